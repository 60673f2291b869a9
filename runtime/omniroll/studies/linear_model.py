"""A linear model with names, and how it goes into other tools."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from os import PathLike

import numpy as np

from omniroll import durable, extras, validation
from omniroll.effects.linear_loop import held
from omniroll.errors import InvalidValueError
from omniroll.validation import positive

ARRAYS = ("A", "B", "C", "D", "rates", "outputs_at", "state", "input", "hessians")
SHOWN = 4  # digits in a table


@dataclass(frozen=True)
class LinearModel:
    """x' = rates + A (x - x0) + B (u - u0), y = outputs_at + C (x - x0) + D (u - u0); leading axes are those of nu.

    A, B, C, D    (..., S, S), (..., S, U), (..., Y, S), (..., Y, U)
    rates         (..., S) the rates at the state; a discrete model: how far x moves in one step
    outputs_at    (..., Y) the outputs at the state
    state         (..., S) x0
    input         (..., U) u0
    states, inputs, outputs   their names, in order: "nu[0]" in 1/s, "chi[0]" in rad, "pose[0]" in m, "pose[2]" in rad,
                  "momenta[0][0]" in kg m^2/s; "torque[0]" in N m or "voltage[0]" in V; "wheel_rates[0]" in rad/s
    step          seconds between two samples, or None for a model in continuous time
    hessians      (..., S, S + U, S + U) second derivatives of each rate by states and inputs, or None

    print(model) shows it as a table with names.
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    rates: np.ndarray
    outputs_at: np.ndarray
    state: np.ndarray
    input: np.ndarray
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    step: float | None = None
    hessians: np.ndarray | None = None

    def discrete(self, step: float) -> "LinearModel":
        """The model from sample to sample, exact for an input that is held: the exponential of [A B rates; 0 0 0].

        step  in s, positive. Raises InvalidValueError for other steps, and for a model that is discrete already. The
        model in discrete time has no hessians.
        """
        if self.step is not None:
            raise InvalidValueError("step", step, f"the model is discrete already, with a step of {self.step} s")
        step = positive("step", step)
        free, forced = held(self.A, np.concatenate([self.B, self.rates[..., None]], axis=-1), step)
        return replace(self, A=free, B=forced[..., :-1], rates=forced[..., -1], step=step, hessians=None)

    def select(self, *states: str, outputs: Sequence[str] | None = None) -> "LinearModel":
        """The model of these states; all others stay where they are, at x0.

        states   names: "nu" is all of nu, "nu[2]" one of it; their order stays
        outputs  names in the same manner; by default those that read no state that is gone

        Raises InvalidValueError for names that the model lacks, and for outputs that read a state that is gone.
        """
        kept = named("states", states, self.states)
        gone = np.setdiff1d(np.arange(len(self.states)), kept)
        reads = self.C[..., gone].any(axis=(*range(self.C.ndim - 2), -1))
        rows = np.flatnonzero(~reads) if outputs is None else named("outputs", outputs, self.outputs)
        if reads[rows].any():
            name = self.outputs[rows[np.argmax(reads[rows])]]
            raise InvalidValueError("outputs", name, "reads a state that is not selected")
        return self._of(kept, rows)

    def without_integrals(self) -> "LinearModel":
        """The model without states that nothing else depends on, and without states that nothing moves, one after the
        other: x and y, the heading without a slope, momenta without friction. The rest is exact, and Riccati's equation
        has a solution where it can be controlled. Outputs that read what is gone go, too.

        Raises InvalidValueError for a model that is discrete: call it before `discrete`.
        """
        if self.step is not None:
            raise InvalidValueError("step", self.step, "take the integrals out before discrete()")
        leads = tuple(range(self.A.ndim - 2))
        acts, moved = self.A.any(axis=leads), np.concatenate([self.A, self.B], axis=-1).any(axis=leads)
        kept = np.arange(len(self.states))
        while len(kept):
            on_others = acts[np.ix_(kept, kept)].any(axis=0)
            moves = moved[np.ix_(kept, [*kept, *range(len(self.states), moved.shape[1])])].any(axis=1)
            if (stays := on_others & moves).all():
                break
            kept = kept[stays]
        gone = np.setdiff1d(np.arange(len(self.states)), kept)
        reads = self.C[..., gone].any(axis=(*leads, -1))
        return self._of(kept, np.flatnonzero(~reads))

    def _of(self, kept: np.ndarray, rows: np.ndarray) -> "LinearModel":
        """The model of some states and outputs, by their places."""
        second = None
        if self.hessians is not None:
            width = [*kept, *range(len(self.states), len(self.states) + len(self.inputs))]
            second = self.hessians[..., kept[:, None, None], np.array(width)[:, None], width]
        return replace(
            self, A=self.A[..., kept[:, None], kept], B=self.B[..., kept, :], C=self.C[..., rows[:, None], kept],
            D=self.D[..., rows, :], rates=self.rates[..., kept], state=self.state[..., kept],
            outputs_at=self.outputs_at[..., rows], states=tuple(self.states[k] for k in kept),
            outputs=tuple(self.outputs[k] for k in rows), hessians=second,
        )  # fmt: skip

    def __str__(self) -> str:
        if self.A.ndim != 2:
            shape = "x".join(map(str, self.A.shape[:-2]))
            counts = (f"{len(getattr(self, name))} {name}" for name in ("states", "inputs", "outputs"))
            return f"{shape} linear models: {', '.join(counts)}"
        moves = "x' of" if self.step is None else f"x after {self.step:g} s of"
        head = [moves, *self.states, "|", *self.inputs, "|", "at x0, u0"]
        of_states = zip(self.states, self.A, self.B, self.rates, strict=True)
        of_outputs = zip(self.outputs, self.C, self.D, self.outputs_at, strict=True)
        rows = [[name, *a, "|", *b, "|", at] for name, a, b, at in of_states]
        rows.append(["y of"] + [""] * (len(head) - 1))
        rows += [[name, *c, "|", *d, "|", at] for name, c, d, at in of_outputs]
        texts = [head, *([_shown(entry) for entry in row] for row in rows)]
        widths = [max(map(len, column)) for column in zip(*texts, strict=True)]
        first = widths.pop(0)
        lines = ("  ".join([name.ljust(first), *map(str.rjust, row, widths)]) for name, *row in texts)
        return "\n".join(line.rstrip() for line in lines)

    def to_scipy(self):
        """The same as scipy.signal.StateSpace, for deviations from the state; of one state alone."""
        from scipy.signal import StateSpace

        timing = {} if self.step is None else {"dt": self.step}
        return StateSpace(*self._one(), **timing)

    def to_control(self):
        """The same as control.StateSpace of python-control, with the names. Raises MissingPackageError without it."""
        control = extras.needed("control", "control", "to_control")
        names = {"states": list(self.states), "inputs": list(self.inputs), "outputs": list(self.outputs)}
        return control.ss(*self._one(), 0 if self.step is None else self.step, **names)

    def to_mat(self, path: str | PathLike[str]) -> None:
        """Write a .mat file (path) for MATLAB and Octave: A, B, C, D, Ts (0 in continuous time), the point x0, u0,
        f0 (rates), y0, and the names as cells StateName, InputName, OutputName; the hessians, if there are any, as H.

        There: m = load("robot.mat"); sys = ss(m.A, m.B, m.C, m.D, m.Ts, "StateName", m.StateName, ...).
        """
        from scipy.io import savemat

        path = validation.file_path("path", path)
        A, B, C, D = self._one()
        cells = {"StateName": self.states, "InputName": self.inputs, "OutputName": self.outputs}
        content = {
            "A": A, "B": B, "C": C, "D": D, "Ts": 0.0 if self.step is None else self.step, "x0": self.state[:, None],
            "u0": self.input[:, None], "f0": self.rates[:, None], "y0": self.outputs_at[:, None],
            **{name: np.array(names, object)[:, None] for name, names in cells.items()},
            **({} if self.hessians is None else {"H": self.hessians}),
        }  # fmt: skip
        with durable.whole_file(path, "wb") as file:
            savemat(file, content)

    def _one(self) -> tuple[np.ndarray, ...]:
        if self.A.ndim != 2:
            raise InvalidValueError("nu", self.state.shape[:-1], "these tools take the model of one state")
        return self.A, self.B, self.C, self.D


def named(field: str, asked: Iterable[str], known: Sequence[str]) -> np.ndarray:
    """The places of names, in the model's order; a name without brackets is all of its numbers."""
    places = set()
    for name in validation.sequence(field, asked, "must be a sequence of names"):
        validation.text(field, name)
        found = [k for k, own in enumerate(known) if own == name or own.partition("[")[0] == name]
        if not found:
            bound = f"must be one of {', '.join(known) or 'none'}, or such a name without [...]"
            raise InvalidValueError(field, name, bound)
        places |= set(found)
    return np.array(sorted(places), int)


def _shown(entry: object) -> str:
    if isinstance(entry, str):
        return entry
    return f"{float(entry) + 0.0:.{SHOWN}g}" if abs(entry) > 1e-14 else "0"
