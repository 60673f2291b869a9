"""A vehicle's mechanics in the number type of a reference solution: the generated Python kernel, called by names.

A state y is a list of numbers: nu, chi, the pose, what the effects integrate, and with effects the time since the phase
began, at the end.
"""

import importlib
from collections.abc import Callable, Iterator
from typing import Any

from omniroll.engine.runs import Task
from omniroll.kernels import sets
from omniroll.studies.accuracy.acting import Acting
from omniroll.studies.accuracy.sticking import Excess, Sticking

PLAIN = ("forward_dynamics", "wheel_speeds", "pose_rates")
MOTION = {"nu": "nu_dot", "chi": "chi_dot", "pose": "pose_dot"}
# With so many digits the axial speeds of free rollers serve as a state, and the engines' spins are checked by others.
AXIAL = {"spins": "axial", "spins_dot": "axial_dot"}
INSTEAD = {"accelerations": ("momenta", "roller_rates"), "roller_losses": ()}


class Mechanics:
    """What a reference solution asks of `task`; numbers are made from floats, exactly, by `number`."""

    def __init__(self, task: Task, number: Callable[[float], Any]):
        bound = task.kernel
        self.task, self.number = task, number
        self.module = sets.python_module(bound.base, bound.effects)
        self.wheels, self.rollers = bound.wheels, bound.rollers_per_wheel
        constants = [nested_numbers(value.tolist(), number) for value in bound.constants]
        self.model = self.module.prepare(self.wheels, self.rollers, *constants)
        self.joint = elementary().circle_ratio(number(1.0)) / self.rollers
        self.free = bound.has_spins
        self.vector = task.effects.state_vector(bound)
        self.places = {AXIAL.get(name, name): name for name in self.vector.slices}
        rates = {quantity.name: quantity.rate for quantity in self.vector.quantities}
        self.rate_of = MOTION | {AXIAL.get(name, name): AXIAL.get(rate, rate) for name, rate in rates.items()}
        asked = (INSTEAD.get(name, (name,)) for name in task.effects.functions(bound.roller_model))
        self.functions = (*(name for names in asked for name in names), *PLAIN)
        self.acting = Acting(task, number) if task.effects else None
        axles = task.effects.bearings(bound).get("axle")
        self.axles = None if axles is None else Sticking(bound.wheel_rows, axles, number)
        self.functions += ("forces",) if self.axles is not None else ()

    # A phase

    def start(self) -> tuple[list, Any]:
        """y and the free rollers' axial speeds [N][n-1] at the start of the run."""
        state, number = self.task.state, self.number
        axial = state.free_axial()
        axial = None if axial is None else nested_numbers(axial.tolist(), number)
        y = [number(float(value)) for value in (*state.nu, *state.chi, *state.pose)]
        y += [number(0.0)] * (self.vector.size - len(y)) + [number(0.0)] * (self.acting is not None)
        return self.with_rollers(y, axial), axial

    def with_rollers(self, y: list, axial: Any) -> list:
        """y where what the effects integrate about the free rollers begins anew with these axial speeds."""
        y = list(y)
        for quantity in self.vector.quantities:
            if quantity.account == 0:
                name = AXIAL.get(quantity.name, quantity.name)
                values = axial if name == "axial" else getattr(self.module, name)(self.model, axial)
                y[self.vector.slices[quantity.name]] = list(flat(values))
        return y

    def begin(self, y: list, axial: Any, now: Any) -> list:
        """y where a phase starts at `now`: what acts is what acts from now on, and its time is 0."""
        self.inputs = {}
        if self.free and "momenta" not in self.rate_of:
            self.inputs["momenta"] = self.module.momenta(self.model, axial)
        if self.acting is not None:
            self.acting.begin(now)
            y = [*y[:-1], self.number(0.0)]
        if self.axles is not None:
            y = self._with_axles(self.axles, y)
        self.before = y
        self.asked: tuple[list | None, list[Excess]] = None, []  # a state, and its excesses
        return y

    def _with_axles(self, axles: Sticking, y: list) -> list:
        """y where it is decided which axles stick, and the rates of these are zero; their events beside the others."""
        if axles.stuck:
            mass_matrix = self.module.mass_matrix(self.model, self.view(y, "chi"))
            y = [*axles.at_rest(mass_matrix, self.view(y, "nu")), *y[3:]]
            axles.decide(mass_matrix, self._known(y)["force"])
        self.acting.events += axles.events(y[:3])
        return y

    def excesses(self, y: list) -> list[Excess]:
        """How much more than they can the axles that stick would have to hold in a state of this phase."""
        if self.axles is None or not self.axles.stuck:
            return []
        if self.asked[0] is not y:
            known = self._known(y)
            mass_matrix = self.module.mass_matrix(self.model, known["chi"])
            _, force = self.axles.held(mass_matrix, known["force"], self.axles.stuck)
            self.asked = y, self.axles.excesses(force, self.axles.stuck)
        return self.asked[1]

    def axial_at(self, y: list, axial: Any) -> Any:
        """The free rollers' axial speeds in a state of the phase that began with `axial`."""
        if "axial" in self.rate_of:
            return self.view(y, "axial")
        if "momenta" in self.rate_of:
            momenta = (self.view(state, "momenta") for state in (self.before, y))
            return middle(self.module.axial_after(self.model, axial, *momenta, y[-1]))
        return axial

    def view(self, y: list, name: str) -> Any:
        """A quantity of the state, as nested lists."""
        place = self.places[name]
        return _shaped(iter(y[self.vector.slices[place]]), self.vector.shapes[place])

    def rates(self, y: list) -> list:
        """y'."""
        known = self._known(y)
        if self.axles is not None and self.axles.stuck:
            mass_matrix = self.module.mass_matrix(self.model, known["chi"])
            known["nu_dot"], _ = self.axles.held(mass_matrix, known["force"], self.axles.stuck)
        rates = [number for rate in self.rate_of.values() for number in flat(known[rate])]
        return rates if self.acting is None else [*rates, self.number(1.0)]

    def _known(self, y: list) -> dict[str, Any]:
        """The state, what acts, and what the functions give of it, by name; without what holds the axles that stick."""
        known = {name: self.view(y, name) for name in self.rate_of} | self.inputs
        known["theta"] = known["heading"] = known["pose"][2]
        if self.acting is not None:
            known |= self.acting.at(y[-1])
        if self.axles is not None:
            known["bearing_torque"] = self.axles.torques()
        for name in self.functions:
            signature = self.task.kernel.signatures[name]
            found = self.form(name)(self.model, *(known[argument.name] for argument in signature.inputs))
            outputs = found if len(signature.outputs) > 1 else (found,)
            known |= {argument.name: value for argument, value in zip(signature.outputs, outputs, strict=True)}
        return known

    # What a phase ends with

    def form(self, name: str) -> Callable:
        """The generated function for the rollers' tips."""
        return getattr(self.module, self.task.kernel.form(name))

    def wheel_speeds(self, nu: list) -> list:
        return self.module.wheel_speeds(self.model, nu)

    def energy(self, y: list, axial: Any) -> Any:
        nu, chi = self.view(y, "nu"), self.view(y, "chi")
        if not self.free:
            return self.module.energy(self.model, nu, chi)
        return self.module.energy(self.model, nu, chi, self.module.spins_from_axial(self.model, nu, chi, axial))

    def switched(self, y: list, axial: Any, moves: dict[int, int]) -> tuple[list, Any]:
        """y and the free rollers' axial speeds [N][n-1] after the wheels in `moves` have switched together."""
        nu, chi = self.view(y, "nu"), self.view(y, "chi")
        after = [-moves[i] * self.joint if i in moves else chi[i] for i in range(self.wheels)]
        zero = self.number(0.0)
        _, left_with = self.module.wheel_rates(self.model, nu, chi)
        _, demanded = self.module.wheel_rates(self.model, nu, after)
        entering, leaving = [zero] * self.wheels, [zero] * self.wheels
        if self.free:
            spins = self.module.spins_from_axial(self.model, nu, chi, axial)
            contact = self.module.contact_axial(self.model, nu, chi)
            axial = [list(wheel) for wheel in axial]
        for i, direction in moves.items():
            spin = zero
            if self.free:
                spin = spins[i][-1] if direction > 0 else spins[i][0]
                axial[i] = [contact[i], *axial[i][:-1]] if direction > 0 else [*axial[i][1:], contact[i]]
            else:
                leaving[i] = left_with[i]
            entering[i] = spin - demanded[i]
        if self.task.switching == "impact" and hasattr(self.module, "impact"):
            nu = self.form("impact")(self.model, nu, after, entering, leaving)
        axial = middle(axial)
        return self.with_rollers([*middle(nu), *after, *y[3 + self.wheels :]], axial), axial


def elementary() -> Any:
    return importlib.import_module("omniroll.generated.python.elementary")


def nested_numbers(value: Any, number: Callable[[float], Any]) -> Any:
    """Nested lists of floats as such lists of numbers."""
    return [nested_numbers(inner, number) for inner in value] if isinstance(value, list) else number(value)


def middle(value: Any) -> Any:
    """A number, or nested lists of them, without the bounds that flint's have: kept from phase to phase they would
    grow until they swallow the digits."""
    if isinstance(value, (list, tuple)):
        return [middle(inner) for inner in value]
    return value.mid() if hasattr(value, "mid") else value


def flat(value: Any) -> Iterator[Any]:
    """The numbers of nested lists, in order."""
    if isinstance(value, (list, tuple)):
        for inner in value:
            yield from flat(inner)
    else:
        yield value


def _shaped(numbers: Iterator[Any], shape: tuple[int, ...]) -> Any:
    return [_shaped(numbers, shape[1:]) for _ in range(shape[0])] if shape else next(numbers)
