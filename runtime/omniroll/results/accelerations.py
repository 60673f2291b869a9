"""Accelerations of states in which something acts, by the generated functions."""

from typing import Any

from omniroll.kernels.kernel import Kernel


def call_named(bound: Kernel, name: str, values: dict[str, Any]) -> Any:
    """A generated function on the values of the names of its inputs."""
    return bound.call(name, *(values[argument.name] for argument in bound.signatures[name].inputs))


def with_accelerations(bound: Kernel, values: dict[str, Any]) -> dict[str, Any]:
    """`values` of states (...) by name, with nu_dot (..., 3) in 1/s^2 and what it was computed from.

    bound   the kernel with all effects
    values  nu, chi, heading, spins (None but for free rollers) and the drives' inputs
    """
    values = dict(values)
    if bound.has_spins:
        values["axial"] = call_named(bound, "axial_speeds", values)
        values["momenta"] = call_named(bound, "momenta", values)
    if "coulomb_momenta" in bound.signatures:
        values["coulomb_momenta_dot"] = call_named(bound, "coulomb_momenta", values)
    rates = call_named(bound, bound.of_every_roller, values)
    values["nu_dot"] = rates[0] if bound.has_spins else rates
    return values
