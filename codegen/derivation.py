"""The derivation's data: read from what Maxima wrote, checked, every expression canonical."""

import json
from functools import cached_property
from pathlib import Path

from .expressions import FUNCTIONS, SUMS, Canonical, Order, to_json
from .programs import (
    ContractError,
    EffectSet,
    Function,
    array_to_json,
    read_array,
    read_function,
    signature_to_json,
)
from .specialise import Registry, specialised

FORMAT = 3
PARTS = (
    "symbols", "effects", "arguments", "fields", "bases", "sets", "steps", "functions", "equations", "proofs", "bounds",
)  # fmt: skip
OPERATORS = ("+", "*", "^", "/", *FUNCTIONS, *SUMS)


class Derivation:
    """data: the parts of the JSON object, by name."""

    def __init__(self, data: dict):
        if not isinstance(data, dict) or data.get("format") != FORMAT:
            raise ContractError(f"the data is not of format {FORMAT}")
        missing = [part for part in PARTS if part not in data]
        if missing:
            raise ContractError(f"parts missing: {', '.join(missing)}")
        self.data = data
        self.canonical = Canonical(Order(data["symbols"]))

    @classmethod
    def load(cls, path: Path) -> "Derivation":
        data = loaded(path)
        try:
            return cls(data)
        except ContractError as problem:
            raise ContractError(f"{path.name}: {problem}") from None

    @cached_property
    def registry(self) -> Registry:
        return Registry.read(self.data["effects"], self.data.get("derivatives", {}))

    @cached_property
    def bases(self) -> dict[str, EffectSet]:
        """The programs with every effect in them, by the name of their roller model."""
        named = {name for f in self.data["functions"] for name in f["sets"]}
        stray = sorted(named - {b["name"] for b in self.data["bases"]})
        if stray:
            raise ContractError(f"functions of unknown sets: {', '.join(stray)}")
        return {data["name"]: self._base(data) for data in self.data["bases"]}

    def base(self, name: str) -> EffectSet:
        """The programs of one base, with every effect in them. KeyError for one that there is not."""
        return self._base({data["name"]: data for data in self.data["bases"]}[name])

    def _base(self, data: dict) -> EffectSet:
        name = data["name"]
        fields = tuple(read_array(f, self.data["fields"], "field", name) for f in data["model"])
        own = (f for f in self.data["functions"] if name in f["sets"])
        arguments, groups, beside = self.data["arguments"], self.data["steps"], self.registry.reads
        functions = tuple(read_function(f, fields, name, arguments, groups, beside) for f in own)
        names = [f.name for f in functions]
        if len(set(names)) < len(names):
            raise ContractError(f"{data['name']}: a function stands twice")
        return EffectSet(data["name"], tuple(data["effects"]), "", fields, functions)

    @cached_property
    def sets(self) -> tuple[EffectSet, ...]:
        """The sets of effects whose kernels are generated beforehand."""
        return tuple(
            specialised(self.bases[s["base"]], s["effects"], self.registry, s.get("meaning", ""))
            for s in self.data["sets"]
        )

    def part(self, name: str) -> object:
        """A part of the data with canonical expressions; not for sets and functions."""
        return self.with_canonical_expressions(self.data[name])

    def programs(self) -> dict:
        """What kernels are made of at run time: each field of a model, each group of steps and each function once, and
        what there is to differentiate."""
        parts = ("fields", "bases", "steps", "functions", "derivatives")
        return {part: self.part(part) for part in parts if part in self.data}

    def with_canonical_expressions(self, data: object) -> object:
        """The same data, every list that reads as an expression replaced by its canonical form."""
        match data:
            case dict():
                return {key: self.with_canonical_expressions(value) for key, value in data.items()}
            case [str(head), *_] if head in OPERATORS:
                return to_json(self.canonical.read(data))
            case list():
                return [self.with_canonical_expressions(value) for value in data]
        return data


def loaded(path: Path) -> dict:
    """The JSON object of a file that Maxima wrote. ContractError where it is not whole."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ContractError(f"{path.name} was not written") from None
    except ValueError as problem:
        raise ContractError(f"{path.name} is not complete JSON: {problem}") from problem


def set_to_json(effects: EffectSet) -> dict:
    data = {"name": effects.name, "effects": list(effects.effects), "meaning": effects.meaning}
    return (
        data | ({"base": effects.base} if effects.base else {}) | {"model": [array_to_json(f) for f in effects.fields]}
    )


def kernel_to_json(function: Function, operations: dict, intermediates: int) -> dict:
    """A function of a kernel as data: how it is called, and the work that it is."""
    return signature_to_json(function) | {"operations": operations, "intermediates": intermediates}


def json_text(data: object, indent: int = 0, before: int = 0, width: int = 110) -> str:
    """JSON, on one line where that fits, so that an expression reads as one. before: characters on the line
    so far.
    """
    short = json.dumps(data)
    if len(short) + before < width or not data or not isinstance(data, dict | list):
        return short
    inner = " " * (indent + 1)
    heads = [json.dumps(key) + ": " for key in data] if isinstance(data, dict) else [""] * len(data)
    values = data.values() if isinstance(data, dict) else data
    items = [
        inner + head + json_text(value, indent + 1, len(inner + head), width)
        for head, value in zip(heads, values, strict=True)
    ]
    opening, closing = "{}" if isinstance(data, dict) else "[]"
    return opening + "\n" + ",\n".join(items) + "\n" + " " * indent + closing
