"""What functions on vector registers need: how many wheels they have room for, and memory that vectors load from."""

import numpy as np

MOST_WHEELS = 64  # MAX_WHEELS in set_in_lanes.h
ALIGNMENT = 128  # bytes


def aligned(size: int) -> np.ndarray:
    """`size` doubles at an address that vectors can be loaded from, all 0."""
    raw = np.zeros(size + ALIGNMENT // 8)
    first = -(raw.ctypes.data // 8) % (ALIGNMENT // 8)
    return raw[first : first + size]
