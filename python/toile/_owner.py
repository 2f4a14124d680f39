"""Handles of the library: each freed once."""

from __future__ import annotations

import ctypes
from typing import Any, Optional

from ._errors import _check


class _Owner:
    """Owns a handle; frees it once, at ``close``, at the end of ``with``, or when collected."""

    _free: Any = None

    def __init__(self) -> None:
        self._handle: Optional[int] = None

    def _take(self, function: Any, *arguments: Any) -> None:
        out = ctypes.c_void_p()
        _check(function(*arguments, ctypes.byref(out)))
        self._handle = out.value

    @property
    def handle(self) -> Any:
        """The C handle; an error once closed."""
        if self._handle is None:
            raise ValueError(f"this {type(self).__name__} is closed")
        return ctypes.c_void_p(self._handle)

    def __reduce_ex__(self, protocol: Any) -> Any:
        # a handle means nothing in another process, and a copy would free it a second time
        raise TypeError(f"a {type(self).__name__} can be neither pickled nor copied")

    def close(self) -> None:
        """Frees the object in the library; closing twice does nothing."""
        if self._handle is not None:
            handle, self._handle = self._handle, None
            type(self)._free(ctypes.c_void_p(handle))

    def __del__(self) -> None:
        # at interpreter exit parts of this module may be gone
        if getattr(self, "_handle", None) is not None and type(self)._free is not None:
            self.close()
