"""The one table of numbers: classes, functions, scene schema, C headers and page say what it says."""

import dataclasses
import inspect
import re
from pathlib import Path

import numpy as np
import pytest

import omniroll
from omniroll import InvalidValueError, vocabulary
from omniroll.kernels import sets
from omniroll.kinds import Choice, Flags, Names, Numbers, Tables, Whole, Word
from omniroll.scenes.page import page
from omniroll.scenes.schema import keys
from omniroll.vocabulary import Entry

ROOT = Path(__file__).parents[2]
CLASSES = (
    omniroll.Vehicle, omniroll.Torque, omniroll.TorqueTable, omniroll.Motor, omniroll.Controller, omniroll.Bearings,
    omniroll.Slope, omniroll.FunctionController, omniroll.PathFollower,
)  # fmt: skip
FUNCTIONS = (omniroll.simulate, omniroll.simulate_many, omniroll.reactions, omniroll.Vehicle.from_parts)
TABLES = {
    name: table if isinstance(table, tuple) else (table,)
    for name, table in vars(vocabulary).items()
    if isinstance(table, Entry) or (isinstance(table, tuple) and table and isinstance(table[0], Entry))
}
PARTS = (ROOT / "generated/python/parts.py").read_text(encoding="utf-8")


def plain(text: str) -> str:
    return " ".join(text.split())


def described(thing) -> dict[str, str]:
    """What the docstring of a class or function says of each name at the start of a line."""
    found, name = {}, None
    for line in inspect.cleandoc(thing.__doc__).splitlines():
        if line and (start := re.match(r"(\w+) {2,}(\S.*)", line)):
            name = start[1]
            found[name] = start[2]
        elif line.startswith("  ") and name:
            found[name] += " " + line.strip()
        else:
            name = None
    return found


@pytest.mark.parametrize("thing", CLASSES, ids=lambda thing: thing.__name__)
def test_classes_say_what_the_table_says(thing):
    """Every field is described with the unit and the meaning that an entry of its name has."""
    entries = [entry for table in TABLES.values() for entry in table]
    said = described(thing)
    for field in dataclasses.fields(thing):
        if field.name not in ("_", "origins"):
            about = [
                f"{e.meaning}, in {e.unit}" if len(e.unit) > 1 else e.meaning for e in entries if e.name == field.name
            ]
            assert any(said[field.name].startswith(text) for text in about), field.name


@pytest.mark.parametrize("thing", FUNCTIONS, ids=lambda thing: thing.__name__)
def test_functions_describe_every_argument(thing):
    assert {name for name in inspect.signature(thing).parameters} - {"cls"} <= set(described(thing))


def test_a_name_means_one_thing():
    """Entries of one name differ in the values that they allow, in defaults and notes, not in unit and meaning."""
    about: dict[tuple, tuple] = {}
    apart = {"times"}  # of the rows of several tables
    for entry in (entry for table in TABLES.values() for entry in table):
        if entry.name not in apart:
            assert about.setdefault(entry.name, (entry.unit, entry.meaning)) == (entry.unit, entry.meaning)


def test_the_schema_takes_its_keys_from_the_table():
    known = {(e.unit, e.meaning) for table in TABLES.values() for e in table}
    of_scenes = {"preset", "step", "times", "platform_disk_radius", "hub_radius", "hub_width", "roller_radius",
                 "roller_length", "log", "log_columns", "twist", "wheel_rate", "handedness"}  # fmt: skip
    assert {key.name for _, key in keys() if (key.unit, key.meaning) not in known} <= of_scenes


def test_the_page_is_written_from_the_schema():
    """Where this fails: python -m omniroll.scenes.page docs/scenes.md"""
    text = (ROOT / "docs/scenes.md").read_text(encoding="utf-8")
    assert page(text) == text


def test_the_c_headers_say_what_the_table_says():
    """Where a header describes an argument of the vehicle, its parts or its drives: unit and meaning."""
    made = (("free", ()), ("free", ("drive", "motor")))
    headers = " ".join(sets.programs().kernel(*one).pair().header for one in made)
    text = plain(f"{headers} {PARTS}".replace("\n *", " "))
    text = re.sub(
        r" \*?(\w+); /\* (?:\[\w+\] )?([^;:]+?): ", r" \1 [\2]: ", text
    )  # a field of a struct like an argument
    checked = set()
    for entry in (*vocabulary.VEHICLE, *vocabulary.PARTS, *vocabulary.STATE, vocabulary.TORQUE):
        for unit, rest in re.findall(rf" {entry.name}(?:\[[\w-]+\])* \[([^]]+)\][:,] (.{{200}})", text):
            checked.add(entry.name)
            assert unit == entry.unit
            assert rest.startswith(entry.meaning.split(", ", 1)[-1]) or rest.startswith(entry.meaning)
    names = {entry.name for entry in (*vocabulary.INERTIAS, *vocabulary.LENGTHS, *vocabulary.PARTS)}
    assert names | {"nu", "chi", "spins", "torque", "wheel_angles", "yaw_scale"} <= checked


@pytest.mark.parametrize("table", TABLES)
def test_entries_are_whole(table):
    for entry in TABLES[table]:
        assert isinstance(entry.kind, (Choice, Flags, Names, Numbers, Tables, Whole, Word)) and entry.meaning
        assert bool(entry.unit) == isinstance(entry.kind, Numbers)
        assert not (entry.needed and entry.default)


@pytest.mark.parametrize("kind, good, bad", [
    (Numbers(above=0), [1, 2.5, np.float64(3)], [0, -1, 1e-200, 1e200, "1", None, [1.0], np.nan]),
    (Numbers(least=0), [0, 1], [-1, -1e-300, np.inf]),
    (Numbers(above=0, below=1), [0.5], [0, 1]),
    (Numbers(shapes=((), ("N",)), least=0), [0, [1, 2], (1.0,)], [[[1.0]], [], [1, -1]]),
    (Numbers(shapes=(("N", 2),)), [[[1, 2]], np.ones((3, 2))], [[1, 2], np.ones((2, 3)), 1.0]),
    (Numbers(shapes=((3,),)), [(1, 2, 3)], [(1, 2), 1]),
    (Numbers(shapes=(("K",),), increasing=True), [[0], [0, 1]], [[1, 1], [1, 0], 1.0]),
    (Whole(3), [3, np.int64(5)], [2, 3.0, True, "3"]),
    (Whole(1, 4), [4], [5]),
    (Choice(("a", "b")), ["a"], ["c", 1, None]),
])  # fmt: skip
def test_values_are_checked(kind, good, bad):
    for value in good:
        kept = kind.checked("name", value)
        assert np.array_equal(kept, value) and not isinstance(kept, (list, np.ndarray))
    for value in bad:
        with pytest.raises(InvalidValueError) as refused:
            kind.checked("name", value)
        assert refused.value.field == "name"
