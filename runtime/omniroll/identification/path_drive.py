"""What drives a vehicle along a path, rollers included: torques and voltages that are held from sample to sample.

The path says nu and the wheels' angles at any time, and so when each wheel passes to its next roller. Between two
switches the generated inverse dynamics gives the force that the motion takes, (3.4). At a switch the entering roller
takes momentum from the vehicle: nu+ is what the law leaves of nu, and M* (nu - nu+) is the momentum that brings nu back
(section 4). What a sample takes is the mean of the force over it, and the momenta of its switches over its length.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicHermiteSpline

from omniroll import validation
from omniroll.effects.bearings import Bearings
from omniroll.effects.effect import Effect
from omniroll.effects.effect_set import EffectSet
from omniroll.effects.motor import Motor, voltages_of
from omniroll.effects.numbers import table
from omniroll.effects.path_follower import Path, nu_dot_of, nu_of_rates
from omniroll.engine.switching import SwitchingModel
from omniroll.errors import InvalidValueError
from omniroll.identification.feedforward import force_of
from omniroll.kernels.kernel import Kernel
from omniroll.vehicles.state import State
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import ROLLER_MODEL, SWITCHING

NODES, WEIGHTS = np.polynomial.legendre.leggauss(3)
ROUNDS = 5  # each leaves a part of the last one's error, as large as the part of nu that a switch takes
TOGETHER = 1e-9  # s: wheels whose switches are less apart switch together


@dataclass(frozen=True, eq=False)
class PathDrive:
    """What drives a vehicle along a path; K samples, N wheels.

    times    (K,) in s, when each sample begins
    torque   (K, N) in N m, at the axles: a TorqueTable holds them
    voltage  (K, N) in V, for motors below their limits; None where no Motor is among the effects
    switches  how many times a wheel passes to its next roller
    """

    times: np.ndarray
    torque: np.ndarray
    voltage: np.ndarray | None
    switches: int


def path_drive(
    vehicle: Vehicle,
    times: ArrayLike,
    poses: ArrayLike,
    *,
    sample_time: float = 0.01,
    effects: Sequence[Effect] = (),
    roller_model: str = "free",
    switching: str = "impact",
    chi: ArrayLike = 0.0,
) -> PathDrive:
    """Torques and voltages that take a vehicle along a path, as far as what is held for a sample can.

    vehicle       Vehicle with three wheels or more
    times, poses  (P,) in s and (P, 3) of the path, with a cubic spline between them, as of a PathFollower. It begins
                  and ends at rest
    sample_time   for which outputs are held, in s
    effects       what acts beside the drive: Bearings, Slope; and a Motor, for voltages. Its own voltage is not used
    roller_model  "free", "locked" or "massless"
    switching     "impact" or "smooth"
    chi           (N,) or one number: the wheels' angles at the start, in rad; the rollers do not spin there

    Raises InvalidValueError for values that do not fit, for wheels that may slip, and for free rollers with friction in
    their bearings, whose spins are not known beforehand.
    """
    step = validation.positive("sample_time", sample_time)
    roller_model, switching = ROLLER_MODEL.checked(roller_model), SWITCHING.checked(switching)
    times, poses = (np.array(given) for given in table("poses", times, poses, "linear", width=3))
    acting = EffectSet.checked(tuple(effects), vehicle)
    bound = acting.kernel(vehicle, roller_model, "python")
    _check(bound, acting)
    count = int(np.ceil((times[-1] - times[0]) / step * (1 - 1e-12)))
    begins = times[0] + step * np.arange(count)
    ways = _Ways(bound, Path(times, poses), np.append(begins, times[-1]))
    start = np.broadcast_to(validation.real_array("chi", chi), (vehicle.wheels,)).astype(float)
    force, switches = _momenta(bound, acting, ways, start, switching)
    torque = bound.wheel_torques(force / step)
    middle = np.stack([ways.nu(time + step / 2) for time in begins])
    has_motor = any(isinstance(effect, Motor) for effect in acting.effects)
    voltage = voltages_of(bound, torque, bound.wheel_speeds(middle)) if has_motor else None
    return PathDrive(begins, torque, voltage, switches)


def _check(bound: Kernel, acting: EffectSet) -> None:
    if bound.slips:
        raise InvalidValueError("effects", list(acting.effects), "must have no Contact: on a path wheels roll")
    if np.linalg.matrix_rank(bound.wheel_rows) < 3:
        raise InvalidValueError("vehicle", bound.vehicle, "needs wheels that can drive it in every direction")
    names = ("roller_viscous", "roller_coulomb")
    found = [name for e in acting.effects if isinstance(e, Bearings) for name in names if np.any(getattr(e, name))]
    if found and bound.has_spins:
        bound_ = "must be 0 of free rollers, whose spins are not known beforehand; take roller_model='locked'"
        raise InvalidValueError(found[0], list(acting.effects), bound_)


class _Ways:
    """A path as nu and the wheels' angles over time.

    edges   (K + 1,) times that bound the samples
    turned  (K + 1, N) by which the wheels have turned since the start, as a spline
    """

    def __init__(self, bound: Kernel, path: Path, edges: np.ndarray):
        self.bound, self.path, self.edges = bound, path, edges
        times = nodes(edges)
        rates = bound.wheel_speeds(np.stack([self.nu(time) for time in times.ravel()])).reshape(*times.shape, -1)
        steps = np.einsum("kgn,g,k->kn", rates, WEIGHTS / 2, np.diff(edges))
        turned = np.concatenate([np.zeros((1, bound.wheels)), np.cumsum(steps, axis=0)])
        slopes = bound.wheel_speeds(np.stack([self.nu(time) for time in edges]))
        self.turned = [CubicHermiteSpline(edges, turned[:, i], slopes[:, i]) for i in range(bound.wheels)]

    def nu(self, time: float) -> np.ndarray:
        """(3,)"""
        pose, rate = self.path.at(time), self.path.at(time, 1)
        return nu_of_rates(self.bound, rate, pose[2])

    def motion(self, times: np.ndarray) -> dict[str, np.ndarray]:
        """nu, nu_dot, heading and the angles by which the wheels have turned at times (M,), by name."""
        nu = np.stack([self.nu(time) for time in times])
        heading = np.array([self.path.at(time)[2] for time in times])
        accelerations = (self.path.at(time, 2) for time in times)
        found = [nu_dot_of(self.bound, *one) for one in zip(accelerations, nu, heading, strict=True)]
        turned = np.stack([spline(times) for spline in self.turned], axis=1)
        return {"nu": nu, "nu_dot": np.stack(found), "heading": heading, "turned": turned}

    def share_before(self, time: float) -> float:
        """The part of its sample that is over at a time."""
        begin = np.clip(np.searchsorted(self.edges, time, side="right") - 1, 0, len(self.edges) - 2)
        return float((time - self.edges[begin]) / (self.edges[begin + 1] - self.edges[begin]))

    def joints(self, chi: np.ndarray) -> list[tuple[float, np.ndarray]]:
        """Times at which wheels that start at chi (N,) come to their joints, with the direction (N,) of each wheel."""
        joint, found = np.pi / self.bound.rollers_per_wheel, []
        for wheel, spline in enumerate(self.turned):
            rollers = (spline(self.edges) + chi[wheel]) / (2 * joint)
            for place in np.arange(np.floor(rollers.min()), np.ceil(rollers.max()) + 1) + 0.5:
                times = spline.solve(2 * joint * place - chi[wheel], extrapolate=False)
                found += [(float(t), wheel, int(np.sign(spline(t, 1)))) for t in times if np.isfinite(t)]
        joined: list[tuple[float, np.ndarray]] = []
        for time, wheel, direction in sorted(found):
            if not joined or time - joined[-1][0] > TOGETHER:
                joined.append((time, np.zeros(len(chi), int)))
            joined[-1][1][wheel] += direction
        return [(time, directions) for time, directions in joined if directions.any()]


def nodes(edges: np.ndarray) -> np.ndarray:
    """(K, 3) Gauss's nodes between times (K + 1,)."""
    return edges[:-1, None] + np.diff(edges)[:, None] * (NODES + 1) / 2


def _momenta(bound: Kernel, acting: EffectSet, ways: _Ways, chi: np.ndarray, law: str) -> tuple[np.ndarray, int]:
    """(K, 3) what the samples take, the force over their time and the momenta of switches; and how many switches."""
    joints, width = ways.joints(chi), 2 * np.pi / bound.rollers_per_wheel
    rolling, jumps = _switched(bound, ways, chi, joints, law)
    edges = np.unique(np.concatenate([ways.edges, [time for time, _ in joints]]))
    times = nodes(edges)
    phase = np.searchsorted([time for time, _ in joints], times[:, 1]).repeat(len(NODES))
    motion = ways.motion(times.ravel())
    passed = np.cumsum([np.zeros_like(chi), *(directions for _, directions in joints)], axis=0)
    motion["chi"] = motion.pop("turned") + chi - width * passed[phase]
    if bound.has_spins:
        motion["momenta"] = np.stack([bound.momenta(state.free_axial()) for state in rolling])[phase]
    force = force_of(bound, acting, motion).reshape(*times.shape, 3)
    taken = np.zeros((len(ways.edges) - 1, 3))
    own = np.searchsorted(ways.edges, times[:, 1]) - 1
    np.add.at(taken, own, np.einsum("kgc,g,k->kc", force, WEIGHTS / 2, np.diff(edges)))
    for (time, _), jump in zip(joints, jumps, strict=True):
        taken[np.clip(np.searchsorted(ways.edges, time, side="right") - 1, 0, len(taken) - 1)] += jump
    return taken, int(np.abs([directions for _, directions in joints]).sum()) if joints else 0


def _switched(
    bound: Kernel, ways: _Ways, chi: np.ndarray, joints: Sequence[tuple[float, np.ndarray]], law: str
) -> tuple[list[State], list[np.ndarray]]:
    """The states with which the phases begin, one more than switches; and the momentum (3,) of each switch."""
    model, width = SwitchingModel(bound, law), 2 * np.pi / bound.rollers_per_wheel
    axial = np.zeros((bound.wheels, bound.rollers_per_wheel)) if bound.has_spins else None
    states = [State(np.zeros(3), chi, np.zeros(3), np.zeros(bound.wheels, int), axial)]
    passed, momenta = np.zeros(bound.wheels), []
    for time, directions in joints:
        angles = np.array([spline(time) for spline in ways.turned]) + chi - width * passed
        angles = np.where(directions != 0, directions * model.joint, angles)
        before = replace(states[-1], nu=ways.nu(time), chi=angles)
        momentum, after = _brought_back(model, before, directions, ways.share_before(time))
        momenta.append(momentum)
        states.append(after)
        passed = passed + directions
    return states, momenta


def _brought_back(
    model: SwitchingModel, before: State, directions: np.ndarray, early: float
) -> tuple[np.ndarray, State]:
    """The momentum (3,) that leaves nu as it was before a switch, and the state then.

    early  the part of the momentum that is given before the switch: a sample's output is the same before and after it

    What is given early is lost in part in the switch itself; the next round makes up for it.
    """
    mass, nu = model.kernel.mass_matrix, before.nu
    momentum = np.zeros(3)
    for _ in range(ROUNDS):
        faster = replace(before, nu=nu + np.linalg.solve(mass(before.chi), early * momentum))
        after = model.apply(faster, directions)
        momentum = mass(after.chi) @ (nu - after.nu) + early * momentum
    return momentum, replace(after, nu=nu)
