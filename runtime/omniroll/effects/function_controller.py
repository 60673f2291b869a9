"""A controller that is a Python function, called at its sample times; its output is held until the next one.

A file can name a function only where that is registered: register_controller gives it its name. A scene, and a
trajectory that is read back, find the function by this name.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from omniroll.effects.named import check_name, keep_named, origin_of
from omniroll.effects.numbers import per_wheel, plain_numbers, read_only, refuse_undriven, spread
from omniroll.effects.sampled import Sampled, SampledDrive
from omniroll.errors import InvalidValueError
from omniroll.kernels.kernel import Kernel
from omniroll.vehicles.state import State
from omniroll.vocabulary import FUNCTION_CONTROLLER, documented

Function = Callable[[float, "Measured"], ArrayLike]
Registered = TypeVar("Registered", bound=Callable)

CONTROLLERS: dict[str, Callable] = {}  # by the names under which they are registered


def register_controller(name: str) -> Callable[[Registered], Registered]:
    """A decorator that registers a function, or a class, as a controller.

    name  str, by which scenes and saved trajectories name it

    The same function may be registered again, for instance where a module is loaded anew. Raises InvalidValueError
    for a name that is empty or another function's.
    """
    check_name(name)
    return lambda function: keep_named(CONTROLLERS, name, function)


@dataclass(frozen=True)
class Measured:
    """What a function sees of the vehicle at a sample; arrays that cannot be written.

    nu            (3,) in 1/s
    chi           (N,) in rad
    pose          (3,) x, y in m, theta in rad
    contact       (N,) int, the physical roller in contact
    wheel_speeds  (N,) in rad/s, the rates of chi, (2.2)
    """

    nu: np.ndarray
    chi: np.ndarray
    pose: np.ndarray
    contact: np.ndarray
    kernel: Kernel
    rates: np.ndarray | None = None

    @cached_property
    def wheel_speeds(self) -> np.ndarray:
        return self.kernel.wheel_speeds(self.nu, self.chi) if self.rates is None else self.rates


@documented(*FUNCTION_CONTROLLER)
@dataclass(frozen=True)
class FunctionController(SampledDrive):
    """A controller that is a Python function: function(time, state) gives the output for each wheel.

    {entries}

    function may also be given as it is: then it is called, but no file can name it. Its arguments are the time in s on
    the clock of the run, and a state with the arrays nu, chi, pose, contact and wheel_speeds. It returns one number for
    all wheels, or one for each. simulate makes more than one run, and so a function that remembers something must be a
    class: each run makes its own object of it without arguments, and calls that.

    Raises InvalidValueError for a name that is not registered, and for numbers out of their bounds; simulate raises it
    for an output of voltages without a Motor, and where the function gives other than N finite numbers.
    """

    function: Function | type | str
    sample_time: float
    output: str = "torque"

    def __post_init__(self) -> None:
        names = (name for name, function in CONTROLLERS.items() if function is self.function)
        self._put(function=next(names, self.function))
        given = callable(self.function)
        self._keep_checked(entry for entry in FUNCTION_CONTROLLER if not (given and entry.name == "function"))
        _ = self._callable

    @property
    def _callable(self) -> Callable:
        """The function or the class. Raises InvalidValueError where none of the name is registered."""
        if callable(self.function):
            return self.function
        if self.function in CONTROLLERS:
            return CONTROLLERS[self.function]
        known = ", ".join(sorted(CONTROLLERS)) or "there is none"
        bound = f"is not the name of a registered controller ({known}); first import the module that registers it with "
        raise InvalidValueError("function", self.function, bound + "omniroll.register_controller")

    def events(self) -> tuple[str, ...]:
        return (f"calls of the function {self._shown}, every {self.sample_time:g} s",)

    @property
    def _shown(self) -> str:
        return origin_of(self.function) if callable(self.function) else self.function

    def process(self, kernel: Kernel, start_time: float) -> "Calling":
        return Calling(self, kernel, start_time, self._callable)

    def as_dict(self) -> dict[str, Any]:
        """Kind and fields, in plain Python types. Raises InvalidValueError for a function that has no name."""
        if callable(self.function):
            bound = "has no name that a file could keep; register it with omniroll.register_controller"
            raise InvalidValueError("function", self._shown, bound)
        return super().as_dict()

    def __reduce__(self) -> tuple:
        """For pickle: with the function in the place of its name, so that its module is imported where it is read."""
        return type(self), (self._callable, self.sample_time, self.output)


class Calling(Sampled):
    """The function in one run. Of a class it makes an object."""

    def __init__(self, controller: FunctionController, kernel: Kernel, start_time: float, function: Callable):
        super().__init__(controller, kernel)
        self.start_time = start_time
        self.function = function() if isinstance(function, type) else function
        self.memory = vars(self.function) if isinstance(function, type) else {}

    def pass_time(self, state: State) -> None:
        arrays = [read_only(array) for array in (state.nu, state.chi, state.pose, state.contact)]
        rates = None if state.rates is None else read_only(state.rates)
        given = self.function(self.start_time + self.next_time(), Measured(*arrays, self.kernel, rates))
        self.output = _output(given, self.kernel.wheels)
        refuse_undriven("function", self.output, self.kernel.vehicle)
        self.samples += 1

    def saved(self) -> dict[str, Any]:
        return {"samples": self.samples, "output": self.output, "memory": self.memory}

    def restore(self, saved: Mapping[str, Any]) -> None:
        self.samples, self.output = saved["samples"], saved["output"]
        self.memory.clear()
        self.memory.update(saved["memory"])


def _output(given: ArrayLike, wheels: int) -> np.ndarray:
    """(N,) what a function has given. Raises InvalidValueError."""
    numbers = plain_numbers(given, wheels)
    return spread("function", per_wheel("function", given), wheels) if numbers is None else np.array(numbers)
