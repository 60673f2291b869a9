"""The account of a run's energy: what it had, what it got, what it lost, and what is left unexplained."""

from dataclasses import dataclass

WORDS = {  # of the entries of an account, for people
    "start": "at the start",
    "end": "at the end",
    "switches": "switches",
    "drive_work": "work of the drive",
    "axle_loss": "axles' bearings",
    "roller_loss": "rollers' bearings",
    "ground_loss": "slip on the ground",
    "slope_work": "work of gravity",
    "weight_work": "work of the weight",
    "spring_energy": "springs and weight",
    "damper_loss": "dampers",
    "residual": "residual",
}


@dataclass(frozen=True)
class Ledger:
    """All in J.

    start, end      kinetic energies
    contributions   by name, positive where the vehicle gains: drive_work, axle_loss, roller_loss, ground_loss,
                    slope_work, weight_work, spring_energy, damper_loss, switches
    largest         kinetic energy during the run
    """

    start: float
    end: float
    contributions: dict[str, float]
    largest: float

    @property
    def residual(self) -> float:
        """What the contributions leave unexplained of end - start."""
        return self.end - self.start - sum(self.contributions.values())

    @property
    def scale(self) -> float:
        """The largest number in the account: what the residual is small against."""
        return max(self.largest, *(abs(value) for value in self.contributions.values()), 0.0)
