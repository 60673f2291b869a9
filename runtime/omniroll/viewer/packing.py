"""Plain data and arrays in one compressed text, which viewer/src/unpacking.js takes apart again.

The text is base64 of deflate (RFC 1951) of: the length of the description as 4 bytes, little-endian; the description
as JSON; the arrays. The description's "arrays" says of each where it stands. An array's bytes are reordered, first
bytes of all its numbers first: numbers of one size share their leading bytes, and so compress.
"""

import base64
import json
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np

TYPES = {"f8": "<f8", "f4": "<f4", "i4": "<i4", "u1": "<u1"}


def packed(description: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> str:
    """The text of plain data and of arrays by name."""
    index, parts, offset = {}, [], 0
    for name, array in arrays.items():
        kind = next(kind for kind, dtype in TYPES.items() if array.dtype == np.dtype(dtype))
        size = array.dtype.itemsize
        part = np.frombuffer(array.tobytes(), np.uint8).reshape(-1, size).T.tobytes()
        index[name] = {"type": kind, "shape": array.shape, "offset": offset}
        parts.append(part)
        offset += len(part)
    text = json.dumps({**description, "arrays": index}, allow_nan=False).encode()
    return compressed(b"".join([len(text).to_bytes(4, "little"), text, *parts]))


def compressed(content: bytes) -> str:
    """base64 of deflate of bytes."""
    compressor = zlib.compressobj(9, wbits=-15)
    return base64.b64encode(compressor.compress(content) + compressor.flush()).decode()
