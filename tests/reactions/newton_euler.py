"""Newton's and Euler's equations of every body in space: platform, hubs, motors' rotors, rollers.

Nothing of the derivation is used, nor Lagrange's equations. A body has a mass, a tensor in its own axes and a
placement as a function of the coordinates q = (x, y, theta, chi_i, phi_ij). Along q + q' t + q'' t^2/2 the
placement is a power series in t, so that the acceleration of its centre and the rate of its angular momentum
are coefficients, exact to the working precision. Unknown together: every q'', every force and torque between
two bodies that touch, and the ground's force at every contact. Equations: six for each body, and no slip.
"""

from dataclasses import dataclass, field

from flint import arb, arb_mat, arb_series
from oracle.balls import coefficient, exact, working_precision
from oracle.bodies import Solid, apply, kappa, product, turn
from oracle.kinematics import UP, add, cross, dot, sub, times
from oracle.lagrange import Speeds

LENGTH = 3  # of the series: value, rate, acceleration


@dataclass(frozen=True)
class Machine:
    """A vehicle as bodies. Numbers in SI; floats are taken exactly.

    platform_mass, platform_centre (x, y, height above the ground), platform_tensor about that centre (3 x 3)
    places (N pairs), axle_angles (N)      wheel centres and axle directions in the platform's axes
    hub, roller                            Solids; a hub's axis is the axle
    rotor, gear                            one motor a wheel on the axle at rotor_distance from the wheel's centre
    """

    platform_mass: object
    platform_centre: tuple
    platform_tensor: tuple
    places: tuple
    axle_angles: tuple
    wheel_radius: object
    roller_axis_radius: object
    rollers_per_wheel: int
    hub: Solid
    roller: Solid
    rotor: Solid | None = None
    gear: object = 1
    rotor_distance: object = 0

    @property
    def wheels(self):
        return len(self.places)


@dataclass(frozen=True)
class Body:
    """name, mass, tensor in its own axes, centre and rotation (series or balls)."""

    name: tuple
    mass: object
    tensor: list
    centre: tuple
    rotation: list


@dataclass
class Acting:
    """Forces that are given. gravity (3) in the fixed axes; torques that the platform puts on the wheels (N), and
    the disks on the rollers (N, n), about their axes.

    ground(i, along, across): the ground's force on wheel i along its axle and along its rolling direction, from the
    slip velocities along these; None where wheels roll. A massless roller never slips along its axle.
    guide: whether something holds the platform level and up, for vehicles that their wheels do not support.
    """

    gravity: tuple = (0, 0, "-9.80665")
    wheel_torques: list | None = None
    roller_torques: list | None = None
    ground: object = None
    guide: bool = False


@dataclass
class Found:
    """second: q'' as Speeds; contact: (axle, rolling, load) of every wheel; reactions between the bodies."""

    second: Speeds
    contact: list
    between: dict = field(default_factory=dict)


def diagonal(solid, axis):
    return [
        [exact(solid.axial if i == axis else solid.transverse) if i == j else arb(0) for j in range(3)]
        for i in range(3)
    ]


def bodies(machine, q):
    """Every body at the coordinates q, by name."""
    found = {}

    def put(name, mass, tensor, centre, rotation):
        found[name] = Body(name, exact(mass), tensor, tuple(centre), rotation)

    heading = turn(2, q.theta)
    base = (q.x, q.y, q.x * 0)
    centre = apply(heading, [exact(c) for c in machine.platform_centre])
    tensor = [[exact(v) for v in row] for row in machine.platform_tensor]
    put(("platform",), machine.platform_mass, tensor, add(base, centre), heading)
    n = machine.rollers_per_wheel
    for i in range(machine.wheels):
        steered = turn(2, q.theta + exact(machine.axle_angles[i]))
        place = [*(exact(c) for c in machine.places[i]), exact(machine.wheel_radius)]
        middle = add(base, apply(heading, place))
        put(("hub", i), machine.hub.mass, diagonal(machine.hub, 0), middle, product(steered, turn(0, q.chi[i])))
        if machine.rotor is not None:
            beside = add(middle, apply(steered, [exact(machine.rotor_distance), arb(0), arb(0)]))
            turned = product(steered, turn(0, exact(machine.gear) * q.chi[i]))
            put(("rotor", i), machine.rotor.mass, diagonal(machine.rotor, 0), beside, turned)
        for j in range(n):
            carried = product(steered, turn(0, q.chi[i] + kappa(n, j)))
            out = apply(carried, [arb(0), arb(0), -exact(machine.roller_axis_radius)])
            rotation = product(carried, turn(1, q.phi[i][j]))
            put(("roller", i, j), machine.roller.mass, diagonal(machine.roller, 1), add(middle, out), rotation)
    return found


def along(machine, q, dq, ddq):
    """q + q' t + q'' t^2/2."""
    moved = [
        arb_series([place, rate, second / 2], LENGTH)
        for place, rate, second in zip(q.flat(), dq.flat(), ddq.flat(), strict=True)
    ]
    return Speeds.shaped(machine.wheels, machine.rollers_per_wheel, moved)


def derivative(values):
    return [v.derivative() if isinstance(v, arb_series) else arb(0) for v in values]


def transposed(matrix):
    return [list(column) for column in zip(*matrix, strict=True)]


def angular_velocity(rotation):
    """omega as series, from the skew matrix (dA/dt) A^T."""
    skew = product([derivative(row) for row in rotation], transposed(rotation))
    return (skew[2][1], skew[0][2], skew[1][0])


def contact_velocity(machine, found, i):
    """Velocity of the point of the contact roller that is at the contact, as a series: the contact moves on."""
    contact = sub(found["hub", i].centre, times(exact(machine.wheel_radius), UP))
    roller = found["roller", i, 0]
    swept = cross(angular_velocity(roller.rotation), sub(contact, roller.centre))
    return add(tuple(derivative(roller.centre)), swept)


def kinetics(body):
    """(m a, d/dt of the angular momentum about its centre)."""
    force = [2 * coefficient(c, 2) * body.mass for c in body.centre]
    tensor = product(product(body.rotation, body.tensor), transposed(body.rotation))
    momentum = apply(tensor, angular_velocity(body.rotation))
    return force, [coefficient(h, 1) for h in momentum]


def zero(machine):
    n = machine.rollers_per_wheel
    return Speeds.shaped(machine.wheels, n, [arb(0)] * (3 + machine.wheels * (n + 1)))


def unit(machine, k):
    flat = zero(machine).flat()
    flat[k] = arb(1)
    return Speeds.shaped(machine.wheels, machine.rollers_per_wheel, flat)


@working_precision
def position(machine, theta, chi):
    """q at a heading and wheel angles; S over the origin, rollers' angles 0."""
    q = zero(machine)
    q.theta, q.chi = exact(theta), [exact(c) for c in chi]
    return q


@working_precision
def rolling(machine, q, platform, spins=None):
    """q' from (x', y', theta') and the free rollers' spins (N, n-1): wheels and contact rollers by no slip."""
    dq = zero(machine)
    dq.x, dq.y, dq.theta = (exact(v) for v in platform)
    for i in range(machine.wheels):
        for j in range(1, machine.rollers_per_wheel):
            dq.phi[i][j] = exact(spins[i][j - 1]) if spins is not None else arb(0)

    def slip(speeds, i):
        velocity = contact_velocity(machine, bodies(machine, along(machine, q, speeds, zero(machine))), i)
        return [coefficient(v, 0) for v in velocity[:2]]

    for i in range(machine.wheels):
        turning, spinning = zero(machine), zero(machine)
        turning.chi[i], spinning.phi[i][0] = arb(1), arb(1)
        a, b, c = slip(turning, i), slip(spinning, i), slip(dq, i)
        solved = arb_mat([[a[0], b[0]], [a[1], b[1]]]).solve(arb_mat([[-c[0]], [-c[1]]]))
        dq.chi[i], dq.phi[i][0] = solved[0, 0], solved[1, 0]
    return dq


class Equations:
    """The linear system; columns are named unknowns, rows six for each body and two for each contact."""

    def __init__(self, machine, q, dq, acting, model, loads):
        self.machine, self.columns, self.right, self.rows = machine, {}, [], {}
        self.acting, self.model, self.dq = acting, model, dq
        self.bodies = bodies(machine, along(machine, q, dq, zero(machine)))
        self.now = bodies(machine, q)
        self.accelerations(q, dq, acting)
        n = machine.rollers_per_wheel
        for i in range(machine.wheels):
            middle = self.now["hub", i].centre
            axle, tangent = self.axes(i)
            torque = acting.wheel_torques[i] if acting.wheel_torques else 0
            self.joint(("hub", i), ("platform",), middle, (tangent, UP), axle, torque)
            if machine.rotor is not None:
                self.geared(i, axle, tangent)
            for j in range(n):
                axis = tuple(row[1] for row in self.now["roller", i, j].rotation)
                across = cross(axis, axle)
                torque = acting.roller_torques[i][j] if acting.roller_torques else 0
                held = (axle, across) if j == 0 or model == "free" else (axle, across, axis)
                self.joint(("roller", i, j), ("hub", i), self.now["roller", i, j].centre, held, axis, torque)
                if j > 0 and model != "free":
                    del self.columns["second", 3 + machine.wheels + i * n + j]
            self.ground(i, axle, tangent, loads.get(i))
        if acting.guide:
            for name, torque in (("x", (1, 0, 0)), ("y", (0, 1, 0))):
                self.wrench(("guide", name), ("platform",), 1, None, torque=tuple(map(exact, torque)))
            up = tuple(map(exact, UP))
            self.wrench(("guide", "up"), ("platform",), 1, self.now["platform",].centre, force=up)

    def axes(self, i):
        axle = tuple(row[0] for row in self.now["hub", i].rotation)
        return axle, cross(UP, axle)

    def row(self, key):
        if key not in self.rows:
            self.rows[key] = len(self.rows)
            self.right.append(arb(0))
        return self.rows[key]

    def accelerations(self, q, dq, acting):
        """m a - m g and dH/dt, and the rate of the contact velocities: at q'' = 0, and per unit of each q''."""
        gravity = [exact(g) for g in acting.gravity]
        still = self.left(q, dq, zero(self.machine))
        for key, value in still.items():
            body, kind, k = key
            weight = self.now[body].mass * gravity[k] if kind == "force" else arb(0)
            self.row(key)
            self.right[self.rows[key]] = weight - value
        for m in range(len(q.flat())):
            moved = self.left(q, dq, unit(self.machine, m))
            self.columns["second", m] = {key: moved[key] - still[key] for key in moved}

    def left(self, q, dq, ddq):
        found = bodies(self.machine, along(self.machine, q, dq, ddq))
        values = {}
        for name, body in found.items():
            for kind, vector in zip(("force", "moment"), kinetics(body), strict=True):
                values |= {(name, kind, k): vector[k] for k in range(3)}
        for i in range(self.machine.wheels):
            velocity = contact_velocity(self.machine, found, i)
            if self.acting.ground is None:
                values |= {(("contact", i), "slip", k): coefficient(velocity[k], 1) for k in (0, 1)}
            elif self.model == "massless":  # its slip along the axle, which turns with the platform, stays zero
                axle, tangent = self.axes(i)
                rate, now = ([coefficient(v, k) for v in velocity] for k in (1, 0))
                values[("contact", i), "slip", 0] = dot(rate, axle) + self.dq.theta * dot(now, tangent)
        return values

    def wrench(self, unknown, body, sign, point, force=None, torque=None):
        """An unknown's force at a point, or torque, on the right of a body's equations."""
        column = self.columns.setdefault(unknown, {})
        moment = torque if force is None else cross(sub(point, self.now[body].centre), force)
        for k in range(3):
            if force is not None:
                column[body, "force", k] = column.get((body, "force", k), arb(0)) - sign * force[k]
            column[body, "moment", k] = column.get((body, "moment", k), arb(0)) - sign * moment[k]

    def joint(self, body, base, point, held, axis, torque):
        """A force in any direction and torques about the held axes; a given torque about the free one."""
        for k in range(3):
            force = tuple(exact(int(k == m)) for m in range(3))
            self.wrench(("force", body, k), body, 1, point, force=force)
            self.wrench(("force", body, k), base, -1, point, force=force)
        for k, about in enumerate(held):
            self.wrench(("torque", body, k), body, 1, point, torque=about)
            self.wrench(("torque", body, k), base, -1, point, torque=about)
        for k in range(3):
            self.right[self.rows[body, "moment", k]] += exact(torque) * axis[k]
            self.right[self.rows[base, "moment", k]] -= exact(torque) * axis[k]

    def geared(self, i, axle, tangent):
        """A rotor in bearings on the platform; the gear turns the wheel with -gear times what turns the rotor."""
        rotor, gear = ("rotor", i), exact(self.machine.gear)
        self.joint(rotor, ("platform",), self.now[rotor].centre, (tangent, UP), axle, 0)
        point = self.now[rotor].centre
        for body, share in ((rotor, arb(1)), (("hub", i), -gear), (("platform",), gear - 1)):
            self.wrench(("gear", i), body, share, point, torque=axle)

    def ground(self, i, axle, tangent, load):
        roller = ("roller", i, 0)
        contact = sub(self.now["hub", i].centre, times(exact(self.machine.wheel_radius), UP))
        if self.acting.ground is None or self.model == "massless":
            self.wrench(("axle", i), roller, 1, contact, force=axle)
        if self.acting.ground is None:
            self.wrench(("rolling", i), roller, 1, contact, force=tangent)
        else:
            self.slipping(i, roller, contact, axle, tangent)
        self.wrench(("load", i), roller, 1, contact, force=UP)
        if load is not None:
            for key, value in self.columns.pop(("load", i)).items():
                self.right[self.rows[key]] -= value * exact(load)

    def slipping(self, i, roller, contact, axle, tangent):
        """The ground's given force, at the slip that the contact has."""
        velocity = [coefficient(v, 0) for v in contact_velocity(self.machine, self.bodies, i)]
        along, across = self.acting.ground(i, dot(velocity, axle), dot(velocity, tangent))
        force = times(across, tangent) if self.model == "massless" else add(times(along, axle), times(across, tangent))
        moment = cross(sub(contact, self.now[roller].centre), force)
        for k in range(3):
            self.right[self.rows[roller, "force", k]] += force[k]
            self.right[self.rows[roller, "moment", k]] += moment[k]

    def solve(self):
        names = list(self.columns)
        assert len(names) == len(self.rows), f"{len(names)} unknowns, {len(self.rows)} equations"
        order = list(self.rows)
        matrix = arb_mat([[self.columns[name].get(key, arb(0)) for name in names] for key in order])
        solved = matrix.solve(arb_mat([[value] for value in self.right]))
        return {name: solved[k, 0] for k, name in enumerate(names)}


@working_precision
def solve(machine, q, dq, acting, *, model="free", loads=None):
    """Found of a state that rolls. model "massless": "locked" with rollers whose axial inertia is 0.

    loads {wheel: load}: loads that are given instead of sought, N - 3 of them.
    """
    loads = loads or {}
    values = Equations(machine, q, dq, acting, model, loads).solve()
    flat = [values.get(("second", k), arb(0)) for k in range(len(q.flat()))]
    second = Speeds.shaped(machine.wheels, machine.rollers_per_wheel, flat)
    contact = [
        (values.get(("axle", i)), values.get(("rolling", i)), values.get(("load", i), loads.get(i)))
        for i in range(machine.wheels)
    ]
    return Found(second, contact, {k: v for k, v in values.items() if k[0] in ("force", "torque")})


def total_mass(machine):
    mass = exact(machine.platform_mass)
    for solid, count in ((machine.hub, 1), (machine.roller, machine.rollers_per_wheel), (machine.rotor, 1)):
        if solid is not None:
            mass += machine.wheels * count * exact(solid.mass)
    return mass


@working_precision
def centre_of_mass(machine):
    """(x, y, height) of the whole in the platform's axes."""
    found = bodies(machine, position(machine, 0, [0] * machine.wheels)).values()
    whole = total_mass(machine)
    return tuple(sum((b.mass * b.centre[k] for b in found), arb(0)) / whole for k in range(3))


@working_precision
def energy(machine, q, dq):
    """Kinetic energy of all bodies."""
    twice = arb(0)
    for body in bodies(machine, along(machine, q, dq, zero(machine))).values():
        speed = [coefficient(c, 1) for c in body.centre]
        omega = [coefficient(w, 0) for w in angular_velocity(body.rotation)]
        turned = [[coefficient(v, 0) for v in row] for row in body.rotation]
        own = apply(transposed(turned), omega)
        twice += body.mass * dot(speed, speed) + dot(own, apply(body.tensor, own))
    return twice / 2
