"""Question 2: the reduced kernel over many vehicles at once, beside heyoka's batch functions of the same form."""

import heyoka
import matplotlib.pyplot as plt
import numpy as np

import omniroll
from omniroll.compiled_engine import aligned, engine_module
from omniroll.kernels import CompiledKernel, kernel

from .common import ROOT, Answer, Target, numeric_model, random_states, reduced_form, relative_error, repeated

VEHICLES = 4096  # their arrays stay in the second cache
REPEATS = 60
MODELS = ("locked", "free")


def states(vehicle, roller_model):
    """nu (3, V), chi (N, V), momenta (2 N, V) or nothing; components first, as both tools want it."""
    nu, chi, _ = random_states(vehicle, VEHICLES)
    parts = [nu.T, chi.T]
    if roller_model == "free":
        parts.append(np.random.default_rng(2).uniform(-1, 1, (2 * vehicle.wheels, VEHICLES)) * vehicle.roller_inertia)
    return [np.ascontiguousarray(part) for part in parts]


def ours(vehicle, roller_model, parts, shared):
    """A call of the compiled batch kernel, and its output (3, V)."""
    module = engine_module()
    ffi = module.ffi
    model = np.asarray(kernel(vehicle, roller_model, "compiled").model, float)
    constants = model if shared else np.repeat(model[:, None], VEHICLES, axis=1)
    out, work = np.empty((3, VEHICLES)), aligned(16 * len(model))
    function = getattr(module.lib, f"omniroll_{roller_model}_reduced_batch")

    def pointer(array):
        return ffi.from_buffer("double[]", array)

    arguments = (
        VEHICLES, vehicle.wheels, vehicle.rollers_per_wheel, pointer(constants), len(model), int(shared),
        *map(pointer, parts), *[ffi.NULL] * (3 - len(parts)), pointer(out), pointer(work),
    )  # fmt: skip
    return (lambda: function(*arguments)), out, constants


def heyokas(vehicle, roller_model, parts, **options):
    """A call of heyoka's compiled function, and its output (3, V). The vehicle's numbers are in its code."""
    names = [f"nu{k}" for k in range(3)] + [f"chi{i}" for i in range(vehicle.wheels)]
    if roller_model == "free":
        names += [f"momentum{k}" for k in range(2 * vehicle.wheels)]
    symbols = heyoka.make_vars(*names)
    nu, chi, momenta = symbols[:3], symbols[3 : 3 + vehicle.wheels], symbols[3 + vehicle.wheels :]
    pairs = [momenta[2 * i : 2 * i + 2] for i in range(vehicle.wheels)]
    form = reduced_form(roller_model, heyoka.sin, heyoka.cos)
    third = (pairs,) if pairs[0] else ()
    nu_dot = form.reduced(numeric_model(vehicle, roller_model), nu, chi, *third)
    function = heyoka.cfunc(nu_dot, vars=list(symbols), **options)
    inputs, out = np.ascontiguousarray(np.concatenate(parts)), np.empty((3, VEHICLES))
    return (lambda: function(inputs, outputs=out)), out


def call(action):
    def run():
        action()

    return run


def measure(roller_model):
    vehicle = omniroll.Vehicle.paper()
    parts = states(vehicle, roller_model)
    chi = np.ascontiguousarray(parts[1].T)
    third = (np.ascontiguousarray(parts[2].T).reshape(VEHICLES, -1, 2),) if len(parts) > 2 else ()
    long_kernel = CompiledKernel(vehicle, roller_model, "long_double")
    exact = np.asarray(long_kernel.reduced(parts[0].T, chi, *third), float)
    found = {}
    tools = {
        "omniroll, one vehicle's constants": ours(vehicle, roller_model, parts, True),
        "omniroll, constants of each vehicle": ours(vehicle, roller_model, parts, False),
        "heyoka cfunc": heyokas(vehicle, roller_model, parts, parallel_mode=False),
    }
    for tool, (action, out, *_) in tools.items():
        action()
        error = relative_error(out.T, exact)
        found[tool] = repeated(call(action), REPEATS), error
    return found


def answer() -> Answer:
    found = {model: measure(model) for model in MODELS}
    rows, targets, wins = [], [], []
    for model in MODELS:
        for tool, (times, error) in found[model].items():
            rows.append([model, tool, times.in_unit(1e9 / VEHICLES), f"{error:.0e}"])
        least = {tool: times.least * 1e9 / VEHICLES for tool, (times, _) in found[model].items()}
        own = least["omniroll, one vehicle's constants"]
        targets.append(Target(f"batch, {model}: <= 10 ns per vehicle", f"{own:.1f} ns", own <= 10))
        ratio = least["heyoka cfunc"] / own
        if ratio < 1:
            wins.append(model)
        targets.append(Target(f"batch, {model}: >= 2x faster than heyoka", f"{ratio:.2f}x", ratio >= 2))
    _figure(found)
    return Answer(
        title="2. Many vehicles at once",
        text=(
            f"The reduced form, N = 3, n = 5, {VEHICLES} vehicles a call on one core; ns per vehicle, "
            "minimum (median); error against long double. heyoka's function has the one vehicle's numbers "
            "in its code and fuses multiplications with additions; this project's kernel takes the "
            "constants as data, once or for each vehicle, and never fuses, so that every machine gives "
            "the same bits."
        ),
        headings=["rollers", "tool", "ns per vehicle", "error"],
        rows=rows,
        targets=targets,
        closing=(
            f"heyoka's function is the faster one for {', '.join(wins)} rollers, vehicle compiled in. " if wins else ""
        )
        + "Constants of each vehicle are read from memory, some 30 numbers a vehicle, and cost the more.",
        figures=["benchmark-batch.png"],
    )


def _figure(found):
    figure, axes = plt.subplots(figsize=(6, 2.6), layout="constrained")
    labels = [f"{tool}\n({model})" for model in MODELS for tool in found[model]]
    values = [times.least * 1e9 / VEHICLES for model in MODELS for times, _ in found[model].values()]
    axes.barh(labels, values, color=["C0", "C0", "C1"] * 2)
    axes.invert_yaxis()
    axes.set_xlabel("ns per vehicle")
    axes.tick_params(axis="y", labelsize="small")
    figure.savefig(ROOT / "docs/benchmark-batch.png", dpi=120, metadata={"Software": None})
    plt.close(figure)
