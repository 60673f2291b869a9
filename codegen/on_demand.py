"""The kernel of one set of effects by itself, from the data in generated/: what a program may do at run time, without
Maxima.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from .derivation import FORMAT, Derivation, kernel_to_json
from .operations import count_intermediates, count_operations
from .rendering import kernel_texts
from .sharing import share


@dataclass(frozen=True)
class KernelTexts:
    """name: of the set; functions: as in generated/data/kernels.json; the texts of the emitted files."""

    name: str
    functions: list[dict]
    c_header: str
    c_source: str
    python: str


def kernel_on_demand(
    programs: dict, effects: list[dict], symbols: dict, base: str, wanted: Sequence[str]
) -> KernelTexts:
    """The kernel of the roller model `base` with the effects `wanted`.

    programs, effects, symbols: the contents of generated/data/programs.json, effects.json and symbols.json.
    ContractError for an effect or a base that they do not know.
    """
    derivation = Derivation(
        dict.fromkeys(("equations", "proofs", "bounds"), [])
        | {"format": FORMAT, "symbols": symbols, "effects": effects}
        | {"bases": programs["bases"], "functions": [f for f in programs["functions"] if f["set"] == base]}
        | {"sets": [{"base": base, "effects": list(wanted), "meaning": "made when it was called for"}]}
    )
    (effect_set,) = derivation.sets
    shared = [share(f) for f in effect_set.functions]
    texts = kernel_texts(effect_set, shared)
    return KernelTexts(
        name=effect_set.name,
        functions=[kernel_to_json(f, count_operations(f), count_intermediates(f)) for f in shared],
        c_header=texts[f"c/omniroll_{effect_set.name}.h"],
        c_source=texts[f"c/omniroll_{effect_set.name}.c"],
        python=texts[f"python/{effect_set.name}.py"],
    )
