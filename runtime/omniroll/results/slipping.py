"""What contacts do that may slip: slip velocities, forces of the ground, and what of a state follows from them."""

from collections.abc import Callable, Mapping

import numpy as np

from omniroll.effects.effect_set import MOMENTS
from omniroll.effects.friction import Grip
from omniroll.effects.guards import EPS
from omniroll.errors import InvalidValueError
from omniroll.kernels.kernel import Kernel
from omniroll.results.accelerations import call_named
from omniroll.vehicles.vehicle import Vehicle

SLOW, SLOW_STANDING = 1e7, 1e4  # times its rounding: rows tell the direction of a slower slip (FAR_FROM_NOISE in C),
SAME, NO_OTHER = 1e-3, 100  # rad, and times its rounding, if it is no farther from that of the slip
LEFT_BY_SWEEPS = 16  # times its rounding: by so little the engine's iteration turns a slip
AT_REST = 1000  # a slip is zero within this many roundings of the velocities that it is the difference of
PAST_REST = 100.0  # roundings: a slip that comes to rest beside others may go back by so many
STRAIGHT = 0.9  # the cosine from which on a slip against its direction counts as one that goes back
LEFT_OF = 1 / 16  # of the largest rounding: of what is left of larger speeds
AT_SLIDING = 1e-9  # a torque that is nearer to the sliding one than this part of it may be that of a roller that turns


def slip_roundings(vehicle: Vehicle, nu: np.ndarray, rates: np.ndarray, axial: np.ndarray | None) -> np.ndarray:
    """(..., N) in m/s: slips within these are zero. Of nu (..., 3), the wheels' rates (..., N) and the axial speeds of
    the rollers in contact (..., N), None of massless ones."""
    turning = 2 * np.abs(nu[..., 2]) / vehicle.yaw_scale
    of_platform = vehicle.platform_radius * (np.abs(nu[..., :2]).sum(axis=-1) + turning)
    of_wheels = vehicle.wheel_radius * np.abs(rates)
    if axial is not None:
        of_wheels = of_wheels + vehicle.roller_radius * np.abs(axial)
    return AT_REST * EPS * (of_platform[..., None] + of_wheels)


def slip_says(slip: np.ndarray, towards: np.ndarray, rounding: np.ndarray, slow: float) -> np.ndarray:
    """(..., N) bool: contacts whose slip (..., N, 2) says where they go; of others the unit vectors `towards`
    (..., N, 2) do, since the slip is rounding (..., N) or less than `slow` times that, or has just come to rest and
    gone back."""
    size, along = np.linalg.norm(slip, axis=-1), (slip * towards).sum(axis=-1)
    back = along < -STRAIGHT * size
    across = np.abs(slip[..., 0] * towards[..., 1] - slip[..., 1] * towards[..., 0])
    turned = np.clip(SAME * along, LEFT_BY_SWEEPS * rounding, NO_OTHER * rounding)
    same = (along > 0) & (across <= turned) & (size < slow * rounding)
    return (size > np.where(back, PAST_REST, 1.0) * rounding) & ~same


def rollers_hold(taken: np.ndarray, sliding: np.ndarray, heading: np.ndarray | None = None) -> np.ndarray:
    """(..., N) bool: torques (..., N) in N m that hold massless rollers, where those that turn have sliding (N,).

    heading  (..., N) in rad, where contacts go that may stick: those of rollers that turn along the rolling direction
    """
    holding = np.abs(np.abs(taken) - sliding) > AT_SLIDING * sliding
    return holding if heading is None else holding | (np.abs(np.cos(heading)) > AT_SLIDING)


def given_in_rows(taken: np.ndarray, sticks: np.ndarray) -> dict[str, np.ndarray]:
    """What the kernel takes, by name, where bearings take (..., N) in N m, those of rollers that stick (..., N) too."""
    return {"contact_sticks": sticks.astype(float), "contact_bearing": np.where(sticks, 0.0, taken)}


def as_if_rigid(wheels: int) -> dict[str, np.ndarray]:
    """What slip_forces takes beside the state, by name, for slips of wheels whose massless rollers stick."""
    none = np.zeros(wheels)
    modes = {"contact_sticks": np.ones(wheels), "contact_bearing": none}
    return modes | {"ground_push": np.zeros((wheels, 2)), "ground_yield": none}


class Contacts:
    """The contacts in some states (...) of a run in which wheels may slip.

    kernel  Kernel of the run
    states  what the effects integrate, by name: rates (..., N), and contact_omega (..., N) of free rollers; or spins
            of massless rollers, contact_spin (..., N), where they are known
    grip    the friction of contacts that stick and slip; None under other laws
    stands  (..., N) of 1 and 0, or None: wheels that stand on their joint
    given   makes what their forces ask for beside: by name, heading, axial of the free rollers (None: there are none),
            and what a trajectory's rows have of the drives and of the contacts' modes
    """

    def __init__(
        self,
        kernel: Kernel,
        states: Mapping[str, np.ndarray],
        grip: Grip | None = None,
        given: Callable[[], Mapping[str, np.ndarray]] = dict,
        stands: np.ndarray | None = None,
    ):
        self.kernel, self.states, self.rates = kernel, states, states["rates"]
        self.axial = (states["contact_omega"],) if kernel.has_spins else ()
        self.grip, self.given = grip, given
        self.stands = np.broadcast_to(False if stands is None else stands > 0, self.rates.shape)

    def spins(self, nu: np.ndarray, chi: np.ndarray) -> np.ndarray:
        """(..., N) in rad/s, of the rollers in contact relative to their disks."""
        if self._massless_stick:
            if "contact_spin" in self.states:
                return self.states["contact_spin"]
            values = self._beside(nu, chi)
            if "contact_sticks" not in values:
                bound = "are not told without the rows of a run, where massless rollers stick and wheels may slip"
                raise InvalidValueError("contact_spin", None, bound)
            if self.grip is not None:
                values, _ = self._pushed(nu, chi)
            return self._called("slip_spins", values)["contact_spin"]
        if not self.axial and "slip_spins" not in self.kernel.signatures:
            return self.kernel.wheel_rates(nu, chi)[1]
        return self._called("slip_spins", self._state(nu, chi))["contact_spin"]

    def carried(self, nu: np.ndarray, chi: np.ndarray) -> np.ndarray:
        """(..., N, 1) in rad/s, for each wheel's free rollers."""
        return self.kernel.carried_beyond_rolling(nu, chi, self.rates)[..., None]

    @property
    def _massless_stick(self) -> bool:
        """Whether massless rollers may stick: their modes are given beside."""
        return "slip_contact_loss" in self.kernel.signatures

    @property
    def _shares(self) -> bool:
        """Whether wheels may stand on their joint: then two rollers share their load."""
        return self.kernel.pivots

    def _state(self, nu: np.ndarray, chi: np.ndarray) -> dict[str, np.ndarray]:
        return self._upright | dict(self.states) | {"nu": nu, "chi": chi}

    @property
    def tilts(self) -> bool:
        """Whether loads come from springs, on which the platform heaves and tilts."""
        return "support_state" in self.kernel.signatures

    @property
    def _upright(self) -> dict[str, np.ndarray]:
        """Heave and tilt where they are not given: those of a vehicle that stands upright."""
        if not self.tilts:
            return {}
        none = np.zeros((*self.rates.shape[:-1], 3))
        return {"tilt": none, "tilt_rate": none, "presses": np.ones_like(self.rates)}

    def energy(self, nu: np.ndarray, chi: np.ndarray, spins: np.ndarray | None) -> np.ndarray:
        """(...) in J, the kinetic energy; `spins` are those of the free rollers."""
        axial = None if spins is None else self.kernel.axial_speeds(nu, chi, spins) + self.carried(nu, chi)
        return self.energy_by_axial(nu, chi, axial)

    def energy_by_axial(self, nu: np.ndarray, chi: np.ndarray, axial: np.ndarray | None) -> np.ndarray:
        """The same from the axial speeds (..., N, n-1) of the free rollers."""
        free = () if axial is None else (axial,)
        upright = self.kernel.call("slip_energy", nu, self.rates, *self.axial, *free)
        if not self.tilts:
            return upright
        return np.asarray(upright + call_named(self.kernel, "tilt_energy", self._state(nu, chi)))

    def forces(self, nu: np.ndarray, chi: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        """Slip velocities and forces of the ground (..., N, 2), in m/s and N, along the axle and along the rolling
        direction; and the loads (..., N) in N, None under a law that knows none."""
        if self.grip is None:
            known = dict(zip(self.kernel.constant_names, self.kernel.constants, strict=True)).get("contact_load")
            loads = None if known is None else np.broadcast_to(known, self.rates.shape)
            more = self._massless_stick or self.tilts or self._shares
            values = self._beside(nu, chi) if more else self._state(nu, chi)
            if self._shares:
                values |= self._called("slip_dynamics", values)
            found = self._called("slip_forces", values)
            if self.tilts:
                loads = self._called("support_state", values)["support_loads"]
            return found["slip"], found["ground_force"], loads
        slip, values = self._in_modes(nu, chi)
        return slip, values["ground_force"], self._loads(values)

    def accelerations(self, nu: np.ndarray, chi: np.ndarray) -> dict[str, np.ndarray]:
        """nu_dot, rates_dot and of free rollers contact_omega_dot, by name, beside what they were computed from."""
        if self.grip is not None:
            return self._in_modes(nu, chi)[1]
        if "disk_dynamics" in self.kernel.signatures:
            bound = "does not tell accelerations where rollers stick and wheels may slip; give it a roller_speed"
            raise InvalidValueError("effects", "Bearings", bound)
        values = self._beside(nu, chi)
        return values | self._called("spring_dynamics" if self.tilts else "slip_dynamics", values)

    def _loads(self, values: dict[str, np.ndarray]) -> np.ndarray:
        """(..., N) in N, of contacts that may stick."""
        if self.tilts:
            return self._called("support_state", values)["support_loads"]
        return np.broadcast_to(self.grip.loads, self.rates.shape)

    def _in_modes(self, nu: np.ndarray, chi: np.ndarray) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Slip velocities, and the accelerations, where contacts stick and slip."""
        values, slip = self._pushed(nu, chi)
        taken = {"contact_bearing": values["contact_taken"]} if self._massless_stick else {}
        dynamics = "sprung_dynamics" if self.kernel.sprung else "ground_dynamics"
        return slip, values | self._called(dynamics, values | taken)

    def _pushed(self, nu: np.ndarray, chi: np.ndarray) -> tuple[dict[str, np.ndarray], np.ndarray]:
        """What the accelerations take where contacts may stick, with the forces on those that slip; and the slips
        (..., N, 2)."""
        values = self._beside(nu, chi)
        sticks = np.broadcast_to(values["sticks"] > 0.5, self.rates.shape)
        values["ground_push"], values["ground_yield"] = np.zeros((*sticks.shape, 2)), np.zeros(sticks.shape)
        if self._shares:
            friction = np.broadcast_to(self.grip.sliding, values["ground_push"].shape)
            values |= {"load": self._loads(values), "friction": friction, "next_share": np.zeros(sticks.shape)}
            values["slip_preload"] = np.where(self.stands, values["slip_heading"], 0.0)
        slip = self._called("slip_forces", values)["slip"]
        slip[sticks] = 0.0
        heading = np.stack([np.cos(values["slip_heading"]), np.sin(values["slip_heading"])], axis=-1)
        rounding = slip_roundings(self.kernel.vehicle, nu, self.rates, *(self.axial or (None,)))
        stands = {"standing_dynamics", "bearing_dynamics"} & self.kernel.signatures.keys()
        if stands and rounding.ndim > 1:  # a whole vehicle may come to rest
            rounding = np.maximum(rounding, LEFT_OF * rounding.max())
        slips = slip_says(slip, heading, rounding, SLOW_STANDING if stands else SLOW)
        if self._massless_stick:
            slips &= values["contact_sticks"] > 0.5
        towards, loads = np.where(slips[..., None], slip, heading), self._loads(values)
        force, _ = self.kernel.call("sliding_forces", towards, loads, self.grip.sliding)
        values["ground_push"] = np.where((sticks | self.stands | (loads == 0))[..., None], 0.0, force)
        if self._massless_stick:
            values |= {"slips": ~sticks & (loads > 0), "slip_direction": towards}
            self._take(values)
            turns, corner = self._slip_in_corners(values, np.where(loads > 0, loads, 1.0), slip)
            values["ground_push"][..., 1] = np.where(turns, corner, values["ground_push"][..., 1])
        return values, slip

    def _take(self, values: dict[str, np.ndarray]) -> None:
        """Where massless rollers may stick: puts what bearings of rollers that do take, whose contacts slip."""
        sticks = values["contact_sticks"] > 0.5
        values["contact_bearing"] = np.where(sticks, 0.0, values["contact_bearing"])
        holding = self._called("slip_spins", values)["contact_holding"]
        values["contact_taken"] = np.where(values["slips"] & sticks, holding, values["contact_taken"])

    def _slip_in_corners(
        self, values: dict[str, np.ndarray], loads: np.ndarray, slip: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Which contacts (..., N) bool slip on rollers that turn, and the forces (..., N) in N on these along the
        rolling direction; puts their slips along the axles (maxima/effects/contact_strip.mac)."""
        turns = values["slips"] & ~(values["contact_sticks"] > 0.5)
        known = {"load": np.where(turns, loads, 1.0), "friction": self.grip.sliding}
        corner = self._called("corner_forces", values | known)
        values["ground_yield"] = np.where(turns, corner["corner_yield"], 0.0)
        slip[turns] = self._called("slip_forces", values)["slip"][turns]
        return turns, corner["corner_force"]

    def _beside(self, nu: np.ndarray, chi: np.ndarray) -> dict[str, np.ndarray]:
        """The inputs of the accelerations but the forces on contacts that slip."""
        none = {name: np.zeros_like(self.rates) for name in ("sticks", "axle_sticks")}
        none |= {"next_before": self.states["next_omega"]} if "next_omega" in self.states else {}  # axial has it
        values = none | self._state(nu, chi) | dict(self.given()) | dict(self.states)
        if self.kernel.has_spins and "momenta" not in values:
            values["momenta"] = self.kernel.momenta(values["axial"])
        if MOMENTS[0] in values:
            cos, sin = (values[name] for name in MOMENTS)
            values["bearing_momenta_dot"] = np.stack([cos, sin], axis=-1)
            values["bearing_drag"] = -(np.sin(chi) * cos + np.cos(chi) * sin)  # sum of - torque sin(chi + kappa)
        if "slip_roller_rates" in self.kernel.signatures:
            values["roller_drag"] = call_named(self.kernel, "slip_roller_rates", values)[1]
        if "coulomb_momenta" in self.kernel.signatures:
            values["coulomb_momenta_dot"] = call_named(self.kernel, "coulomb_momenta", values)
        return values

    def _called(self, name: str, values: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """What a function gives, by name."""
        outputs = self.kernel.signatures[name].outputs
        found = call_named(self.kernel, name, values)
        each = found if len(outputs) > 1 else (found,)
        return {argument.name: value for argument, value in zip(outputs, each, strict=True)}
