"""The equations of a changed assumption as a Python kernel, to be simulated by omniroll.studies.what_if.

A symbol of the generic wheel is an array over the wheels, one of the generic free roller an array over the wheels and
their free rollers; a sum over these is NumPy's.
"""

from dataclasses import dataclass

from .expressions import SUMS, Call, Expression, Power, symbols
from .filling import template
from .infix import Infix, broken

WHEEL = ("alpha", "chi", "rho", "chi_dot", "phi_dot", "entering", "leaving", "momentum_cos", "momentum_sin")
ROLLER = ("kappa", "nu_s", "nu_dot_s", "phi_s_dot", "omega")
NAMES = {
    "2.1:rho": "rho", "2.1": "contact_spin", "2.2": "wheel_rate", "2.3:1": "x_rate", "2.3:2": "y_rate",
    "2.3:3": "theta_rate", "3.2": "twice_lagrangian", "3.4:1": "f_1", "3.4:2": "f_2", "3.4:3": "f_3",
    "3.4:roller": "nu_dot_s", "7.1:ss": "m_ss", "impact:1": "impulse_1", "impact:2": "impulse_2",
    "impact:3": "impulse_3",
    **{f"7.1:{ab}": f"m_{ab}" for ab in ("11", "12", "13", "22", "23", "33", "1s", "2s", "3s")},
}  # fmt: skip
OF_ROLLERS = ("3.4:roller", "7.1:1s", "7.1:2s", "7.1:3s", "7.1:ss")
STATE = (*WHEEL, *ROLLER, "nu_1", "nu_2", "nu_3", "nu_dot_1", "nu_dot_2", "nu_dot_3", "x", "y", "theta",
         "x_dot", "y_dot", "theta_dot", "pi")  # fmt: skip


@dataclass
class NumPy(Infix):
    """Expressions of NumPy arrays; of_rollers: where a wheel's arrays stand beside those of its rollers."""

    of_rollers: bool = False

    def symbol(self, name: str) -> str:
        if name == "pi":
            return "np.pi"
        return f"at.{name}[:, None]" if self.of_rollers and name in WHEEL else f"at.{name}"

    def call(self, function: str, argument: str) -> str:
        return f"np.{function}({argument})"

    def ratio(self, p: int, q: int) -> str:
        return f"{p}/{q}"

    def expression(self, e: Expression) -> str:
        match e:
            case Call(function, argument) if function in SUMS:
                return f"{function}(at, {NumPy(function == 'sum_ij').expression(argument)})"
            case Power(base, exponent) if exponent > 1:
                return f"{self.factor(base)}**{exponent}"
        return super().expression(e)


def kernel_text(equations: dict[str, Expression]) -> str:
    """A module of one function an equation. equations: by identifier."""
    functions = [
        (name, number, broken(f"    return ({NumPy(number in OF_ROLLERS).expression(equations[number])})"))
        for number, name in NAMES.items()
        if number in equations
    ]
    return template("what_if_kernel.py", functions=functions, numbers=numbers_of(equations))


def numbers_of(equations: dict[str, Expression]) -> list[str]:
    """The symbols that must be given as numbers."""
    used = set().union(*(symbols(e) for number, e in equations.items() if number in NAMES))
    return sorted(used - set(STATE))
