"""The names under which files keep effects. An effect of one's own gets its name from register_effect."""

from collections.abc import Callable
from typing import Any, TypeVar

from omniroll.errors import InvalidValueError

Kind = TypeVar("Kind", bound=type)
Named = TypeVar("Named")

KINDS: dict[str, type] = {}  # the classes of effects, by the names that files keep


def register_effect(name: str) -> Callable[[Kind], Kind]:
    """A decorator that registers a class of effects, a dataclass whose fields are plain data.

    name  str, by which saved trajectories name it

    The same class may be registered again, for instance where a module is loaded anew. Raises InvalidValueError for a
    name that is empty or another class's, and for what is no class.
    """
    check_name(name)

    def register(kind: Kind) -> Kind:
        if not isinstance(kind, type) or not hasattr(kind, "__dataclass_fields__"):
            raise InvalidValueError("kind", kind, "must be a dataclass, whose fields a file can keep")
        return keep_named(KINDS, name, kind)

    return register


def check_name(name: object) -> None:
    """Raises InvalidValueError for what cannot be a name."""
    if not isinstance(name, str) or not name:
        raise InvalidValueError("name", name, "must be a text that is not empty")


def keep_named(registry: dict[str, Named], name: str, named: Named) -> Named:
    """Register a class or a function. Raises InvalidValueError for a name that is another's."""
    there = registry.get(name)
    if there is not None and origin_of(there) != origin_of(named):
        raise InvalidValueError("name", name, f"is registered for {origin_of(there)} already")
    registry[name] = named
    return named


def origin_of(named: Any) -> str:
    """Module and name of a class or a function; of another object those of its class."""
    return f"{named.__module__}.{getattr(named, '__qualname__', type(named).__qualname__)}"


def name_of(kind: type) -> str:
    """The name of a class of effects. Raises InvalidValueError where it has none."""
    for name, registered in KINDS.items():
        if registered is kind:
            return name
    bound = "has no name that a file could keep; register its class with omniroll.register_effect"
    raise InvalidValueError("effects", kind.__name__, bound)


def kind_of(name: str) -> type:
    """The class of effects with this name. Raises InvalidValueError where there is none."""
    if name not in KINDS:
        bound = "is not the name of a registered effect; first import the module that registers it with "
        raise InvalidValueError("effects", name, bound + "omniroll.register_effect")
    return KINDS[name]
