"""Question 11: how near the engine is to the price of its evaluations, and where the rest goes."""

from costs.counting import LEVEL
from costs.shares import ACCURACY, LENGTH, MODELS, shares

import omniroll
from omniroll.engine.simulate import checked_task

from . import batch
from .common import Answer, Target, repeated
from .motion import TASK
from .page import table
from .tools import run_alone

ACCURACIES, REPEATS = (1e-6, 1e-9), 15
MOST = 2


def price(roller_model) -> float:
    """Seconds of one vehicle in the batch kernel, of the repeat that was fastest."""
    vehicle = omniroll.Vehicle.paper()
    action, _ = batch.ours(vehicle, roller_model, batch.states(vehicle, roller_model), shared=True)
    return repeated(batch.call(action), 20 * REPEATS).least / batch.VEHICLES


def measured(roller_model, accuracy):
    """Seconds in the engine, evaluations and sweeps a step of motion 3."""
    vehicle = omniroll.Vehicle.paper()
    checked = checked_task(vehicle, **TASK | {"roller_model": roller_model}, accuracy=accuracy)
    found = [run_alone(checked, accuracy) for _ in range(REPEATS)]
    run = found[-1][1]
    sweeps = run.run.record.sweep_count / run.run.record.step_count
    return min(seconds for seconds, *_ in found), run.stats()["evaluations"], sweeps


def answer() -> Answer:
    rows, worst = [], 0.0
    for roller_model in MODELS:
        each = price(roller_model)
        for accuracy in ACCURACIES:
            seconds, evaluations, sweeps = measured(roller_model, accuracy)
            over = seconds / (evaluations * each)
            worst = max(worst, over)
            rows.append(
                [
                    roller_model, f"{accuracy:.0e}", f"{evaluations}", f"{sweeps:.1f}", f"{each * 1e9:.1f}",
                    f"{evaluations * each * 1e3:.2f}", f"{seconds * 1e3:.2f}", f"{over:.1f}",
                ]
            )  # fmt: skip
    found = shares()
    parts = [[part, *(f"{100 * found[model].get(part, 0):.0f} %" for model in found)] for part in found[MODELS[0]]]
    kernel = min(share["the kernel"] for share in found.values())
    return Answer(
        title="11. How near the engine is to its kernel",
        text=(
            "Motion 3 without its error estimate. The limit is what its evaluations would cost in the batch kernel, "
            "which has sixteen vehicles on the way at once and nothing to do between them. The engine has the sixteen "
            "nodes of one step, and each sweep waits for the sums of the one before."
        ),
        headings=[
            "rollers", "accuracy", "evaluations", "sweeps a step", "batch kernel, ns", "limit, ms", "engine, ms",
            "over the limit",
        ],
        rows=rows,
        closing=(
            f"Where the engine's instructions go, over {LENGTH:.0f} s at {ACCURACY:.0e} (callgrind, {LEVEL}):\n\n"
            f"{table(['part', *found], parts)}\n\n"
            "An engine whose evaluations cost what they cost in a batch, and the rest what it costs now, would be at "
            f"{1 + (1 - kernel) * worst:.1f} times the limit, by these shares. The sums over the nodes carry the order "
            "32 of a step."
        ),
        targets=[
            Target(f"motion 3: <= {MOST}x its evaluations in the batch kernel", f"{worst:.1f}x at worst", worst <= MOST)
        ],
    )  # fmt: skip
