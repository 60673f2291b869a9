"""Reactions are there on request only, and add nothing to what simulates."""

import re
from functools import cache

import pytest

from omniroll import generated_data
from omniroll.kernels import sets

MODELS = ("massless", "locked", "free")
REACTIONS = ("contact_forces", "contact_impulses", "load_balance")
LISTED = [effect for effect in generated_data.load("effects")["effects"] if effect["neutral"]]
# Loads from springs share the numbers of the loads' balance.
OTHERS = tuple(
    e["name"] for e in LISTED
    if "reactions" not in (e["name"], *e["needs"], *e["excludes"]) and e["table"] != "springs"
)  # fmt: skip


@cache
def made(base, effects):
    return sets.programs().kernel(base, effects)


def bodies(texts):
    """{name: text} of the Python functions of a set."""
    parts = re.split(r"^def (\w+)", texts.python, flags=re.MULTILINE)[1:]
    return {name: text.strip() for name, text in zip(parts[::2], parts[1::2], strict=True)}


@pytest.mark.parametrize("base", MODELS)
@pytest.mark.parametrize("others", [(), OTHERS], ids=["alone", "with all"])
def test_every_other_function_stays_as_it_is(base, others):
    plain, asked = bodies(made(base, others)), bodies(made(base, (*others, "reactions")))
    extra = asked.keys() - plain.keys()
    assert extra >= set(REACTIONS) and extra <= {*REACTIONS, "coulomb_momenta", "bearing_momenta"}
    assert all(asked[name] == text for name, text in plain.items())


@pytest.mark.parametrize("base", MODELS)
def test_without_them_no_symbol_of_theirs_is_left(base):
    (own,) = (effect["neutral"] for effect in LISTED if effect["name"] == "reactions")
    texts = made(base, OTHERS)
    for text in (texts.python, texts.pair().source, texts.pair().header):
        assert not set(own) & set(re.findall(r"\w+", text))
