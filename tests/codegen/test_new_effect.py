"""A new effect adds files of its own to what is generated, and changes nothing of the other sets."""

import copy
from pathlib import Path

import pytest
from toy import array, derivation

from codegen.derivation import Derivation
from codegen.maxima import Maxima, MaximaError
from codegen.programs import steps
from codegen.rendering import render

MACHINERY = Path(__file__).resolve().parents[2] / "maxima/machinery"
OWN = {"c/toy_wind.c", "python/toy_wind.py", "data/kernels/toy_wind.json"}
NAMING = {"data/programs.json", "data/effects.json", "data/arguments.json"}  # its steps, itself, its argument


def with_wind():
    """The toy's data with one more effect, which pushes, and its set."""
    data = copy.deepcopy(derivation())
    data["effects"].append({"name": "wind", "meaning": "a wind", "optional": True, "neutral": {"push": 0}, "needs": []})
    data["sets"].insert(1, {"base": "toy", "effects": ["wind"], "meaning": "a toy in a wind"})
    data["steps"]["wind"] = {
        "source": "effects/wind.mac",
        "proofs": [],
        "body": [{"let": "gust", "expr": ["*", "push", "nu_1"]}, {"add": "f", "expr": ["*", "gust", "l"]}],
    }
    dynamics = next(f for f in data["functions"] if f["name"] == "forward_dynamics")
    data["arguments"] |= array("push", [])
    data["arguments"]["push"]["effect"] = "wind"
    dynamics["inputs"].insert(2, "push")
    loop = next(k for k, node in enumerate(dynamics["body"]) if "loop" in node)
    dynamics["body"].insert(loop, {"use": "wind"})
    return data


@pytest.mark.long
def test_what_a_new_effect_changes():
    before, after = render(Derivation(derivation())), render(Derivation(with_wind()))
    assert after.keys() - before.keys() == OWN
    assert {path for path in before if after[path] != before[path]} == NAMING
    own = after["c/toy_wind.c"].decode()
    assert "Steps: wind (maxima/effects/wind.mac)" in own
    assert own.count("void omniroll_") == 1, "only what the effect changes"
    assert b"gust" not in after["c/toy.c"] + after["python/toy.py"]


def test_an_effect_after_the_programs_that_are_made_of_what_it_brings_is_refused(tmp_path):
    load = "".join(f'load("{MACHINERY / name}.mac")$ ' for name in ("claims", "steps", "effects"))
    closed = "closed_kinds: ['force_steps]$ brings(\"wind\", 'constants, [])$ "
    (tmp_path / "late.mac").write_text(load + closed + 'brings("wind", \'force_steps, [])$')
    with pytest.raises(MaximaError, match="wind brings force_steps.*stand before effects/derivatives_by_numbers"):
        Maxima.find(lambda line: None).derive(tmp_path / "late.mac", tmp_path / "out", lambda line: None)


def test_what_stands_in_the_place_of_an_absent_effect_is_there():
    """A step that nothing else reads while the effect is there."""
    data = with_wind()
    data["effects"][-1]["neutral"]["gust"] = "calm"
    data["steps"]["wind"]["body"].insert(0, {"let": "calm", "expr": ["*", 2, "nu_2"]})
    without, beside = ({step.name for step in steps(found.function("forward_dynamics").body)}
                       for found in Derivation(data).sets if found.name in ("toy", "toy_wind"))  # fmt: skip
    assert "calm" in without and "gust" not in without
    assert "gust" in beside and "calm" not in beside
