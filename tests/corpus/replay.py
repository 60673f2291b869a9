"""Scenes of the corpus run again and compared with what is kept of them."""

from collections.abc import Iterable

from contact.laws import judged

from corpus import files
from corpus.kinds import ACCURACY, numbers_of, scene
from corpus.record import NotTold, Record, difference, recorded
from omniroll import SimulationStopped, simulate
from omniroll.errors import NoDerivativeError

LAWS = 5e-12  # of what the laws ask for in each row: a speed that has come to rest is left with that
# Scenes that the present engine runs otherwise than what is kept of them: how it says so, and why.
HEADING = (
    "static friction above sliding on a slope: what is kept left out that gravity's direction turns with the "
    "heading behind a let-go; by nu[1] those of now are within 2e-7 of differences of runs, those kept 6e-5 off"
)
FROM_REST = "the same, from rest, where what an axle does depends on the side to which nu[1] moves: two differences"
GOES_ON = (
    "a slip comes to rest and at once goes on in another direction: what is kept left that out; those of now "
    "are within 1e-9 of differences of runs, those kept up to 8e-1 off"
)
TOGETHER = "several change their modes together: the compiled engine leaves this to nobody now, and says so"
JUST_LET_GO = "a slip of 4e-11 m/s behind a let-go has its direction to 1e-11, in the engine that was kept, too"
NEAR_REST = "a slip of 1.7e-7 m/s on its way to rest has its direction to 2e-11: speeds of 2.7 m/s are rounded to more"
ONE_ROW = "a change of a mode is told by two rows of one time, and one of the two engines has one there: it is not seen"
FEWER = (
    "from rest under more than holds: only what must take all that it can at the least use breaks away, before"
    " the rounds; the engine that was kept let go of all that any of the facets passed, and an axle more began to turn"
)
OTHERS = ("ends agree, other events", ONE_ROW)
DIFFERS: dict[tuple[str, str, str], dict[int, tuple[str, str]]] = {
    ("coulomb", "massless", "axles"): dict.fromkeys((0, 2), ("derivatives", HEADING)),
    ("coulomb", "massless", "viscous"): dict.fromkeys((4, 5), ("derivatives", HEADING))
    | {2: ("NoDerivativeError", TOGETHER)},
    ("coulomb", "massless", "none"): dict.fromkeys((0, 4, 5), ("derivatives", HEADING)),
    ("coulomb", "free", "both and viscous"): dict.fromkeys((5, 8), ("derivatives", HEADING))
    | {0: ("derivatives", GOES_ON), 9: ("NoDerivativeError", TOGETHER)},
    ("coulomb", "free", "both"): {2: ("derivatives", HEADING)} | dict.fromkeys((4, 5), ("NoDerivativeError", TOGETHER)),
    ("coulomb", "free", "rollers"): dict.fromkeys((1, 4, 5, 6), ("derivatives", HEADING))
    | {2: ("NoDerivativeError", TOGETHER)},
    ("coulomb", "free", "axles"): dict.fromkeys((1, 5), ("derivatives", HEADING))
    | {0: ("derivatives", FROM_REST), 9: ("NotTold: the law of a contact", JUST_LET_GO)}
    | dict.fromkeys((2, 3), ("derivatives", GOES_ON))
    | {14: OTHERS, 24: ("other events", FEWER)},
    ("coulomb", "free", "viscous"): dict.fromkeys((1, 2, 3), ("derivatives", HEADING))
    | {0: ("derivatives", GOES_ON), 6: ("NotTold: the law of a contact", NEAR_REST)},
    ("rolling", "locked", "axles"): dict.fromkeys((3, 6), OTHERS),
    ("rolling", "massless", "axles"): dict.fromkeys((3, 11, 14), OTHERS),
    ("rolling", "massless", "rollers"): dict.fromkeys((5, 18), OTHERS),
    ("rolling", "massless", "both"): {18: OTHERS},
    ("rolling", "free", "axles"): {9: OTHERS},
    ("rolling", "free", "rollers"): dict.fromkeys((1, 15, 17), OTHERS),
    ("rolling", "free", "both"): dict.fromkeys((10, 20, 22), OTHERS),
    ("rolling", "free", "both and viscous"): dict.fromkeys((1, 17), OTHERS),
    ("coulomb", "free", "none"): {0: ("derivatives", HEADING)} | dict.fromkeys((1, 5), ("derivatives", GOES_ON)),
}


def record_of(kind: tuple[str, str, str], number: int, derivatives: bool, accuracy: float = ACCURACY) -> Record:
    """Raises NotTold, SimulationStopped."""
    vehicle, task = scene(kind, number)
    names = numbers_of(kind) if derivatives else ()
    run = simulate(vehicle, **task | {"accuracy": accuracy}, sensitivities=names)
    for law, residual in judged(run).items():
        if not residual.max() <= LAWS:
            raise NotTold(f"the law of a {law} is missed by {residual.max():.1e}")
    return recorded(run, names)


def unexplained(kind: tuple[str, str, str], found: dict[int, str]) -> dict[int, str]:
    """What differs otherwise than DIFFERS says."""
    named = DIFFERS.get(kind, {})
    return {number: told for number, told in found.items()
            if number not in named or not told.startswith(named[number][0])}  # fmt: skip


def differences(kind: tuple[str, str, str], numbers: Iterable[int] | None = None) -> dict[int, str]:
    """How scenes differ from what is kept, in words, by number; all of a kind, or some."""
    kept, found = files.read(kind), {}
    for number in kept if numbers is None else numbers:
        try:
            own = record_of(kind, number, len(kept[number].derivatives) > 0)
        except (NotTold, SimulationStopped, NoDerivativeError) as error:
            found[number] = f"{type(error).__name__}: {error}"
            continue
        if told := difference(own, kept[number]):
            found[number] = told
    return found
