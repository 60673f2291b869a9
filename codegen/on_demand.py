"""The kernel of one set of effects by itself, from the data in generated/: what a program may do at run time, without
Maxima.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from .derivation import FORMAT, Derivation, kernel_to_json
from .operations import count_intermediates, count_operations
from .programs import EffectSet
from .rendering import kernel_texts
from .sharing import share
from .specialise import Registry, specialised


@dataclass(frozen=True)
class KernelTexts:
    """name: of the set; functions: as in generated/data/kernels.json; the texts of the emitted files."""

    name: str
    functions: list[dict]
    c_header: str
    c_source: str
    python: str


class Programs:
    """What kernels are made of at run time: the programs with every effect in them, each read once.

    programs, effects, symbols: the contents of generated/data/programs.json, effects.json and symbols.json.
    """

    def __init__(self, programs: dict, effects: list[dict], symbols: dict):
        self._data = dict.fromkeys(("equations", "proofs", "bounds", "sets"), []) | {
            "format": FORMAT, "symbols": symbols, "effects": effects, "bases": programs["bases"],
        }  # fmt: skip
        self._data["steps"] = programs["steps"]
        self._functions = programs["functions"]
        self._bases: dict[str, EffectSet] = {}
        self.registry = Registry.read(effects)

    def base(self, name: str) -> EffectSet:
        """The programs of one roller model. KeyError for one that there is not."""
        if name not in self._bases:
            functions = [f for f in self._functions if name in f["sets"]]
            self._bases[name] = Derivation(self._data | {"functions": functions}).base(name)
        return self._bases[name]


def kernel_on_demand(programs: Programs, base: str, wanted: Sequence[str]) -> KernelTexts:
    """The kernel of the roller model `base` with the effects `wanted`. ContractError for an unknown effect."""
    effect_set = specialised(programs.base(base), wanted, programs.registry, "made when it was called for")
    shared = [share(f) for f in effect_set.functions]
    texts = kernel_texts(effect_set, shared)
    return KernelTexts(
        name=effect_set.name,
        functions=[kernel_to_json(f, count_operations(f), count_intermediates(f)) for f in shared],
        c_header=texts[f"c/omniroll_{effect_set.name}.h"],
        c_source=texts[f"c/omniroll_{effect_set.name}.c"],
        python=texts[f"python/{effect_set.name}.py"],
    )
