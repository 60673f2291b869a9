"""Lagrange's equations with multipliers, d/dt dT/dq' - dT/dq = Q + A^T lambda, with A q'' + A' q' = 0.

`accelerations` writes the equations out and eliminates the free rollers (their block is diagonal and no constraint
touches them); it serves 369 coordinates in milliseconds. tests/test_oracle.py holds it to Lagrange's equations as they
stand: the energy is differentiated numerically, and what is left does no work on any admissible motion.
"""

from dataclasses import dataclass, field

from flint import arb, arb_mat, arb_series

from .balls import coefficient, exact, line, square, working_precision
from .kinematics import constraint_rows, contact_speeds, platform_speeds

MODELS = ("massless", "locked", "free")


@dataclass
class Speeds:
    """q', or any covector like generalised forces: x, y, theta, chi[i], phi[i][j], j = 0 the contact
    roller.
    """

    x: object
    y: object
    theta: object
    chi: list
    phi: list

    def flat(self):
        return [self.x, self.y, self.theta, *self.chi, *(p for wheel in self.phi for p in wheel)]

    def map(self, function):
        return Speeds(
            function(self.x),
            function(self.y),
            function(self.theta),
            [function(c) for c in self.chi],
            [[function(p) for p in wheel] for wheel in self.phi],
        )

    @classmethod
    def shaped(cls, wheels, rollers, values):
        """From the flat order of `flat`."""
        values = list(values)
        spins = values[3 + wheels :]
        phi = [spins[i * rollers : (i + 1) * rollers] for i in range(wheels)]
        return cls(*values[:3], values[3 : 3 + wheels], phi)

    @classmethod
    def unflat(cls, vehicle, values):
        return cls.shaped(vehicle.wheels, vehicle.rollers_per_wheel, values)

    @classmethod
    def zero(cls, vehicle):
        count, n = vehicle.wheels, vehicle.rollers_per_wheel
        return cls.unflat(vehicle, [arb(0)] * (3 + count * (n + 1)))


@dataclass
class Accelerations:
    """What a state does next. nu_dot (3); spins_dot (N lists of n-1); second derivatives; multipliers."""

    nu_dot: list
    spins_dot: list
    second: Speeds
    multipliers: list = field(default_factory=list)


@working_precision
def speeds(vehicle, nu, chi, spins=None, *, model, theta=0):
    """q' of a state: constraints solved for the wheels and contact rollers. spins: N lists of n-1, or None
    = 0.
    """
    nu, chi, theta = [exact(v) for v in nu], [exact(c) for c in chi], exact(theta)
    platform = platform_speeds(vehicle, nu, theta)
    n = vehicle.rollers_per_wheel
    disks, rollers = [], []
    for i, angle in enumerate(chi):
        disk, contact = contact_speeds(vehicle, i, theta, angle, platform)
        free = [arb(0)] * (n - 1) if spins is None or model != "free" else [exact(s) for s in spins[i]]
        disks.append(disk)
        rollers.append([arb(0)] * n if model == "massless" else [contact, *free])
    return Speeds(*platform, disks, rollers)


def offset_in_fixed_axes(vehicle, theta):
    dx, dy = (exact(c) for c in vehicle.offset)
    sin, cos = theta.sin(), theta.cos()
    return cos * dx - sin * dy, sin * dx + cos * dy


def inertia_of_roller(vehicle, model):
    return arb(0) if model == "massless" else vehicle.number("roller_inertia")


@working_precision
def kinetic_energy(vehicle, theta, chi, dq, *, model):
    """(3.2), term by term in the full coordinates."""
    theta = exact(theta)
    mass, roller = vehicle.number("mass"), inertia_of_roller(vehicle, model)
    dx, dy = offset_in_fixed_axes(vehicle, theta)
    twice = mass * (square(dq.x) + square(dq.y)) + vehicle.number("yaw_inertia") * square(dq.theta)
    twice += 2 * mass * dq.theta * (dx * dq.y - dy * dq.x)
    for i in range(vehicle.wheels):
        twice += vehicle.number("wheel_inertia") * square(dq.chi[i])
        for j in range(vehicle.rollers_per_wheel):
            tilt = (vehicle.kappa(j) + exact(chi[i])).sin()
            twice += roller * (square(dq.phi[i][j]) + 2 * dq.theta * tilt * dq.phi[i][j])
    return twice / 2


class System:
    """Small linear system left when the free rollers are eliminated; entries are balls or series in time.

    Unknowns: x'', y'', theta'', chi''_i, phi''_i1 (massive models), multipliers.
    """

    def __init__(self, vehicle, theta, chi, dq, theta_ahead, chi_ahead, model, forces):
        self.vehicle, self.model = vehicle, model
        self.theta, self.chi, self.dq = theta, chi, dq
        self.forces = forces or Speeds.zero(vehicle)
        self.rows, self.right = {}, {}
        self.wheels = range(vehicle.wheels)
        self.massive = model != "massless"
        self.roller = inertia_of_roller(vehicle, model)
        self.platform()
        for i in self.wheels:
            self.disk(i)
            if self.massive:
                self.contact_roller(i)
            if model == "free":
                self.free_rollers(i)
            self.constraint(i, theta_ahead, chi_ahead[i])

    def put(self, row, column, value):
        entries = self.rows.setdefault(row, {})
        entries[column] = entries[column] + value if column in entries else value

    def move_right(self, row, value):
        self.right[row] = self.right[row] + value if row in self.right else value

    def platform(self):
        mass, dq = self.vehicle.number("mass"), self.dq
        dx, dy = offset_in_fixed_axes(self.vehicle, self.theta)
        self.put("x", "x", mass)
        self.put("y", "y", mass)
        self.put("theta", "theta", self.vehicle.number("yaw_inertia"))
        for a, b, value in (("x", "theta", -mass * dy), ("y", "theta", mass * dx)):
            self.put(a, b, value)
            self.put(b, a, value)
        turn = dq.theta * dq.theta
        self.move_right("x", mass * turn * dx + self.forces.x)
        self.move_right("y", mass * turn * dy + self.forces.y)
        self.move_right("theta", self.forces.theta)

    def disk(self, i):
        self.put(("chi", i), ("chi", i), self.vehicle.number("wheel_inertia"))
        self.move_right(("chi", i), self.forces.chi[i])

    def contact_roller(self, i):
        """theta: B (sin phi'' + cos chi' phi');  chi: -B cos theta' phi';  phi: B (phi'' + sin theta'' +
        cos chi' theta').
        """
        sin, cos, dq, roller = self.chi[i].sin(), self.chi[i].cos(), self.dq, self.roller
        phi = dq.phi[i][0]
        row = ("phi", i)
        self.put(row, row, roller)
        self.put(row, "theta", roller * sin)
        self.put("theta", row, roller * sin)
        self.move_right(row, self.forces.phi[i][0] - roller * cos * dq.chi[i] * dq.theta)
        self.move_right("theta", -roller * cos * dq.chi[i] * phi)
        self.move_right(("chi", i), roller * cos * dq.theta * phi)

    def free_rollers(self, i):
        """phi'' = Q/B - sin theta'' - cos chi' theta' put into the equations of theta and chi."""
        dq, roller = self.dq, self.roller
        for j in range(1, self.vehicle.rollers_per_wheel):
            psi = self.chi[i] + self.vehicle.kappa(j)
            sin, cos, phi, force = psi.sin(), psi.cos(), dq.phi[i][j], self.forces.phi[i][j]
            self.put("theta", "theta", -roller * sin * sin)
            right = roller * sin * cos * dq.chi[i] * dq.theta - sin * force
            self.move_right("theta", right - roller * cos * dq.chi[i] * phi)
            self.move_right(("chi", i), roller * cos * dq.theta * phi)

    def constraint(self, i, theta, chi):
        dq = self.dq
        rate = {"x": dq.x, "y": dq.y, "theta": dq.theta, "chi": dq.chi[i], "phi": dq.phi[i][0]}
        for k, row in enumerate(constraint_rows(self.vehicle, i, theta, chi, self.model)):
            multiplier = ("multiplier", i, k)
            for name, value in row.items():
                key = (name, i) if name in ("chi", "phi") else name
                self.put(multiplier, key, value)
                self.put(key, multiplier, -value)
                if isinstance(value, arb_series):
                    self.move_right(multiplier, -value.derivative() * rate[name])

    def keys(self):
        names = ["x", "y", "theta", *(("chi", i) for i in self.wheels)]
        names += [("phi", i) for i in self.wheels] if self.massive else []
        return names + [key for key in self.rows if key[0] == "multiplier"]

    def matrix(self, keys):
        entry = lambda a, b: coefficient(self.rows[a].get(b, arb(0)), 0)  # noqa: E731
        return arb_mat([[entry(a, b) for b in keys] for a in keys])

    def free_acceleration(self, i, j, yaw):
        """phi''_ij of a free roller, given theta''."""
        if self.model != "free":
            return arb(0) * yaw
        psi = self.chi[i] + self.vehicle.kappa(j)
        bare = -psi.sin() * yaw - psi.cos() * self.dq.chi[i] * self.dq.theta
        return bare + self.forces.phi[i][j] / self.roller


def nu_rates(vehicle, theta, dq, second):
    """nu' from q': nu_1, nu_2 are the parts of v_S along the turning axes, over R; nu_3 = Lambda theta'."""
    sin, cos, scale = theta.sin(), theta.cos(), vehicle.number("platform_radius")
    along = cos * second.x + sin * second.y + dq.theta * (cos * dq.y - sin * dq.x)
    across = cos * second.y - sin * second.x - dq.theta * (cos * dq.x + sin * dq.y)
    return [along / scale, across / scale, vehicle.number("yaw_scale") * second.theta]


@working_precision
def accelerations(vehicle, nu, chi, spins=None, *, model="free", theta=0, forces=None):
    """Accelerations of a state that satisfies the constraints.

    nu (3), chi (N), spins (N, n-1) or None; theta turns the whole vehicle; forces is a Speeds of generalised
    forces.
    """
    theta, chi = exact(theta), [exact(c) for c in chi]
    dq = speeds(vehicle, nu, chi, spins, model=model, theta=theta)
    forces = forces.map(exact) if forces else None
    theta_ahead, chi_ahead = (line(theta, dq.theta), [line(c, rate) for c, rate in zip(chi, dq.chi, strict=True)])
    system = System(vehicle, theta, chi, dq, theta_ahead, chi_ahead, model, forces)
    keys = system.keys()
    right = arb_mat([[coefficient(system.right.get(key, arb(0)), 0)] for key in keys])
    solved = system.matrix(keys).solve(right)
    values = {key: solved[k, 0] for k, key in enumerate(keys)}
    yaw, n = values["theta"], vehicle.rollers_per_wheel
    phi = [
        [values.get(("phi", i), arb(0)), *(system.free_acceleration(i, j, yaw) for j in range(1, n))]
        for i in range(vehicle.wheels)
    ]
    second = Speeds(values["x"], values["y"], yaw, [values["chi", i] for i in range(vehicle.wheels)], phi)
    multipliers = [values[key] for key in keys if key[0] == "multiplier"]
    return Accelerations(nu_rates(vehicle, theta, dq, second), [w[1:] for w in phi], second, multipliers)


@working_precision
def mass_matrix(vehicle, theta, chi, *, model):
    """Mq of (3.2), all 3 + N (n + 1) coordinates, as rows of balls or series."""
    count, n = vehicle.wheels, vehicle.rollers_per_wheel
    size = 3 + count * (n + 1)
    rows = [[arb(0)] * size for _ in range(size)]
    mass, roller = vehicle.number("mass"), inertia_of_roller(vehicle, model)
    dx, dy = offset_in_fixed_axes(vehicle, theta)
    rows[0][0] = rows[1][1] = mass
    rows[2][2] = vehicle.number("yaw_inertia")
    rows[0][2] = rows[2][0] = -mass * dy
    rows[1][2] = rows[2][1] = mass * dx
    for i in range(count):
        rows[3 + i][3 + i] = vehicle.number("wheel_inertia")
        for j in range(n):
            k = 3 + count + i * n + j
            rows[k][k] = roller
            rows[2][k] = rows[k][2] = roller * (chi[i] + vehicle.kappa(j)).sin()
    return rows
