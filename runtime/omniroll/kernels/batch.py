"""nu' of many vehicles in one call: runtime/csrc/batch.c computes sixteen vehicles at a time in vector registers.

This serves who integrates thousands of vehicles together, samples rollouts or fits parameters. In all arrays the
vehicle is the last index, so that the C code reads them as they are.
"""

from collections.abc import Callable, Sequence
from functools import partial
from types import SimpleNamespace

import numpy as np

from omniroll.errors import InvalidValueError
from omniroll.kernels import sets
from omniroll.kernels.kernel import CompiledKernel, kernel
from omniroll.kernels.lanes import MOST_WHEELS, aligned
from omniroll.validation import choice, sequence
from omniroll.vehicles.checks import joint_angle, refuse_kinds, refuse_moving_rows, refuse_two_rows
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import ROLLER_MODELS

VEHICLES = "must be a Vehicle or a sequence of them, at least one"


class Batch:
    """The reduced kernel of V vehicles, all with the same N and n.

    vehicles      a Vehicle, for any number of states; or a sequence of V vehicles, one for each state
    roller_model  "free", "locked" or "massless"

    Raises InvalidValueError, a ValueError; KernelsMissingError where the compiled engine was not built.
    """

    def __init__(self, vehicles: Vehicle | Sequence[Vehicle], roller_model: str = "free"):
        choice("roller_model", roller_model, ROLLER_MODELS)
        self.shared = isinstance(vehicles, Vehicle)
        self.vehicles = [vehicles] if self.shared else sequence("vehicles", vehicles, VEHICLES)
        kernels = _checked(self.vehicles, roller_model)
        first = kernels[0]
        self.wheels, self.rollers_per_wheel, self.has_momenta = first.wheels, first.rollers_per_wheel, first.has_spins
        module = sets.engine(first.base, first.effects, first.wheels, first.sharp)
        self._ffi, self._function = module.ffi, module.lib.omniroll_forward_dynamics_batch
        self._constants = _blocks(module, kernels)
        self._largest_angle = joint_angle(self.rollers_per_wheel)

    def accelerations(self, nu: np.ndarray, chi: np.ndarray, momenta: np.ndarray | None = None) -> np.ndarray:
        """nu' (3, V) in 1/s^2, equation (3.4) solved.

        nu       (3, V) in 1/s
        chi      (N, V) in rad, |chi| <= pi/n
        momenta  (N, 2, V) in kg m^2/s of free rollers, as Kernel.momenta gives them; None for the other models

        Each result is that of Kernel.forward_dynamics to the last bits; calls may run in several threads. Raises
        InvalidValueError for other shapes, angles beyond the roller and results that are not finite.
        """
        count = self._count(nu)
        shapes = self._shapes(count, momenta)
        given = {"nu": nu, "chi": chi, "momenta": momenta}
        arrays = {field: _doubles(field, given[field], shape) for field, shape in shapes.items()}
        nu_dot = np.empty((3, count))
        self.bind(**arrays, nu_dot=nu_dot)()
        outside = np.abs(arrays["chi"]) > self._largest_angle
        if outside.any():
            bound = f"must be on the roller, at most pi/n = {self._largest_angle!r}"
            raise InvalidValueError("chi", float(arrays["chi"][outside][0]), bound)
        if not np.isfinite(nu_dot).all():
            self._refuse(arrays)
        return nu_dot

    def bind(
        self, nu: np.ndarray, chi: np.ndarray, momenta: np.ndarray | None = None, *, nu_dot: np.ndarray
    ) -> Callable[[], None]:
        """`accelerations` as a function without arguments that reads arrays and writes one, for loops.

        nu, chi, momenta  as of accelerations: contiguous arrays of doubles, whose numbers are not checked
        nu_dot            (3, V), where the results go; it must be another array than nu

        The function may run in one thread at a time. Raises InvalidValueError for arrays of another shape, kind or
        order.
        """
        count = self._count(nu_dot)
        shapes = self._shapes(count, momenta)
        given = {"nu": nu, "chi": chi, "momenta": momenta}
        arrays = {field: given[field] for field in shapes} | {"nu_dot": nu_dot}
        for field, array in arrays.items():
            _refuse_unless_bindable(field, array, shapes.get(field, shapes["nu"]))
        pointers = [self._pointer(arrays[field]) for field in ("nu", "chi")]
        pointers.append(self._pointer(arrays["momenta"]) if self.has_momenta else self._ffi.NULL)
        head = (count, self.wheels, self.rollers_per_wheel, self._pointer(self._constants), self.shared)
        return partial(self._function, *head, *pointers, self._pointer(nu_dot))

    def _count(self, nu: np.ndarray) -> int:
        """How many states there are: as many as vehicles, or as columns of nu where one vehicle serves them all."""
        try:
            shape = np.shape(nu)
        except Exception:  # ragged rows, or an object whose own code fails: refused where it is read
            shape = ()
        return shape[-1] if self.shared and len(shape) == 2 else len(self.vehicles)

    def _shapes(self, count: int, momenta: np.ndarray | None) -> dict[str, tuple[int, ...]]:
        """Shapes of the inputs for `count` vehicles; refuses momenta that are missing, or one too many."""
        if self.has_momenta != (momenta is not None):
            bound = "is needed for free rollers" if self.has_momenta else "must be None but for free rollers"
            raise InvalidValueError("momenta", momenta, bound)
        shapes = {"nu": (3, count), "chi": (self.wheels, count)}
        return shapes | {"momenta": (self.wheels, 2, count)} if self.has_momenta else shapes

    def _refuse(self, arrays: dict[str, np.ndarray]) -> None:
        """An error that says why nu_dot is not finite."""
        for field, array in arrays.items():
            if not np.isfinite(array).all():
                raise InvalidValueError(field, float(array[~np.isfinite(array)][0]), "must be finite")
        raise InvalidValueError("nu", float(np.abs(arrays["nu"]).max()), "gives accelerations beyond the number range")

    def _pointer(self, array: np.ndarray):
        return self._ffi.from_buffer("double[]", array)


def _checked(vehicles: list[Vehicle], roller_model: str) -> list[CompiledKernel]:
    """The vehicles' kernels, of one N, n and set."""
    if not vehicles or not all(isinstance(vehicle, Vehicle) for vehicle in vehicles):
        raise InvalidValueError("vehicles", vehicles, VEHICLES)
    first = vehicles[0]
    if first.wheels > MOST_WHEELS:
        raise InvalidValueError("vehicles", first, f"must have at most {MOST_WHEELS} wheels")
    kernels: list[CompiledKernel] = []
    for k, vehicle in enumerate(vehicles):
        refuse_two_rows(vehicle, f"vehicles[{k}]", vehicle, "take kernel()")
        refuse_moving_rows(vehicle, f"vehicles[{k}]", vehicle, "use kernel()")
        refuse_kinds(vehicle, f"vehicles[{k}]", vehicle, "use kernel()")
        if vehicle.has_layout:
            raise InvalidValueError(f"vehicles[{k}]", vehicle, "has a layout, which this kernel lacks; use kernel()")
        if (vehicle.wheels, vehicle.rollers_per_wheel) != (first.wheels, first.rollers_per_wheel):
            raise InvalidValueError(f"vehicles[{k}]", vehicle, "must have as many wheels and rollers as the first")
        kernels.append(kernel(vehicle, roller_model))
        if kernels[k].sharp != kernels[0].sharp:
            bound = "has rollers with far sharper or blunter tips than the first; put them into a batch of their own"
            raise InvalidValueError(f"vehicles[{k}]", vehicle, bound)
    return kernels


def _blocks(module: SimpleNamespace, kernels: list[CompiledKernel]) -> np.ndarray:
    """The constants of all vehicles in blocks of sixteen; batch.c. The model in a block points into the block."""
    first, count = kernels[0], len(kernels)
    constants = aligned(module.lib.omniroll_blocks_size(count, first.wheels, first.rollers_per_wheel))
    models = module.ffi.new("omniroll_model *[]", [own.model_for(module.ffi) for own in kernels])
    module.lib.omniroll_fill_blocks(count, models, module.ffi.from_buffer("double[]", constants))
    return constants


def _doubles(field: str, value: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """`value` as a contiguous array of doubles."""
    try:
        array = np.ascontiguousarray(value, dtype=float)
    except Exception:  # ragged rows, texts, or an object whose own code fails
        raise InvalidValueError(field, value, "must be an array of real numbers") from None
    if array.shape != shape:
        raise InvalidValueError(field, array.shape, f"must have the shape {shape}")
    return array


def _refuse_unless_bindable(field: str, array: np.ndarray, shape: tuple[int, ...]) -> None:
    """The C code takes the array as it is: its numbers, their order and how many there are."""
    if not isinstance(array, np.ndarray) or array.dtype != float or not array.flags.c_contiguous:
        raise InvalidValueError(field, array, "must be a contiguous array of doubles")
    if array.shape != shape:
        raise InvalidValueError(field, array.shape, f"must have the shape {shape}")
