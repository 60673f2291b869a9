"""One number or choice that is allowed and yet looks wrong."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Lint:
    """Something that looks wrong: where, and why."""

    table: str
    key: str
    text: str

    def __str__(self) -> str:
        return f"[{self.table}] {self.key}: {self.text}"
