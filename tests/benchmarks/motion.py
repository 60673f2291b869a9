"""Question 3: the paper's motion 3 over 1000 s and some 3353 switches, at equal achieved error."""

import math
import time
from functools import partial

import heyoka
import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq

import omniroll

from .common import Answer, Target, numeric_model, reduced_form
from .tools import Engine, Simulate, cheapest, error_at_end, figure, ladder

NU, DURATION = (1.0, 0.0, 1.0), 1000.0
GOALS = (1e-5, 1e-9)
LADDER = tuple(float(f"{10 ** (-k / 2):.0e}") for k in range(6, 31))
SCIPY_LADDER = (1e-8, 1e-13)
REPEATS = 5
TASK = {"nu": NU, "duration": DURATION, "roller_model": "locked", "switching": "smooth"}


# heyoka


class Heyoka:
    """A Taylor integrator; terminal events at the joints, whose callback passes the contact on."""

    def __init__(self, vehicle, tolerance, number=float, **options):
        self.number, n = number, vehicle.rollers_per_wheel
        pi = number(math.pi) if number is float else 4 * np.arctan(number(1))
        self.joint = pi / n
        names = ["nu0", "nu1", "nu2", *(f"chi{i}" for i in range(vehicle.wheels)), "x", "y", "theta"]
        symbols = heyoka.make_vars(*names)
        nu, chi, theta = symbols[:3], symbols[3:-3], symbols[-1]
        form = reduced_form("locked", heyoka.sin, heyoka.cos)
        model = self._model(vehicle, form)
        rates = [
            *form.forward_dynamics(model, nu, chi), *form.wheel_speeds(model, nu), *form.pose_rates(model, nu, theta)
        ]  # fmt: skip
        events = []
        for i in range(vehicle.wheels):
            for sign, direction in ((1, heyoka.event_direction.positive), (-1, heyoka.event_direction.negative)):
                equation = symbols[3 + i] - heyoka.expression(number(sign) * self.joint)
                events.append(
                    heyoka.t_event(
                        equation, direction=direction, callback=self._passing(3 + i, -sign * self.joint), fp_type=number
                    )
                )
        self.start = np.array([*NU, *[0] * vehicle.wheels, 0, 0, 0], dtype=number)
        self.integrator = heyoka.taylor_adaptive(
            list(zip(symbols, rates, strict=True)), self.start.copy(), t_events=events, tol=number(tolerance),
            fp_type=number, **options,
        )  # fmt: skip

    def _model(self, vehicle, form):
        if self.number is float:
            return numeric_model(vehicle, "locked")
        scalars = {name: self.number(getattr(vehicle, name)) for name in omniroll.kernels.kernel.VEHICLE_SCALARS}
        angles = [self.number(angle) for angle in vehicle.wheel_angles]
        plain = reduced_form("locked", np.sin, np.cos)
        return plain.prepare(vehicle.wheels, vehicle.rollers_per_wheel, wheel_angles=angles, **scalars)

    def _passing(self, place, angle):
        def callback(integrator, direction):
            integrator.state[place] = angle
            self.switches += 1
            return True

        return callback

    def __call__(self):
        self.switches = 0
        self.integrator.state[:] = self.start
        self.integrator.time = self.number(0)
        self.integrator.reset_cooldowns()
        self.integrator.propagate_until(self.number(DURATION))
        self.end = self.integrator.state[:3].copy(), self.integrator.state[-3:].copy()


# SciPy


def numpy_flow(vehicle):
    """The reduced form in NumPy: the wheels are an axis."""
    model = numeric_model(vehicle, "locked")
    cos_alpha, sin_alpha = np.array(model.cos_alpha), np.array(model.sin_alpha)
    R, l, B, inverse = model.R, model.l, model.B, model.inverse_yaw_scale  # noqa: E741
    r = vehicle.roller_axis_radius
    constant = np.array(
        [
            [model.m0_11, model.m0_12, model.m0_13],
            [model.m0_12, model.m0_22, model.m0_23],
            [model.m0_13, model.m0_23, model.m0_33],
        ]
    )

    def flow(_, y):
        nu, chi, theta = y[:3], y[3:-3], y[-1]
        sine, cosine, yaw_rate = np.sin(chi), np.cos(chi), inverse * nu[2]
        rho = l * cosine - r
        roll = R / l * (nu[0] * sin_alpha - nu[1] * cos_alpha)
        chi_dot = roll - R / l * yaw_rate
        rolling = R * (nu[0] * cos_alpha + nu[1] * sin_alpha) / rho
        rows = np.stack([R / rho * cos_alpha, R / rho * sin_alpha])
        stretch = l * sine * chi_dot / rho * rolling
        couple = B * cosine * rolling
        mass = constant.copy()
        mass[:2, :2] += B * rows @ rows.T
        cross = B * inverse * rows @ sine
        mass[2, :2] += cross
        mass[:2, 2] += cross
        force = np.empty(3)
        force[:2] = -B * rows @ (stretch + yaw_rate * cosine * chi_dot)
        force[0] += model.coriolis * nu[2] * nu[1] + R / l * yaw_rate * (sin_alpha @ couple)
        force[1] -= model.coriolis * nu[2] * nu[0] + R / l * yaw_rate * (cos_alpha @ couple)
        force[2] = -inverse * (B * sine @ stretch + roll @ couple)
        nu_dot = np.linalg.solve(mass, force)
        c, s = math.cos(theta), math.sin(theta)
        pose = [R * (nu[0] * c - nu[1] * s), R * (nu[0] * s + nu[1] * c), yaw_rate]
        return np.concatenate([nu_dot, chi_dot, pose])

    return flow


class Scipy:
    """DOP853; a step that passes a joint gives the switch's time by its interpolant and is taken again up to there."""

    def __init__(self, vehicle, tolerance):
        self.tolerance, self.joint, self.flow = tolerance, math.pi / vehicle.rollers_per_wheel, numpy_flow(vehicle)
        self.wheels = slice(3, 3 + vehicle.wheels)

    def _stepper(self, t, y, bound, first):
        first = None if first is None else min(first, bound - t)
        return DOP853(self.flow, t, y, bound, rtol=self.tolerance, atol=0.01 * self.tolerance, first_step=first)

    def _joint_time(self, stepper):
        """(t, wheel) of the first joint that the step passed, or None."""
        inside, found = stepper.dense_output(), None
        for i in range(*self.wheels.indices(len(stepper.y))):
            if abs(stepper.y[i]) > self.joint:
                bound = math.copysign(self.joint, stepper.y[i])
                if (inside(stepper.t_old)[i] - bound) * (stepper.y[i] - bound) >= 0:
                    continue
                time = brentq(lambda t, i=i, bound=bound: inside(t)[i] - bound, stepper.t_old, stepper.t, xtol=1e-15)
                if found is None or time < found[0]:
                    found = time, i
        return found

    def __call__(self):
        start = time.thread_time()
        t, y = 0.0, np.array([*NU, 0, 0, 0, 0, 0, 0], float)
        self.switches, self.evaluations, first = 0, 0, None
        while t < DURATION:
            stepper, found = self._stepper(t, y, DURATION, first), None
            while stepper.status == "running" and found is None:
                before = stepper.y
                stepper.step()
                found = self._joint_time(stepper)
            self.evaluations += stepper.nfev
            if found is None:
                t, y = stepper.t, stepper.y
                break
            last, first = stepper.t_old, stepper.step_size
            if found[0] > last:
                stepper = self._stepper(last, before, found[0], found[0] - last)
                while stepper.status == "running":
                    stepper.step()
                self.evaluations += stepper.nfev
            t, y = found[0], stepper.y.copy()
            y[found[1]] = -math.copysign(self.joint, y[found[1]])
            self.switches += 1
        self.end = y[:3], y[-3:]
        return time.thread_time() - start


def references(vehicle):
    """(reference end state, its distance from this project's finest run, switches)."""
    fine = Heyoka(vehicle, 1e-18, np.longdouble)
    fine()
    own = Engine(vehicle, 1e-15, **TASK)
    own()
    reference = [np.asarray(part, float) for part in fine.end]
    return reference, error_at_end(vehicle, own.end, reference, np.linalg.norm(NU)), own.switches


def measure():
    vehicle = omniroll.Vehicle.paper()
    reference, confirmed, switches = references(vehicle)
    tools = {
        "omniroll, the C engine alone": (partial(Engine, **TASK), LADDER, REPEATS),
        "omniroll, simulate(control=False)": (partial(Simulate, control=False, **TASK), LADDER, 3),
        "omniroll, simulate()": (partial(Simulate, **TASK), (1e-5, 1e-7, 1e-9), 3),
        "heyoka": (Heyoka, LADDER, 3),
        "SciPy DOP853": (Scipy, SCIPY_LADDER, 1),
    }

    def error(end):
        return error_at_end(vehicle, end, reference, np.linalg.norm(NU))

    found = {tool: ladder(partial(make, vehicle), tols, n, error) for tool, (make, tols, n) in tools.items()}
    return found, confirmed, switches


def answer() -> Answer:
    found, confirmed, switches = measure()
    rows = []
    for tool, entries in found.items():
        cells = []
        for goal in GOALS:
            best = cheapest(entries, goal)
            cells += (
                ["-", "not reached"] if best is None else [best[1].in_unit(1e3), f"{best[2]:.0e} (tol {best[0]:.0e})"]
            )
        rows.append([tool, *cells])
    targets = []
    for peer, wanted in (("heyoka", 10), ("SciPy DOP853", 1000)):
        for goal in GOALS:
            own, other = cheapest(found["omniroll, the C engine alone"], goal), cheapest(found[peer], goal)
            value = other[1].least / own[1].least if own and other else math.nan
            claim = f"motion 3, error <= {goal:g}: >= {wanted}x faster than {peer}"
            measured = "the peer does not get there" if math.isnan(value) else f"{value:.1f}x"
            targets.append(Target(claim, measured, value >= wanted))
    targets += _of_simulate(found)
    curves = {
        tool: [(1e3 * times.least, max(error, 1e-16)) for _, times, error in entries] for tool, entries in found.items()
    }
    figure("benchmark-motion-3.png", curves, xlabel="ms for 1000 s of motion", ylabel="error of the end state")
    return Answer(
        title="3. Motion 3 over 1000 s",
        text=(
            f"Locked rollers, smooth switches, nu = (1, 0, 1), {switches} switches. ms for the whole "
            "motion, minimum (median), of the fastest setting of each tool's ladder of tolerances whose "
            "error of the end state, in the norm of `accuracy`, is below the goal. heyoka: terminal "
            "events at +-pi/n, Python callbacks that only move an angle. SciPy: a NumPy kernel, the "
            "switch by the interpolant and a step onto it; one run a setting. Building the integrators is "
            "not counted. The C engine writes its rows and dense output; `simulate()` makes a Trajectory "
            "of them."
        ),
        headings=["tool", "ms to 1e-5", "error", "ms to 1e-9", "error"],
        rows=rows,
        targets=targets,
        closing=(
            "Reference: heyoka in long double at tolerance 1e-18. "
            f"This project's run at 1e-15 is {confirmed:.1e} from it."
        ),
        figures=["benchmark-motion-3.png"],
    )


def _of_simulate(found):
    """Targets of simulate(): without its estimate against the engine alone, with it against heyoka."""
    goal = GOALS[-1]
    alone, plain, checked, peer = (
        cheapest(found[tool], goal)
        for tool in (
            "omniroll, the C engine alone",
            "omniroll, simulate(control=False)",
            "omniroll, simulate()",
            "heyoka",
        )
    )
    over, faster = plain[1].least / alone[1].least, peer[1].least / checked[1].least
    return [
        Target("simulate(control=False) <= 1.5x the engine alone, to 1e-9", f"{over:.2f}x", over <= 1.5),
        Target("simulate() with its error estimate >= 3x faster than heyoka, to 1e-9", f"{faster:.1f}x", faster >= 3),
    ]
