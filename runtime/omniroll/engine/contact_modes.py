"""The modes of contacts in the rows of a run, where those go that slip under Coulomb's friction, and what they carry.

The force of a contact that slips depends on the direction of its slip alone. So what a phase is given are the contacts'
modes and these directions; that the slips follow the directions is one more equation (variations.py).
"""

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from omniroll.kernels.kernel import Kernel
from omniroll.kernels.tangent_kernel import with_tangent
from omniroll.results.accelerations import call_named
from omniroll.results.slipping import as_if_rigid, slip_roundings
from omniroll.results.trajectory import Trajectory

NEAR_REST = 30  # times what is zero of a slip: the direction of less on the way to rest is what an iteration has left
MODES = ("sticks", "slip_heading")  # what rows keep of contacts


def pushes(kernel: Kernel, known: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """`ground_push` (..., N, 2) in N, the forces on contacts with `slip_heading` and `load` (..., N), 0 for those that
    stick; with what `pushed` (..., N, 2) adds to them. Where massless rollers may stick, `ground_yield` (..., N)."""
    heading = np.asarray(known["slip_heading"])
    if "corner_forces" in kernel.signatures:
        return _pushes_in_strips(kernel, known, heading)
    across = np.cos(heading) if kernel.has_spins else np.zeros_like(heading)  # massless rollers slip one way alone
    towards = np.stack([across, np.sin(heading)], axis=-1)
    force, _ = kernel.call("sliding_forces", towards, known["load"], known["friction"])
    return {"ground_push": force + known["pushed"]}


def _pushes_in_strips(kernel: Kernel, known: Mapping[str, np.ndarray], heading: np.ndarray) -> dict[str, np.ndarray]:
    """The same where massless rollers may stick: one that turns has its contact slip along the rolling direction alone,
    and its bearing says the force along the axle (maxima/effects/contact_strip.mac)."""
    turns, slips = np.asarray(known["contact_sticks"]) < 0.5, np.asarray(known["load"]).real > 0
    across, along = np.where(turns, 0.0, np.cos(heading)), np.where(turns, np.sign(heading.real), np.sin(heading))
    given = dict(known) | {"slip_direction": np.stack([across, along], axis=-1)}
    given["load"] = np.where(slips, known["load"], 1.0)
    force, _ = call_named(kernel, "sliding_forces", dict(given) | {"load": known["load"]})
    with np.errstate(divide="ignore", invalid="ignore"):  # of those that are in no corner
        corner, per_slip = call_named(kernel, "corner_forces", given)
    both = turns & slips
    rolling = np.where(both, corner, force[..., 1])
    push = np.stack([np.broadcast_to(force[..., 0], rolling.shape), rolling], axis=-1)
    return {"ground_push": push + known["pushed"], "ground_yield": np.where(both, per_slip, 0.0)}


def slips(kernel: Kernel, known: Mapping[str, np.ndarray]) -> np.ndarray:
    """(..., N, 2) in m/s, the slip velocities of states, by what generated functions take; where massless rollers may
    stick those of wheels whose rollers do."""
    given = dict(known) | {"ground_push": np.zeros((kernel.wheels, 2))}
    if "corner_forces" in kernel.signatures:
        given |= as_if_rigid(kernel.wheels)
    return call_named(kernel, "slip_forces", given)[0]


class ContactModes:
    """The contacts (N,) of a run.

    sticks   (T, N) bool in each row: where a step starts those of the step, in others those with which a phase ends
    slides   (T, N) bool: those that slip under a load
    turns    whether there are slips of two components, so that their directions turn
    turning  (T, N) bool: those that slip with two components
    headings (T, N) in rad, where slips go in rows in which they are rounding
    """

    def __init__(self, trajectory: Trajectory, plain: Kernel, deviations, rigid: np.ndarray | None = None):
        """rigid: (T, N) bool, wheels whose massless rollers stick in the rows; None where these may not."""
        self.plain, self.deviations = plain, deviations
        self.grip = trajectory.effects.grip(plain.vehicle)
        names = trajectory.effects.drives()
        self.headings = trajectory.drive[:, names.index("slip_heading")]
        self.sticks = trajectory.drive[:, names.index("sticks")] > 0.5
        self.slides = ~self.sticks & (self.grip.loads > 0)
        self.turns = plain.has_spins or rigid is not None
        self.turning = self.slides & (plain.has_spins if rigid is None else rigid)
        self.first = 0 if self.turns else 1  # of the components of slips

    def at(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """What generated functions take of the contacts in rows (...), by name."""
        return self.where(self.slides[rows])

    def where(self, slides: np.ndarray) -> dict[str, np.ndarray]:
        """The same where contacts (..., N) slip."""
        load = np.where(slides, self.grip.loads, 0.0)
        return {"load": load, "friction": self.grip.sliding, "pushed": np.zeros((self.plain.wheels, 2))}

    def moved(self, found: Mapping[str, np.ndarray], tangents: Mapping[str, np.ndarray]) -> dict:
        """The same, carrying tangents (P, ...) of the numbers, for states with one axis behind that of P."""
        still = {"ground_friction": found["friction"], "contact_load": self.grip.loads}
        of_friction, of_load = (tangents.get(name, np.zeros((1, *own.shape)))[:, None] for name, own in still.items())
        moving = {"friction": with_tangent(found["friction"], of_friction)}
        moving["load"] = with_tangent(found["load"], np.where(found["load"] > 0, of_load, 0.0))
        return dict(found) | moving

    def per_reach(self) -> np.ndarray:
        """(N, 2) one over the squares of what static friction can hold, in 1/N^2."""
        reach = self.grip.loads[:, None] * np.broadcast_to(self.grip.static, (self.plain.wheels, 2))
        with np.errstate(divide="ignore"):
            found = np.where(reach > 0, reach**-2.0, 0.0)
        found[:, : self.first] = 0.0
        return found

    def roundings(self, y: np.ndarray) -> np.ndarray:
        """(..., N) in m/s, within which slips are zero in states (..., size)."""
        views = self.deviations.vector.views(y)
        return slip_roundings(self.plain.vehicle, views["nu"], views["rates"], views.get("contact_omega"))

    def noises(self, y: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """(..., N) in m/s, within which slips do not say where they go, in states (..., size) of steps that end in rows
        (...)."""
        return self.roundings(y) * np.where(self.rests[rows], NEAR_REST, 1)

    def headed(self, y: np.ndarray, inputs: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """(..., U) inputs, with the headings of contacts that slip in states (..., size), of the phases of rows (...).
        Where a slip does not say where it goes it has the row's own heading. Inside a step that is the row with which
        it ends: if the slip comes to rest there the row knows where it went, and else where it began in this phase."""
        inputs = np.array(inputs)
        headings = self.deviations.views(inputs)["slip_heading"]
        headings[...] = self.headings[rows]
        if self.turns:
            slip = slips(self.plain, self.deviations.known_in(y, inputs))
            known = np.linalg.norm(slip, axis=-1) > self.noises(y, rows)
            headings[...] = np.where(known & self.turning[rows], np.arctan2(slip[..., 1], slip[..., 0]), headings)
        return inputs

    @cached_property
    def rests(self) -> np.ndarray:
        """(T, N) bool: contacts that slip in a row in any direction, and come to rest behind it."""
        found = np.zeros_like(self.slides)
        found[:-1] = self.turning[:-1] & self.sticks[1:]
        return found
