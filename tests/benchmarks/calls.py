"""Question 5: what a call costs, from Python and back."""

import numpy as np

import omniroll
from omniroll.kernels.kernel import kernel

from .common import Answer, Target, Times, random_states, relative_error, repeated

CALLS, REPEATS = 200, 25
MILLISECOND = 1e-3


def per_call(action) -> Times:
    action()

    def many():
        for _ in range(CALLS):
            action()

    times = repeated(many, REPEATS)
    return Times(times.least / CALLS, times.median / CALLS)


def of_accelerations(vehicle):
    """[(what, Times, error)]; the error is that against the Python kernel."""
    nu, chi, spins = (array[0] for array in random_states(vehicle, 1))
    exact, _ = kernel(vehicle, "free", "python").accelerations(nu, chi, spins)
    found, _ = omniroll.accelerations(vehicle, nu, chi, spins)
    error = relative_error(found[None], exact[None])
    plain = nu.tolist(), chi.tolist()
    return [
        ("accelerations, arrays", per_call(lambda: omniroll.accelerations(vehicle, nu, chi, spins)), error),
        ("accelerations, lists", per_call(lambda: omniroll.accelerations(vehicle, *plain, spins.tolist())), error),
        ("accelerations, rollers at rest", per_call(lambda: omniroll.accelerations(vehicle, *plain)), error),
    ]


def of_simulate(vehicle):
    """[(what, Times, error)] of 1 ms; the error is that of the end against a run at 1e-14."""

    def run(**options):
        return omniroll.simulate(vehicle, nu=(1, 0, 1), duration=MILLISECOND, **options)

    exact, found = run(accuracy=1e-14, control=False), run()
    error = float(np.abs(found.nu[-1] - exact.nu[-1]).max())
    return [
        ("simulate of 1 ms, with its error estimate", per_call(run), error),
        ("simulate of 1 ms, control=False", per_call(lambda: run(control=False)), error),
        ("simulate of 1 ms, then nu and pose are read", per_call(lambda: (r := run(), r.nu, r.pose)), error),
    ]


def answer() -> Answer:
    vehicle = omniroll.Vehicle.paper()
    calls, runs = of_accelerations(vehicle), of_simulate(vehicle)
    targets = [
        Target(f"{what}: <= 15 microseconds", f"{times.least * 1e6:.1f}", times.least <= 15e-6)
        for what, times, _ in calls
    ]
    targets += [
        Target(f"{what}: <= 250 microseconds", f"{times.least * 1e6:.0f}", times.least <= 250e-6)
        for what, times, _ in runs
    ]
    return Answer(
        title="5. A call",
        text=(
            "The paper's vehicle with free rollers, from Python. What a call checks, copies and makes is counted. The "
            "error of accelerations is the difference from the Python kernel, that of a run the difference of nu at "
            "its end from a run at 1e-14."
        ),
        headings=["call", "microseconds", "error"],
        rows=[[what, times.in_unit(1e6), f"{error:.0e}"] for what, times, error in calls + runs],
        targets=targets,
    )
