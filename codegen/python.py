"""Python: how it writes symbols, functions, arrays and the model. Any number type that elementary.py
knows.
"""

import keyword
import re
from dataclasses import dataclass
from functools import cached_property

from .infix import Infix, broken, local_names
from .operations import count_intermediates, count_operations
from .programs import EARLIER, Array, Element, Function, Step

KEYWORDS = frozenset(
    [
        *keyword.kwlist,
        "range",
        "like",
        "None",
        "SimpleNamespace",
        "sin",
        "cos",
        "sqrt",
        "exp",
        "number",
        "ratio",
        "circle_ratio",
    ]
)
CONSTANTS = {
    "N": "number({wheels}, like)",
    "n": "number({rollers}, like)",
    "slot": "number(j + 1, like)",
    "pi": "circle_ratio(like)",
    "own": "number(int(i == k), like)",
}
COUNTS = {"N": "{wheels}", "n-1": "{rollers} - 1"}


@dataclass
class PythonFunction(Infix):
    """One function's text, piece by piece; the template puts the pieces together."""

    function: Function

    @property
    def name(self) -> str:
        return self.function.name

    @cached_property
    def names(self) -> dict[str, str]:
        return local_names(self.function, KEYWORDS)

    @property
    def parameters(self) -> list[str]:
        first = ["model"] if self.function.reads_model else ["wheels", "rollers_per_wheel"]
        return [*first, *(a.name for a in self.function.inputs)]

    @property
    def signature(self) -> str:
        lines = [f"def {self.name}("]
        indent = " " * len(lines[0])
        for place, name in enumerate(self.parameters):
            text = name + ("):" if place == len(self.parameters) - 1 else ",")
            if len(lines[-1]) + 1 + len(text) > 110:
                lines.append(indent + text)
            else:
                lines[-1] += text if lines[-1].endswith("(") else " " + text
        return "\n".join(lines)

    @cached_property
    def operations(self) -> dict:
        return count_operations(self.function)

    @property
    def intermediates(self) -> int:
        return count_intermediates(self.function)

    def with_counts(self, text: str) -> str:
        """Text with the two counts as this function reaches them."""
        prefix = "model." if self.function.reads_model else ""
        return text.format(wheels=f"{prefix}wheels", rollers=f"{prefix}rollers_per_wheel")

    @property
    def like(self) -> str:
        """A number of the type that the function computes with: the first input's first component."""
        if self.function.inputs:
            first = self.function.inputs[0]
            return first.name + "[0]" * len(first.shape)
        first = self.function.fields[0]
        return f"model.{first.name}" + "[0]" * len(first.shape)

    def needs_like(self, body: str) -> bool:
        return bool(re.search(r"\blike\b", body))

    def symbol(self, name: str) -> str:
        return self.names.get(name, name)

    def call(self, function: str, argument: str) -> str:
        return f"{function}({argument})"

    def ratio(self, p: int, q: int) -> str:
        return f"ratio({p}, {q}, like)"

    def reference(self, element: Element) -> str:
        array = element.array
        is_field = array in self.function.fields and array not in self.function.arguments
        return f"{'model.' * is_field}{array.name}" + "".join(f"[{k}]" for k in element.index)

    def is_parameter(self, step: Step) -> bool:
        """A scalar argument under its own name needs no local."""
        return step.kind == "load" and step.target is not None and self.reference(step.target) == step.name

    def empty(self, array: Array) -> str:
        """Text of nested lists of the array's shape, to be filled."""
        text = "None"
        for size in reversed(array.shape):
            count = self.with_counts(COUNTS[size]) if isinstance(size, str) else str(size)
            text = (
                f"[{text}] * ({count})"
                if text == "None" and " " in count
                else (f"[{text}] * {count}" if text == "None" else f"[{text} for _ in range({count})]")
            )
        return text

    @property
    def empty_outputs(self) -> list[tuple[str, str]]:
        return [(a.name, self.empty(a)) for a in self.function.outputs if a.shape]

    def line(self, step: Step, indent: str) -> str:
        """One step as a statement. `add` makes a new number: += would change an array that belongs to the
        caller.
        """
        if step.kind == "load":
            value = self.reference(step.target) if step.target else self.with_counts(CONSTANTS[step.name])
        else:
            value = self.expression(step.expression)
        target = self.reference(step.target) if step.kind == "put" else self.symbol(step.name)
        if step.kind == "add":
            value = f"{target} + {self.term(step.expression)}"
        text = f"{indent}{target} = {value}"
        return text if len(text) <= 110 else broken(f"{indent}{target} = ({value})")

    def count(self, index: str) -> str:
        """Number of turns of the loop over this index."""
        return "i" if index == EARLIER else self.with_counts(COUNTS["n-1" if index == "j" else "N"])
