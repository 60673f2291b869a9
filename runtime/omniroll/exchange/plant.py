"""A vehicle as other programs take it: its generated C, its numbers, its start, inputs in the place of controllers."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from numpy.typing import ArrayLike

from omniroll.codegen.along import SECOND
from omniroll.effects.effect import Effect
from omniroll.effects.effect_set import EffectRun, EffectSet
from omniroll.effects.sampled import without_controllers
from omniroll.errors import InvalidValueError
from omniroll.kernels import firmware, sets
from omniroll.kernels.kernel import DERIVATIVES, Kernel
from omniroll.validation import trailing
from omniroll.vehicles import checks, profiles
from omniroll.vehicles.checks import refuse_two_rows
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import ROLLER_MODEL, SWITCHING

KNOWN = {"nu", "chi", "momenta", "heading", "roller_drag", "torque", "damping"}  # what a step gives its accelerations
PREFIX = "omniroll"
ENVIRONMENT = Environment(
    loader=PackageLoader("omniroll.exchange"), undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True,
    keep_trailing_newline=True,
)  # fmt: skip


@dataclass(frozen=True)
class Plant:
    """What moves, without what controls it.

    kernel  of the vehicle with its effects
    law     of the switches, "impact" or "smooth"
    signal  what is put in at each wheel: "voltage" in V where there is a motor, else "torque" in N m
    start   by name: nu (3,), pose (3,), chi (N,), of free rollers spins (N, n-1), and the signal (N,)
    """

    kernel: Kernel
    law: str
    signal: str
    start: dict[str, np.ndarray]

    @classmethod
    def of(
        cls,
        vehicle: Vehicle,
        *,
        nu: ArrayLike = (0, 0, 0),
        chi: ArrayLike = 0,
        spins: ArrayLike | None = None,
        pose: ArrayLike = (0, 0, 0),
        roller_model: str = "free",
        switching: str = "impact",
        effects: Sequence[Effect] = (),
        start_time: float = 0.0,
        derivatives: bool = False,
    ) -> "Plant":
        """Arguments as of simulate. Raises InvalidValueError for what the generated step of a controller lacks."""
        if not isinstance(vehicle, Vehicle):
            raise InvalidValueError("vehicle", vehicle, "must be a Vehicle")
        acting = EffectSet.checked(without_controllers(effects), vehicle)
        roller_model = ROLLER_MODEL.checked(roller_model)
        bound = acting.kernel(vehicle, roller_model, "python")
        refuse_what_no_step_has(bound)
        if derivatives:
            bound = acting.kernel(vehicle, roller_model, "python", also=(DERIVATIVES, SECOND))
        start = {
            "nu": checks.speeds(nu),
            "pose": trailing("pose", pose, (3,)),
            "chi": checks.wheel_angles_in_contact(chi, bound.vehicle),
        }
        if (own := checks.free_spins(0 if spins is None else spins, bound.vehicle, roller_model)) is not None:
            start["spins"] = own
        for name, value in start.items():
            if value.ndim > 1 + (name == "spins"):
                raise InvalidValueError(name, value.shape, "must be of one state")
        run = EffectRun(acting, bound, start_time)
        run.begin_phase(0.0)
        signal = "voltage" if "motor" in bound.effects else "torque"
        start = {name: np.array(value, float) for name, value in start.items()}
        start[signal] = np.array(run.signals[signal].value)
        return cls(bound, SWITCHING.checked(switching), signal, start)

    def pair(self) -> dict[str, str]:
        """The texts of the generated header and source, by file name."""
        return firmware.pair_files(self.kernel.base, self.kernel.effects, PREFIX, False, self.kernel.sharp)

    def arguments(self, function: str) -> list[dict]:
        """The arguments of a generated function: name, shape, unit, meaning, role."""
        functions = sets.functions(self.kernel.base, self.kernel.effects)
        return next(f["arguments"] for f in functions if f["name"] == function)


def refuse_what_no_step_has(bound: Kernel) -> None:
    """Raises InvalidValueError where the generated step does not decide all that acts."""
    vehicle, moves = bound.vehicle, profiles.field_of(bound.vehicle) or "roller_angle"
    none = "there is no generated step for these yet"
    refuse_two_rows(vehicle, "rows", vehicle.rows, "export it with rows = 1, the middle of the wheels")
    checks.refuse_kinds(vehicle, "wheel_kinds", vehicle.wheel_kinds, none)
    checks.refuse_moving_rows(vehicle, moves, getattr(vehicle, moves), none)
    if bound.slips:
        bound = "cannot be exported: the generated step is that of wheels that roll"
        raise InvalidValueError("effects", "Contact", bound)
    further = [a.name for a in bound.signatures["forward_dynamics"].inputs if a.name not in KNOWN]
    if further:
        what = "bearings that stick cannot be exported; wheel_speed and roller_speed give laws that can"
        raise InvalidValueError("effects", bound.set_name, f"needs {further[0]}: {what}")


def filled(template: str, **values: object) -> str:
    """The text of an exported file."""
    return ENVIRONMENT.get_template(f"{template}.j2").render(**values)
