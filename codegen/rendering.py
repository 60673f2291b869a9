"""Every emitted file as bytes: templates filled with what the printers say."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial

from . import formulas
from .c import CFunction
from .derivation import Derivation, json_text, kernel_to_json, set_to_json
from .filling import ENVIRONMENT, template
from .latex import Latex, matrix_of, symbol_names
from .operations import count_intermediates, count_operations
from .programs import EffectSet, Function
from .python import PythonFunction
from .sharing import share

NODES = 16  # of a step of the compiled engine: two vectors of eight lanes
SAMPLE = "controller_sample"  # of the set "parts"
ENVIRONMENT.filters |= formulas.FILTERS

Sets = list[tuple[EffectSet, list[Function]]]  # with shared subexpressions


def render(derivation: Derivation) -> dict[str, bytes]:
    """{path below generated/: contents}, in a fixed order."""
    from .quadrature import gauss, radau  # needs mpmath, which the kernels alone do not

    sets: Sets = [(s, [share(f) for f in s.functions]) for s in derivation.sets]
    texts = {
        "__init__.py": template("package.py", text="Everything that codegen wrote. Never edited by hand."),
        "python/__init__.py": template("package.py", text="The kernels in Python, one module a set of effects."),
        "python/elementary.py": template("elementary.py"),
    }
    texts |= c_texts(sets) | python_texts(sets) | kernel_texts(sets)
    texts["c/gauss.h"] = template("quadrature.h", name="Gauss", tables=gauss(NODES))
    texts["c/radau.h"] = template("quadrature.h", name="Radau", tables=radau(NODES))
    texts |= controller_text(sets)
    texts["latex/equations.tex"] = latex_text(derivation)
    texts["symbols.md"] = template("symbols.md", symbols=derivation.data["symbols"])
    texts |= data_texts(derivation) | formula_texts(derivation)
    return {path: texts[path].encode("utf-8") for path in sorted(texts)}


def first_homes(
    sets: Sets, text: Callable[[Function], str]
) -> Iterable[tuple[EffectSet, list[Function], dict[str, list[str]]]]:
    """Each set with the functions that no set before it has, and those that it shares: {set before: names}."""
    homes: dict[str, str] = {}
    for effects, functions in sets:
        own: list[Function] = []
        shared: dict[str, list[str]] = {}
        for function in functions:
            home = homes.setdefault(text(function), effects.name)
            if home == effects.name:
                own.append(function)
            else:
                shared.setdefault(home, []).append(function.name)
        yield effects, own, shared


def c_texts(sets: Sets) -> dict[str, str]:
    """Each function in C once: in the file of the first set that has it."""
    code = ENVIRONMENT.get_template("functions.j2").module.code
    with_model = [(s, functions) for s, functions in sets if s.fields]
    return {
        f"c/{effects.name}.c": template("set.c", set=effects, functions=list(map(CFunction, own)), elsewhere=shared)
        for effects, own, shared in first_homes(with_model, lambda f: code(CFunction(f)))
    }


def controller_text(sets: Sets) -> dict[str, str]:
    """What the compiled engine calls at a sample; nothing where the derivation has no controller."""
    sample = next((f for _, functions in sets for f in functions if f.name == SAMPLE), None)
    return {"c/controller.h": template("controller.h", sample=CFunction(sample))} if sample else {}


def python_texts(sets: Sets) -> dict[str, str]:
    """Each function in Python once; a set's module imports those that another set has already."""
    return {
        f"python/{effects.name}.py": python_text(effects, own, shared)
        for effects, own, shared in first_homes(
            sets, lambda f: python_text(EffectSet("", (), "", f.fields, ()), [replace(f, groups=())], {})
        )
    }


def python_text(effects: EffectSet, functions: list[Function], elsewhere: dict[str, list[str]]) -> str:
    return template("set.py", set=effects, functions=list(map(PythonFunction, functions)), elsewhere=elsewhere)


def latex_text(derivation: Derivation) -> str:
    data, read = derivation.data, derivation.canonical.read
    latex = Latex(symbol_names(data["symbols"], data))
    return template(
        "equations.tex",
        latex=latex,
        read=read,
        matrix_of=partial(matrix_of, latex, read=read),
        equations=[*data["equations"], *data.get("equations_more", [])],
        matrices=data.get("matrices", []),
    )


DATA_FILES = ("symbols", "effects", "arguments", "equations", "proofs", "bounds")


def data_texts(derivation: Derivation) -> dict[str, str]:
    parts = {name: {name: derivation.part(name)} for name in DATA_FILES}
    beside = ("equations_more", "matrices", "equation_symbols")
    parts["equations"] |= {name: derivation.part(name) for name in beside if name in derivation.data}
    if "sharpness" in derivation.data:
        parts["bounds"]["sharpness"] = derivation.part("sharpness")
    parts["programs"] = derivation.programs()
    return {f"data/{name}.json": data_text(part) for name, part in parts.items()}


def data_text(parts: dict[str, object]) -> str:
    return template("data.json", parts={key: json_text(value, 1, len(key) + 5) for key, value in parts.items()})


def kernel_texts(sets: Sets) -> dict[str, str]:
    """How the functions of each set are called and the work that they are: once, in the file of the first set."""
    return {
        f"data/kernels/{effects.name}.json": data_text(
            {"set": set_to_json(effects), "functions": list(map(described, own)), "elsewhere": shared}
        )
        for effects, own, shared in first_homes(sets, lambda f: json_text(described(f)))
    }


def described(function: Function) -> dict:
    entry = kernel_to_json(function, count_operations(function), count_intermediates(function))
    del entry["set"]
    return entry


def formula_texts(derivation: Derivation) -> dict[str, str]:
    """The comparison with the paper, where the derivation has one."""
    if not derivation.data.get("formulas"):
        return {}
    records = formulas.Comparison(derivation).records()
    values = formulas.page_values(records)
    return {
        "formulas/formulas.json": template("data.json", parts={"formulas": json_text(records, 1, 13)}),
        "formulas/formulas.md": template("formulas.md", **values),
        "formulas/formulas.html": template("formulas.html", **values),
    }
