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

from omniroll.effects.bound_rates import PLAIN, PLAIN_RATES, dynamics_with
from omniroll.effects.effect_set import BEARINGS, MOMENTS, EffectSet
from omniroll.engine.contact_modes import MODES, pushes
from omniroll.engine.pieces_of_steps import PiecesOfSteps
from omniroll.engine.slopes import NOTHING, Slopes
from omniroll.kernels.kernel import Kernel
from omniroll.kernels.tangent_kernel import TangentKernel, tangent_of
from omniroll.results.accelerations import call_named
from omniroll.results.dense import values_at
from omniroll.results.trajectory import Trajectory

HELD = {"forward_dynamics": "held_dynamics", "accelerations": "held_accelerations"}  # the same where axles stick
HELD_WITH_SPINS = {"accelerations": "stuck_accelerations"}  # the same where free rollers may stick, too
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
        self.grips = "sticks" in drives
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
        if self.grips:
            known |= pushes(kernel, known)
        return self._called(kernel, known)

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
        least: np.ndarray | float = NO_ANGLE,
    ):
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
        slopes = self.slopes.at(y, inputs, held).reshape(count, s, size, -1)
        G = np.zeros((count, s, *self.width))
        given = self.deviations.input_size
        G[..., :given] = slopes[..., size:]
        times = (self.lengths[steps][:, None] * x)[..., None, None]
        G[..., given : given + moving] = times * slopes[..., size : size + moving]
        if self.of_numbers is not None:
            found = tangent_of(self.deviations.rates_of(self.of_numbers, y, inputs, turning))
            G[..., given + moving :] = np.moveaxis(found.reshape(self.numbers, count, s, size), 0, -1)
        return slopes[..., :size], G

    def rates_at_nodes(self, steps: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Some of the steps (k,), one group after the other, and (l, s, m, m + F) the rates of the deviation at their
        nodes by what it depends on."""
        parts = np.array_split(np.arange(len(steps)), max(1, -(-len(steps) // SOLVED_AT_ONCE)))
        if self.kept is not None:
            yield from ((steps[part], self.kept[steps[part]]) for part in parts)
            return
        A, G = self.coefficients(steps, np.tile(self.inside.nodes, (len(steps), 1)))
        for part in parts:
            to_nodes = self.inside.to_nodes * self.lengths[steps[part]][:, None, None]
            rates = self.solved(A[part], G[part], to_nodes)
            self.pieces.look(steps[part], A[part], rates)
            yield steps[part], rates

    def solved(self, A: np.ndarray, G: np.ndarray, to_nodes: np.ndarray) -> np.ndarray:
        """(l, s, m, m + F) the rates d' = A d + G at the nodes, by d at the start and by what is given.

        The core c and what it carries, g, with g' = A_gc c + G_g: only the core has to be solved for. The place on the
        plane feeds nothing back. to_nodes (l, s, s) integrates rates at the nodes up to each node.
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
        solved, at_nodes = _solved_plainly(right, to_nodes, to_core, of_core, of_itself), np.zeros_like(forced)
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
