"""Free rollers that stick on their disks, in 40 digits, beside rollers in contact and axles that do, where wheels roll.

Of the generated formulas it takes the accelerations that given torques of all bearings make, and the impact.
Bearings that stick must be independent: at the rest of the whole vehicle they are not.
"""

from typing import Any

from flint import arb

from hard import true_events
from hard.constrained import Row
from hard.moving import CONSTANTS, larger, split
from hard.true_events import ROUNDED
from hard.true_friction import Torques
from omniroll.engine.runs import Task
from omniroll.kernels import sets
from omniroll.studies.accuracy.acting import Acting
from omniroll.studies.accuracy.mechanics import elementary, flat, nested_numbers

START = ("nu", "chi", "pose", "spins")


class Rolling:
    """The formulas of a task, with one of its numbers larger by `change`; a state is nu, chi, pose and spins."""

    contacts, ground, heavy = 0, None, True

    def __init__(self, task: Task, name: str, change: Any):
        number, place = split(name)
        bound, self.task, self.start_number = task.kernel, task, (number, place, change)
        self.kernel, self.module = bound, sets.python_module(bound.base, bound.effects)
        self.wheels, self.rollers = bound.wheels, bound.rollers_per_wheel
        values = (nested_numbers(value.tolist(), arb) for value in bound.constants)
        constants = dict(zip(bound.constant_names, values, strict=True))
        self.bearings, moved = Torques.of(task.effects.effects, self.wheels, self.rollers, name, change)
        kernel_name = CONSTANTS.get(number, number)
        if kernel_name in constants:
            constants[kernel_name] = larger(constants[kernel_name], place, change)
        elif not moved and number not in START:
            raise ValueError(f"{name} is no number of this reference")
        self.model = self.module.prepare(self.wheels, self.rollers, *constants.values())
        self.joint = elementary().circle_ratio(arb(1)) / self.rollers
        self.acting = Acting(task, arb)

    def start(self) -> tuple[Row, list]:
        state, (number, place, change) = self.task.state, self.start_number
        given = {name: nested_numbers(getattr(state, name).tolist(), arb) for name in ("nu", "chi", "pose")}
        axial = nested_numbers(state.free_axial().tolist(), arb)
        spins = self.module.spins_from_axial(self.model, given["nu"], given["chi"], axial)
        given["spins"] = [[arb(0) if abs(float(s)) < ROUNDED else s for s in wheel] for wheel in spins]
        if number in given:
            given[number] = larger(given[number], place, change)
        return list(flat([given[name] for name in START])), []

    def shown(self, y: Row, axial: list) -> Row:
        """nu, chi, the pose and the spins of a state."""
        return y

    def parts(self, y: Row) -> dict[str, Any]:
        n, each = self.wheels, self.rollers - 1
        spins = y[6 + n :]
        return {
            "nu": y[:3], "chi": y[3 : 3 + n], "pose": y[3 + n : 6 + n],
            "spins": [spins[i * each : (i + 1) * each] for i in range(n)],
        }  # fmt: skip

    def slip(self, y: Row) -> list[Row]:
        return []

    def loads_at_rest(self) -> Row:
        return []

    def turning(self, y: Row) -> Row:
        """The rates of all bearings."""
        known = self.parts(y)
        wheels, contacts = self.module.wheel_rates(self.model, known["nu"], known["chi"])
        return [*(wheels if self.bearings.axles else []), *contacts, *flat(known["spins"])]

    def with_bearings(self, inputs: dict[str, Any], torques: Row) -> dict[str, Any]:
        """The inputs with the torques of all bearings."""
        axles, n, each = self.bearings.axles, self.wheels, self.rollers - 1
        free = torques[axles + n :]
        of_rollers = {"contact_bearing": torques[axles : axles + n]}
        of_rollers["free_bearing"] = [free[i * each : (i + 1) * each] for i in range(n)]
        return inputs | of_rollers | ({"bearing_torque": torques[:axles]} if axles else {})

    def rates(self, y: Row, forces: list[Row], inputs: dict[str, Any]) -> Row:
        known = self.parts(y) | inputs
        known["heading"] = known["pose"][2]
        arguments = (known[argument.name] for argument in self.kernel.signatures["accelerations"].inputs)
        nu_dot, spins_dot = getattr(self.module, self.kernel.form("accelerations"))(self.model, *arguments)
        chi_dot = self.module.wheel_speeds(self.model, known["nu"])
        pose_dot = self.module.pose_rates(self.model, known["nu"], known["pose"][2])
        return [*nu_dot, *chi_dot, *pose_dot, *flat(spins_dot)]

    def switched(self, y: Row, axial: list, i: int, direction: int) -> tuple[Row, list]:
        """After wheel i has passed to its next roller. Axial speeds of free rollers stay; the one that comes into
        contact has what the contact demands, under `impact` of another nu."""
        known = self.parts(y)
        nu, chi, spins, m = known["nu"], known["chi"], known["spins"], self.module
        after = [-direction * self.joint if k == i else value for k, value in enumerate(chi)]
        axial, contact = m.axial_speeds(self.model, nu, chi, spins), m.contact_axial(self.model, nu, chi)
        entering = [arb(0)] * self.wheels
        spin = spins[i][-1] if direction > 0 else spins[i][0]
        entering[i] = spin - m.wheel_rates(self.model, nu, after)[1][i]
        axial[i] = [contact[i], *axial[i][:-1]] if direction > 0 else [*axial[i][1:], contact[i]]
        if self.task.switching == "impact":
            leaving = [arb(0)] * self.wheels
            nu = getattr(m, self.kernel.form("impact"))(self.model, nu, after, entering, leaving)
        spins = m.spins_from_axial(self.model, nu, after, axial)
        return [arb(value).mid() for value in flat([nu, after, known["pose"], spins])], []


class Run(true_events.Run):
    formulas = Rolling
