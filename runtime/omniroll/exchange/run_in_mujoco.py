"""A run once more in MuJoCo, with a body for each roller, contacts and friction."""

import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from omniroll import extras
from omniroll.effects.bearings import Bearings
from omniroll.effects.contact import Contact
from omniroll.effects.slope import Slope
from omniroll.effects.springs import Springs
from omniroll.errors import InvalidValueError
from omniroll.exchange.mjcf import SPHERES, UP, to_mjcf
from omniroll.results.trajectory import Trajectory

PURPOSE = "a comparison with MuJoCo"
STEP = 1e-3  # s, of a comparison that asks for nothing else, as what follows
FRICTION = 1.0
FINE_SPHERES = 101  # of a roller: of 31 the motion is two to four times as far apart
UNSTABLE = ("mjWARN_BADQPOS", "mjWARN_BADQVEL", "mjWARN_BADQACC")


@dataclass(frozen=True, eq=False)
class MujocoRun:
    """What MuJoCo makes of a run of this project.

    step     in s
    t        (K,) in s, on the clock of the run
    pose     (K, 3) x, y in m, the heading in rad
    nu       (K, 3) in 1/s
    wheel_rates  (K, N) in rad/s
    seconds  that it took
    model    the MJCF text
    off_ground   part of the time that a wheel is off the ground, the mean of all: in skids MuJoCo's wheels hop
    """

    step: float
    t: np.ndarray
    pose: np.ndarray
    nu: np.ndarray
    wheel_rates: np.ndarray
    seconds: float
    model: str
    off_ground: float


def run_in_mujoco(
    trajectory: Trajectory,
    times: np.ndarray,
    step: float,
    friction: float | None = None,
    spheres: int = SPHERES,
    height: float | None = None,
) -> MujocoRun:
    """The bodies of a run's vehicle from the same start, driven by what its drives gave.

    trajectory  Trajectory, whose torques at the axles act at their times; what motors lose per rate of a wheel follows
                the rates that MuJoCo finds
    times       (K,) increasing, in s, within the run
    step        in s, MuJoCo's time step
    friction    coefficient between rollers and ground; None: that of the run's Contact, or 1
    spheres     number of spheres that stand for a roller; of few it is a polygon, on which a wheel rolls unevenly
    height      in m, of the centre of mass; None: that of the run's Springs, or the axles'

    Raises InvalidValueError where MuJoCo's simulation becomes unstable and for a step longer than the run,
    MissingPackageError without the extra `mujoco`.
    """
    mujoco = extras.needed("mujoco", "mujoco", PURPOSE)
    text = _model_text(trajectory, step, friction, spheres, height)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    _start(data, trajectory)
    wheels = range(1, trajectory.vehicle.wheels + 1)
    dofs = [int(model.joint(f"wheel{i}").dofadr[0]) for i in wheels]
    begin, end = float(trajectory.t[0]), float(trajectory.t[-1])
    steps = int((float(times[-1]) - begin) / step * (1 + 1e-12))  # whole ones that end within the run
    if not steps:
        raise InvalidValueError("step", step, f"must not be longer than the run, {float(times[-1]) - begin!r} s")
    given, lost = _drive(trajectory, np.clip(begin + step * (np.arange(steps) + 0.5), begin, end))
    rows, kept = [], np.unique(np.clip(np.round((times - begin) / step), 0, steps).astype(int))
    began = time.perf_counter()
    wheel_of, off = _wheel_of_geoms(model, len(dofs)), 0
    for k in range(steps + 1):
        if k == kept[len(rows)]:
            rows.append([*data.qpos[:7], *data.qvel[:6], *data.qvel[dofs]])
            if k == kept[-1]:
                break
        data.ctrl[:] = given[k] - lost[k] * data.qvel[dofs]
        mujoco.mj_step(model, data)
        touching = set(wheel_of[data.contact.geom].max(axis=1).tolist()) if data.ncon else ()
        off += len(dofs) - len(touching)
    seconds = time.perf_counter() - began
    if any(data.warning[int(getattr(mujoco.mjtWarning, name))].number for name in UNSTABLE):
        raise InvalidValueError("step", step, "must be smaller: MuJoCo's simulation became unstable")
    found = np.array(rows)
    pose, nu = _motion(found, trajectory)
    moments, share = np.minimum(begin + step * kept, end), off / (steps * len(dofs))
    return MujocoRun(step, moments, pose, nu, found[:, 13:], seconds, text, share)


def _wheel_of_geoms(model: Any, wheels: int) -> np.ndarray:
    """The number of the wheel that each geom is of, from 0; -1 for the ground and the platform."""
    of_body = np.full(model.nbody, -1)
    for wheel in range(wheels):
        of_body[model.body(f"wheel{wheel + 1}").id] = wheel
    for body in range(1, model.nbody):  # parents stand before their children
        if of_body[body] < 0:
            of_body[body] = of_body[model.body_parentid[body]]
    return of_body[model.geom_bodyid]


def left_out(trajectory: Trajectory) -> list[str]:
    """How the two models differ besides contacts, in words."""
    texts = []
    if trajectory.roller_model != "free":
        texts.append(f"the scene's rollers are {trajectory.roller_model}, MuJoCo's have mass and spin")
    for effect in trajectory.effects.effects:
        if isinstance(effect, Bearings):
            smooth = {"wheel_coulomb": not effect.sticks, "roller_coulomb": True}
            named = [name for name, absent in smooth.items() if absent and getattr(effect, name) is not None]
            texts += [f"{name} is not in MuJoCo's model" for name in named]
        if isinstance(effect, Contact):
            texts += _of_ground(effect)
    return texts


def _of_ground(contact: Contact) -> list[str]:
    """How the ground of a run differs from MuJoCo's."""
    texts = []
    if contact.friction is None:
        texts.append(f"the ground's friction is {contact.law}, MuJoCo's is Coulomb's, with a coefficient")
    elif np.ndim(contact.friction) and np.ptp(contact.friction):
        texts.append("the ground's friction is an ellipse, MuJoCo's is a circle of its mean")
    if contact.speed is not None:
        texts.append("the ground's friction fades below a speed, MuJoCo's contacts give way")
    if contact.static_friction is not None:
        texts.append("static_friction is not in MuJoCo's model")
    if contact.load is not None:
        texts.append("the loads are given, MuJoCo's follow from the weight")
    return texts


def friction_of(trajectory: Trajectory) -> float:
    """The coefficient between rollers and ground of a run; 1 where it has none."""
    given = [e.friction for e in trajectory.effects.effects if isinstance(e, Contact) and e.friction is not None]
    return float(np.mean(given[0])) if given else FRICTION


def _model_text(trajectory: Trajectory, step: float, friction: float | None, spheres: int, height: float | None) -> str:
    vehicle, effects = trajectory.vehicle, trajectory.effects
    friction = friction_of(trajectory) if friction is None else friction
    options: dict[str, Any] = {"armature": effects.equipped(vehicle).wheel_inertia - vehicle.wheel_inertia}
    for effect in effects.effects:
        if isinstance(effect, Slope):
            down = effect.gravity * math.sin(effect.angle)
            options["gravity"] = (
                down * math.cos(effect.direction), down * math.sin(effect.direction),
                -effect.gravity * math.cos(effect.angle),
            )  # fmt: skip
        if isinstance(effect, Springs) and height is None:
            height = effect.height
        if isinstance(effect, Contact) and effect.normal_gravity is not None and "gravity" not in options:
            options["gravity"] = (0.0, 0.0, -effect.normal_gravity)
        if isinstance(effect, Bearings) and effect.roller_viscous is not None:
            options["roller_damping"] = float(np.max(effect.roller_viscous))
    return to_mjcf(vehicle, step=step, friction=friction, spheres=spheres, height=height, **{"gravity": UP} | options)


def _start(data: Any, trajectory: Trajectory) -> None:
    """The state at the start of the run: wheels at their angles, rollers that spin as they do there."""
    vehicle, nu, chi = trajectory.vehicle, trajectory.nu[0], trajectory.chi[0]
    x, y, theta = trajectory.pose[0].tolist()
    scale = vehicle.platform_radius
    forward, left = scale * nu[0], scale * nu[1]
    c, s = math.cos(theta), math.sin(theta)
    data.qpos[:7] = x, y, vehicle.wheel_radius, math.cos(theta / 2), 0, 0, math.sin(theta / 2)
    data.qvel[:6] = forward * c - left * s, forward * s + left * c, 0, 0, 0, nu[2] / vehicle.yaw_scale
    rates = trajectory.measure(trajectory.t[:1], names=("wheel_rate",))["wheel_rate"][0]
    spins = trajectory.spins
    for i in range(vehicle.wheels):
        wheel = data.joint(f"wheel{i + 1}")
        wheel.qpos[0], wheel.qvel[0] = chi[i], rates[i]
        data.joint(f"roller{i + 1}_1").qvel[0] = trajectory.contact_spin[0, i]
        if spins is not None:
            for j in range(2, vehicle.rollers_per_wheel + 1):
                data.joint(f"roller{i + 1}_{j}").qvel[0] = spins[0, i, j - 2]


def _drive(trajectory: Trajectory, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(K, N) torques at the axles, and what they lose per rate; the bearings' among them."""
    seen = trajectory.arrays(times)
    shape = len(times), trajectory.vehicle.wheels
    zero = np.zeros(shape)
    torque = seen.get("torque", zero) + seen.get("bearing_torque", zero)
    damping = seen.get("damping", zero)
    for effect in trajectory.effects.effects:
        if isinstance(effect, Bearings):
            damping = damping + effect.constants(trajectory.vehicle).get("axle_damping", 0.0)
    return torque, damping


def _motion(rows: np.ndarray, trajectory: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """Pose and nu of rows of the platform's position, quaternion and velocities."""
    vehicle = trajectory.vehicle
    heading = 2 * np.arctan2(rows[:, 6], rows[:, 3])
    first = trajectory.pose[0, 2]
    heading = np.unwrap(np.concatenate([[first], heading]))[1:]
    c, s = np.cos(heading), np.sin(heading)
    forward, left = rows[:, 7] * c + rows[:, 8] * s, rows[:, 8] * c - rows[:, 7] * s
    scale = vehicle.platform_radius
    nu = np.column_stack([forward / scale, left / scale, rows[:, 12] * vehicle.yaw_scale])
    return np.column_stack([rows[:, :2], heading]), nu
