"""How small deviations of a run grow along one of its steps: the variational equations, solved along its polynomials.

Where y' = f(y, u, p) and y(t) is known, a deviation follows d' = f_y d + f_u du + f_p dp: a linear equation, whose
coefficients are evaluated at the nodes of a Gauss formula on each step, for many steps at once. Collocation at these
nodes then is one linear system a step. It gives the deviation at the nodes, and at any time, as a linear function of
what it is at the step's start, of the inputs' deviations and of the numbers'.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from numpy.polynomial import legendre

from omniroll.effects.bound_rates import PLAIN, PLAIN_RATES, dynamics_with
from omniroll.effects.effect_set import EffectSet
from omniroll.kernels.kernel import Kernel
from omniroll.kernels.tangent_kernel import TangentKernel, tangent_of, with_tangent
from omniroll.results.accelerations import call_named
from omniroll.results.dense import values_at
from omniroll.results.trajectory import Trajectory

LEAST_NODES = 8
NUMBERS_AT_ONCE = 2**21  # of one array, where several steps are computed together


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

    state   names of the quantities that are integrated, and of the rates that the generated functions give them
    inputs  names and shapes of what a phase is given: the momenta of free rollers, where they are constant, and what
            the drives give
    """

    def __init__(self, effects: EffectSet, bound: Kernel):
        vector = effects.state_vector(bound)
        added = [quantity for quantity in vector.quantities if not quantity.account]
        self.rates = PLAIN_RATES | {quantity.name: quantity.rate for quantity in added}
        self.vector = vector
        self.state = np.concatenate([np.arange(vector.size)[vector.slices[name]] for name in self.rates])
        self.inputs = {name: (bound.wheels,) for name in effects.drives()}
        if bound.has_spins and not {"momenta", "axial", "spins"} & set(vector.slices):
            self.inputs["momenta"] = (bound.wheels, 2)
        asked = effects.functions(bound.roller_model)
        self.functions = tuple(dict.fromkeys((*asked, dynamics_with(asked), *PLAIN)))

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

    @property
    def input_size(self) -> int:
        return sum(int(np.prod(shape)) for shape in self.inputs.values())

    def views(self, inputs: np.ndarray) -> dict[str, np.ndarray]:
        """Inputs (..., U) by name."""
        found, start = {}, 0
        for name, shape in self.inputs.items():
            end = start + int(np.prod(shape))
            found[name] = inputs[..., start:end].reshape(*inputs.shape[:-1], *shape)
            start = end
        return found

    def joined(self, inputs: Mapping[str, np.ndarray]) -> np.ndarray:
        """The inverse of `views`."""
        lead = np.broadcast_shapes(*(inputs[name].shape[: -len(shape)] for name, shape in self.inputs.items()))
        return np.concatenate(
            [
                np.broadcast_to(inputs[name], (*lead, *shape)).reshape(*lead, int(np.prod(shape)))
                for name, shape in self.inputs.items()
            ],
            axis=-1,
        )

    def rates_of(self, kernel: Kernel, y: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """(..., m) the rates of what deviates, in states y (..., size) with inputs (..., U)."""
        known = {name: self.vector.view(y, name) for name in self.vector.slices} | self.views(inputs)
        known["theta"] = known["heading"] = known["pose"][..., 2]
        for function in self.functions:
            names = [argument.name for argument in kernel.signatures[function].outputs]
            found = call_named(kernel, function, known)
            known |= dict(zip(names, found if len(names) > 1 else (found,), strict=True))
        parts = [(known[rate], len(self.vector.shapes[name])) for name, rate in self.rates.items()]
        return np.concatenate([part.reshape(*part.shape[: part.ndim - axes], -1) for part, axes in parts], axis=-1)


class Variations:
    """The variational equations along a trajectory, for P columns of deviations of numbers.

    trajectory  Trajectory with its polynomials
    plain       Kernel of the run
    tangents    of the arguments of `prepare`, (P, ...) by name
    columns     P
    inputs      (T, U) what each row's phase was given
    """

    def __init__(
        self,
        trajectory: Trajectory,
        plain: Kernel,
        tangents: Mapping[str, np.ndarray],
        columns: int,
        deviations: Deviations,
        inputs: np.ndarray,
    ):
        self.trajectory, self.deviations, self.inputs = trajectory, deviations, inputs
        self.of_state = TangentKernel(plain)
        numbered = [k for k in range(columns) if any(tangent[k].any() for tangent in tangents.values())]
        self.columns, self.numbered = columns, numbered
        of_numbers = {name: tangent[numbered][:, None] for name, tangent in tangents.items()}
        self.of_numbers = TangentKernel(plain, of_numbers, (len(numbered), 1)) if numbered else None
        self.gauss = gauss(max(LEAST_NODES, trajectory.dense.shape[1] - 1))
        self.starts = trajectory.elapsed[trajectory.step_rows]
        self.lengths = trajectory.elapsed[trajectory.step_rows + 1] - self.starts

    @property
    def width(self) -> tuple[int, int]:
        """How many numbers deviate in the state, and in the inputs."""
        return len(self.deviations.state), self.deviations.input_size

    def chunks(self, count: int | None = None) -> Sequence[np.ndarray]:
        """Steps, or so many entries, in groups that are computed together."""
        state, inputs = self.width
        size = max((state + inputs + len(self.numbered)) * len(self.gauss.nodes), (len(self.gauss.nodes) * state) ** 2)
        steps = np.arange(len(self.starts) if count is None else count)
        return np.array_split(steps, max(1, -(-len(steps) * size // NUMBERS_AT_ONCE)))

    def coefficients(self, steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A (k, s, m, m) and G (k, s, m, 2 U + P) of the steps (k,) at the nodes: d' = A d + G (du, du', dp)."""
        nodes, (size, given) = self.gauss.nodes, self.width
        rows = self.trajectory.step_rows[steps]
        count, s = len(steps), len(nodes)
        dense = np.repeat(self.trajectory.dense[steps], s, axis=0)
        y = values_at(dense, np.tile(nodes, count))
        part = np.tile(nodes, count)[:, None]
        inputs = np.repeat(self.inputs[rows], s, axis=0)
        inputs = inputs + part * (np.repeat(self.inputs[rows + 1], s, axis=0) - inputs)
        along = np.zeros((size + given, 1, y.shape[1] + given))
        along[np.arange(size), 0, self.deviations.state] = 1
        along[size + np.arange(given), 0, y.shape[1] + np.arange(given)] = 1
        own = self.deviations.rates_of(
            self.of_state, with_tangent(y, along[..., : y.shape[1]]), with_tangent(inputs, along[..., y.shape[1] :])
        )
        slopes = tangent_of(own).reshape(size + given, count, s, size).transpose(1, 2, 3, 0)
        by_numbers = np.zeros((count, s, size, self.columns))
        if self.of_numbers is not None:
            found = tangent_of(self.deviations.rates_of(self.of_numbers, y, inputs))
            by_numbers[..., self.numbered] = found.reshape(-1, count, s, size).transpose(1, 2, 3, 0)
        by_inputs = slopes[..., size:]
        times = (self.lengths[steps][:, None] * nodes)[..., None, None]
        return slopes[..., :size], np.concatenate([by_inputs, times * by_inputs, by_numbers], axis=-1)

    def rates_at_nodes(self, steps: np.ndarray) -> np.ndarray:
        """(k, s, m, m + 2 U + P) the rates of the deviation at the nodes of steps (k,), by what it depends on.

        The core c and what it carries, g, with g' = A_gc c + G_g: only the core has to be solved for. The place on the
        plane feeds nothing back.
        """
        A, G = self.coefficients(steps)
        count, s, size = A.shape[:3]
        core, carried = self.deviations.core, self.deviations.carried
        to_nodes = self.gauss.to_nodes * self.lengths[steps][:, None, None]  # of rates at nodes, what they come to

        def integral(rates: np.ndarray) -> np.ndarray:
            return (to_nodes @ rates.reshape(count, s, -1)).reshape(rates.shape)

        to_core, of_core = A[:, :, core[:, None], carried], A[:, :, carried[:, None], core]
        start = np.concatenate([np.eye(size), np.zeros((size, G.shape[-1]))], axis=1)
        forced = np.concatenate([np.zeros((count, s, size, size)), G], axis=-1)
        known = start[carried] + integral(forced[:, :, carried])
        right = start[core] + integral(to_core @ known + forced[:, :, core])
        inner = np.einsum("ijk,ikl,ikab,ilbc->ijalc", to_nodes, to_nodes, to_core, of_core, optimize=True)
        system = inner + np.einsum("ijk,ikab->ijakb", to_nodes, A[:, :, core[:, None], core])
        wide = s * len(core)
        at_nodes = np.zeros((count, s, size, start.shape[1]))
        at_nodes[:, :, core] = np.linalg.solve(
            np.eye(wide) - system.reshape(count, wide, wide), right.reshape(count, wide, -1)
        ).reshape(right.shape)
        at_nodes[:, :, carried] = known + integral(of_core @ at_nodes[:, :, core])
        return A @ at_nodes + forced

    def maps(self, steps: np.ndarray) -> np.ndarray:
        """(k, m, m + 2 U + P) how far the deviation has come at the ends of the steps, less what it was."""
        rates = self.rates_at_nodes(steps)
        return np.einsum("j,ijab->iab", self.gauss.weights, rates) * self.lengths[steps][:, None, None]

    def within(self, steps: np.ndarray, x: np.ndarray) -> np.ndarray:
        """The same at the parts x (k,) of the steps (k,)."""
        weights = self.gauss.integrals(x) * self.lengths[steps][:, None]
        return np.einsum("ij,ijab->iab", weights, self.rates_at_nodes(steps))
