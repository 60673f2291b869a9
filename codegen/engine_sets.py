"""What the compiled engine must know of a set of effects, as text: the header engine_set.h of its folder.

The engine (runtime/csrc) knows no effect by name. It has a core (nu, and what else must be solved for), followers (chi,
the pose) and accounts (integrals that feed nothing back); this file says which quantities those are and which generated
functions give their rates, and the template writes the calls. No other file calls a generated function for the engine.
"""

from dataclasses import dataclass

from .filling import template
from .programs import Array, EffectSet, Function
from .specialise import Registry, State

CORE, ACCOUNT = "core", "account"
INPUTS = ("torque", "damping", "bearing_torque")  # of the kernel: affine in time between two events
# How rollers that spin freely are known: their axial speeds are constant in a phase, or follow from two momenta of their
# wheel; or the spin of each is a part of the core.
CONSTANT, COLLAPSED, SINGLE = "constant", "collapsed", "single"
# Functions that the engine calls as they are, at transitions and for the followers.
PLAIN = ("wheel_speeds", "wheel_rates", "contact_axial", "pose_rates", "momenta", "impact")
# What gives nu', with the spins' rates where these are in the core; and the same where axles stick, whose bearings'
# torques are an input.
DYNAMICS = {False: "forward_dynamics", True: "accelerations"}
HELD = {False: "held_dynamics", True: "held_accelerations"}
BEARING_INPUT = "bearing_torque"
SIZES = {"N": "wheels", "n-1": "(rollers - 1)"}


def size_of(array: Array) -> str:
    """The number of elements, in C."""
    return "*".join(str(SIZES.get(size, size)) for size in array.shape) or "1"


@dataclass(frozen=True)
class Call:
    """A call of a generated function: its arguments in C after the model, and the locals that it needs."""

    function: Function
    arguments: tuple[str, ...]
    locals: tuple[str, ...] = ()


class EngineSet:
    """The facts of one set of effects, for the template."""

    def __init__(self, effects: EffectSet, registry: Registry):
        self.set = effects
        rates = {array.name: array for f in effects.functions for array in f.outputs}
        present = registry.states_of(effects.base, effects.effects)
        self.core = [state for state in present if state.kind == CORE]
        self.accounts = [state for state in present if state.kind == ACCOUNT]
        self.arrays = {state.name: rates[state.rate] for state in self.core}
        names = [state.name for state in self.core]
        self.rollers = SINGLE if "spins" in names else COLLAPSED if "momenta" in names else CONSTANT
        asked = [array.name for array in self.function(DYNAMICS[self.rollers == SINGLE]).inputs]
        self.inputs = [name for name in INPUTS if name in asked]
        self.heading = "heading" in asked
        self.acted = bool(present or self.inputs or self.heading)
        self.holds = effects.function(HELD[self.rollers == SINGLE]) is not None
        plain = (*PLAIN, "mass_matrix") if self.holds else PLAIN
        self.plain = [f for f in map(effects.function, plain) if f is not None]

    @property
    def solving(self) -> bool:
        """Whether the set has functions for sharp tips beside the usual ones."""
        return self.set.function("forward_dynamics_sharp") is not None

    def called(self, function: Function) -> str:
        """The name of a function in C."""
        has_form = self.set.function(f"{function.name}_sharp") is not None
        return f"SOLVED({function.name})" if has_form else f"lanes_{function.name}"

    def function(self, name: str) -> Function:
        found = self.set.function(name)
        assert found is not None, f"{self.set.name} has no function {name}"
        return found

    def offset(self, state: str) -> str:
        """Where a state begins in the core."""
        before = [size_of(self.arrays[s.name]) for s in self.core[: [s.name for s in self.core].index(state)]]
        return " + ".join(before)

    def place(self, base: str, state: str) -> str:
        offset = self.offset(state)
        return f"{base} + {offset}" if offset else base

    @property
    def core_size(self) -> str:
        return " + ".join(size_of(self.arrays[state.name]) for state in self.core) or "0"

    @property
    def parts(self) -> list[str]:
        """Where each state of the core ends, in C."""
        sizes = [size_of(self.arrays[state.name]) for state in self.core]
        return [" + ".join(sizes[: k + 1]) for k in range(len(sizes))]

    @staticmethod
    def parameters(function: Function) -> list[str]:
        """The parameters of the function that the engine calls in its place."""
        own = [f"const lanes_t *{a.name}" if a.shape else f"lanes_t {a.name}" for a in function.inputs]
        return ["const int wheels", "const vehicle_t *v", *own, *(f"lanes_t *{a.name}" for a in function.outputs)]

    @property
    def bearing_input(self) -> int:
        """The place of the bearings' torques among the inputs."""
        return self.inputs.index(BEARING_INPUT)

    def core_calls(self) -> list[Call]:
        """What gives the rates of the core, in order; the last gives nu'."""
        dynamics = DYNAMICS[self.rollers == SINGLE]
        others = dict.fromkeys(state.function for state in self.core if state.function != dynamics)
        return self._rate_calls([*others, dynamics])

    def _rate_calls(self, names: list[str]) -> list[Call]:
        rates = {state.rate: self.place("core_dot", state.name) for state in self.core}
        targets = {"nu_dot": "nu_dot", "held_force": "at->held_force"} | rates
        return self._calls([self.function(name) for name in names], targets)

    def held_call(self) -> Call:
        """The dynamics where axles stick."""
        return self._rate_calls([HELD[self.rollers == SINGLE]])[0]

    def slope_calls(self) -> list[Call]:
        """What gives the slopes of the core's rates, each in its own number: by friction."""
        slopes = {f"{s.name}_{kind}": self.place(kind, s.name) for s in self.core for kind in ("slope", "chord")}
        functions = [f for f in self.set.functions if any(array.name in slopes for array in f.outputs)]
        return self._calls(functions, slopes)

    def account_calls(self) -> list[Call]:
        """What gives the rates of the accounts."""
        rates = {state.rate: f"account_dot + {k}" for k, state in enumerate(self.accounts)}
        names = dict.fromkeys(state.function for state in self.accounts)
        return self._calls([self.function(name) for name in names], rates)

    def start_calls(self) -> list[Call]:
        """What gives the core from the axial speeds of the free rollers, nu and chi."""
        names = {state.name: state.name for state in self.core} | {"spins": "spins_from_axial"}
        functions = {state.name: self.function(names[state.name]) for state in self.core}
        return [
            Call(function, (*(array.name for array in function.inputs), self.place("core", name)))
            for name, function in functions.items()
        ]

    @staticmethod
    def power(state: State) -> int:
        """The power of |nu| with which its size grows."""
        return 2 if state.size == "energy" else 1

    def later_call(self) -> Call:
        """What gives the axial speeds later in a phase."""
        function = self.function("axial_speeds" if self.rollers == SINGLE else "axial_after")
        places = {name: name for name in ("nu", "chi", "axial")}
        if self.rollers == SINGLE:
            return Call(function, ("nu", "chi", self.place("core", "spins"), "later"))
        places |= {
            "momenta_before": self.place("before", "momenta"),
            "momenta_after": self.place("core", "momenta"),
            "elapsed": "elapsed",
        }
        return Call(function, (*(places[array.name] for array in function.inputs), "later"))

    def _calls(self, functions: list[Function], targets: dict[str, str]) -> list[Call]:
        """The calls, each with locals for the outputs that are no targets. Locals serve the later calls as inputs."""
        plain = ("nu", "chi", "heading", "momenta", "directions", "absent")
        known = {name: f"at->{name}" for name in plain}
        known |= {state.name: self.place("at->core", state.name) for state in self.core}
        known |= {name: f"at->inputs + {k}*wheels" if k else "at->inputs" for k, name in enumerate(self.inputs)}
        calls = []
        for function in functions:
            own, arguments = [], [known[array.name] for array in function.inputs]
            for array in function.outputs:
                if array.name in targets:
                    arguments.append(targets[array.name])
                    continue
                size = size_of(array).replace("wheels", "MOST_WHEELS")
                own.append(f"{array.name}[{size}]")
                arguments.append(array.name)
                known[array.name] = array.name
            calls.append(Call(function, tuple(arguments), tuple(own)))
        return calls


MOTION = ("forward_dynamics", "wheel_speeds", "pose_rates")  # functions of a set that the engine can run


def engine_set(effects: EffectSet, registry: Registry) -> str:
    """The text of the header; a set that the engine cannot run has none.

    Where wheels may slip, their rates do not follow from nu, as the engine takes it.
    """
    runs = all(map(effects.function, MOTION)) and effects.function("slip_dynamics") is None
    return template("engine_set.h", facts=EngineSet(effects, registry)) if runs else ""
