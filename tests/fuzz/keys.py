"""Every key of a scene that takes numbers, in a shipped scene that has its table."""

import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from omniroll.kinds import Numbers, Whole
from omniroll.scenes.schema import keys

FOLDER = Path(__file__).resolve().parents[2] / "scenes"
NUMBERS = [(table.name, key) for table, key in keys() if isinstance(key.kind, Numbers | Whole)]
Tables = dict[str, dict[str, Any]]


@cache
def shipped() -> list[Tables]:
    return [tomllib.loads(path.read_text(encoding="utf-8")) for path in sorted(FOLDER.glob("*.toml"))]


def scenes_with(value: Any) -> Iterator[tuple[str, str]]:
    """For each of the keys, in each of its shapes: which it is, and a scene as text that has the value there."""
    for table, key in NUMBERS:
        found = sorted(shipped(), key=lambda tables: (key.name not in tables.get(table, {}), table not in tables))  # noqa: B023 (used at once)
        vehicle = found[0]["vehicle"]
        sizes = {"N": vehicle.get("wheels", 3), "n-1": vehicle.get("rollers_per_wheel", 5) - 1}
        sizes |= {"K": 2, "W": 2, "several": 2}
        for shape in key.kind.shapes if isinstance(key.kind, Numbers) else ((),):
            changed = found[0].get(table, {}) | {key.name: _filled(value, [sizes.get(size, size) for size in shape])}
            yield f"[{table}] {key.name}", written(found[0] | {table: changed})


def _filled(value: Any, shape: list[int]) -> Any:
    return [_filled(value, shape[1:]) for _ in range(shape[0])] if shape else value


def written(tables: Tables) -> str:
    """Tables as TOML."""
    lines = []
    for name, content in tables.items():
        lines += [f"[{name}]", *(f"{key} = {_text(value)}" for key, value in content.items())]
    return "\n".join(lines)


def _text(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_text, value))}]"
    if isinstance(value, bool | str):
        return str(value).lower() if isinstance(value, bool) else f'"{value}"'
    return repr(value)
