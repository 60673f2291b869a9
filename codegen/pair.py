"""A set of effects as files to compile: a header and a source file for a controller, and the compiled engine's kernel.

The functions' texts are those of generated/c. What stands around them (structs, checks, steps from joint to joint)
comes from templates.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from math import prod

from .c import CFunction, Model, prototype, times
from .expressions import ZERO, Call, Canonical, Expression, Symbol, symbols
from .filling import template
from .infix import Infix
from .operations import called_functions
from .programs import Array, EffectSet, Function, steps
from .short_angles import LARGEST, short_angles

CARRIED = {"roller_rates": "axial", "momenta_rates": "momenta"}  # function: the state that a set with it integrates
NUMBER = re.compile(r"\w+(\[\d\])?\Z")  # a name in the code that is one number
SIGNS = ("positive", "not_negative")  # of a constant by itself
CONTENTS = {  # what a reader looks for, and the functions that do it; a set may lack some
    "Set-up": ("prepare", "check_layout", "start"),
    "Motion": ("step", "step_derivatives"),
    "A loop of your own": ("time_to_joint", "switch", "joint", "pose_rates", "wheel_rates"),
    "Velocity of the vehicle from the wheels' rates (odometry)": ("nu_from_wheels", "nu_from_contacts"),
    "Rates of the wheels from the velocity of the vehicle": ("wheel_speeds",),
    "Twist in m/s and rad/s, and what an encoder's angle says of the contact": (
        "twist_from_nu",
        "nu_from_twist",
        "contact_from_angle",
    ),
    "Accelerations from torques (forward dynamics)": ("forward_dynamics", "accelerations"),
    "Forces and torques from accelerations (inverse dynamics)": ("inverse_dynamics", "wheel_torques"),
    "Motors, from their voltages": ("motor_torques", "motor_margins"),
    "Spins of the free rollers": ("axial_speeds", "spins_from_axial", "momenta"),
}
STEP_NEEDS = ("forward_dynamics", "wheel_speeds", "pose_rates", "wheel_rates")
DERIVATIVES_NEED = ("forward_dynamics_derivatives", "rate_derivatives")
COUNT_OF = {"N": "wheels"}
GIVEN_TO_EACH = "free_bearing"  # torques of each free roller's bearing: a set that takes these has no steps
OWN_COUNTS = "tip_i"  # of wheels with numbers of rollers of their own, whose joints these templates do not know
CHANGES = "row_constants"  # a set with it has other constants after a switch, which the templates of steps have not
ON_ROLLER = ("chi", "arc_middle")  # a wheel's angle, and the one from which that is counted: their sum is on the roller


@dataclass(frozen=True)
class Pair:
    """The two files of a set, and what cffi must know of them: declarations that need a typedef of <prefix>_real."""

    header: str
    source: str
    declarations: str


class LanesFunction(CFunction):
    """The text of a function on vectors. Half a wheel angle is short by nature; any other angle may be long."""

    @cached_property
    def short(self) -> set[str]:
        """The names of values that depend on a wheel's angle on its roller alone."""
        names = {*ON_ROLLER}
        for step in steps(self.function.body):
            if step.kind == "let" and symbols(step.expression) and symbols(step.expression) <= names:
                names.add(step.name)
        return names

    def expression(self, e: Expression) -> str:
        if isinstance(e, Call) and e.function in ("sin", "cos"):
            kind = "short" if symbols(e) <= self.short else "long"
            return f"lanes_{kind}_{e.function}({self.expression(e.argument)})"
        return super().expression(e)


class Margin(Infix):
    """The text of what a bound of the derivation demands to be positive."""

    def __init__(self, names: dict[str, str], prefix: str):
        self.names, self.prefix = names, prefix

    def symbol(self, name: str) -> str:
        return self.names[name]

    def call(self, function: str, argument: str) -> str:
        return f"{self.prefix}_{function}({argument})"

    def ratio(self, p: int, q: int) -> str:
        return f"{self.prefix.upper()}_NUMBER({p})/{q}"


def pair(
    effects: EffectSet,
    functions: Sequence[Function],
    bounds: Sequence[dict],
    names: dict,
    stem: str,
    prefix: str,
    is_float: bool = False,
) -> Pair:
    """The pair of files of a set.

    functions  with shared subexpressions, in the order in which they stand in the files
    bounds     of the derivation's data: field, positive or not_negative, reason
    names      the derivation's symbols: {symbol: its argument in the code}
    stem       of the files' names
    prefix     of all names that the header declares
    is_float   whether the number type is float without a macro that says so
    """
    prepare = next(f for f in functions if f.prepares)
    in_c = [CFunction(f, prefix) for f in functions]
    values = {
        "set": effects, "prefix": prefix, "PREFIX": prefix.upper(), "functions": in_c, "header": f"{stem}.h",
        "model": Model(effects.fields), "constants": prepare.inputs,
        "calls": set().union(*map(called_functions, functions)) | {"cos"},  # of the functions and the bounds
        "short_angles": short_angles(), "largest_square": LARGEST,
        "bounds": _margins(prepare, bounds, names, prefix), "is_float": is_float,
        "wrong_sign": lambda array, value: wrong_sign(own_sign(array, bounds), value),
    }  # fmt: skip
    for sign in SIGNS:
        values[sign] = [a.name for a in prepare.inputs if own_sign(a, bounds) == sign]
    values |= {"motion": "", "inputs": [], **_motion(effects, functions, prefix)}
    values["prepare_prototype"] = _prepare(values["model"], prefix)
    values["layout_prototype"] = _check_layout(values["model"], prefix)
    values["layout"] = ", ".join(f"sizeof({prefix}_{name})" for name in _structs(values["model"]))
    values["checked"] = _checked(values["model"], prefix, bool(values["motion"]))
    there = {f.name for f in functions} | {"check_layout"} | set(values.get("prototypes", ()))
    contents = {title: [name for name in wanted if name in there] for title, wanted in CONTENTS.items()}
    listed = set().union(*contents.values())
    usual = [f.name for f in functions if not f.name.endswith("_sharp")]  # the other form stands beside
    contents["Further"] = [name for name in usual if name not in listed]
    values["contents"] = [(title, [f"{prefix}_{name}" for name in names]) for title, names in contents.items() if names]
    values["public"] = list(dict.fromkeys([*chain.from_iterable(contents.values()), *(f.name for f in functions)]))
    types = template("types.h", **values)
    motion = template("motion.h", **values) if values["motion"] else ""
    header = template("pair.h", **values | {"types": types, "motion": motion, "example": _example(values)})
    declarations = [
        types,
        *(f"{f.prototype};" for f in in_c if not f.function.prepares),
        f"{values['prepare_prototype']};",
        motion,
    ]
    return Pair(header, template("pair.c", **values), "\n".join(declarations))


def kernel_in_lanes(effects: EffectSet, functions: Sequence[Function]) -> str:
    """The kernel of the compiled engine: the functions on vectors, without `prepare`."""
    own = [LanesFunction(f, "lanes") for f in functions if not f.prepares]
    return template(
        "kernel_in_lanes.h",
        set=effects, functions=own, model=Model(effects.fields), prefix="lanes", PREFIX="LANES",
        calls=set().union(*(called_functions(f.function) for f in own)),
        short_angles=short_angles(),
    )  # fmt: skip


def _prepare(model: Model, prefix: str) -> str:
    roller = [f"{prefix}_roller *roller"] if model.roller else []
    parameters = [f"const {prefix}_vehicle *vehicle", f"{prefix}_wheel *wheel", *roller, f"{prefix}_model *model"]
    return prototype("int", f"{prefix}_prepare", parameters)


def _structs(model: Model) -> list[str]:
    """The structs whose layout the caller and the source file must agree about, besides the state."""
    return ["vehicle", "wheel", *(["roller"] if model.roller else []), "model"]


def _check_layout(model: Model, prefix: str) -> str:
    return prototype("int", f"{prefix}_check_layout", [f"size_t {name}" for name in _structs(model)])


def _checked(model: Model, prefix: str, has_motion: bool) -> list[tuple[str, str, str]]:
    """The functions by which a caller first uses a model: name, prototype of the one that checks before, arguments."""
    written = ["wheel", *(["roller"] if model.roller else []), "model"]
    parameters = {
        "prepare": [f"const {prefix}_vehicle *vehicle", *(f"{prefix}_{name} *{name}" for name in written)],
        "start": [f"const {prefix}_model *model", f"{prefix}_state *state"],
    }
    return [
        (
            name,
            prototype("static inline int", f"{prefix}_{name}_checked", taken),
            ", ".join(each.partition("*")[2] for each in taken),
        )
        for name, taken in parameters.items()
        if name == "prepare" or has_motion
    ]


def _motion_prototypes(prefix: str, inputs: Sequence[Array], has_derivatives: bool, has_impact: bool) -> dict[str, str]:
    """The declarations of the functions that pass joints, by name."""
    model, state = f"const {prefix}_model *model", f"{prefix}_state *state"
    given = [f"const {prefix}_inputs *inputs"] if inputs else []
    parameters = {
        "joint": (f"{prefix}_real", [model]),
        "start": ("int", [model, state]),
        "twist_from_nu": ("void", [model, f"const {prefix}_real *nu", f"{prefix}_real *twist"]),
        "nu_from_twist": ("void", [model, f"const {prefix}_real *twist", f"{prefix}_real *nu"]),
        "contact_from_angle": ("int", [model, f"{prefix}_real angle", f"{prefix}_real *chi", "int *contact"]),
        "time_to_joint": (f"{prefix}_real", [model, f"const {state}", "int *wheel"]),
        "switch": ("int", [model, "int law", state]),
        "step": ("int", [model, "int law", *given, f"{prefix}_real h", state]),
        # within the source file
        "first_joint": (
            f"static {prefix}_real", [model, f"const {state}", f"{prefix}_real *chi_dot", "int *wheel"]
        ),
        "advance": ("static void", [model, *given, f"{prefix}_real h", state]),
        "phase": (f"static {prefix}_real", [model, *given, f"{prefix}_real h", state, f"{prefix}_real *turned"]),
        "exchange_slots": (
            f"static {prefix}_real", [f"{prefix}_real *axial", "int slots", "int direction", f"{prefix}_real leaving"]
        ),
    }  # fmt: skip
    if has_derivatives:
        real, known, along = f"{prefix}_real", f"const {state}", f"{prefix}_along *along"
        acting, space = [model, "int law", *given, f"{real} h", state], [f"{real} *derivatives", f"{real} *work"]
        before = ["int law", f"const {real} *nu"] if has_impact else []
        parameters |= {
            "step_derivatives": ("int", [*acting, *space]),
            # within the source file
            "steps": ("static int", [*acting, along]),
            "start_along": ("static void", [model, f"{real} *rows", f"{real} *work", along]),
            "slopes_of_rates": (
                "static void",
                [model, *given, known, f"const {real} *x", f"const {along}", f"{real} *rates", f"{real} *slopes"],
            ),
            "follow_rates": ("static void", [model, *given, known, along]),
            "move_time": ("static void", [f"const {along}", "int column", f"{real} time"]),
            "carry": ("static void", [f"const {along}", f"{real} h", f"{real} h_moved"]),
            "follow_phase": ("static void", [model, *given, known, f"{real} length", along]),
            "follow_switch": ("static void", [model, *before, known, along]),
        }  # fmt: skip
    return {name: prototype(result, f"{prefix}_{name}", taken) for name, (result, taken) in parameters.items()}


def own_sign(array: Array, bounds: Sequence[dict]) -> str:
    """What the derivation's bounds say of a constant by itself: one of SIGNS, or nothing."""
    own = (sign for b in bounds if b["field"] == array.name for sign in SIGNS if isinstance(b.get(sign), str))
    return next(own, "")


def wrong_sign(sign: str, value: str) -> str:
    """A further condition on which a constant is refused, as C text."""
    return {"positive": f" || !({value} > 0)", "not_negative": f" || {value} < 0"}.get(sign, "")


def _margins(prepare: Function, bounds: Sequence[dict], names: dict[str, str], prefix: str) -> list[dict]:
    """The bounds on several constants together as C text; what this set does not take is zero in them."""
    given = {a.name for a in prepare.inputs}
    codes = {symbol: code for symbol, code in names.items() if NUMBER.match(code) and code.partition("[")[0] in given}
    texts = {symbol: f"vehicle->{code}" for symbol, code in codes.items()}
    texts |= {
        "N": f"{prefix.upper()}_NUMBER(vehicle->wheels)",
        "n": f"{prefix.upper()}_NUMBER(vehicle->rollers_per_wheel)",
    }
    texts["pi"] = f"{prefix.upper()}_NUMBER(3.141592653589793238462643383279502884L)"
    canonical, margins = Canonical(), []
    for bound in bounds:
        if not isinstance(bound.get("positive"), list):  # a bound of one constant by itself
            continue
        expression = canonical.read(bound["positive"])
        absent = {name: ZERO for name in symbols(expression) - texts.keys()}
        margin = canonical.substituted(expression, absent)
        if bound["field"] in given and not isinstance(margin, Symbol):
            zero = sorted({names[name].partition("[")[0] for name in absent if name in names})
            reason = "; ".join([bound["reason"], *(f"{name} is 0 here" for name in zero)])
            text = Margin(texts, prefix).expression(margin)
            margins.append({"field": bound["field"], "reason": reason, "margin": text})
    return margins


def _motion(effects: EffectSet, functions: Sequence[Function], prefix: str) -> dict:
    """What the templates of steps and switches need to know; nothing for a set that lacks their functions."""
    named = {f.name: f for f in functions}
    if not all(name in named for name in STEP_NEEDS):
        return {}
    if any(a.name == GIVEN_TO_EACH for f in functions for a in f.inputs) or CHANGES in named:
        return {}
    if any(a.name == "chi" for a in named["wheel_speeds"].inputs):  # the template's steps know rates of nu alone
        return {}
    if OWN_COUNTS in {field.name for field in effects.fields}:
        return {}
    dynamics = named["forward_dynamics"]
    carried = next((what for name, what in CARRIED.items() if name in named), "")
    per_wheel = {"": 0, "momenta": "2*model->wheels", "axial": "model->wheels*(model->rollers_per_wheel - 1)"}[carried]
    stage = {"nu": "stage", "chi": "stage + 6", "heading": "stage[5]", "roller_drag": "scratch + 2*wheels"}
    if "momenta" in named:
        stage["momenta"] = {"": "state->momenta", "momenta": "stage + 6 + wheels", "axial": "scratch"}[carried]
    inputs = [a for a in dynamics.inputs if a.name not in stage]
    derivatives = {} if carried else _derivatives(named)
    return {
        "motion": True, "prototypes": _motion_prototypes(prefix, inputs, bool(derivatives), "impact" in named),
        "inputs": inputs,
        "derivatives": derivatives,
        "free": "momenta" in named, "impact": "impact" in named,
        "carried": carried, "carried_size": per_wheel, "work": _work(carried),
        "arguments": [stage.get(a.name, f"inputs->{a.name}") for a in dynamics.inputs],
    }  # fmt: skip


def _derivatives(named: dict[str, Function]) -> dict:
    """What the templates need for the derivatives of a step; nothing for a set without those of the rates."""
    if not all(name in named for name in DERIVATIVES_NEED):
        return {}
    dynamics, kinematics = (named[name] for name in DERIVATIVES_NEED)
    kept = [a for a in (*dynamics.outputs, *kinematics.outputs) if a.name != "nu_dot"]
    parts, place = [], "scratch"
    for a in kept:
        parts.append((a.name, place))
        place = f"{a.name} + {times(*(COUNT_OF.get(size, size) for size in a.shape))}"
    known = {"nu": "x", "chi": "x + 6", "heading": "x[5]", "momenta": "state->momenta", "nu_dot": "rates"}
    given_to = {a.name: known.get(a.name, f"inputs->{a.name}") for a in dynamics.inputs}
    outputs = [known.get(a.name, a.name) for a in dynamics.outputs]
    torque = any(a.name == "nu_dot_by_torque" for a in kept)
    free = "momenta" in named
    moving, columns, given = "(6 + (wheels))", ["6 + (wheels)"], ["6 + (wheels)"]
    if free:
        columns.append("(wheels)*((rollers_per_wheel) - 1)")
        given.append("2*(wheels)")
    size = " + ".join(columns)
    if torque:
        columns.append("(wheels)")
        given.append("(wheels)")
    stages = f"(4*{moving} + 2)*({' + '.join(given)})"
    scratch = sum(prod(size for size in a.shape if isinstance(size, int)) for a in kept if "N" not in a.shape)
    each = sum(prod(size for size in a.shape if isinstance(size, int)) for a in kept if "N" in a.shape)
    return {
        "parts": parts, "dynamics": [*given_to.values(), *outputs], "torque": torque,
        "heading": any(a.name == "nu_dot_by_heading" for a in kept), "size": size, "columns": " + ".join(columns),
        "work": f"{' + '.join(columns)} + {stages} + 7*{moving} + {scratch} + {each}*(wheels)",
    }  # fmt: skip


def _work(carried: str) -> str:
    """The numbers of work space of a state, as C text.

    They hold what the sums of a step have lost by rounding, four vectors of all that is integrated, and what the rates
    need.
    """
    slots = "(wheels)*((rollers_per_wheel) - 1)"
    return {
        "": "30 + 6*(wheels)",
        "momenta": f"30 + 17*(wheels) + {slots}",
        "axial": f"30 + 8*(wheels) + 5*{slots}",
    }[carried]


def _example(values: dict) -> list[str]:
    """The example of the header, which the tests compile and run as it stands."""
    return template("example.c", **values).splitlines()
