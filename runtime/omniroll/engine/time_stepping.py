"""Friction that slips and sticks in the Python engine: Moreau's time stepping. Small, and meant to be read.

It is a witness of the compiled engine. Both take the derived formulas; nothing else is shared: no rule, no tolerance,
no decision. Here there are no phases, no events and no modes that anything decides. The speeds are

    w = (nu, the wheels' rates, the axial speeds of the rollers),

in which the kinetic energy is w . M w / 2 with a constant M. What touches, turns and sticks is a list of elements
(elements.py): a contact that rolls is a rigid one. A step of length h, with the places in its middle,

  1. takes the speeds without friction at its end,  w_free = w + h a(w),  by the derived accelerations;
  2. asks for the speeds and impulses of all elements together;
  3. moves the places by the new speeds, and hands contacts over to the next rollers where a wheel is beyond its joint.
     A roller that comes into contact where wheels roll gets its axial speed by impulses of the next step: that is the
     law `impact`, the projection in the kinetic metric.

An element that has rested in a step holds up to its static friction in the next one, one that has slipped takes its
sliding friction. The method is of first order, also where something comes to rest, breaks away or jumps.
"""

from dataclasses import dataclass, replace

import numpy as np

from omniroll.effects.guards import Guards
from omniroll.engine.elements import Elements, NotSolvedError, Step
from omniroll.engine.python_run import NUMBER, PythonRun
from omniroll.engine.runs import Task
from omniroll.errors import InvalidValueError
from omniroll.kernels.kernel import kernel
from omniroll.results.accelerations import call_named
from omniroll.vehicles.checks import joint_angle
from omniroll.vehicles.state import State, by_place, by_roller

AT_REST = 1e-12  # of the largest speed: slips and rates of the start are rounding
STEP = 1.0  # s, times the accuracy: the length of a step
MOST_STEPS = 1e6  # of a run
SMOOTH = ("drive", "motor", "slope")  # effects of the registry that are no friction


class Mechanics:
    """What the derived formulas say of a vehicle in the speeds w = (nu (3,), rates (N,), axial speeds (N, m)).

    m is n for free and locked rollers, and 1 for massless ones, of which only those in contact turn.
    """

    def __init__(self, task: Task):
        vehicle, self.wheels = task.kernel.vehicle, task.kernel.wheels
        self.has_mass = task.kernel.roller_model != "massless"
        others = [effect for effect in task.effects.effects if not effect.is_friction]
        names = {name for effect in others for name in effect.kernel_effects()}
        constants = {name: value for effect in others for name, value in effect.constants(vehicle).items()}
        ground = ("contact", "contact_coulomb")  # whose forces are given from outside
        effects = (*(name for name in SMOOTH if name in names), *ground)
        self.geometry = kernel(vehicle, "free", "python", effects=effects, constants=tuple(constants.items()))
        self.moving = self.geometry
        if not self.has_mass:
            self.moving = kernel(vehicle, "massless", "python", effects=effects, constants=tuple(constants.items()))
        self.rollers = vehicle.rollers_per_wheel if self.has_mass else 1
        self.size = 3 + self.wheels * (1 + self.rollers)
        self.mass = self._mass()

    def split(self, w: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """nu, rates and axial speeds (..., N, m) of w (..., W)."""
        nu, rates, axial = np.split(w, [3, 3 + self.wheels], axis=-1)
        return nu, rates, axial.reshape(*w.shape[:-1], self.wheels, self.rollers)

    def _known(self, w: np.ndarray) -> dict[str, np.ndarray]:
        nu, rates, axial = self.split(w)
        return {"nu": nu, "rates": rates, "contact_omega": axial[..., 0], "axial": axial[..., 1:]}

    def _mass(self) -> np.ndarray:
        """(W, W) of the kinetic energy, a sum of squares."""

        def energy(w: np.ndarray) -> np.ndarray:
            return np.asarray(call_named(self.moving, "slip_energy", self._known(w)))

        units = np.eye(self.size)
        alone = energy(units)
        return energy(units[:, None] + units) - alone[:, None] - alone

    def accelerations(
        self, w: np.ndarray, chi: np.ndarray, heading: float, drives: dict[str, np.ndarray]
    ) -> np.ndarray:
        """(W,) w' without friction."""
        known = self._known(w) | {"chi": chi, "heading": np.array(heading)} | drives
        known["ground_push"] = np.zeros((self.wheels, 2))
        if self.has_mass:
            known["momenta"] = self.moving.momenta(known["axial"])
        found = call_named(self.moving, "slip_dynamics", known)
        return np.concatenate([found[0], found[2], np.zeros(self.wheels * self.rollers)])

    def rows(self, chi: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What w is multiplied by: slips (N, 2, W) along the axle and the rolling direction, the wheels' rates (N, W),
        and the rollers' spins on their disks (N, m, W)."""
        units = np.concatenate([np.eye(3), np.zeros((2, 3))])
        rates, axial = (np.broadcast_to(np.eye(5)[:, k, None], (5, self.wheels)) for k in (3, 4))
        push = np.zeros((self.wheels, 2))
        slip, _ = self.geometry.call("slip_forces", units, chi, rates, axial, push)
        of = np.arange(self.wheels)
        slips, wheels = np.zeros((self.wheels, 2, self.size)), np.zeros((self.wheels, self.size))
        slips[:, :, :3] = np.moveaxis(slip[:3], 0, -1)
        slips[of, :, 3 + of] = slip[3]
        slips[of, :, self._place(of, 0)] = slip[4]
        wheels[of, 3 + of] = 1.0
        return slips, wheels, self._spins(chi)

    def _place(self, wheel: np.ndarray, roller: np.ndarray | int) -> np.ndarray:
        return 3 + self.wheels + wheel * self.rollers + roller

    def _spins(self, chi: np.ndarray) -> np.ndarray:
        """Each roller's axial speed less what its disk gives to it, which turns with nu_3 alone."""
        yaw, found = np.array([0.0, 0.0, 1.0]), np.zeros((self.wheels, self.rollers, self.size))
        found[:, 0, 2] = self.geometry.call("slip_spins", yaw, chi, np.zeros(self.wheels))
        if self.has_mass:
            found[:, 1:, 2] = self.geometry.spins_from_axial(yaw, chi, np.zeros((self.wheels, self.rollers - 1)))
        wheel, roller = np.indices((self.wheels, self.rollers))
        found[wheel, roller, self._place(wheel, roller)] = 1.0
        return found


@dataclass
class Laws:
    """The numbers of the elements.

    sliding, static  (N, 2) coefficients of contacts that slip and that stick
    loads    (N,) of contacts; damping (N, 2); fade (N,)
    rolls    whether contacts are rigid
    bearings  "axle" of the wheels and "roller": sliding and holding torques, damping, fade, each (N,)
    locked   whether rollers off the ground stand on their disks
    """

    sliding: np.ndarray
    static: np.ndarray
    loads: np.ndarray
    damping: np.ndarray
    fade: np.ndarray
    rolls: bool
    bearings: dict[str, tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]
    locked: bool

    @classmethod
    def of(cls, task: Task) -> "Laws":
        bound, effects, wheels = task.kernel, task.effects, task.kernel.wheels
        given = effects.constants(effects.equipped(task.vehicle))

        def per_wheel(name: str, width: tuple[int, ...] = ()) -> np.ndarray:
            return np.broadcast_to(np.asarray(given.get(name, 0.0), float), (wheels, *width))

        grip = effects.grip(bound.vehicle)
        friction = per_wheel("ground_friction", (2,)) if grip is None else grip.sliding
        bearings = {}
        for name in ("axle", "roller"):
            sticks = effects.bearings(bound).get(name)
            sliding = per_wheel(f"{name}_torque") if sticks is None else sticks.sliding
            holding = sliding if sticks is None else sticks.holding
            damping, fade = per_wheel(f"{name}_damping"), per_wheel(f"{name}_fade_speed") ** 2
            if sliding.any() or damping.any():
                bearings[name] = sliding, holding, damping, fade
        return cls(
            sliding=friction, static=friction if grip is None else grip.static,
            loads=per_wheel("contact_load") if grip is None else grip.loads,
            damping=per_wheel("ground_damping", (2,)),
            fade=friction.prod(axis=1) * per_wheel("ground_fade_speed") ** 2, rolls=not effects.slips,
            bearings=bearings, locked=bound.roller_model == "locked",
        )  # fmt: skip


@dataclass
class Place:
    """Where the elements of a kind stand in the list: from `start` on, of this shape; their rows of G from `row` on,
    `width` each."""

    name: str
    start: int
    shape: tuple[int, ...]
    width: int
    row: int

    @property
    def elements(self) -> slice:
        return slice(self.start, self.start + int(np.prod(self.shape)))

    @property
    def rows(self) -> slice:
        return slice(self.row, self.row + int(np.prod(self.shape)) * self.width)


class SteppedInTime(PythonRun):
    """One simulation with a fixed step."""

    def __init__(self, task: Task, accuracy: float):
        _refuse(task)
        super().__init__(task, accuracy)
        self.mechanics, self.laws = Mechanics(task), Laws.of(task)
        self.vector = self.acting.state_vector
        self.joint = joint_angle(self.kernel.rollers_per_wheel)
        self.length = STEP * accuracy
        self.bytes_per_row = NUMBER * 3 * (self.vector.size + self.mechanics.size)
        self.w = self._speeds_at_start()
        self._lay_out()
        names = [quantity.name for quantity in self.vector.quantities if quantity.account]
        self.accounts = {name: np.zeros(self.vector.shapes[name]) for name in names}

    def _speeds_at_start(self) -> np.ndarray:
        state, bound, count = self.state, self.mechanics.geometry, self.mechanics.wheels
        rates, _ = bound.wheel_rates(state.nu, state.chi)
        axial = np.zeros((count, self.mechanics.rollers))
        if self.kernel.roller_model == "free":
            axial[:] = by_place(state.axial, state.contact)
        elif self.kernel.roller_model == "locked":
            axial[:, 1:] = bound.axial_speeds(state.nu, state.chi, np.zeros((count, self.mechanics.rollers - 1)))
        if not self.kernel.slips:
            axial[:, 0] = bound.contact_axial(state.nu, state.chi)
        return np.concatenate([state.nu, rates if state.rates is None else state.rates, axial.ravel()])

    def _lay_out(self) -> None:
        """The list of elements: contacts, axles and rollers, of each kind all or none."""
        count, laws, self.places = self.mechanics.wheels, self.laws, []
        start = row = 0
        kinds = [("contact", (count,), 2), ("axle", (count,), 1), ("roller", (count, self.mechanics.rollers), 1)]
        for name, shape, width in kinds:
            if name == "contact" or name in laws.bearings or (name == "roller" and laws.locked):
                self.places.append(Place(name, start, shape, width, row))
                start, row = self.places[-1].elements.stop, self.places[-1].rows.stop
        elements = [np.arange(place.elements.start, place.elements.stop) for place in self.places]
        widths = [place.width for place in self.places]
        self.of = np.concatenate([np.repeat(own, width) for own, width in zip(elements, widths, strict=True)])
        self.rests, self.held = np.zeros(start, bool), np.zeros(row)
        for place, rows in zip(self.places, self._rows_of_places(self.state.chi), strict=True):
            speeds = np.abs(rows @ self.w).reshape(len(rows), -1).max(axis=1)
            self.rests[place.elements] = speeds <= AT_REST * np.abs(self.w).max(initial=1e-300)
        self._rest_without_mass(np.ones(self.mechanics.wheels, bool))

    def _rest_without_mass(self, wheels: np.ndarray) -> None:
        """Rollers without inertia stand on their disks before they touch the ground: those of `wheels` (N,) bool."""
        if not self.mechanics.has_mass:
            for place in self.places:
                if place.name == "roller":
                    self.rests[place.elements] |= wheels

    def _rows_of_places(self, chi: np.ndarray) -> list[np.ndarray]:
        """(elements, rows of each, W) of each kind in the list."""
        found = dict(zip(("contact", "axle", "roller"), self.mechanics.rows(chi), strict=True))
        return [found[place.name].reshape(-1, place.width, self.mechanics.size) for place in self.places]

    # One step

    def _elements(self, chi: np.ndarray) -> Elements:
        made = [
            (self._contacts if place.name == "contact" else self._bearings)(place, rows, self.rests[place.elements])
            for place, rows in zip(self.places, self._rows_of_places(chi), strict=True)
        ]
        rows, *numbers = (np.concatenate(parts) for parts in zip(*made, strict=True))
        return Elements(rows, self.of, *numbers)

    def _contacts(self, place: Place, rows: np.ndarray, rests: np.ndarray) -> tuple[np.ndarray, ...]:
        """Rows, damping, bound, fade and which are rigid, of contacts; coefficients of friction are in the rows."""
        laws = self.laws
        friction = np.where(rests[:, None], laws.static, laws.sliding)
        has_friction = (laws.loads > 0) & friction.any(axis=1)
        rows = rows * np.where(has_friction[:, None], friction, 1.0)[..., None]
        bound = np.where(has_friction, laws.loads, 0.0)
        rigid = np.full(len(rows), laws.rolls)
        return rows.reshape(-1, rows.shape[-1]), laws.damping.ravel(), bound, laws.fade, rigid

    def _bearings(self, place: Place, rows: np.ndarray, rests: np.ndarray) -> tuple[np.ndarray, ...]:
        """The same of axles, or of rollers."""
        rigid = np.zeros(place.shape, bool)
        if place.name == "roller" and self.laws.locked:
            rigid[:, 1:] = True
        none = (np.zeros(self.mechanics.wheels),) * 4
        each = rigid.size // self.mechanics.wheels
        sliding, holding, damping, fade = (np.repeat(own, each) for own in self.laws.bearings.get(place.name, none))
        return rows[:, 0], damping, np.where(rests, holding, sliding), fade, rigid.ravel()

    def _advance(self, h: float) -> None:
        mechanics, (nu, rates, _) = self.mechanics, self.mechanics.split(self.w)
        chi = self.state.chi + h / 2 * rates
        heading = self.state.pose[2] + h / 2 * self.kernel.pose_rates(nu, self.state.pose[2])[2]
        drives = {name: signal.at(h / 2) for name, signal in self.acting.signals.items()}
        free = self.w + h * mechanics.accelerations(self.w, chi, heading, drives)
        elements = self._elements(chi)
        found = Step(mechanics.mass, free, h, elements).solved(self.held)
        middle = (self.w + found.speeds) / 2
        self._account(elements.rows @ middle * found.impulses, middle, drives, h)
        self.w, self.held, self.rests, self.h = found.speeds, found.held, found.rests, h
        self._move(h, middle)

    def _move(self, h: float, middle: np.ndarray) -> None:
        """Places by the new speeds, the pose by those in the middle."""
        nu, rates, _ = self.mechanics.split(self.w)
        pose = self.state.pose
        half = pose + h / 2 * self.kernel.pose_rates(nu, pose[2])
        pose = pose + h * self.kernel.pose_rates(middle[:3], half[2])
        self.state = replace(self.state, nu=nu, chi=self.state.chi + h * rates, pose=pose)

    def _account(self, work: np.ndarray, middle: np.ndarray, drives: dict[str, np.ndarray], h: float) -> None:
        """Energy that elements have taken, and the work of drives: exact for the impulses of a step."""
        names = {"contact": "ground_loss", "axle": "axle_loss", "roller": "roller_loss"}
        for place in self.places:
            if names[place.name] in self.accounts:
                account = self.accounts[names[place.name]]
                of_wheels = work[place.rows].reshape(self.mechanics.wheels, -1).sum(axis=1)
                account -= of_wheels if account.ndim else of_wheels.sum()
        if "drive_work" in self.accounts:
            nu, rates, _ = self.mechanics.split(middle)
            known = drives | {"nu": nu, "rates": rates}
            self.accounts["drive_work"] += h * call_named(self.mechanics.moving, "slip_drive_power", known)

    def _pass_joints(self) -> None:
        """Hand contacts over where wheels are beyond their joints."""
        directions = np.where(np.abs(self.state.chi) > self.joint, np.sign(self.state.chi), 0).astype(int)
        if not directions.any():
            return
        count, n = self.mechanics.rollers, self.kernel.rollers_per_wheel
        _, _, axial = self.mechanics.split(self.w)  # a view
        for wheel in np.flatnonzero(directions):
            if count > 1:
                axial[wheel] = np.roll(axial[wheel], directions[wheel])
                self._roll(wheel, directions[wheel])
        self._rest_without_mass(directions != 0)
        self.state = replace(
            self.state, chi=self.state.chi - 2 * self.joint * directions, contact=(self.state.contact - directions) % n
        )
        self.rows.switch(directions)
        self._add_row()

    def _roll(self, wheel: int, direction: int) -> None:
        """What is known of a wheel's rollers goes with them."""
        for place in self.places:
            if place.name == "roller":
                for own in (self.held[place.rows], self.rests[place.elements]):
                    rollers = own.reshape(place.shape)
                    rollers[wheel] = np.roll(rollers[wheel], direction)

    # The run

    def simulate(self) -> None:
        task, acting = self.task, self.acting
        self._ask()
        self._add_row()
        while self.elapsed < task.duration:
            self._ask()
            following = (np.floor(self.elapsed / self.length + 1e-9) + 1) * self.length
            end = min(task.duration, acting.next_time(), following)
            try:
                with np.errstate(all="ignore"):
                    self._advance(end - self.elapsed)
            except (NotSolvedError, np.linalg.LinAlgError) as error:
                self._stop(str(error))
            if not np.isfinite(self.w).all():
                self._stop("the speeds leave the number range")
            self.elapsed = end
            self.rows.step_rows.append(len(self.rows.y) - 1)
            self._add_row()
            self.rows.dense.append(np.array(self.rows.y[-2:]))
            self._pass_joints()
            self._look_up()

    def _ask(self) -> None:
        """What the effects give from now on."""
        acting = self.acting
        while self.elapsed >= acting.next_time():
            acting.pass_time(self.elapsed, self._at_end())
        y = self._y()
        for _ in range(3 * self.mechanics.wheels):
            guards = Guards(acting.begin_phase(self.elapsed), len(y))
            passed = guards.beyond(0.0, y)
            if not passed.any():
                break
            acting.pass_guards(passed)

    def _look_up(self) -> None:
        if reason := self._interruption():
            self._stop(reason)
        if self.bytes_held > self.task.memory:
            self._stop("more rows than memory should hold; ask for a lower accuracy, which makes the steps longer")
        self._show()

    # Rows

    def _at_end(self) -> State:
        _, rates, axial = self.mechanics.split(self.w)
        state = replace(self.state, rates=rates.copy() if self.kernel.slips else None)
        if self.kernel.roller_model == "free":
            state = replace(state, axial=by_roller(axial, state.contact))
        return state

    def _y(self) -> np.ndarray:
        y, state = np.zeros(self.vector.size), self._at_end()
        plain = {"nu": state.nu, "chi": state.chi, "pose": state.pose}
        self.vector.put(y, plain | self.accounts | self.task.effects.initial(self.kernel, state))
        return y

    def _add_row(self) -> None:
        axial = self.mechanics.split(self.w)[2][:, 1:].copy() if self.kernel.has_spins else None
        self.rows.add(self.elapsed, self._y(), self.state.contact, axial, self._drive())

    def _drive(self) -> np.ndarray:
        """(D, N) what rows keep: of drives, and of Coulomb's friction."""
        count, found = self.mechanics.wheels, {}
        h = getattr(self, "h", 1.0)
        for place in self.places:
            taken = self.held[place.rows].reshape(*place.shape, place.width) / h
            if place.name == "contact":
                slip = self.mechanics.rows(self.state.chi)[0] @ self.w
                found["sticks"] = self.rests[place.elements].astype(float)
                found["slip_heading"] = np.arctan2(slip[:, 1], slip[:, 0])
            elif place.name == "axle":
                found["bearing_torque"] = taken[:, 0]
            else:
                found["contact_bearing"] = taken[:, 0, 0]
                kappa = 2 * np.pi * np.arange(1, place.shape[1]) / max(place.shape[1], 1)
                found["bearing_cos"] = taken[:, 1:, 0] @ np.cos(kappa)
                found["bearing_sin"] = taken[:, 1:, 0] @ np.sin(kappa)
        found |= {name: signal.at(0.0) for name, signal in self.acting.signals.items()}
        return np.array([np.broadcast_to(found.get(n, 0.0), count) for n in self.acting.drives]).reshape(-1, count)

    def figures(self) -> tuple[int, int, int, float]:
        steps = self.rows.step_count
        return steps, steps, 1 + self.rows.switch_count, 0.0


def _refuse(task: Task) -> None:
    """Raise InvalidValueError where a run of this engine makes no sense."""
    if not task.effects.slips and task.switching != "impact" and task.kernel.roller_model != "massless":
        steps = "must be 'impact' where bearings stick in the Python engine, which steps in time"
        bound = f"{steps}; or choose engine='compiled'"
        raise InvalidValueError("switching", task.switching, bound)
    steps = task.duration / (STEP * task.accuracy)
    if steps > MOST_STEPS:
        least = task.duration / STEP / MOST_STEPS
        bound = f"must be at least {least:.2g} for friction in the Python engine, of first order; or engine='compiled'"
        raise InvalidValueError("accuracy", task.accuracy, bound)
