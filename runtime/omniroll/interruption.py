"""Signals that end a run in good order: the first one is a wish, the second one acts as it would have without this."""

import signal
import threading
from types import FrameType
from typing import Any

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interruption:
    """Takes note of SIGINT and SIGTERM, for `with`; in a thread beside the main one, which gets none, it does nothing.

    number  of the signal that came, or None
    """

    def __init__(self) -> None:
        self.number: int | None = None
        self.before: dict[int, Any] = {}

    def __enter__(self) -> "Interruption":
        if threading.current_thread() is threading.main_thread():
            self.before = {number: signal.signal(number, self._note) for number in SIGNALS}
        return self

    def __exit__(self, *_: Any) -> None:
        for number, handler in self.before.items():
            signal.signal(number, handler)
        self.before = {}

    def _note(self, number: int, frame: FrameType | None) -> None:
        self.number = number
        self.__exit__()

    def __call__(self) -> str:
        """What is to be said of the signal that came, or ""."""
        return "" if self.number is None else f"interrupted by {signal.Signals(self.number).name}"

    @property
    def exit_code(self) -> int:
        """As a shell has it: 128 and the signal's number."""
        return 128 + (self.number or 0)
