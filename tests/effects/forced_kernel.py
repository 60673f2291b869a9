"""The kernel of a set of effects, made by hand from the plain kernel: M* nu' = f + V^T Q.

V's columns are the plain kernel's own kinematics. A free roller is eliminated with its force: Q phi'' = ... puts
- sin(psi) Q/Lambda into the third equation. Nothing here comes from maxima/effects.mac.
"""

import math

import numpy as np

from omniroll.kernels import Argument, Kernel, Signature, kernel


class ForcedKernel(Kernel):
    """The plain Python kernel plus generalised forces; one state at a time."""

    backend = "python"

    def __init__(self, vehicle, roller_model, effects, constants):
        super().__init__(vehicle, roller_model)
        self.plain = kernel(vehicle, roller_model, "python")
        self.effects, self.constants = effects, {name: np.asarray(value) for name, value in constants}
        self.signatures = dict(self.plain.signatures)
        shapes = {
            "nu": (3,), "chi": (self.wheels,), "momenta": (self.wheels, 2), "theta": (), "torque": (self.wheels,),
            "damping": (self.wheels,), "roller_drag": (self.wheels,), "roller_energy": (self.wheels,), "pose": (3,),
            "axial": (self.wheels, self.rollers_per_wheel - 1), "elapsed": (), "nu_dot": (3,),
        }  # fmt: skip
        shapes |= {f"{name}_dot": shapes[name] for name in ("momenta", "roller_energy", "axial")}
        shapes |= {name: shapes["momenta"] for name in ("momenta_before", "momenta_after")}

        def signature(inputs, outputs):
            arguments = [tuple(Argument(name, shapes.get(name, ())) for name in group) for group in (inputs, outputs)]
            return Signature(*arguments)

        extra = [name for name, on in (
            ("momenta", self.has_spins), ("theta", "slope" in effects), ("torque", "drive" in effects),
            ("damping", "motor" in effects), ("roller_drag", self.has_spins and "roller_coulomb" in effects),
        ) if on]  # fmt: skip
        self.signatures |= {
            "reduced": signature(["nu", "chi", *extra], ["nu_dot"]),
            "momenta_rates": signature(
                ["nu", "chi", "momenta", "roller_energy"], ["momenta_dot", "roller_energy_dot", "roller_loss"]
            ),
            "roller_energy": signature(["axial"], ["roller_energy"]),
            "axial_after": signature(["axial", "momenta_before", "momenta_after", "elapsed"], ["axial"]),
            "roller_rates": signature(["nu", "chi", "axial"], ["axial_dot", "roller_drag", "roller_loss"]),
            "contact_loss": signature(["nu", "chi"], ["roller_loss"]),
            "axle_loss": signature(["nu"], ["axle_loss"]),
            "drive_power": signature(["nu", "torque"] + ["damping"] * ("motor" in effects), ["drive_power"]),
            "potential": signature(["pose"], ["potential"]),
        }

    def bind(self, name, buffers):
        signature = self.signatures[name]

        def call():
            found = self.call(name, *(buffers[argument.name].copy() for argument in signature.inputs))
            for argument, value in zip(signature.outputs, found if isinstance(found, tuple) else (found,), strict=True):
                buffers[argument.name][...] = value

        return call

    def call(self, name, *values):
        if name in self.plain.signatures and name != "reduced":
            return self.plain.call(name, *values)
        values = [np.asarray(value, float) for value in values]
        if name in ("axial_after", "potential", "roller_energy"):
            return getattr(self, "_" + name)(*values)
        return getattr(self, "_" + name)(**dict(zip([a.name for a in self.signatures[name].inputs], values)))

    # Kinematics

    def _wheels_per_nu(self):
        return self.plain.wheel_speeds(np.eye(3)).T

    def _contacts_per_nu(self, chi):
        return self.plain.wheel_rates(np.eye(3), chi)[1].T

    def _angles(self, chi):
        return chi[:, None] + 2 * math.pi * np.arange(1, self.rollers_per_wheel) / self.rollers_per_wheel

    # Forces

    def _axle(self, speeds):
        c = self.constants
        force = -c["axle_damping"] * speeds if "axle_damping" in c else 0 * speeds
        if "axle_torque" in c:
            force = force - c["axle_torque"] * speeds / np.hypot(speeds, c["axle_speed"])
        return force

    def _roller(self, spins):
        c, shape = self.constants, (-1,) + (1,) * (spins.ndim - 1)
        force = 0 * spins
        if "roller_damping" in c:
            force = force - c["roller_damping"].reshape(shape) * spins
        if "roller_torque" in c:
            force = force - c["roller_torque"].reshape(shape) * spins / np.hypot(spins, c["roller_speed"])
        return force

    def _reduced(self, nu, chi, momenta=None, theta=0.0, torque=0.0, damping=0.0, roller_drag=None):
        wheels, contacts = self._wheels_per_nu(), self._contacts_per_nu(chi)
        speeds = wheels @ nu
        force = wheels.T @ (torque - damping * speeds + self._axle(speeds)) + contacts.T @ self._roller(contacts @ nu)
        if momenta is not None:
            force[2] -= self._free_couple(nu, chi, momenta, roller_drag) / self.vehicle.yaw_scale
        if "gravity" in self.constants:
            pull = self.vehicle.mass * self.constants["gravity"] * math.sin(self.constants["slope_angle"])
            down = self.constants["slope_direction"] - float(theta)
            force[:2] += pull * self.vehicle.platform_radius * np.array([math.cos(down), math.sin(down)])
        bias = self.plain.bias(nu, chi, *(() if momenta is None else (momenta,)))
        return np.linalg.solve(self.plain.mass_matrix(chi), bias + force)

    def _free_couple(self, nu, chi, momenta, roller_drag):
        """Sum over the free rollers of sin(psi) Q."""
        if roller_drag is not None:
            return roller_drag.sum()
        if "roller_damping" not in self.constants:
            return 0.0
        yaw, sines = nu[2] / self.vehicle.yaw_scale, np.sin(self._angles(chi))
        axial = (momenta[:, 0] * np.sin(chi) + momenta[:, 1] * np.cos(chi)) / self.vehicle.roller_inertia
        return -(self.constants["roller_damping"] * (axial - yaw * (sines**2).sum(axis=1))).sum()

    # Rollers

    def _momenta_rates(self, nu, chi, momenta, roller_energy):
        c, inertia, yaw = self.constants["roller_damping"], self.vehicle.roller_inertia, nu[2] / self.vehicle.yaw_scale
        kappa, sines = self._angles(0 * chi), np.sin(self._angles(chi))
        turning = yaw * np.stack([(np.cos(kappa) * sines).sum(1), (np.sin(kappa) * sines).sum(1)], axis=1)
        momenta_dot = -c[:, None] * (momenta / inertia - turning)
        along = (momenta[:, 0] * np.sin(chi) + momenta[:, 1] * np.cos(chi)) / inertia  # sum of omega sin(psi)
        squares = 2 * roller_energy / inertia
        energy_dot = -c * (squares - yaw * along)
        loss = c * (squares - 2 * yaw * along + yaw**2 * (sines**2).sum(axis=1))
        return momenta_dot, energy_dot, loss.sum() + self._contact_loss(nu, chi)

    def _roller_energy(self, axial):
        return self.vehicle.roller_inertia * (axial**2).sum(axis=-1) / 2

    def _axial_after(self, axial, before, after, elapsed):
        decay = np.exp(-np.multiply.outer(elapsed, self.constants["roller_damping"]) / self.vehicle.roller_inertia)
        kappa, inertia = self._angles(np.zeros(self.wheels)), self.vehicle.roller_inertia
        change = (after - decay[..., None] * before) / inertia
        cosine = change[..., 0] / (np.cos(kappa) ** 2).sum(axis=1)
        sine = change[..., 1] / (np.sin(kappa) ** 2).sum(axis=1)
        return decay[..., None] * axial + cosine[..., None] * np.cos(kappa) + sine[..., None] * np.sin(kappa)

    def _roller_rates(self, nu, chi, axial):
        sines = np.sin(self._angles(chi))
        spins = axial - nu[2] / self.vehicle.yaw_scale * sines
        force = self._roller(spins)
        loss = -(force * spins).sum() + self._contact_loss(nu, chi)
        return force / self.vehicle.roller_inertia, (sines * force).sum(axis=1), loss

    # Powers

    def _contact_loss(self, nu, chi):
        spins = self._contacts_per_nu(chi) @ nu
        return -(self._roller(spins) * spins).sum()

    def _axle_loss(self, nu):
        speeds = self._wheels_per_nu() @ nu
        return -(self._axle(speeds) * speeds).sum()

    def _drive_power(self, nu, torque, damping=0.0):
        speeds = self._wheels_per_nu() @ nu
        return ((torque - damping * speeds) * speeds).sum()

    def _potential(self, pose):
        c = self.constants
        down = pose[..., 0] * math.cos(c["slope_direction"]) + pose[..., 1] * math.sin(c["slope_direction"])
        return -self.vehicle.mass * c["gravity"] * math.sin(c["slope_angle"]) * down
