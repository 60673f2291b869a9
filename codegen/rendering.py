"""Every emitted file as bytes: templates filled with what the printers say."""

import re
import textwrap
from collections.abc import Iterable
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from . import formulas
from .c import CFunction, Layout, plus, prototype, times
from .derivation import Derivation, json_text, kernel_to_json, set_to_json
from .expressions import Canonical
from .latex import Latex, escaped
from .operations import called_functions, count_intermediates, count_operations
from .programs import Array, EffectSet, Function, Loop
from .python import PythonFunction
from .sharing import share
from .short_angles import LARGEST, short_angles

SOURCE = "maxima/derive.mac"
NODES = 16  # of a step of the compiled engine: two vectors of eight lanes
STEP_NEEDS = ("reduced", "wheel_speeds", "pose_rates")
FURTHER_STATE = ("momenta_rates", "roller_rates")  # functions of sets whose free rollers' momenta change in a phase
PLACE_WORDS = {
    "once": "once",
    "wheel": "per wheel",
    "slot": "per free-roller slot",
    "roller": "per free roller",
}


def render(derivation: Derivation) -> dict[str, bytes]:
    """{path below generated/: contents}, in a fixed order."""
    from .quadrature import gauss  # needs mpmath, which the kernels alone do not

    shared = {f"{s.name}.{f.name}": share(f) for s in derivation.sets for f in s.functions}
    texts = {
        "__init__.py": template("package.py", text="Everything that codegen wrote. Never edited by hand."),
        "python/__init__.py": template("package.py", text="The kernels in Python, one module a set of effects."),
        "python/elementary.py": template("elementary.py"),
    }
    for effects in derivation.sets:
        texts |= kernel_texts(effects, [shared[f"{effects.name}.{f.name}"] for f in effects.functions])
    texts["c/gauss.h"] = template("gauss.h", gauss=gauss(NODES))
    texts["latex/equations.tex"] = latex_text(derivation)
    texts["symbols.md"] = template("symbols.md", symbols=derivation.data["symbols"])
    texts |= data_texts(derivation, shared) | formula_texts(derivation)
    return {path: texts[path].encode("utf-8") for path in sorted(texts)}


def template(file: str, **values: object) -> str:
    """The text of one emitted file. file: the template's name without .j2."""
    return ENVIRONMENT.get_template(f"{file}.j2").render(
        template=f"codegen/templates/{file}.j2", source=SOURCE, **values
    )


def kernel_texts(effects: EffectSet, functions: list[Function]) -> dict[str, str]:
    layout = Layout(effects.fields)
    step = step_function(effects)
    in_c = [CFunction(f, layout) for f in functions]
    reduced = effects.function("reduced")
    values = {
        "set": effects,
        "layout": layout,
        "functions": in_c,
        "step": step,
        "asked": "".join(f"{a.name}, " for a in reduced.inputs[2:]) if reduced else "",
        "calls": set().union(*map(called_functions, functions)),
        "short_angles": short_angles(),
        "largest_square": LARGEST,
    }
    in_python = [PythonFunction(f) for f in functions]
    return {
        f"c/omniroll_{effects.name}.h": template("omniroll_set.h", **values),
        f"c/omniroll_{effects.name}.c": template("omniroll_set.c", **values),
        f"python/{effects.name}.py": template("set.py", set=effects, functions=in_python),
    }


def step_function(effects: EffectSet) -> dict | None:
    """What the fixed step needs to know, where the set has the functions that it is made of and no further state."""
    if not all(effects.function(name) for name in STEP_NEEDS) or any(map(effects.function, FURTHER_STATE)):
        return None
    reduced = effects.function("reduced")
    assert reduced is not None
    asked = [a for a in reduced.inputs if a.name not in ("nu", "chi")]
    passed = [a for a in asked if a.shape]  # what has no shape is the heading, which is a part of the pose
    name = f"omniroll_{effects.name}_step"
    parameters = [
        "int wheels",
        "int rollers_per_wheel",
        "const real_t *model",
        "real_t h",
        "real_t *nu",
        "real_t *chi",
        *(f"const real_t *{a.name}" for a in passed),
        "real_t *pose",
        "real_t *work",
    ]
    return {
        "name": name,
        "passed": passed,
        "asked": [a.name if a.shape else "theta_stage" for a in asked],
        "prototype": prototype("OMNIROLL_API void", name, parameters),
    }


def latex_text(derivation: Derivation) -> str:
    names = {name: entry["latex"] for name, entry in derivation.data["symbols"].items()}
    return template(
        "equations.tex",
        latex=Latex(names),
        read=Canonical(derivation.canonical.order).read,
        equations=derivation.data["equations"],
    )


def data_texts(derivation: Derivation, shared: dict[str, Function]) -> dict[str, str]:
    kernels = [
        kernel_to_json(
            f,
            count_operations(shared[f"{s.name}.{f.name}"]),
            count_intermediates(shared[f"{s.name}.{f.name}"]),
        )
        for s in derivation.sets
        for f in s.functions
    ]
    parts = {name: {name: derivation.part(name)} for name in ("symbols", "effects", "equations", "proofs", "bounds")}
    if "sharpness" in derivation.data:
        parts["bounds"]["sharpness"] = derivation.part("sharpness")
    parts["programs"] = derivation.programs()
    parts["kernels"] = {"sets": list(map(set_to_json, derivation.sets)), "functions": kernels}
    return {
        f"data/{name}.json": template(
            "data.json", parts={key: json_text(value, 1, len(key) + 5) for key, value in part.items()}
        )
        for name, part in parts.items()
    }


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


# What the templates use beside the printers


def sizes(array: Array) -> str:
    """[N][n-1] after the array's name in comments."""
    return "".join(f"[{size}]" for size in array.shape)


def wrapped(text: str, before: str, then: str | None = None, width: int = 110) -> str:
    """Prose in lines of which the first starts with `before`, each other one with `then` or `before`."""
    return (
        "\n".join(
            textwrap.wrap(
                text,
                width,
                initial_indent=before,
                subsequent_indent=before if then is None else then,
                break_long_words=False,
                break_on_hyphens=False,
            )
        )
        or before.rstrip()
    )


def work(function: CFunction | PythonFunction) -> str:
    """The operation counts as one sentence."""
    places = []
    for place, counts in function.operations.items():
        told = ", ".join(f"{number} {kind}" for kind, number in counts.items() if number)
        if told:
            places.append(f"{PLACE_WORDS[place]} {told}")
    return f"Operations: {'; '.join(places) or 'none'}. Intermediates: {function.intermediates}."


def equations_of(numbers: Iterable[str]) -> str:
    """(3.1), (3.4) and plain words for what is not a number."""
    return ", ".join(f"({n})" if re.fullmatch(r"\d+\.\d+(:\w+)?", n) else n for n in numbers)


def called(names: list[str], text: str) -> list[str]:
    """The functions that the text calls."""
    return [name for name in names if re.search(rf"\b{name}\(", text)]


def is_loop(node: object) -> bool:
    return isinstance(node, Loop)


def environment() -> Environment:
    made = Environment(
        loader=FileSystemLoader(Path(__file__).with_name("templates")),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )
    made.filters |= {
        "sizes": sizes,
        "wrapped": wrapped,
        "work": work,
        "equations": equations_of,
        "tex": escaped,
        "called": called,
    } | formulas.FILTERS
    made.tests["loop"] = is_loop
    made.globals |= {"plus": plus, "times": times}
    return made


ENVIRONMENT = environment()
