"""What the paper says of its motions (sections 3 and 5, figures 5 to 7), in short, and how each is measured.

A claim is judged by one number per run. The words are the paper's, the limits are ours: the paper gives none.
"""

from collections.abc import Callable
from dataclasses import dataclass

from omniroll.studies.motions import measures
from omniroll.studies.motions.cases import MASSLESS, SETTINGS, Runs, Setting

CONSTANT = 1e-6  # relative; a thousand times the accuracy asked of the runs
CLOSE = 0.05  # of the way travelled, or of the angle turned
Measure = Callable[[object, object], float]  # (run, massless run of the same motion) -> number


@dataclass(frozen=True)
class Claim:
    """One statement of the paper and the number that decides it.

    `kind` is "constant" (number <= CONSTANT), "varies" (> CONSTANT), "close" (<= CLOSE) or "close, not equal"
    (between the two). `about` limits it to some settings' roller models. `remark` says why it fails
    where it does.
    """

    id: str
    motion: int
    source: str
    text: str
    quantity: str
    kind: str
    measure: Measure
    about: tuple[str, ...] = ("locked", "free")
    remark: str = ""

    def holds(self, value: float) -> bool:
        """Whether `value` is what the claim says."""
        return {
            "constant": value <= CONSTANT,
            "varies": value > CONSTANT,
            "close": value <= CLOSE,
            "close, not equal": CONSTANT < value <= CLOSE,
        }[self.kind]


@dataclass(frozen=True)
class Finding:
    """A claim measured under one setting."""

    claim: Claim
    setting: Setting
    value: float
    holds: bool


def centre_apart(run, massless) -> float:
    """Largest distance from the massless centre over the massless way, or over 1 m where that rests."""
    return measures.distance_from(run, massless) / (measures.path_length(massless) or 1.0)


def heading_apart(run, massless) -> float:
    """Largest difference from the massless heading over the massless turn, or over 1 rad."""
    return measures.angle_from(run, massless) / (measures.spread(massless.pose[:, 2]) or 1.0)


CLAIMS = (
    Claim("1a", 1, "section 5", "The vehicle turns about its vertical axis at a constant rate.",
          "spread of nu_3 / nu_3(0)", "constant", lambda run, _: measures.spread(run.nu[:, 2]),
          ("massless", "locked", "free"),
          remark="Free rollers keep momentum about axes that turn, so the inertia behind nu_3 varies."),
    Claim("1b", 1, "section 5", "Its centre stays at rest.",
          "way of the centre, m", "constant", lambda run, _: measures.path_length(run),
          ("massless", "locked", "free")),
    Claim("1c", 1, "section 5", "The motion is the same with rollers and without.",
          "heading apart from massless / angle turned", "constant", heading_apart),
    Claim("2a", 2, "section 5", "The trajectory is close to the one without rollers, or the same.",
          "centre apart from massless / way", "close", centre_apart),
    Claim("2b", 2, "section 5", "nu_1, the speed along the heading, is not constant once there are rollers.",
          "spread of nu_1 / nu_1(0)", "varies", lambda run, _: measures.spread(run.nu[:, 0])),
    Claim("2c", 2, "section 5", "nu_3 stays constant, but for numerical noise at the changes of contact.",
          "spread of nu_3 / nu_1(0)", "constant", lambda run, _: measures.spread(run.nu[:, 2])),
    Claim("2d", 2, "section 5", "The kinetic energy changes in steps, at the changes of contact.",
          "largest step / E(0)", "varies", lambda run, _: measures.largest_energy_step(run),
          remark="The term of (3.2) that the paper names for it has the factor theta', zero here."),
    Claim("2e", 2, "section 5", "Between two changes of contact the energy is constant.",
          "largest drift / E(0)", "constant", lambda run, _: measures.energy_drift(run)),
    Claim("3a", 3, "section 5", "The trajectory is close to the one without rollers, and not the same.",
          "centre apart from massless / way", "close, not equal", centre_apart),
    Claim("3b", 3, "section 5", "So is the rotation about the vertical axis.",
          "heading apart from massless / angle turned", "close, not equal", heading_apart),
    Claim("3c", 3, "section 5, figure 6", "nu_3 is no longer constant.",
          "spread of nu_3 / nu_3(0)", "varies", lambda run, _: measures.spread(run.nu[:, 2])),
    Claim("3d", 3, "section 5, figure 7", "The kinetic energy changes in steps, as in motion 2.",
          "largest step / E(0)", "varies", lambda run, _: measures.largest_energy_step(run)),
    Claim("3e", 3, "section 5, figure 7", "Between two changes of contact the energy is constant.",
          "largest drift / E(0)", "constant", lambda run, _: measures.energy_drift(run)),
    Claim("3f", 3, "figure 5", "Without rollers the centre moves on a circle.",
          "largest deviation from a circle / radius", "constant", lambda run, _: measures.circle(run)[1],
          ("massless",)),
    Claim("3g", 3, "section 3, figure 5", "Without rollers nu_3, a linear integral, is constant.",
          "spread of nu_3 / nu_3(0)", "constant", lambda run, _: measures.spread(run.nu[:, 2]),
          ("massless",)),
)  # fmt: skip


def judge(runs: Runs) -> list[Finding]:
    """Every claim under every setting that it is about."""
    findings = []
    for claim in CLAIMS:
        massless = runs[claim.motion, MASSLESS.key]
        for setting in SETTINGS:
            if setting.roller_model in claim.about:
                value = claim.measure(runs[claim.motion, setting.key], massless)
                findings.append(Finding(claim, setting, value, claim.holds(value)))
    return findings
