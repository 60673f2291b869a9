"""Wheels that may slip, in 40 digits: the motion under each law of the ground, with events and rules of its own.

Of the generated formulas it takes the accelerations that given forces of the ground and given torques make, and the
slip velocities. The laws of friction, which contacts and bearings stick, and what holds them are solved for here:
unknown forces and torques that keep slips and rates zero (hard.constrained).
Effects beside the ground are torques and friction in the bearings of axles and rollers: Coulomb's as the set-valued
law, and of axles viscous friction. Wheels that stand must leave nu enough room for their forces to be determined. Where
rollers may stick under Coulomb's friction each has an axial speed of its own in the state.

A slip on its way to rest has a direction that turns ever faster, so that the steps of the series shrink with it. What
is left of it at RESTS, a force of this contact takes away at once: the square of that is left out.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import arb, arb_series

import omniroll
from hard.constrained import Row, Series, coefficients, first_zero, solved
from hard.moving import CONSTANTS, larger, split
from omniroll.engine.runs import Task
from omniroll.kernels.kernel import Kernel, kernel
from omniroll.studies.accuracy.acting import Acting
from omniroll.studies.accuracy.mechanics import elementary, flat, nested_numbers

ORDER, ERROR = 36, 1e-30  # of the series, and of a step, relative
RESTS = 1e-14  # m/s
STILL = 1e-25  # m/s, of a slip that a start does not have
ROUNDED = 1e-14  # rad/s, of a spin that doubles say a start has, and is not there
ZERO = 1e-28  # of a margin
EDGE = 1e-20  # N^2: static friction has been used up where it has just been found so
AT_ONCE = 1e-20  # m/s^2, of an acceleration that is not there
LONGEST = 10_000  # steps
OWN = ("drive", "axle_viscous")  # effects that may be beside the ground
STICKS, SLIPS, BEGINS = "sticks", "slips", "begins"


@dataclass
class Friction:
    """The numbers of the ground, which may be moved."""

    law: str
    numbers: dict[str, Any]

    @classmethod
    def of(cls, contact: omniroll.Contact, task: Task) -> "Friction":
        wheels, found = task.kernel.wheels, {}
        for name in ("coefficient", "friction", "static_friction"):
            given = getattr(contact, name)
            if given is not None:
                found[name] = [arb(float(v)) for v in np.broadcast_to(given, 2)]
        for name in ("speed", "height"):
            if getattr(contact, name) is not None:
                found[name] = arb(float(getattr(contact, name)))
        if contact.load is not None:
            found["load"] = [arb(float(v)) for v in np.broadcast_to(contact.load, wheels)]
        found["normal_gravity"] = arb(omniroll.vocabulary.STANDARD_GRAVITY)
        if contact.normal_gravity is not None:
            found["normal_gravity"] = arb(float(contact.normal_gravity))
        return cls(contact.law, found)

    def move(self, name: str, place: tuple[int, ...], change: Any) -> bool:
        """Whether it has a number of this name, which is larger from now on."""
        if name not in self.numbers:
            return False
        self.numbers[name] = larger(self.numbers[name], place, change)
        return True

    def sliding(self, towards: Row, along_axle: bool) -> Row:
        """The force per load (regularised, coulomb), or the force (viscous), on a contact that slips `towards`."""
        axle, rolling = towards if along_axle else (arb(0), towards[1])
        if self.law == "viscous":
            first, second = self.numbers["coefficient"]
            return [-first * axle, -second * rolling]
        first, second = self.numbers["friction"]
        square = first * first * axle * axle + second * second * rolling * rolling
        if self.law == "regularised":
            square += first * second * self.numbers["speed"] ** 2
        size = square.sqrt()
        return [-(first**2) * axle / size, -(second**2) * rolling / size]

    def used_up(self, force: Row, load: Any, along_axle: bool) -> Any:
        """How much more than the load, in squares of N, a force asks for at this static friction."""
        first, second = self.numbers.get("static_friction", self.numbers.get("friction"))
        along, across = force[0] / first, force[1] / second
        return across * across - load * load + (along * along if along_axle else 0)


@dataclass
class Bearings:
    """The torques of the bearings of axles, if these may stick, then of all rollers in contact and of free ones, if
    these may (B,): of those that turn, and the largest of those at rest.

    axles    how many of them are those of axles
    damping  (N,) in N m s, of rollers in contact
    """

    sliding: Row
    holding: Row
    axles: int
    damping: Row

    @classmethod
    def of(cls, effects: list, counts: tuple[int, int], name: str, change: Any) -> "tuple[Bearings | None, bool]":
        """Those of the effects, with the number of this name larger, and whether they have it."""
        own = next((e for e in effects if isinstance(e, omniroll.Bearings)), None)
        (wheels, rollers), (number, place) = counts, split(name)
        sliding, holding, has = [], [], False
        for body, count in (("wheel", 1), ("roller", rollers)):
            found = []
            for kind in ("coulomb", "break_away"):
                given = getattr(own, f"{body}_{kind}", None)
                if given is None:
                    continue
                torques = [arb(float(v)) for v in np.broadcast_to(given, wheels)]
                if number == f"{body}_{kind}":
                    torques, has = larger(torques, place, change), True
                found.append(torques + [torque for torque in torques for _ in range(count - 1)])
            if found:
                sliding, holding = sliding + found[0], holding + found[-1]
        if not sliding:
            return None, False
        damping = [arb(float(v)) for v in np.broadcast_to(own.roller_viscous or 0.0, wheels)]
        if number == "roller_viscous":
            damping, has = larger(damping, place, change), True
        return cls(sliding, holding, wheels if own.wheel_coulomb is not None else 0, damping), has


class Vehicle:
    """The formulas of a task, with one of its numbers larger by `change`.

    damps  whether bearings of rollers have viscous friction, which is put down here
    """

    damps = False

    def __init__(self, task: Task, name: str, change: Any):
        contact = next(e for e in task.effects.effects if isinstance(e, omniroll.Contact))
        number, place = split(name)
        bound, self.task = task.kernel, task
        effects = [effect for effect in bound.effects if effect in OWN]
        others = [e for e in task.effects.effects if e is not contact]
        given = {key: value for e in others for key, value in e.constants(task.vehicle).items()}
        if self.damps:
            given.pop("roller_damping")  # which these formulas do not know
        self.bearings, of_bearings = Bearings.of(others, (bound.wheels, self._bearings_of_rollers(bound)), name, change)
        self.rollers_stick = self.bearings is not None and len(self.bearings.sliding) > self.bearings.axles
        effects += self._of_ground()
        effects += [] if "drive" in effects else ["drive"]
        self.kernel = own = kernel(
            task.vehicle, bound.roller_model, "python", effects=tuple(effects), constants=tuple(given.items())
        )
        self.module = omniroll.kernels.sets.python_module(own.base, own.effects)
        self.wheels, self.rollers, self.heavy = own.wheels, own.rollers_per_wheel, own.has_spins
        constants = dict(zip(own.constant_names, (nested_numbers(c.tolist(), arb) for c in own.constants), strict=True))
        self.ground = Friction.of(contact, task)
        self.start_number, moved = (number, place, change), self.ground.move(number, place, change)
        kernel_name = CONSTANTS.get(number, number)
        self.without = self.module.prepare(self.wheels, self.rollers, *constants.values())
        if kernel_name in constants:
            constants[kernel_name], moved = larger(constants[kernel_name], place, change), True
        self.model = self.module.prepare(self.wheels, self.rollers, *constants.values())
        self.constants = constants
        self.mass, self.inertia = constants["mass"], constants["wheel_inertia"]
        self.joint = elementary().circle_ratio(arb(1)) / self.rollers
        radius, angles = constants["platform_radius"], constants["wheel_angles"]
        self.places = [[radius * a.cos(), radius * a.sin()] for a in angles]
        self.contact = contact
        moved = moved or of_bearings
        if not moved and number not in ("nu", "chi", "pose", "spins", "wheel_rates", "contact_spins"):
            raise ValueError(f"{name} is no number of this reference")
        self.acting = Acting(task, arb) if others else None

    def _of_ground(self) -> list[str]:
        """The effects of the ground, and of bearings, of which formulas are taken."""
        return ["contact", "contact_coulomb", "contact_loads"] + ["roller_sticking"] * self.rollers_stick

    @staticmethod
    def _bearings_of_rollers(bound: Kernel) -> int:
        """How many rollers of a wheel have bearings that may stick."""
        return bound.rollers_per_wheel

    @property
    def two_ways(self) -> bool:
        """Whether contacts may slip along their axles, too."""
        return self.heavy

    def start(self) -> tuple[Row, list[Row]]:
        """y = nu, chi, pose, the wheels' rates and the axial speeds of the rollers in contact; and those of others."""
        state, (number, place, change) = self.task.state, self.start_number

        def given(name: str, values: Any) -> Any:
            values = nested_numbers(np.asarray(values, float).tolist(), arb)
            return larger(values, place, change) if name == number else values

        nu, chi, pose = (given(name, getattr(state, name)) for name in ("nu", "chi", "pose"))
        rates, spins = self.module.wheel_rates(self.model, nu, chi)
        if self.contact.wheel_rates is not None:
            rates = given("wheel_rates", np.broadcast_to(self.contact.wheel_rates, self.wheels))
        if not self.heavy:
            return [*nu, *chi, *pose, *rates], []
        turning = self.module.contact_axial(self.model, nu, chi)
        if self.contact.contact_spins is not None:
            own = given("contact_spins", np.broadcast_to(self.contact.contact_spins, self.wheels))
            turning = [t + o - s for t, o, s in zip(turning, own, spins, strict=True)]
        y, free = [*nu, *chi, *pose, *rates, *turning], self._free(nu, chi)
        return ([*y, *flat(free)], []) if self.rollers_stick else (y, free)

    def _free(self, nu: Row, chi: Row) -> list[Row]:
        """The axial speeds of the free rollers: their spins stay where another number is moved."""
        state = self.task.state
        old = [nested_numbers(getattr(state, name).tolist(), arb) for name in ("nu", "chi")]
        axial = nested_numbers(state.free_axial().tolist(), arb)
        spins = self.module.spins_from_axial(self.without, *old, axial)
        number, place, change = self.start_number
        if number == "spins":
            spins = larger(spins, place, change)
        return self.module.axial_speeds(self.model, nu, chi, spins)

    def parts(self, y: Row) -> dict[str, Any]:
        n = self.wheels
        ends = {"nu": (0, 3), "chi": (3, 3 + n), "pose": (3 + n, 6 + n), "rates": (6 + n, 6 + 2 * n)}
        ends["contact_omega"] = (6 + 2 * n, 6 + 3 * n)
        found = {name: y[first:last] for name, (first, last) in ends.items()}
        return found | {"axial": self.by_wheel(y[6 + 3 * n :])} if self.rollers_stick else found

    def by_wheel(self, free: Row) -> list[Row]:
        """Values of all free rollers, wheel by wheel."""
        each = self.rollers - 1
        return [free[i * each : (i + 1) * each] for i in range(self.wheels)]

    def turning(self, y: Row) -> Row:
        """The rates of all bearings."""
        known = self.parts(y)
        rates = known["rates"] if self.bearings.axles else []
        if not self.rollers_stick:
            return rates
        contacts = self.module.slip_spins(self.model, known["nu"], known["chi"], known["contact_omega"])
        free = self.module.spins_from_axial(self.model, known["nu"], known["chi"], known["axial"])
        return [*rates, *contacts, *flat(free)]

    def with_bearings(self, inputs: dict[str, Any], torques: Row) -> dict[str, Any]:
        """The inputs with the torques of all bearings."""
        axles, n, found = self.bearings.axles, self.wheels, dict(inputs)
        if axles:
            found["torque"] = [a + b for a, b in zip(inputs["torque"], torques[:axles], strict=True)]
        if self.rollers_stick:
            found["contact_bearing"] = torques[axles : axles + n]
            found["free_bearing"] = self.by_wheel(torques[axles + n :])
        return found

    def free_axial(self, y: Row, axial: list[Row]) -> list[Row]:
        """The axial speeds of the free rollers, in a state with what is kept beside it."""
        return self.parts(y)["axial"] if self.rollers_stick else axial

    def slip(self, y: Row) -> list[Row]:
        known = self.parts(y) | {"ground_push": [[arb(0)] * 2] * self.wheels, "load_factor": [arb(1)] * self.wheels}
        slip, _ = self.call("slip_forces", known)
        return slip if self.heavy else [[arb(0), rolling] for _, rolling in slip]

    def rates(self, y: Row, forces: list[Row], inputs: dict[str, Any]) -> Row:
        known = self.parts(y) | inputs | {"ground_push": forces, "load_factor": [arb(1)] * self.wheels}
        known["heading"] = known["pose"][2]
        pose_dot = self.module.pose_rates(self.model, known["nu"], known["pose"][2])
        if self.rollers_stick:
            return self._rates_with_rollers(known, pose_dot)
        nu_dot, chi_dot, *others = self.call("slip_dynamics", known)
        return [*nu_dot, *chi_dot, *pose_dot, *flat(others)]

    def _rates_with_rollers(self, known: dict[str, Any], pose_dot: Row) -> Row:
        """Of contacts and bearings that are all as if they slipped and turned."""
        none, n = [arb(0)] * self.wheels, self.wheels
        known |= {"momenta": self.module.momenta(self.model, known["axial"])}
        known |= dict.fromkeys(("sticks", "axle_sticks", "contact_sticks"), none) | {"absent": none[:1] * 3}
        known |= {"free_sticks": [none[:1] * (self.rollers - 1)] * n}
        known |= {"directions": [arb(int(i == j)) for i in range(3) for j in range(3)]}
        outputs = (argument.name for argument in self.kernel.signatures["bearing_dynamics"].outputs)
        found = dict(zip(outputs, self.call("bearing_dynamics", known), strict=True))
        names = ("rates_dot", "contact_omega_dot", "axial_dot")
        return [*found["nu_dot"], *found["chi_dot"], *pose_dot, *flat([found[name] for name in names])]

    def call(self, name: str, known: dict[str, Any]) -> Any:
        inputs = (known[argument.name] for argument in self.kernel.signatures[name].inputs)
        return getattr(self.module, name)(self.model, *inputs)

    def springs(self, z: Row) -> Row:
        """The loads of equal springs under a platform that sinks and tilts by z."""
        return [z[0] + z[1] * x + z[2] * y for x, y in self.places]

    def moments(self, loads: Row) -> Row:
        by_place = zip(loads, self.places, strict=True)
        return [sum(column) for column in zip(*((n, n * x, n * y) for n, (x, y) in by_place), strict=True)]

    def loads_at_rest(self) -> Row:
        if self.ground.law == "viscous" or "load" in self.ground.numbers:
            return self.ground.numbers.get("load", [arb(1)] * self.wheels)
        units = [[arb(int(i == j)) for j in range(3)] for i in range(3)]
        columns = [self.moments(self.springs(unit)) for unit in units]
        matrix = [list(row) for row in zip(*columns, strict=True)]
        weight = self.mass * self.ground.numbers["normal_gravity"]
        return self.springs(solved(matrix, [weight, arb(0), arb(0)]))


class Phase:
    """The motion in given modes of the contacts and bearings; unknown are what holds contacts, where slips begin to go,
    and what holds bearings.

    towards  (N,) signs of the slips of massless rollers
    turning  (B,) signs of the rates of bearings, 0 where one sticks
    """

    def __init__(
        self, vehicle: Vehicle, modes: list[str], towards: list[int], turning: list[int], inputs: dict[str, Any]
    ):
        self.turning = list(turning)
        self.v, self.modes, self.towards, self.inputs = vehicle, list(modes), list(towards), inputs
        self.own = (0, 1) if vehicle.heavy else (1,)  # directions in which contacts may slip
        self.places: dict[tuple[int, int], int] = {}
        for i, mode in enumerate(modes):
            if mode == STICKS or (mode == BEGINS and vehicle.heavy):
                for c in self.own:
                    self.places[i, c] = len(self.places)
        self.of_contacts = len(self.places)
        stuck = [i for i, sign in enumerate(turning) if not sign]
        self.bearings = {i: self.of_contacts + k for k, i in enumerate(stuck)}
        self.unknowns = self.of_contacts + len(stuck)
        self.loads = vehicle.loads_at_rest()

    def signals(self, time: Any, z: Row) -> dict[str, Any]:
        given, slopes = self.inputs.get("torque", ([arb(0)] * self.v.wheels,) * 2)
        torque = [value + slope * time for value, slope in zip(given, slopes, strict=True)]
        found = {"torque": torque} | ({"momenta": self.inputs["momenta"]} if "momenta" in self.inputs else {})
        if self.v.bearings is None:
            return found
        signs = enumerate(zip(self.turning, self.v.bearings.sliding, strict=True))
        own = [z[self.bearings[i]] if i in self.bearings else -sign * s for i, (sign, s) in signs]
        return self.v.with_bearings(found, own)

    def speeds(self, y: Row, z: Row) -> Row:
        """The rates of all bearings."""
        return self.v.turning(y)

    def goes_back(self, i: int, slip: Row) -> Any:
        """Of a contact that slips how far it does against where it did at the start, by that; None of others."""
        if self.modes[i] != SLIPS:
            return None
        first = [s[0].mid() for s in map(arb_series, slip)]
        return -sum(a * b for a, b in zip(first, slip, strict=True)) / sum(a * a for a in first)

    def asked(self, y: Row, z: Row) -> dict[int, Any]:
        """What holds bearings that stick."""
        return {i: z[k] for i, k in self.bearings.items()}

    def forces(self, y: Row, z: Row) -> list[Row]:
        slip = self.v.slip(y) if any(mode == SLIPS for mode in self.modes) else None
        loads, found = self.loads, []
        for i, mode in enumerate(self.modes):
            if mode == STICKS:
                found.append([z[self.places[i, c]] if (i, c) in self.places else arb(0) for c in (0, 1)])
            else:
                load = arb(1) if self.v.ground.law == "viscous" else loads[i]
                found.append([load * f for f in self.v.ground.sliding(self.direction(i, slip, z), self.v.heavy)])
        return found

    def direction(self, i: int, slip: Any, z: Row) -> Row:
        """In which a contact slips."""
        if self.v.ground.law == "coulomb" and not self.v.heavy:
            return [arb(0), arb(self.towards[i])]
        return slip[i] if self.modes[i] == SLIPS else [z[self.places[i, c]] for c in (0, 1)]

    def rates(self, time: Any, y: Row, z: Row) -> Row:
        return self.v.rates(y, self.forces(y, z), self.signals(time, z))

    def kept(self, time: Any, y: Row, z: Row) -> Row:
        """The slips of contacts that stick; of those that begin to slip, less what the unknown direction makes; the
        rates of bearings that stick."""
        turning = self.v.turning(y) if self.bearings else []
        rates = [turning[i] for i in self.bearings]
        if not self.places:
            return rates
        slip = self.v.slip(y)
        kept = [slip[i][c] - (time * z[k] if self.modes[i] == BEGINS else 0) for (i, c), k in self.places.items()]
        return kept + rates

    def balance(self, time: Any, y: Row, z: Row, rates: Row) -> Row:
        return []


class Run:
    """The motion from its start to the end; `log` says what happens.

    modes     of the contacts
    towards   signs of the slips of massless rollers
    resting   contacts whose slip has come to zero at this instant
    released  contacts that have used their friction up at this instant
    turning   signs of the rates of bearings, 0 where one sticks
    at_rest, let_go  bearings that have come to rest, and that have used their friction up
    """

    formulas, in_modes = Vehicle, Phase

    def __init__(self, task: Task, name: str, change: Any):
        self.v, self.now, self.end = self.formulas(task, name, change), arb(0), arb(task.duration)
        self.y, self.axial = self.v.start()
        self.modes, self.towards, self.log = [SLIPS] * self.v.wheels, [0] * self.v.wheels, []
        self.decided = list(self.modes)  # when modes were decided last
        self.resting: set[int] = set()
        self.released: set[int] = set()
        self.begun: dict[int, Row] = {}  # first guesses of where slips go
        self.turning: list[int] = []
        if self.v.bearings is not None:
            self.turning = [sign_of(rate, ROUNDED) for rate in self.v.turning(self.y)]
        self.at_rest = {i for i, sign in enumerate(self.turning) if not sign}
        self.let_go: set[int] = set()
        self.turned = list(self.turning)  # when it was decided last
        self._see()

    def to_the_end(self) -> Row:
        """nu, chi, pose and spins."""
        self._decide()
        for _ in range(LONGEST):
            if float(self.end - self.now) <= 0:
                parts = self.v.parts(self.y)
                spins = []
                if self.v.heavy:
                    axial = self.v.free_axial(self.y, self.axial)
                    spins = self.v.module.spins_from_axial(self.v.model, parts["nu"], parts["chi"], axial)
                return [*parts["nu"], *parts["chi"], *parts["pose"], *flat(spins)]
            self._step()
        raise ValueError("too many steps")

    def _phase(self) -> Phase:
        v, inputs = self.v, {}
        if v.heavy and not v.rollers_stick:
            inputs["momenta"] = v.module.momenta(v.model, self.axial)
        if v.acting is not None:
            while v.acting.next_time() <= float(self.now):
                v.acting.pass_time(v.acting.next_time(), None, v.parts(self.y)["nu"], None)
            v.acting.begin(self.now)
            inputs |= v.acting.signals
        return self.in_modes(v, self.modes, self.towards, self.turning, inputs)

    def _see(self) -> None:
        """Which contacts rest, of those that may."""
        for i, slip in enumerate(self.v.slip(self.y)):
            if self.v.ground.law == "coulomb" and self.modes[i] == SLIPS:
                if max(abs(float(s)) for s in slip) < STILL:
                    self.resting.add(i)
                elif not self.towards[i]:
                    self.towards[i] = 1 if float(slip[1]) > 0 else -1

    def _decide(self) -> None:
        """Contacts at rest stick if friction can hold them; else one after the other begins to slip, against what
        would hold it, the one that asks for most first."""
        for i in self.resting:
            self.modes[i] = STICKS
        released = set(self.released)
        for i in self.at_rest:
            self.turning[i] = 0
            if i < self.v.bearings.axles:
                self.y[self._rate(i)] = arb(0)
        for _ in range(self.v.wheels + len(self.turning) + 1):
            series = Series(self._phase(), self.y, 0, self._guess_at(self._phase()))
            z = [c[0] for c in series.z]
            phase = series.motion
            forces, loads = phase.forces(self.y, z), phase.loads
            used = {
                i: float(self.v.ground.used_up(forces[i], loads[i], self.v.two_ways)) + (EDGE if i in released else 0)
                for i, mode in enumerate(self.modes) if mode == STICKS
            }  # fmt: skip
            bearing = self._bearing_that_gives(phase, z)
            if bearing is not None:
                self.turning[bearing] = -sign_of(phase.asked(self.y, z)[bearing])
                self._has_given(bearing)
                continue
            first = max(used, key=lambda i: used[i], default=None)
            if first is None or used[first] <= ZERO:
                break
            self.modes[first] = BEGINS
            self.towards[first] = -1 if float(forces[first][1]) > 0 else 1
            self.begun[first] = [-force / self.v.mass for force in forces[first]]
            self._has_gone(first, loads[first])
        self._check_directions(series)
        now = [SLIPS if mode == BEGINS else mode for mode in self.modes]
        self.log += [(float(self.now), i, mode) for i, mode in enumerate(now) if mode != self.decided[i]]
        kinds = {True: "sticks", False: "turns"}
        for i, (new, old) in enumerate(zip(self.turning, self.turned, strict=True)):
            if new != old:
                body = "axle" if i < self.v.bearings.axles else "roller"
                self.log.append((float(self.now), i, body, kinds[new == 0]))
        self.turned = list(self.turning)
        self.at_rest.clear()
        self.let_go.clear()
        self.decided = now
        self.resting.clear()
        self.released.clear()

    def _has_given(self, bearing: int) -> None:
        """A bearing has just given way."""

    def _has_gone(self, contact: int, load: Any) -> None:
        """A contact with this load has just begun to slip."""

    def _rate(self, i: int) -> int:
        """The place of a wheel's rate in y."""
        return 6 + self.v.wheels + i

    def _bearing_that_gives(self, phase: Phase, z: Row) -> int | None:
        """The bearing that is asked for most beyond what it holds; None where all are held."""
        beyond = {
            i: float(abs(torque) - self.v.bearings.holding[i]) + (EDGE if i in self.let_go else 0)
            for i, torque in phase.asked(self.y, z).items()
        }
        first = max(beyond, key=lambda i: beyond[i], default=None)
        return None if first is None or beyond[first] <= ZERO else first

    def _guess_at(self, phase: Phase) -> Row:
        guess = [arb(0)] * phase.unknowns
        for (i, c), k in phase.places.items():
            if self.modes[i] == BEGINS:
                guess[k] = self.begun[i][c]
        return guess

    def _check_directions(self, series: Series) -> None:
        """A contact that begins to slip goes where its slip grows; with one friction it has no acceleration yet."""
        if self.v.heavy or BEGINS not in self.modes:
            return
        rates = series.motion.rates(arb(0), self.y, [c[0] for c in series.z])
        grown = [arb_series([value, rate], 2) for value, rate in zip(self.y, rates, strict=True)]
        for i, slip in enumerate(self.v.slip(grown)):
            if self.modes[i] == BEGINS and float(slip[1][1]) * self.towards[i] < -AT_ONCE:
                raise ValueError(f"contact {i} neither sticks nor slips")

    def _step(self) -> None:
        phase = self._phase()
        series = Series(phase, self.y, ORDER, self._guess_at(phase))
        known = np.inf if self.v.acting is None else self.v.acting.next_time()
        goal = min(self.end, arb(known), key=float) if known < np.inf else self.end
        left = goal - self.now
        h = min(left, arb(series.length(ERROR)), key=float)
        margins = self._margins(series)
        found = first_zero([margin for margin, _ in margins], h, ZERO)
        if found is not None:
            h = found[0]
        self.y, _ = series.at(h)
        arrived = found is None and float(left - h) <= 0
        self.now = goal if arrived else (self.now + h).mid()
        self.modes = [SLIPS if mode == BEGINS else mode for mode in self.modes]
        if found is not None:
            for k in found[1]:
                margins[k][1]()
        self._rest_where_little_is_left()
        if found is not None or self.resting or self.at_rest or arrived:
            self._settle()

    def _margins(self, series: Series) -> list[tuple[Row, Any]]:
        """Functions, by coefficients, that become positive, and what happens then."""
        count = ORDER + 1
        y, z = ([arb_series(c, count) for c in rows] for rows in (series.y, [[*c, 0] for c in series.z]))
        phase, found = series.motion, []
        chi = self.v.parts(y)["chi"]
        for i in range(self.v.wheels):
            for d in (1, -1):
                found.append((d * chi[i] - self.v.joint, lambda i=i, d=d: self._switch(i, d)))
        found += self._margins_of_bearings(phase, y, z)
        if self.v.ground.law == "coulomb":
            forces, loads, slip = phase.forces(y, z), phase.loads, self.v.slip(y)
            for i, mode in enumerate(self.modes):
                if mode == STICKS:
                    excess = self.v.ground.used_up(forces[i], loads[i], self.v.two_ways)
                    found.append((excess, lambda i=i: self.released.add(i)))
                elif (back := phase.goes_back(i, slip[i])) is not None:
                    found.append((back, lambda i=i: self.resting.add(i)))
        return [(coefficients(margin, count), happens) for margin, happens in found]

    def _margins_of_bearings(self, phase: Phase, y: Row, z: Row) -> list[tuple[Any, Any]]:
        found: list[tuple[Any, Any]] = []
        rates = phase.speeds(y, z) if self.turning else []
        for i, sign in enumerate(self.turning):
            if sign:
                found.append((-sign * rates[i], lambda i=i: self.at_rest.add(i)))
        for i, torque in phase.asked(y, z).items():
            for side in (1, -1):
                found.append((side * torque - self.v.bearings.holding[i], lambda i=i: self.let_go.add(i)))
        return found

    def _switch(self, i: int, direction: int) -> None:
        """No speed changes: the roller that comes into contact has the axial speed that it has."""
        n = self.v.wheels
        self.y[3 + i] = (-direction * self.v.joint).mid()
        self.log.append((float(self.now), i, "switch"))
        if self.v.heavy:
            place, axial = 6 + 2 * n + i, list(self.v.free_axial(self.y, self.axial)[i])
            leaving = self.y[place]
            self.y[place] = axial.pop(-1 if direction > 0 else 0)
            axial = [leaving, *axial] if direction > 0 else [*axial, leaving]
            if self.v.rollers_stick:
                first = 6 + 3 * n + i * len(axial)
                self.y[first : first + len(axial)] = axial
                self.turning = [sign_of(rate) for rate in self.v.turning(self.y)]
            else:
                self.axial[i] = axial
            if self.modes[i] == STICKS:
                self.modes[i] = SLIPS
                self._see()

    def _turns(self, i: int) -> bool:
        """Whether the slip of a contact has two components."""
        return self.v.heavy

    def _rest_where_little_is_left(self) -> None:
        """A slip of two components comes near zero and not there: a contact rests whose slip is all but gone."""
        if self.v.ground.law != "coulomb":
            return
        slip = self.v.slip(self.y)
        for i, mode in enumerate(self.modes):
            left = max(abs(float(s)) for s in slip[i])
            if mode == SLIPS and self._turns(i) and left < RESTS:  # `_take_away` brings the rest of it to zero
                self.resting.add(i)

    def _settle(self) -> None:
        rests = [i for i in self.resting if self.modes[i] == SLIPS]
        for i in rests:
            self.modes[i] = STICKS
        if rests:
            self._take_away()
        self.resting |= {i for i, mode in enumerate(self.modes) if mode == STICKS}
        self.at_rest |= {i for i, sign in enumerate(self.turning) if not sign}
        self._decide()

    def _take_away(self) -> None:
        """Forces of the contacts that stick bring their slips to zero at once."""
        phase = self._phase()
        series = Series(phase, self.y, 0, self._guess_at(phase))
        slip = self.v.slip(self.y)
        left = [slip[i][c] for i, c in phase.places] + [arb(0)] * (phase.unknowns - phase.of_contacts)
        impulse = solved(series.matrix, [-value for value in left])
        for value, response in zip(impulse, series.response, strict=True):
            self.y = [(y + value * r).mid() for y, r in zip(self.y, response, strict=True)]


def sign_of(value: Any, still: float = STILL) -> int:
    return 0 if abs(float(value)) < still else 1 if float(value) > 0 else -1
