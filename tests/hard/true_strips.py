"""Massless rollers that stick on their disks beside contacts that stick on the ground, and axles, in 40 digits.

Of the generated formulas it takes the accelerations that given forces of the ground make, the speeds of rigid wheels,
and the balance of loads that follow the motion, which are three more unknown numbers. That a contact's force along the
axle is its roller's torque over the arm, where rollers turn, the ellipse, and its normal along which a contact slips
whose roller turns, are put down here. What sticks is held by unknown forces and torques (hard.true_ground), which must
be determined.
"""

from typing import Any

from flint import arb

from hard import true_ground
from hard.constrained import Row
from hard.true_ground import BEGINS, OFF, SLIPS, STICKS, STILL, Phase, Vehicle, sign_of
from omniroll.kernels.kernel import Kernel


class Rigid(Vehicle):
    """The formulas of wheels whose rollers all stick, under given forces of the ground along both directions. Bearings
    are those of axles, if these may stick, then of the rollers in contact (N,)."""

    two_ways = True

    def _of_ground(self) -> list[str]:
        loads = ["contact_loads"] if "contact_loads" in self.task.kernel.effects else []
        return ["contact", "contact_coulomb", "roller_sticking", *loads]

    @staticmethod
    def _bearings_of_rollers(bound: Kernel) -> int:
        return 1

    def parts(self, y: Row) -> dict[str, Any]:
        n = self.wheels
        found = {"nu": y[:3], "chi": y[3 : 3 + n], "pose": y[3 + n : 6 + n], "rates": y[6 + n :]}
        return found | {"contact_omega": []}

    def arms(self, y: Row) -> Row:
        """In m, from the axes of the rollers in contact to the ground."""
        radius, axis = self.constants["wheel_radius"], self.constants["roller_axis_radius"]
        return [radius * chi.cos() - axis for chi in self.parts(y)["chi"]]

    def slip(self, y: Row) -> list[Row]:
        known = self.parts(y) | self._as_rigid() | {"ground_push": [[arb(0)] * 2] * self.wheels}
        return self.call("slip_forces", known)[0]

    def _as_rigid(self) -> dict[str, Row]:
        none, one = [arb(0)] * self.wheels, [arb(1)] * self.wheels
        return {"contact_sticks": one, "contact_bearing": none, "ground_yield": none, "load_factor": one}

    def rates(self, y: Row, forces: list[Row], inputs: dict[str, Any]) -> Row:
        none = [arb(0)] * self.wheels
        known = self.parts(y) | inputs | self._as_rigid() | {"ground_push": forces, "sticks": none}
        known |= {"directions": [arb(int(i == j)) for i in range(3) for j in range(3)], "absent": [arb(0)] * 3}
        nu_dot, chi_dot, rates_dot, *_ = self.call("bearing_dynamics", known)
        pose_dot = self.module.pose_rates(self.model, known["nu"], known["pose"][2])
        return [*nu_dot, *chi_dot, *pose_dot, *rates_dot]

    def turning(self, y: Row) -> Row:
        """The rates of axles, and the speeds of wheels along their axles."""
        return [*(self.parts(y)["rates"] if self.bearings.axles else []), *(axle for axle, _ in self.slip(y))]

    def with_bearings(self, inputs: dict[str, Any], torques: Row) -> dict[str, Any]:
        axles = torques[: self.bearings.axles] or [arb(0)] * self.wheels
        return inputs | {"torque": [a + b for a, b in zip(inputs["torque"], axles, strict=True)]}


class StripPhase(Phase):
    """The motion in given modes. Unknown are the forces that hold contacts, along the axle too where the roller sticks;
    where slips of two components begin to go; and what holds axles."""

    v: Rigid

    def __init__(
        self, vehicle: Rigid, modes: list[str], towards: list[int], turning: list[int], inputs: dict[str, Any]
    ):
        super().__init__(vehicle, modes, towards, turning, inputs)
        axles, self.places = vehicle.bearings.axles, {}
        self.spins = turning[axles:]
        for i, mode in enumerate(modes):
            own = (1,) if self.spins[i] else (0, 1)
            if mode == STICKS or (mode == BEGINS and own[0] == 0):
                for c in own:
                    self.places[i, c] = len(self.places)
        self.of_contacts = len(self.places)
        stuck = [i for i, sign in enumerate(turning[:axles]) if not sign]
        self.bearings = {i: self.of_contacts + k for k, i in enumerate(stuck)}
        self.of_loads = self.of_contacts + len(stuck)
        self.unknowns = self.of_loads + 3 * vehicle.is_loaded

    def forces(self, y: Row, z: Row) -> list[Row]:
        slip, arms, axles, loads = self.v.slip(y), self.v.arms(y), self.v.bearings.axles, self.loads(z)
        first, second = self.v.ground.numbers["friction"]
        found = []
        for i, (mode, spin) in enumerate(zip(self.modes, self.spins, strict=True)):
            held = [z[self.places[i, c]] if (i, c) in self.places else arb(0) for c in (0, 1)]
            if spin:
                axle = -spin * self.v.bearings.sliding[axles + i] / arms[i]
                left = ((first * loads[i]) ** 2 - axle * axle).sqrt() if mode != STICKS else arb(0)
                found.append([axle, held[1] if mode == STICKS else -self.towards[i] * left * second / first])
            elif mode in (STICKS, OFF):
                found.append(held)
            else:
                towards = slip[i] if mode == SLIPS else held
                found.append([loads[i] * f for f in self.v.ground.sliding(towards, True)])
        return found

    def speeds(self, y: Row, z: Row) -> Row:
        """Where the contact slips, too, the roller takes what that leaves."""
        found, axles = self.v.turning(y), self.v.bearings.axles
        for i, slip in self.slips_along(y, z).items():
            found[axles + i] -= slip
        return found

    def slips_along(self, y: Row, z: Row) -> dict[int, Any]:
        """In m/s, how fast contacts slip along their axles whose rollers turn: along the ellipse's normal."""
        first, second = self.v.ground.numbers["friction"]
        slip, forces, found = self.v.slip(y), self.forces(y, z), {}
        for i, (mode, spin) in enumerate(zip(self.modes, self.spins, strict=True)):
            if spin and mode != STICKS:
                axle, rolling = forces[i]
                found[i] = slip[i][1] * (axle / first**2) / (rolling / second**2)
        return found

    def goes_back(self, i: int, slip: Row) -> Any:
        if self.spins[i] and self.modes[i] in (SLIPS, BEGINS):
            return -self.towards[i] * slip[1]
        return super().goes_back(i, slip)

    def asked(self, y: Row, z: Row) -> dict[int, Any]:
        forces, arms, axles = self.forces(y, z), self.v.arms(y), self.v.bearings.axles
        of_rollers = {axles + i: arms[i] * forces[i][0] for i, spin in enumerate(self.spins) if not spin}
        return super().asked(y, z) | of_rollers


class Run(true_ground.Run):
    """The same of such a vehicle. At its start, and where they come into contact, rollers stand on their disks."""

    v: Rigid
    formulas, in_modes = Rigid, StripPhase

    def __init__(self, *given: Any):
        super().__init__(*given)
        axles = self.v.bearings.axles
        self.turning[axles:] = [0] * self.v.wheels
        self.turned = list(self.turning)
        self.at_rest = {i for i, sign in enumerate(self.turning) if not sign}

    def _turns(self, i: int) -> bool:
        return not self.turning[self.v.bearings.axles + i]

    def _has_given(self, bearing: int) -> None:
        """A roller whose contact does not slip along the rolling direction rolls."""
        i = bearing - self.v.bearings.axles
        if i < 0 or self.modes[i] == STICKS:
            return
        rolling = self.v.slip(self.y)[i][1]
        self.towards[i] = sign_of(rolling) if self.modes[i] == SLIPS else self.towards[i]
        if self.modes[i] == SLIPS and abs(float(rolling)) < STILL:
            self.modes[i] = STICKS

    def _has_gone(self, contact: int, load: Any) -> None:
        """Its roller stands if the ground turns it no more: then the contact slips along the axle as fast as it has
        turned."""
        roller, slip = self.v.bearings.axles + contact, self.v.slip(self.y)[contact]
        most = self.v.arms(self.y)[contact] * self.v.ground.numbers["friction"][0] * load
        if self.turning[roller] and sign_of(slip[0]) and float(most - self.v.bearings.sliding[roller]) < 0:
            self.turning[roller], self.modes[contact] = 0, SLIPS

    def _switch(self, i: int, direction: int) -> None:
        self.y[3 + i] = (-direction * self.v.joint).mid()
        self.log.append((float(self.now), i, "switch"))
        self.turning[self.v.bearings.axles + i] = 0
        if self.modes[i] == STICKS:
            self.modes[i] = SLIPS
            self._see()

    def _lift(self, i: int) -> None:
        """The roller of a contact that is off stands on its disk."""
        self.turning[self.v.bearings.axles + i] = 0
        super()._lift(i)
