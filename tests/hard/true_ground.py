"""Wheels that may slip, in 40 digits: the formulas for the motion under each law of the ground.

Of the generated formulas it takes the accelerations that given forces of the ground and given torques make, and the
slip velocities. Effects beside the ground are torques. Wheels that stand must leave nu enough room for their forces to
be determined.
"""

from typing import Any

import numpy as np
from flint import arb

import omniroll
from hard import true_events
from hard.constrained import Row, solved
from hard.moving import CONSTANTS, larger, split
from hard.true_friction import Friction
from omniroll.engine.runs import Task
from omniroll.kernels.kernel import kernel
from omniroll.studies.accuracy.acting import Acting
from omniroll.studies.accuracy.mechanics import elementary, flat, nested_numbers


class Vehicle:
    """The formulas of a task, with one of its numbers larger by `change`.

    without  the model with the number as it is
    """

    bearings = None  # that may stick

    def __init__(self, task: Task, name: str, change: Any):
        contact = next(e for e in task.effects.effects if isinstance(e, omniroll.Contact))
        number, place = split(name)
        bound, self.task = task.kernel, task
        effects = ("contact", "contact_coulomb", "contact_loads", "drive")
        self.kernel = own = kernel(task.vehicle, bound.roller_model, "python", effects=effects)
        self.module = omniroll.kernels.sets.python_module(own.base, own.effects)
        self.wheels, self.rollers, self.heavy = own.wheels, own.rollers_per_wheel, own.has_spins
        constants = dict(zip(own.constant_names, (nested_numbers(c.tolist(), arb) for c in own.constants), strict=True))
        self.contacts, self.ground = own.wheels, Friction.of(contact, own.wheels)
        self.start_number, moved = (number, place, change), self.ground.move(number, place, change)
        kernel_name = CONSTANTS.get(number, number)
        self.without = self.module.prepare(self.wheels, self.rollers, *constants.values())
        if kernel_name in constants:
            constants[kernel_name], moved = larger(constants[kernel_name], place, change), True
        self.model = self.module.prepare(self.wheels, self.rollers, *constants.values())
        self.mass = constants["mass"]
        self.joint = elementary().circle_ratio(arb(1)) / self.rollers
        radius, angles = constants["platform_radius"], constants["wheel_angles"]
        self.places = [[radius * a.cos(), radius * a.sin()] for a in angles]
        self.contact = contact
        if not moved and number not in ("nu", "chi", "pose", "spins", "wheel_rates", "contact_spins"):
            raise ValueError(f"{name} is no number of this reference")
        self.acting = Acting(task, arb)

    def start(self) -> tuple[Row, list[Row]]:
        """y = nu, chi, pose, the wheels' rates and the axial speeds of the rollers in contact; and those of others."""
        state, (number, place, change) = self.task.state, self.start_number

        def given(name: str, values: Any) -> Any:
            values = nested_numbers(np.asarray(values, float).tolist(), arb)
            return larger(values, place, change) if name == number else values

        nu, chi, pose = (given(name, getattr(state, name)) for name in ("nu", "chi", "pose"))
        rates, spins = self.module.wheel_rates(self.model, nu, chi)
        if self.contact.wheel_rates is not None:
            rates = given("wheel_rates", np.broadcast_to(self.contact.wheel_rates, self.wheels))
        if not self.heavy:
            return [*nu, *chi, *pose, *rates], []
        turning = self.module.contact_axial(self.model, nu, chi)
        if self.contact.contact_spins is not None:
            own = given("contact_spins", np.broadcast_to(self.contact.contact_spins, self.wheels))
            turning = [t + o - s for t, o, s in zip(turning, own, spins, strict=True)]
        return [*nu, *chi, *pose, *rates, *turning], self._free(nu, chi)

    def _free(self, nu: Row, chi: Row) -> list[Row]:
        """The axial speeds of the free rollers: their spins stay where another number is moved."""
        state = self.task.state
        old = [nested_numbers(getattr(state, name).tolist(), arb) for name in ("nu", "chi")]
        axial = nested_numbers(state.free_axial().tolist(), arb)
        spins = self.module.spins_from_axial(self.without, *old, axial)
        number, place, change = self.start_number
        if number == "spins":
            spins = larger(spins, place, change)
        return self.module.axial_speeds(self.model, nu, chi, spins)

    def parts(self, y: Row) -> dict[str, Any]:
        n = self.wheels
        ends = {"nu": (0, 3), "chi": (3, 3 + n), "pose": (3 + n, 6 + n), "rates": (6 + n, 6 + 2 * n)}
        ends["contact_omega"] = (6 + 2 * n, 6 + 3 * n)
        return {name: y[first:last] for name, (first, last) in ends.items()}

    def shown(self, y: Row, axial: list[Row]) -> Row:
        """nu, chi, the pose and the spins of a state."""
        known, spins = self.parts(y), []
        if self.heavy:
            spins = self.module.spins_from_axial(self.model, known["nu"], known["chi"], axial)
        return [*known["nu"], *known["chi"], *known["pose"], *flat(spins)]

    def slip(self, y: Row) -> list[Row]:
        known = self.parts(y) | {"ground_push": [[arb(0)] * 2] * self.wheels, "load_factor": [arb(1)] * self.wheels}
        slip, _ = self.call("slip_forces", known)
        return slip if self.heavy else [[arb(0), rolling] for _, rolling in slip]

    def rates(self, y: Row, forces: list[Row], inputs: dict[str, Any]) -> Row:
        known = self.parts(y) | inputs | {"ground_push": forces, "load_factor": [arb(1)] * self.wheels}
        known["heading"] = known["pose"][2]
        pose_dot = self.module.pose_rates(self.model, known["nu"], known["pose"][2])
        nu_dot, chi_dot, *others = self.call("slip_dynamics", known)
        return [*nu_dot, *chi_dot, *pose_dot, *flat(others)]

    def switched(self, y: Row, axial: list[Row], i: int, direction: int) -> tuple[Row, list[Row]]:
        """After wheel i has passed to its next roller. No speed changes: the roller that comes into contact has the
        axial speed that it has."""
        y, axial, n = list(y), list(axial), self.wheels
        y[3 + i] = (-direction * self.joint).mid()
        if not self.heavy:
            return y, axial
        place, own = 6 + 2 * n + i, list(axial[i])
        leaving = y[place]
        y[place] = own.pop(-1 if direction > 0 else 0)
        axial[i] = [leaving, *own] if direction > 0 else [*own, leaving]
        return y, axial

    def call(self, name: str, known: dict[str, Any]) -> Any:
        inputs = (known[argument.name] for argument in self.kernel.signatures[name].inputs)
        return getattr(self.module, name)(self.model, *inputs)

    def springs(self, z: Row) -> Row:
        """The loads of equal springs under a platform that sinks and tilts by z."""
        return [z[0] + z[1] * x + z[2] * y for x, y in self.places]

    def moments(self, loads: Row) -> Row:
        by_place = zip(loads, self.places, strict=True)
        return [sum(column) for column in zip(*((n, n * x, n * y) for n, (x, y) in by_place), strict=True)]

    def loads_at_rest(self) -> Row:
        if self.ground.law == "viscous" or "load" in self.ground.numbers:
            return self.ground.numbers.get("load", [arb(1)] * self.wheels)
        units = [[arb(int(i == j)) for j in range(3)] for i in range(3)]
        columns = [self.moments(self.springs(unit)) for unit in units]
        matrix = [list(row) for row in zip(*columns, strict=True)]
        weight = self.mass * self.ground.numbers["normal_gravity"]
        return self.springs(solved(matrix, [weight, arb(0), arb(0)]))


class Run(true_events.Run):
    formulas = Vehicle
