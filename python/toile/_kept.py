"""Memory of the library as NumPy arrays that cannot outlive it."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from . import _ffi
from ._errors import _check
from ._ffi import lib
from ._owner import _Owner


class _Kept(_Owner):
    """Numbers that the library keeps where they are, and as they are, while this object lives.

    NumPy's arrays over them hold on to this object (``array.base``), and so do their slices: the
    memory goes with the last of them. The simulation may change or be closed meanwhile, in this
    thread or another.
    """

    _free = lib.toile_array_free

    def __init__(self, function: Any, handle: Any) -> None:
        super().__init__()
        self._take(function, handle)
        view = _ffi.new("toile_view_f64")
        _check(lib.toile_array_view(self.handle, ctypes.byref(view)))
        self.shape = (view.count, view.components)
        self.__array_interface__ = {
            "version": 3,
            "shape": self.shape,
            "typestr": np.dtype(np.float64).str,
            "strides": (view.stride, 8),
            # read-only
            "data": (ctypes.cast(view.data, ctypes.c_void_p).value or 0, True),
        }


def _kept(function: Any, handle: Any) -> np.ndarray:
    """What `function` gives of a simulation, without a copy."""
    memory = _Kept(function, handle)
    return np.asarray(memory) if memory.shape[0] else np.zeros(memory.shape)
