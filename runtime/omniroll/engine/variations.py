"""How small deviations of a run grow along one of its steps: the variational equations, solved along its polynomials.

Where y' = f(y, u, p) and y(t) is known, a deviation follows d' = f_y d + f_u du + f_p dp: a linear equation, whose
coefficients are evaluated at the nodes of a Gauss formula on each step, for many steps at once. Collocation at these
nodes then is one linear system a step, which a few sweeps solve unless rates are fast. It gives the deviation at the
nodes, and at any time, as a linear function of what it is at the step's start, of the inputs' deviations and of the
numbers'.

A run that is calm has long steps, in which its deviations may decay much faster than it moves. Such a step is followed
in pieces (pieces_of_steps.py).
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from math import prod

import numpy as np
from numpy.polynomial import legendre

from omniroll.effects.bound_rates import HELD, HELD_WITH_SPINS, PLAIN, PLAIN_RATES, dynamics_with
from omniroll.effects.effect_set import BEARINGS, EffectSet
from omniroll.effects.ground_loads import Carried
from omniroll.effects.loads_beside_bearings import BesideBearings, left_function, left_of, settled, taken_and_gain
from omniroll.effects.slipping_bearings import MOMENTS
from omniroll.engine.contact_modes import MODES, ContactModes, loads_that_follow, pushes
from omniroll.engine.pieces_of_steps import PiecesOfSteps
from omniroll.engine.slopes import NOTHING, Slopes
from omniroll.kernels.kernel import Kernel
from omniroll.kernels.tangent_kernel import TangentKernel, tangent_of, with_tangent
from omniroll.results.accelerations import call_named
from omniroll.results.dense import values_at
from omniroll.results.trajectory import Trajectory

NO_ANGLE = 1e-6  # rad, of a wheel's angle, where a number changes by its own size: nothing
PIECE_NODES = 16  # of a piece of a step
LEAST_NODES = 8  # inside a step; a polynomial of higher degree has as many nodes as its rates have coefficients
KEPT = 2**22  # numbers that are kept of the rates at the nodes of all steps, for whoever asks between rows
MOST_SWEEPS = 30  # of a step whose deviations are found by sweeps
ENOUGH = 2.0**-53  # times the largest number of a column: changes that end its sweeps
RISES = 16.0  # times that: changes of fast rates, where sweeps do not serve
STEPS_AT_ONCE, SOLVED_AT_ONCE = 400, 64  # so that their arrays stay in the processor's cache

Held = Callable[[np.ndarray], tuple[Mapping, Mapping]]  # see Variations


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

    @property
    def last(self) -> np.ndarray:
        """(s,) weights of the last coefficient of the polynomial through values there, in Legendre's."""
        s = len(self.nodes)
        return (2 * s - 1) * self.weights * legendre.legvander(2 * self.nodes - 1, s - 1)[:, -1]

    @property
    def before_last(self) -> np.ndarray:
        """(s,) the same of the coefficient before it."""
        s = len(self.nodes)
        return (2 * s - 3) * self.weights * legendre.legvander(2 * self.nodes - 1, s - 2)[:, -1]

    @cached_property
    def to_nodes(self) -> np.ndarray:
        """(s, s) the same, from 0 to each node."""
        return self.integrals(self.nodes)


@cache
def gauss(count: int) -> Gauss:
    x, weights = legendre.leggauss(count)
    return Gauss((1 + x) / 2, weights / 2)


class Deviations:
    """Names and places of what deviates: the part of y that feeds back, and the inputs that a phase holds.

    rates      names of the quantities that are integrated, and of the rates that the generated functions give them
    state      (m,) their places in y
    inputs     names and shapes of what a phase is given: what the drives give, and the momenta of free rollers where
               they are constant, the torques of their bearings where they may stick
    constant   (moving,) bool: inputs among those that are torques of bearings, which do not change within a step
    sticking   names of those inputs that are torques of bearings which may stick, and whose rates follow from nu
    spins_stick  whether free rollers may stick as well
    axles_stick, rollers_stick  whether axles, and rollers, may stick where wheels may slip
    grips      whether contacts may stick on the ground
    loaded     whether loads follow the motion; coupled, whether the motion follows the loads as well
    left       whether then bearings of massless rollers leave a part of the loads
    corners    whether they do where contacts slip under Coulomb's friction
    at_rest    (N,) in N, the loads of the vehicle at rest; None where loads do not follow the motion
    functions  generated functions that give the rates, in the order in which they are called
    """

    def __init__(self, effects: EffectSet, bound: Kernel):
        vector = effects.state_vector(bound)
        # Energies are integrals that feed nothing back.
        added = [quantity for quantity in vector.quantities if not quantity.account and quantity.size != "energy"]
        self.rates = PLAIN_RATES | {quantity.name: quantity.rate for quantity in added}
        self.vector = vector
        self.state = np.concatenate([np.arange(vector.size)[vector.slices[name]] for name in self.rates])
        drives = effects.drives()
        self.inputs = {name: (bound.wheels,) for name in drives if name not in (*MODES, *MOMENTS)}
        self.moving = sum(map(prod, self.inputs.values()))  # inputs that change within a phase stand first
        self.constant = bound.slips & np.isin(list(self.inputs), BEARINGS).repeat(bound.wheels)
        self.inputs |= {name: (bound.wheels,) for name in MODES if name in drives}  # which a phase holds
        self.grips, self.loaded = "sticks" in drives, "carries" in drives
        self.coupled = self.loaded and "contact_viscous" not in effects.names()
        self.corners = self.coupled and "corner_loads" in bound.signatures
        self.plain, self.left = bound, self.coupled and left_function(bound) is not None
        self.at_rest = effects.grip(bound.vehicle).loads if self.loaded else None
        if bound.has_spins and not {"momenta", "axial", "spins"} & set(vector.slices):
            self.inputs["momenta"] = (bound.wheels, 2)
        self.spins_stick = bound.rollers_stick and bound.has_spins
        if self.spins_stick:
            self.inputs["free_bearing"] = (bound.wheels, bound.rollers_per_wheel - 1)
        self.axles_stick = bound.slips and "bearing_torque" in self.inputs
        self.rollers_stick = bound.slips and self.spins_stick
        self.sticking = () if bound.slips else tuple(name for name in BEARINGS if name in self.inputs)
        asked = effects.functions(bound.roller_model)
        functions = dict.fromkeys((*asked, *(PLAIN[1:] if bound.slips else (dynamics_with(asked), *PLAIN))))
        if self.sticking:
            held = HELD_WITH_SPINS if self.spins_stick else HELD
            functions = dict.fromkeys(held.get(name, name) for name in functions)
        self.functions = self._needed(bound, functions)

    def _needed(self, bound: Kernel, functions: Iterable[str]) -> tuple[str, ...]:
        """Those of these functions, which are called one after the other, that the rates depend on."""
        needed, found = set(self.rates.values()), []
        for function in reversed(list(functions)):
            signature = bound.signatures[function]
            if needed & {argument.name for argument in signature.outputs}:
                needed |= {argument.name for argument in signature.inputs}
                found.append(function)
        return tuple(reversed(found))

    @cached_property
    def core(self) -> np.ndarray:
        """Places of what has to be solved for: nu, and what the effects integrate."""
        rest = np.arange(len(self.state))
        return rest[(rest < 3) | (rest >= self.vector.plain)]

    @cached_property
    def carried(self) -> np.ndarray:
        """Places of what is carried along and feeds back: the wheels' angles and the heading."""
        chi = self.vector.slices["chi"]
        return np.append(np.arange(chi.start, chi.stop), self.vector.plain - 1)

    @cached_property
    def places(self) -> dict[str, np.ndarray]:
        """By name the places of a quantity among what deviates, and of an input behind all quantities."""
        found, start = {}, 0
        shapes = {name: self.vector.shapes[name] for name in self.rates} | self.inputs
        for name, shape in shapes.items():
            found[name] = start + np.arange(prod(shape)).reshape(shape)
            start += prod(shape)
        return found

    @property
    def input_size(self) -> int:
        return sum(map(prod, self.inputs.values()))

    def changes(self, inputs: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """(..., moving) by how much inputs (T, U) of rows change in the steps from rows (...)."""
        moving = slice(self.moving)
        return np.where(self.constant, 0.0, inputs[rows + 1, moving] - inputs[rows, moving])

    def views(self, inputs: np.ndarray) -> dict[str, np.ndarray]:
        """Inputs (..., U) by name."""
        found, start = {}, 0
        for name, shape in self.inputs.items():
            end = start + prod(shape)
            found[name] = inputs[..., start:end].reshape(*inputs.shape[:-1], *shape)
            start = end
        return found

    def joined(self, inputs: Mapping[str, np.ndarray]) -> np.ndarray:
        """The inverse of `views`."""
        lead = np.broadcast_shapes(*(inputs[name].shape[: -len(shape)] for name, shape in self.inputs.items()))
        return np.concatenate(
            [
                np.broadcast_to(inputs[name], (*lead, *shape)).reshape(*lead, prod(shape))
                for name, shape in self.inputs.items()
            ],
            axis=-1,
        )

    def known_in(self, y: np.ndarray, inputs: np.ndarray) -> dict[str, np.ndarray]:
        """What generated functions take, by name, in states y (..., size) with inputs (..., U)."""
        known = {name: self.vector.view(y, name) for name in self.vector.slices} | self.views(inputs)
        return known | dict.fromkeys(("theta", "heading"), known["pose"][..., 2])

    def known_of(
        self, kernel: Kernel, y: np.ndarray, inputs: np.ndarray, held: Mapping[str, np.ndarray]
    ) -> dict[str, np.ndarray]:
        """The same, with what the functions of the rates give; `held`, what sticks leaves to nu."""
        known = self.known_in(y, inputs) | dict(held)
        if self.grips and not self.corners:
            known |= pushes(kernel, known)
        if self.coupled:
            known |= self.loads_among(kernel, known)
            known |= self.pressed(kernel, known, known["loads"], known["loads"])
        elif self.loaded:
            known["load_factor"] = known["carries"]
        return self._called(kernel, known)

    def loads_among(self, kernel: Kernel, known: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """(..., N) in N, `loads` that follow the motion, and `compression`, what the springs of all contacts have.

        Of a load the bearing of a massless roller that turns leaves what is in no proportion to it. There loads are
        found by Newton's rule on numbers without tangents; with these one more round of it, at the solution, gives the
        tangents, whatever those of the point about which it is linear are."""
        about = self._about(known) if self.left else None
        return dict(zip(("loads", "compression"), self._found_about(kernel, known, about), strict=True))

    def _about(self, known: Mapping[str, np.ndarray]) -> np.ndarray:
        """(1, ..., N) or (..., N) in N, loads that follow the motion, which carry no tangents: all columns have the
        same, and they are found once."""
        real = {name: self._without_columns(name, value) for name, value in known.items()}

        def solve(about: np.ndarray) -> Carried:
            loads, compression = self._found_about(self.plain, real, about)
            return Carried(loads, loads, compression, np.ones(loads.shape[:-1]))

        return settled(solve, self.at_rest, float(self.at_rest.sum())).loads

    def _without_columns(self, name: str, value: np.ndarray) -> np.ndarray:
        """A value without tangents, of the first column alone where it has columns (P, ...)."""
        real = np.real(value)
        return real[:1] if np.iscomplexobj(value) and real.ndim > self._axes.get(name, real.ndim) else real

    @cached_property
    def _axes(self) -> dict[str, int]:
        """How many axes what generated functions take has in one state, by name."""
        taken = (argument for signature in self.plain.signatures.values() for argument in signature.inputs)
        return {argument.name: len(argument.shape) for argument in taken}

    def _found_about(
        self, kernel: Kernel, known: Mapping[str, np.ndarray], about: np.ndarray | None
    ) -> tuple[np.ndarray, np.ndarray]:
        """What loads_that_follow gives where friction beside bearings is linear about loads (..., N)."""

        def rates_under(loads: np.ndarray) -> dict[str, np.ndarray]:
            given = self.pressed(kernel, known, loads, about) if self.coupled else {"load_factor": known["carries"]}
            return self._called(kernel, dict(known) | given)

        return loads_that_follow(kernel, known, rates_under)

    def pressed(
        self, kernel: Kernel, known: Mapping[str, np.ndarray], loads: np.ndarray, about: np.ndarray | None
    ) -> dict[str, np.ndarray]:
        """What generated functions take of loads (..., N) by which friction goes; beside rollers that turn it is linear
        about loads (..., N), whose tangents are none."""
        if not self.left:
            return {"load_factor": loads}

        def left(there: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            return taken_and_gain(left_of(self.plain, known, there))

        turns = (np.real(known["contact_sticks"]) < 0.5) & (np.real(known["carries"]) > 0.5)
        if self.corners:
            turns &= np.real(known["sticks"]) < 0.5
        beside = BesideBearings.at(left, turns, np.real(about))
        if not self.corners:
            return {"load_factor": beside.factor(loads), "bearing_factor": 1 / beside.about}
        own = pushes(kernel, known, beside.about)
        own["ground_yield"] = pushes(kernel, known, np.where(turns, loads, 1.0))["ground_yield"]
        return {"load_factor": beside.factor(loads)} | own

    def _called(self, kernel: Kernel, known: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """With what the functions of the rates give."""
        for function in self.functions:
            names = [argument.name for argument in kernel.signatures[function].outputs]
            found = call_named(kernel, function, known)
            known |= dict(zip(names, found if len(names) > 1 else (found,), strict=True))
        return known

    def rates_of(
        self, kernel: Kernel, y: np.ndarray, inputs: np.ndarray, held: Mapping[str, np.ndarray] = NOTHING
    ) -> np.ndarray:
        """(..., m) the rates of what deviates, in states y (..., size) with inputs (..., U)."""
        return self.rates_among(self.known_of(kernel, y, inputs, held))

    def rates_among(self, known: Mapping[str, np.ndarray]) -> np.ndarray:
        """(..., m) the same from what known_of gives."""
        parts = [(known[rate], len(self.vector.shapes[name])) for name, rate in self.rates.items()]
        parts = [part.reshape(*part.shape[: part.ndim - axes], -1) for part, axes in parts]
        lead = np.broadcast_shapes(*(part.shape[:-1] for part in parts))
        return np.concatenate([np.broadcast_to(part, (*lead, part.shape[-1])) for part in parts], axis=-1)


class Variations:
    """The variational equations along a trajectory.

    trajectory  Trajectory with its polynomials
    plain       Kernel of the run, with Python's functions
    tangents    of the arguments of `prepare`, (Q, ...) by name, for Q numbers that deviate
    numbers     Q
    inputs      (T, U) what each row's phase was given
    nodes       inside a step; None: as many as the polynomials ask for
    held        from rows what sticks leaves to nu in their steps, and the same carrying the numbers' tangents
    contacts    those that may stick on the ground; None: there are none
    least       (P,) deviations of the wheels' angles in the columns that are nothing
    """

    def __init__(
        self,
        trajectory: Trajectory,
        plain: Kernel,
        tangents: Mapping[str, np.ndarray],
        numbers: int,
        deviations: Deviations,
        inputs: np.ndarray,
        nodes: int | None = None,
        held: Held | None = None,
        contacts: ContactModes | None = None,
        least: np.ndarray | float = NO_ANGLE,
    ):
        self.contacts = contacts
        self.trajectory, self.deviations, self.inputs, self.numbers = trajectory, deviations, inputs, numbers
        self.held = held or (lambda rows: (NOTHING, NOTHING))
        self.slopes = Slopes(deviations, trajectory, plain)
        of_numbers = {name: tangent[:, None] for name, tangent in tangents.items()}
        self.of_numbers = TangentKernel(plain, of_numbers, (numbers, 1)) if numbers else None
        self.inside = gauss(nodes or max(LEAST_NODES, trajectory.dense.shape[1] - 1))
        self.starts = trajectory.elapsed[trajectory.step_rows]
        self.lengths = trajectory.elapsed[trajectory.step_rows + 1] - self.starts
        self.kept: np.ndarray | None = None  # (S, s, m, m + F) what `rates_at_nodes` gives of all steps
        self.pieces = PiecesOfSteps(self, gauss(PIECE_NODES), plain.slips, least, asked=nodes is None)

    @property
    def width(self) -> tuple[int, int]:
        """How many numbers deviate in the state, and what drives it: inputs, how fast they change, numbers."""
        given = self.deviations.input_size + self.deviations.moving + self.numbers
        return len(self.deviations.state), given

    def chunks(self, count: int | None = None) -> Sequence[np.ndarray]:
        """Steps, or so many entries, in groups whose coefficients are computed together."""
        steps = np.arange(len(self.starts) if count is None else count)
        return np.array_split(steps, max(1, -(-len(steps) // STEPS_AT_ONCE)))

    def coefficients(self, steps: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A (k, s, m, m) and G (k, s, m, F) of the steps (k,) at parts x (k, s) of them: d' = A d + G (du, du', dp)."""
        size, rows = len(self.deviations.state), self.trajectory.step_rows[steps]
        (count, s), moving = x.shape, self.deviations.moving
        y = values_at(np.repeat(self.trajectory.dense[steps], s, axis=0), x.ravel())
        inputs = np.repeat(self.inputs[rows], s, axis=0)
        if moving:
            change = np.repeat(self.deviations.changes(self.inputs, rows), s, axis=0)
            inputs[:, :moving] += x.reshape(-1, 1) * change
        held, turning = self.held(np.repeat(rows, s))
        if self.contacts is not None:
            inputs = self.contacts.headed(y, inputs, np.repeat(rows + self.contacts.turns, s))
        slopes = self.slopes.at(y, inputs, held).reshape(count, s, size, -1)
        G = np.zeros((count, s, *self.width))
        given = self.deviations.input_size
        G[..., :given] = slopes[..., size:]
        times = (self.lengths[steps][:, None] * x)[..., None, None]
        G[..., given : given + moving] = times * slopes[..., size : size + moving]
        if self.of_numbers is not None:
            found = tangent_of(self.deviations.rates_of(self.of_numbers, y, inputs, turning))
            G[..., given + moving :] = np.moveaxis(found.reshape(self.numbers, count, s, size), 0, -1)
        self.directions = None
        if self.contacts is not None and self.contacts.turns:
            found = self._directions(y, inputs, np.repeat(rows, s))
            self.directions = tuple(part.reshape(count, s, *part.shape[1:]) for part in found)
        return slopes[..., :size], G

    def _directions(self, y: np.ndarray, inputs: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Slopes (k, N, m + F) of the slips across their directions in states (k, size), and (k, N) the slips along
        them; where a slip does not turn 0, and 1."""
        deviations, slides = self.deviations, self.contacts.turning[rows]
        m, headings = len(deviations.state), deviations.views(inputs)["slip_heading"]
        slopes = np.zeros((*slides.shape, m + self.width[1]))
        unit = np.zeros((m, 1, y.shape[1]))
        unit[np.arange(m), 0, deviations.state] = 1.0
        known = deviations.known_in(with_tangent(y, unit), inputs)
        along, across = self.contacts.along_and_across(self.slopes.carrying, known, headings)
        slopes[..., :m] = np.moveaxis(tangent_of(across), 0, -1)
        if self.of_numbers is not None:
            known = deviations.known_in(y, inputs)
            moved = tangent_of(self.contacts.along_and_across(self.of_numbers, known, headings)[1])
            slopes[..., m + deviations.input_size + deviations.moving :] = np.moveaxis(moved, 0, -1)
        return np.where(slides[..., None], slopes, 0.0), np.where(slides, along[0].real, 1.0)

    def rates_at_nodes(self, steps: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Some of the steps (k,), one group after the other, and (l, s, m, m + F) the rates of the deviation at their
        nodes by what it depends on."""
        parts = np.array_split(np.arange(len(steps)), max(1, -(-len(steps) // SOLVED_AT_ONCE)))
        if self.kept is not None:
            yield from ((steps[part], self.kept[steps[part]]) for part in parts)
            return
        A, G = self.coefficients(steps, np.tile(self.inside.nodes, (len(steps), 1)))
        directions = self.directions
        for part in parts:
            to_nodes = self.inside.to_nodes * self.lengths[steps[part]][:, None, None]
            turning = None if directions is None else tuple(own[part] for own in directions)
            rates = self.solved(A[part], G[part], to_nodes, turning)
            self.pieces.look(steps[part], A[part], rates, _which_turn(turning, len(part)))
            yield steps[part], rates

    def solved(
        self, A: np.ndarray, G: np.ndarray, to_nodes: np.ndarray, turning: tuple[np.ndarray, np.ndarray] | None = None
    ) -> np.ndarray:
        """(l, s, m, m + F) the rates d' = A d + G at the nodes, by d at the start and by what is given.

        The core c and what it carries, g, with g' = A_gc c + G_g: only the core has to be solved for. The place on the
        plane feeds nothing back. to_nodes (l, s, s) integrates rates at the nodes up to each node. `turning`, where
        directions of slips turn: what _directions gives, (l, s, ...).
        """
        count, s, size = A.shape[:3]
        core, carried = self.deviations.core, self.deviations.carried

        def integral(rates: np.ndarray) -> np.ndarray:
            return (to_nodes @ rates.reshape(count, s, -1)).reshape(rates.shape)

        to_core, of_core = A[:, :, core[:, None], carried], A[:, :, carried[:, None], core]
        of_itself = A[:, :, core[:, None], core]
        start = np.eye(size, size + G.shape[-1])
        forced = np.zeros((count, s, size, size + G.shape[-1]))
        forced[..., size:] = G
        known = start[carried] + integral(forced[:, :, carried])
        right = start[core] + integral(to_core @ known + forced[:, :, core])
        turns = _which_turn(turning, count)
        solved, rest = np.empty_like(right), np.flatnonzero(~turns)
        at_nodes = np.zeros_like(forced)
        if turns.any():
            slopes, along = (own[turns] for own in turning)
            of_turns = G[turns][..., self.deviations.places["slip_heading"] - size]
            force = -slopes[..., carried] @ known[turns]
            force[..., size:] -= slopes[..., size:]
            solved[turns], found = _turned(
                right[turns], force, to_nodes[turns], (to_core[turns], of_core[turns], of_itself[turns]),
                of_turns[:, :, core], (slopes[..., core], slopes[..., carried]), along,
            )  # fmt: skip
            forced[turns] += of_turns @ found
        if rest.size:
            solved[rest] = _solved_plainly(right[rest], to_nodes[rest], to_core[rest], of_core[rest], of_itself[rest])
        at_nodes[:, :, core] = solved
        at_nodes[:, :, carried] = known + integral(of_core @ solved)
        return np.add(forced, A @ at_nodes, out=forced)

    def maps(self) -> np.ndarray:
        """(S, m, m + F) what the deviation at the end of each step is, by that at its start and by what is given."""
        state, given = self.width
        found = np.zeros((len(self.starts), state, state + given))
        shape = (len(self.starts), len(self.inside.nodes), state, state + given)
        kept = np.empty(shape) if prod(shape) <= KEPT else None
        for steps in self.chunks():
            for some, rates in self.rates_at_nodes(steps):
                if kept is not None:
                    kept[some] = rates
                means = self.inside.weights @ rates.reshape(*rates.shape[:2], -1)
                found[some] = means.reshape(found[some].shape) * self.lengths[some][:, None, None]
        found[:, range(state), range(state)] += 1.0
        self.kept = kept
        return found

    def come_to(self, steps: np.ndarray, x: np.ndarray, deviation: np.ndarray, given: np.ndarray) -> np.ndarray:
        """(k, m, P) what deviations come to at the parts x (k,) of the steps (k,).

        deviation, given  (S, m, P) at the starts of all steps, and (S, F, P) what drives them
        """
        wanted, back = np.unique(steps, return_inverse=True)
        found = np.empty((len(steps), *deviation.shape[1:]))
        done = 0
        for part in self.chunks(len(wanted)):
            for own, rates in self.rates_at_nodes(wanted[part]):
                rates = rates @ np.concatenate([deviation[own], given[own]], axis=1)[:, None]
                (here,) = np.nonzero((back >= done) & (back < done + len(own)))
                weights = self.inside.integrals(x[here]) * self.lengths[steps[here]][:, None]
                found[here] = np.einsum("ks,ksmp->kmp", weights, rates[back[here] - done])
                done += len(own)
        for step in self.pieces.asked_in(wanted, deviation, given):
            for k in np.flatnonzero(steps == step):
                found[k] = self.pieces.moved(step, x[k], deviation[step], given[step]) - deviation[step]
        return found


def _which_turn(turning: tuple[np.ndarray, np.ndarray] | None, count: int) -> np.ndarray:
    """(l,) bool: steps in which directions of slips turn."""
    return np.zeros(count, bool) if turning is None else turning[0].any(axis=(1, 2, 3))


def _solved_plainly(
    right: np.ndarray, to_nodes: np.ndarray, to_core: np.ndarray, of_core: np.ndarray, of_itself: np.ndarray
) -> np.ndarray:
    """x = right + felt(x) (l, s, c, w) of l steps: by sweeps, or where rates are fast by one linear system."""

    def integral(rates: np.ndarray) -> np.ndarray:
        return (to_nodes @ rates.reshape(*rates.shape[:2], -1)).reshape(rates.shape)

    solved, found = _by_sweeps(right, lambda x: integral(to_core @ integral(of_core @ x) + of_itself @ x))
    slow = np.flatnonzero(~found)
    if slow.size:
        solved[slow] = _at_once(right[slow], to_nodes[slow], to_core[slow], of_core[slow], of_itself[slow])
    return solved


def _by_sweeps(right: np.ndarray, felt: Callable[[np.ndarray], np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """(l, s, c, w) x = right + felt(x) of l steps, and (l,) bool of which it was found.

    What is felt is an integral from the step's start, so that the changes fall as a power over a factorial. Where those
    of a column rise first, rates are fast, and what the changes cancel would have cost digits.
    """
    found, change, size = right.copy(), right, np.abs(right).max(axis=(1, 2))
    rises, is_found = np.zeros(len(right), bool), np.zeros(len(right), bool)
    with np.errstate(over="ignore", invalid="ignore"):  # of those that rise
        for _ in range(MOST_SWEEPS):
            change = felt(change)
            found += change
            largest = np.abs(change).max(axis=(1, 2))
            rises |= ~(largest <= RISES * size).all(axis=1)
            is_found = (largest <= ENOUGH * size).all(axis=1) & ~rises
            if (is_found | rises).all():
                break
    return found, is_found


def _turned(
    right: np.ndarray,
    force: np.ndarray,
    to_nodes: np.ndarray,
    slopes: tuple[np.ndarray, np.ndarray, np.ndarray],
    of_turns: np.ndarray,
    across: tuple[np.ndarray, np.ndarray],
    along: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """x = right + felt(x, turns) (l, s, c, w) and the turns (l, s, N, w) of directions, by one linear system a step:

        slips across directions = turn times slip along them,

    which is as regular where a slip is zero as elsewhere (directed.py). `force`, what the slips across get beside x.
    """
    count, s, size, wide = right.shape
    turning = along.shape[-1]
    system = np.zeros((count, s * (size + turning), s * (size + turning)))
    (to_core, of_core, of_itself), (of_x, of_carried), rates = slopes, across, slice(0, s * size)
    system[:, rates, rates] = _system(to_nodes, to_core, of_core, of_itself)
    turns = slice(s * size, None)
    by_turns = to_nodes[:, :, None, :, None] * of_turns.swapaxes(1, 2)[:, None]
    system[:, rates, turns] = -by_turns.reshape(count, s * size, s * turning)
    over = to_nodes[:, :, None, :, None] * of_core.swapaxes(1, 2)[:, None]
    slip = (of_carried @ over.reshape(count, s, of_core.shape[2], s * size)).reshape(count, s, turning, s, size)
    slip[:, range(s), :, range(s)] += of_x.swapaxes(0, 1)
    system[:, turns, rates] = slip.reshape(count, s * turning, s * size)
    system[:, range(s * size, s * (size + turning)), range(s * size, s * (size + turning))] = -along.reshape(count, -1)
    whole = np.concatenate([right.reshape(count, s * size, wide), force.reshape(count, s * turning, wide)], axis=1)
    found = np.linalg.solve(system, whole)
    return found[:, rates].reshape(right.shape), found[:, turns].reshape(count, s, turning, wide)


def _at_once(
    right: np.ndarray, to_nodes: np.ndarray, to_core: np.ndarray, of_core: np.ndarray, of_itself: np.ndarray
) -> np.ndarray:
    """The same by one linear system a step."""
    count, s, size, _ = right.shape
    system = _system(to_nodes, to_core, of_core, of_itself)
    return np.linalg.solve(system, right.reshape(count, s * size, -1)).reshape(right.shape)


def _system(to_nodes: np.ndarray, to_core: np.ndarray, of_core: np.ndarray, of_itself: np.ndarray) -> np.ndarray:
    """(l, s c, s c) what it takes from the core at the nodes to what is given for it there."""
    count, s, size, carried = *to_core.shape[:3], of_core.shape[2]
    wide = s * size
    # What the core at node k does to the carried at node j, and by it to the core's rates there.
    over = to_nodes[:, :, None, :, None] * of_core.swapaxes(1, 2)[:, None]
    felt = (to_core @ over.reshape(count, s, carried, wide)).reshape(count, s, size, s, size)
    felt[:, range(s), :, range(s)] += of_itself.swapaxes(0, 1)
    return np.eye(wide) - (to_nodes @ felt.reshape(count, s, -1)).reshape(count, wide, wide)
