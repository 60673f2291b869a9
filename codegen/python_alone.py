"""Which sets of effects the Python engine alone runs: what stands together in them that the compiled engine lacks."""

from collections.abc import Callable

# Pairs of generated functions: a set that has both, and what it has then.
TOGETHER = {
    ("corner_forces", "spring_loads"): (
        "massless rollers that stick beside contacts that stick, under loads that follow the motion"
    )
}


def lacking(has: Callable[[str], object]) -> str:
    """What a set has that the compiled engine lacks, or nothing.

    has  whether the set has a function of this name
    """
    return next((lack for names, lack in TOGETHER.items() if all(map(has, names))), "")
