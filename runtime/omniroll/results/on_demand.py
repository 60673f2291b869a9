"""Values that are made when they are first read: what nobody reads costs nothing."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

Maker = Callable[[], Any]


class OnDemand:
    """A field of a frozen dataclass whose value comes from the object's `made`, a mapping of fields to functions.

    The value is kept; arrays cannot be written.
    """

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __get__(self, instance: Any, owner: type | None = None) -> Any:
        if instance is None:
            return self
        value = instance.made[self.name]()
        if isinstance(value, np.ndarray):
            value.flags.writeable = False
        instance.__dict__[self.name] = value
        return value


class MadeOnDemand:
    """A base for dataclasses with such fields."""

    made: Mapping[str, Maker]

    def __getstate__(self) -> dict[str, Any]:
        """For pickle: with the values of all fields in the place of the functions that make them."""
        values = {name: getattr(self, name) for name in self.made}
        return vars(self) | values | {"made": {}}


class Stats(dict):
    """Figures of a run by name; those in `made` are computed when they are first read."""

    def __init__(self, known: Mapping[str, Any], made: Mapping[str, Maker] | None = None):
        super().__init__(known)
        self.made = dict(made or {})

    def __missing__(self, name: str) -> Any:
        value = self[name] = self.made.pop(name)()
        return value

    def __contains__(self, name: object) -> bool:
        return super().__contains__(name) or name in self.made

    def make_on_demand(self, name: str, maker: Maker) -> None:
        """The figure `name` is what `maker` gives when it is first read."""
        self.pop(name, None)
        self.made[name] = maker

    def get(self, name: str, default: Any = None) -> Any:
        return self[name] if name in self else default

    def complete(self) -> dict[str, Any]:
        """All figures, as a plain dict."""
        for name in list(self.made):
            self[name]  # noqa: B018
        return dict(self)

    def known(self) -> dict[str, Any]:
        """The figures that have been computed, as a plain dict; the others are None."""
        return dict.fromkeys(self.made) | dict(self)

    def __reduce__(self) -> tuple:
        return Stats, (self.complete(),)
