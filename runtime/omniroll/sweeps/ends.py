"""What simulate_many returns: arrays of the ends of many runs, made of what is kept of each."""

from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from omniroll.effects.effect_set import EffectSet
from omniroll.engine.control import sensitivity
from omniroll.engine.simulate import checked_task
from omniroll.kernels.kernel import Kernel, kernel
from omniroll.kernels.phases import Carry, kernel_in_phase
from omniroll.results import tables_of_many
from omniroll.results.on_demand import MadeOnDemand, Maker, OnDemand
from omniroll.results.slipping import Contacts
from omniroll.results.trajectory import Samples
from omniroll.sweeps.member import COUNTS, ON_DEMAND, SAMPLED, Found, Run, nothing
from omniroll.sweeps.sweep import Sweep, cores
from omniroll.vehicles import checks
from omniroll.vehicles.vehicle import Vehicle

if TYPE_CHECKING:  # only an extra brings them
    import pandas
    import xarray

NOT_RUN = "interrupted before it was run"


@dataclass(frozen=True, eq=False, repr=False)
class Ends(MadeOnDemand):
    """The states at the ends of many runs: the fields of Samples, each with the shape (...) of the runs in front.

    made  how contact_spin, spins and energy are computed when they are first read
    """

    t: np.ndarray
    nu: np.ndarray
    chi: np.ndarray
    contact: np.ndarray
    pose: np.ndarray
    made: dict[str, Maker]

    contact_spin = OnDemand()
    spins = OnDemand()
    energy = OnDemand()


@dataclass(frozen=True, eq=False, repr=False)
class Many(MadeOnDemand):
    """The ends of many runs; `...` is the shape to which vehicles, starts and effects broadcast.

    end             the state at each run's end, with the fields of Samples: t (...), nu (..., 3), chi (..., N), ...
    energy_start    (...) in J
    switches        (...) int, how many wheels switched; steps, evaluations (...) int likewise
    error_estimate  (...) as in Trajectory.stats, nan where there is none
    sensitivity     (...) likewise; two further runs each measure it when it is first read
    stopped         (...) bool: the run could not go on, and `end` is where it stopped; or it failed, and `end` is nan
                    (contact -1)
    reasons         {index: message} of these runs
    samples         Samples at `times`, shapes (..., T, ...), or None; nan, or -1 for contact, beyond the end of
                    a stopped run
    made            how energy_start and sensitivity are computed when they are first read
    """

    end: Ends
    switches: np.ndarray
    steps: np.ndarray
    evaluations: np.ndarray
    error_estimate: np.ndarray
    stopped: np.ndarray
    reasons: dict[tuple[int, ...], str]
    samples: Samples | None
    made: dict[str, Maker]

    energy_start = OnDemand()
    sensitivity = OnDemand()

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape (...) of the runs."""
        return self.stopped.shape

    def to_pandas(self, axes: Mapping[str, ArrayLike] | None = None) -> "pandas.DataFrame":
        """A table of pandas with a row for each run in C order, and a column for each number of its end: x, nu_1, ...

        axes  the name of each leading axis and the values (K,) that were varied along it, which become the first
              columns; None: run, or run_1, run_2, ..., from 0

        frame.attrs["units"] has the columns' units; `reason` says why a run stopped. Raises MissingPackageError
        without the extra `tables`, InvalidValueError for axes that are not those of the runs.
        """
        return tables_of_many.to_pandas(self, axes)

    def to_xarray(self, axes: Mapping[str, ArrayLike] | None = None) -> "xarray.Dataset":
        """A Dataset of xarray over the leading axes, with the other dimensions of Trajectory.to_xarray.

        axes  as in `to_pandas`: the coordinates

        Samples have the further dimension `sample`, and `samples_` before their names. Raises as `to_pandas` does.
        """
        return tables_of_many.to_xarray(self, axes)

    def __repr__(self) -> str:
        return f"<Many: {self.stopped.size} runs {self.shape}, {np.count_nonzero(self.stopped)} stopped>"


def gathered(shape: tuple[int, ...], sweep: Sweep) -> Many:
    found = [{"reason": NOT_RUN} if one is None else one for one in sweep.found]

    def of(name: str, kind: Any = float, default: Any = None) -> np.ndarray:
        return _stacked(shape, [one.get(name, default) for one in found], kind)

    samples = None
    if sweep.times is not None:
        parts = [one.get("samples") or {} for one in found]
        kinds = {name: int if name == "contact" else float for name in SAMPLED}
        stacked = {name: _stacked(shape, [p.get(name) for p in parts], kind) for name, kind in kinds.items()}
        made = {name: partial(stacked.get, name) for name in ON_DEMAND}
        samples = Samples(**{name: stacked[name] for name in SAMPLED if name not in made}, made=made)
    states = _States(shape, sweep.runs, found)
    wheels = sweep.runs[0]["vehicle"].wheels
    missing = {"t": np.nan, "nu": np.full(3, np.nan), "pose": np.full(3, np.nan), "chi": np.full(wheels, np.nan)}
    return Many(
        end=Ends(
            **{name: of(name, default=value) for name, value in missing.items()},
            contact=_stacked(shape, [states.contact(k, np.full(wheels, -1)) for k in range(len(found))], int),
            made={
                "contact_spin": lambda: states.of_vehicles(_contact_spins),
                "spins": lambda: states.of_vehicles(lambda k, nu, chi, spins, contacts: spins),
                "energy": lambda: states.of_vehicles(_energy),
            },
        ),
        **{name: of(name, int, 0) for name in COUNTS},
        error_estimate=np.array([one.get("error_estimate") for one in found], float).reshape(shape),
        stopped=np.array([one["reason"] is not None for one in found], bool).reshape(shape),
        reasons={k: one["reason"] for k, one in zip(np.ndindex(shape), found, strict=True) if one["reason"]},
        samples=samples,
        made={
            "energy_start": lambda: states.of_vehicles(_energy, start=True),
            "sensitivity": lambda: _sensitivities(shape, sweep, found),
        },
    )


def _stacked(shape: tuple[int, ...], values: list[Any], kind: type = float) -> np.ndarray | None:
    """(..., ...) of one array from each run, nan or -1 where a run has none; None where no run has one."""
    sizes = {np.shape(value) for value in values if value is not None}
    if not sizes:
        return None
    (size,) = sizes
    return np.array([nothing(size, kind) if value is None else value for value in values], kind).reshape(shape + size)


def _contact_spins(
    bound: Kernel, nu: np.ndarray, chi: np.ndarray, spins: np.ndarray | None, contacts: Contacts | None
) -> np.ndarray:
    return bound.wheel_rates(nu, chi)[1] if contacts is None else contacts.spins(nu, chi)


def _energy(
    bound: Kernel, nu: np.ndarray, chi: np.ndarray, spins: np.ndarray | None, contacts: Contacts | None
) -> np.ndarray:
    if contacts is not None:
        return contacts.energy(nu, chi, spins)
    return bound.energy(nu, chi, *bound.spins_or_nothing(spins))


class _States:
    """What follows from the states at the starts and ends of runs, by the kernels of their vehicles."""

    def __init__(self, shape: tuple[int, ...], runs: list[Run], found: list[Found]):
        self.shape, self.runs, self.found = shape, runs, found

    def of_vehicles(self, function: Callable, *, start: bool = False) -> np.ndarray | None:
        """(..., ...) function(kernel, nu, chi, spins, contacts) of the states at the ends or starts, all of a vehicle
        at once; contacts are Contacts where wheels may slip, else None."""
        values: list[Any] = [None] * len(self.runs)
        for bound, effects, places in self._in_phases(start):
            nu, chi, axial = (self._of(name, places, start) for name in ("nu", "chi", "axial"))
            spins = bound.spins_from_axial(nu, chi, axial) if bound.has_spins else None
            contacts = self._contacts(effects, places, start) if effects.slips else None
            of_places = function(bound, nu, chi, spins, contacts)
            for k, value in zip(places, [None] * len(places) if of_places is None else of_places, strict=True):
                values[k] = value
        return _stacked(self.shape, values)

    def contact(self, place: int, missing: np.ndarray) -> np.ndarray:
        """(N,) the rollers in contact at a run's end; the engine counts n more of wheels that stand on their joints."""
        numbers = self.found[place].get("contact")
        return missing if numbers is None else np.asarray(numbers) % self.runs[place]["vehicle"].rollers_per_wheel

    def _in_phases(self, start: bool) -> Iterator[tuple[Kernel, EffectSet, list[int]]]:
        """The same as _by_kernel, with what carries at the end of each run."""
        for bound, effects, places in self._by_kernel():
            if start or not bound.pivots:
                yield bound, effects, places
                continue
            for k in places:
                carry = Carry.of_numbers(np.asarray(self.found[k]["contact"], int), bound.rollers_per_wheel)
                yield kernel_in_phase(bound, carry), effects, [k]

    def _contacts(self, effects: EffectSet, places: list[int], start: bool) -> Contacts:
        """Those of some runs. Their spins and energies do not depend on the law of the ground."""
        run, name = self.runs[places[0]], "start_speeds" if start else "speeds"
        of_runs = [self.found[k][name] for k in places]
        speeds = {each: np.array([one[each] for one in of_runs]) for each in of_runs[0]}
        return Contacts(effects.kernel(run["vehicle"], run["roller_model"], "python"), speeds)

    def _of(self, name: str, places: list[int], start: bool) -> np.ndarray | None:
        if not start or name == "axial":
            values = [self.found[k]["start_axial" if start else name] for k in places]
        else:
            values = [self.runs[k][name] for k in places]
        if start and name == "chi":
            vehicles = (self.runs[k]["vehicle"] for k in places)
            values = list(map(checks.wheel_angles_in_contact, values, vehicles))
        return None if values[0] is None else np.array(values, float)

    def _by_kernel(self) -> Iterator[tuple[Kernel, EffectSet, list[int]]]:
        """Each Python kernel, which works on all states at once, with effects of one of its runs, and the runs."""
        groups: dict[tuple[Vehicle, bool], list[int]] = {}
        acting: dict[tuple[Vehicle, bool], EffectSet] = {}
        for k, (run, one) in enumerate(zip(self.runs, self.found, strict=True)):
            if "nu" in one:
                effects = EffectSet.checked(run["effects"], run["vehicle"])
                key = effects.equipped(run["vehicle"]), effects.slips
                groups.setdefault(key, []).append(k)
                acting.setdefault(key, effects)
        for key, places in groups.items():
            yield kernel(key[0], self.runs[0]["roller_model"], "python"), acting[key], places


def _sensitivities(shape: tuple[int, ...], sweep: Sweep, found: list[Found]) -> np.ndarray:
    """(...) of the runs that have an error estimate; nan for the others."""

    def of_run(run: Run, one: Found) -> float:
        value = None if one.get("error_estimate") is None else sensitivity(checked_task(**run))
        return np.nan if value is None else value

    with ThreadPoolExecutor(cores()) as pool:
        return np.array(list(pool.map(of_run, sweep.runs, found)), float).reshape(shape)
