"""What the compiled engine knows of rollers with several arcs: the vehicle on each, and at which angles it carries."""

from typing import Any

import numpy as np

from omniroll.kernels.by_state import has_pieces, kernel_on_pieces, piece_numbers, pieces_of
from omniroll.kernels.kernel import Kernel


class Pieces:
    """The pieces of a roller in memory that the engine reads; of other wheels there is one, of which it reads nothing.

    bound  the kernel of the engine's set
    ffi    of the engine
    """

    def __init__(self, bound: Kernel, ffi: Any):
        self.bound = bound
        self.several = has_pieces(bound.vehicle)
        found = pieces_of(bound.vehicle) if self.several else ()
        self.count, self.ends = max(1, len(found)), np.array([piece[1:] for piece in found]).ravel()
        self.kernels = [kernel_on_pieces(bound, (k,) * bound.wheels) for k in range(len(found))]
        self.pointers = [ffi.from_buffer("double[]", self.ends), ffi.NULL]
        if found:
            self.pointers[1] = ffi.new("omniroll_model *[]", [own.model_for(ffi) for own in self.kernels])

    def put_into(self, run: Any) -> None:
        """Tell a run, whose struct points here from now on."""
        run.pieces.count = self.count
        run.pieces.ends, run.pieces.models = self.pointers

    def contact_numbers(self, contact: np.ndarray, nu: np.ndarray, chi: np.ndarray) -> np.ndarray:
        """(N,) the contacts' numbers as the engine counts them, from those of the rollers. A wheel on a border stands
        on the piece to which it turns."""
        if not self.several:
            return contact
        numbers = piece_numbers(self.bound.vehicle, chi)
        turns_back = (chi == self.ends[2 * numbers]) & (numbers > 0) & (self.bound.wheel_speeds(nu, chi) < 0)
        rollers = self.bound.rollers_per_wheel
        return contact % (2 * rollers) + 2 * rollers * (numbers - turns_back)
