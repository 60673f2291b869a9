"""A scene to start from, written from the schema: every table and key with its unit, values, default and meaning."""

import textwrap
import tomllib
from collections.abc import Iterator, Mapping

from omniroll.kinds import Choice, Word
from omniroll.robots.wheels import wheel_numbers
from omniroll.scenes.page import WAYS
from omniroll.scenes.schema import SCENE, Table
from omniroll.vocabulary import Entry

GIVEN = {  # what the scene says; all the rest is a comment
    ("vehicle", "preset"): '"paper"',
    ("start", "nu"): "[1.0, 0.0, 1.0]",
    ("run", "duration"): "10.0",
    ("run", "step"): "0.02",
    ("rollers", "model"): '"free"',
    ("switching", "law"): '"impact"',
}
HEAD = """\
# A scene: what is simulated, and what is wanted back. Run it, look at it, or ask what it leaves out:
#     omniroll run {name} --plot
#     omniroll run {name} --view
#     omniroll explain {name}
# Units are SI. N is the number of wheels, n of rollers per wheel. A table without "#" is on; a line that begins with
# "# " and a key is there to be switched on, with its default where it has one.
"""
WIDTH, COLUMN = 116, 34


def template(name: str, wheel: str | None = None) -> str:
    """The text of a scene file.

    name   of the file, for the commands in its first lines
    wheel  one of omniroll.robots.wheels.WHEEL_NAMES whose wheels are assumed; None: those of the paper

    Raises InvalidValueError for a wheel that is not in the catalogue.
    """
    of_wheel = {} if wheel is None else _of_wheel(wheel)
    return "\n".join([HEAD.format(name=name), *(_table(table, of_wheel, wheel) for table in SCENE)])


def _of_wheel(name: str) -> dict[tuple[str, str], str]:
    """The numbers of the wheels of a robot, or of one on sale, as a scene says them."""
    return {("vehicle", key): repr(value) for key, value in wheel_numbers(name).items()}


def _table(table: Table, of_wheel: Mapping[tuple[str, str], str], wheel: str | None) -> str:
    is_on = any(place[0] == table.name for place in GIVEN)
    mark = "" if is_on else "# "
    lines = [*_comment(_plain(table.meaning), "## "), f"{mark}[{table.name}]"]
    for title, keys in WAYS if table.name == "vehicle" else ((None, table.keys),):
        lines += [f"## {title}"] if title else []
        for key in keys:
            assumed = of_wheel.get((table.name, key.name))
            lines += [f"## Assumed: {key.name} of the wheels of {wheel}"] if assumed else []
            lines += _key(table, key, assumed or GIVEN.get((table.name, key.name)))
    return "\n".join(lines) + "\n"


def _key(table: Table, key: Entry, given: str | None) -> Iterator[str]:
    """A key with what it means behind it, in as many lines as that needs."""
    value = given or _default(key)
    start = f"{'' if given else '# '}{key.name} = {value}".rstrip()
    about = _about(key, value != _default(key) or not value)
    first, *rest = textwrap.wrap(about, WIDTH - COLUMN, break_long_words=False, break_on_hyphens=False)
    yield f"{start:<{COLUMN - 4}} ## {first}" if len(start) < COLUMN - 3 else f"{start} ## {first}"
    yield from (" " * (COLUMN - 3) + f"## {line}" for line in rest)


def _about(key: Entry, with_default: bool) -> str:
    unit = f"{key.unit}: " if key.unit not in ("", "1") else ""
    default = f"; default: {key.default}" if with_default and key.default else ""
    needed = "; needed" if key.needed else ""
    return _plain(f"{unit}{key.meaning} ({key.kind.shown()}{default}{needed})") + (f". {key.note}" if key.note else "")


def _default(key: Entry) -> str:
    """The default as TOML, where it is a value; otherwise nothing."""
    if isinstance(key.kind, (Choice, Word)):
        return f'"{key.default}"' if key.kind.complaint(key.default, {}) is None else ""
    text = key.default.replace("(", "[").replace(")", "]")
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return ""
    return text if key.kind.complaint(value, {}) is None else ""


def _plain(text: str) -> str:
    """Without the marks of Markdown."""
    return text.replace("`", "")


def _comment(text: str, mark: str) -> list[str]:
    return textwrap.wrap(text, WIDTH, initial_indent=mark, subsequent_indent=mark, break_on_hyphens=False)
