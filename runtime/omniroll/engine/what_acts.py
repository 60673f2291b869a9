"""What acts in a run, as the compiled engine takes it: C structs with the bearings that may stick, and with the tables,
controllers and drives of a plan where the engine does these by itself.

What no run changes stands in memory once, for all runs of a plan; a run copies the structs and has its own numbers
where the engine writes.
"""

from functools import lru_cache
from typing import Any

import numpy as np

from omniroll.effects.effect_set import BEARINGS, Plan
from omniroll.effects.friction import Bearing
from omniroll.effects.numbers import Curve

PLACES = {  # where a run has what acts: the group in its struct, the field, and how many there are
    "bearing": ("bearings", "each", "count"), "grip": ("ground", "grips", "grip_count"),
    "table": ("acts", "tables", "table_count"), "sampler": ("acts", "samplers", "sampler_count"),
    "modal": ("acts", "modal", "modal_count"),
}  # fmt: skip
SETTLES = 1e-9  # of the acceleration that friction gives the vehicle: a slip comes to rest that falls faster


class WhatActs:
    """The structs of a plan, as they are before a run.

    ffi     of the engine's library
    inputs  names of the kernel's inputs
    wheels  N
    """

    def __init__(self, ffi: Any, plan: Plan, inputs: tuple[str, ...], wheels: int):
        self.ffi, self.plan, self.wheels = ffi, plan, wheels
        self.kernel, self.stick = plan.acting.kernel, plan.acting.effects.bearings(plan.acting.kernel)
        self.grip = plan.acting.effects.grip(self.kernel.vehicle)
        self.found = self._of_set(inputs)
        self.kept: list[np.ndarray] = []  # what the structs point to
        entries = {"bearing": self._bearings(), "grip": self._grips()} | ({} if plan.asks else self._forms(inputs))
        self.ground = self._ground() if entries["grip"] else {}
        self.patterns = {name: ffi.new(f"omniroll_{name}_t[]", found) for name, found in entries.items() if found}

    def _of_set(self, inputs: tuple[str, ...]) -> dict[str, Bearing]:
        """The bearings, "axle" of the wheels and "roller", that the engine's set knows. Where wheels may slip, those
        that may not stick in the scene take nothing, turning or at rest."""
        if not self.kernel.slips:
            return self.stick
        none = Bearing(np.zeros(self.wheels), np.zeros(self.wheels))
        known = [name for name, torque in (("axle", BEARINGS[0]), ("roller", BEARINGS[1])) if torque in inputs]
        return dict.fromkeys(known, none) | self.stick

    def _bearings(self) -> list[dict[str, Any]]:
        """Those of axles, of rollers in contact, of free rollers. Rows are their rates for each of nu, of those whose
        rates follow from it; beside contacts that stick each roller has the row that it has in contact, since it comes
        there."""
        kernel, wheels = self.kernel, self.wheels
        axles, rollers = self.found.get("axle"), self.found.get("roller")
        free = kernel.rollers_per_wheel - 1 if kernel.has_spins else 0
        of_axles = np.zeros((wheels, 3)) if kernel.slips else kernel.wheel_rows
        of_rollers = kernel.wheel_rates(np.eye(3), np.zeros(wheels))[1].T
        beside = rollers is not None and self.grip is not None
        if kernel.slips and not beside:
            of_rollers = np.zeros((wheels, 3))
        parts = [] if axles is None else [(of_axles, axles.sliding, axles.holding)]
        if rollers is not None:
            each = np.repeat(np.arange(wheels), free)
            of_free = of_rollers[each] if beside else np.zeros((len(each), 3))
            parts += [(of_rollers, rollers.sliding, rollers.holding)]
            parts += [(of_free, rollers.sliding[each], rollers.holding[each])]
        return [
            {"row": row, "sliding": sliding, "holding": holding, "nearer": 1.0}
            | {"mode": int(kernel.slips and holding == 0)}
            for rows, *torques in parts
            for row, sliding, holding in zip(rows.tolist(), *torques, strict=True)
        ]

    def places_of_modes(self) -> np.ndarray:
        """(B,) of the bearings that may stick in the scene, among all that the engine has: of axles, then of the
        rollers wheel by wheel, that in contact first."""
        kernel, wheels = self.kernel, self.wheels
        first, found = 0, [np.zeros(0, int)]
        if "axle" in self.found:
            first = wheels
            found += [np.arange(wheels)] * ("axle" in self.stick)
        if "roller" in self.stick:
            free = kernel.rollers_per_wheel - 1 if kernel.has_spins else 0
            of_free = first + wheels + np.arange(wheels * free).reshape(wheels, free)
            found.append(np.concatenate([first + np.arange(wheels)[:, None], of_free], axis=1).ravel())
        return np.concatenate(found)

    def _count_bearings(self, run: Any) -> None:
        """How many of the bearings are of axles and have rates of their own, and what the engine must know of these."""
        kernel, vehicle, bearings = self.kernel, self.kernel.vehicle, run.bearings
        axles, rollers = self.found.get("axle"), self.found.get("roller")
        run.hold.undecided = int("bearing" in self.patterns)
        bearings.axle_count = 0 if axles is None else self.wheels
        free = self.wheels * (kernel.rollers_per_wheel - 1) if kernel.has_spins and rollers is not None else 0
        if not kernel.slips:
            bearings.core_count = free
            if rollers is not None:
                bearings.roller_inertia, bearings.rate_of_speed = vehicle.roller_inertia, 1 / vehicle.yaw_scale
            return
        bearings.core_count = bearings.axle_count + free + (0 if rollers is None else self.wheels)
        asks = axles is not None or (self.grip is not None and rollers is not None)
        rates = [float(np.linalg.norm(kernel.wheel_rows, axis=1).max())] if asks else []
        if rollers is not None:
            bearings.roller_inertia = vehicle.roller_inertia
            _, spins = kernel.wheel_rates(np.eye(3), np.zeros(kernel.wheels))  # of rollers that roll, or stand in space
            rates += [float(np.linalg.norm(spins, axis=0).max()), 1 / vehicle.yaw_scale]
        bearings.rate_of_speed = max(rates, default=0.0)

    def _grips(self) -> list[dict[str, Any]]:
        if self.grip is None:
            return []
        numbers = zip(self.grip.loads, self.grip.sliding.tolist(), self.grip.static.tolist(), strict=True)
        return [
            {"load": load, "at_rest": load, "carries": int(load > 0), "sliding": sliding, "staying": static}
            | {"towards": (0.0, 1.0)}
            for load, sliding, static in numbers
        ]

    def _ground(self) -> dict[str, Any]:
        """What is the same for all contacts that have modes."""
        vehicle = self.kernel.vehicle
        typical, radius = self.grip.largest, vehicle.platform_radius
        return {
            "undecided": 1,
            "typical": typical,
            "friction": typical / (vehicle.mass * radius),
            "settles": SETTLES * typical / vehicle.mass,
            "reach": vehicle.wheel_radius - vehicle.roller_axis_radius,
            "arms": [radius, 2 * radius / vehicle.yaw_scale, vehicle.wheel_radius, vehicle.roller_radius],
        }

    def _forms(self, inputs: tuple[str, ...]) -> dict[str, list[dict[str, Any]]]:
        """Tables, controllers and drives with modes."""
        plan, ffi = self.plan, self.ffi
        signals = [*inputs, "voltage"]
        tables = [{"signal": signals.index(form.signal), "curve": self._curve(form.curve)} for form in plan.tables]
        samplers = [
            {"signal": signals.index(form.signal), "sample_time": form.sample_time, "limit": form.limit}
            | {"target": self._curve(form.target)}
            | {name: self._pointer(getattr(form, name)) for name in ("proportional", "integral")}
            for form in plan.samplers
        ]
        for _, form in plan.called:
            samplers.append({"signal": signals.index(form.signal), "sample_time": form.sample_time})
        modal = [
            {"signal": signals.index(form.signal), "event_count": form.laws.shape[2] - 1}
            | {"transition_count": len(form.transitions), "transitions": self._pointer(form.transitions, np.int64)}
            | {"laws": ffi.cast("omniroll_affine_t *", self._pointer(form.laws))}
            | {"wheel_rows": self._pointer(form.wheel_rows)}
            for form in plan.modal
        ]
        return {"table": tables, "sampler": samplers, "modal": modal}

    def put_into(self, run: Any, modes: list[np.ndarray]) -> tuple[list[Any], np.ndarray]:
        """Have a run's struct point to structs of its own: these, and the sums and outputs (S, 2, N) of its samplers.

        Where bearings or contacts may stick, it is to be decided which do.

        modes  (N,) of each drive with modes, which the engine changes

        All three must live as long as the run.
        """
        ffi, kept = self.ffi, []
        for name, pattern in self.patterns.items():
            own = ffi.new(ffi.typeof(pattern), len(pattern))
            ffi.memmove(own, pattern, ffi.sizeof(pattern))
            group, field, count = PLACES[name]
            setattr(getattr(run, group), field, own)
            setattr(getattr(run, group), count, len(own))
            kept.append(own)
        self._count_bearings(run)
        if "grip" in self.patterns:
            run.ground = self.ground
        acts = run.acts
        sampled = np.zeros((acts.sampler_count, 2, self.wheels))
        first = ffi.from_buffer("double[]", sampled) + 0
        for k in range(acts.sampler_count):
            acts.samplers[k].sum = first + 2 * k * self.wheels
            acts.samplers[k].output = first + (2 * k + 1) * self.wheels
        for k, numbers in enumerate(modes[: acts.modal_count]):
            acts.modal[k].modes = ffi.from_buffer("long long[]", numbers)
        return kept, sampled

    def _pointer(self, array: np.ndarray, kind: type = float) -> Any:
        self.kept.append(np.ascontiguousarray(array, kind))
        return self.ffi.from_buffer("double[]" if kind is float else "long long[]", self.kept[-1])

    def _curve(self, curve: Curve) -> dict[str, Any]:
        return {
            "width": curve.values.shape[1],
            "held": int(curve.interpolation == "hold"),
            "count": len(curve.knots),
            "next": int(np.searchsorted(curve.knots, 0.0, side="right")),
            "times": self._pointer(curve.knots),
            "values": self._pointer(curve.values),
        }


what_acts = lru_cache(maxsize=64)(WhatActs)  # of the plans that runs share
