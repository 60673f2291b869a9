"""Scenes with up to three changes: a shipped scene as text, mutated by number, with tables that it did not have."""

import re
import shutil
import warnings
from pathlib import Path

import numpy as np

import omniroll
from omniroll.errors import OmnirollError, SimulationStopped
from omniroll.scenes.schema import SCENE

FOLDER = Path(__file__).resolve().parents[2] / "scenes"
SHIPPED = sorted(FOLDER.glob("*.toml"))
PARTS = [key.name for table in SCENE for key in table.keys]
ADDED = (
    "[slope]\nangle = 0.05\ndirection = 0.7",
    "[bearings]\nwheel_coulomb = 0.004\nroller_viscous = 1e-6",
    "[bearings]\nwheel_coulomb = 1e-3\nwheel_speed = 0.5\nwheel_viscous = 2e-4\n"
    "roller_coulomb = 1e-5\nroller_speed = 0.5",
    "[bearings]\nwheel_coulomb = 0.001\nroller_coulomb = 1e-5\nroller_break_away = 1.5e-5",
    "[contact]\ncoefficient = 50.0",
    '[contact]\nlaw = "regularised"\nfriction = 0.4\nspeed = 0.01\nnormal_gravity = 9.8',
    '[contact]\nlaw = "coulomb"\nfriction = 0.1\nstatic_friction = 0.15\nnormal_gravity = 9.8',
    '[contact]\nlaw = "coulomb"\nfriction = 0.5\nnormal_gravity = 9.80665\n[springs]\nheight = 0.06\ndeflection = 5e-4',
    '[contact]\nlaw = "regularised"\nfriction = 0.5\nspeed = 0.02\nnormal_gravity = 9.80665\n[springs]\nheight = 0.06',
    "[layout]\ncenter_of_mass = [0.004, -0.008]",
    "[drive]\ntorque = 0.02",
    "[measurements]\ntracking_places = [[0.0, 0.1], [0.1, 0.0]]\ntracking_directions = [0.0, 1.5]\n"
    "tracking_radius = 0.02",
    "[reactions]\nheight = 0.05\nfriction = 0.5",
)
PRESETS = ("paper", "robot-soccer-kit", "open-base", "tigers-2020", "youbot", "robomaster-hero", "mecanum-trio")
CHOSEN = {
    r'(model = )"\w+"': ("free", "massless", "locked"),
    '(law = )"impact"': ("smooth",),
    r'(preset = )"[\w-]+"': PRESETS,
}
VALUES = (
    "0", "-1", "1", "3", "0.5", "1e-320", "1e200", "1e308", "nan", "inf", "-inf", "99999999999999999999999", "1_0",
    "true", "false", '""', '"one"', '"free"', '"\\u0000"', "[]", "[1]", "[1, 2]", "[1, 2, 3]", "[1, [2, 3]]",
    "[[1, 2, 3], [1, 2]]", "[[], []]", "[nan, 0, 0]", "[1e308, 1, 1]", "{}", "{a = 1}", "2026-01-01",
    "2026-01-01T00:00:00Z", "07:32:00", "[true, false, true]", '["a", "b", "c"]', "[120, 240, 360]", "-0.0",
    "[[1, 2, 3], [4, 5, 6]]", "[0.0, 0.5]", "[0.5, 0.0]", "0x7fffffffffffffffffff", "1e-9", "90",
)  # fmt: skip
GARBAGE = ("[", "]]", "=", "a = ", "[[run]]", "[vehicle]", "\x00", "é = 1", "# x", '"""', "a.b.c = 1", "[run.x]")
DECIMAL = re.compile(r"(?<![\w.])\d+\.\d*(?:e-?\d+)?(?![\w.])")
MILD = 0.8  # of the scenes: their numbers are other ones and no wild ones
OTHER_KIND, PYTHON = 0.4, 0.1  # of the scenes: have another table, another word; run on the Python engine
LONGEST = 0.05  # s of a motion that is run
MEMORY = 1e8  # bytes


def mutated(seed: int) -> str:
    """A scene as text with one to three changes."""
    rng = np.random.default_rng([7, seed])
    text = SHIPPED[rng.integers(len(SHIPPED))].read_text(encoding="utf-8")
    lines = of_another_kind(text, rng).splitlines()
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


def of_another_kind(text: str, rng: np.random.Generator) -> str:
    """With a table that it did not have, with another model, law or vehicle, and on the other engine, by turns."""
    added = ADDED[rng.integers(len(ADDED))]
    if rng.random() < OTHER_KIND and not any(table in text for table in re.findall(r"\[\w+\]", added)):
        text += f"\n{added}\n"
    if "[measurements]" in text and "step =" not in text:
        text = text.replace("[run]", "[run]\nstep = 0.01")
    for pattern, words in CHOSEN.items():
        if rng.random() < OTHER_KIND / 2:
            text = re.sub(pattern, rf'\1"{words[rng.integers(len(words))]}"', text, count=1)
    steps_in_time = "[contact]" in text or "_coulomb" in text  # which takes the Python engine minutes at 1e-7
    to_python = rng.random() < PYTHON and not steps_in_time
    return text.replace("[run]", '[run]\nengine = "python"') if to_python else text


def scaled(lines: list[str], rng: np.random.Generator) -> list[str]:
    """With up to three numbers that are no whole ones made smaller or larger by up to ten: most such scenes run."""
    places = [k for k, line in enumerate(lines) if DECIMAL.search(line.partition("#")[0])]
    for place in rng.choice(places, size=min(len(places), rng.integers(1, 4)), replace=False):
        given, _, note = lines[place].partition("#")
        factor = 10 ** rng.uniform(-1, 1)
        given = DECIMAL.sub(lambda number, by=factor: repr(float(number[0]) * by), given)
        lines[place] = given + (f"#{note}" if note else "")
    return lines


def try_scene(seed: int, folder: Path) -> str:
    """Read the scene of this number, and run it shortly where it is good; what came of it in a word."""
    path = folder / f"fuzzed-{seed}.toml"
    text = mutated(seed)
    path.write_text(text, encoding="utf-8")
    shutil.copy(FOLDER / "commands.csv", folder)
    word = "done"
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            scene = omniroll.load_scene(path)
            try:
                duration = min(LONGEST, scene.options["duration"])
                made = omniroll.run(scene, duration=duration, memory=MEMORY, control=False)
            except SimulationStopped as stopped:
                made, word = stopped.trajectory, "stopped"
            instruments = scene.instruments()
            read = made.measure(made.t[[0, -1]], instruments) if instruments else {}
    except OmnirollError as error:
        assert str(error) and all(len(line) < 1000 for line in str(error).splitlines())
        return "refused"
    except Exception as error:
        raise AssertionError(f"scene {seed}: {type(error).__name__}: {error}\n{text}") from error
    finally:
        path.unlink()
    for array in (made.t, made.nu, made.chi, made.pose, made.energy, *read.values()):
        assert np.isfinite(array).all(), f"scene {seed}: not finite\n{text}"
    return word
