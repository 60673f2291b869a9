"""Deviations followed along a run in C: runtime/csrc/deviations/following.c, on the set's functions with their slopes.

The library of a set is compiled where it is not built, when sensitivities are asked for the first time; a run that is
asked for none needs none.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np
from numpy.polynomial import legendre

from omniroll.codegen.along import SUFFIX
from omniroll.engine.bearing_modes import FREE, BearingModes
from omniroll.engine.contact_modes import ContactModes
from omniroll.engine.deviations import Deviations
from omniroll.engine.directions import Directions
from omniroll.engine.events_beside import APART, GRAZES, JUMPS, LETS_GO_ONLY_JUST, REACHED, RESTS_ONLY_JUST, UNKNOWN
from omniroll.engine.motion import Columns, Motion
from omniroll.engine.sticking import Sticking
from omniroll.engine.workspace import NODES
from omniroll.errors import InvalidValueError, KernelsMissingError
from omniroll.kernels import sets
from omniroll.kernels.kernel import Kernel
from omniroll.kernels.lanes import aligned
from omniroll.results.dense import weights_at

TYPES = {"double": float, "long long": np.int64, "int": np.int32}  # of numbers, by their names in C
# At the ends of steps collocation at Gauss's nodes has twice the order that it has inside them. So from row to row
# fewer nodes are as exact as the run itself, where its accuracy is this one or better, and where the deviations move no
# faster than the run: the last of Legendre's polynomials makes at most this part of them in a step.
FEWER, FINE, MOST_LAST = 12, 1e-8, 1e-5
MANY = 16  # steps that ask for more
NO_ANGLE = 1e-6  # rad, of a wheel's angle, where a number changes by its own size: nothing
LEAST_WRONG = 1e-10  # of the deviations of speeds: what they may be off by behind a step in which rates are fast,
ACCURACIES = 3.0  # or so many times the run's accuracy


@dataclass(frozen=True)
class Gauss:
    """Gauss's nodes on [0, 1] and what integrates the polynomial through values there.

    nodes    (s,)
    weights  (s,) of the integral from 0 to 1
    """

    nodes: np.ndarray
    weights: np.ndarray

    def integrals(self, x: np.ndarray) -> np.ndarray:
        """(..., s) weights of the integral from 0 to x (...)."""
        s = len(self.nodes)
        to_series = legendre.legvander(2 * self.nodes - 1, s - 1).T * self.weights
        of_series = legendre.legvander(2 * np.asarray(x) - 1, s)
        falling = np.concatenate([-np.ones_like(of_series[..., :1]), of_series[..., : s - 1]], axis=-1)
        return (of_series[..., 1:] - falling) / 2 @ to_series

    def coefficient(self, back: int) -> np.ndarray:
        """(s,) weights of a coefficient, so many before the last, of the polynomial through values there, in
        Legendre's."""
        degree = len(self.nodes) - 1 - back
        return (2 * degree + 1) * self.weights * legendre.legvander(2 * self.nodes - 1, degree)[:, -1]


@cache
def gauss(count: int) -> Gauss:
    x, weights = legendre.leggauss(count)
    return Gauss((1 + x) / 2, weights / 2)


def library_of(motion: Motion):
    """`ffi` and `lib` for the deviations of a run. Raises KernelsMissingError where they cannot be had."""
    plain, deviations = motion.plain, motion.deviations
    try:
        found = sets.variations(plain.base, plain.effects, plain.wheels, plain.sharp)
    except KernelsMissingError as problem:
        text = f"derivatives of runs are computed in C: install a C compiler (cc); {problem}"
        raise KernelsMissingError(text) from None
    texts = [found.lib.omniroll_variations_names(inputs) for inputs in (False, True)]
    followed = [tuple(found.ffi.string(text).decode().split()) for text in texts]  # beside nu, and of drives
    if [tuple(deviations.rates)[3:], _drives(deviations)] != followed:
        raise InvalidValueError("sensitivities", plain.set_name, "effects with further numbers are not followed")
    return found


def _drives(deviations: Deviations) -> tuple[str, ...]:
    """The inputs that drives give, and modes: those that are not of free rollers."""
    return tuple(name for name in deviations.inputs if name not in ("momenta", FREE))


@cache
def _tables(degree: int, count: int) -> dict[str, np.ndarray]:
    """What C takes of so many nodes, for steps with polynomials of this degree."""
    nodes = gauss(count)
    return {
        "nodes": nodes.nodes, "weights": nodes.weights, "integrals": nodes.integrals(nodes.nodes),
        "last": nodes.coefficient(0), "before_last": nodes.coefficient(1),
        "of_coefficients": weights_at(degree, nodes.nodes),
    }  # fmt: skip


class Models:
    """The constants of a vehicle in C with their slopes by numbers: the first in which nothing deviates, then the
    numbers, one after the other."""

    def __init__(self, ffi, lib, plain: Kernel, tangents: Mapping[str, np.ndarray], numbered: np.ndarray):
        self.ffi, self.lib, self.plain = ffi, lib, plain
        self.kept: list = []
        fields = {name for name, _ in self.ffi.typeof("omniroll_vehicle").fields}
        own = {n: v for n, v in zip(plain.constant_names, plain.constants, strict=True) if n in fields}
        vehicle = self.ffi.new("omniroll_vehicle *")
        vehicle.wheels, vehicle.rollers_per_wheel = plain.wheels, plain.rollers_per_wheel
        self._put(vehicle, "", own)
        self._put(vehicle, SUFFIX, {name: np.zeros_like(value) for name, value in own.items()})
        models = [self._prepared(vehicle, {})]
        for column in numbered:
            models.append(self._prepared(vehicle, {n: way[column] for n, way in tangents.items() if n in own}))
        self.pointers = self.ffi.new("omniroll_model *[]", models)

    def __len__(self) -> int:
        return len(self.pointers)

    def _put(self, vehicle, suffix: str, values: Mapping[str, np.ndarray]) -> None:
        """Put values into the fields of their names with the suffix."""
        for name, value in values.items():
            array = np.asarray(value, float, order="C")
            setattr(vehicle, name + suffix, self.ffi.from_buffer("double[]", array) if array.ndim else float(array))
            self.kept.append(array)

    def _prepared(self, still, moved: Mapping[str, np.ndarray]):
        """The model of a vehicle in which nothing deviates, but for these constants."""
        ffi, wheels, slots = self.ffi, self.plain.wheels, self.plain.rollers_per_wheel - 1
        vehicle, model = ffi.new("omniroll_vehicle *", still[0]), ffi.new("omniroll_model *")
        self._put(vehicle, SUFFIX, moved)
        storage = [ffi.new("omniroll_wheel[]", wheels)]
        if self.plain.has_spins:
            storage.append(ffi.new("omniroll_roller[]", slots))
        self.kept += [*storage, model]
        if self.lib.omniroll_prepare(vehicle, *storage, model) != self.lib.OMNIROLL_OK:
            raise KernelsMissingError(f"the library of {self.plain.set_name} refuses the vehicle")
        return model


@lru_cache(maxsize=16)
def _models_of(columns: Columns, ffi, lib) -> Models:
    """The models of a run's columns, which C only reads."""
    return Models(ffi, lib, columns.plain, columns.constants, columns.numbered)


class CompiledVariations:
    """The deviations of one run in P columns.

    rows    (T, m, P) deviations in the rows; follow() fills them
    inputs  (S, F, P) of what drives the steps; the caller fills what drives do, follow() what rollers do
    axial   (K, N n, P) deviations of the rollers' axial speeds at the phases' starts
    sticking  contacts and bearings that may stick
    turns   (T,) 1 in rows in which these change their modes as a step begins, until that is passed
    """

    def __init__(
        self, motion: Motion, columns: Columns, rows: np.ndarray, inputs: np.ndarray, axial: np.ndarray | None,
        sticking: Sticking | None,
    ):  # fmt: skip
        self.module = module = library_of(motion)
        self.motion, self.columns = motion, columns
        self.rows, self.inputs, self.axial = rows, inputs, axial
        self.models = _models_of(columns, module.ffi, module.lib)
        self.struct = module.ffi.new("omniroll_variations_t *")
        self.kept: list[np.ndarray] = []
        # Slips along the axles decay fast within steps, and massless rollers that stick have such slips, too.
        decays = "contact_omega" in motion.deviations.rates or "slip_contact_loss" in motion.plain.signatures
        few = motion.trajectory.accuracy <= FINE and not decays
        self.nodes = FEWER if few else NODES  # from row to row
        self.asked, self.turns = 0, np.zeros(len(rows), np.int32)
        self._why = np.zeros(2, np.int32)
        self._fill(sticking)

    def begin(self, phase: int, spins: np.ndarray | None = None) -> None:
        """Let what sticks where a phase begins, of wheels that roll, take what it does from the deviations there. At a
        start at which free rollers' spins deviate by (P, N, n-1) find what follows from these first."""
        moved = self.module.ffi.NULL
        if spins is not None:
            moved = self._pointer(spins.reshape(len(spins), -1).T, "double")
        self.module.lib.omniroll_begin(self.struct, int(self.motion.phases[phase]), phase, moved)

    def why(self) -> str:
        """Why a row has not been passed."""
        reason, column = self._why.tolist()
        texts = UNKNOWN, RESTS_ONLY_JUST, LETS_GO_ONLY_JUST, APART.format(self.columns.names[column])
        return texts[reason]

    def follow(self, first: int, last: int, phase: int, as_one: bool = False, knot: np.ndarray | None = None) -> int:
        """Fill the rows behind `first` up to `last`; returns where it has come, before a switch that is not plain, or
        something else that it does not pass: why() says for what reason.

        knot  (P,) by how much the time deviates at which drives jump behind `first`; None where none does
        """
        call = self.module.lib.omniroll_follow
        self.struct[0].knot = self.module.ffi.NULL if knot is None else self._pointer(knot, "double")
        self._take_nodes(self.nodes)
        reached = call(self.struct, first, last, phase, as_one)
        while reached < 0:  # a step asks for more nodes; where many do, all get them
            first, self.asked = -1 - reached, self.asked + 1
            self.nodes = NODES if self.asked == MANY else self.nodes
            phase = int(self.motion.phase_of(first))
            self._take_nodes(NODES)
            call(self.struct, first, first + 1, phase, False)
            self._take_nodes(self.nodes)
            reached = call(self.struct, first + 1, last, phase, False)
        return reached

    def since_rows(self, step: np.ndarray, phase: np.ndarray, x: np.ndarray) -> np.ndarray:
        """(k, m, P) what the deviations have come to since the rows of steps (k,), each in its phase, at parts x."""
        self._take_nodes(NODES)
        wanted, first, back = np.unique(step, return_index=True, return_inverse=True)
        trajectory = self.motion.trajectory
        rows, elapsed = trajectory.step_rows[step], trajectory.elapsed
        rates, in_pieces = self._rates_in_steps(wanted, phase[first])
        weights = gauss(self.struct.gauss.count).integrals(x) * (elapsed[rows + 1] - elapsed[rows])[:, None]
        found = np.einsum("ks,ksmp->kmp", weights, rates[back])
        cut = np.flatnonzero(in_pieces[back])
        if cut.size:
            found[cut] = self._moved_in_steps(step[cut], phase[cut], x[cut]) - self.rows[rows[cut]]
        return found

    def _rates_in_steps(self, steps: np.ndarray, phases: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(k, s, m, P) the rates of the deviations at the nodes of steps (k,), and (k,) bool: steps that are followed
        in pieces, and have none."""
        nodes = self.struct.gauss.count
        rates, cut = np.zeros((len(steps), nodes, *self.rows.shape[1:])), np.zeros(len(steps), np.int32)
        places = self._pointer(steps, "long long"), self._pointer(phases, "long long")
        found = self._pointer(rates, "double"), self._pointer(cut, "int")
        self.module.lib.omniroll_rates_in_steps(self.struct, len(steps), *places, *found)
        return rates, cut != 0

    def _moved_in_steps(self, steps: np.ndarray, phases: np.ndarray, x: np.ndarray) -> np.ndarray:
        """(k, m, P) the deviations at parts x (k,) of steps (k,) that are followed in pieces."""
        moved = np.empty((len(steps), *self.rows.shape[1:]))
        places = self._pointer(steps, "long long"), self._pointer(phases, "long long")
        numbers = self._pointer(x, "double"), self._pointer(moved, "double")
        self.module.lib.omniroll_moved_in_steps(self.struct, len(steps), *places, *numbers)
        return moved

    def _take_nodes(self, wanted: int) -> None:
        """Work with so many nodes in a step, where vectors are no wider."""
        count = self.module.lib.omniroll_variations_nodes(wanted)
        run = self.struct[0]
        if run.gauss.count == count:
            return
        run.gauss.count, run.bounds.most_last = count, MOST_LAST if count < NODES else 0.0
        self._point(run.gauss, **_tables(run.motion.degree, count))

    def _point(self, group, **arrays: np.ndarray) -> None:
        """Let fields of the struct, or of a group in it, point to arrays' numbers, of the types that they have in C."""
        fields = dict(self.module.ffi.typeof(group).fields)
        for name, array in arrays.items():
            setattr(group, name, self._pointer(array, fields[name].type.item.cname))

    def _pointer(self, array: np.ndarray, kind: str):
        """A pointer to an array's numbers, which are kept alive; not of another array's where the type fits."""
        self.kept.append(np.ascontiguousarray(array, TYPES[kind]))
        return self.module.ffi.from_buffer(f"{kind}[]", self.kept[-1])

    def _grip(self, contacts: ContactModes) -> np.ndarray:
        """(1 + Q, 3 N) the loads of contacts and their friction, and how the numbers move these."""
        grip, moved, numbered = contacts.grip, self.columns.constants, self.columns.numbered
        found = np.zeros((1 + len(numbered), 3 * self.motion.plain.wheels))
        loads, friction = np.split(found, [len(grip.loads)], axis=1)
        given = grip.loads
        for name, part, own in (("contact_load", loads, given), ("ground_friction", friction, grip.sliding)):
            part[0] = own.ravel()
            if name in moved:
                part[1:] = moved[name][numbered].reshape(len(numbered), -1)
        loads[:, given == 0] = 0.0
        return found

    def _per_reach(self, contacts: ContactModes) -> np.ndarray:
        """(1 + Q, N, 2) one over the squares of what static friction can hold, and how the numbers move these."""
        own, moved = contacts.per_reach(), self.columns.constants
        found = np.zeros((1 + len(self.columns.numbered), *own.shape))
        found[0] = own
        parts = {"ground_static_friction": contacts.grip.static, "contact_load": contacts.grip.loads[:, None]}
        for name, part in parts.items():
            if name in moved:
                with np.errstate(divide="ignore", invalid="ignore"):
                    rises = moved[name][self.columns.numbered].reshape(len(found) - 1, *part.shape) / part
                found[1:] -= np.where(own > 0, 2 * own * rises, 0.0)
        return found

    def _fill_contacts(self, contacts: ContactModes) -> None:
        """What C takes of contacts that have modes."""
        y = self.motion.y
        noises = contacts.noises(y, np.minimum(np.arange(len(y)) + 1, len(y) - 1))
        run, per_reach = self.struct[0], self._per_reach(contacts)
        run.bounds.grazes = GRAZES * (contacts.grip.largest / self.motion.plain.vehicle.mass)
        self._point(run.contacts, grip=self._grip(contacts), slip_rounding=noises, per_reach=per_reach)

    def _fill_bearings(self, bearings: BearingModes, sticking: Sticking) -> None:
        """What C takes of bearings that may stick."""
        self.turns[:] = bearings.alone
        own = self.struct.bearings
        self._point(own, mode=bearings.modes, enters=self.turns, inertia=sticking.inertias, sliding=bearings.sliding)
        self._point(own, bound=bearings.holding, bound_moved=sticking.torques[1])

    def _fill_held(self, held: Directions, sticking: Sticking) -> None:
        """What C takes of rates that are held together."""
        allowed = held.tables(sticking.turning_directions[:, self.columns.numbered])
        self._point(self.struct.bearings, hold=held.which, allowed=allowed)
        if self.motion.stands:
            numbers, moved = sticking.numbers
            self._point(self.struct.contacts, standing=numbers, standing_moved=moved)

    def _drive(self) -> np.ndarray:
        """(T, F, N) what drives give, and modes; of bearings that may stick the torques of those that turn."""
        motion, trajectory = self.motion, self.motion.trajectory
        names, kept = _drives(motion.deviations), trajectory.effects.drives()
        if not names:
            return np.zeros(1)
        drive = trajectory.drive[:, [kept.index(name) for name in names]]
        turning = {} if motion.bearings is None else motion.bearings.given(motion.bearings.torques)
        for name in turning.keys() & set(names):
            drive[:, names.index(name)] = turning[name]
        return drive

    def _fill(self, sticking: Sticking | None) -> None:
        run, motion, columns = self.struct[0], self.motion, self.columns
        trajectory, plain, deviations = motion.trajectory, motion.plain, motion.deviations
        run.wheels, run.rollers_per_wheel = plain.wheels, plain.rollers_per_wheel
        run.bounds.jumps, run.bounds.reached, run.bounds.only_just = JUMPS, REACHED, GRAZES
        run.bounds.most_wrong = max(LEAST_WRONG, ACCURACIES * trajectory.accuracy)
        run.impact = trajectory.switching == "impact"
        run.motion.rows = len(trajectory)
        run.columns, run.size, run.given_size = len(columns), len(deviations.state), self.inputs.shape[1]
        dense = np.zeros((0, 1, motion.y.shape[1])) if trajectory.dense is None else trajectory.dense  # of no step
        run.motion.row_size, run.motion.degree = dense.shape[2], dense.shape[1] - 1
        run.models, run.model = len(self.models), self.models.pointers
        number = np.zeros(len(columns), np.int32)
        number[columns.numbered] = 1 + np.arange(len(columns.numbered))
        steps = np.full(len(trajectory), -1)
        steps[trajectory.step_rows] = np.arange(len(trajectory.step_rows))
        self._point(
            run.motion, elapsed=trajectory.elapsed, y=motion.y, contact=trajectory.contact, drive=self._drive(),
            dense=dense, step_of=steps, step_rows=trajectory.step_rows, phase_start=motion.phases,
        )  # fmt: skip
        self._point(run.bounds, least=NO_ANGLE / columns.sizes)
        self._point(run, number=number, place=deviations.state, why=self._why, moved=self.rows, given=self.inputs)
        if motion.contacts is not None:
            self._fill_contacts(motion.contacts)
        if motion.bearings is not None:
            self._fill_bearings(motion.bearings, sticking)
        if motion.held is not None:
            self._fill_held(motion.held, sticking)
        if self.axial is not None:
            self._point(run.motion, spins=trajectory.spins)
            self._point(run, axial=self.axial)
        size = self.module.lib.omniroll_variations_work_size(self.struct)
        self._point(run, work=aligned(size))
