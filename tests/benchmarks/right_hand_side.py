"""Question 1: nanoseconds for a right-hand side, against the number of rollers, beside CasADi's and SymPy's C."""

import tempfile
from pathlib import Path

import casadi
import matplotlib.pyplot as plt
import mpmath
import numpy as np
import sympy

import omniroll
from omniroll.kernels.firmware import constants_file
from omniroll.kernels.kernel import VEHICLE_SCALARS, kernel

from .common import (
    ROOT,
    Answer,
    RightHandSide,
    Target,
    model_as_data,
    model_numbers,
    numeric_model,
    pair,
    random_states,
    reduced_form,
    relative_error,
)
from .generic_mechanics import coordinate_rates, kinetic_energy

ROLLERS = (5, 15, 30, 60)
MOST_FOR_QR = 15  # CasADi's default factorisation grows to hundreds of megabytes of C beyond
STATES = 32

OURS = """
#include "{file}"
#include "omniroll_constants.h"
__attribute__((externally_visible)) void rhs(const double *in, double *out)
{{
    omniroll_{name}(&omniroll_constant_model, in, in + 3, in + {state}, out{outputs});
}}
"""

# The kernel as a library has it, with the vehicle as data; or included, so that the compiler knows the vehicle.
INCLUDES = {"omniroll": "omniroll.h", "omniroll, vehicle compiled in": "omniroll.c"}


def ours(folder, vehicle, name, tool="omniroll"):
    """This project's C: `accelerations`, or `forward_dynamics` with two momenta a wheel."""
    wheels, rollers = vehicle.wheels, vehicle.rollers_per_wheel
    full = name == "accelerations"
    source, files = folder / f"ours_{name}.c", pair("free")
    sources = [source, files / "omniroll.c"] if tool == "omniroll" else [source]
    library = f"ours_{name}_{len(sources)}"
    source.write_text(
        OURS.format(
            file=INCLUDES[tool], name=name, state=3 + wheels, outputs=", out + 3" if full else "",
        )
    )  # fmt: skip
    for file, text in constants_file(kernel(vehicle, "free"), "the benchmark", "omniroll").items():
        (folder / file).write_text(text)
    size = 3 + wheels * (rollers - 1) if full else 3
    known = ["-fwhole-program"] if tool != "omniroll" else []  # the kernel has this caller alone, and may be inlined
    return RightHandSide(folder, library, sources, size, f"-I{files}", f"-I{folder}", *known)


# CasADi


def casadi_function(folder, name, inputs, output):
    """CasADi's generated C of output(inputs), with its own elimination of common subexpressions."""
    function = casadi.Function("peer", [casadi.vertcat(*inputs)], [output], {"cse": True})
    generator = casadi.CodeGenerator(f"{name}.c")
    generator.add(function)
    generator.generate(str(folder) + "/")
    work = function.sz_w() + 1
    wrapper = folder / f"{name}_call.c"
    wrapper.write_text(
        "int peer(const double **arg, double **res, long long int *iw, double *w, int mem);\n"
        "void rhs(const double *in, double *out)\n{\n"
        f"    static double w[{work}];\n    const double *arg[8] = {{in}};\n    double *res[8] = {{out}};\n"
        "    peer(arg, res, 0, w, 0);\n}\n"
    )
    return RightHandSide(folder, name, [folder / f"{name}.c", wrapper], output.numel())


def casadi_generic(folder, vehicle, solver):
    """M w' = f by CasADi's differentiation, solved by its symbolic QR ("qr") or sparse LDL^T ("ldl").

    "ldl, nu first" has the unknowns in the order of the output.
    """
    wheels, places = vehicle.wheels, vehicle.rollers_per_wheel - 1
    nu, chi = casadi.SX.sym("nu", 3), casadi.SX.sym("chi", wheels)
    spins, theta = casadi.SX.sym("spins", wheels * places), casadi.SX.sym("theta")
    # With the spins first, LDL^T has no fill; with nu first, the order in which one writes it, it fills up.
    first, second = (spins, nu) if solver != "ldl, nu first" else (nu, spins)
    w, q = casadi.vertcat(first, second), casadi.vertcat(theta, chi)
    rates = casadi.vertcat(
        *coordinate_rates(
            vehicle, casadi.vertsplit(nu), casadi.vertsplit(spins), theta, casadi.vertsplit(chi), casadi.sin, casadi.cos
        )
    )
    v = casadi.SX.sym("v", rates.numel())
    energy = kinetic_energy(vehicle, casadi.vertsplit(chi), casadi.vertsplit(v), casadi.sin)
    momenta, slope = casadi.substitute([casadi.gradient(energy, v), casadi.gradient(energy, q)], [v], [rates])
    V, q_dot = casadi.jacobian(rates, w), rates[2 : 3 + wheels]
    mass = V.T @ casadi.jacobian(momenta, w)
    force = -(V.T @ casadi.jtimes(momenta, q, q_dot))
    force += casadi.jacobian(rates[2 : 3 + wheels], w).T @ slope
    mass, force = casadi.substitute([mass, force], [theta], [casadi.SX(0)])
    mass = casadi.sparsify(casadi.simplify(mass))
    if solver == "qr":
        found = casadi.solve(mass, force)
    else:
        D, LT, p = casadi.ldl(mass, False)
        found = casadi.ldl_solve(force, D, LT, p)
    if first is spins:
        count = spins.numel()
        found = casadi.vertcat(found[count:], found[:count])
    return casadi_function(folder, f"casadi_{solver[:3]}_{first is nu}", [nu, chi, spins], found)


def casadi_reduced(folder, vehicle, as_data=False):
    """The reduced form with the vehicle's numbers in the code, or as data."""
    nu, chi = casadi.SX.sym("nu", 3), casadi.SX.sym("chi", vehicle.wheels)
    momenta = casadi.SX.sym("momenta", 2 * vehicle.wheels)
    pairs = [[momenta[2 * i], momenta[2 * i + 1]] for i in range(vehicle.wheels)]
    form = reduced_form("free", casadi.sin, casadi.cos)
    model = numeric_model(vehicle, "free")
    inputs = [nu, chi, momenta]
    if as_data:
        model, data = model_as_data(model, lambda name: casadi.SX.sym(name))
        inputs += data
    out = form.forward_dynamics(model, casadi.vertsplit(nu), casadi.vertsplit(chi), pairs)
    return casadi_function(folder, f"casadi_reduced_{as_data}", inputs, casadi.vertcat(*out))


# SymPy


def sympy_c(name, symbols, outputs):
    """A C function of cse() and ccode(): void name(const double *in, outputs...)."""
    shared, results = sympy.cse([expression for _, expression in outputs], sympy.numbered_symbols("t"))
    lines = [f"    const double {symbol} = in[{k}];" for k, symbol in enumerate(symbols)]
    lines += [f"    const double {symbol} = {sympy.ccode(value)};" for symbol, value in shared]
    lines += [f"    {place} = {sympy.ccode(value)};" for (place, _), value in zip(outputs, results, strict=True)]
    return "#include <math.h>\n" + name + "\n{\n" + "\n".join(lines) + "\n}\n"


def sympy_reduced(folder, vehicle, as_data=False):
    """The reduced form with the vehicle's numbers in the code, or as data."""
    wheels = vehicle.wheels
    nu, chi = list(sympy.symbols("nu:3")), list(sympy.symbols(f"chi:{wheels}"))
    momenta = list(sympy.symbols(f"momentum:{2 * wheels}"))
    pairs = [momenta[2 * i : 2 * i + 2] for i in range(wheels)]
    form = reduced_form("free", sympy.sin, sympy.cos)
    model, data = numeric_model(vehicle, "free"), []
    if as_data:
        model, data = model_as_data(model, sympy.Symbol)
    out = form.forward_dynamics(model, nu, chi, pairs)
    source = folder / f"sympy_reduced_{as_data}.c"
    places = [(f"out[{k}]", value) for k, value in enumerate(out)]
    source.write_text(sympy_c("void rhs(const double *in, double *out)", nu + chi + momenta + data, places))
    return RightHandSide(folder, f"sympy_reduced_{as_data}", [source], 3)


# Both rows


def exact(vehicle, name, nu, chi, third):
    """The same function in 40 digits."""
    module = reduced_form("free", mpmath.sin, mpmath.cos)
    with mpmath.workdps(40):
        numbers = [[mpmath.mpf(float(x)) for x in values] for values in (nu, chi)]
        rest = [[mpmath.mpf(float(x)) for x in row] for row in third]
        scalars = {name: mpmath.mpf(getattr(vehicle, name)) for name in VEHICLE_SCALARS}
        angles = [mpmath.mpf(a) for a in vehicle.wheel_angles]
        model = module.prepare(vehicle.wheels, vehicle.rollers_per_wheel, wheel_angles=angles, **scalars)
        out = getattr(module, name)(model, *numbers, rest)
        flat = [*out[0], *(x for row in out[1] for x in row)] if name == "accelerations" else out
        return [float(x) for x in flat]


def measured(function, states, truth):
    """Times and error of a call."""
    error = relative_error(np.array([function(state) for state in states[: len(truth)]]), truth)
    return function.per_call(states), error


def measure(rollers):
    """{(row, tool): (Times, error)} for one n."""
    vehicle = omniroll.Vehicle.paper(3, rollers)
    nu, chi, spins = random_states(vehicle, STATES)
    momenta = np.random.default_rng(2).uniform(-1, 1, (STATES, 3, 2)) * vehicle.roller_inertia
    full = np.concatenate([nu, chi, spins.reshape(STATES, -1)], axis=1)
    short = np.concatenate([nu, chi, momenta.reshape(STATES, -1)], axis=1)
    constants = np.concatenate([np.atleast_1d(value) for _, value in model_numbers(numeric_model(vehicle, "free"))])
    with_model = np.concatenate([short, np.tile(constants, (STATES, 1))], axis=1)
    truth = np.array([exact(vehicle, "accelerations", *state) for state in zip(nu[:4], chi, spins)])  # noqa: B905
    truth_reduced = np.array([exact(vehicle, "forward_dynamics", *state) for state in zip(nu[:4], chi, momenta)])  # noqa: B905
    found = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for tool in INCLUDES:
            found["full", tool] = measured(ours(folder, vehicle, "accelerations", tool), full, truth)
            found["forward_dynamics", tool] = measured(
                ours(folder, vehicle, "forward_dynamics", tool), short, truth_reduced
            )
        for tool, peer in (("CasADi", casadi_reduced), ("SymPy", sympy_reduced)):
            found["forward_dynamics", f"{tool}, vehicle compiled in"] = measured(
                peer(folder, vehicle), short, truth_reduced
            )
            found["forward_dynamics", tool] = measured(peer(folder, vehicle, True), with_model, truth_reduced)
        found["full", "CasADi, LDL, spins first"] = measured(casadi_generic(folder, vehicle, "ldl"), full, truth)
        if rollers <= MOST_FOR_QR:
            for tool, solver in (("solve()", "qr"), ("LDL, nu first", "ldl, nu first")):
                peer = casadi_generic(folder, vehicle, solver)
                found["full", f"CasADi, {tool}"] = measured(peer, full, truth)
    return found


KNOWN = ", vehicle compiled in"
PEERS = ("CasADi, solve()", "CasADi, LDL, nu first", "CasADi, LDL, spins first")
TOOLS = (
    *(("full", tool) for tool in (*INCLUDES, *PEERS)),
    *(("forward_dynamics", tool + how) for how in ("", KNOWN) for tool in ("omniroll", "CasADi", "SymPy")),
)


def answer() -> Answer:
    found = {n: measure(n) for n in ROLLERS}
    rows = []
    for row, tool in TOOLS:
        cells = [
            f"{found[n][row, tool][0].in_unit(1e9)}; {found[n][row, tool][1]:.0e}" if (row, tool) in found[n] else "-"
            for n in ROLLERS
        ]
        rows.append([row, tool, *cells])

    def ratio(n, row, tool, own):
        return found[n][row, tool][0].least / found[n][row, own][0].least

    targets = []
    for n, wanted in ((5, 10), (15, 50)):
        for tool in PEERS:
            value = ratio(n, "full", tool, "omniroll" + KNOWN)
            claim = f"same inputs and outputs, n = {n}: >= {wanted}x faster than {tool}, the vehicle compiled into both"
            targets.append(Target(claim, f"{value:.1f}x", value >= wanted))
    for tool in ("CasADi", "SymPy"):
        for how in ("", KNOWN):
            value = min(ratio(n, "forward_dynamics", tool + how, "omniroll" + how) for n in ROLLERS)
            claim = f"reduced form: faster than {tool}'s C at every n{how or ', vehicle as data'}"
            targets.append(Target(claim, f"{value:.2f}x at worst", value > 1))
    growth = found[60]["forward_dynamics", "omniroll"][0].least / found[5]["forward_dynamics", "omniroll"][0].least
    targets.append(Target("reduced form: time at n = 60 over n = 5 <= 1.05", f"{growth:.2f}", growth <= 1.05))
    _figure(found)
    return Answer(
        title="1. A right-hand side against the number of rollers",
        text=(
            "Free rollers, N = 3, one vehicle, random states; ns per call, minimum (median); after the "
            "semicolon the largest error over the largest component, against 40 digits. *Full*: every "
            "spin in and out; the peers get energy and constraints (`generic_mechanics.py`) and "
            "differentiate, CasADi solves M w' = f for all 3 + N (n-1) unknowns by its `solve()` (a "
            "symbolic QR) or by its LDL^T, in two orders of the unknowns: as they stand in the output (nu "
            "first, which fills the factor; both not tried beyond n = 15) and with the spins first (no "
            "fill). *Reduced*: the same formulas, this project's, go through each tool's code generator. "
            "The peers of the full form have the vehicle's numbers and N, n in their code; of this "
            "project's kernel, which takes them as data, both variants are shown."
        ),
        headings=["form", "tool", *(f"n = {n}" for n in ROLLERS)],
        rows=rows,
        targets=targets,
        closing=_plain_words(found),
        figures=["benchmark-right-hand-side.png"],
    )


def _plain_words(found):
    """Where a peer wins."""
    words = []
    for how in ("", KNOWN):
        values = [(n, found[n]["forward_dynamics", "omniroll" + how][0].least) for n in ROLLERS]
        for tool in ("CasADi", "SymPy"):
            ahead = [own / found[n]["forward_dynamics", tool + how][0].least for n, own in values]
            if max(ahead) > 1:
                row = how.strip(", ") or "vehicle as data"
                words.append(f"{tool} wins the reduced form ({row}): up to {max(ahead):.2f}x faster.")
    if words:
        words.append("It writes three wheels out in one straight line; this kernel loops and serves every N.")
    words.append(
        "A sparse factorisation in the right order is the peers' best: row `LDL, spins first`. It is an elimination "
        "that costs as much for each roller, as this kernel's; its error grows with n."
    )
    return " ".join(words)


def _figure(found):
    figure, axes = plt.subplots(figsize=(9, 4.2), layout="constrained")
    colours = {tool: f"C{k}" for k, tool in enumerate(dict.fromkeys(tool.removesuffix(KNOWN) for _, tool in TOOLS))}
    for row, tool in TOOLS:
        ns = [n for n in ROLLERS if (row, tool) in found[n]]
        style = ("-" if row == "full" else "--") + ("o" if tool.endswith(KNOWN) else "s")
        times = [1e9 * found[n][row, tool][0].least for n in ns]
        axes.loglog(ns, times, style, color=colours[tool.removesuffix(KNOWN)], label=f"{row}: {tool}")
    axes.set(xlabel="rollers per wheel", ylabel="ns per right-hand side", xticks=ROLLERS, xticklabels=map(str, ROLLERS))
    axes.minorticks_off()
    figure.legend(loc="outside right upper", fontsize="small")
    axes.grid(alpha=0.3)
    figure.savefig(ROOT / "docs/benchmark-right-hand-side.png", dpi=120, metadata={"Software": None})
    plt.close(figure)
