"""Methods whose results are kept."""

from collections.abc import Callable
from functools import cached_property, lru_cache, partial
from typing import Any

LAST = 8  # results of a method


def kept(method: Callable) -> Any:
    """Decorates a method: the results of the last calls are kept with the object, by their arguments.

    They must depend on nothing that changes, and those who get them must not change them. Arguments must be hashable.
    """
    found = cached_property(lambda instance: lru_cache(maxsize=LAST)(partial(method, instance)))
    found.__doc__ = method.__doc__
    return found
