"""What instruments read near a state: the readings there, and their slopes by what the state and the inputs are.

The generated functions from which readings are made carry tangents, a column for each state and each input. How nu'
changes is known from the linear model, so that no accelerations are evaluated here.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from omniroll.effects.effect_set import DRIVES, EffectSet
from omniroll.kernels.kernel import Kernel
from omniroll.kernels.tangent_kernel import TangentKernel, tangent_of, with_tangent
from omniroll.results.measurements import NAMES, Instruments, Moments, measuring_kernel, true_values

WHOLE = ("encoder_count", "contact_roller")  # readings that jump: they have no slope
POSE = "odometry"  # that of encoders which count without steps is the pose, where axles tell all of the motion
OF_TRACKING = tuple(name for name in NAMES if name.startswith("tracking_"))  # a linear model has no such wheels
READINGS = tuple(name for name in NAMES if name not in (*WHOLE, *OF_TRACKING))


def readings_near(
    bound: Kernel,
    acting: EffectSet,
    known: Mapping[str, np.ndarray],
    slopes: Mapping[str, np.ndarray],
    instruments: Instruments,
    names: Sequence[str],
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """The readings (k,) of these names, and their slopes (k, columns).

    known   values of nu, chi, pose, nu_dot, of the drives' inputs, and of wheels that may slip rates, by name
    slopes  (k, columns) of all of them but those of the drives' inputs that do not change
    """
    columns = slopes["nu"].shape[1]
    carried = {
        name: with_tangent(value, slopes[name].T if name in slopes else np.zeros((columns, len(value))))
        for name, value in known.items()
    }
    no_roller = np.zeros((columns, bound.wheels), int)  # has passed: wheels' angles are those from the middle of theirs
    moments = Moments(
        carried["nu"], carried["chi"], carried["pose"], no_roller, None,
        {name: carried[name] for name in DRIVES if name in carried}, no_roller, carried.get("rates"),
        accelerations=lambda: {"nu_dot": carried["nu_dot"]},
    )  # fmt: skip
    asked = tuple(name for name in names if name != POSE)
    plain = measuring_kernel(bound.vehicle, bound.roller_model, acting, ())
    found = true_values(
        bound.vehicle, bound.roller_model, acting, moments, instruments, asked, TangentKernel(plain)
    ) | {POSE: carried["pose"]}
    read = {name: found[name].reshape(columns, -1) for name in names if name in found}
    return {name: own[0].real for name, own in read.items()}, {name: tangent_of(own).T for name, own in read.items()}
