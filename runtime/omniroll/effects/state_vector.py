"""Where each quantity stands in a state y = (nu, chi, pose, what the effects integrate)."""

from collections.abc import Mapping, Sequence
from math import prod

import numpy as np

from omniroll.effects.registry import Quantity
from omniroll.kernels.kernel import Kernel


class Layout:
    """Names, places and shapes of quantities in a row of numbers.

    shapes  by name, in their order
    """

    def __init__(self, shapes: Mapping[str, tuple[int, ...]]):
        self.shapes, self.slices, self.size = shapes, {}, 0
        for name, shape in shapes.items():
            self.slices[name] = slice(self.size, self.size + prod(shape))
            self.size += prod(shape)

    def view(self, y: np.ndarray, name: str) -> np.ndarray:
        """The quantity in rows (..., size): a view."""
        return y[..., self.slices[name]].reshape(y.shape[:-1] + self.shapes[name])

    def views(self, y: np.ndarray) -> dict[str, np.ndarray]:
        """All quantities by name."""
        return {name: self.view(y, name) for name in self.slices}

    def joined(self, views: Mapping[str, np.ndarray]) -> np.ndarray:
        """The inverse of `views`, of quantities whose leading axes broadcast."""
        lead = np.broadcast_shapes(*(views[name].shape[: -len(shape)] for name, shape in self.shapes.items()))
        whole = ((np.broadcast_to(views[name], (*lead, *shape)), prod(shape)) for name, shape in self.shapes.items())
        return np.concatenate([view.reshape(*lead, size) for view, size in whole], axis=-1)


class StateVector(Layout):
    """A state y: nu, chi, the pose, and what the effects integrate."""

    def __init__(self, kernel: Kernel, quantities: Sequence[Quantity]):
        self.quantities = tuple(quantities)
        shapes = {"nu": (3,), "chi": (kernel.wheels,), "pose": (3,)}
        if self.quantities:
            outputs = {a.name: a.shape for signature in kernel.signatures.values() for a in signature.outputs}
            shapes |= {quantity.name: outputs[quantity.rate] for quantity in self.quantities}
        super().__init__(shapes)
        self.plain = self.slices["pose"].stop  # the part that every vehicle has

    def scale_of_added(self, kernel: Kernel, speed: float) -> np.ndarray:
        """The size of each component that effects add, where the vehicle moves at |nu| = speed."""
        if not self.quantities:
            return np.zeros(0)
        along = speed * np.eye(3)
        rest = kernel.spins_or_nothing(np.zeros((kernel.wheels, kernel.rollers_per_wheel - 1)))
        energy = kernel.energy(along, np.zeros(kernel.wheels), *rest).max()
        _, spins = kernel.wheel_rates(along, np.zeros(kernel.wheels))
        spin = np.abs(spins).max()
        sizes = {"energy": energy, "momentum": kernel.vehicle.roller_inertia * spin, "speed": spin}
        sizes |= sizes_on_springs(kernel)
        return np.concatenate(
            [np.full(prod(self.shapes[quantity.name]), sizes[quantity.size]) for quantity in self.quantities]
        )

    def put(self, y: np.ndarray, values: Mapping[str, np.ndarray]) -> None:
        """Write quantities into a state (size,)."""
        for name, value in values.items():
            y[self.slices[name]] = np.ravel(value)


def sizes_on_springs(kernel: Kernel) -> dict[str, float]:
    """Of heave and tilt, and of their rates, where a platform stands on springs: as under twice the load at rest."""
    if "spring_load" not in kernel.constant_names:
        return {}
    load, stiffness = (np.array(kernel.constant(name)) for name in ("spring_load", "spring_stiffness"))
    deflection = float((load / stiffness).min())
    return {"deflection": deflection, "deflection_rate": float(np.sqrt(kernel.constant("tilt_gravity") * deflection))}
