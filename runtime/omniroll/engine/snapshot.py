"""The memory of a run of the compiled engine as bytes, and back: structs without their pointers, arrays whole."""

from typing import Any

import numpy as np


class Memory:
    """Some structs and arrays. The bytes of one are another's where both have the same sizes."""

    def __init__(self, ffi: Any, structs: list, arrays: list[np.ndarray]):
        self.structs = [(_bytes_of(ffi, struct), _plain(ffi, struct)) for struct in structs]
        self.arrays = arrays
        sizes = [np.count_nonzero(plain) for _, plain in self.structs] + [array.nbytes for array in arrays]
        self.ends = np.cumsum([0, *sizes]).tolist()

    @property
    def size(self) -> int:
        return self.ends[-1]

    def read(self) -> bytes:
        parts = [struct[plain].tobytes() for struct, plain in self.structs]
        return b"".join(parts + [array.tobytes() for array in self.arrays])

    def write(self, saved: bytes) -> None:
        parts = [saved[start:end] for start, end in zip(self.ends, self.ends[1:], strict=False)]
        for (struct, plain), part in zip(self.structs, parts, strict=False):
            struct[plain] = np.frombuffer(part, np.uint8)
        for array, part in zip(self.arrays, parts[len(self.structs) :], strict=True):
            array[...] = np.frombuffer(part, array.dtype).reshape(array.shape)


def _bytes_of(ffi: Any, struct: Any) -> np.ndarray:
    """All bytes of a struct, or of an array of them: a view of its memory."""
    return np.frombuffer(ffi.buffer(struct), np.uint8)


def _plain(ffi: Any, struct: Any) -> np.ndarray:
    """Which of these bytes are of no pointer."""
    kind = ffi.typeof(struct).item
    count = len(ffi.buffer(struct)) // ffi.sizeof(kind)
    plain = np.ones(ffi.sizeof(kind), bool)
    for start, size in _pointers(ffi, kind, 0):
        plain[start : start + size] = False
    return np.tile(plain, count)


def _pointers(ffi: Any, kind: Any, offset: int) -> list[tuple[int, int]]:
    """Where the pointers of a struct stand, and their sizes, in bytes; those of structs inside it too."""
    found = []
    for _, field in kind.fields:
        if field.type.kind == "pointer":
            found.append((offset + field.offset, ffi.sizeof(field.type)))
        elif field.type.kind == "struct":
            found += _pointers(ffi, field.type, offset + field.offset)
    return found
