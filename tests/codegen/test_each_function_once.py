"""Each generated function stands once, and what is made of it has it as it stands there."""

import re
from collections import defaultdict
from pathlib import Path

import pytest

from omniroll import generated_data
from omniroll.codegen.expressions import symbols
from omniroll.codegen.programs import steps
from omniroll.kernels import sets
from omniroll.kernels.kernel import optional_effects

GENERATED = Path(__file__).resolve().parents[2] / "generated"
IN_C = re.compile(r"^(?P<head>\w[^\n;{}()]*\([^{};]*?\))\n\{\n(?P<body>.*?)^\}\n", re.MULTILINE | re.DOTALL)
LOCAL = re.compile(r"(?:omniroll_real|int|omniroll_\w+) \*?(\w+)(?=[,;)\[]| =)")
SETS = [entry for entry in generated_data.load("kernels")["sets"] if entry.get("base", "parts") != "parts"]
BASES = [base["name"] for base in generated_data.load("programs")["bases"]]


def c_functions(text):
    """{name: (head, body)} of the functions in a C file."""
    return {re.search(r"(\w+)\(", found["head"])[1]: (found["head"], found["body"]) for found in IN_C.finditer(text)}


def without_names(head, body):
    """A C function's text with numbers for the names of its arguments and locals; fields keep theirs."""
    names = dict.fromkeys(LOCAL.findall(head) + LOCAL.findall(body))
    numbers = {name: f"_{place}" for place, name in enumerate(names)}
    renamed = re.sub(r"(?<![\w.>])\w+", lambda word: numbers.get(word[0], word[0]), body)
    return " ".join(renamed.split())


def twice(entries):
    """The groups of more than one name that share a text, from pairs of both."""
    groups = defaultdict(list)
    for name, text in entries:
        groups[text].append(name)
    return [group for group in groups.values() if len(group) > 1]


def test_no_function_twice_in_c():
    files = {path.name: c_functions(path.read_text(encoding="utf-8")) for path in (GENERATED / "c").glob("*.c")}
    bodies = [(f"{file}: {name}", without_names(*text)) for file, own in files.items() for name, text in own.items()]
    assert len(bodies) > 50, "the functions of generated/c were not found"
    assert twice(bodies) == []


@pytest.mark.long
@pytest.mark.parametrize("entry", SETS, ids=[entry["name"] for entry in SETS])
def test_a_pair_has_the_functions_of_generated_c_verbatim(entry):
    base, effects = entry["base"], tuple(entry["effects"])
    everywhere = "".join(path.read_text(encoding="utf-8") for path in (GENERATED / "c").glob("*.c"))
    pair = c_functions((sets.c_folder(base, effects) / "omniroll.c").read_text(encoding="utf-8"))
    names = [f["name"] for f in sets.functions(base, effects)]
    assert len(names) > 10
    for name in names:
        head, body = pair["omniroll_" + {"prepare": "constants"}.get(name, name)]
        assert f"{head.removeprefix('static ')}\n{{\n{body}}}\n" in everywhere, name


@pytest.mark.parametrize("base", BASES)
def test_every_field_of_a_model_is_read(base):
    """Without effects, with each alone and with all together: no function computes what none reads."""
    every = optional_effects()
    for wanted in [(), *(("drive", "motor") if effect == "motor" else (effect,) for effect in every), every]:
        kernel = sets.programs().kernel(base, wanted).effects
        read = set().union(*(symbols_read(f) for f in kernel.functions if not f.prepares))
        assert not {field.name for field in kernel.fields} - read, wanted


def symbols_read(function):
    """The symbols of a function's expressions that it does not make itself."""
    made = {step.name for step in steps(function.body) if step.kind in ("let", "var")}
    expressions = [step.expression for step in steps(function.body) if step.expression is not None]
    return set().union(*map(symbols, expressions)) - made
