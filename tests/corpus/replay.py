"""Scenes of the corpus run again and compared with what is kept of them."""

from collections.abc import Iterable

from corpus import files
from corpus.kinds import ACCURACY, numbers_of, scene
from corpus.record import NotTold, Record, difference, recorded
from contact.laws import judged
from omniroll import SimulationStopped, simulate
from omniroll.errors import NoDerivativeError

LAWS = 5e-12  # of what the laws ask for in each row: a speed that has come to rest is left with that
# Scenes that the present engine runs otherwise than what is kept of them: kind, number, and why.
DIFFERS: dict[tuple[str, str, str], dict[int, str]] = {}


def record_of(kind: tuple[str, str, str], number: int, derivatives: bool, accuracy: float = ACCURACY) -> Record:
    """Raises NotTold, SimulationStopped."""
    vehicle, task = scene(kind, number)
    names = numbers_of(kind) if derivatives else ()
    run = simulate(vehicle, **task | {"accuracy": accuracy}, sensitivities=names)
    for law, residual in judged(run).items():
        if not residual.max() <= LAWS:
            raise NotTold(f"the law of a {law} is missed by {residual.max():.1e}")
    return recorded(run, names)


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
