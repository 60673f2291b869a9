"""heyoka's Taylor integrator beside the others, where it is installed: terminal events at the joints."""

import importlib
import importlib.util
from collections.abc import Callable
from functools import lru_cache
from types import FunctionType, SimpleNamespace

import numpy as np

from omniroll import generated
from omniroll.engine.runs import Task
from omniroll.kernels.kernel import Kernel, kernel
from omniroll.studies.accuracy.peers import Outcome, Peer, ScipyRun

TOLERANCES = tuple(10.0**-k for k in range(3, 14, 2))


def heyoka_peer() -> tuple[Peer, ...]:
    """The peer, in a tuple that is empty where heyoka is not installed."""
    return (
        (Peer("heyoka", _run, TOLERANCES, prepare=_prepare, with_effects=False),)
        if importlib.util.find_spec("heyoka")
        else ()
    )


def _run(task: Task, times: np.ndarray, tolerance: float) -> Outcome:
    return HeyokaRun(task, times, "Taylor", tolerance).outcome()


def _prepare(task: Task, tolerance: float) -> None:
    _integrator(task.kernel, tolerance)


class HeyokaRun(ScipyRun):
    """Phases by heyoka; the rest, the switching model among it, as for SciPy."""

    def _phase(self, now: float, until: float) -> SimpleNamespace:
        integrator = _integrator(self.bound, self.tolerance)
        axial = self.state.free_axial()
        if axial is not None:
            integrator.pars[:] = self.bound.momenta(axial).ravel()
        integrator.time = now
        integrator.state[:] = np.concatenate([self.state.nu, self.state.chi, self.state.pose])
        integrator.reset_cooldowns()
        rows: dict[float, np.ndarray] = {}
        at_joint = False
        while integrator.time < until and not at_joint:
            outcome, _ = integrator.step(max_delta_t=until - integrator.time, write_tc=True)
            at_joint = -len(integrator.t_events) <= int(outcome) < 0  # event k ends the step with -k - 1
            if not at_joint and outcome not in self.going_on:
                raise ArithmeticError(f"heyoka stopped: {outcome}")
            self.evaluations += integrator.order + 1  # one for each Taylor coefficient
            for time in self.times[(self.times >= now) & (self.times < integrator.time)]:
                rows.setdefault(time, integrator.update_d_output(time).copy())
            now = integrator.time
        return SimpleNamespace(
            t=[integrator.time], y=integrator.state.copy()[:, None], status=int(at_joint), sol=rows.__getitem__
        )

    @property
    def going_on(self) -> tuple:
        import heyoka

        return heyoka.taylor_outcome.success, heyoka.taylor_outcome.time_limit


@lru_cache(maxsize=32)
def _integrator(bound: Kernel, tolerance: float):
    """The compiled integrator, made once for a vehicle, a roller model and a tolerance."""
    import heyoka

    own = kernel(bound.vehicle, bound.roller_model, "python")
    form, wheels = _in_heyoka(own.set_name, heyoka.sin, heyoka.cos), own.wheels
    dynamics = getattr(form, own.form("forward_dynamics"))
    symbols = heyoka.make_vars("nu_1", "nu_2", "nu_3", *(f"chi_{i}" for i in range(wheels)), "x", "y", "theta")
    nu, chi, theta = symbols[:3], symbols[3:-3], symbols[-1]
    momenta = [[heyoka.par[2 * i], heyoka.par[2 * i + 1]] for i in range(wheels)]
    third = (momenta,) if own.has_spins else ()
    rates = [
        *dynamics(own._model, nu, chi, *third), *form.wheel_speeds(own._model, nu),
        *form.pose_rates(own._model, nu, theta),
    ]  # fmt: skip
    joint = np.pi / own.rollers_per_wheel
    outward = ((1, heyoka.event_direction.positive), (-1, heyoka.event_direction.negative))
    events = [heyoka.t_event(angle - sign * joint, direction=direction) for angle in chi for sign, direction in outward]
    equations = list(zip(symbols, rates, strict=True))
    return heyoka.taylor_adaptive(equations, [0.0] * len(symbols), t_events=events, tol=tolerance)


def _in_heyoka(set_name: str, sin: Callable, cos: Callable) -> SimpleNamespace:
    """The functions of a generated Python kernel with another algebra's sine and cosine.

    A set's module has its functions from several files, each of which knows the sine by itself.
    """
    module = importlib.import_module(f"{generated.__name__}.python.{set_name}")
    own = {name: thing for name, thing in vars(module).items() if isinstance(thing, FunctionType)}
    return SimpleNamespace(
        **{name: FunctionType(f.__code__, f.__globals__ | {"sin": sin, "cos": cos}) for name, f in own.items()}
    )
