"""Question 2: the reduced kernel over many vehicles at once, beside heyoka's batch functions of the same form."""

import itertools

import heyoka
import matplotlib.pyplot as plt
import numpy as np

import omniroll
from omniroll.kernels import sets
from omniroll.kernels.kernel import CompiledKernel

from .common import (
    ROOT,
    Answer,
    Target,
    model_as_data,
    model_numbers,
    numeric_model,
    random_states,
    reduced_form,
    relative_error,
    repeated,
)

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
    made, out = omniroll.Batch(vehicle if shared else [vehicle] * VEHICLES, roller_model), np.empty((3, VEHICLES))
    momenta = [part.reshape(vehicle.wheels, 2, VEHICLES) for part in parts[2:]]
    return made.bind(*parts[:2], *momenta, nu_dot=out), out


def heyokas(vehicle, roller_model, parts, as_data=False, **options):
    """A call of heyoka's compiled function, and its output (3, V). The vehicle's numbers are in its code, or come with
    each vehicle."""
    names = [f"nu{k}" for k in range(3)] + [f"chi{i}" for i in range(vehicle.wheels)]
    if roller_model == "free":
        names += [f"momentum{k}" for k in range(2 * vehicle.wheels)]
    symbols = heyoka.make_vars(*names)
    nu, chi, momenta = symbols[:3], symbols[3 : 3 + vehicle.wheels], symbols[3 + vehicle.wheels :]
    pairs = [momenta[2 * i : 2 * i + 2] for i in range(vehicle.wheels)]
    form = reduced_form(roller_model, heyoka.sin, heyoka.cos)
    third = (pairs,) if pairs[0] else ()
    model, given = numeric_model(vehicle, roller_model), {}
    numbers = np.concatenate([np.atleast_1d(value) for _, value in model_numbers(model)])
    if as_data:
        places = itertools.count()
        model, _ = model_as_data(model, lambda name: heyoka.par[next(places)])
    function = heyoka.cfunc(form.forward_dynamics(model, nu, chi, *third), vars=list(symbols), **options)
    if as_data:
        given["pars"] = np.repeat(numbers[: function.nparams, None], VEHICLES, axis=1)
    inputs, out = np.ascontiguousarray(np.concatenate(parts)), np.empty((3, VEHICLES))
    return (lambda: function(inputs, outputs=out, **given)), out


def constants_of_a_vehicle(roller_model):
    """Numbers of the batch kernel's constants for each of many vehicles."""
    vehicle = omniroll.Vehicle.paper()
    made = sets.engine(roller_model, (), vehicle.wheels)
    return made.lib.omniroll_blocks_size(VEHICLES, vehicle.wheels, vehicle.rollers_per_wheel) // VEHICLES


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
    exact = np.asarray(long_kernel.forward_dynamics(parts[0].T, chi, *third), float)
    found = {}
    tools = {
        "omniroll, one vehicle's constants": ours(vehicle, roller_model, parts, True),
        "omniroll, constants of each vehicle": ours(vehicle, roller_model, parts, False),
        "heyoka cfunc": heyokas(vehicle, roller_model, parts, parallel_mode=False),
        "heyoka cfunc, constants of each vehicle": heyokas(vehicle, roller_model, parts, True, parallel_mode=False),
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
        for how, theirs in (
            ("one vehicle's constants", ""),
            ("constants of each vehicle", ", constants of each vehicle"),
        ):
            ahead = least[f"omniroll, {how}"] / least["heyoka cfunc" + theirs]
            wins += [f"{model} rollers, {how} ({ahead:.2f}x)"] if ahead > 1 else []
        targets.append(Target(f"batch, {model}: >= 2x faster than heyoka", f"{ratio:.2f}x", ratio >= 2))
    _figure(found)
    return Answer(
        title="2. Many vehicles at once",
        text=(
            f"The reduced form, N = 3, n = 5, {VEHICLES} vehicles a call on one core; ns per vehicle, "
            "minimum (median); error against long double. heyoka's function has the one vehicle's numbers "
            "in its code, or takes them with each vehicle, and fuses multiplications with additions; this "
            "project's kernel takes the constants as data, once or for each vehicle, and never fuses, so "
            "that every machine gives the same bits."
        ),
        headings=["rollers", "tool", "ns per vehicle", "error"],
        rows=rows,
        targets=targets,
        closing=_plain_words(wins),
        figures=["benchmark-batch.png"],
    )


def _plain_words(wins):
    words = [f"heyoka's function is the faster one for {'; '.join(wins)}."] if wins else []
    sizes = " and ".join(f"{constants_of_a_vehicle(model)} ({model})" for model in MODELS)
    words.append(f"Constants of each vehicle are read from memory, {sizes} numbers a vehicle, and cost the more.")
    return " ".join(words)


def _figure(found):
    figure, axes = plt.subplots(figsize=(6, 3.4), layout="constrained")
    labels = [f"{tool}\n({model})" for model in MODELS for tool in found[model]]
    values = [times.least * 1e9 / VEHICLES for model in MODELS for times, _ in found[model].values()]
    axes.barh(labels, values, color=["C0", "C0", "C1", "C1"] * 2)
    axes.invert_yaxis()
    axes.set_xlabel("ns per vehicle")
    axes.tick_params(axis="y", labelsize="small")
    figure.savefig(ROOT / "docs/benchmark-batch.png", dpi=120, metadata={"Software": None})
    plt.close(figure)
