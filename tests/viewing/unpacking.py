"""The data of a page taken apart again, in Python."""

import base64
import json
import re
import zlib
from math import comb

import numpy as np

TYPES = {"f8": float, "f4": np.float32, "i4": np.int32, "u1": np.uint8}


def unpacked(html: str) -> tuple[dict, dict[str, np.ndarray]]:
    """The description and the arrays of a page."""
    (text,) = re.findall(r'<script type="text/plain" id="data">(.*?)</script>', html)
    content = zlib.decompress(base64.b64decode(text), wbits=-15)
    start = 4 + int.from_bytes(content[:4], "little")
    description = json.loads(content[4:start])
    arrays = {}
    for name, about in description["arrays"].items():
        dtype, count = np.dtype(TYPES[about["type"]]), int(np.prod(about["shape"]))
        first = start + about["offset"]
        parts = np.frombuffer(content[first : first + count * dtype.itemsize], np.uint8)
        numbers = np.ascontiguousarray(parts.reshape(dtype.itemsize, count).T)
        arrays[name] = numbers.view(dtype).reshape(about["shape"])
    return description, arrays


class Pieces:
    """A run's pieces as they stand on a page: arrays without the run's number in their names."""

    def __init__(self, arrays: dict[str, np.ndarray]):
        self.arrays = arrays
        self.offsets = np.concatenate([[0], np.cumsum(arrays["degree"].astype(int) + 1)])

    def at(self, elapsed: float) -> tuple[int, float, np.ndarray]:
        """The piece, the part of it that has passed, and all its columns, at a time since the start."""
        start = self.arrays["start"]
        piece = np.searchsorted(start, elapsed, side="right") - 1
        length = start[piece + 1] - start[piece] if piece + 1 < len(start) else 0.0
        x = (elapsed - start[piece]) / length if length else 0.0
        changes = self.arrays["coefficients"][:, self.offsets[piece] : self.offsets[piece + 1]]
        degree = changes.shape[1] - 1
        basis = [comb(degree, k) * x**k * (1 - x) ** (degree - k) for k in range(degree + 1)]
        return piece, x, np.cumsum(changes, axis=1) @ basis
