"""The rates of a vehicle with effects: generated functions called one after the other on named arrays.

The signatures of the functions say what each needs and gives; what is called is what the effects ask for, then the
plain vehicle's functions. Where wheels may slip, one function gives all accelerations and the rates themselves. The
arrays of states and rates are views of one y and one y'.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from omniroll.effects.effect import Signal
from omniroll.effects.state_vector import StateVector
from omniroll.kernels.kernel import Flow, Kernel

PLAIN = ("wheel_speeds", "pose_rates")
PLAIN_RATES = {"nu": "nu_dot", "chi": "chi_dot", "pose": "pose_dot"}


def dynamics_with(functions: Sequence[str]) -> str:
    """The function that gives nu' beside these: one of them, where it gives the free rollers' accelerations as well."""
    return "accelerations" if "accelerations" in functions else "forward_dynamics"


class BoundRates:
    """The functions of one kernel, bound to buffers. Belongs to one run: threads do not share it.

    kernel     Kernel
    functions  those that the effects ask for
    """

    def __init__(self, kernel: Kernel, vector: StateVector, functions: Sequence[str]):
        functions = (*functions, "pose_rates") if kernel.slips else (*functions, dynamics_with(functions), *PLAIN)
        functions = tuple(dict.fromkeys(functions))
        self.kernel = kernel
        self.y, self.rates = np.zeros(vector.size), np.zeros(vector.size)
        rates = PLAIN_RATES | {quantity.name: quantity.rate for quantity in vector.quantities}
        self.buffers = {name: vector.view(self.y, name) for name in rates}
        self.buffers |= {rate: vector.view(self.rates, name) for name, rate in rates.items()}
        self.buffers["theta"] = self.buffers["heading"] = self.buffers["pose"][2:].reshape(())
        for function in functions:
            signature = kernel.signatures[function]
            for argument in (*signature.inputs, *signature.outputs):
                self.buffers.setdefault(argument.name, np.zeros(argument.shape))
        self.calls = [kernel.bind(function, self.buffers) for function in functions]

    def flow(self, constants: Mapping[str, np.ndarray], inputs: Mapping[str, Signal]) -> Flow:
        """f(time, y) -> y' during one phase; time counts from its start."""
        y, rates, calls = self.y, self.rates, self.calls
        for name, value in constants.items():
            self.buffers[name][...] = value
        own = [(self.buffers[name], signal) for name, signal in inputs.items() if name in self.buffers]
        moving = [(buffer, signal) for buffer, signal in own if signal.slope.any()]
        for buffer, signal in own:
            buffer[:] = signal.value

        def flow(time: float, values: np.ndarray) -> np.ndarray:
            y[:] = values
            for buffer, signal in moving:
                buffer[:] = signal.at(time)
            for call in calls:
                call()
            return rates.copy()

        return flow
