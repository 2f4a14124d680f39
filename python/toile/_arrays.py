"""NumPy arrays and text on their way into the library and out of it."""

from __future__ import annotations

import ctypes
import os
from typing import Any, Optional, Union

import numpy as np

from ._errors import _check

PathLike = Union[str, "os.PathLike[str]"]
Array = Any


def _real(array: Array, what: str) -> np.ndarray:
    """Numbers as contiguous float64; what is no real number is refused, not converted."""
    a = np.asarray(array)
    if a.dtype.kind not in "iuf" and a.size:
        raise ValueError(f"{what}: must be real numbers, are {a.dtype}")
    return np.ascontiguousarray(a, dtype=np.float64)


def _f64(array: Array, columns: int, what: str) -> np.ndarray:
    """A contiguous copy or view with `columns` columns."""
    a = _real(array, what)
    if a.ndim == 1 and a.size == columns:
        a = a.reshape(1, columns)
    if a.ndim != 2 or a.shape[1] != columns:
        raise ValueError(f"{what}: shape {a.shape}, expected (n, {columns})")
    return a


def _u32(array: Array, what: str) -> np.ndarray:
    """Indices as contiguous uint32; negative ones and ones above 2^32 - 1 are refused."""
    a = np.asarray(array)
    if a.size == 0:
        return np.zeros(a.shape, np.uint32)
    if not np.issubdtype(a.dtype, np.integer):
        raise ValueError(f"{what}: must be integers, are {a.dtype}")
    if int(a.min()) < 0 or int(a.max()) > 0xFFFFFFFF:
        raise ValueError(f"{what}: from {a.min()} to {a.max()}, must fit 32 bits")
    return np.ascontiguousarray(a, dtype=np.uint32)


def _vector(values: Array, count: int, what: str) -> Any:
    a = _real(values, what).reshape(-1)
    if a.size != count:
        raise ValueError(f"{what}: {a.size} numbers, expected {count}")
    return (ctypes.c_double * count)(*a)


def _pointer(array: np.ndarray) -> Any:
    kind = {np.dtype(np.float64): ctypes.c_double, np.dtype(np.uint32): ctypes.c_uint32}
    return array.ctypes.data_as(ctypes.POINTER(kind[array.dtype]))


def _copy(function: Any, dtype: Any, *arguments: Any) -> np.ndarray:
    """Two calls: how many, then the values."""
    needed = ctypes.c_size_t()
    _check(function(*arguments, None, 0, ctypes.byref(needed)))
    out = np.empty(needed.value, dtype=dtype)
    if out.size:
        pointer = ctypes.cast(out.ctypes.data, function.argtypes[len(arguments)])
        _check(function(*arguments, pointer, out.size, ctypes.byref(needed)))
    return out


def _text(function: Any, *arguments: Any) -> str:
    data = _copy(function, np.uint8, *arguments).tobytes()
    return data.rstrip(b"\0").decode()


def _encode(text: str) -> bytes:
    return text.encode("utf-8")


def _dir(path: Optional[PathLike]) -> Optional[bytes]:
    return None if path is None else os.fsencode(path)
