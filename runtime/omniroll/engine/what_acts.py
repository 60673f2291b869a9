"""What acts in a run, as the compiled engine takes it: C structs with the bearings that may stick, and with the tables,
controllers and drives of a plan where the engine does these by itself.

What no run changes stands in memory once, for all runs of a plan; a run copies the structs and has its own numbers
where the engine writes.
"""

from functools import lru_cache
from typing import Any

import numpy as np

from omniroll.effects.effect_set import Plan
from omniroll.effects.numbers import Curve
from omniroll.effects.slipping_bearings import SlippingBearings
from omniroll.effects.slipping_rollers import spin_per_speed


class WhatActs:
    """The structs of a plan, as they are before a run.

    ffi     of the engine's library
    inputs  names of the kernel's inputs
    wheels  N
    """

    def __init__(self, ffi: Any, plan: Plan, inputs: tuple[str, ...], wheels: int):
        self.ffi, self.plan, self.wheels = ffi, plan, wheels
        self.kept: list[np.ndarray] = []  # what the structs point to
        entries = {"bearing": self._bearings(), "grip": self._grips()} | ({} if plan.asks else self._forms(inputs))
        self.ground = self._ground() if entries["grip"] else {}
        self.patterns = {name: ffi.new(f"omniroll_{name}_t[]", found) for name, found in entries.items() if found}

    def _bearings(self) -> list[dict[str, Any]]:
        """Those of axles, of rollers in contact, of free rollers; these have no row, and neither have axles of wheels
        that may slip."""
        acting, rollers = self.plan.acting, self.plan.acting.slipping_rollers
        if isinstance(acting.own_axles, SlippingBearings):
            return self._slipping_bearings(acting.own_axles)
        found = [own for own in (acting.axles or acting.bearings or acting.own_axles, rollers) if own is not None]
        if not found:
            return []
        sliding, holding = (
            np.concatenate([_by_kind(getattr(own, name)) for own in found]) for name in ("sliding", "holding")
        )
        own = [] if acting.own_axles or rollers else found[0].rows.tolist()
        rows = [*own, *[(0.0, 0.0, 0.0)] * (len(sliding) - len(own))]
        names = ("row", "sliding", "holding", "nearer")
        numbers = zip(rows, sliding, holding, np.ones(len(rows)), strict=True)
        return [dict(zip(names, own, strict=True)) for own in numbers]

    @staticmethod
    def _slipping_bearings(bearings: SlippingBearings) -> list[dict[str, Any]]:
        """The same beside contacts that stick; of axles only where these may stick, too. Each roller has the row that
        it has in contact, since it comes there."""
        kernel = bearings.kernel
        _, spins = kernel.wheel_rates(np.eye(3), np.zeros(kernel.wheels))
        order = bearings.in_order_of_the_engine()
        rows = np.zeros((len(bearings.sliding), 3))
        rows[kernel.wheels :] = np.repeat(spins.T, bearings.places, axis=0)
        names = ("row", "sliding", "holding", "nearer")
        numbers = zip(rows[order].tolist(), bearings.sliding[order], bearings.holding[order], np.ones(len(order)),
                      strict=True)  # fmt: skip
        return [dict(zip(names, own, strict=True)) for own in numbers]

    def _count_bearings(self, run: Any) -> None:
        """How many of the bearings are of axles and of free rollers, and what the engine must know of these."""
        vehicle, bearings = self.plan.acting.kernel.vehicle, self.plan.acting.bearings
        run.hold.undecided = int("bearing" in self.patterns)
        if self.plan.acting.axles is not None:
            run.axle_count = self.wheels
        axles = self.plan.acting.own_axles
        if isinstance(axles, SlippingBearings):
            run.own_count = len(axles.in_order_of_the_engine())
            run.axle_count = self.wheels if axles.may_stick.all() else 0
            run.roller_inertia, run.rate_of_speed = vehicle.roller_inertia, float(axles.reach.max())
        elif axles is not None:
            run.axle_count = run.own_count = self.wheels
            run.rate_of_speed = axles.reach
        rollers = self.plan.acting.slipping_rollers
        if rollers is not None:
            run.own_count += rollers.modes.size
            reach = spin_per_speed(self.plan.acting.kernel)
            run.roller_inertia, run.rate_of_speed = vehicle.roller_inertia, max(run.rate_of_speed, reach)
        if bearings is not None:
            run.axle_count, run.own_count = bearings.axle_count, len(bearings.sliding) - bearings.plane
            run.roller_inertia, run.rate_of_speed = vehicle.roller_inertia, 1 / vehicle.yaw_scale

    def _grips(self) -> list[dict[str, Any]]:
        ground = self.plan.acting.ground
        if ground is None:
            return []
        grip = ground.grip
        numbers = zip(grip.loads, grip.sliding.tolist(), grip.static.tolist(), strict=True)
        contacts = [
            {"load": load, "carries": int(load > 0), "sliding": sliding, "staying": static}
            for load, sliding, static in numbers
        ]
        return [contact | {"towards": (0.0, 1.0)} for contact in contacts]

    def _ground(self) -> dict[str, Any]:
        """What is the same for all contacts that have modes."""
        grip, vehicle = self.plan.acting.ground.grip, self.plan.acting.kernel.vehicle
        typical = float((grip.loads[:, None] * grip.sliding).max())
        radius = vehicle.platform_radius
        return {
            "undecided": 1,
            "typical": typical,
            "friction": typical / (vehicle.mass * radius),
            "settles": grip.settles(vehicle),
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
            | {"transition_count": len(form.transitions), "transitions": self._places(form.transitions)}
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
            setattr(run, name if name == "modal" else f"{name}s", own)
            setattr(run, f"{name}_count", len(own))
            kept.append(own)
        self._count_bearings(run)
        if "grip" in self.patterns:
            run.ground = self.ground
        sampled = np.zeros((run.sampler_count, 2, self.wheels))
        first = ffi.from_buffer("double[]", sampled) + 0
        for k in range(run.sampler_count):
            run.samplers[k].sum = first + 2 * k * self.wheels
            run.samplers[k].output = first + (2 * k + 1) * self.wheels
        for k, numbers in enumerate(modes[: run.modal_count]):
            run.modal[k].modes = ffi.from_buffer("long long[]", numbers)
        return kept, sampled

    def _pointer(self, array: np.ndarray) -> Any:
        self.kept.append(np.ascontiguousarray(array, float))
        return self.ffi.from_buffer("double[]", self.kept[-1])

    def _places(self, numbers: np.ndarray) -> Any:
        self.kept.append(np.ascontiguousarray(numbers, np.int64))
        return self.ffi.from_buffer("long long[]", self.kept[-1])

    def _curve(self, curve: Curve) -> dict[str, Any]:
        return {
            "width": curve.values.shape[1],
            "held": int(curve.interpolation == "hold"),
            "count": len(curve.knots),
            "next": int(np.searchsorted(curve.knots, 0.0, side="right")),
            "times": self._pointer(curve.knots),
            "values": self._pointer(curve.values),
        }


def _by_kind(torques: np.ndarray) -> np.ndarray:
    """Torques of bearings in the engine's order: of rollers (N, n) by place first those in contact."""
    return torques if torques.ndim == 1 else np.concatenate([torques[:, 0], torques[:, 1:].ravel()])


what_acts = lru_cache(maxsize=64)(WhatActs)  # of the plans that runs share
