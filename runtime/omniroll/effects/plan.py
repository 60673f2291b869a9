"""What an engine must know of the effects before a run starts."""

import math
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from omniroll.effects.effect import Modal, Sampler, Table

if TYPE_CHECKING:
    from omniroll.effects.effect_set import EffectRun


class Plan:
    """The forms in which the compiled engine knows the processes of a run, in the order of the effects.

    acting    the run's effects at its start; where an engine does not know them all, a run has others of its own
    tables, samplers, modal  the forms
    asks      whether some process has none, so that an engine must ask all of them at their events
    """

    def __init__(self, acting: "EffectRun"):
        self.acting = acting
        described = [process.compiled() for process in acting.processes]
        forms = [form for forms in described if forms is not None for form in forms]
        self.tables = [form for form in forms if isinstance(form, Table)]
        self.samplers = [form for form in forms if isinstance(form, Sampler)]
        self.modal = [form for form in forms if isinstance(form, Modal)]
        self.asks = None in described or len(self.modal) > 1

    @property
    def sticks(self) -> bool:
        """Whether axles may stick."""
        return self.acting.axles is not None

    @cached_property
    def has_events(self) -> bool:
        """Whether the effects have times or guards at the start."""
        return self.acting.next_time() < math.inf or bool(self.acting.begin_phase(0.0))

    @cached_property
    def guards_read_nu_alone(self) -> bool:
        """Whether no guard reads what stands behind nu in a state; of those that an engine must ask for."""
        return not self.asks or all(len(guard.weights) <= 3 for guard in self.acting.begin_phase(0.0))

    @cached_property
    def largest(self) -> float:
        """The largest of the numbers that torques and voltages are made of; inf where an engine must ask for them."""
        if self.asks:
            return math.inf
        numbers = [table.curve.values for table in self.tables] + [drive.laws for drive in self.modal]
        for sampler in self.samplers:
            numbers += [sampler.target.values, sampler.proportional, sampler.integral, np.array(sampler.sample_time)]
        return max((float(np.abs(array).max()) for array in numbers if array.size), default=0.0)
