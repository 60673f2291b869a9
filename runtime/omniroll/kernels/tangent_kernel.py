"""Generated functions that carry tangents: the derivative of whatever they compute, along several columns at once.

A generated function is arithmetic with sines, roots and exponentials, so it takes complex numbers as well. A number
x + i STEP d, where STEP is so small that its square is lost beside 1, comes out as f(x) + i STEP f'(x) d, and nothing
cancels: this is the complex step. What is differentiated is the code that runs, the forms for sharp tips included.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from omniroll.kernels.kernel import Kernel, PythonKernel, components_first

STEP = 2.0**-300  # a power of two: scaling by it rounds nothing


def with_tangent(value: ArrayLike, tangent: ArrayLike) -> np.ndarray:
    """Complex numbers that carry tangents."""
    return np.asarray(value) + 1j * (STEP * np.asarray(tangent))


def tangent_of(value: ArrayLike) -> np.ndarray:
    """What such numbers carry."""
    return np.asarray(value).imag / STEP


class TangentKernel(PythonKernel):
    """The functions of a kernel on numbers with tangents.

    plain     Kernel
    tangents  of the arguments of `prepare`, by name: (*columns, ...) with the argument's own axes last; 0 where none is
    columns   leading axes of all constants; those of a call's inputs broadcast with them
    """

    def __init__(self, plain: Kernel, tangents: Mapping[str, np.ndarray] | None = None, columns: tuple[int, ...] = ()):
        self.plain, self.columns, self.tangents = plain, columns, {} if tangents is None else tangents
        super().__init__(plain.vehicle, plain.roller_model, plain.effects, plain.given)

    def _given_constants(self) -> list:
        lead = len(self.columns)
        return [
            np.moveaxis(self.constant(name), range(lead), range(value.ndim, value.ndim + lead))
            for name, value in zip(self.constant_names, self.constants, strict=True)
        ]

    def constant(self, name: str) -> np.ndarray:
        """(*columns, ...) the argument of `prepare` that has this name, with its tangents."""
        value = super().constant(name)
        return with_tangent(value, np.broadcast_to(self.tangents.get(name, 0.0), (*self.columns, *value.shape)))

    def with_constants(self, changes: Mapping[str, tuple[float, ...]]) -> "TangentKernel":
        return TangentKernel(self.plain.with_constants(changes), self.tangents, self.columns)

    def call(self, name: str, *values: ArrayLike):
        signature = self.signatures[name]
        lead, arrays = self._broadcast(name, values, np.complex128)
        inputs = components_first(arrays, len(lead)) if lead else arrays
        with np.errstate(all="ignore"):
            found = getattr(self._module, self.form(name))(self._model, *inputs)
        found = found if len(signature.outputs) > 1 else (found,)
        lead = np.broadcast_shapes(lead, self.columns)
        outputs = tuple(
            _components_last(output, argument.shape, lead)
            for output, argument in zip(found, signature.outputs, strict=True)
        )
        return outputs if len(outputs) > 1 else outputs[0]


def _components_last(output, shape: tuple[int, ...], lead: tuple[int, ...]) -> np.ndarray:
    """A nested list of components, each a number or an array that broadcasts to `lead`, as one array lead + shape."""
    result = np.empty(lead + shape, complex)
    for place in np.ndindex(shape):
        component = output
        for index in place:
            component = component[index]
        result[(..., *place)] = component
    return result
