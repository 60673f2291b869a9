"""The vehicle's parameters, as exact numbers."""

from dataclasses import dataclass, replace

from flint import arb

from .balls import exact, working_precision

SCALARS = (
    "mass", "yaw_inertia", "wheel_inertia", "roller_inertia", "yaw_scale", "platform_radius", "wheel_radius",
    "roller_axis_radius",
)  # fmt: skip


@dataclass(frozen=True)
class OracleVehicle:
    """Scalars are numbers (floats are taken exactly); the rest:

    wheel_angles      N angles alpha_i; by default the wheel centres stand at R (cos alpha, sin alpha)
    places            N pairs, wheel centres in the platform's axes, instead of the default
    axle_angles       N angles beta_i of the axles in the platform's axes; by default alpha_i
    offset            centre of mass in the platform's axes; yaw_inertia is then still about S
    """

    mass: object
    yaw_inertia: object
    wheel_inertia: object
    roller_inertia: object
    yaw_scale: object
    platform_radius: object
    wheel_radius: object
    roller_axis_radius: object
    wheel_angles: tuple
    rollers_per_wheel: int
    places: tuple | None = None
    axle_angles: tuple | None = None
    offset: tuple = (0, 0)

    @property
    def wheels(self):
        return len(self.wheel_angles)

    def number(self, name):
        return exact(getattr(self, name))

    @working_precision
    def place(self, i):
        if self.places is not None:
            return tuple(exact(c) for c in self.places[i])
        sin, cos = exact(self.wheel_angles[i]).sin_cos()
        return self.number("platform_radius") * cos, self.number("platform_radius") * sin

    def axle_angle(self, i):
        return exact((self.axle_angles or self.wheel_angles)[i])

    def kappa(self, j):
        """Angle of roller j = 0..n-1 from the contact roller j = 0 (the paper counts from 1)."""
        return 2 * arb.pi() * j / self.rollers_per_wheel

    def with_(self, **changes):
        return replace(self, **changes)

    def permuted(self, order):
        """The same vehicle with its wheels numbered in another order."""
        pick = lambda values: None if values is None else tuple(values[k] for k in order)  # noqa: E731
        return replace(
            self, wheel_angles=pick(self.wheel_angles), places=pick(self.places), axle_angles=pick(self.axle_angles)
        )

    def fields(self):
        """Keyword arguments of omniroll.Vehicle, as floats."""
        values = {name: float(getattr(self, name)) for name in SCALARS}
        values["wheels"] = self.wheels
        values["rollers_per_wheel"] = self.rollers_per_wheel
        values["wheel_angles"] = [float(a) for a in self.wheel_angles]
        return values
