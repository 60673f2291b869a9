"""Scenes in which one value is wrong, or a few are: a scene as TOML, mutated by number."""

import re
import warnings
from pathlib import Path

import numpy as np

import omniroll
from omniroll.errors import OmnirollError
from omniroll.scenes.schema import SCENE

FOLDER = Path(__file__).resolve().parents[2] / "scenes"
NAMES = (
    "motion-3",
    "motion-1",
    "robot-soccer-kit",
    "robot-soccer-kit",
    "driven",
    "tracked",
    "ramp-lets-go",
)
ACTING = ("[drive]", "[controller]", "[contact]")
PARTS = [key.name for table in SCENE for key in table.keys]
VALUES = (
    "0", "-1", "1", "3", "0.5", "1e-320", "1e200", "1e308", "nan", "inf", "-inf", "99999999999999999999999", "1_0",
    "true", "false", '""', '"one"', '"free"', '"\\u0000"', "[]", "[1]", "[1, 2]", "[1, 2, 3]", "[1, [2, 3]]",
    "[[1, 2, 3], [1, 2]]", "[[], []]", "[nan, 0, 0]", "[1e308, 1, 1]", "{}", "{a = 1}", "2026-01-01",
    "2026-01-01T00:00:00Z", "07:32:00", "[true, false, true]", '["a", "b", "c"]', "[120, 240, 360]", "-0.0",
    "[[1, 2, 3], [4, 5, 6]]", "[0.0, 0.5]", "[0.5, 0.0]", "0x7fffffffffffffffffff", "1e-9", "90",
)  # fmt: skip
GARBAGE = ("[", "]]", "=", "a = ", "[[run]]", "[vehicle]", "\x00", "é = 1", "# x", '"""', "a.b.c = 1", "[run.x]")
DECIMAL = re.compile(r"(?<![\w.])\d+\.\d*(?:e-?\d+)?(?![\w.])")
MILD = 0.7  # of the scenes: their numbers are other ones and no wild ones
LONGEST = 0.02  # s of a motion that is run
MEMORY = 1e6  # bytes: a motion of very many switches or stiff steps is stopped


def mutated(seed: int, compiled: bool = False) -> str:
    """A scene as text with one to three changes. Effects run on the Python engine, unless they are to be compiled."""
    rng = np.random.default_rng([7, seed])
    text = (FOLDER / f"{NAMES[rng.integers(len(NAMES))]}.toml").read_text(encoding="utf-8")
    if not compiled and any(table in text for table in ACTING):  # no kernel is compiled for a mutation
        text = text.replace("[run]", "[run]\nengine = 'python'")
    lines = text.splitlines()
    if rng.random() < MILD:
        return "\n".join(scaled(lines, rng))
    for _ in range(rng.integers(1, 4)):
        place, kind = rng.integers(len(lines)), rng.integers(6)
        name, equals, _ = lines[place].partition("=")
        if kind <= 2 and equals:
            lines[place] = f"{name}= {VALUES[rng.integers(len(VALUES))]}"
        elif kind == 3:
            lines.insert(place, f"{PARTS[rng.integers(len(PARTS))]} = {VALUES[rng.integers(len(VALUES))]}")
        elif kind == 4:
            lines[place] = "" if rng.random() < 0.7 else GARBAGE[rng.integers(len(GARBAGE))]
        else:
            cut = rng.integers(len(lines[place]) + 1)
            lines[place] = lines[place][:cut]
    return "\n".join(lines)


def scaled(lines: list[str], rng: np.random.Generator) -> list[str]:
    """With up to three numbers that are no whole ones made smaller or larger by up to ten: most such scenes run."""
    places = [k for k, line in enumerate(lines) if DECIMAL.search(line.partition("#")[0])]
    for place in rng.choice(places, size=min(len(places), rng.integers(1, 4)), replace=False):
        given, _, note = lines[place].partition("#")
        factor = 10 ** rng.uniform(-1, 1)
        given = DECIMAL.sub(lambda number, by=factor: repr(float(number[0]) * by), given)
        lines[place] = given + (f"#{note}" if note else "")
    return lines


def try_scene(seed: int, folder: Path, *, with_effects: bool, compiled: bool = False) -> str:
    """Read the scene of this number, and run it shortly where it is good; what came of it in a word."""
    path = folder / f"fuzzed-{seed}.toml"
    text = mutated(seed, compiled)
    path.write_text(text, encoding="utf-8")
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            scene = omniroll.load_scene(path)
            if "effects" in scene.options and not with_effects:
                return "read"
            duration = min(LONGEST, scene.options["duration"])
            made = omniroll.run(scene, duration=duration, memory=MEMORY, control=False)
    except OmnirollError as error:
        assert str(error) and all(len(line) < 1000 for line in str(error).splitlines())
        return "refused"
    except Exception as error:
        raise AssertionError(f"scene {seed}: {type(error).__name__}: {error}\n{text}") from error
    finally:
        path.unlink()
    for array in (made.t, made.nu, made.chi, made.pose, made.energy):
        assert np.isfinite(array).all(), f"scene {seed}"
    return "done"
