"""C99: how it writes symbols, functions, arrays and the model."""

import re
from dataclasses import dataclass
from functools import cached_property

from .infix import Infix, broken, local_names
from .operations import count_intermediates, count_operations
from .programs import Array, Element, Function, Step

KEYWORDS = frozenset(
    """auto break case char const continue default do double else enum extern float for goto if inline int
long register restrict return short signed sizeof static struct switch typedef union unsigned void volatile
while real_t real_number real_sin real_cos real_sqrt real_exp h work""".split()
)
SIZES = {"N": "wheels", "n-1": "slots"}
CONSTANTS = {
    "N": "real_number(wheels)",
    "n": "real_number(rollers_per_wheel)",
    "slot": "real_number(j + 1)",
    "pi": "real_number(3.141592653589793238462643383279502884L)",
}


class Layout:
    """Where each field stands in the model: scalars, then each wheel's fields together, then each slot's."""

    def __init__(self, fields: tuple[Array, ...]):
        self.scalars = [f for f in fields if f.shape == ()]
        self.wheel = [f for f in fields if f.shape == ("N",)]
        self.slot = [f for f in fields if f.shape == ("n-1",)]
        if len(self.scalars) + len(self.wheel) + len(self.slot) != len(fields):
            raise ValueError("a model field is a scalar, of shape N or of shape n-1")

    @property
    def size(self) -> str:
        return plus(
            len(self.scalars),
            times(len(self.wheel), "wheels"),
            times(len(self.slot), "(rollers_per_wheel - 1)"),
        )

    def place(self, array: Array) -> str:
        """Index of the field in the model."""
        if array in self.scalars:
            return str(self.scalars.index(array))
        if array in self.wheel:
            return plus(times(len(self.wheel), "i"), len(self.scalars) + self.wheel.index(array))
        return plus(
            times(len(self.wheel), "wheels"),
            times(len(self.slot), "j"),
            len(self.scalars) + self.slot.index(array),
        )


def plus(*terms: int | str) -> str:
    """A sum of ints and text, without what is zero."""
    return " + ".join(str(term) for term in terms if term not in (0, "0", "")) or "0"


def times(*factors: int | str) -> str:
    number, words = 1, []
    for factor in factors:
        if isinstance(factor, int):
            number *= factor
        else:
            words.append(factor)
    if number == 0:
        return "0"
    return "*".join([str(number)] * (number != 1 or not words) + words)


@dataclass
class CFunction(Infix):
    """One function's text, piece by piece; the template puts the pieces together."""

    function: Function
    layout: Layout

    @property
    def name(self) -> str:
        return f"omniroll_{self.function.set}_{self.function.name}"

    @cached_property
    def names(self) -> dict[str, str]:
        return local_names(self.function, KEYWORDS)

    @property
    def parameters(self) -> list[tuple[str, str]]:
        """(declaration, name) of each parameter."""
        own = [
            (
                f"{'const ' * (a.role == 'in')}real_t *{a.name}" if a.shape or a.role == "out" else f"real_t {a.name}",
                a.name,
            )
            for a in self.function.arguments
        ]
        counts = [("int wheels", "wheels"), ("int rollers_per_wheel", "rollers_per_wheel")]
        if self.function.reads_model:
            return [*counts, ("const real_t *model", "model"), *own]
        return [*counts, *own, *([("real_t *model", "model")] if self.function.prepares else [])]

    @property
    def prototype(self) -> str:
        return prototype("OMNIROLL_API void", self.name, [declaration for declaration, _ in self.parameters])

    def unused(self, body: str) -> list[str]:
        return [name for _, name in self.parameters if not re.search(rf"\b{name}\b", body)]

    @cached_property
    def operations(self) -> dict:
        return count_operations(self.function)

    @property
    def intermediates(self) -> int:
        return count_intermediates(self.function)

    def symbol(self, name: str) -> str:
        return self.names.get(name, name)

    def call(self, function: str, argument: str) -> str:
        return f"real_{function}({argument})"

    def ratio(self, p: int, q: int) -> str:
        return f"real_number({p})/{q}"

    def reference(self, element: Element) -> str:
        """The element as C text."""
        array = element.array
        if array in self.function.fields and array not in self.function.arguments:
            return f"model[{self.layout.place(array)}]"
        if not array.shape:
            return array.name if array.role == "in" else f"*{array.name}"
        terms: list[int | str] = []
        number = 0
        for axis, k in enumerate(element.index):
            stride = [size if isinstance(size, int) else SIZES[size] for size in array.shape[axis + 1 :]]
            term = times(*stride, k)
            if term.isdigit():
                number += int(term)
            else:
                terms.append(term)
        return f"{array.name}[{plus(*terms, number)}]"

    def is_parameter(self, step: Step) -> bool:
        """A scalar argument under its own name needs no local."""
        return step.kind == "load" and step.target is not None and self.reference(step.target) == step.name

    def line(self, step: Step, indent: str) -> str:
        """One step as a statement."""
        if step.kind == "load":
            value = self.reference(step.target) if step.target else CONSTANTS[step.name]
        else:
            value = self.expression(step.expression)
            if value.lstrip("-").isdigit():  # where real_t is no scalar, a bare number is none of its values
                value = f"real_number({value})"
        target = self.reference(step.target) if step.kind == "put" else self.symbol(step.name)
        before = {"load": "const real_t ", "let": "const real_t ", "var": "real_t "}.get(step.kind, "")
        return broken(f"{indent}{before}{target} {'+=' if step.kind == 'add' else '='} {value};")


def prototype(result: str, name: str, parameters: list[str], width: int = 110) -> str:
    """The function's declaration, without its semicolon, broken between parameters."""
    lines = [f"{result} {name}("]
    indent = " " * len(lines[0])
    for place, parameter in enumerate(parameters):
        text = parameter + (")" if place == len(parameters) - 1 else ",")
        if len(lines[-1]) + 1 + len(text) > width:
            lines.append(indent + text)
        else:
            lines[-1] += text if lines[-1].endswith("(") else " " + text
    return "\n".join(lines)
