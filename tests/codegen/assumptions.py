"""Changed assumptions, and the mechanics that follows from each, in numbers and by brute force.

A change is a line of maxima/paper/ in Maxima's words. The same words, read as Python, change a vehicle of two wheels
of three rollers here: its Lagrangian is added up over all bodies, no slip is solved at each contact from the velocities
of the bodies, and V^T (d/dt dL/dq' - dL/dq) is taken by differences in 80 digits. There are no quasi-velocities'
momenta, no brackets and no parts: nothing of maxima/ but the words that change.
"""

import random
import string
from dataclasses import dataclass, field

import numpy as np
from mpmath import mp, mpf

WHEELS, ROLLERS = 2, 3
STEP = mpf(10) ** -20  # errors of differences are its square
UP = np.array([mpf(0), mpf(0), mpf(1)])
ASSIGNED_BEFORE, COORDINATES = set("qV"), set("xy")  # have a value or a meaning where energies stand
LETTERS = sorted(set(string.ascii_letters) - ASSIGNED_BEFORE - COORDINATES)

PLACES = {  # what is changed: file, what stands there, and what takes its place
    "platform": ("kinetic_energy", "I_S*theta_dot^2)/2$", "I_S*theta_dot^2)/2 + {}$"),
    "wheel": ("kinetic_energy", "roller_axis(chi), wheel_turning))/2$", "roller_axis(chi), wheel_turning))/2 + {}$"),
    "roller": ("kinetic_energy", "roller_axis(chi + kappa), wheel_turning)/2$",
               "roller_axis(chi + kappa), wheel_turning)/2 + {}$"),
    "ride": ("geometry", "ride_of_chi: l$", "ride_of_chi: l + {}$"),
    "slip": ("constraints", "contact_velocity: velocity_on_roller(contact_place)$",
             "contact_velocity: velocity_on_roller(contact_place) + {}$"),
    "axle": ("geometry", "axle: level_axle$", "axle: {}$"),
    "wheel_place": ("geometry", "arm*level_axle - offset*across$", "arm*level_axle - offset*across + {}$"),
    "contact_place": ("constraints", "contact_place: subst(solved_contact, contact_place)$",
                      "contact_place: subst(solved_contact, contact_place) + {}$"),
    "roller_axis": ("geometry", "roller_axis(beta) := cos(psi)*rim(beta) + sin(psi)*axle$",
                    "roller_axis(beta) := {}$"),
}  # fmt: skip
KINDS = [  # the place, and the words; @ is the letter
    ("platform", "@*theta_dot*(y_dot*cos(theta) - x_dot*sin(theta))"),  # an eccentric mass
    ("ride", "@*sin(chi)^2/9"),  # another profile of the rollers: wheels that rise and fall
    ("platform", "- @*x^2/2"),  # a spring
    ("wheel", "@*chi_dot^2*cos(chi)^2/2"),
    ("roller", "@*phi_s_dot^2*cos(chi + kappa)^2/2"),
    ("axle", "cos(@/9)*level_axle + sin(@/9)*vertical"),  # axles that lean
    ("platform", "@*x_dot*y_dot"),  # a mass that is not the same forward and sideways
    ("wheel", "- @*cos(chi)"),  # an unbalanced wheel
    ("roller", "@*phi_s_dot*theta_dot*cos(kappa)"),
    ("slip", "@*chi_dot*level_axle/9"),  # wheels that creep
    ("platform", "@*(x*y_dot - y*x_dot)"),  # a gyroscopic term
    ("wheel", "@*theta_dot*chi_dot*sin(alpha)"),
    ("roller", "- @*cos(chi + kappa)"),  # a potential of each roller's place
    ("wheel_place", "@*across/9"),
    ("platform", "@*cos(theta)*y"),  # a potential of the whole pose
    ("wheel", "@*x_dot*chi_dot*cos(theta + alpha)"),
    ("roller", "@*phi_s_dot*chi_dot"),
    ("contact_place", "@*level_axle/9"),
    ("wheel", "@*phi_dot*chi_dot"),
    ("roller_axis", "cos(@/9)*(cos(beta)*across + sin(beta)*upward) + sin(@/9)*axle"),  # rollers that are skew
]


@dataclass(frozen=True)
class Assumption:
    """A changed line. place: of PLACES; words: what comes in, in Maxima's words."""

    place: str
    words: str

    @property
    def file(self) -> str:
        return PLACES[self.place][0]

    def applied(self, text: str) -> str:
        """The file's text with the change."""
        _, old, new = PLACES[self.place]
        assert text.count(old) == 1, old
        return text.replace(old, new.format(self.words))


def all_assumptions() -> list[Assumption]:
    """Each letter in another one, and each kind with a name that is longer than a letter."""
    of_letters = [(letter, KINDS[k % len(KINDS)]) for k, letter in enumerate(LETTERS)]
    of_names = [("stiffness", KINDS[2]), ("unbalance_of_wheel", KINDS[7]), ("bulge", KINDS[1]), ("camber", KINDS[5])]
    return [Assumption(place, words.replace("@", name)) for name, (place, words) in [*of_letters, *of_names]]


@dataclass
class State:
    """A state of the vehicle, drawn by a seed: numbers by their names, and arrays over wheels and rollers."""

    seed: int
    numbers: dict = field(init=False)

    def __post_init__(self) -> None:
        drawn = random.Random(self.seed)
        draw = lambda low, high: mpf(drawn.uniform(low, high))  # noqa: E731
        names = [*LETTERS, "I_S", "Lambda", "stiffness", "unbalance_of_wheel", "bulge", "camber"]
        self.numbers = {name: draw(0.5, 1.5) for name in names}
        self.numbers |= {"l": mpf(2), "r": mpf("0.7"), "N": mpf(WHEELS), "n": mpf(ROLLERS)}
        self.alpha = [draw(0, 6) for _ in range(WHEELS)]
        self.q = [draw(-1, 1) for _ in range(2)] + [draw(0, 6)]
        self.q += [draw(-0.6, 0.6) for _ in range(WHEELS)] + [mpf(0)] * (WHEELS * ROLLERS)
        self.nu = [draw(-1, 1) for _ in range(3 + WHEELS * (ROLLERS - 1))]
        self.kappa = [2 * mp.pi * j / ROLLERS for j in range(ROLLERS)]


@dataclass
class Mechanics:
    """The vehicle of an assumption at a state. Coordinates: x, y, theta, chi_i, then phi_i1 ... phi_in, wheel by wheel;
    speeds: nu_1, nu_2, nu_3, then those of the free rollers, wheel by wheel."""

    assumption: Assumption | None
    state: State

    def added(self, place: str, otherwise: object, **names: object) -> object:
        """What the assumption says of a place."""
        if self.assumption is None or self.assumption.place != place:
            return otherwise
        return eval(self.assumption.words.replace("^", "**"), {"sin": mp.sin, "cos": mp.cos},
                    self.state.numbers | names)  # fmt: skip

    def phi(self, i: int, j: int) -> int:
        return 3 + WHEELS + ROLLERS * i + j

    def frame(self, i: int) -> dict:
        """Directions of wheel i in the platform's frame."""
        sin, cos = mp.sin(self.state.alpha[i]), mp.cos(self.state.alpha[i])
        level, across = np.array([cos, sin, mpf(0)]), np.array([-sin, cos, mpf(0)])
        axle = self.added("axle", level, level_axle=level, vertical=UP)
        return {"level_axle": level, "across": across, "axle": axle, "upward": np.cross(axle, across)}

    def roller_axis(self, frame: dict, beta: object) -> np.ndarray:
        usual = mp.cos(beta) * frame["across"] + mp.sin(beta) * frame["upward"]
        return self.added("roller_axis", usual, beta=beta, **frame)

    def lagrangian(self, q: list, v: list) -> object:
        c, (x, y, theta) = self.state.numbers, q[:3]
        pose = {"x": x, "y": y, "theta": theta, "x_dot": v[0], "y_dot": v[1], "theta_dot": v[2]}
        total = (c["M"] * (v[0] ** 2 + v[1] ** 2) + c["I_S"] * v[2] ** 2) / 2 + self.added("platform", 0, **pose)
        for i in range(WHEELS):
            frame, chi, chi_dot = self.frame(i), q[3 + i], v[3 + i]
            named = pose | {"chi": chi, "chi_dot": chi_dot, "alpha": self.state.alpha[i]}
            platform = v[2] * UP
            total += c["J"] * (chi_dot**2 + 2 * (platform @ frame["axle"]) * chi_dot) / 2
            total += self.added("wheel", 0, phi_dot=v[self.phi(i, 0)], **named)
            for j, kappa in enumerate(self.state.kappa):
                spin, carrier = v[self.phi(i, j)], platform + chi_dot * frame["axle"]
                total += c["B"] * (spin**2 + 2 * (carrier @ self.roller_axis(frame, chi + kappa)) * spin) / 2
                if j > 0:
                    total += self.added("roller", 0, kappa=kappa, phi_s_dot=spin, **named)
        return total

    def rates(self, q: list, nu: list) -> list:
        """q' by no slip at every contact."""
        c, theta = self.state.numbers, q[2]
        velocity, yaw = np.array([c["R"] * nu[0], c["R"] * nu[1], mpf(0)]), nu[2] / c["Lambda"]
        v = [mpf(0)] * len(q)
        v[0] = velocity[0] * mp.cos(theta) - velocity[1] * mp.sin(theta)
        v[1] = velocity[0] * mp.sin(theta) + velocity[1] * mp.cos(theta)
        v[2] = yaw
        for i in range(WHEELS):
            v[3 + i], v[self.phi(i, 0)] = self.rolling(i, q[3 + i], velocity, yaw)
            for j in range(1, ROLLERS):
                v[self.phi(i, j)] = nu[3 + (ROLLERS - 1) * i + j - 1]
        return v

    def rolling(self, i: int, chi: object, velocity: np.ndarray, yaw: object) -> tuple:
        c, frame = self.state.numbers, self.frame(i)
        place = c["R"] * frame["level_axle"] + self.added("wheel_place", 0 * UP, **frame)
        axis = self.roller_axis(frame, chi)
        ride = [c["l"] + self.added("ride", 0, chi=chi + step) for step in (-STEP, 0, STEP)]
        rise = (ride[2] - ride[0]) / (2 * STEP) * UP
        middle = c["r"] * (mp.sin(chi) * frame["across"] - mp.cos(chi) * frame["upward"])
        rises = lambda at: (UP @ (rise + np.cross(frame["axle"], at)), UP @ np.cross(axis, at - middle))  # noqa: E731
        contact = touching(-ride[1] * frame["upward"], frame["across"], frame["axle"], rises)
        contact = contact + self.added("contact_place", 0 * UP, **frame)
        carried = velocity + yaw * np.cross(UP, place + contact)
        by_wheel = rise + np.cross(frame["axle"], contact) + self.added("slip", 0 * UP, chi_dot=mpf(1), **frame)
        by_roller = np.cross(axis, contact - middle)
        (a, b, e), (d, f, g) = ([u @ w for u in (by_wheel, by_roller, carried)]
                                for w in (frame["level_axle"], frame["across"]))  # fmt: skip
        return (b * g - e * f) / (a * f - b * d), (e * d - a * g) / (a * f - b * d)

    def momenta(self, q: list, v: list) -> list:
        return [difference(lambda w: self.lagrangian(q, w), v, k) for k in range(len(q))]

    def V(self) -> list[list]:
        """Columns."""
        size = len(self.state.nu)
        return [self.rates(self.state.q, [mpf(k == m) for k in range(size)]) for m in range(size)]

    def matrix(self) -> np.ndarray:
        """M* (speeds, speeds): of the quadratic form that L* is in the speeds, beside linear terms and a potential."""
        q, columns = self.state.q, self.V()
        alone = [self.lagrangian(q, column) for column in columns]
        at_rest, size = self.lagrangian(q, [mpf(0)] * len(q)), len(columns)
        found = np.zeros((size, size), dtype=object)
        for a in range(size):
            for b in range(a + 1):
                together = self.lagrangian(q, [u + w for u, w in zip(columns[a], columns[b], strict=True)])
                found[a, b] = found[b, a] = together - alone[a] - alone[b] + at_rest
        return found

    def force(self) -> list:
        """-V^T (d/dt dL/dq' - dL/dq) where nu' = 0."""
        q, v = self.state.q, self.rates(self.state.q, self.state.nu)

        def p_after(time: object) -> list:
            later = [a + time * b for a, b in zip(q, v, strict=True)]
            return self.momenta(later, self.rates(later, self.state.nu))

        slopes = [(a - b) / (2 * STEP) for a, b in zip(p_after(STEP), p_after(-STEP), strict=True)]
        acting = [difference(lambda w: self.lagrangian(w, v), q, k) - slope for k, slope in enumerate(slopes)]
        return [np.dot(column, acting) for column in self.V()]


def touching(below: np.ndarray, ahead: np.ndarray, aside: np.ndarray, rises) -> np.ndarray:
    """The place below + a ahead + b aside that neither the wheel's turning nor the roller's lifts off the ground."""
    at, by_a, by_b = (np.array(rises(place)) for place in (below, below + ahead, below + aside))
    (m, p), (n, q) = by_a - at, by_b - at
    determinant = m * q - n * p
    a, b = (n * at[1] - q * at[0]) / determinant, (p * at[0] - m * at[1]) / determinant
    return below + a * ahead + b * aside


def differs(shown: object, right: object) -> bool:
    return abs(shown - right) > mpf(10) ** -25 * (1 + abs(right))


def difference(f, at: list, k: int) -> object:
    """df/d(at[k])."""
    ahead, behind = list(at), list(at)
    ahead[k] += STEP
    behind[k] -= STEP
    return (f(ahead) - f(behind)) / (2 * STEP)


class Printed:
    """The equations that the derivation writes, evaluated at a state."""

    def __init__(self, equations: list[dict], state: State):
        self.equations = {entry["id"]: entry["expr"] for entry in equations}
        q, nu = state.q, state.nu
        pose = dict(zip(("x", "y", "theta"), q, strict=False)) | {f"nu_{k + 1}": nu[k] for k in range(3)}
        self.numbers = state.numbers | pose | {f"nu_dot_{k}": mpf(0) for k in (1, 2, 3)}
        self.wheels = []
        for i in range(WHEELS):
            own = {"chi": q[3 + i], "alpha": state.alpha[i]}
            own["rho"] = self.value(self.equations["2.1:rho"], self.numbers | own)
            spins = nu[3 + (ROLLERS - 1) * i :][: ROLLERS - 1]
            rollers = [{"kappa": state.kappa[j], "nu_s": spins[j - 1]} for j in range(1, ROLLERS)]
            self.wheels.append((own, rollers))

    def __call__(self, name: str, wheel: int | None = None, roller: int | None = None) -> object:
        """Of the vehicle, of a wheel, or of a roller of it, counted from 1 as j - 1."""
        own = {} if wheel is None else self.wheels[wheel][0] | {"rollers": self.wheels[wheel][1]}
        own = own if roller is None else own | self.wheels[wheel][1][roller - 1]
        return self.value(self.equations[name], self.numbers | own)

    def value(self, e: object, at: dict) -> object:
        match e:
            case str():
                return at[e]
            case int():
                return mpf(e)
            case ["sum_i", inner]:
                return sum(self.value(inner, at | own) for own, _ in self.wheels)
            case ["sum_j", inner]:
                return sum(self.value(inner, at | roller) for roller in at["rollers"])
            case ["sum_ij", inner]:
                return sum(self.value(inner, at | own | roller) for own, rollers in self.wheels for roller in rollers)
            case ["+", *terms]:
                return sum(self.value(term, at) for term in terms)
            case ["*", *factors]:
                return mp.fprod(self.value(factor, at) for factor in factors)
            case ["/", p, q]:
                return mpf(p) / q
            case ["^", base, k]:
                return self.value(base, at) ** k
            case ["sin" | "cos" as name, angle]:
                return getattr(mp, name)(self.value(angle, at))
        raise ValueError(e)


def disagreements(equations: list[dict], assumption: Assumption | None, seed: int) -> list[str]:
    """What is printed and is not what follows: M*, the right side, the free rollers' equations, the momenta."""
    with mp.workdps(80):
        state = State(seed)
        true, printed = Mechanics(assumption, state), Printed(equations, state)
        matrix, force = true.matrix(), true.force()
        p = true.momenta(state.q, true.rates(state.q, state.nu))
        pairs = [(a, b) for a in range(3) for b in range(a, 3)]
        found = {f"7.1:{a + 1}{b + 1}": (printed(f"7.1:{a + 1}{b + 1}"), matrix[a, b]) for a, b in pairs}
        found |= {f"3.4:{a + 1}": (printed(f"3.4:{a + 1}"), force[a]) for a in range(3)}
        found |= {f"7.2:{k + 1}": (printed(f"7.2:{k + 1}"), p[k]) for k in range(3)}
        for i in range(WHEELS):
            found |= {f"7.2:4 of wheel {i}": (printed("7.2:4", i), p[3 + i]),
                      f"7.2:5 of wheel {i}": (printed("7.2:5", i), p[true.phi(i, 0)])}  # fmt: skip
            for j in range(1, ROLLERS):
                s, name = 2 + (ROLLERS - 1) * i + j, f"of roller {i}, {j}"
                found |= {f"7.1:{a + 1}s {name}": (printed(f"7.1:{a + 1}s", i, j), matrix[a, s]) for a in range(3)}
                found |= {f"7.1:ss {name}": (printed("7.1:ss", i, j), matrix[s, s]),
                          f"3.4:roller {name}": (printed("3.4:roller", i, j) * matrix[s, s], force[s]),
                          f"7.2:6 {name}": (printed("7.2:6", i, j), p[true.phi(i, j)])}  # fmt: skip
        differ = {name: both for name, both in found.items() if differs(*both)}
        return [f"{name}: {mp.nstr(shown, 8)} is printed, {mp.nstr(right, 8)} follows"
                for name, (shown, right) in differ.items()]  # fmt: skip
