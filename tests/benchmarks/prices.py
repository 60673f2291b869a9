"""Question 10: what effects cost, in instructions of the engine."""

from collections.abc import Sequence

from costs.counting import LEVEL
from costs.prices import EVERY, LENGTHS, PROMISED, Price, prices, prices_of_events

from .common import Answer, Target

OVER, PHASES, EVENTS = 1.5, 3, 1.5


def promised(found: Sequence[Price], name: str) -> Target:
    """What an evaluation with other wheels costs."""
    beside, most = PROMISED[name]
    of = {price.effect: price.of_evaluation for price in found}
    cost = of[name] / of[beside]
    return Target(f"an evaluation of {name}: <= {most} of {beside}", f"{cost:.3f}", cost <= most)


def answer() -> Answer:
    found, events = prices(), prices_of_events()
    rows = [
        [
            price.effect, f"{price.operations:.2f}", f"{price.of_evaluation:.2f}", str(price.count.phases),
            f"{price.count.evaluations / price.count.phases:.0f}", f"{price.count.per_phase / 1e3:.1f}",
            f"{price.of_phase:.2f}",
        ]
        for price in found
    ]  # fmt: skip
    dearest = max(found, key=lambda price: price.of_evaluation / price.operations)
    longest = max(found, key=lambda price: price.of_phase)
    over = dearest.of_evaluation / dearest.operations
    targets = [
        Target(
            f"an evaluation with an effect: <= {OVER} times the ratio of the operations",
            f"{over:.2f} ({dearest.effect})",
            over <= OVER,
        ),
        Target(
            f"a phase with an effect: <= {PHASES} phases of the bare vehicle",
            f"{longest.of_phase:.2f} ({longest.effect})",
            longest.of_phase <= PHASES,
        ),
        *(promised(found, name) for name in PROMISED),
        *(
            Target(f"{name}: <= {EVENTS} phases of the bare vehicle", f"{price:.2f}", price <= EVENTS)
            for name, price in events.items()
        ),
    ]
    return Answer(
        title="10. What effects cost",
        text=(
            "The paper's vehicle with free rollers, impact, nu = (5, 0, 5), accuracy 1e-9. Instructions of the "
            f"engine between {LENGTHS[0]} and {LENGTHS[1]} s, counted by callgrind at the level {LEVEL}: of an "
            "evaluation, all that the engine does shared out among them, and of a phase, over those of the bare "
            "vehicle. Operations are those of `omniroll explain`. Knots, samples and limits come each "
            f"{EVERY} s or more often and leave the motion as it is; a run without them is taken off."
        ),
        headings=[
            "effect", "operations", "instructions of an evaluation", "phases", "evaluations a phase",
            "thousand instructions a phase", "over the bare phase",
        ],
        rows=rows,
        targets=targets,
    )  # fmt: skip
