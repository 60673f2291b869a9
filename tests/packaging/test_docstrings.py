"""The docstrings of the public names: each parameter is described, each error that a function raises is named."""

import ast
import dataclasses
import inspect
import re
import textwrap

import pytest

import omniroll


def public_members(thing: type) -> dict[str, object]:
    """Methods and properties that a class has by itself, without what a dataclass makes."""
    members = {}
    for name, member in vars(thing).items():
        if isinstance(member, (classmethod, staticmethod)):
            member = member.__func__
        if isinstance(member, property):
            member = member.fget
        if inspect.isfunction(member) and not name.startswith("_"):
            members[f"{thing.__name__}.{name}"] = member
    return members


def documented() -> dict[str, tuple[object, str]]:
    """Every public function, class and method by name, with the docstrings that speak of its parameters."""
    things = {}
    for name in omniroll.__all__:
        thing = getattr(omniroll, name)
        things[name] = (thing, thing.__doc__ or "")
        if inspect.isclass(thing):
            for member_name, member in public_members(thing).items():
                own = member.__doc__ or inspect.getdoc(getattr(thing, member.__name__)) or ""
                # Arguments that all methods of a class have in common are described in its docstring.
                things[member_name] = (member, own + (thing.__doc__ if thing is omniroll.Kernel else ""))
    return things


THINGS = documented()


def parameters_of(thing: object) -> list[str]:
    if inspect.isclass(thing):
        if dataclasses.is_dataclass(thing):
            return [field.name for field in dataclasses.fields(thing) if field.name != "_"]
        if issubclass(thing, BaseException) or "__init__" not in vars(thing):
            return []
        thing = thing.__init__
    return [name for name in inspect.signature(thing).parameters if name not in ("self", "cls")]


def raised_by(thing: object) -> set[str]:
    """The names of the errors in the `raise` statements of a function, or of a class's own making."""
    if inspect.isclass(thing):
        makers = [vars(thing)[name] for name in ("__init__", "__post_init__") if name in vars(thing)]
        return set().union(*(raised_by(maker) for maker in makers if inspect.getsourcefile(maker)))
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(inspect.unwrap(thing))))
    except (OSError, TypeError):
        return set()
    calls = [node.exc for node in ast.walk(tree) if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call)]
    return {call.func.id for call in calls if isinstance(call.func, ast.Name)}


@pytest.mark.parametrize("name", THINGS)
def test_it_describes_each_parameter_and_names_each_error(name):
    thing, text = THINGS[name]
    assert text.strip() and "{entries}" not in text
    assert [parameter for parameter in parameters_of(thing) if not re.search(rf"\b{parameter}\b", text)] == []
    assert [error for error in raised_by(thing) if error not in text] == []
