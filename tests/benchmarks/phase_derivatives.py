"""Question 12: twelve derivatives of the motion between two switches, beside those of tools that know no switch."""

import casadi
import heyoka
import numpy as np

import omniroll
from omniroll.kernels.kernel import VEHICLE_SCALARS

from .common import Answer, reduced_form, repeated
from .derivatives import NAMES, NUMBERS, START

DURATION, REPEATS = 0.375, 30  # s, to just before the first switch; runs of each
STATE = ("nu[0]", "nu[1]", "nu[2]", "chi[0]", "chi[1]", "chi[2]", "pose[0]", "pose[1]", "pose[2]")
ACCURACIES = (1e-9, 1e-11)  # of omniroll
TOLERANCES = (1e-9, 1e-12, 1e-15)  # of heyoka
INTEGRATION = (1e-8, 1e-10, 1e-12)  # CasADi's tolerances
VEHICLE = omniroll.Vehicle.paper()


def start(number=float):
    return np.array([*START["nu"], *START["chi"], 0, 0, 0], dtype=number)


def rates(symbols, sin, cos, numbers):
    """The rates of STATE by the generated equations, the vehicle's NUMBERS as symbols of another algebra."""
    of = lambda plain, symbolic: lambda x: plain(x) if isinstance(x, float) else symbolic(x)  # noqa: E731
    form = reduced_form("locked", of(np.sin, sin), of(np.cos, cos))
    form.circle_ratio = lambda like: np.pi
    given = {name: getattr(VEHICLE, name) for name in VEHICLE_SCALARS} | dict(zip(NUMBERS, numbers, strict=True))
    model = form.prepare(VEHICLE.wheels, VEHICLE.rollers_per_wheel, wheel_angles=list(VEHICLE.wheel_angles), **given)
    nu, chi, theta = symbols[:3], symbols[3:6], symbols[8]
    return [*form.forward_dynamics(model, nu, chi), *form.wheel_speeds(model, nu), *form.pose_rates(model, nu, theta)]


class Heyoka:
    """The variational equations by the same start values and numbers, integrated by Taylor series."""

    def __init__(self, tolerance, number=float):
        names = [name.replace("[", "_").rstrip("]") for name in STATE]
        symbols = heyoka.make_vars(*names)
        parameters = [heyoka.par[k] for k in range(len(NUMBERS))]
        system = list(zip(symbols, rates(symbols, heyoka.sin, heyoka.cos, parameters), strict=True))
        by = [*(symbols[STATE.index(name)] for name in NAMES if name in STATE), *parameters]
        self.number = number
        self.integrator = heyoka.taylor_adaptive(
            heyoka.var_ode_sys(system, by, 1), start(number), tol=number(tolerance), fp_type=number, compact_mode=True,
            pars=[number(getattr(VEHICLE, name)) for name in NUMBERS],
        )  # fmt: skip
        self.start = self.integrator.state.copy()

    def __call__(self) -> np.ndarray:
        self.integrator.state[:] = self.start
        self.integrator.time = self.number(0)
        self.integrator.propagate_until(self.number(DURATION))
        return self.integrator.state[len(STATE) :].reshape(len(STATE), len(NAMES)).copy()


class CasADi:
    """Forward sensitivities of CasADi's integrator CVODES, along the twelve directions at once."""

    def __init__(self, tolerance):
        state, numbers = casadi.SX.sym("x", len(STATE)), casadi.SX.sym("p", len(NUMBERS))
        symbols = casadi.vertsplit(state)
        found = rates(symbols, casadi.sin, casadi.cos, casadi.vertsplit(numbers))
        options = {"reltol": tolerance, "abstol": tolerance, "max_num_steps": 100_000}
        problem = {"x": state, "p": numbers, "ode": casadi.vertcat(*found)}
        integrator = casadi.integrator("phase", "cvodes", problem, 0, DURATION, options)
        self.integrator, self.slopes = integrator, integrator.forward(len(NAMES))
        self.by_state, self.by_numbers = np.zeros((len(STATE), len(NAMES))), np.zeros((len(NUMBERS), len(NAMES)))
        for column, name in enumerate(NAMES):
            place = (self.by_state, STATE) if name in STATE else (self.by_numbers, NUMBERS)
            place[0][place[1].index(name), column] = 1
        self.numbers = [getattr(VEHICLE, name) for name in NUMBERS]

    def __call__(self) -> np.ndarray:
        end = self.integrator(x0=start(), p=self.numbers)
        found = self.slopes(
            x0=start(), p=self.numbers, out_xf=end["xf"], fwd_x0=self.by_state, fwd_p=self.by_numbers
        )  # fmt: skip
        return np.array(found["fwd_xf"])


def own(accuracy) -> np.ndarray:
    begun = start()
    run = omniroll.simulate(
        VEHICLE, nu=begun[:3], chi=begun[3:6], pose=begun[6:], duration=DURATION, roller_model="locked",
        accuracy=accuracy, sensitivities=NAMES,
    )  # fmt: skip
    assert len(run.switches) == 0
    ends = (run.sensitivity(name) for name in NAMES)
    return np.array([np.concatenate([end.nu[-1], end.chi[-1], end.pose[-1]]) for end in ends]).T


def runs() -> dict:
    """Each tool's settings, as [(the setting in words, what gives the derivatives)]."""
    return {
        "omniroll, simulate(sensitivities=...)": [(f"accuracy {a:.0e}", lambda a=a: own(a)) for a in ACCURACIES],
        "heyoka, variational equations": [(f"tol {t:.0e}", Heyoka(t)) for t in TOLERANCES],
        "CasADi, forward sensitivities of CVODES": [(f"tol {t:.0e}", CasADi(t)) for t in INTEGRATION],
    }


def error_of(found, reference) -> float:
    """The largest error of a column over the column's largest component."""
    return float((np.abs(found - reference).max(axis=0) / np.abs(reference).max(axis=0)).max())


def answer() -> Answer:
    reference = Heyoka(1e-18, np.longdouble)().astype(float)
    rows = []
    for tool, settings in runs().items():
        for setting, derivatives in settings:
            error = error_of(derivatives(), reference)
            times = repeated(lambda derivatives=derivatives: derivatives() is None or None, REPEATS)
            rows.append([tool, setting, times.in_unit(1e3), f"{error:.0e}"])
    return Answer(
        title="12. Twelve derivatives between two switches",
        text=(
            f"The paper's vehicle with locked rollers over {DURATION:g} s, up to just before its first switch: the "
            f"derivatives of the end state by {', '.join(NAMES)}. ms of all twelve with the motion itself, minimum "
            "(median), after the set-up: heyoka compiles its series and CasADi builds its integrator beforehand. "
            "Both have the generated equations, with the vehicle's numbers as parameters. The error is the "
            "largest of a column over the column's largest component, against heyoka in long double at tolerance 1e-18."
        ),
        headings=["tool", "setting", "ms", "error"],
        rows=rows,
    )
