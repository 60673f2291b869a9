"""What the compiled engine must know of a set of effects, as text: the header engine_set.h of its folder.

The engine (runtime/csrc) knows no effect by name. It has a core (nu, and what else must be solved for), followers (chi,
the pose) and accounts (integrals that feed nothing back); this file says which quantities those are and which generated
functions give their rates, and the template writes the calls. No other file calls a generated function for the engine.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from .along import SUFFIX
from .expressions import Number
from .filling import template
from .programs import Array, EffectSet, Function
from .specialise import OFTEN_ABSENT, Registry, State, without

CORE, ACCOUNT = "core", "account"
# Inputs of the kernel: affine in time between two events.
INPUTS = ("torque", "damping", "bearing_torque", "contact_bearing", "sticks", "presses")
# How rollers that spin freely are known: their axial speeds are constant in a phase, follow from two momenta of their
# wheel, or are each a part of the core.
CONSTANT, COLLAPSED, SINGLE = "constant", "collapsed", "single"
SPINS = "spins"  # the core has these in the place of the axial speeds, where wheels roll
# Functions that the engine calls as they are, at transitions and for the followers.
PLAIN = ("wheel_speeds", "wheel_rates", "contact_axial", "pose_rates", "momenta")
IMPACT = "impact"  # the same; which has more inputs where a switch changes the wheels' rates
EXCESS = {"turn_excess": "rate_excess"}  # such inputs, and what the engine calls them
ROWS = "row_constants"  # of wheels with two rows of rollers: what of the constants changes with the row that carries
OF_ROLLERS = ("spins_from_axial", "axial_speeds")  # which sensitivities call beside these
SLIP = "slip_dynamics"  # instead of forward_dynamics where wheels may slip; it gives the rates of their speeds, too
STANDS = "standing_dynamics"  # instead of these where axles may stick beside them
SPRINGS = "spring_dynamics"  # instead of slip_dynamics where loads come from springs, on which the platform tilts
SPRUNG = "sprung_dynamics"  # instead of ground_dynamics there
TILT_ACCELERATION = "tilt_rate_dot"  # which these give, too
DISKS = "disk_dynamics"  # instead of slip_dynamics where rollers may stick on their disks
BEARINGS = "bearing_dynamics"  # instead of all of these where rollers may stick beside contacts that do
GRIPS = "ground_dynamics"  # instead of these where contacts may also stick on the ground: with their modes as an input
SUPPORTS = "support_state"  # which the engine calls where contacts may stick on springs
LEANING = "leaning_axial"  # the same, of free rollers
ON_THE_GROUND = ("slip_forces", "sliding_forces")  # which the engine calls then
HEADING_INPUT = (
    "slip_heading"  # beside the inputs then, for rows alone: the direction in which a contact begins to slip
)
PRELOAD = "slip_preload"  # what that is of a wheel that stands on its joint
MOMENT_INPUTS = ("bearing_cos", "bearing_sin")  # the same: what free rollers' bearings do to the wheels' momenta
MODES = ("sticks", HEADING_INPUT, *MOMENT_INPUTS)  # inputs that a phase holds
OF_CONTACTS = ("ground_push", "ground_force", "slip_dot")  # of a point: forces given to contacts, and what follows
OF_STANDING = ("load", "friction", "next_before", "next_share")  # of a point whose wheels may stand and slip
# Outputs, and the inputs of other functions that they are.
ALIASES = {"coulomb_rates": "coulomb_momenta_dot", "bearing_rates": "bearing_momenta_dot"}
NEXT_SPEEDS, NEXT_SPEEDS_DOT = "next_omega", "next_omega_dot"  # of rollers beside the joint of wheels that stand on it
RATES, CONTACT_SPEEDS = "rates", "contact_omega"  # these speeds: of the wheels, and of the rollers in contact
# What gives nu', with the spins' rates where these are in the core; and the same where bearings stick, whose torques
# are inputs: of axles, of rollers in contact, and in a function of its own of free rollers too.
DYNAMICS = {False: "forward_dynamics", True: "accelerations"}
HELD = {False: "held_dynamics", True: "held_accelerations"}
STUCK = "stuck_accelerations"
TURNING = "_turning"  # behind the name of what gives nu' while no wheel stands on its joint
BARE = "_bare"  # the same where a scene has none of OFTEN_ABSENT
AXES = (1, 2, 3)
# The motions that wheels which stand allow, where none stands: all of them.
FREE = {f"direction_{row}{column}": Number(Fraction(row == column)) for row in AXES for column in AXES}
FREE |= {f"absent_{axis}": Number(Fraction(0)) for axis in AXES}
SLIP_SPINS = "slip_spins"  # of rollers in contact, where wheels slip and rollers stick
OF_AXLES = ("axle_sticks", "axle_holding")  # of a point where wheels slip and axles stick
OF_SPINS = ("free_sticks", "free_bearing", "free_holding")  # of a point then
REACHES = "contact_reaches"  # of rollers in contact, where wheels slip and rollers stick: their arms
SERIES = "slip_contact_loss"  # of massless rollers that stick where wheels may slip: bearing and ground in series
CORNERS = "corner_forces"  # of these beside contacts that stick: where both move
# Of a point, beside these, where wheels slip and rollers stick; and of massless ones beside contacts that stick.
OF_DISKS = ("contact_sticks", "contact_holding", "contact_spin_dot", "spins_dot", "yaw_mass")
OF_STRIPS = ("contact_sticks", "contact_holding", "contact_spin", "ground_yield")
# Functions that the engine calls where a set has them, with what they take and give; neutral ones stand in their place.
WHERE_THERE = (
    ("contact_axial", ("nu", "chi"), ("axial",)),
    ("momenta", ("axial",), ("momenta",)),
    ("mass_matrix", ("chi",), ("matrix",)),
    ("spins_from_axial", ("nu", "chi", "axial"), ("spins",)),
    (CORNERS, ("chi", "slip_direction", "load", "friction", "contact_bearing"), ("corner_force", "corner_yield")),
    ("sliding_forces", ("slip_direction", "load", "friction"), ("sliding_force", "sliding_slope")),
    (SUPPORTS, ("tilt", "tilt_rate", "presses"), ("support_loads", "support_margins", "support_rises")),
    (LEANING, ("nu", "chi", "tilt", "tilt_rate"), ("axial",)),
)
FEW = 2  # effects of OFTEN_ABSENT: a set with no more has no form of nu' without them
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
        self.set, self.turning, self.bare = effects, TURNING, BARE
        rates = {array.name: array for f in effects.functions for array in f.outputs}
        present = registry.integrated(effects)
        self.sprung = effects.function(SPRUNG) is not None
        self.grips = self.sprung or effects.function(GRIPS) is not None
        self.tilts = self.sprung or effects.function(SPRINGS) is not None
        self.slips = self.grips or self.tilts or effects.function(SLIP) is not None
        names = {state.name for state in present}
        self.spins = SPINS in names
        known = (BEARINGS, STANDS, SPRUNG, GRIPS, DISKS, SPRINGS)
        slipping = next((name for name in known if effects.function(name)), SLIP)
        self.stands = slipping in (BEARINGS, STANDS)
        self.in_series = effects.function(SERIES) is not None
        self.strips = self.in_series and self.grips  # what their bearings take cuts ellipses of the ground's friction
        self.disks_stick = slipping in (BEARINGS, DISKS) and not self.in_series
        self.dynamics = slipping if self.slips else DYNAMICS[self.spins]
        dynamics = self.function(self.dynamics)
        own = {array.name for array in dynamics.outputs if self.slips and "n-1" not in array.shape}
        if self.sprung:  # what follows from nu where contacts stick is coupled with it, and no tilt
            own.discard(TILT_ACCELERATION)
        own.discard(NEXT_SPEEDS_DOT)  # which is friction of its own
        # First what is coupled with nu: the speeds whose rates the dynamics gives.
        self.core = sorted((s for s in present if s.kind == CORE), key=lambda state: state.rate not in own)
        self.coupled = sum(state.rate in own for state in self.core)
        self.accounts = [state for state in present if state.kind == ACCOUNT]
        self.arrays = {state.name: rates[state.rate] for state in present}
        asked = [array.name for array in dynamics.inputs]
        self.inputs = [name for name in INPUTS if name in asked]
        self.inputs += [HEADING_INPUT] if self.grips else []
        moments = self.stands and (self.disks_stick or self.in_series)  # of massless rollers 0
        self.inputs += MOMENT_INPUTS if moments else ()
        self.heading = "heading" in asked
        self.chi_feeds_back = any(array.name == "chi" for array in self.function("wheel_speeds").inputs)
        self.rollers = SINGLE if {"axial", SPINS} & names else COLLAPSED if "momenta" in names else CONSTANT
        self.rows = effects.function(ROWS) is not None
        self.fields = {field.name for field in effects.fields}
        self.arcs = "arc_middle" in self.fields  # whether rollers have several, of which one carries
        self.pivots = "turns" in self.fields  # whether wheels may stand on their joint
        rows = effects.function(ROWS)
        self.of_rows = {array.name for array in (*rows.inputs, *rows.outputs)} if rows is not None else set()
        self.folds = "row_factors" in self.of_rows
        self.acted = bool(present or self.inputs or self.heading or self.pivots)  # these have guards
        self.spins_stick = self.spins and effects.function(STUCK) is not None
        self.axles_stick = OF_AXLES[-1] in own
        self.held = STUCK if self.spins_stick else HELD[self.spins]
        self.holds = effects.function(self.held) is not None and not self.slips
        inertia = self.holds or (self.acted and not self.slips)
        self.zeros: dict[str, str] = {}  # states that some functions take and no rate depends on, and where they are
        further = ["mass_matrix"] * inertia + ["spins_from_axial"] * (self.spins_stick or self.disks_stick)
        further += [CORNERS] * self.strips + [SUPPORTS, LEANING] * self.sprung
        self.impact = effects.function(IMPACT)
        plain = (*PLAIN, *further, *(ON_THE_GROUND[1:] if self.grips else []))
        self.plain = [f for f in map(effects.function, plain) if f is not None]
        here = {f.name for f in self.plain}
        self.absent = [entry for entry in WHERE_THERE if entry[0] not in here]

    @property
    def often_absent(self) -> list[str]:
        """The effects that the form of nu' leaves out for scenes without them; none where a set has no such form."""
        own = [name for name in OFTEN_ABSENT if name in self.set.effects]
        is_worth_while = len(own) > FEW and not (self.spins or self.disks_stick or self.in_series)
        return own if is_worth_while else []

    @property
    def solving(self) -> bool:
        """Whether the set has functions for sharp tips beside the usual ones."""
        return self.set.function("forward_dynamics_sharp") is not None

    def called(self, function: Function, case: str = "") -> str:
        """The name of a function in C, in one of its cases."""
        has_form = self.set.function(f"{function.name}_sharp") is not None
        name = f"{function.name}{case}"
        return f"SOLVED({name})" if has_form else f"lanes_{name}"

    def function(self, name: str) -> Function:
        found = self.set.function(name)
        assert found is not None, f"{self.set.name} has no function {name}"
        return found

    def offset(self, state: str) -> str:
        """Where a state begins in the core, or among the accounts."""
        kind = self.core if any(s.name == state for s in self.core) else self.accounts
        before = [size_of(self.arrays[s.name]) for s in kind[: [s.name for s in kind].index(state)]]
        return " + ".join(before)

    def has(self, state: str) -> bool:
        return any(s.name == state for s in self.core)

    def place(self, base: str, state: str) -> str:
        offset = self.offset(state)
        return f"{base} + {offset}" if offset else base

    @property
    def impact_arguments(self) -> list[str]:
        """What the engine gives to the impact, and what that gives."""
        assert self.impact is not None
        return [EXCESS.get(a.name, a.name) for a in (*self.impact.inputs, *self.impact.outputs)]

    @property
    def bearing_rates(self) -> tuple[str, ...]:
        """The states that stand together and are rates of bearings, or where wheels slip speeds of what these hold."""
        if self.spins_stick:
            return (SPINS,)
        return ((RATES,) if self.axles_stick else ()) + ((CONTACT_SPEEDS, "axial") if self.disks_stick else ())

    @property
    def bearing_count(self) -> str:
        """How many bearings have such rates, or one that follows from the state, in C."""
        in_series = ["wheels"] * self.in_series
        return " + ".join([*(size_of(self.arrays[name]) for name in self.bearing_rates), *in_series])

    @property
    def core_size(self) -> str:
        return " + ".join(size_of(self.arrays[state.name]) for state in self.core) or "0"

    @property
    def account_size(self) -> str:
        return " + ".join(size_of(self.arrays[state.name]) for state in self.accounts) or "0"

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

    def place_of_input(self, name: str) -> int:
        """The place of an input among the inputs, -1 where it is none."""
        return self.inputs.index(name) if name in self.inputs else -1

    @staticmethod
    def neutral_parameters(inputs: Sequence[str], outputs: Sequence[str]) -> list[str]:
        """The parameters of a function that the set has not, in its place."""
        own = [f"const lanes_t *{name}" for name in inputs]
        return ["const int wheels", "const vehicle_t *v", *own, *(f"lanes_t *{name}" for name in outputs)]

    @property
    def headings_input(self) -> int:
        """The place among the inputs of the directions in which contacts begin to slip, -1 where there are none."""
        return self.place_of_input(HEADING_INPUT)

    def core_calls(self, dynamics: str = "") -> list[Call]:
        """What gives the rates of the core, in order; the last is `dynamics`, or that of the set."""
        solving = self.function(dynamics or self.dynamics)
        given = {array.name for array in solving.outputs} | {state.rate for state in self.core[: self.coupled]}
        states = self._giving([state for state in self.core if state.rate not in given])
        needs_momenta = self.rollers == SINGLE and any(a.name == "momenta" for a in solving.inputs)
        functions = ([self.function("momenta")] if needs_momenta else []) + states + [solving]
        rates = {state.rate: self.place("at->core_dot", state.name) for state in self.core}
        targets = {"nu_dot": "nu_dot", "held_force": "at->held_force"}
        targets |= {name: f"at->{name}" for name in (*OF_CONTACTS, *OF_AXLES, *OF_SPINS, *OF_STANDING)}
        of_rollers = OF_DISKS if self.disks_stick else OF_STRIPS if self.strips else ()
        targets |= {name: f"at->{name}" for name in of_rollers}
        return self._calls(functions, targets | rates)

    def rolling_calls(self) -> list[Call]:
        """The same where all contacts stick: the dynamics of rolling. Empty where that needs what a point has not."""
        rolling = self.set.function(DYNAMICS[False])
        if not self.grips or self.tilts or rolling is None:
            return []
        known = {"nu", "chi", "heading", "momenta", *(state.name for state in self.core), *self.inputs}
        of_core = self._giving(self.core[self.coupled :])
        known |= {ALIASES.get(array.name, array.name) for f in of_core for array in f.outputs}
        return self.core_calls(rolling.name) if {array.name for array in rolling.inputs} <= known else []

    @property
    def moving(self) -> list[str]:
        """The inputs that change within a phase."""
        return [name for name in self.inputs if name not in MODES]

    def slip_velocities(self) -> Call:
        """What gives the slip velocities alone, in some states: without forces of the ground."""
        function = self.function(ON_THE_GROUND[0])
        of_core = {state.name: self.place("core", state.name) for state in self.core}
        known = of_core | {"nu": "nu", "chi": "chi", "contact_sticks": "rigid"}
        return Call(function, (*(known.get(array.name, "none") for array in function.inputs), "slip", "force"))

    def slip_spins(self) -> Call:
        """What gives the spins of rollers in contact where wheels slip, and what holds those that stick."""
        function = self.function(SLIP_SPINS)
        return Call(function, tuple(array.name for array in (*function.inputs, *function.outputs)))

    def slip_call(self) -> Call:
        """What gives the slip velocities of the contacts, and with them the ground's forces."""
        (call,) = self._calls([self.function(ON_THE_GROUND[0])], {"slip": "slip"})
        return call

    def held_call(self) -> Call:
        """The dynamics where bearings stick."""
        return self.core_calls(self.held)[-1]

    def slope_calls(self) -> list[Call]:
        """What gives the slopes of the core's rates, each in its own number: by friction."""
        slopes = {f"{s.name}_{kind}": self.place(kind, s.name) for s in self.core for kind in ("slope", "chord")}
        functions = [f for f in self.set.functions if any(array.name in slopes for array in f.outputs)]
        return self._calls(functions, slopes)

    def account_calls(self) -> list[Call]:
        """What gives the rates of the accounts."""
        rates = {state.rate: self.place("account_dot", state.name) for state in self.accounts}
        return self._calls(self._giving(self.accounts), rates)

    def start_calls(self) -> list[Call]:
        """What gives the core from the axial speeds of the free rollers, at nu and chi."""
        calls = []
        for state in self.core:
            function = self.set.function("spins_from_axial" if state.name == SPINS else state.name)
            if function is not None:  # axial speeds themselves need none
                inputs = (array.name for array in function.inputs)
                calls.append(Call(function, (*inputs, self.place("core", state.name))))
        return calls

    @staticmethod
    def power(state: State) -> int:
        """The power of |nu| with which its size grows."""
        return {"energy": 2, "deflection": 0, "deflection_rate": 0}.get(state.size, 1)

    def later_call(self) -> Call:
        """What gives the axial speeds later in a phase, where they follow from the core."""
        if self.spins:
            return Call(self.function("axial_speeds"), ("nu", "chi", self.place("core", SPINS), "later"))
        function = self.function("axial_after")
        places = {
            "axial": "axial",
            "momenta_before": self.place("before", "momenta"),
            "momenta_after": self.place("core", "momenta"),
            "elapsed": "elapsed",
        }
        return Call(function, (*(places[array.name] for array in function.inputs), "later"))

    @property
    def differentiated(self) -> list[Function]:
        """The functions that sensitivities call, in the set's order."""
        calls = [*self.core_calls(), *self.start_calls(), *([self.later_call()] if self.later_follows else [])]
        names = {call.function.name for call in calls} | {*PLAIN, IMPACT, *OF_ROLLERS}
        names |= {*ON_THE_GROUND} if self.grips else set()
        names |= {SLIP_SPINS} if self.disks_stick or self.in_series else set()
        names |= {REACHES} if self.stands and (self.disks_stick or self.strips) else set()
        names |= {CORNERS} if self.strips else set()
        return [f for f in self.set.functions if f.name.removesuffix("_sharp") in names or f.prepares]

    @property
    def later_follows(self) -> bool:
        """Whether a function gives the rollers' axial speeds later in a phase."""
        return bool(self.core) and (self.rollers == COLLAPSED or self.spins)

    def called_along(self, function: Function) -> str:
        """The name in C of a function with its slopes in a direction."""
        has_form = self.set.function(f"{function.name}_sharp") is not None
        return f"SOLVED({function.name}{SUFFIX})" if has_form else f"lanes_{function.name}{SUFFIX}"

    def along(self, call: Call) -> list[str]:
        """The arguments of a call with slopes: what it takes, how that moves; what it gives, how that moves."""
        taken, given = call.arguments[: len(call.function.inputs)], call.arguments[len(call.function.inputs) :]
        return [*taken, *map(moving, taken), *given, *map(moving, given)]

    @staticmethod
    def moved(names: Sequence[str]) -> list[str]:
        """What moves these arguments."""
        return [moving(name) for name in names]

    @property
    def core_needs_chi(self) -> bool:
        """Whether the rates of the core depend on the wheels' angles."""
        return any(array.name == "chi" for call in self.core_calls() for array in call.function.inputs)

    @staticmethod
    def parameters_along(function: Function) -> list[str]:
        """The parameters of the function with slopes that sensitivities call in its place."""
        own = [(f"const lanes_t *{a.name}" if a.shape else f"lanes_t {a.name}") for a in function.inputs]
        given = [f"lanes_t *{a.name}" for a in function.outputs]
        return ["const int wheels", "const vehicle_t *v", *own, *(f"{o}{SUFFIX}" for o in own), *given,
                *(f"{o}{SUFFIX}" for o in given)]  # fmt: skip

    def _giving(self, states: Sequence[State]) -> list[Function]:
        """The functions that give the rates of these states, each once."""
        names = {state.function for state in states}
        return [f for f in self.set.functions if f.name in names]

    def _calls(self, functions: list[Function], targets: dict[str, str]) -> list[Call]:
        """The calls, each with locals for the outputs that are no targets. Locals serve the later calls as inputs."""
        plain = ("nu", "chi", "heading", "momenta", "directions", "absent", "ground_push")
        known = {name: f"at->{name}" for name in (*plain, *OF_AXLES, *OF_SPINS, *OF_DISKS, *OF_STRIPS, *OF_STANDING)}
        known |= self.zeros | {state.name: self.place("at->core", state.name) for state in self.core}
        known |= {name: f"at->inputs + {k}*wheels" if k else "at->inputs" for k, name in enumerate(self.inputs)}
        known |= {PRELOAD: known[HEADING_INPUT]} if self.grips else {}  # a wheel that stands has no heading
        calls = []
        for function in functions:
            own, arguments = [], [known[array.name] for array in function.inputs]
            for array in function.outputs:
                if array.name in targets:
                    arguments.append(targets[array.name])
                    continue
                size = size_of(array).replace("wheels", "MAX_WHEELS")
                if "rollers" in size:  # the only such outputs are rates of the core, which no account needs
                    arguments.append("at->core_dot")
                    continue
                own.append(f"{array.name}[{size}]")
                arguments.append(array.name)
                known[ALIASES.get(array.name, array.name)] = array.name
            calls.append(Call(function, tuple(arguments), tuple(own)))
        return calls


def moving(argument: str) -> str:
    """How an argument moves in a direction, as C text: at another point, or under its name with the suffix."""
    if argument.startswith("at->"):
        return argument.replace("at->", "along->")
    name, plus, place = argument.partition(" + ")
    return f"{name}{SUFFIX}{plus}{place}"


MOTION = ("forward_dynamics", "wheel_speeds", "pose_rates")  # functions of a set that the engine can run


def engine_set(effects: EffectSet, registry: Registry) -> str:
    """The text of the header; a set that the engine cannot run has none."""
    return template("engine_set.h", facts=EngineSet(effects, registry)) if _runs(effects) else ""


def _runs(effects: EffectSet) -> bool:
    """Whether the engine can run a set."""
    return all(map(effects.function, MOTION))


def further_forms(effects: EffectSet, registry: Registry) -> list[Function]:
    """What the engine calls beside a set's functions: what gives nu' while no wheel stands on its joint, where some
    may, and where a scene has none of OFTEN_ABSENT."""
    if not _runs(effects):
        return []
    facts = EngineSet(effects, registry)
    joints = ["joints"] * facts.pivots
    turning = without(effects, registry, joints, facts.dynamics, TURNING, {}) if joints else []
    absent = [*facts.often_absent, *joints] if facts.often_absent else []
    names = [facts.dynamics, *(DYNAMICS[False] for call in facts.rolling_calls()[-1:])] if absent else []
    return turning + [form for name in names for form in without(effects, registry, absent, name, BARE, FREE)]


def along_set(effects: EffectSet, registry: Registry) -> str:
    """The header along_set.h, for sensitivities: what the engine calls of the set whose functions have slopes.

    effects  the set without these
    """
    facts = deviating(effects, registry)
    called = (*PLAIN, IMPACT, *OF_ROLLERS, ON_THE_GROUND[1], SLIP_SPINS, REACHES, CORNERS)
    facts.plain = [f for f in facts.differentiated if f.name in called]
    facts.absent = [name for name in called if name not in {f.name for f in facts.plain}]
    return template("along_set.h", facts=facts)


def differentiated(effects: EffectSet, registry: Registry) -> set[str]:
    """The names of the functions of a set that sensitivities call."""
    return {f.name for f in deviating(effects, registry).differentiated}


def deviating(effects: EffectSet, registry: Registry) -> EngineSet:
    """The facts of a set with what deviates as its core: energies feed nothing back. Where bearings stick, the dynamics
    are those of what sticks: with all directions allowed, of what turns. What free rollers' bearings do to momenta, as
    rows have it, is no input: that follows from which of them turn."""
    facts = EngineSet(effects, registry)
    facts.dynamics = facts.held if facts.holds else facts.dynamics
    facts.inputs = [name for name in facts.inputs if name not in MOMENT_INPUTS]  # which follow from the bearings
    facts.zeros = {state.name: "at->zeros" for state in facts.core if state.size == "energy"}
    facts.core = [state for state in facts.core if state.size != "energy"]
    return facts
