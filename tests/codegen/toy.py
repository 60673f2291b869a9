"""A small made-up derivation with every kind of step, shape and expression, and tools to run programs."""

import math
from fractions import Fraction

from codegen.expressions import Call, Number, Power, Product, Sum, Symbol
from codegen.programs import Loop


def array(name, shape, **elements):
    """An entry of a table. elements: the place of each symbol in the array."""
    places = {symbol: [name, *place] for symbol, place in elements.items()}
    return {name: {"shape": shape, "unit": "1", "meaning": f"the toy's {name}", "elements": places}}


FIELDS = (
    array("gain", []) | array("l", []) | array("cos_alpha", ["N"]) | array("sin_alpha", ["N"])
    | array("cos_kappa", ["n-1"])
)  # fmt: skip
ARGUMENTS = (
    array("mass", [], M=[]) | array("length", []) | array("wheel_angles", ["N"], alpha=["i"])
    | array("nu", [3], nu_1=[0], nu_2=[1], nu_3=[2]) | array("chi", ["N"], chi=["i"]) | array("theta", [])
    | array("momenta", ["N", 2], p=["i", 0], q=["i", 1]) | array("spins", ["N", "n-1"], spin=["i", "j"])
    | array("sizes", ["N"], size=["i"]) | array("chi_dot", ["N"]) | array("contact_spin", ["N"])
    | array("pose_dot", [3]) | array("nu_dot", [3]) | array("energy", []) | array("total", []) | array("mean", [])
)  # fmt: skip


def function(name, summary, inputs, outputs, body, set="toy", equations=("3.4", "section 4")):
    """inputs, outputs: names of arguments."""
    return {
        "sets": [set],
        "name": name,
        "summary": summary,
        "equations": list(equations),
        "inputs": inputs.split(),
        "outputs": outputs.split(),
        "body": body,
    }


def let(name, expr):
    return {"let": name, "expr": expr}


def put(target, expr):
    return {"put": target, "expr": expr}


FUNCTIONS = [
    function(
        "prepare", "Constants of the toy.",
        "mass length wheel_angles", "",
        [
            let("gain", ["*", ["/", 1, 3], "M", ["^", "N", -1]]),
            let("half", ["*", ["/", 1, 2], "n"]),
            put(["gain"], "gain"),
            put(["l"], ["+", "length", ["/", 1, 2], ["*", -1, "half", ["/", 1, 7]]]),
            {"loop": "i", "body": [
                put(["cos_alpha", "i"], ["cos", "alpha"]),
                put(["sin_alpha", "i"], ["sin", "alpha"]),
            ]},
            {"loop": "j", "body": [put(["cos_kappa", "j"], ["cos", ["*", 2, "pi", "slot", ["^", "n", -1]]])]},
        ],
    ),
    function(
        "wheel_rates", "Rates of the toy's wheels.",
        "nu chi", "chi_dot contact_spin",
        [
            {"loop": "i", "body": [
                {"use": "wheel"},
                put(["chi_dot", "i"], ["*", "gain", ["^", "l", -1],
                    ["+", ["*", "sin_alpha", "nu_1"], ["*", -1, "cos_alpha", "nu_2"]]]),
                put(["contact_spin", "i"], ["*", "turn", ["^", ["+", 2, ["cos", "chi"]], -1]]),
            ]},
        ],
    ),
    function(
        "wheel_speeds", "Rates of the toy's wheels alone.", "nu", "chi_dot",
        [{"loop": "i", "body": [put(["chi_dot", "i"], ["*", "gain", "cos_alpha", "nu_2"])]}],
    ),
    function(
        "pose_rates", "Rates of the toy's pose.", "nu theta", "pose_dot",
        [
            put(["pose_dot", 0], ["*", "nu_1", ["cos", "theta"]]),
            put(["pose_dot", 1], ["*", "nu_1", ["sin", "theta"]]),
            put(["pose_dot", 2], "nu_3"),
        ],
    ),
    function(
        "forward_dynamics", "Accelerations of the toy.",
        "nu chi momenta", "nu_dot",
        [
            {"var": "m", "expr": ["+", 1, ["^", "gain", 2]]},
            {"var": "f", "expr": 0},
            {"loop": "i", "body": [
                let("rho", ["+", ["*", "l", ["cos", "chi"]], 2]),
                {"add": "m", "expr": ["*", ["^", "gain", 2], ["^", "cos_alpha", 2], ["^", "rho", -2]]},
                {"add": "f", "expr": ["+", ["*", -1, "p", ["sin", "chi"], ["^", "rho", -1]],
                                      ["*", "q", ["cos", "chi"], "gain"]]},
            ]},
            {"update": "f", "expr": ["*", "f", ["/", 3, 4]]},
            put(["nu_dot", 0], ["*", "f", ["^", "m", -1]]),
            put(["nu_dot", 1], ["*", -1, "nu_2", ["^", "m", -1]]),
            put(["nu_dot", 2], ["*", -1, ["+", "nu_3", ["*", -1, "nu_1"]]]),
        ],
    ),
    function(
        "share_of", "A set without a model.", "mass sizes", "total mean",
        [
            {"var": "sum", "expr": 0},
            {"loop": "i", "body": [{"add": "sum", "expr": ["*", "mass", "size"]}]},
            put(["total"], ["*", "sum", "n"]),
            put(["mean"], ["*", "sum", ["^", "N", -1], ["/", 2, 3]]),
        ],
        set="parts",
    ),
]  # fmt: skip

GROUPS = {
    "wheel": {"source": "forms/toy.mac", "proofs": ["p"],
              "body": [let("turn", ["*", "gain", "nu_3"]), {"use": "no_use"}]},
    "no_use": {"source": "forms/toy.mac", "proofs": [], "body": [let("unused", ["sin", "nu_3"])]},
}  # fmt: skip


def derivation():
    """The toy's data, new at every call."""
    meanings = {"nu_1": r"\nu_1", "rho": r"\rho", "l": "l"}
    return {
        "format": 3,
        "symbols": {s: {"code": s, "latex": t, "unit": "1", "meaning": s} for s, t in meanings.items()},
        "effects": [{"name": "toy", "meaning": "a toy"}],
        "arguments": ARGUMENTS,
        "fields": FIELDS,
        "bases": [{"name": "toy", "effects": ["toy"], "model": list(FIELDS)},
                  {"name": "parts", "effects": [], "model": []}],
        "sets": [{"base": "toy", "effects": [], "meaning": "a toy for tests"},
                 {"base": "parts", "effects": [], "meaning": "a toy of parts"}],
        "steps": GROUPS,
        "functions": FUNCTIONS,
        "equations": [{"id": "1", "title": "a_b", "source": "2.1", "left": "x",
                       "expr": ["*", -1, ["^", "rho", -1], ["+", "nu_1", ["*", -1, ["sin", "l"]]]]}],
        "proofs": [{"name": "p", "file": "f.mac", "claim": "0 = 0"}],
        "bounds": [{"field": "l", "positive": ["+", ["*", -1, "r"], "l"], "reason": "it must"}],
        "formulas": [],
    }  # fmt: skip


# Exact values are numbers modulo a prime: as good as fractions to tell two expressions apart, and they do not
# grow.
PRIME = 2**61 - 1
EXACT = {
    "sin": lambda x: x**3 + x,
    "cos": lambda x: x**2 + 1,
    "sqrt": lambda x: x**2 + 3,
    "exp": lambda x: x**2 + x + 5,
}


def exact(value):
    """A rational number modulo the prime."""
    value = Fraction(value)
    return value.numerator * pow(value.denominator, -1, PRIME) % PRIME


def evaluate(e, values):
    """The expression at exact values; odd and even polynomials stand for the elementary functions."""
    match e:
        case Number(value):
            return exact(value)
        case Symbol(name):
            return values(name)
        case Sum(terms):
            return sum(evaluate(term, values) for term in terms) % PRIME
        case Product(factors):
            return math.prod(evaluate(factor, values) for factor in factors) % PRIME
        case Power(base, exponent):
            return pow(evaluate(base, values), exponent, PRIME)
        case Call(name, argument):
            return EXACT[name](evaluate(argument, values)) % PRIME


def run(function, wheels, rollers, data):
    """{(output, index): exact value}. data: {array: {index: value}} for model fields and inputs."""
    output = {}

    def place(element, at):
        return tuple(at.get(k, k) for k in element.index)

    def block(body, known, at):
        known = dict(known)
        changed = {}

        def value(name):
            if name in known:
                return known[name]
            if name in function.elements:
                element = function.elements[name]
                return data[element.array.name][place(element, at)]
            counts = {"N": wheels, "n": rollers, "pi": exact(Fraction(22, 7)), "slot": at.get("j", -1) + 1}
            return counts[name]

        for node in body:
            if isinstance(node, Loop):
                for k in range(wheels if node.index == "i" else rollers - 1):
                    changed = block(node.body, known, at | {node.index: k})
                    known |= {name: new for name, new in changed.items() if name in known}
            elif node.kind == "load":
                known[node.name] = value(node.name) if node.name not in known else known[node.name]
            elif node.kind == "put":
                output[(node.target.array.name, place(node.target, at))] = evaluate(node.expression, value)
            else:
                new = evaluate(node.expression, value)
                known[node.name] = (known[node.name] + new) % PRIME if node.kind == "add" else new
        return known

    block(function.body, {}, {})
    return output


def random_data(function, wheels, rollers, random):
    """Exact random values for everything that the function reads."""
    sizes = {"N": wheels, "n-1": rollers - 1}
    data = {}
    for a in {element.array for element in function.elements.values()}:
        places = [()]
        for size in a.shape:
            places = [(*p, k) for p in places for k in range(sizes.get(size, size))]
        data[a.name] = {p: random.randrange(1, PRIME) for p in places}
    return data
