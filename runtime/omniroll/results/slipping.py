"""What contacts do that may slip: slip velocities, forces of the ground, and what of a state follows from them."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from omniroll.effects.ground import AT_REST, Grip, slip_roundings, slip_says
from omniroll.effects.ground_loads import AT_EVENT, ROUNDINGS, Carried, carried
from omniroll.effects.ground_with_axles import LEFT_OF
from omniroll.effects.loads_beside_bearings import BesideBearings, left_of, settled, taken_and_gain
from omniroll.effects.rounds_with_loads import points_elsewhere
from omniroll.effects.slipping_bearings import MOMENTS
from omniroll.errors import InvalidValueError
from omniroll.kernels.kernel import Kernel
from omniroll.results.accelerations import call_named
from omniroll.vehicles.loads import Springs, contact_loads

ALONG = 100  # roundings of the speeds that make a slip: one that is turned by less is not
FAR_ABOVE = 1e6  # times the loads at rest: of loads so large bearings leave all of the friction


def goes_along(slip: np.ndarray, heading: np.ndarray, rounding: np.ndarray) -> np.ndarray:
    """(..., N) bool: whether unit vectors (..., N, 2) are the directions of slips within what rounding turns these by,
    by (..., N) within which slips are zero. The loads of a row are those by which an event has been located in the
    direction that the row has; where the slip is slow, rounding of it would move them."""
    across = slip[..., 1] * heading[..., 0] - slip[..., 0] * heading[..., 1]
    return (np.abs(across) <= ALONG / AT_REST * rounding) & ((slip * heading).sum(axis=-1) > 0)


Pushed = tuple[dict[str, np.ndarray], np.ndarray, np.ndarray, np.ndarray]


def _across(slip: np.ndarray, heading: np.ndarray, rounding: np.ndarray) -> np.ndarray:
    """(..., N, 2) the rolling directions, with the signs of slips (..., N, 2) that pass zero there; where one is
    rounding (..., N) with those of the headings."""
    says = np.abs(slip[..., 1]) > rounding
    sign = np.copysign(1.0, np.where(says, slip[..., 1], heading[..., 1]))
    return np.stack([0 * sign, sign], axis=-1)


class Contacts:
    """The contacts in some states (...) of a run in which wheels may slip.

    kernel  Kernel of the run
    states  what the effects integrate, by name: rates (..., N), and contact_omega (..., N) of free rollers; or spins
            of massless rollers, contact_spin (..., N), where they are known
    grip    the friction of contacts that stick and slip; None under other laws
    given   makes what their forces ask for beside: by name, heading, axial of the free rollers (None: there are none),
            and what a trajectory's rows have of the drives and of the contacts' modes
    """

    def __init__(
        self,
        kernel: Kernel,
        states: Mapping[str, np.ndarray],
        grip: Grip | None = None,
        given: Callable[[], Mapping[str, np.ndarray]] = dict,
    ):
        self.kernel, self.states, self.rates = kernel, states, states["rates"]
        self.axial = (states["contact_omega"],) if kernel.has_spins else ()
        self.grip, self.given = grip, given

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
                given = self.grip.sticks and not self.grip.balance
                values = self._pushed(nu, chi)[0] if given else self._under_grip(nu, chi)[2]
            return self._called("slip_spins", values)["contact_spin"]
        if not self.axial:
            return self.kernel.wheel_rates(nu, chi)[1]
        return call_named(self.kernel, "slip_spins", self._state(nu, chi))

    @property
    def _massless_stick(self) -> bool:
        """Whether massless rollers may stick: their modes are given beside."""
        return "slip_contact_loss" in self.kernel.signatures

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
        free = () if spins is None else (self.kernel.axial_speeds(nu, chi, spins),)
        upright = self.kernel.call("slip_energy", nu, self.rates, *self.axial, *free)
        if not self.tilts:
            return upright
        return upright + call_named(self.kernel, "tilt_energy", self._state(nu, chi))

    def forces(self, nu: np.ndarray, chi: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        """Slip velocities and forces of the ground (..., N, 2), in m/s and N, along the axle and along the rolling
        direction; and the loads (..., N) in N, None under a law that knows none."""
        if self.grip is None:
            known = dict(zip(self.kernel.constant_names, self.kernel.constants, strict=True)).get("contact_load")
            loads = None if known is None else np.broadcast_to(known, self.rates.shape)
            more = self._massless_stick or self.tilts
            values = self._beside(nu, chi) if more else self._state(nu, chi)
            found = self._called("slip_forces", values)
            if self.tilts:
                loads = self._called("support_state", values)["support_loads"]
            return found["slip"], found["ground_force"], loads
        slip, loads, values = self._under_grip(nu, chi)
        return slip, values["ground_force"], loads

    def accelerations(self, nu: np.ndarray, chi: np.ndarray) -> dict[str, np.ndarray]:
        """nu_dot, rates_dot and of free rollers contact_omega_dot, by name, beside what they were computed from."""
        if self.grip is not None:
            return self._under_grip(nu, chi)[2]
        if "disk_dynamics" in self.kernel.signatures:
            bound = "does not tell accelerations where rollers stick and wheels may slip; give it a roller_speed"
            raise InvalidValueError("effects", "Bearings", bound)
        values = self._beside(nu, chi)
        return values | self._called("spring_dynamics" if self.tilts else "slip_dynamics", values)

    def _under_grip(self, nu: np.ndarray, chi: np.ndarray) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
        """Slip velocities, loads, and the accelerations where contacts have modes."""
        return (self._in_modes if self.grip.sticks else self._under_loads)(nu, chi)

    def _in_modes(self, nu: np.ndarray, chi: np.ndarray) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
        """The same where they may stick."""
        values, slip, given, misled = self._pushed(nu, chi)
        taken = {"contact_bearing": values["contact_taken"]} if self._massless_stick else {}
        moving = values | taken
        loads = self._loads("ground_dynamics", moving, misled / AT_REST) if self.grip.balance else given
        values["load_factor"] = moving["load_factor"]
        if self.grip.balance and self._massless_stick:
            values["contact_taken"] = moving["contact_bearing"]
            self._slip_in_corners(values, loads, slip)
        return slip, loads, values | self._called("ground_dynamics", moving)

    def _pushed(self, nu: np.ndarray, chi: np.ndarray) -> Pushed:
        """What the accelerations take where contacts may stick, with the forces on those that slip; the slips (..., N,
        2), the loads (..., N) by which forces are given, and by how much rounding turns slips, (..., 1) in rad."""
        values = self._beside(nu, chi)
        sticks = np.broadcast_to(values["sticks"] > 0.5, self.rates.shape)
        values["ground_push"] = np.zeros((*sticks.shape, 2))
        values["ground_yield"], values["damped_yield"] = np.zeros(sticks.shape), np.zeros(sticks.shape)
        slip = self._called("slip_forces", values)["slip"]
        slip[sticks] = 0.0
        heading = np.stack([np.cos(values["slip_heading"]), np.sin(values["slip_heading"])], axis=-1)
        rounding = slip_roundings(self.kernel.vehicle, nu, self.rates, *(self.axial or (None,)))
        if "damped_corners" in self.kernel.signatures:
            heading = np.where((values["contact_sticks"] < 0.5)[..., None], _across(slip, heading, rounding), heading)
        stands = {"standing_dynamics", "bearing_dynamics"} & self.kernel.signatures.keys()
        if stands and rounding.ndim > 1:  # a whole vehicle may come to rest
            rounding = np.maximum(rounding, LEFT_OF * rounding.max())
        slips = slip_says(slip, heading, rounding)
        if self.grip.balance:
            slips &= ~goes_along(slip, heading, rounding)
        if self._massless_stick:
            slips &= values["contact_sticks"] > 0.5
        towards = np.where(slips[..., None], slip, heading)
        given = np.ones(sticks.shape) if self.grip.balance else np.broadcast_to(self.grip.loads, sticks.shape)
        force = self.grip.sliding_forces(self.kernel, towards, given)
        values["ground_push"] = np.where((sticks | (given == 0))[..., None], 0.0, force)
        if self._massless_stick:
            values |= {"slips": ~sticks & (given > 0), "slip_direction": towards}
            self._take(values)
            if not self.grip.balance:
                loads = np.where(self.grip.loads > 0, self.grip.loads, 1.0)
                turns, corner = self._slip_in_corners(values, loads, slip)
                values["ground_push"][..., 1] = np.where(turns, corner, values["ground_push"][..., 1])
        size = np.where(slips, np.linalg.norm(slip, axis=-1), 1.0)
        misled = np.where(slips & ~sticks, rounding / size, 0.0).max(axis=-1, keepdims=True)
        return values, slip, given, misled

    def _take(self, values: dict[str, np.ndarray]) -> None:
        """Where massless rollers may stick: puts what bearings of rollers that do take, whose contacts slip."""
        sticks = values["contact_sticks"] > 0.5
        values["contact_bearing"] = np.where(sticks, 0.0, values["contact_bearing"])
        holding = self._called("slip_spins", values)["contact_holding"]
        values["held_by_load"] = np.where(values["slips"] & sticks, holding, 0.0)
        values["contact_taken"] = np.where(values["slips"] & sticks, holding, values["contact_taken"])

    def _slip_in_corners(
        self, values: dict[str, np.ndarray], loads: np.ndarray, slip: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Which contacts (..., N) bool slip on rollers that turn, and the forces (..., N) in N on these along the
        rolling direction; puts their slips along the axles (maxima/effects/contact_strip.mac)."""
        turns = values["slips"] & ~(values["contact_sticks"] > 0.5)
        known = {"load": np.where(turns, loads, 1.0), "friction": self.grip.sliding}
        if "damped_corners" in self.kernel.signatures:
            return turns, self._slip_beside_dampers(values, known, slip, turns)
        corner = self._called("corner_forces", values | known)
        values["ground_yield"] = np.where(turns, corner["corner_yield"], 0.0)
        slip[turns] = self._called("slip_forces", values)["slip"][turns]
        return turns, corner["corner_force"]

    def _slip_beside_dampers(
        self, values: dict[str, np.ndarray], known: Mapping[str, np.ndarray], slip: np.ndarray, turns: np.ndarray
    ) -> np.ndarray:
        """The same where bearings have viscous friction, of the contacts `turns` (maxima/effects/
        contact_damped_strip.mac)."""
        corner = self._called("damped_corners", values | known)
        values["damped_yield"] = np.where(turns, corner["root_yield"], 0.0)
        slip[turns] = self._called("slip_forces", values)["slip"][turns]
        return corner["damped_force"]

    def _under_loads(self, nu: np.ndarray, chi: np.ndarray) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
        """The same under a smooth law whose loads follow the motion."""
        values = self._beside(nu, chi)
        loads = self._loads("slip_dynamics", values)
        values |= self._called("slip_dynamics", values) | self._called("slip_forces", values)
        return values["slip"], loads, values

    def _beside(self, nu: np.ndarray, chi: np.ndarray) -> dict[str, np.ndarray]:
        """The inputs of the accelerations but the forces on contacts that slip."""
        none = {name: np.zeros_like(self.rates) for name in ("sticks", "axle_sticks")}
        none |= {name: np.ones_like(self.rates) for name in ("load_factor", "passed_on")}
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
        return {argument.name: value for argument, value in zip(outputs, found, strict=True)}

    def _loads(self, dynamics: str, values: dict[str, np.ndarray], misled: np.ndarray | float = 0.0) -> np.ndarray:
        """Loads (..., N) that follow the motion, by this function of the accelerations; `values` gets load_factor.

        misled  (..., 1) how far rounding turns the forces on contacts that slip: a load that vanishes is found to so
                much of the weight, and is zero within it
        """
        shape = self.rates.shape
        carries = np.broadcast_to(values["carries"] > 0.5, shape)
        springs = Springs(self.kernel.vehicle.places())
        shares = np.array([springs.shares(row) for row in carries.reshape(-1, carries.shape[-1])])

        start = np.broadcast_to(springs.rows.T @ self.grip.loads, (*shape[:-1], 3)).copy()
        arm = float(np.abs(springs.places).max())

        def about(there: np.ndarray) -> Carried:
            def sums_of(loads: np.ndarray) -> np.ndarray:
                self._press(values, loads, carries, there)
                moving = self._called(dynamics, values)
                return call_named(self.kernel, "slip_load_balance", values | self.grip.balance | moving)[0]

            return carried(shares.reshape(*shape, 3), carries, sums_of, start, arm)

        at_rest = np.broadcast_to(self.grip.loads, shape)
        # Newton's rule comes from above: below loads of which a bearing takes all of the friction it would stay.
        begins = about(FAR_ABOVE * at_rest).loads if self._left_of_loads and self.grip.sticks else at_rest
        found = self._settled(about, begins, springs) if self._left_of_loads else about(at_rest)
        rounding = (ROUNDINGS * np.finfo(float).eps + misled) * self.grip.loads.sum()
        loads = np.where(found.loads > -rounding, np.maximum(found.loads, 0.0), found.loads)
        self._press(values, loads, carries, loads)
        return loads

    def _settled(self, about: Callable[[np.ndarray], Carried], begins: np.ndarray, springs: Springs) -> Carried:
        """The loads that Newton's rule finds from `begins` (..., N) on; where some of these would pull, or there are
        none, those that it finds from loads elsewhere."""
        weight = self.grip.loads.sum()
        found = settled(about, begins, weight)
        for point in points_elsewhere(springs.places):
            wrong = ~(found.loads.min(axis=-1) > -AT_EVENT * weight)
            if not wrong.any():
                break
            from_there = contact_loads(springs.places, weight * np.append(1.0, point))
            there = settled(about, np.broadcast_to(from_there, begins.shape), weight)
            takes = wrong & (there.loads.min(axis=-1) > -AT_EVENT * weight)
            found = replace(found, loads=np.where(takes[..., None], there.loads, found.loads))
        return found

    @property
    def _left_of_loads(self) -> bool:
        """Whether bearings of massless rollers leave a part of the loads."""
        return self._massless_stick and self.grip.law != "viscous"

    def _press(self, values: dict[str, np.ndarray], loads: np.ndarray, carries: np.ndarray, about: np.ndarray) -> None:
        """Puts what the kernels take of loads (..., N); about (..., N) the friction beside rollers that turn is linear
        in them."""
        values["load_factor"] = self.grip.factor(loads, carries)
        if not self._left_of_loads:
            return
        turns = (values["contact_sticks"] < 0.5) & carries
        given = values | {"friction": self.grip.sliding}
        if "damped_corner_loads" in self.kernel.signatures:
            self._press_beside_dampers(values, loads, carries, about)
            return
        beside = BesideBearings.at(lambda there: taken_and_gain(left_of(self.kernel, given, there)), turns, about)
        values["load_factor"] = np.where(turns, beside.factor(loads), values["load_factor"])
        if not self.grip.sticks:
            values["bearing_factor"] = 1 / beside.about
            return
        values["load_factor"] *= np.where(turns, left_of(self.kernel, given, beside.about)["left_part"], 1.0)
        self._hold_by_loads(values, loads)

    def _press_beside_dampers(
        self, values: dict[str, np.ndarray], loads: np.ndarray, carries: np.ndarray, about: np.ndarray
    ) -> None:
        """The same where bearings have viscous friction, too (maxima/effects/contact_damped_loads.mac)."""
        turns = (values["contact_sticks"] < 0.5) & carries & values["slips"]
        friction = {"friction": self.grip.sliding}
        taken = left_of(self.kernel, values | friction, about)["bearing_load"]
        there = BesideBearings.about_of(taken, turns, about)
        found = self._called("damped_corner_loads", values | friction | {"load": there})
        beside = BesideBearings.with_gain(found["load_gain"], turns, there, about)
        values["load_factor"] = np.where(turns, beside.factor(loads) * found["left_part"], values["load_factor"])
        values["passed_on"] = np.where(turns, 1 + found["passed_gain"] * (loads - there) / there, 1.0)
        values["damped_yield"] = np.where(turns, found["root_yield"], 0.0)
        self._hold_by_loads(values, loads)

    def _hold_by_loads(self, values: dict[str, np.ndarray], loads: np.ndarray) -> None:
        """Rollers that stick on their disks, of contacts that slip, are held in proportion to loads (..., N)."""
        by_load = values["slips"] & (values["contact_sticks"] > 0.5)
        values["contact_bearing"] = np.where(by_load, loads * values["held_by_load"], values["contact_bearing"])
