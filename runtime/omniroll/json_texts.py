"""JSON that others may have written: an object is read, or a ValueError says what the text is instead."""

import json
from typing import Any


def read_object(text: str) -> dict[str, Any]:
    """The JSON object that a text is. Raises ValueError for any other text, one that is nested too deep included."""
    try:
        found = json.loads(text)
    except RecursionError:
        raise ValueError("lists or objects stand too deep inside each other") from None
    if not isinstance(found, dict):
        raise ValueError(f"it is a JSON {type(found).__name__}, not an object")
    return found


def part(found: dict[str, Any], name: str, kind: type, default: Any = None) -> Any:
    """What an object has under a name, of a kind; `default` where it has nothing there. Raises ValueError for another
    kind, and for what is missing and has no default."""
    value = found.get(name)
    if value is None and default is not None:
        return default
    if not isinstance(value, kind):
        shown = "missing" if value is None else f"of the type {type(value).__name__}"
        raise ValueError(f"{name!r} is {shown}, not {kind.__name__}")
    return value
