"""What the page shows of a run: plain data and arrays."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from omniroll.results.ledger import WORDS
from omniroll.results.pictures import rows_between
from omniroll.results.trajectory import Trajectory
from omniroll.vehicles.state import by_roller
from omniroll.vehicles.vehicle import Vehicle
from omniroll.viewer.pieces import Pieces, pieces_of

MOST_SPINS = 4_000_000  # numbers; beyond them the rollers off the ground are drawn at rest on their disks
AXIAL = 2.0**-16  # rad/s: axial speeds are multiples of it, so that constant ones stay constant in a file
POINTS = 500  # samples of the energy among the rows


@dataclass(frozen=True, eq=False)
class Shown:
    """A run, its name on the page, and the forces of the ground in its T rows.

    forces  (T, N, 3) in N: along the axle, along the rolling direction, upwards; None where they are not known. Of
            wheels that may slip the run has them, and on springs the loads, too
    """

    run: Trajectory
    label: str
    forces: np.ndarray | None = None

    def __post_init__(self) -> None:
        along = self.run.ground_force
        if self.forces is None and along is not None:
            upwards = np.zeros(along.shape[:-1]) if self.run.presses is None else self.run.ground_load
            object.__setattr__(self, "forces", np.concatenate([along, upwards[..., None]], axis=-1))

    def description(self) -> dict[str, Any]:
        """What is not an array, as JSON can hold it; units SI."""
        run, vehicle = self.run, self.run.vehicle
        return {
            "label": self.label,
            "roller_model": run.roller_model,
            "switching": run.switching,
            "start_time": run.start_time,
            "switches": len(run.switches),
            "ledger_words": {name: WORDS.get(name, name) for name in self._gains()},
            "vehicle": {
                "wheels": vehicle.wheels,
                "rollers": vehicle.rollers_per_wheel,
                "angles": vehicle.wheel_angles,
                "places": run.vehicle.places().tolist(),
                "platform_radius": vehicle.platform_radius,
                "wheel_radius": vehicle.wheel_radius,
                "roller_axis_radius": vehicle.roller_axis_radius,
                "yaw_scale": vehicle.yaw_scale,
                "center_of_mass": vehicle.center_of_mass,
                **_kind_of_wheels(vehicle),
                **_kinds(vehicle),
            },
        }

    def arrays(self) -> dict[str, np.ndarray]:
        """The arrays by name; viewer/src/run.js reads them. P pieces, T rows, K switches, E points of the energy.

        start, contact, degree, coefficients   the pieces, as omniroll.viewer.pieces.Pieces has them
        axial         (N, n, 2, P) in rad/s, absolute axial speeds of the free rollers by physical number at the starts
                      and ends of the pieces; that of the roller in contact has no meaning. Only with free rollers
        forces        (2, P, N, 3) in N at the same places, as `forces` above. Only where they are known
        slip          (2, P, N, 2) in m/s at the same places: along the axle, along the rolling direction. Only where
                      wheels may slip
        tilt          (2, P, 3) at the same places: heave of the centre of mass in m, turns about xi and eta in rad.
                      Only on springs
        switch_time   (K,) in s since the start; switch_wheel (K,)
        row_time      (T,) in s since the start
        ledger        (A, T) in J, gained since the start, by entry of the ledger
        energy_time   (E,) in s since the start; energy (E,) in J
        """
        run, pieces = self.run, pieces_of(self.run)
        curve = rows_between(run, run.t[-1], POINTS)
        row, wheel = np.nonzero(run.contact[1:] != run.contact[:-1])
        arrays = {
            "start": pieces.start,
            "contact": pieces.contact.astype("i4"),
            "degree": pieces.degree.astype("u1"),
            "coefficients": pieces.coefficients,
            "switch_time": run.elapsed[row + 1],
            "switch_wheel": wheel.astype("i4"),
            "row_time": run.elapsed,
            "ledger": np.array(list(self._gains().values()), "f4"),
            "energy_time": curve.t - run.start_time,
            "energy": curve.energy.astype("f4"),
        }
        if run.spins is not None and run.spins.size <= MOST_SPINS:
            arrays["axial"] = _axial(run, pieces)
        if self.forces is not None:
            arrays["forces"] = self.forces[pieces.rows].astype("f4")
        if run.slip is not None:
            arrays["slip"] = run.slip[pieces.rows].astype("f4")
        if run.presses is not None:
            arrays["tilt"] = run.quantity("tilt")[pieces.rows].astype("f4")
        return arrays

    def _gains(self) -> Mapping[str, np.ndarray]:
        """(T,) the energy gained from each effect and at switches since the start, in J."""
        run = self.run
        switched = (run.contact[1:] != run.contact[:-1]).any(axis=1)
        jumps = np.append(0.0, np.where(switched, np.diff(run.energy), 0.0))
        return run.contributions() | {"switches": np.cumsum(jumps)}


def _kind_of_wheels(vehicle: Vehicle) -> dict[str, Any]:
    """What the page does not take for granted of rollers: their angles by wheel, and how far their rows are apart."""
    if vehicle.has_wheels_of_the_paper:
        return {}
    return {"roller_angles": vehicle.roller_angle, "row_offset": vehicle.row_offset}


def _kinds(vehicle: Vehicle) -> dict[str, Any]:
    """Of wheels of several kinds: what each wheel has in the place of the vehicle's."""
    if not vehicle.has_kinds:
        return {}
    names = ("wheel_radius", "roller_axis_radius", "row_offset")
    own = [vehicle.by_wheel[name] for name in names]
    of_wheels = zip(vehicle.rollers, *own, strict=True)
    return {"kinds": [dict(zip(("rollers", *names), wheel, strict=True)) for wheel in of_wheels]}


def _axial(run: Trajectory, pieces: Pieces) -> np.ndarray:
    axial = run.kernel.axial_speeds(run.nu, run.chi, run.spins)
    whole = np.concatenate([np.zeros_like(axial[..., :1]), axial], axis=-1)
    axial = by_roller(whole, run.contact, np.array(run.vehicle.rollers))
    axial = np.round(axial / AXIAL) * AXIAL
    return np.ascontiguousarray(np.moveaxis(axial[pieces.rows], (2, 3), (0, 1)), "f4")
