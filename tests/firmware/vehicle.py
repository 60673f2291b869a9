"""A vehicle as a controller has it: the model, the state and the step of a pair of C files, called from Python."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

import omniroll
from omniroll.kernels import sets
from omniroll.kernels.kernel import NUMBER_TYPES, VEHICLE_SCALARS

OK, BAD_COUNT, BAD_NUMBER, BAD_SHAPE, BAD_STATE, NO_PROGRESS, BAD_LAYOUT, UNFINISHED, NO_DERIVATIVE = range(9)
LAWS = {"smooth": 0, "impact": 1}


class FirmwareVehicle:
    """One vehicle. All storage is its own, as it is the caller's in C.

    base, effects  the set
    vehicle        an omniroll.Vehicle with the inertia that the effects bring
    constants      arguments of `prepare` that belong to the effects
    inputs         what acts, by name: numbers or (N,)
    """

    def __init__(
        self,
        vehicle: omniroll.Vehicle,
        base: str = "free",
        effects: Sequence[str] = (),
        *,
        constants: Mapping[str, ArrayLike] = {},  # noqa: B006
        inputs: Mapping[str, ArrayLike] = {},  # noqa: B006
        number_type: str = "double",
        law: str = "impact",
    ):
        library = sets.library(base, tuple(effects), number_type)
        self.ffi, self.lib, self.law = library.ffi, library.lib, LAWS[law]
        self.real = NUMBER_TYPES[number_type]
        self.wheels, self.rollers = vehicle.wheels, vehicle.rollers_per_wheel
        self.kept: list[np.ndarray] = []
        self.vehicle = self.ffi.new("omniroll_vehicle *")
        given = {name: getattr(vehicle, name) for name in (*VEHICLE_SCALARS, "wheel_angles")} | dict(constants)
        given |= {"wheels": self.wheels, "rollers_per_wheel": self.rollers}
        self.fill(self.vehicle, given)
        known = self.ffi.list_types()[0]
        self.storage = [self.ffi.new("omniroll_wheel[]", self.wheels)]
        if "omniroll_roller" in known:
            self.storage.append(self.ffi.new("omniroll_roller[]", self.rollers - 1))
        self.model = self.ffi.new("omniroll_model *")
        self.status = self.lib.omniroll_prepare(self.vehicle, *self.storage, self.model)
        self.inputs = ()
        if "omniroll_inputs" in known:
            self.inputs = (self.ffi.new("omniroll_inputs *"),)
            zeros = dict.fromkeys(self.fields("omniroll_inputs *"), np.zeros(self.wheels))
            self.fill(self.inputs[0], zeros | dict(inputs))
        self.nu, self.pose, self.contact = np.zeros(3), np.zeros(3), np.zeros(self.wheels, np.intc)
        self.state = self.ffi.new("omniroll_state *")
        slots = self.wheels * (self.rollers - 1)
        sizes = {"chi": self.wheels, "axial": slots, "momenta": 2 * self.wheels}
        sizes["work"] = 30 + 17 * self.wheels + 5 * slots  # at least OMNIROLL_WORK of any set
        wanted = self.fields("omniroll_state *")
        self.arrays = {name: np.zeros(size, self.real) for name, size in sizes.items() if name in wanted}
        for name, array in self.arrays.items():
            setattr(self.state, name, self.pointer(array))
        self.state.contact = self.ffi.from_buffer("int[]", self.contact)

    def fields(self, struct: str) -> list[str]:
        return [name for name, _ in self.ffi.typeof(struct).item.fields]

    def pointer(self, array: np.ndarray):
        return self.ffi.from_buffer("omniroll_real[]", array)

    def fill(self, struct, values: Mapping[str, ArrayLike]) -> None:
        """Put numbers into the fields of a struct that has them; other numbers are not for this set."""
        for name, kind in self.ffi.typeof(struct).item.fields:
            if kind.type.kind == "pointer":
                self.kept.append(np.array(values[name], self.real).ravel())
                setattr(struct, name, self.pointer(self.kept[-1]))
            else:
                setattr(struct, name, values[name])

    def start(self, nu: ArrayLike, chi: ArrayLike = 0, pose: ArrayLike = (0, 0, 0), spins: ArrayLike = 0) -> int:
        """Put the vehicle into a state; the status of omniroll_start."""
        self.state.nu[0:3] = [float(x) for x in nu]
        self.state.pose[0:3] = [float(x) for x in pose]
        self.arrays["chi"][:] = chi
        self.contact[:] = 0
        if "axial" in self.arrays:
            wanted = np.broadcast_to(np.asarray(spins, self.real), (self.wheels, self.rollers - 1)).ravel().copy()
            self.lib.omniroll_axial_speeds(
                self.model, self.state.nu, self.state.chi, self.pointer(wanted), self.state.axial
            )
        return self.lib.omniroll_start(self.model, self.state)

    def step(self, h: float) -> int:
        """The status of omniroll_step."""
        return self.lib.omniroll_step(self.model, self.law, *self.inputs, h, self.state)

    def run(self, h: float, steps: int) -> int:
        """Steps until one is refused; the last status."""
        for _ in range(steps):
            if (status := self.step(h)) != OK:
                return status
        return OK

    def finish(self, h: float, most: int = 1000) -> tuple[int, int]:
        """A step, and further calls for the time that is left until it is done: the last status, how many calls."""
        status, calls = self.step(h), 1
        while status in (UNFINISHED, NO_PROGRESS) and calls < most:
            status, calls = self.step(self.state.left), calls + 1
        return status, calls

    def numbers(self) -> np.ndarray:
        """nu, pose, chi."""
        return np.array([*self.state.nu, *self.state.pose, *self.arrays["chi"]], float)

    def wheel_speeds(self) -> np.ndarray:
        """The wheels' rates, (N,)."""
        speeds = np.zeros(self.wheels, self.real)
        self.lib.omniroll_wheel_speeds(self.model, self.state.nu, self.pointer(speeds))
        return speeds

    def spins(self) -> np.ndarray:
        """Spins of the free rollers relative to their disks, (N, n-1)."""
        spins = np.zeros((self.wheels, self.rollers - 1), self.real)
        flat = self.pointer(spins.reshape(-1))
        self.lib.omniroll_spins_from_axial(self.model, self.state.nu, self.state.chi, self.state.axial, flat)
        return spins.astype(float)

    def switches(self) -> int:
        """Calls omniroll_switch; how many wheels changed their roller."""
        return self.lib.omniroll_switch(self.model, self.law, self.state)

    def time_to_joint(self) -> tuple[float, int]:
        wheel = self.ffi.new("int *")
        return float(self.lib.omniroll_time_to_joint(self.model, self.state, wheel)), wheel[0]
