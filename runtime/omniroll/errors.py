"""The errors that omniroll raises by name."""

from functools import partial
from typing import Any

LONGEST = 400  # characters of a value that are shown


def _shown(value: Any) -> str:
    """A value as text, cut where it is long."""
    try:
        text = repr(value)
    except Exception:  # an integer of thousands of digits, or an object whose own code fails
        text = f"a value of type {type(value).__name__}"
    return text if len(text) <= LONGEST else text[: LONGEST - 4] + " ..."


class OmnirollError(Exception):
    """Base of every error that omniroll raises by itself."""


class InvalidValueError(OmnirollError, ValueError):
    """An argument that makes no sense.

    field   name of the argument or of the vehicle's field
    value   what was given
    bound   the rule that it breaks, in words
    """

    def __init__(self, field: str, value: Any, bound: str):
        super().__init__(f"{field} = {_shown(value)}: {bound}")
        self.field, self.value, self.bound = field, value, bound

    def __reduce__(self):
        return type(self), (self.field, self.value, self.bound)


class LogError(InvalidValueError):
    """A log that makes no sense.

    source  name of the file, or of the log
    line    number of the line in the file, the line of names being 1; of arrays, the row from 0; or None
    field   name of the column, or None
    value   what stands there, or None
    bound   what is wrong, in words
    """

    def __init__(self, source: str, line: int | None, field: str | None, value: Any, bound: str):
        super().__init__(field, value, bound)
        place = ":".join(str(part) for part in (source, line) if part is not None)
        what = " = ".join(part for part in (field, None if value is None else _shown(value)) if part)
        self.args = (f"{place}: {what + ': ' if what else ''}{bound}",)
        self.source, self.line = source, line

    def __reduce__(self):
        return type(self), (self.source, self.line, self.field, self.value, self.bound)


class KernelsMissingError(OmnirollError, RuntimeError):
    """The compiled kernels were asked for and are not there."""


class MissingPackageError(OmnirollError, ImportError):
    """A package is missing that only some users need.

    package  its name
    extra    of omniroll that installs it
    purpose  what needs it, the subject of a sentence
    """

    def __init__(self, package: str, extra: str, purpose: str):
        super().__init__(f"{purpose} needs {package}, which is missing: pip install 'omniroll[{extra}]'")
        self.package, self.extra, self.purpose = package, extra, purpose

    def __reduce__(self):
        return type(self), (self.package, self.extra, self.purpose)


class SimulationStopped(OmnirollError, RuntimeError):
    """A run that cannot go on: switches without progress in time, or a step that cannot be made.

    reason      in words
    t           time at which the run stopped
    wheel       number of a wheel that kept it from going on, from 0, or None; the message counts from 1
    state       dict with nu, chi, pose and contact at that time
    trajectory  the trajectory up to that time
    """

    def __init__(self, reason: str, *, t: float, wheel: int | None, state: dict, trajectory: Any = None):
        at = f"t = {t!r}" + (f", wheel {wheel + 1}" if wheel is not None else "")
        shown = ", ".join(f"{name} = {value!r}" for name, value in state.items())
        super().__init__(f"stopped at {at}: {reason} ({shown})")
        self.reason, self.t, self.wheel, self.state, self.trajectory = reason, t, wheel, state, trajectory


class NoDerivativeError(OmnirollError, ValueError):
    """An instant at which a run has no derivative: the motion beside it differs by more than a little.

    reason  in words
    t       time
    wheels  numbers of the wheels that it is about
    """

    def __init__(self, reason: str, *, t: float, wheels: tuple[int, ...]):
        super().__init__(f"no derivative at t = {t!r}, wheels {', '.join(map(str, wheels))}: {reason}")
        self.reason, self.t, self.wheels = reason, t, wheels

    def __reduce__(self):
        return partial(type(self), self.reason, t=self.t, wheels=self.wheels), ()


class SweepInterrupted(OmnirollError, KeyboardInterrupt):
    """simulate_many was interrupted.

    many  Many with what was done until then; the other runs count as stopped
    """

    def __init__(self, many: Any):
        done = many.stopped.size - sum(reason.startswith("interrupted") for reason in many.reasons.values())
        super().__init__(f"{done} of {many.stopped.size} runs are done")
        self.many = many


class RollingWarning(UserWarning):
    """Rolling without slip could not have held: a force beyond friction, or a load that would have to pull."""


class UnstableControllerWarning(UserWarning):
    """A sampled controller whose errors grow from sample to sample."""


class OneSidedWarning(UserWarning):
    """A derivative that holds for changes of one sign alone."""


class AccuracyWarning(UserWarning):
    """The estimated error of a run is larger than the accuracy that was asked for."""
