"""The kernel of one set of effects by itself, from the data in generated/: what a program may do at run time, without
Maxima.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from .along import ALONG
from .derivation import FORMAT, Derivation, kernel_to_json
from .engine_sets import along_set, differentiated, engine_set, further_forms
from .operations import count_intermediates, count_operations
from .pair import Pair, kernel_in_lanes, pair
from .programs import EffectSet, Function
from .rendering import python_text
from .sharing import share
from .specialise import Registry, specialised


class Programs:
    """What kernels are made of at run time: the programs with every effect in them, each read once.

    programs, arguments, effects, symbols, bounds: the contents of the files of these names in generated/data.
    """

    FILES = ("programs", "arguments", "effects", "symbols", "bounds")

    def __init__(self, programs: dict, arguments: dict, effects: list[dict], symbols: dict, bounds: list[dict]):
        self._data = programs | dict.fromkeys(("equations", "proofs", "bounds", "sets"), []) | {
            "format": FORMAT, "symbols": symbols, "effects": effects, "arguments": arguments,
        }  # fmt: skip
        self._functions = programs["functions"]
        self._bases: dict[str, EffectSet] = {}
        self.registry = Registry.read(effects, programs.get("derivatives", {}))
        self.bounds, self.names = bounds, {symbol: entry["code"] for symbol, entry in symbols.items()}

    @classmethod
    def load(cls, folder: Path) -> "Programs":
        """From the files of generated/data."""
        read = {name: json.loads((folder / f"{name}.json").read_text(encoding="utf-8")) for name in cls.FILES}
        return cls(read["programs"], *(read[name][name] for name in cls.FILES[1:]))

    def base(self, name: str) -> EffectSet:
        """The programs of one roller model. KeyError for one that there is not."""
        if name not in self._bases:
            functions = [f for f in self._functions if name in f["sets"]]
            self._bases[name] = Derivation(self._data | {"functions": functions}).base(name)
        return self._bases[name]

    def kernel(self, base: str, wanted: Sequence[str]) -> "SetKernel":
        """The kernel of the roller model `base` with the effects `wanted`. ContractError for an unknown effect."""
        if ALONG in wanted:
            return self._along(base, [name for name in wanted if name != ALONG])
        return SetKernel(self, specialised(self.base(base), wanted, self.registry, self._meaning(base, wanted)))

    def _along(self, base: str, effects: Sequence[str]) -> "AlongKernel":
        """The functions that sensitivities call of a set, with their slopes in a direction."""
        plain, wanted = self.kernel(base, effects).effects, (*effects, ALONG)
        names = differentiated(plain, self.registry)
        found = specialised(self.base(base), wanted, self.registry, self._meaning(base, wanted), names)
        return AlongKernel(self, found, plain)

    def _meaning(self, base: str, wanted: Sequence[str]) -> str:
        return ", ".join([f"{base} rollers", *self.registry.ordered(wanted)])


@dataclass
class SetKernel:
    """The texts of one set of effects; each is made when it is asked for."""

    programs: Programs
    effects: EffectSet

    @property
    def name(self) -> str:
        return self.effects.name

    @cached_property
    def functions(self) -> list[Function]:
        """The functions with shared subexpressions."""
        return [share(f) for f in self.effects.functions]

    @property
    def signatures(self) -> list[dict]:
        """What the functions take and give, and the work that they are; as in generated/data/kernels."""
        return [kernel_to_json(f, count_operations(f), count_intermediates(f)) for f in self.functions]

    def in_one_form(self, sharp: bool) -> "SetKernel":
        """The set with one form of every function: that for sharp tips, under the usual name, or the usual one."""
        suffix, kept = "_sharp", []
        for function in self.effects.functions:
            special = self.effects.function(f"{function.name}{suffix}")
            if function.name.endswith(suffix):
                continue
            if sharp and special is not None:
                function = replace(special, name=function.name, summary=f"{function.summary[:-1]}; for sharp tips.")
            kept.append(function)
        return SetKernel(self.programs, replace(self.effects, functions=tuple(kept)))

    def pair(self, stem: str = "omniroll", prefix: str = "omniroll", is_float: bool = False) -> Pair:
        """The header and the source file for a controller; codegen/pair.py says what the arguments are."""
        return pair(self.effects, self.functions, self.programs.bounds, self.programs.names, stem, prefix, is_float)

    @property
    def in_lanes(self) -> str:
        """The functions on vectors, for the compiled engine."""
        further = further_forms(self.effects, self.programs.registry)
        return kernel_in_lanes(self.effects, [*self.functions, *map(share, further)])

    @property
    def python(self) -> str:
        """The module of the functions in Python."""
        return python_text(self.effects, self.functions, {})

    def calls_file(self) -> dict[str, str]:
        """How the functions are called, by the name of the file."""
        cases = {function.name: function.cases for function in self.functions}
        functions = [entry | {"cases": cases[entry["name"]]} for entry in self.signatures]
        return {"functions.json": json.dumps(functions)}

    def python_files(self) -> dict[str, str]:
        """What Python needs of the set, by the names of the files."""
        return {f"{self.name}.py": self.python} | self.calls_file()

    def c_files(self) -> dict[str, str]:
        """What is compiled, and what cffi needs, by the names of the files."""
        pair = self.pair()
        return {
            "omniroll.h": pair.header,
            "omniroll.c": pair.source,
            "declarations.h": pair.declarations,
            "kernel_in_lanes.h": self.in_lanes,
            "engine_set.h": engine_set(self.effects, self.programs.registry),
        }

    def files(self) -> dict[str, str]:
        """All texts of the set."""
        return self.c_files() | self.python_files()


@dataclass
class AlongKernel(SetKernel):
    """The same of a set whose functions have slopes in a direction; `plain` is the set without these."""

    plain: EffectSet

    def c_files(self) -> dict[str, str]:
        """What sensitivities are compiled from, by the names of the files."""
        header = along_set(self.plain, self.programs.registry)
        return {name: text for name, text in super().c_files().items() if text} | {"along_set.h": header}
