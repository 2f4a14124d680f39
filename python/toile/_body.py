"""Bodies: shapes that cloth meets."""

from __future__ import annotations

import ctypes
import os
from typing import Any

import numpy as np

from . import _ffi
from ._arrays import Array, PathLike, _f64, _pointer, _real, _u32, _vector
from ._errors import _check
from ._ffi import lib
from ._owner import _Owner


class Body(_Owner):
    """A shape that cloth meets: a signed distance, negative inside."""

    _free = lib.toile_body_free

    @classmethod
    def _make(cls, function: Any, *arguments: Any) -> Body:
        body = cls()
        body._take(function, *arguments)
        return body

    def __enter__(self) -> Body:
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    @classmethod
    def sphere(cls, radius: float) -> Body:
        """Sphere around the origin, radius [m]."""
        return cls._make(lib.toile_body_sphere, radius)

    @classmethod
    def capsule(cls, half_length: float, radius: float) -> Body:
        """Capsule along y from -half_length to half_length [m]."""
        return cls._make(lib.toile_body_capsule, half_length, radius)

    @classmethod
    def plane(cls, normal: Array = (0, 1, 0), offset: float = 0.0) -> Body:
        """Half space where ``normal . x <= offset``."""
        return cls._make(lib.toile_body_plane, _vector(normal, 3, "normal"), offset)

    @classmethod
    def grid(cls, values: Array, origin: Array, cell_size: float) -> Body:
        """Signed distances [m] at grid nodes, shape (nx, ny, nz), first node at `origin` [m]."""
        data = _real(values, "values")
        if data.ndim != 3:
            raise ValueError(f"values: shape {data.shape}, expected (nx, ny, nz)")
        desc = _ffi.new("toile_sdf_grid_desc")
        desc.counts = (ctypes.c_uint32 * 3)(*data.shape)
        desc.origin = _vector(origin, 3, "origin")
        desc.cell_size = cell_size
        desc.values, desc.value_count = _pointer(data), data.size
        return cls._make(lib.toile_body_grid, ctypes.byref(desc))

    @classmethod
    def mesh(cls, positions: Array, triangles: Array, cell_size: float = 0.0) -> Body:
        """Closed mesh: positions [m], shape (n, 3), triangles, shape (m, 3)."""
        x = _f64(positions, 3, "positions")
        t = _u32(triangles, "triangles")
        if t.ndim != 2 or t.shape[1] != 3:
            raise ValueError(f"triangles: shape {t.shape}, expected (n, 3)")
        return cls._make(lib.toile_body_mesh, _pointer(x), len(x), _pointer(t), len(t), cell_size)

    @classmethod
    def obj(cls, path: PathLike, scale: float = 1.0, cell_size: float = 0.0) -> Body:
        """Closed mesh from an OBJ file; `scale` makes its coordinates metres."""
        return cls._make(lib.toile_body_obj, os.fsencode(path), scale, cell_size)

    def distance(self, point: Array) -> tuple[float, np.ndarray]:
        """Signed distance [m] and its gradient, shape (3,), at a point of the body's frame."""
        value, gradient = ctypes.c_double(), (ctypes.c_double * 3)()
        at = _vector(point, 3, "point")
        _check(lib.toile_body_distance(self.handle, at, ctypes.byref(value), gradient))
        return value.value, np.array(gradient)
