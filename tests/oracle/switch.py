"""Change of the contact roller, and the laws that give the speeds after it.

`impact_literal` is the projection as it is written, q'+ = V (V^T Mq V)^-1 V^T Mq q'-, with dense matrices.
`impact` solves the same problem as momentum balance, Mq (q'+ - q'-) = A^T mu, A q'+ = 0, without the free
rollers, each of which keeps its momentum about its own axis.
"""

from flint import arb, arb_mat

from .balls import exact, working_precision
from .kinematics import constraint_rows
from .lagrange import Speeds, inertia_of_roller, mass_matrix, offset_in_fixed_axes, speeds


@working_precision
def relabel(vehicle, chi, dq, moves):
    """Angles and speeds named by the new contact rollers. moves: {wheel: +1 or -1}, the joint that it
    reached.

    At +pi/n: chi - 2 pi/n, the roller that was j = n is now j = 1 and the old contact roller j = 2.
    """
    chi, phi = list(chi), [list(wheel) for wheel in dq.phi]
    for i, direction in moves.items():
        chi[i] = chi[i] - direction * 2 * arb.pi() / vehicle.rollers_per_wheel
        phi[i] = phi[i][-1:] + phi[i][:-1] if direction > 0 else phi[i][1:] + phi[i][:1]
    return chi, Speeds(dq.x, dq.y, dq.theta, list(dq.chi), phi)


def nu_of(vehicle, theta, dq):
    sin, cos, scale = theta.sin(), theta.cos(), vehicle.number("platform_radius")
    return [
        (cos * dq.x + sin * dq.y) / scale,
        (cos * dq.y - sin * dq.x) / scale,
        vehicle.number("yaw_scale") * dq.theta,
    ]


@working_precision
def smooth(vehicle, theta, chi, dq, *, model):
    """nu stays; contact rollers take the spin that the constraint demands; the rest keep theirs (locked:
    stand).
    """
    theta = exact(theta)
    return speeds(vehicle, nu_of(vehicle, theta, dq), chi, [w[1:] for w in dq.phi], model=model, theta=theta)


@working_precision
def nullspace(vehicle, theta, chi, *, model):
    """V: a basis of the speeds that the constraints admit, as columns."""
    count, n = vehicle.wheels, vehicle.rollers_per_wheel
    unit = lambda k: [int(k == m) for m in range(3)]  # noqa: E731
    columns = [speeds(vehicle, unit(k), chi, None, model=model, theta=theta).flat() for k in range(3)]
    if model == "free":
        for i in range(count):
            for j in range(1, n):
                column = [arb(0)] * (3 + count * (n + 1))
                column[3 + count + i * n + j] = arb(1)
                columns.append(column)
    return arb_mat(columns).transpose()


@working_precision
def impact_literal(vehicle, theta, chi, dq, *, model):
    """Projection of q'- on the admissible speeds in the metric Mq. dq is named by the new contact rollers."""
    theta, chi = exact(theta), [exact(c) for c in chi]
    basis = nullspace(vehicle, theta, chi, model=model)
    mass = arb_mat(mass_matrix(vehicle, theta, chi, model=model))
    before = arb_mat([[exact(v)] for v in dq.flat()])
    pull = basis.transpose() * mass
    after = basis * (pull * basis).solve(pull * before)
    return Speeds.unflat(vehicle, [after[k, 0] for k in range(after.nrows())])


@working_precision
def impact(vehicle, theta, chi, dq, *, model):
    """The same projection from the balance of momentum; fast for many rollers. Massless: nothing changes."""
    theta, chi, dq = exact(theta), [exact(c) for c in chi], dq.map(exact)
    balance = Balance(vehicle, theta, chi, dq, model)
    keys = balance.keys()
    entry = lambda a, b: balance.rows[a].get(b, arb(0))  # noqa: E731
    right = arb_mat([[balance.right.get(key, arb(0))] for key in keys])
    solved = arb_mat([[entry(a, b) for b in keys] for a in keys]).solve(right)
    values = {key: solved[k, 0] for k, key in enumerate(keys)}
    wheels = range(vehicle.wheels)
    return Speeds(
        values["x"],
        values["y"],
        values["theta"],
        [values["chi", i] for i in wheels],
        [balance.spins_after(i, values) for i in wheels],
    )


class Balance:
    """Mq q'+ - A^T mu = Mq q'-, A q'+ = 0, in x, y, theta, chi_i, phi_i1 and the impulses mu."""

    def __init__(self, vehicle, theta, chi, dq, model):
        self.vehicle, self.chi, self.dq, self.model = vehicle, chi, dq, model
        self.rows, self.right = {}, {}
        self.roller = inertia_of_roller(vehicle, model)
        dx, dy = offset_in_fixed_axes(vehicle, theta)
        mass = vehicle.number("mass")
        self.inertia("x", "x", mass, dq.x)
        self.inertia("y", "y", mass, dq.y)
        self.inertia("theta", "theta", vehicle.number("yaw_inertia"), dq.theta)
        for a, value, speed in (("x", -mass * dy, dq.x), ("y", mass * dx, dq.y)):
            self.inertia(a, "theta", value, dq.theta)
            self.inertia("theta", a, value, speed)
        for i in range(vehicle.wheels):
            self.inertia(("chi", i), ("chi", i), vehicle.number("wheel_inertia"), dq.chi[i])
            if model != "massless":
                self.rollers(i)
            for k, row in enumerate(constraint_rows(vehicle, i, theta, chi[i], model)):
                for name, value in row.items():
                    key = (name, i) if name in ("chi", "phi") else name
                    self.put(("impulse", i, k), key, value)
                    self.put(key, ("impulse", i, k), -value)

    def put(self, row, column, value):
        entries = self.rows.setdefault(row, {})
        entries[column] = entries.get(column, arb(0)) + value

    def inertia(self, row, column, value, speed_before):
        self.put(row, column, value)
        self.right[row] = self.right.get(row, arb(0)) + value * speed_before

    def rollers(self, i):
        for j in range(self.vehicle.rollers_per_wheel):
            sin, phi = (self.chi[i] + self.vehicle.kappa(j)).sin(), self.dq.phi[i][j]
            if j == 0:
                key = ("phi", i)
                self.inertia(key, key, self.roller, phi)
                self.inertia(key, "theta", self.roller * sin, self.dq.theta)
                self.inertia("theta", key, self.roller * sin, phi)
            elif self.model == "locked":  # the roller stops; what it carried about the vertical is handed over
                self.right["theta"] += self.roller * sin * phi
            else:  # B (phi + sin theta') is kept; the change of theta' comes back through sin
                self.inertia("theta", "theta", -self.roller * sin * sin, self.dq.theta)

    def keys(self):
        count = self.vehicle.wheels
        names = ["x", "y", "theta", *(("chi", i) for i in range(count))]
        names += [] if self.model == "massless" else [("phi", i) for i in range(count)]
        return names + [key for key in self.rows if key[0] == "impulse"]

    def spins_after(self, i, values):
        n = self.vehicle.rollers_per_wheel
        if self.model == "massless":
            return [arb(0)] * n
        if self.model == "locked":
            return [values["phi", i], *[arb(0)] * (n - 1)]
        lost = self.dq.theta - values["theta"]
        tilt = [(self.chi[i] + self.vehicle.kappa(j)).sin() for j in range(n)]
        return [values["phi", i], *(self.dq.phi[i][j] + tilt[j] * lost for j in range(1, n))]


@working_precision
def after_switch(vehicle, theta, chi, dq, moves, *, model, law):
    """(chi, q') after the wheels in `moves` have switched together under the law "smooth" or "impact"."""
    chi, dq = relabel(vehicle, chi, dq, moves)
    return chi, {"smooth": smooth, "impact": impact}[law](vehicle, theta, chi, dq, model=model)
