"""The vehicle with free rollers as a user of a general tool writes it: energy and constraints, nothing eliminated.

Coordinates q = (x, y, theta, chi_i, phi_ij), speeds w = (nu, spins of the free rollers), q' = V(q) w from (2.1) and
(2.2), kinetic energy (3.2). The tool's own differentiation forms the projected equations of Lagrange,

    V^T (d/dt dT/dq' - dT/dq) = 0,   that is   M w' = f   for all 3 + N (n-1) unknowns,
    M = V^T dP/dw,   f = -V^T (dP/dq q' - dT/dq),   P = dT/dq' at q' = V w.
"""

import math


def coordinate_rates(vehicle, nu, spins, theta, chi, sin, cos):
    """q' = V(q) w, a list of 3 + N + N n; `spins` is a flat list by wheel, the contact rollers' left out."""
    places = vehicle.rollers_per_wheel - 1
    R, l, r = vehicle.platform_radius, vehicle.wheel_radius, vehicle.roller_axis_radius  # noqa: E741
    yaw_rate = nu[2] / vehicle.yaw_scale
    rates = [R * (nu[0] * cos(theta) - nu[1] * sin(theta)), R * (nu[0] * sin(theta) + nu[1] * cos(theta)), yaw_rate]
    for alpha in vehicle.wheel_angles:
        rates.append(R / l * (nu[0] * math.sin(alpha) - nu[1] * math.cos(alpha) - yaw_rate))
    for i, alpha in enumerate(vehicle.wheel_angles):
        rates.append(R * (nu[0] * math.cos(alpha) + nu[1] * math.sin(alpha)) / (l * cos(chi[i]) - r))
        rates.extend(spins[i * places : (i + 1) * places])
    return rates


def kinetic_energy(vehicle, chi, rates, sin):
    """T of (3.2) for any q'."""
    wheels, n, B = vehicle.wheels, vehicle.rollers_per_wheel, vehicle.roller_inertia
    spins = rates[3 + wheels :]
    total = vehicle.mass * (rates[0] ** 2 + rates[1] ** 2) + vehicle.yaw_inertia * rates[2] ** 2
    for i in range(wheels):
        total = total + vehicle.wheel_inertia * rates[3 + i] ** 2
        for j in range(n):
            spin = spins[i * n + j]
            total = total + B * (spin**2 + 2 * rates[2] * sin(chi[i] + 2 * math.pi * j / n) * spin)
    return total / 2
