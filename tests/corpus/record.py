"""What the corpus keeps of a run, told without the engine's notions: which elements rest in each phase, from the speeds
in its middle; when that changes; the state, the forces and the derivatives at such instants and at the end.

An element is a number: contacts 0 to N - 1, then axles, then rollers in contact, then the free rollers of each wheel.
Its sign is that of its speed, 0 where it rests; a contact that slips has 1. A switch is an event of its wheel's number
with the sign 7 or -7, as the contact passes on.
"""

from dataclasses import dataclass, fields

import numpy as np
from contact.laws import contact_rows, speeds_at

from omniroll import Contact, Trajectory

SWITCHES = 7
AT_ONCE = 1e-9  # s: what is nearer is one instant
RESTS, MOVES = 1e-11, 1e-8  # of the largest speed: what is between is not told apart
KEPT = 3  # events whose states are kept
DETERMINATE = 1e-7  # part of a force in what balances itself


class NotTold(ValueError):
    """A speed that is neither rest nor motion: the scene says nothing."""


@dataclass
class Record:
    """Of a run; E events, K of them kept beside the end.

    instants     (E,) in s
    changes      (E, 2) int: element and its new sign, ordered by time and element
    states       (K + 1, 6 + 3 N) nu, pose, chi, the wheels' rates, spins in contact; the last row is the end
    spins        (F,) of free rollers at the end
    forces       (K + 1, 4 N) of the ground along axle and rolling direction, torques of axles, of rollers in contact;
                 NaN where they are not determinate
    energy       (2,) at the end: kinetic, and all that the ledger says was lost
    derivatives  (D, 6 + N) of nu, pose and chi at the end
    """

    instants: np.ndarray
    changes: np.ndarray
    states: np.ndarray
    spins: np.ndarray
    forces: np.ndarray
    energy: np.ndarray
    derivatives: np.ndarray

    def flat(self) -> list[np.ndarray]:
        return [getattr(self, field.name) for field in fields(self)]


def recorded(run: Trajectory, numbers: tuple[str, ...] = ()) -> Record:
    """Raises NotTold."""
    borders = _borders(run.t)
    found = events(run, borders)
    instants = np.unique([at for at, _, _ in found])[:KEPT]
    rows = [*(row_behind(run.t, borders, at) for at in instants), len(run) - 1]
    end, width = [run.sensitivity(name) for name in numbers], 6 + run.vehicle.wheels
    spins = np.empty(0) if run.spins is None else run.spins[-1].ravel()
    losses = [value[-1] for name, value in sorted(run.contributions().items()) if name.endswith("loss")]
    return Record(
        np.array([at for at, _, _ in found]),
        np.array([change for _, *change in found], int).reshape(-1, 2),
        np.array([_state(run, row) for row in rows]),
        spins,
        np.array([determinate_forces(run, row) for row in rows]),
        np.array([run.energy[-1], sum(losses)]),
        np.array([np.concatenate([one.nu[-1], one.pose[-1], one.chi[-1]]) for one in end]).reshape(len(end), width),
    )


def _borders(t: np.ndarray) -> np.ndarray:
    """Times of the start, of the end, and at which rows stand on two sides, each instant once: its last time."""
    times = np.concatenate([t[:1], t[1:][np.diff(t) == 0], t[-1:]])
    return times[np.append(np.diff(times) > AT_ONCE, True)]


def row_behind(t: np.ndarray, borders: np.ndarray, at: float) -> int:
    """The last row of what happens at once at an instant. Steps behind it may be shorter than AT_ONCE: their rows are
    later states, at times that the accuracy chooses."""
    last = borders[np.searchsorted(borders, at + AT_ONCE) - 1]  # earlier where the instant has no two sides
    return int(np.searchsorted(t, max(at, last), side="right")) - 1


def events(run: Trajectory, borders: np.ndarray) -> list[tuple[float, int, int]]:
    """Instant, element and new sign of each change, in order."""
    phases = signs(run, (borders[1:] + borders[:-1]) / 2)
    found = [(float(one.t), int(one.wheel), SWITCHES * int(np.sign(one.direction))) for one in run.switches]
    passed = {(at, wheel) for at, wheel, _ in found}
    wheels = np.arange(run.vehicle.wheels)
    free = phases.shape[1] // len(wheels) - 3
    of_wheel = np.concatenate([np.tile(wheels, 3), np.repeat(wheels, free)])
    for at, before, after in zip(borders[1:-1], phases, phases[1:], strict=False):
        switched = {wheel for t, wheel in passed if abs(t - at) <= AT_ONCE}
        for element in np.flatnonzero(before != after):
            if element < 2 * len(wheels) or of_wheel[element] not in switched:  # else rollers have other places now
                found.append((float(at), int(element), int(after[element])))
    return sorted(found)


def signs(run: Trajectory, times: np.ndarray) -> np.ndarray:
    """(T, elements) int at times. Raises NotTold."""
    at = run.sample(times)
    slip, rates = speeds_at(run.vehicle, at)
    free = np.empty((len(times), 0)) if at.spins is None else at.spins.reshape(len(times), -1)
    sliding = np.linalg.norm(slip, axis=-1) * _may_stick(run)
    bearings = next((effect for effect in run.effects.effects if hasattr(effect, "wheel_coulomb")), None)
    of_axles, of_rollers = (getattr(bearings, name, None) is not None for name in ("wheel_coulomb", "roller_coulomb"))
    reach = run.vehicle.wheel_radius - run.vehicle.roller_axis_radius
    speeds = np.concatenate([sliding, rates * run.vehicle.wheel_radius * of_axles, at.contact_spin * reach * of_rollers,
                             free * reach * of_rollers], axis=1)  # fmt: skip
    size = np.maximum(np.abs(speeds).max(initial=0.0), np.abs(at.nu).max() * run.vehicle.platform_radius)
    part = np.abs(speeds) / (size or 1.0)
    if ((part > RESTS) & (part < MOVES)).any():
        raise NotTold
    return np.where(part <= RESTS, 0, np.sign(speeds)).astype(int)


def _may_stick(run: Trajectory) -> bool:
    return any(isinstance(effect, Contact) and effect.law == "coulomb" for effect in run.effects.effects)


def _rates(run: Trajectory) -> np.ndarray:
    return speeds_at(run.vehicle, run)[1]


def _state(run: Trajectory, row: int) -> np.ndarray:
    return np.concatenate([run.nu[row], run.pose[row], run.chi[row], _rates(run)[row], run.contact_spin[row]])


def determinate_forces(run: Trajectory, row: int) -> np.ndarray:
    """(4 N,) NaN where other forces do the same to the motion: forces of elements at rest that balance themselves."""
    wheels, names = run.vehicle.wheels, run.effects.drives()
    nothing = np.full(wheels, np.nan)
    force = np.full((wheels, 2), np.nan) if run.ground_force is None else run.ground_force[row]
    torques = [run.drive[row, names.index(name)] if name in names else nothing
               for name in ("bearing_torque", "contact_bearing")]  # fmt: skip
    found = np.concatenate([force[:, 0], force[:, 1], *torques])
    acts = ~np.isnan(found)
    acts[: 2 * wheels] = True  # the ground, where wheels roll, too
    slip, rates = speeds_at(run.vehicle, run)
    size = max(np.abs(run.nu).max() * run.vehicle.platform_radius, np.abs(slip).max(), 1e-300)
    radius, reach = run.vehicle.wheel_radius, run.vehicle.wheel_radius - run.vehicle.roller_axis_radius
    sticks = np.linalg.norm(slip[row], axis=-1) <= MOVES * size
    if run.ground_force is not None and not _may_stick(run):
        sticks[:] = False
    rests = np.concatenate([sticks, sticks, np.abs(rates[row]) * radius <= MOVES * size,
                            np.abs(run.contact_spin[row]) * reach <= MOVES * size])  # fmt: skip
    held = rests & acts
    rows = contact_rows(run.vehicle, run.chi[row])[held]
    *_, of_rows = np.linalg.svd(rows.T, full_matrices=True)
    rank = np.linalg.matrix_rank(rows, tol=1e-9) if len(rows) else 0
    many = np.zeros(4 * wheels)
    many[held] = np.linalg.norm(of_rows[rank:], axis=0) if len(rows) else 0.0
    found[many > DETERMINATE] = np.nan
    return found


# ---- comparison ------------------------------------------------------------------------------------------------------

INSTANTS = 1e-10  # s
ALLOWED = {"states": 1e-9, "spins": 1e-9, "energy": 1e-9, "forces": 1e-10, "derivatives": 1e-9}  # relative


def difference(own: Record, other: Record, part: float = 1.0) -> str:
    """How two records differ by more than a part of what is allowed: in words, or nothing."""
    same = own.changes.shape == other.changes.shape and (own.changes == other.changes).all()
    if not same or (own.instants.size and np.abs(own.instants - other.instants).max() > AT_ONCE):
        ends = "" if ends_differ(own, other, part) else "ends agree, "
        return f"{ends}other events: {_in_words(own)} and {_in_words(other)}"
    if own.instants.size and (late := np.abs(own.instants - other.instants).max()) > part * INSTANTS:
        return f"instants {late:.1e} s apart"
    for name, allowed in ALLOWED.items():
        mine, theirs = getattr(own, name), getattr(other, name)
        if mine.shape != theirs.shape:
            return f"{name} of {mine.shape} and {theirs.shape}"
        if (np.isnan(mine) != np.isnan(theirs)).any():
            return f"{name} that are determinate in one alone"
        axis, least = (None, 0.0) if name == "forces" else (0, 1.0)
        sizes = np.nanmax(np.abs(theirs), axis=axis, initial=least)
        apart = np.nanmax(np.abs(mine - theirs) / np.maximum(sizes, 1e-300), initial=0.0) if mine.size else 0.0
        if apart > part * allowed:
            return f"{name} {apart:.1e} apart"
    return ""


def ends_differ(own: Record, other: Record, part: float = 1.0) -> bool:
    """Whether states at the end, spins and energy do, by more than a part of what is allowed."""
    pairs = (own.states[-1], other.states[-1]), (own.spins, other.spins), (own.energy, other.energy)
    allowed = part * ALLOWED["states"]
    return any((np.abs(mine - theirs) > allowed * np.maximum(np.abs(theirs), 1.0)).any() for mine, theirs in pairs)


def _in_words(record: Record) -> str:
    pairs = zip(record.instants, record.changes, strict=True)
    return "; ".join(f"{at:.9f} s {element} -> {sign}" for at, (element, sign) in list(pairs)[:12])
