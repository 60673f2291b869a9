"""C99: how it writes symbols, functions, arrays, and the structs of a model and of a vehicle."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

from .infix import Infix, broken, local_names
from .operations import count_intermediates, count_operations
from .programs import OWN, Array, Element, Function, Step

KEYWORDS = frozenset(
    """auto break case char const continue default do double else enum extern float for goto if inline int
long register restrict return short signed sizeof static struct switch typedef union unsigned void volatile
while h vehicle wheel roller state""".split()
)
LARGEST_INTEGER = 2**31 - 1  # of every compiler's int
SIZES = {"N": "wheels", "n-1": "slots"}
COUNTS = {"N": "wheels", "n": "rollers_per_wheel"}


class Model:
    """The fields of a model by the struct that they stand in: the model's own, a wheel's, a free roller's. Free rollers
    have theirs by slot, or of wheels of several kinds by wheel and slot."""

    def __init__(self, fields: tuple[Array, ...]):
        self.own = [f for f in fields if f.shape == ()]
        self.wheel = [f for f in fields if f.shape == ("N",)]
        by_slot, by_both = ([f for f in fields if f.shape == shape] for shape in (("n-1",), ("N", "n-1")))
        self.roller, self.by_wheel = by_slot or by_both, bool(by_both)
        if len(self.own) + len(self.wheel) + len(self.roller) != len(fields):
            raise ValueError("a model field is a scalar, of shape N, and of shape n-1 or [N][n-1], not of both")

    def rollers(self, wheels: str, rollers: str) -> str:
        """How many structs of free rollers there are, as C text."""
        return f"{wheels}*({rollers} - 1)" if self.by_wheel else f"{rollers} - 1"

    def place(self, element: Element, writes: bool = False) -> str:
        """The field as C text, in the loop that it needs; what writes it has the arrays by themselves."""
        array = element.array
        if array in self.own:
            return f"model->{array.name}"
        struct = "wheel" if array in self.wheel else "roller"
        return f"{'' if writes else 'model->'}{struct}[{offset(array, element.index)}].{array.name}"


def times(*factors: int | str) -> str:
    """A product of ints and text, without factors of one."""
    number, words = 1, []
    for factor in factors:
        if isinstance(factor, int):
            number *= factor
        else:
            words.append(factor)
    if number == 0:
        return "0"
    return "*".join([str(number)] * (number != 1 or not words) + words)


def plus(*terms: int | str) -> str:
    """A sum of ints and text, without what is zero."""
    return " + ".join(str(term) for term in terms if term not in (0, "0", "")) or "0"


@dataclass
class CFunction(Infix):
    """One function's text, piece by piece; the template puts the pieces together.

    prefix  of every name that others see: <prefix>_real, <prefix>_model, <prefix>_forward_dynamics
    """

    function: Function
    prefix: str = "omniroll"

    @property
    def name(self) -> str:
        return f"{self.prefix}_{'constants' if self.function.prepares else self.function.name}"

    @cached_property
    def real(self) -> str:
        return f"{self.prefix}_real"

    @cached_property
    def model(self) -> Model:
        return Model(self.function.fields)

    @cached_property
    def names(self) -> dict[str, str]:
        return local_names(self.function, KEYWORDS)

    @property
    def parameters(self) -> list[tuple[str, str]]:
        """(declaration, name) of each parameter."""
        if self.function.prepares:
            written = ["wheel", *(["roller"] if self.model.roller else []), "model"]
            own = [(f"{self.prefix}_{name} *{name}", name) for name in written]
            return [(f"const {self.prefix}_vehicle *vehicle", "vehicle"), *own]
        model = (f"const {self.prefix}_model *model", "model")
        first = [model if self.function.reads_model else ("int wheels", "wheels")]
        return first + [(parameter(a, self.real), a.name) for a in self.function.arguments]

    @property
    def prototype(self) -> str:
        return prototype("void", self.name, [declaration for declaration, _ in self.parameters])

    def unused(self, body: str) -> list[str]:
        return [name for _, name in self.parameters if not re.search(rf"\b{name}\b", body)]

    def counts(self, body: str) -> list[str]:
        """Declarations of the numbers of turns that the loops of the body need; without a model they are given."""
        if not self.function.fields:
            return []
        holder = "vehicle" if self.function.prepares else "model"
        values = {"wheels": f"{holder}->wheels", "slots": f"{holder}->rollers_per_wheel - 1"}
        return [f"const int {name} = {value};" for name, value in values.items() if re.search(rf"\b{name}\b", body)]

    @cached_property
    def operations(self) -> dict:
        return count_operations(self.function)

    @property
    def intermediates(self) -> int:
        return count_intermediates(self.function)

    def symbol(self, name: str) -> str:
        return self.names.get(name, name)

    def call(self, function: str, argument: str) -> str:
        return f"{self.prefix}_{function}({argument})"

    def number(self, text: str) -> str:
        """A number of the kernel's type, which need not be a scalar."""
        return f"{self.prefix.upper()}_NUMBER({text})"

    def ratio(self, p: int, q: int) -> str:
        return f"{self.number(str(p))}/{q if q <= LARGEST_INTEGER else self.number(f'{q}.0L')}"

    def constant(self, name: str) -> str:
        """N, n, pi, or the number of a free roller's slot."""
        if name == "pi":
            return self.number("3.141592653589793238462643383279502884L")
        if name == "slot":
            return self.number("j + 1")
        if name == OWN:
            return self.number("i == k")
        holder = "vehicle" if self.function.prepares else "model"
        return self.number(f"{holder}->{COUNTS[name]}")

    def reference(self, element: Element) -> str:
        """The element as C text."""
        array = element.array
        if array in self.function.fields and array not in self.function.arguments:
            return self.model.place(element, self.function.prepares)
        holder = "vehicle->" * (self.function.prepares and array.role == "in")
        if not array.shape:
            return f"{holder}{array.name}" if array.role == "in" else f"*{array.name}"
        return f"{holder}{array.name}[{offset(array, element.index)}]"

    def is_parameter(self, step: Step) -> bool:
        """A scalar argument under its own name needs no local."""
        return step.kind == "load" and step.target is not None and self.reference(step.target) == step.name

    def line(self, step: Step, indent: str) -> str:
        """One step as a statement."""
        if step.kind == "load":
            value = self.reference(step.target) if step.target else self.constant(step.name)
        else:
            value = self.expression(step.expression)
            if value.lstrip("-").isdigit():  # a vector type cannot take a bare number
                value = self.number(value)
        target = self.reference(step.target) if step.kind == "put" else self.symbol(step.name)
        before = {"load": f"const {self.real} ", "let": f"const {self.real} ", "var": f"{self.real} "}
        return broken(f"{indent}{before.get(step.kind, '')}{target} {'+=' if step.kind == 'add' else '='} {value};")


def parameter(array: Array, real: str) -> str:
    """The declaration of an argument: arrays and outputs by pointer, one number by value."""
    if array.shape or array.role == "out":
        return f"{'const ' * (array.role == 'in')}{real} *{array.name}"
    return f"{real} {array.name}"


def offset(array: Array, index: Iterable[int | str]) -> str:
    """Where an element stands in its dense array, the last index fastest."""
    terms: list[int | str] = []
    number = 0
    for axis, k in enumerate(index):
        stride = [size if isinstance(size, int) else SIZES[size] for size in array.shape[axis + 1 :]]
        term = times(*stride, k)
        if term.isdigit():
            number += int(term)
        else:
            terms.append(term)
    return plus(*terms, number)


def prototype(result: str, name: str, parameters: list[str], width: int = 110) -> str:
    """The function's declaration, without its semicolon, broken between parameters."""
    lines = [f"{result} {name}("]
    indent = " " * len(lines[0])
    for place, declaration in enumerate(parameters):
        text = declaration + (")" if place == len(parameters) - 1 else ",")
        if len(lines[-1]) + 1 + len(text) > width:
            lines.append(indent + text)
        else:
            lines[-1] += text if lines[-1].endswith("(") else " " + text
    return "\n".join(lines)
