"""Generated kernels bound to a vehicle and a roller model.

`kernel(vehicle, roller_model)` gives a Kernel; its methods are the generated functions of the set, on NumPy
arrays whose leading axes broadcast. Two backends have the same methods:

  compiled   the C kernels, plain shared libraries that cffi calls in its ABI mode
  python     the Python kernels omniroll.generated.python.<set>

What a function takes and gives is read from generated/data/kernels, so a new function or set needs no
code here beyond its method. A kernel has the effects that it is asked for and no others; sets.py finds or makes what it
needs. N is the number of wheels, n of rollers per wheel; units as in omniroll.vehicles.vehicle.
"""

import math
import warnings
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache, partial
from itertools import accumulate, pairwise

import numpy as np
from numpy.typing import ArrayLike

from omniroll import generated_data
from omniroll.codegen.along import SECOND
from omniroll.codegen.derivatives import REQUEST
from omniroll.errors import InvalidValueError, KernelsMissingError
from omniroll.kernels import sets
from omniroll.kernels.by_state import (
    OF_ARCS,
    arc_constants,
    call_on_pieces,
    flow_by_calls,
    has_pieces,
    piece_numbers,
)
from omniroll.validation import choice
from omniroll.vehicles import profiles
from omniroll.vehicles.checks import refuse_unmodelled
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import KERNEL_ARGUMENTS, ROLLER_MODELS, documented

BACKENDS = ("compiled", "python")
NUMBER_TYPES = {"double": np.float64, "float": np.float32, "long_double": np.longdouble}
C_TYPES = {"double": "double", "float": "float", "long_double": "long double"}
VEHICLE_SCALARS = (
    "mass",
    "yaw_inertia",
    "wheel_inertia",
    "roller_inertia",
    "yaw_scale",
    "platform_radius",
    "wheel_radius",
    "roller_axis_radius",
)

BY_WHEEL = {  # arguments of `prepare` for wheels of several kinds, and what a wheel calls its number
    "wheel_radii": "wheel_radius",
    "roller_axis_radii": "roller_axis_radius",
    "wheel_inertias": "wheel_inertia",
    "roller_inertias": "roller_inertia",
    "roller_counts": "rollers_per_wheel",
    "row_offsets": "row_offset",
}
OF_THE_VEHICLE = (
    "wheel_places",
    "center_of_mass",
    "roller_angle",
    "row_offset",
    "sides",
    "turns",
    *BY_WHEEL,
    "weightless",
    "driven",
    *OF_ARCS,
    "wheel_loads",
)  # constants of these
IN_THE_MIDDLE = 0.0  # of sides: wheels as if they had one row in their middle, as controllers know them

SHARP = 1e2  # beyond this the functions for sharp tips are the more accurate ones
MECANUM = "mecanum"  # the effect that a vehicle with rollers at an angle brings
KINDS = "kinds"  # the effect that wheels of several kinds bring
PROFILE = "profile"  # the effect that rollers with a meridian of their own bring
ARCS = "arcs"  # the effect that rollers of several arcs bring
JOINTS = "joints"  # what mecanum wheels and two rows of rollers need
MOVING_ROWS = "moving_rows"  # what mecanum wheels and profiles need: rates that go by the wheels' angles
DERIVATIVES = "derivatives"  # the effect that brings derivatives by state and inputs
SHARP_SUFFIX = "_sharp"  # of the name of a function for sharp tips, which stands beside the usual form

Flow = Callable[[float, np.ndarray], np.ndarray]
Constants = tuple[tuple[str, float | tuple], ...]  # arguments of `prepare` by name, in a form that can be hashed


@dataclass(frozen=True)
class Argument:
    """An argument of a generated function; `shape` for one vehicle, without leading axes."""

    name: str
    shape: tuple[int, ...]

    def array(self, value: ArrayLike, dtype: type) -> np.ndarray:
        """A value with its leading axes. Raises InvalidValueError for other shapes, and for what is no number."""
        try:
            array = np.asarray(value, dtype)
        except Exception:  # ragged rows, texts, or an object whose own code fails
            raise InvalidValueError(self.name, value, "must be real numbers") from None
        if array.shape[array.ndim - len(self.shape) :] != self.shape:
            want = ", ".join(map(str, ("...", *self.shape)))
            raise InvalidValueError(self.name, value, f"must have the shape ({want}), not {array.shape}")
        return array


@dataclass(frozen=True)
class Signature:
    """The inputs and outputs of a generated function, for given N and n."""

    inputs: tuple[Argument, ...]
    outputs: tuple[Argument, ...]

    @cached_property
    def shapes(self) -> tuple[tuple[tuple[int, ...], ...], ...]:
        """Of the inputs and of the outputs."""
        return tuple(a.shape for a in self.inputs), tuple(a.shape for a in self.outputs)

    @cached_property
    def places(self) -> tuple[list[slice], list[slice]]:
        """Of the inputs and of the outputs, one after the other in one array of numbers."""
        ends = accumulate(math.prod(argument.shape) for argument in self.inputs + self.outputs)
        places = [slice(start, end) for start, end in pairwise([0, *ends])]
        return places[: len(self.inputs)], places[len(self.inputs) :]


@cache
def signatures(
    base: str, effects: tuple[str, ...], wheels: int, rollers_per_wheel: int, sharp: bool = False
) -> dict[str, Signature]:
    """The signature of every function of a set, by name; where tips are sharp, that of its form for these."""
    sizes = {"N": wheels, "n": rollers_per_wheel, "n-1": rollers_per_wheel - 1}

    def arguments(function: dict, role: str) -> tuple[Argument, ...]:
        return tuple(
            Argument(entry["name"], tuple(sizes.get(size, size) for size in entry["shape"]))
            for entry in function["arguments"]
            if entry["role"] == role
        )

    found = {function["name"]: function for function in sets.functions(base, effects)}
    usual = [name for name in found if not name.endswith(SHARP_SUFFIX)]
    forms = {name: found[form(name, sharp, found)] for name in usual}
    return {name: Signature(arguments(own, "in"), arguments(own, "out")) for name, own in forms.items()}


@cache
def _function_names(base: str, effects: tuple[str, ...]) -> frozenset[str]:
    """The names of a set's functions, forms for sharp tips among them."""
    return frozenset(function["name"] for function in sets.functions(base, effects))


def form(name: str, sharp: bool, generated: Container[str]) -> str:
    """The generated function that computes what `name` says; where tips are sharp, its form for these if it has one.

    generated  the names of the set's functions
    """
    special = f"{name}{SHARP_SUFFIX}"
    return special if sharp and special in generated else name


def is_sharp(vehicle: Vehicle, roller_model: str) -> bool:
    """Whether nu' is to be solved for by the functions for sharp tips.

    Both forms compute the same; where the contact rollers' inertia B/rho^2 outgrows all other inertia at the joint,
    only the one for sharp tips is accurate.
    """
    return roller_model != "massless" and vehicle.sharpness() > SHARP


@cache
def optional_effects() -> tuple[str, ...]:
    """The effects that a kernel may have beside its roller model, in the registry's order."""
    return tuple(effect["name"] for effect in generated_data.load("effects")["effects"] if effect["optional"])


BROUGHT: dict[str, Callable[[Vehicle], bool]] = {  # effects that a vehicle brings, and whether one does
    "layout": lambda vehicle: vehicle.has_layout,
    "rows": lambda vehicle: vehicle.rows > 1,
    MECANUM: lambda vehicle: any(vehicle.roller_angle),
    KINDS: lambda vehicle: vehicle.has_kinds,
    PROFILE: lambda vehicle: vehicle.has_profile,
    ARCS: has_pieces,
}


def effects_of(vehicle: Vehicle, roller_model: str, effects: Sequence[str]) -> tuple[str, ...]:
    """The effects in the registry's order, with what they need and with those that the vehicle itself brings; behind
    them the numbers by which there are derivatives, and whether there are second ones."""
    refuse_unmodelled(vehicle)
    of_vehicle = [effect for effect, brings in BROUGHT.items() if brings(vehicle)]
    if not effects and not of_vehicle:
        return ()
    asked = sorted({effect for effect in effects if isinstance(effect, str) and effect.startswith(REQUEST)})
    second = [SECOND] * (SECOND in effects)
    own = [effect for effect in effects if effect not in (*asked, *second)] + [DERIVATIVES] * bool(asked or second)
    for effect in own:
        choice("effects", effect, optional_effects())
    needed = (other for effect in (*own, *of_vehicle) for other in sets.needs()[effect])
    present = {*own, *needed, *of_vehicle}
    found = tuple(effect for effect in optional_effects() if effect in present)
    _refuse_beside_wheels(vehicle, found)
    if MOVING_ROWS in found and is_sharp(vehicle, roller_model):
        field = profiles.field_of(vehicle) or "roller_angle"
        bound = (
            "takes no rollers with sharp tips under this roller model: make roller_axis_radius less, or take massless"
        )
        raise InvalidValueError(field, getattr(vehicle, field), bound)
    if asked:
        numbers = [a.name for a in signatures(roller_model, found, 3, 3)["prepare"].inputs]
        for request in asked:
            choice("effects", request, [REQUEST + name for name in numbers])
    return (*found, *asked, *second)


BESIDE = {  # effects that a vehicle's wheels bring, the field that does, and what to take instead
    MECANUM: ("roller_angle", "omni-wheels (roller_angle = 0)"),
    PROFILE: ("", "rollers that keep the wheel round (no meridian_radius or roller_profile)"),
    KINDS: ("wheel_kinds", "wheels that are all alike"),
}

SMOOTH = {"axle_sticking": "give Bearings a wheel_speed, below which it fades"}  # what to take in an effect's place


def _refuse_beside_wheels(vehicle: Vehicle, effects: Sequence[str]) -> None:
    """Raise InvalidValueError for what is not derived for mecanum wheels, profiles or wheels of several kinds."""
    own = (any(vehicle.roller_angle), vehicle.has_profile, vehicle.has_kinds)
    for (name, (field, instead)), has in zip(BESIDE.items(), own, strict=True):
        entries = {entry["name"]: entry for entry in generated_data.load("effects")["effects"]} if has else {}
        excluded = entries[name]["excludes"] if has else ()
        present = {*effects} - ({"rows"} if vehicle.rows == 1 else set())  # of a general set, at an offset of zero
        beside = [other for other in excluded if other in present]
        if beside:
            way_out = SMOOTH.get(beside[0], "leave that out")
            bound = f"does not go with {entries[beside[0]]['meaning']}; {way_out}, or take {instead}"
            field = field or profiles.field_of(vehicle)
            raise InvalidValueError(field, getattr(vehicle, field), bound)


def _constants_of(vehicle: Vehicle, effects: Sequence[str], constants: Constants) -> dict[str, ArrayLike]:
    """The arguments of `prepare` by name: the vehicle's numbers, and those of the effects."""
    own = {name: getattr(vehicle, name) for name in VEHICLE_SCALARS} | {"wheel_angles": vehicle.wheel_angles}
    if "layout" in effects:
        own |= {"wheel_places": vehicle.places(), "center_of_mass": vehicle.center_of_mass}
    if "rows" in effects:
        own |= {"row_offset": vehicle.row_offset, "sides": IN_THE_MIDDLE}
    if JOINTS in effects:
        own |= {"turns": 1.0}
    if MECANUM in effects:
        own |= {"roller_angle": vehicle.roller_angle}
    if PROFILE in effects:
        own |= arc_constants(vehicle, piece_numbers(vehicle, np.zeros(vehicle.wheels)))
    if "weight" in effects:
        own |= {"wheel_loads": 0.0}
    if KINDS in effects:
        own |= {name: vehicle.by_wheel[of_one] for name, of_one in BY_WHEEL.items()}
        own |= {"weightless": [float(inertia == 0) for inertia in own["roller_inertias"]], "driven": vehicle.driven}
    return own | dict(constants)


def _prepare_arguments(signature: Signature, given: Mapping[str, ArrayLike]) -> list[np.ndarray]:
    """The arguments of `prepare` in its order. One number stands for all wheels."""
    wanted = [argument.name for argument in signature.inputs]
    if not set(wanted) <= set(given):
        raise TypeError(f"constants {sorted(given)}; these effects need {wanted}")
    return [_constant(given[argument.name], argument.shape) for argument in signature.inputs]


def _constant(value: ArrayLike, shape: tuple[int, ...]) -> np.ndarray:
    array = np.array(value, float)
    return array if array.shape == shape else np.array(np.broadcast_to(array, shape), order="C")


@documented(*KERNEL_ARGUMENTS)
class Kernel:
    """The generated functions of one set, for one vehicle. Made by `kernel`.

    vehicle       Vehicle, with the inertia that effects bring
    roller_model  "massless", "locked" or "free"
    effects       names of the effects beside the roller model, in the registry's order
    constants     (name, value) of the arguments of `prepare` that belong to the effects
    set_name      name of the set of effects
    sharp         whether the rollers end in sharp tips: then the set's functions for these solve for nu'

    Its methods take the arguments below. `inputs` are further ones that the set has, in the order in which
    `forward_dynamics` takes them. A method whose function the set lacks raises KeyError;
    arrays of other shapes raise ValueError.

    {entries}
    """

    backend: str

    def __init__(self, vehicle: Vehicle, roller_model: str, effects: tuple[str, ...] = (), constants: Constants = ()):
        self.vehicle, self.roller_model = vehicle, roller_model
        self.wheels, self.rollers_per_wheel = vehicle.wheels, vehicle.rollers_per_wheel  # of the wheel that has most
        self.base, self.effects = roller_model, effects_of(vehicle, roller_model, effects)
        self.sharp = is_sharp(vehicle, roller_model)
        self.set_name = sets.set_name(self.base, self.effects)
        self.signatures = dict(self._found_signatures())
        prepare = self.signatures.pop("prepare")
        self.constant_names = [argument.name for argument in prepare.inputs]
        self.given = constants
        self.constants = _prepare_arguments(prepare, _constants_of(vehicle, self.effects, constants))
        self.has_spins = roller_model == "free"
        self.slips = "slip_dynamics" in self.signatures  # whether wheels may slip
        self.sprung = "sprung_dynamics" in self.signatures  # whether they may stick on the ground, under springs
        self.grips = self.sprung or "ground_dynamics" in self.signatures  # or under given loads
        self.pivots = JOINTS in self.effects  # whether wheels may stand on their joint
        self.has_phases = self.pivots or "rows" in self.effects  # whether constants go by what carries
        self.rows_move = MOVING_ROWS in self.effects  # whether the wheels' rates go by their angles
        self.rollers_stick = "contact_spin_rates" in self.signatures
        if has_pieces(vehicle) and OF_ARCS[0] not in dict(constants):
            self.call = partial(call_on_pieces, self)  # type: ignore[method-assign]
            self.flow = partial(flow_by_calls, self)  # type: ignore[method-assign]
        self.of_every_roller = "accelerations" if self.has_spins else "forward_dynamics"  # without spins they are one

    def _found_signatures(self) -> dict[str, Signature]:
        """Of all functions by name, `prepare` among them."""
        return signatures(self.base, self.effects, self.wheels, self.rollers_per_wheel, self.sharp)

    @property
    def slots(self) -> int:
        """How many structs of free rollers the model has."""
        return (self.wheels if KINDS in self.effects else 1) * (self.rollers_per_wheel - 1)

    @cached_property
    def magnitudes(self) -> tuple[float, float]:
        """The smallest and the largest magnitude among the constants that are not 0."""
        sizes = [abs(number) for value in self.constants for number in value.ravel().tolist() if number]
        return min(sizes), max(sizes)

    @cached_property
    def wheel_rows(self) -> np.ndarray:
        """(N, 3) the wheels' speeds for each of nu."""
        rows = np.ascontiguousarray(self.wheel_speeds(np.eye(3)).T)
        rows.flags.writeable = False
        return rows

    @cached_property
    def nu_dot_per_torque(self) -> np.ndarray:
        """(3, N) nu' for each torque at the axles, of a vehicle at rest with chi = 0: their power is torque chi'."""
        return np.linalg.solve(self.mass_matrix(np.zeros(self.wheels)), self.wheel_rows.T)

    def constant(self, name: str) -> np.ndarray:
        """The argument of `prepare` that has this name."""
        return self.constants[self.constant_names.index(name)]

    def form(self, name: str) -> str:
        """The generated function that computes what `name` says for these tips."""
        return form(name, self.sharp, _function_names(self.base, self.effects))

    def call(self, name: str, *values: ArrayLike):
        """The generated function `name` of `values`: its output or a tuple of its outputs; leading axes broadcast."""
        raise NotImplementedError

    def with_constants(self, changes: Mapping[str, tuple[float, ...]]) -> "Kernel":
        """The kernel with other constants of the effects.

        changes  arguments of `prepare` by name
        """
        kept = ((name, value) for name, value in self.given if name not in changes)
        return self._made_with((*kept, *changes.items()))

    def _made_with(self, constants: Constants) -> "Kernel":
        raise NotImplementedError

    def flow(self, momenta: np.ndarray | None) -> Flow:
        """The right-hand side f(time, y) -> y' with y = (nu, chi, pose), length 6 + N.

        `momenta` are the two constants of each wheel's free rollers, (N, 2); None but for free rollers.
        """
        raise NotImplementedError

    def bind(self, name: str, buffers: Mapping[str, np.ndarray]) -> Callable[[], None]:
        """The generated function `name` as a call without arguments on named arrays of doubles.

        It reads its inputs from `buffers` and writes its outputs there; each has the shape of its argument.
        """
        raise NotImplementedError

    def wheel_speeds(self, nu: ArrayLike, chi: ArrayLike | None = None) -> np.ndarray:
        """chi' (..., N), (2.2). Of mecanum wheels and of profiles it depends on chi (..., N); without chi it is that in
        the middle of the rollers, which the usual kinematics have."""
        return self.call("wheel_speeds", nu, *self.angles_or_nothing(chi))

    def angles_or_nothing(self, chi: ArrayLike | None) -> tuple[ArrayLike, ...]:
        """The arguments after nu of wheel_speeds, drive_power, axle_loss and motor_margins."""
        return () if MOVING_ROWS not in self.effects else (self._angles(chi),)

    def _angles(self, chi: ArrayLike | None) -> ArrayLike:
        return np.zeros(self.wheels) if chi is None else chi

    def wheel_rates(self, nu: ArrayLike, chi: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """chi' (..., N) and the contact rollers' spins (..., N), (2.2) and (2.1)."""
        return self.call("wheel_rates", nu, chi)

    def nu_from_wheels(self, chi_dot: ArrayLike, chi: ArrayLike | None = None) -> np.ndarray:
        """nu (..., 3) from the wheels' speeds (..., N) by least squares; N at least 3. Of mecanum wheels at chi
        (..., N); without chi with the rollers in their middle, as robots' odometry has it. Of wheels of several kinds
        by normal equations, too."""
        if "nu_from_wheels_at" in self.signatures:
            return self.call("nu_from_wheels_at", self._angles(chi), chi_dot)
        return self.call("nu_from_wheels", chi_dot)

    def nu_from_contacts(self, chi: ArrayLike, chi_dot: ArrayLike, contact_spin: ArrayLike) -> np.ndarray:
        """nu (..., 3) from the wheels' speeds and the contact spins (..., N) by least squares; N at least 2."""
        return self.call("nu_from_contacts", chi, chi_dot, contact_spin)

    def pose_rates(self, nu: ArrayLike, theta: ArrayLike) -> np.ndarray:
        """x', y', theta' (..., 3)."""
        return self.call("pose_rates", nu, theta)

    def mass_matrix(self, chi: ArrayLike) -> np.ndarray:
        """M* (..., 3, 3); of the reduced form where rollers are free."""
        return self.call("mass_matrix", chi)

    def forces(self, nu: ArrayLike, chi: ArrayLike, *inputs: ArrayLike) -> np.ndarray:
        """The force f (..., 3) of M* nu' = f, (3.4). Further inputs as of `forward_dynamics`."""
        return self.call("forces", nu, chi, *inputs)

    def forward_dynamics(self, nu: ArrayLike, chi: ArrayLike, *inputs: ArrayLike) -> np.ndarray:
        """nu' (..., 3).

        Further inputs, those that the set has, in this order: momenta (..., N, 2) of free rollers; torque (..., N)
        of drives; damping (..., N) of motors; the heading (...,) on a slope; roller_drag (..., N) of free rollers
        with Coulomb's friction.
        """
        return self.call("forward_dynamics", nu, chi, *inputs)

    def accelerations(self, nu: ArrayLike, chi: ArrayLike, *inputs: ArrayLike):
        """nu' (..., 3); with free rollers, whose spins are (..., N, n-1), also spins' of that shape.

        Further inputs: spins of free rollers, then torque, damping and heading as of `forward_dynamics`.
        """
        return self.call(self.of_every_roller, nu, chi, *inputs)

    def inverse_dynamics(self, nu: ArrayLike, chi: ArrayLike, *inputs: ArrayLike) -> np.ndarray:
        """The generalised force (..., 3) that gives nu_dot; inputs as of forward_dynamics, nu_dot (..., 3) last."""
        return self.call("inverse_dynamics", nu, chi, *inputs)

    def wheel_torques(self, force: ArrayLike, chi: ArrayLike | None = None) -> np.ndarray:
        """Torques (..., N) of least norm that make a generalised force; N at least 3. Mecanum wheels: chi as of
        nu_from_wheels; both go by normal equations there, which square the condition."""
        if "wheel_torques_at" in self.signatures:
            return self.call("wheel_torques_at", self._angles(chi), force)
        return self.call("wheel_torques", force)

    def energy(self, nu: ArrayLike, chi: ArrayLike, *spins: ArrayLike) -> np.ndarray:
        """Kinetic energy (...,), (3.2). Free rollers: spins (..., N, n-1)."""
        return self.call("energy", nu, chi, *spins)

    def impact(self, nu: ArrayLike, chi: ArrayLike, entering: ArrayLike, leaving: ArrayLike) -> np.ndarray:
        """nu (..., 3) after the impact; chi is that after the switch, entering and leaving are (..., N)."""
        return self.call("impact", nu, chi, entering, leaving)

    def contact_axial(self, nu: ArrayLike, chi: ArrayLike) -> np.ndarray:
        """Absolute speeds about their axes (..., N) of the rollers in contact; of free rollers only."""
        return self.call("contact_axial", nu, chi)

    def axial_speeds(self, nu: ArrayLike, chi: ArrayLike, spins: ArrayLike) -> np.ndarray:
        """Free rollers' absolute speeds about their axes (..., N, n-1), constant between switches."""
        return self.call("axial_speeds", nu, chi, spins)

    def spins_from_axial(self, nu: ArrayLike, chi: ArrayLike, axial: ArrayLike) -> np.ndarray:
        """The inverse of axial_speeds."""
        return self.call("spins_from_axial", nu, chi, axial)

    def carried_beyond_rolling(self, nu: ArrayLike, chi: ArrayLike, rates: np.ndarray) -> np.ndarray:
        """(..., N) in rad/s, what rollers at an angle turn about their axes with their wheels' rates (..., N), beyond
        those of rolling, which axial_speeds and spins_from_axial have: sin psi (chi' - g . nu), of section 3.4."""
        if not any(self.vehicle.roller_angle):
            return np.zeros_like(rates)
        return np.sin(self.vehicle.roller_angle) * (rates - self.wheel_speeds(nu, chi))

    def momenta(self, axial: ArrayLike) -> np.ndarray:
        """The two constants (..., N, 2) of each wheel's free rollers."""
        return self.call("momenta", axial)

    # Functions of sets with further effects

    def potential(self, pose: ArrayLike) -> np.ndarray:
        """Potential energy (...,) on a slope."""
        return self.call("potential", pose)

    def drive_power(self, nu: ArrayLike, *inputs: ArrayLike) -> np.ndarray:
        """Power (...,) of drives: of mecanum wheels chi (..., N); torque (..., N), and damping (..., N) of motors."""
        return self.call("drive_power", nu, *inputs)

    def motor_torques(self, voltage: ArrayLike, modes: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Torques and damping (..., N) of motors: voltage in V and modes (..., N), which are 0, or +-1 at a limit."""
        return self.call("motor_torques", voltage, modes)

    def motor_margins(self, nu: ArrayLike, voltage: ArrayLike, modes: ArrayLike) -> np.ndarray:
        """Event functions (..., N, 2) of motors, whose voltage and modes are (..., N): a positive one ends the mode."""
        return self.call("motor_margins", nu, voltage, modes)

    def motor_laws(self, modes: ArrayLike) -> tuple[np.ndarray, ...]:
        """What motors in their modes (..., N) make of voltage u and wheel rate w.

        Three parts (..., N) of the torque, at_zero + per_volt u - lost_per_rate w, and three (..., N, 2) of the
        margins, at_zero + per_volt u + per_rate w.
        """
        return self.call("motor_laws", modes)

    def axle_loss(self, nu: ArrayLike) -> np.ndarray:
        """Power (...,) lost in the axles' bearings."""
        return self.call("axle_loss", nu)

    def contact_loss(self, nu: ArrayLike, chi: ArrayLike) -> np.ndarray:
        """Power (...,) lost in the bearings of the rollers in contact; of massless and locked rollers."""
        return self.call("contact_loss", nu, chi)

    def roller_energy(self, axial: ArrayLike) -> np.ndarray:
        """Energy (..., N) of the free rollers' axial spins; with viscous friction alone."""
        return self.call("roller_energy", axial)

    def momenta_rates(
        self, nu: ArrayLike, chi: ArrayLike, momenta: ArrayLike, roller_energy: ArrayLike
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rates of momenta (..., N, 2) and roller_energy (..., N), and the power lost in all rollers' bearings;
        of free rollers with viscous friction alone."""
        return self.call("momenta_rates", nu, chi, momenta, roller_energy)

    def axial_after(
        self, axial: ArrayLike, momenta: ArrayLike, momenta_after: ArrayLike, elapsed: ArrayLike
    ) -> np.ndarray:
        """Axial speeds (..., N, n-1) after the time `elapsed`; of free rollers with viscous friction alone."""
        return self.call("axial_after", axial, momenta, momenta_after, elapsed)

    def roller_rates(
        self, nu: ArrayLike, chi: ArrayLike, axial: ArrayLike
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rates of the axial speeds (..., N, n-1), roller_drag (..., N), and the power lost in all rollers'
        bearings; of free rollers with Coulomb's friction."""
        return self.call("roller_rates", nu, chi, axial)

    def spins_or_nothing(self, spins: np.ndarray | None) -> tuple[np.ndarray, ...]:
        """The arguments after nu and chi of accelerations and energy: spins where rollers are free."""
        return (spins,) if self.has_spins else ()

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.roller_model}: N={self.wheels}, n={self.rollers_per_wheel}>"

    def _signature(self, name: str) -> Signature:
        """Of a function. Raises InvalidValueError for a name that the set does not have."""
        if not isinstance(name, str) or name not in self.signatures:
            raise InvalidValueError("name", name, f"is no function of this kernel: {', '.join(self.signatures)}")
        return self.signatures[name]

    def checked_inputs(self, name: str, values: Sequence[ArrayLike]) -> tuple[Argument, ...]:
        """What a function takes. Raises InvalidValueError for another number of values."""
        inputs = self._signature(name).inputs
        if len(values) != len(inputs):
            bound = f"must be those that {name} takes: {', '.join(argument.name for argument in inputs)}"
            raise InvalidValueError("values", values, bound)
        return inputs

    def _broadcast(self, name: str, values: Sequence[ArrayLike], dtype: type) -> tuple[tuple, list[np.ndarray]]:
        """Leading shape, and the inputs with it: contiguous arrays of one number type."""
        inputs = self.checked_inputs(name, values)
        arrays = [argument.array(value, dtype) for argument, value in zip(inputs, values, strict=True)]
        leads = [
            array.shape[: array.ndim - len(argument.shape)] for argument, array in zip(inputs, arrays, strict=True)
        ]
        try:
            lead = np.broadcast_shapes(*leads)
        except ValueError:
            raise InvalidValueError(name, leads, "leading axes of the arguments must broadcast") from None
        return lead, [_copy(array, lead + argument.shape) for argument, array in zip(inputs, arrays, strict=True)]


def _copy(array: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """A contiguous copy of an array, broadcast to a shape."""
    return np.array(array if array.shape == shape else np.broadcast_to(array, shape), order="C")


class PythonKernel(Kernel):
    """The generated Python kernels: each component is a NumPy array, so that all leading axes run at once."""

    backend = "python"

    def __init__(self, vehicle: Vehicle, roller_model: str, effects: tuple[str, ...] = (), constants: Constants = ()):
        super().__init__(vehicle, roller_model, effects, constants)
        self._module = sets.python_module(self.base, self.effects)
        self._model = self._module.prepare(vehicle.wheels, vehicle.rollers_per_wheel, *self._given_constants())

    def _given_constants(self) -> list:
        """What `prepare` takes, components first."""
        return [value.tolist() for value in self.constants]

    def _made_with(self, constants: Constants) -> Kernel:
        return type(self)(self.vehicle, self.roller_model, self.effects, constants)

    def call(self, name: str, *values: ArrayLike):
        signature = self._signature(name)
        lead, arrays = self._broadcast(name, values, np.float64)
        # Components come first in the generated code; without leading axes they are floats, which are fast.
        inputs = components_first(arrays, len(lead)) if lead else [array.tolist() for array in arrays]
        try:
            with np.errstate(all="ignore"):
                found = getattr(self._module, self.form(name))(self._model, *inputs)
        except (ZeroDivisionError, OverflowError):  # Python's floats raise where arrays and C give inf or nan
            found = tuple(np.full(argument.shape, np.nan) for argument in signature.outputs)
            found = found if len(signature.outputs) > 1 else found[0]
        found = found if len(signature.outputs) > 1 else (found,)
        outputs = tuple(
            _components_last(output, argument.shape, lead)
            for output, argument in zip(found, signature.outputs, strict=True)
        )
        return outputs if len(outputs) > 1 else outputs[0]

    def flow(self, momenta: np.ndarray | None) -> Flow:
        module, model, chi_end = self._module, self._model, 3 + self.wheels
        dynamics = getattr(module, self.form("forward_dynamics"))
        constants = () if momenta is None else (momenta.tolist(),)

        def rates(_: float, y: np.ndarray) -> np.ndarray:
            state = y.tolist()
            nu, chi, theta = state[:3], state[3:chi_end], state[-1]
            try:
                nu_dot = dynamics(model, nu, chi, *constants)
                chi_dot = module.wheel_speeds(model, nu, *self.angles_or_nothing(chi))
                return np.array([*nu_dot, *chi_dot, *module.pose_rates(model, nu, theta)], float)
            except (ZeroDivisionError, OverflowError):  # Python's floats raise where C gives inf or nan
                return np.full(len(state), np.nan)

        return rates

    def bind(self, name: str, buffers: Mapping[str, np.ndarray]) -> Callable[[], None]:
        function, model, signature = getattr(self._module, self.form(name)), self._model, self.signatures[name]
        inputs = [buffers[argument.name] for argument in signature.inputs]
        outputs = [buffers[argument.name] for argument in signature.outputs]

        def call() -> None:
            try:
                found = function(model, *(values.tolist() for values in inputs))
            except (ZeroDivisionError, OverflowError):  # Python's floats raise where C gives inf or nan
                found = (np.nan,) * len(outputs) if len(outputs) > 1 else np.nan
            for output, values in zip(outputs, found if len(outputs) > 1 else (found,), strict=True):
                output[...] = values

        return call


def components_first(arrays: Sequence[np.ndarray], lead: int) -> list[np.ndarray]:
    """Arrays with so many leading axes, these behind the others."""
    return [
        array if array.ndim == lead else np.moveaxis(array, range(lead), range(array.ndim - lead, array.ndim))
        for array in arrays
    ]


def _components_last(output, shape: tuple[int, ...], lead: tuple[int, ...]) -> np.ndarray:
    """A nested list of components, each a number or an array of shape `lead`, as one array lead + shape."""
    result = np.empty(shape + lead)
    for place in np.ndindex(shape):
        component = output
        for index in place:
            component = component[index]
        result[place] = component
    if not (lead and shape):
        return result
    return np.array(np.moveaxis(result, range(len(shape)), range(len(lead), result.ndim)), order="C")


class CompiledKernel(Kernel):
    """The generated C kernels, called state by state."""

    backend = "compiled"

    def __init__(
        self,
        vehicle: Vehicle,
        roller_model: str,
        number_type: str = "double",
        effects: tuple[str, ...] = (),
        constants: Constants = (),
    ):
        super().__init__(vehicle, roller_model, effects, constants)
        self.number_type, self.dtype = number_type, NUMBER_TYPES[number_type]
        library = sets.library(self.base, self.effects, number_type)
        self._ffi, self._lib = library.ffi, library.lib
        self._array = self._ffi.typeof(f"{C_TYPES[number_type]}[]")
        self._bound: dict[str, _Bound] = {}
        self._prepare()

    @property
    def model(self):
        """The constants of the vehicle: a cffi pointer to the struct omniroll_model of the header."""
        return self._model

    def model_for(self, ffi):
        """`model` as a pointer of another library's cffi interface; both libraries have the set's structs."""
        return ffi.cast("omniroll_model *", int(self._ffi.cast("uintptr_t", self._model)))

    def _function(self, name: str):
        return getattr(self._lib, f"omniroll_{self.form(name)}")

    def _pointer(self, array: np.ndarray):
        """A pointer to the first number of a contiguous array; keeps the array alive."""
        return self._ffi.from_buffer(self._array, array)

    def _prepare(self) -> None:
        ffi = self._ffi
        vehicle = ffi.new("omniroll_vehicle *")
        vehicle.wheels, vehicle.rollers_per_wheel = self.wheels, self.rollers_per_wheel
        arrays = [np.asarray(value, self.dtype, order="C") for value in self.constants]
        pointers = [self._pointer(array) if array.ndim else array for array in arrays]
        for name, array, value in zip(self.constant_names, arrays, pointers, strict=True):
            setattr(vehicle, name, value if array.ndim else self._number(array))
        self._model = ffi.new("omniroll_model *")
        storage = [ffi.new("omniroll_wheel[]", self.wheels)]
        kinds = ["omniroll_vehicle", "omniroll_wheel"]
        if self.has_spins:
            storage.append(ffi.new("omniroll_roller[]", self.slots))
            kinds.append("omniroll_roller")
        self._storage = storage  # the model points to it
        sizes = [ffi.sizeof(kind) for kind in (*kinds, "omniroll_model")]
        if self._lib.omniroll_check_layout(*sizes) != self._lib.OMNIROLL_OK:
            raise KernelsMissingError(f"the library of {self.set_name} has other structs than its declarations")
        status = self._lib.omniroll_prepare(vehicle, *storage, self._model)
        if status != self._lib.OMNIROLL_OK:
            bound = f"the C kernel in {C_TYPES[self.number_type]} refuses it with status {status}, see its header"
            raise InvalidValueError("vehicle", self.vehicle, bound)

    def _number(self, array: np.ndarray):
        """One number as cffi takes it; a long double keeps its digits."""
        return self._pointer(array.reshape(1))[0] if self.number_type == "long_double" else float(array)

    def _made_with(self, constants: Constants) -> Kernel:
        return CompiledKernel(self.vehicle, self.roller_model, self.number_type, self.effects, constants)

    def call(self, name: str, *values: ArrayLike):
        bound = self._bound.get(name) if isinstance(name, str) else None
        if bound is None:
            signature = self._signature(name)
            bound = self._bound[name] = _Bound(self._function(name), signature, self._model)
        found = bound.one_state(values, self.dtype, self._pointer)
        return self._many_states(name, bound, values) if found is None else found

    def _many_states(self, name: str, bound: "_Bound", values: Sequence[ArrayLike]):
        """The function for each state of the leading axes."""
        lead, arrays = self._broadcast(name, values, self.dtype)
        outputs = tuple(np.empty(lead + shape, self.dtype) for shape in bound.out_shapes)
        count = math.prod(lead)
        arguments = [self._arguments(a, shape, count) for a, shape in zip(arrays, bound.in_shapes, strict=True)]
        arguments += [self._pointers(a, shape, count) for a, shape in zip(outputs, bound.out_shapes, strict=True)]
        for of_one in zip(*arguments, strict=True):
            bound.function(self._model, *of_one)
        return outputs if len(outputs) > 1 else outputs[0]

    def _arguments(self, array: np.ndarray, shape: tuple[int, ...], count: int) -> list:
        """An input of `count` states, as C takes it: a scalar goes by value, everything else by pointer."""
        if shape:
            return self._pointers(array, shape, count)
        pointer = self._pointer(array)
        return [pointer[k] for k in range(count)]

    def _pointers(self, array: np.ndarray, shape: tuple[int, ...], count: int) -> list:
        first, size = self._pointer(array), math.prod(shape)
        return [first + k * size for k in range(count)]

    def flow(self, momenta: np.ndarray | None) -> Flow:
        wheels = self.wheels
        # The buffers belong to the closure, which lives as long as its pointers do.
        state, rates = np.zeros(6 + wheels, self.dtype), np.zeros(6 + wheels, self.dtype)
        y, dy = self._pointer(state) + 0, self._pointer(rates) + 0
        constants = () if momenta is None else (self._pointer(np.ascontiguousarray(momenta, self.dtype)),)
        dynamics, wheel_speeds, pose_rates = map(self._function, ("forward_dynamics", "wheel_speeds", "pose_rates"))
        model, nu, chi = self._model, y, y + 3
        nu_dot, chi_dot, pose_dot = dy, dy + 3, dy + 3 + wheels
        angles = self.angles_or_nothing(chi)

        def flow(_: float, values: np.ndarray) -> np.ndarray:
            state[:] = values
            dynamics(model, nu, chi, *constants, nu_dot)
            wheel_speeds(model, nu, *angles, chi_dot)
            pose_rates(model, nu, state[-1], pose_dot)
            return rates.astype(float)

        return flow

    def bind(self, name: str, buffers: Mapping[str, np.ndarray]) -> Callable[[], None]:
        function, signature = self._function(name), self.signatures[name]
        arrays = [buffers[argument.name] for argument in (*signature.inputs, *signature.outputs)]
        pointers = [self._pointer(array) for array in arrays]
        scalars = [k for k, argument in enumerate(signature.inputs) if not argument.shape]
        if not scalars:
            return partial(function, self._model, *pointers)

        def call() -> None:
            for k in scalars:  # a scalar input goes by value
                pointers[k] = arrays[k].item()
            function(self._model, *pointers)

        return call


class _Bound:
    """A C function with its shapes, for calls that cost little more than the function."""

    def __init__(self, function: Callable, signature: Signature, model):
        self.function, self.model = function, model
        self.in_shapes, self.out_shapes = signature.shapes
        self.in_places, self.out_places = signature.places
        self.size = self.out_places[-1].stop

    def one_state(self, values: Sequence[ArrayLike], dtype: type, pointer: Callable):
        """The outputs for one state; None where the values are not one state of these shapes."""
        if len(values) != len(self.in_shapes):
            return None
        memory = np.empty(self.size, dtype)  # of all inputs and outputs, so that there is one pointer to make
        first, arguments = pointer(memory), []
        for value, shape, place in zip(values, self.in_shapes, self.in_places, strict=True):
            try:
                array = np.asarray(value, dtype)
            except Exception:  # no numbers
                return None
            if array.shape != shape:
                return None
            memory[place] = array if len(shape) == 1 else array.ravel()
            # A scalar input goes by value, everything else by pointer.
            arguments.append(first + place.start if shape else first[place.start])
        self.function(self.model, *arguments, *[first + place.start for place in self.out_places])
        outputs = [
            memory[place] if len(shape) == 1 else memory[place].reshape(shape)
            for place, shape in zip(self.out_places, self.out_shapes, strict=True)
        ]
        return tuple(outputs) if len(outputs) > 1 else outputs[0]


def kernel(
    vehicle: Vehicle,
    roller_model: str = "free",
    backend: str = "compiled",
    number_type: str = "double",
    effects: tuple[str, ...] = (),
    constants: Constants = (),
) -> Kernel:
    """The kernel of a vehicle, a roller model and further effects.

    vehicle       Vehicle, with the inertia that effects bring
    roller_model  "massless", "locked" or "free"
    backend       "compiled" or "python"
    number_type   of the compiled kernels: "double", "float" or "long_double"
    effects       names from generated/data/effects.json; a vehicle with a layout brings "layout" by itself
    constants     (name, value) of the arguments of `prepare` that belong to the effects

    A set of effects that was not generated beforehand is made now; its kernel is a Python one where it cannot be
    compiled. neutral_kernel.py makes none. Raises InvalidValueError for unknown names, KernelsMissingError where the C
    kernels were not built.
    """
    try:
        return kept_kernel(vehicle, roller_model, backend, number_type, effects, constants)
    except TypeError:  # an argument that cannot be a key, and so is none of those that are known
        _check_arguments(vehicle, roller_model, backend, number_type)
        for name, value in (("effects", effects), ("constants", constants)):
            if not isinstance(value, tuple):
                raise InvalidValueError(name, value, "must be a tuple") from None
        raise


def _check_arguments(vehicle: Vehicle, roller_model: str, backend: str, number_type: str) -> None:
    if not isinstance(vehicle, Vehicle):
        raise InvalidValueError("vehicle", vehicle, "must be a Vehicle")
    choice("roller_model", roller_model, ROLLER_MODELS)
    choice("backend", backend, BACKENDS)
    choice("number_type", number_type, tuple(NUMBER_TYPES))


@lru_cache(maxsize=64)
def kept_kernel(
    vehicle: Vehicle, roller_model: str, backend: str, number_type: str, effects: tuple[str, ...], constants: Constants
) -> Kernel:
    """The kernel of these arguments, made when it is first asked for."""
    _check_arguments(vehicle, roller_model, backend, number_type)
    if backend == "python":
        return PythonKernel(vehicle, roller_model, effects, constants)
    try:
        return CompiledKernel(vehicle, roller_model, number_type, effects, constants)
    except KernelsMissingError as problem:
        if not effects_of(vehicle, roller_model, effects):  # built with omniroll
            raise
        warnings.warn(f"the Python kernel runs, which is slower: {problem}", RuntimeWarning, stacklevel=2)
        return PythonKernel(vehicle, roller_model, effects, constants)
