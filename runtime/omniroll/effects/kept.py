"""Methods whose results are kept."""

from collections.abc import Callable
from functools import lru_cache, partial
from typing import Any

LAST = 8  # results of a method


class kept:
    """Decorates a method: the results of the last calls are kept with the object, by their arguments.

    They must depend on nothing that changes, and those who get them must not change them. Arguments must be hashable.
    """

    def __init__(self, method: Callable):
        self.method = method
        self.__doc__ = method.__doc__

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __get__(self, instance: Any, owner: type | None = None) -> Any:
        if instance is None:
            return self
        found = instance.__dict__[self.name] = lru_cache(maxsize=LAST)(partial(self.method, instance))
        return found
