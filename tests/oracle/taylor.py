"""Reference motions: Taylor series of the full-coordinate equations, switches located to the working
precision.

Order k of the accelerations follows from orders below it: the matrix K(t) and the right side of
`lagrange.System` are series, and K(0) z_k = right_k - sum_{j >= 1} K_j z_{k-j}. Steps follow the decay of
the coefficients.
"""

from dataclasses import dataclass, field
from itertools import pairwise

from flint import arb, arb_mat, arb_series

from .balls import coefficient, exact, sharp, working_precision
from .lagrange import Speeds, System, kinetic_energy, speeds
from .switch import after_switch, nu_of

PROBES = 12  # places within a step where a wheel is looked at for having left its roller


@dataclass
class State:
    """t, pose (x, y, theta), chi (N), q' as Speeds; contact[i] is the physical number of the contact
    roller.
    """

    t: object
    pose: list
    chi: list
    dq: Speeds
    contact: list

    @property
    def theta(self):
        return self.pose[2]


@dataclass
class Switch:
    """One switch, of all wheels in moves {wheel: direction} together, with the states on both sides."""

    t: object
    moves: dict
    before: State
    after: State
    energy_before: object
    energy_after: object


@dataclass
class Motion:
    """The end state, the switches, the smallest gap between two of them, states at the times asked for."""

    end: State
    switches: list = field(default_factory=list)
    samples: list = field(default_factory=list)
    steps: int = 0

    def smallest_gap(self):
        times = [0.0, *(float(s.t) for s in self.switches), float(self.end.t)]
        return min(b - a for a, b in pairwise(times))


class Series:
    """Taylor coefficients of x', y', theta', chi'_i, phi'_ij and of x, y, theta, chi_i about a state."""

    def __init__(self, vehicle, state, model, order, forces=None):
        self.vehicle, self.model, self.forces = vehicle, model, forces
        dq = state.dq
        self.place = [[p] for p in (*state.pose, *state.chi)]
        self.rate = [[v] for v in dq.flat()]
        self.integrate_places(0)
        self.solved, self.inverse = [], None
        for k in range(order):
            self.extend(k)

    def integrate_places(self, k):
        for place, rate in zip(self.place, self.rate, strict=False):  # the rollers' angles are of no use
            place.append(rate[k] / (k + 1))

    def speeds(self, length):
        return Speeds.unflat(self.vehicle, [arb_series(c[:length], length) for c in self.rate])

    def extend(self, k):
        """Coefficient k of the accelerations, hence k + 1 of the speeds and k + 2 of the places."""
        now = [arb_series(c[: k + 1], k + 1) for c in self.place]
        ahead = [arb_series(c[: k + 2], k + 2) for c in self.place]
        dq = self.speeds(k + 1)
        applied = self.forces(now[2], dq) if self.forces else None
        system = System(self.vehicle, now[2], now[3:], dq, ahead[2], ahead[3:], self.model, applied)
        keys = system.keys()
        if self.inverse is None:
            self.inverse = system.matrix(keys).inv().mid()
        right = arb_mat([[self.known(system, key, k)] for key in keys])
        answer = self.inverse * right
        self.solved.append({key: sharp(answer[m, 0]) for m, key in enumerate(keys)})
        for m, value in enumerate(self.acceleration(system, k)):
            self.rate[m].append(sharp(value) / (k + 1))
        self.integrate_places(k + 1)

    def known(self, system, key, k):
        total = coefficient(system.right.get(key, arb(0)), k)
        for column, value in system.rows[key].items():
            if isinstance(value, arb_series):
                for j in range(1, min(k, value.length() - 1) + 1):
                    total -= value[j] * self.solved[k - j][column]
        return total

    def acceleration(self, system, k):
        newest = self.solved[k]
        values = [newest[key] for key in ("x", "y", "theta", *(("chi", i) for i in system.wheels))]
        yaw = arb_series([z["theta"] for z in self.solved], k + 1)
        for i in system.wheels:
            values.append(newest.get(("phi", i), arb(0)))
            for j in range(1, self.vehicle.rollers_per_wheel):
                values.append(coefficient(system.free_acceleration(i, j, yaw), k))
        return values

    def step(self, tolerance):
        """Step over which the last two coefficients stay below the tolerance, relative to the largest
        first ones.
        """
        scale = max(abs(float(c[0])) for c in self.rate) or 1.0
        best = 1e9
        for c in self.rate:
            for m in (-1, -2):
                size, order = abs(c[m]), len(c) + m
                if float(size) > 0 or not size.is_zero():
                    best = min(best, float(((tolerance * scale / size).log() / order).exp()))
        return exact(0.9 * best)

    def state(self, t0, h, contact):
        at = lambda c: sharp(horner(c, h))  # noqa: E731
        place = [at(c) for c in self.place]
        dq = Speeds.unflat(self.vehicle, [at(c) for c in self.rate])
        return State(sharp(t0 + h), place[:3], place[3:], dq, list(contact))


def horner(coefficients, h):
    total = arb(0)
    for c in reversed(coefficients):
        total = total * h + c
    return total


def crossing(series, i, h, joint):
    """First time in (0, h] when wheel i leaves its roller, and the direction; None if it does not."""
    place, rate = series.place[3 + i], series.rate[3 + i]
    early = arb(0)
    for probe in range(1, PROBES + 1):
        late = h * probe / PROBES
        if abs(horner(place, late)) > joint:
            break
        early = late
    else:
        return None
    direction = 1 if horner(place, late) > 0 else -1
    for _ in range(12):  # bisection until Newton is safe
        middle = (early + late) / 2
        early, late = (early, middle) if direction * horner(place, middle) > joint else (middle, late)
    t = (early + late) / 2
    for _ in range(8):
        t = sharp(t - (horner(place, t) - direction * joint) / horner(rate, t))
    return t, direction


@working_precision
def start(vehicle, *, nu, chi, spins=None, pose=(0, 0, 0), model):
    """State at t = 0; floats are taken exactly."""
    pose, chi = [exact(p) for p in pose], [exact(c) for c in chi]
    dq = speeds(vehicle, nu, chi, spins, model=model, theta=pose[2])
    return State(arb(0), pose, chi, dq.map(sharp), [0] * vehicle.wheels)


@working_precision
def simulate(vehicle, state, duration, *, model, law, digits=30, order=40, times=(), together="1e-20", forces=None):
    """Motion from `state` over `duration`, every step to `digits` digits. times: when to keep a sample.

    forces(theta, dq) gives the generalised forces as a Speeds, from series for theta and q'.
    Wheels that reach their joints within `together` of each other switch together. A wheel that after a
    switch moves back over the joint that it came from is refused (RuntimeError): the law is silent there.
    """
    tolerance, joint = arb(10) ** -digits, arb.pi() / vehicle.rollers_per_wheel
    end, together = exact(duration), arb(together)
    motion, wanted = Motion(state), sorted(exact(t) for t in times)
    while state.t < end:
        series = Series(vehicle, state, model, order, forces)
        h = series.step(tolerance)
        h = end - state.t if state.t + h > end else h
        found = {i: crossing(series, i, h, joint) for i in range(vehicle.wheels)}
        found = {i: c for i, c in found.items() if c}
        if found:
            h = min((t for t, _ in found.values()), key=float)
        while wanted and state.t + h >= wanted[0]:
            motion.samples.append(series.state(state.t, wanted.pop(0) - state.t, state.contact))
        state = series.state(state.t, h, state.contact)
        motion.steps += 1
        moves = {i: d for i, (t, d) in found.items() if abs(t - h) < together}
        if moves:
            motion.switches.append(switch_now(vehicle, state, moves, model, law))
            state = motion.switches[-1].after
    motion.end = state
    return motion


def switch_now(vehicle, before, moves, model, law):
    chi, dq = after_switch(vehicle, before.theta, before.chi, before.dq, moves, model=model, law=law)
    contact = [(c - moves.get(i, 0)) % vehicle.rollers_per_wheel for i, c in enumerate(before.contact)]
    after = State(before.t, list(before.pose), [sharp(c) for c in chi], dq.map(sharp), contact)
    for i, direction in moves.items():
        after.chi[i] = sharp(-direction * arb.pi() / vehicle.rollers_per_wheel)
        if not direction * after.dq.chi[i] > 0:
            raise RuntimeError(f"wheel {i} turns back at the joint at t = {float(before.t)}")
    energy = [kinetic_energy(vehicle, s.theta, s.chi, s.dq, model=model) for s in (before, after)]
    return Switch(before.t, moves, before, after, *energy)


@working_precision
def nu(vehicle, state):
    """(nu_1, nu_2, nu_3) of a State."""
    return nu_of(vehicle, state.theta, state.dq)


@working_precision
def energy(vehicle, state, *, model):
    return kinetic_energy(vehicle, state.theta, state.chi, state.dq, model=model)
