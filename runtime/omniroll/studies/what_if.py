"""Motions by changed equations: a bare vehicle, integrated by SciPy with the kernel that codegen.what_if writes.

Slow, general and small. The matrix, the right side, the equation of a free roller and the impulse of a switch are
evaluated as they were derived, with every free roller's spin as an unknown of its own; nothing is assumed about the
form of what was changed. The rules of a switch are those of engine/switching.py.
"""

import importlib.util
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp

from omniroll.engine.switching import outward
from omniroll.errors import InvalidValueError, SimulationStopped
from omniroll.generated_data import code_names
from omniroll.scenes.loading import Scene
from omniroll.vehicles.checks import joint_angle
from omniroll.vehicles.vehicle import Vehicle

RTOL, ATOL = 1e-10, 1e-12
TOGETHER = 1e-9  # of pi/n: wheels that are so close to their joints switch together
MOST_SWITCHES = 100_000
ROWS = 600  # of a motion, at equal times, beside those of the switches


@dataclass(frozen=True)
class Motion:
    """Rows of a motion: t (K,) s, nu (K, 3) 1/s, pose (K, 3) m, m, rad, energy (K,) J; times of switches (S,) s."""

    t: np.ndarray
    nu: np.ndarray
    pose: np.ndarray
    energy: np.ndarray
    switches: np.ndarray


def loaded(path: Path) -> ModuleType:
    """The kernel of a file that codegen.what_if wrote."""
    spec = importlib.util.spec_from_file_location(f"what_if_{path.stem}", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@dataclass
class ChangedVehicle:
    """A vehicle whose equations are those of a kernel.

    kernel        the module, from `loaded`
    vehicle       the paper's layout: wheels at distance R, each on the ray of its axle
    roller_model  "massless", "locked" or "free"
    law           "smooth" or "impact"
    numbers       of the symbols that the vehicle does not have, by name

    InvalidValueError where a number is missing or the vehicle is not of the paper's layout.
    """

    kernel: ModuleType
    vehicle: Vehicle
    roller_model: str = "locked"
    law: str = "impact"
    numbers: Mapping[str, float] | None = None

    def __post_init__(self) -> None:
        if self.vehicle.wheel_places is not None or any(self.vehicle.center_of_mass):
            raise InvalidValueError("vehicle", self.vehicle, "must be of the paper's layout")
        known = {s: getattr(self.vehicle, code, None) for s, code in code_names().items() if code.isidentifier()}
        self.values = {s: float(v) for s, v in known.items() if isinstance(v, int | float)} | dict(self.numbers or {})
        if self.roller_model == "massless":
            self.values["B"] = 0.0
        missing = [name for name in self.kernel.NUMBERS if name not in self.values]
        if missing:
            raise InvalidValueError("numbers", self.numbers, f"the equations also need {', '.join(missing)}")
        self.n, self.wheels = self.vehicle.rollers_per_wheel, self.vehicle.wheels
        self.joint = joint_angle(self.n)
        self.alpha = np.asarray(self.vehicle.wheel_angles, float)
        self.kappa = 2 * np.pi * np.arange(1, self.n)[None, :] / self.n

    @cached_property
    def is_free(self) -> bool:
        return self.roller_model == "free"

    def at(self, y: np.ndarray, **more: object) -> SimpleNamespace:
        """What the kernel reads at a state y: nu, chi, pose and the spins of the free rollers."""
        N = self.wheels
        pose, spins = y[3 + N : 6 + N], y[6 + N :].reshape(N, self.n - 1)
        at = SimpleNamespace(**self.values, alpha=self.alpha, kappa=self.kappa, chi=y[3 : 3 + N], nu_s=spins,
                             nu_1=y[0], nu_2=y[1], nu_3=y[2], x=pose[0], y=pose[1], theta=pose[2])  # fmt: skip
        at.rho = self.kernel.rho(at)
        vars(at).update(more)
        return at

    def columns(self, at: SimpleNamespace) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """M* (3, 3), its columns of the free rollers (3, N(n-1)) and their own entries (N(n-1),)."""
        k, shape = self.kernel, at.nu_s.shape
        m = np.array([[k.m_11(at), k.m_12(at), k.m_13(at)], [k.m_12(at), k.m_22(at), k.m_23(at)],
                      [k.m_13(at), k.m_23(at), k.m_33(at)]], float)  # fmt: skip
        rows = [np.broadcast_to(f(at), shape).ravel() for f in (k.m_1s, k.m_2s, k.m_3s, k.m_ss)]
        return m, np.array(rows[:3], float), np.array(rows[3], float)

    def accelerations(self, at: SimpleNamespace) -> tuple[np.ndarray, np.ndarray]:
        """nu' (3,) and nu_s' (N, n-1). The equation of a free roller is linear in nu'."""
        k, shape = self.kernel, at.nu_s.shape
        m, columns, _ = self.columns(at)
        f = np.array([k.f_1(at), k.f_2(at), k.f_3(at)], float)
        if not self.is_free:
            return np.linalg.solve(m, f), np.zeros(shape)
        units = np.vstack([np.zeros(3), np.eye(3)])
        asked = []
        for unit in units:
            at.nu_dot_1, at.nu_dot_2, at.nu_dot_3 = unit
            asked.append(np.broadcast_to(k.nu_dot_s(at), shape).ravel())
        still, by_nu_dot = asked[0], np.array(asked[1:]).T - asked[0][:, None]
        nu_dot = np.linalg.solve(m + columns @ by_nu_dot, f - columns @ still)
        return nu_dot, (still + by_nu_dot @ nu_dot).reshape(shape)

    def rates(self, t: float, y: np.ndarray) -> np.ndarray:
        at, k = self.at(y), self.kernel
        nu_dot, spin_dot = self.accelerations(at)
        pose = [k.x_rate(at), k.y_rate(at), k.theta_rate(at)]
        return np.concatenate([nu_dot, self.wheel_rates(at), pose, spin_dot.ravel()])

    def wheel_rates(self, at: SimpleNamespace) -> np.ndarray:
        return np.broadcast_to(self.kernel.wheel_rate(at), (self.wheels,))

    def contact_spins(self, at: SimpleNamespace) -> np.ndarray:
        return np.broadcast_to(self.kernel.contact_spin(at), (self.wheels,))

    def energy(self, y: np.ndarray) -> float:
        """nu . dL*/dnu - L*: with a potential it is in it."""
        at, k = self.at(y), self.kernel
        m, columns, own = self.columns(at)
        nu, spins = y[:3], at.nu_s.ravel()
        at.x_dot, at.y_dot, at.theta_dot = k.x_rate(at), k.y_rate(at), k.theta_rate(at)
        at.chi_dot, at.phi_dot, at.phi_s_dot = self.wheel_rates(at), self.contact_spins(at), at.nu_s
        twice_quadratic = nu @ m @ nu + 2 * nu @ columns @ spins + own @ spins**2
        return float(twice_quadratic - k.twice_lagrangian(at) / 2)

    def switched(self, y: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """The state after the wheels with directions +1 or -1 have switched together."""
        N, before = self.wheels, self.at(y)
        after, spins = y.copy(), before.nu_s.copy()
        contact, moving = self.contact_spins(before), directions != 0
        after[3 : 3 + N] = np.where(moving, -directions * self.joint, y[3 : 3 + N])
        entering = np.zeros(N)
        for i in np.flatnonzero(moving):
            ring = np.roll(np.concatenate([[contact[i]], spins[i]]), directions[i])
            entering[i], spins[i] = (ring[0], ring[1:]) if self.is_free else (0.0, 0.0)
        after[6 + N :] = spins.ravel()
        if self.law == "smooth":
            return after
        at = self.at(after)
        demanded = self.contact_spins(at)
        at.entering = np.where(moving, entering - demanded, 0.0)
        at.leaving = np.where(moving & (not self.is_free), contact, 0.0)
        m, columns, own = self.columns(at)
        impulse = np.array([self.kernel.impulse_1(at), self.kernel.impulse_2(at), self.kernel.impulse_3(at)], float)
        if not self.is_free:
            after[:3] += np.linalg.solve(m, impulse)
            return after
        change = np.linalg.solve(m - (columns / own) @ columns.T, impulse)
        after[:3] += change
        after[6 + N :] -= columns.T @ change / own
        return after

    def motion(self, duration: float, nu: ArrayLike, chi: ArrayLike = 0, pose: ArrayLike = (0, 0, 0),
               spins: ArrayLike = 0) -> Motion:  # fmt: skip
        """The motion over `duration` s from nu (3,), chi (N,), the pose (3,) and the free rollers' spins (N, n-1).

        SimulationStopped where the integration fails or does not pass its switches.
        """
        N, t = self.wheels, 0.0
        shape = (N, self.n - 1)
        y = np.concatenate([nu, np.broadcast_to(chi, N), pose, np.broadcast_to(spins, shape).ravel()]).astype(float)
        ends = [event(3 + i, self.joint) for i in range(N)]
        grid, rows, switches = np.linspace(0, duration, ROWS), [(t, y)], []
        while t < duration:
            directions = self.due(y)
            if directions.any():
                y = self.switched(y, directions)
                switches.append(t)
                rows.append((t, y))
                if len(switches) > MOST_SWITCHES:
                    raise SimulationStopped(f"more than {MOST_SWITCHES} switches within {t:g} s")
                continue
            ahead = grid[grid > t]
            found = solve_ivp(self.rates, (t, duration), y, "DOP853", ahead, events=ends, rtol=RTOL, atol=ATOL)
            if found.status < 0:
                raise SimulationStopped(f"at {t:g} s: {found.message}")
            rows += list(zip(found.t, np.transpose(found.y), strict=True))
            if found.status == 0:
                break
            passed = [i for i in range(N) if len(found.t_events[i])]
            first = min(passed, key=lambda i: found.t_events[i][0])
            t, y = found.t_events[first][0], found.y_events[first][0]
            y = y.copy()
            near = np.abs(y[3 : 3 + N]) >= self.joint * (1 - TOGETHER)
            y[3 : 3 + N] = np.where(near, np.sign(y[3 : 3 + N]) * self.joint, y[3 : 3 + N])
            rows.append((t, y))
        times, states = np.array([row[0] for row in rows]), np.array([row[1] for row in rows])
        energies = np.array([self.energy(state) for state in states])
        return Motion(times, states[:, :3], states[:, 3 + N : 6 + N], energies, np.array(switches))

    def due(self, y: np.ndarray) -> np.ndarray:
        """Directions of the wheels that stand at their joints and move outwards."""
        return outward(y[3 : 3 + self.wheels], self.wheel_rates(self.at(y)), self.n)


def by_scene(kernel: ModuleType, scene: Scene, numbers: Mapping[str, float]) -> Motion:
    """The motion of a scene's bare vehicle, without what acts on it, by the kernel's equations."""
    options = scene.options
    law = options.get("switching", "impact")
    changed = ChangedVehicle(kernel, scene.vehicle, options.get("roller_model", "free"), law, numbers)
    start = {name: options[name] for name in ("nu", "chi", "pose", "spins") if name in options}
    return changed.motion(options["duration"], **start)


def described(motion: Motion) -> str:
    """Where a motion ends, in a line."""
    (x, y, theta), nu = motion.pose[-1], ", ".join(f"{speed:.4f}" for speed in motion.nu[-1])
    end = f"after {motion.t[-1]:g} s  x {x:.4f} m  y {y:.4f} m  heading {theta:.4f} rad  nu {nu}"
    return f"{end}  energy {motion.energy[0]:.6g} to {motion.energy[-1]:.6g} J  {len(motion.switches)} switches"


def event(place: int, joint: float) -> Callable[[float, np.ndarray], float]:
    """What ends a phase: the wheel at its joint."""

    def reached(t: float, y: np.ndarray) -> float:
        return abs(y[place]) - joint

    reached.terminal, reached.direction = True, 1  # type: ignore[attr-defined]
    return reached


def picture(motions: Mapping[str, Motion], path: Path, title: str) -> Path:
    """Path, heading, energy and nu of the old and the new motion by their names, as PNG. Needs matplotlib."""
    import matplotlib

    from omniroll.results import pictures

    styles = ({"color": "#6b6b6b", "zorder": 2}, {"color": "#1f5fa8", "linestyle": (0, (4, 1.6)), "zorder": 3})
    lines = [
        (style | {"label": name}, SimpleNamespace(**vars(motion)))
        for style, (name, motion) in zip(styles, motions.items(), strict=True)
    ]
    with matplotlib.rc_context(pictures.STYLE):
        figure, axes = pictures.panels_of(lines)
        axes["energy"].set_title("energy")
        axes["key"].axis("off")
        axes["key"].legend(*axes["path"].get_legend_handles_labels(), loc="center left")
        figure.suptitle(title, x=0.01, ha="left", fontsize=13)
        return pictures.save(figure, path)
