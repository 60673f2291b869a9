"""Linear models of a vehicle near a state: for controllers, filters and whoever asks how it answers.

The derivatives are those of generated functions (maxima/effects/derivatives.mac): M* nu' = f differentiated, one
factorisation of M* for all columns; for sharp tips the steps of their own form differentiated; where wheels may slip,
the functions of the rates on numbers that carry tangents. They hold between two events: until a roller changes, a motor
reaches or leaves its limit.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import chain

import numpy as np
from numpy.typing import ArrayLike

from omniroll.effects.effect import Effect
from omniroll.effects.effect_set import DRIVES, EffectSet
from omniroll.effects.sampled import without_controllers
from omniroll.errors import InvalidValueError
from omniroll.kernels.kernel import DERIVATIVES, Kernel
from omniroll.kernels.neutral_kernel import best_backend
from omniroll.kernels.phases import Carry, kernel_in_phase
from omniroll.kernels.tangent_kernel import TangentKernel
from omniroll.results.measurements import Instruments, axles_tell_all
from omniroll.scenes.loading import Scene
from omniroll.studies.linear_by_tangents import near_by_tangents
from omniroll.studies.linear_model import ARRAYS, LinearModel
from omniroll.studies.linear_rates import RatesNear, rolling_near, second_derivatives
from omniroll.studies.linear_readings import READINGS, WHOLE, readings_near
from omniroll.validation import choice, trailing
from omniroll.vehicles import checks
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import ROLLER_MODEL

OUTPUTS = ("nu", "chi", "pose", "wheel_rates", "yaw_rate")
OF_MOTION = ("nu", "chi", "pose", "rates")  # what readings are made from
MOST_WHEELS = 100  # matrices are dense


def linearise(
    what: Vehicle | Scene,
    *,
    nu: ArrayLike | None = None,
    chi: ArrayLike | None = None,
    spins: ArrayLike | None = None,
    pose: ArrayLike | None = None,
    roller_model: str | None = None,
    effects: Sequence[Effect] | None = None,
    outputs: Sequence[str] = OUTPUTS,
    place: ArrayLike = (0, 0),
    hessians: bool = False,
) -> LinearModel:
    """The linear model of a vehicle or a scene near a state.

    what          Vehicle, or a Scene, whose start and effects are taken where they are not given
    nu            (..., 3) in 1/s; 0 where neither is given
    chi           (..., N) in rad, or one angle for all wheels; 0
    spins         (..., N, n-1) in rad/s, of free rollers relative to their disks; 0
    pose          (..., 3) in m, m, rad; 0
    roller_model  "free", "locked" or "massless"; "free"
    effects       what acts on the vehicle, with its numbers at the start: the torques and voltages there are u0. A
                  controller is left out, since its output is an input of the model; without any drive the inputs are
                  torques
    outputs       of "nu", "chi", "pose", "wheel_rates", "yaw_rate", and of the readings of ideal instruments that
                  omniroll.vocabulary.MEASUREMENTS has: "wheel_angle", "wheel_rate", "net_torque", "motor_current",
                  "motor_voltage", "gyro", "accelerometer", "odometry", of encoders that count without steps
    place         (2,) in m, of the accelerometer in the platform's frame
    hessians      whether the model has the second derivatives of the rates, too, of omni-wheels that roll

    Leading axes broadcast. The states are nu, chi, the pose, and with free rollers the two momenta of each wheel, which
    are all that the vehicle feels of them. Between two events (3.4), (2.2) and (2.3) have these derivatives.

    Where wheels may slip, under the laws `viscous` and `regularised`, the wheels' rates are states behind the pose, and
    of free rollers `contact_omega`, the axial speeds of those in contact; with Coulomb friction of free rollers that
    fades at a speed `axial`, those of all others, in the place of the momenta. Rates and spins are those that the
    Contact gives; without them the state rolls. Loads that follow the motion do so in A and B as well.

    Of two rows of rollers those carry that do where a run starts, the outer ones.

    Where the rollers end in sharp tips, elimination in M* would lose digits of the derivatives: there the generated
    derivatives are those of the form of forward_dynamics for such tips.

    Returns a LinearModel. Raises InvalidValueError for axles and rollers that stick (Coulomb friction without a
    named speed), for Coulomb friction of free rollers that roll, which makes each roller a state, for contacts that may
    stick (the law `coulomb`), where loads follow the motion for a vehicle that tips or that no set of contacts carries,
    for more than 100 wheels, and for values that do not fit.
    """
    given = dict(what.options) if isinstance(what, Scene) else {}
    vehicle = what.vehicle if isinstance(what, Scene) else what
    if not isinstance(vehicle, Vehicle):
        raise InvalidValueError("what", what, "must be a Vehicle or a Scene")
    if vehicle.wheels > MOST_WHEELS:
        raise InvalidValueError(
            "wheels", vehicle.wheels, f"must be at most {MOST_WHEELS}: the model's matrices are dense"
        )
    asked = {"nu": nu, "chi": chi, "spins": spins, "pose": pose, "roller_model": roller_model, "effects": effects}
    given |= {name: value for name, value in asked.items() if value is not None}
    if isinstance(outputs, str) or not isinstance(outputs, Sequence):
        raise InvalidValueError("outputs", outputs, "must be a sequence of names")
    for name in outputs:
        if name in WHOLE:
            raise InvalidValueError("outputs", name, "jumps from one whole number to the next, and has no slope")
        choice("outputs", name, (*OUTPUTS, *READINGS))
    instruments = Instruments(place=place)
    roller_model = ROLLER_MODEL.checked(given.get("roller_model", "free"))
    acting = EffectSet.checked(without_controllers(given.get("effects", ())), vehicle)
    _refuse_what_has_no_derivative(acting, roller_model)
    by_tangents = acting.slips or vehicle.rows > 1 or vehicle.rows_move or vehicle.has_kinds
    if by_tangents:
        first = np.zeros(vehicle.wheels, int)  # the rollers that carry where a run starts
        bound = kernel_in_phase(acting.kernel(vehicle, roller_model, "python"), Carry(first, first))
        near_of = near_by_tangents
    else:
        backend = best_backend(roller_model)
        near_of, bound = rolling_near, acting.kernel(vehicle, roller_model, backend, also=(DERIVATIVES,))
    if "odometry" in outputs and by_tangents:
        bound = "asks for wheels that roll, omni-wheels in one row: of others it is not the pose"
        raise InvalidValueError("outputs", "odometry", bound)
    if "odometry" in outputs and not axles_tell_all(bound):
        raise InvalidValueError("outputs", "odometry", "asks for axles whose rates tell all of the motion")
    points = _points(bound, given)
    near = [near_of(bound, acting, given.get("start_time", 0), *point) for point in points.flat]
    if hessians and by_tangents:
        bound = "are those of omni-wheels in one row that roll: leave them out for mecanum, two rows and a Contact"
        raise InvalidValueError("hessians", hessians, bound)
    models = [_model(rates, bound, acting, instruments, tuple(outputs)) for rates in near]
    if hessians:
        carrying = TangentKernel(bound)
        models = [replace(m, hessians=second_derivatives(carrying, one)) for m, one in zip(models, near, strict=True)]
    return _together(models, points.shape)


def _refuse_what_has_no_derivative(acting: EffectSet, roller_model: str) -> None:
    by_name = {name: effect for effect in acting.effects for name in effect.kernel_effects()}
    if "contact_coulomb" in by_name:
        bound = "contacts that stick have no derivative where they begin to slip; viscous and regularised are smooth"
        raise InvalidValueError("law", by_name["contact_coulomb"].law, bound)
    if "axle_sticking" in by_name:
        bound = "axles that stick have no derivative at rest; wheel_speed gives the regularised law, which has one"
        raise InvalidValueError("wheel_coulomb", by_name["axle_sticking"].wheel_coulomb, bound)
    if "roller_sticking" in by_name:
        bound = "rollers that stick have no derivative at rest; roller_speed gives the regularised law, which has one"
        raise InvalidValueError("roller_coulomb", by_name["roller_sticking"].roller_coulomb, bound)
    if "contact_springs" in by_name:
        raise InvalidValueError("effects", "Springs", "have no linear model: leave them out for loads at rest")
    if roller_model == "free" and "roller_coulomb" in by_name and not acting.slips:
        bound = "Coulomb friction of free rollers makes each roller a state; the linear model knows viscous friction"
        raise InvalidValueError("roller_coulomb", by_name["roller_coulomb"].roller_coulomb, bound)


def _points(bound: Kernel, given: Mapping) -> np.ndarray:
    """An array of the states' leading shape; each entry is nu (3,), chi (N,), pose (3,) and the free rollers' axial
    speeds (N, n-1) or None."""
    nu = checks.speeds(given.get("nu", (0, 0, 0)))
    chi = checks.wheel_angles_in_contact(given.get("chi", 0), bound.vehicle)
    pose = trailing("pose", given.get("pose", (0, 0, 0)), (3,))
    spins = checks.free_spins(given.get("spins", 0), bound.vehicle, bound.roller_model)
    axial = None if spins is None else bound.axial_speeds(nu, chi, spins)
    leads = [nu.shape[:-1], chi.shape[:-1], pose.shape[:-1], *([] if axial is None else [axial.shape[:-2]])]
    try:
        points = np.empty(np.broadcast_shapes(*leads), object)
    except ValueError:
        raise InvalidValueError("nu", leads, "leading axes of nu, chi, spins and pose must broadcast") from None
    if not points.size:
        raise InvalidValueError("nu", points.shape, "must hold at least one state")
    nu, chi, pose = (np.broadcast_to(a, (*points.shape, a.shape[-1])) for a in (nu, chi, pose))
    if axial is not None:
        axial = np.broadcast_to(axial, (*points.shape, *axial.shape[-2:]))
    for place in np.ndindex(points.shape):
        points[place] = nu[place], chi[place], pose[place], None if axial is None else axial[place]
    return points


def _model(
    near: RatesNear, bound: Kernel, acting: EffectSet, instruments: Instruments, wanted: tuple[str, ...]
) -> LinearModel:
    """The model of one state."""
    parts, rates, layout, wheels = near.parts, near.rates, near.layout, bound.wheels
    by_state_and_input = np.hstack([near.A, near.B])  # of the rates
    own = [name for name in OF_MOTION if name in parts]
    slopes = {name: np.eye(*by_state_and_input.shape)[layout[name]] for name in own}
    values = parts | {"wheel_rates": rates["chi"], "yaw_rate": rates["pose"][2:]}
    rows = slopes | {
        "wheel_rates": by_state_and_input[layout["chi"]], "yaw_rate": by_state_and_input[layout["pose"]][2:],
    }  # fmt: skip
    if readings := [name for name in wanted if name in READINGS]:
        known = {name: parts[name] for name in own} | {"nu_dot": rates["nu"]}
        known |= {name: near.signals[name] for name in DRIVES if name in near.signals}
        if bound.pivots:
            known["rates"], slopes["rates"] = rates["chi"], by_state_and_input[layout["chi"]]
        slopes["nu_dot"] = by_state_and_input[layout["nu"]]
        slopes["torque"] = np.hstack([np.zeros((wheels, len(near.A))), np.diag(near.torque_per_signal)])
        read, by = readings_near(bound, acting, known, slopes, instruments, readings)
        values, rows = values | read, rows | by
    if lacking := [name for name in wanted if name not in rows]:
        raise InvalidValueError("outputs", lacking[0], "asks for a Motor as the only drive")
    of_outputs = [np.zeros((0, by_state_and_input.shape[1])), *(rows[name] for name in wanted)]
    C, D = np.split(np.concatenate(of_outputs), [len(near.A)], 1)
    signal = "torque" if near.modal is None else near.modal.signal
    return LinearModel(
        near.A, near.B, C, D,
        rates=layout.joined(rates),
        outputs_at=np.concatenate([values[name] for name in wanted] or [np.zeros(0)]),
        state=layout.joined(parts),
        input=near.signals[signal],
        states=tuple(chain.from_iterable(_names(name, part.shape) for name, part in parts.items())),
        inputs=tuple(_names(signal, (wheels,))),
        outputs=tuple(chain.from_iterable(_names(name, values[name].shape) for name in wanted)),
    )  # fmt: skip


def _names(name: str, shape: tuple[int, ...]) -> list[str]:
    return [name + "".join(f"[{k}]" for k in place) for place in np.ndindex(shape)]


def _together(models: Sequence[LinearModel], shape: tuple[int, ...]) -> LinearModel:
    """The models of several states as one, with the leading axes of the states."""
    arrays = [name for name in ARRAYS if getattr(models[0], name) is not None]
    stacked = {name: np.stack([getattr(model, name) for model in models]) for name in arrays}
    return replace(models[0], **{name: array.reshape(*shape, *array.shape[1:]) for name, array in stacked.items()})
