"""One caller at a time, for `with`: a second one is refused, from another thread or from a function that the first one
calls. It would find numbers that are being changed."""

import threading
from typing import Any

from omniroll.errors import OmnirollError


class Alone:
    """what  is used by one caller at a time, with its article"""

    def __init__(self, what: str):
        self.what, self.lock = what, threading.Lock()

    def __enter__(self) -> None:
        if not self.lock.acquire(blocking=False):
            raise self.refusal()

    def __exit__(self, *_: Any) -> None:
        self.lock.release()

    def refusal(self) -> OmnirollError:
        return OmnirollError(f"{self.what} belongs to one thread, and a call of it has not ended yet")
