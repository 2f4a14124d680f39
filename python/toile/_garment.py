"""Garments: panels, edges, seams, fabrics."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Optional, Sequence, Union

import numpy as np

from . import _ffi
from ._arrays import Array, PathLike, _dir, _encode, _f64, _pointer, _real, _text, _u32, _vector
from ._errors import _check
from ._ffi import lib
from ._owner import _Owner


@dataclass(frozen=True)
class Edge:
    """An edge of a panel between two of its corners.

    ``curve`` is ``None`` for a straight edge, one control point ``(u, v)`` for a quadratic or two
    for a cubic Bezier curve [m]. ``radius`` [m] makes it a circular arc instead.
    """

    start: int
    end: int
    curve: Optional[Sequence[Any]] = None
    radius: Optional[float] = None
    large: bool = False
    right: bool = False

    def _kind(self) -> tuple[int, list[float]]:
        if self.radius is not None:
            if self.curve is not None:
                raise ValueError("an edge has a curve or a radius, not both")
            return 3, [float(self.radius), float(self.large), float(self.right), 0.0]
        if self.curve is None:
            return 0, [0.0] * 4
        controls = np.asarray(self.curve, dtype=np.float64).reshape(-1)
        if controls.size == 2:
            return 1, [*map(float, controls), 0.0, 0.0]
        if controls.size == 4:
            return 2, [*map(float, controls)]
        raise ValueError(f"curve: {controls.size} numbers, expected 2 or 4")


class Garment(_Owner):
    """Panels, seams and fabrics: what a host edits."""

    _free = lib.toile_garment_free

    def __init__(self, name: str = "", edge_length: float = 0.015) -> None:
        """An empty garment; `edge_length` is the target edge length of its triangles [m]."""
        super().__init__()
        desc = _ffi.new("toile_garment_desc")
        desc.name = _encode(name)
        desc.edge_length = edge_length
        self._take(lib.toile_garment_create, ctypes.byref(desc))

    @classmethod
    def from_json(cls, text: str, base_dir: Optional[PathLike] = None) -> Garment:
        """A garment object of toile or a GarmentCode specification; fabric files named in it are
        looked up in `base_dir`."""
        data = _encode(text)
        return cls._of(lib.toile_garment_from_json, data, len(data), _dir(base_dir))

    @classmethod
    def _of(cls, function: Any, *arguments: Any) -> Garment:
        """The garment that a function of the library makes."""
        garment = cls.__new__(cls)
        _Owner.__init__(garment)
        garment._take(function, *arguments)
        return garment

    @classmethod
    def from_file(cls, path: PathLike) -> Garment:
        """The same from a file; files named in it are looked up beside it."""
        path = Path(path)
        return cls.from_json(path.read_text(encoding="utf-8"), path.parent)

    def __enter__(self) -> Garment:
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def add_panel(
        self,
        name: str,
        vertices: Array,
        edges: Optional[Sequence[Union[Edge, tuple[int, int]]]] = None,
        holes: Sequence[Sequence[Union[Edge, tuple[int, int]]]] = (),
        position: Array = (0, 0, 0),
        quaternion_xyzw: Array = (0, 0, 0, 1),
        grain: float = 0.0,
        edge_length: float = 0.0,
        fabric: int = 0,
    ) -> int:
        """Adds a flat piece and returns its number.

        `vertices`: corners [m], shape (n, 2). `edges`: closed outline, counter-clockwise seen from
        the outside of the cloth; without it, straight edges join the corners in order. `position`
        [m] and `quaternion_xyzw` place the panel in the world, `grain` [rad] is the warp's
        direction from +v, `edge_length` [m] overrides the garment's if not 0.
        """
        corners = _f64(vertices, 2, "vertices")
        if holes and edges is None:
            n = len(corners) - len({i for h in holes for e in h for i in _ends(e)})
            edges = [(i, (i + 1) % n) for i in range(n)]
        desc = _ffi.new("toile_panel_desc")
        label = _encode(name)
        desc.name = label
        desc.vertices, desc.vertex_count = _pointer(corners), len(corners)
        loops = [list(edges)] if edges is not None else []
        loops += [list(h) for h in holes]
        flat = [e if isinstance(e, Edge) else Edge(*e) for loop in loops for e in loop]
        ends = _u32(np.array([[e.start, e.end] for e in flat]).reshape(-1, 2), "edges")
        kinds = np.array([e._kind()[0] for e in flat], np.uint32)
        controls = np.array([e._kind()[1] for e in flat], np.float64).reshape(-1, 4)
        sizes = np.array([len(h) for h in holes], np.uint32)
        if flat:
            desc.edges, desc.edge_count = _pointer(ends), len(flat)
            desc.edge_kinds, desc.edge_controls = _pointer(kinds), _pointer(controls)
        if len(sizes):
            desc.hole_sizes, desc.hole_count = _pointer(sizes), len(sizes)
        desc.position = _vector(position, 3, "position")
        desc.quaternion_xyzw = _vector(quaternion_xyzw, 4, "quaternion_xyzw")
        desc.grain, desc.edge_length, desc.fabric = grain, edge_length, fabric
        out = ctypes.c_uint32()
        _check(lib.toile_garment_add_panel(self.handle, ctypes.byref(desc), ctypes.byref(out)))
        return out.value

    def add_seam(
        self,
        a: tuple[int, int],
        b: tuple[int, int],
        same_direction: bool = False,
        rest_angle: float = 0.0,
    ) -> int:
        """Sews edge `a` to edge `b`, each (panel, edge); returns the seam's number. Usually the
        start of `a` meets the end of `b`. `rest_angle` across the seam [rad]."""
        desc = _ffi.new("toile_seam_desc")
        desc.panel_a, desc.edge_a = a
        desc.panel_b, desc.edge_b = b
        desc.same_direction, desc.rest_angle = int(same_direction), rest_angle
        out = ctypes.c_uint32()
        _check(lib.toile_garment_add_seam(self.handle, ctypes.byref(desc), ctypes.byref(out)))
        return out.value

    def set_fabric(self, json: str) -> None:
        """Makes every panel of one fabric: toile's own JSON or an ARCSim material."""
        data = _encode(json)
        _check(lib.toile_garment_set_fabric(self.handle, data, len(data)))

    def add_fabric(self, json: str) -> int:
        """Adds a fabric for single panels (see :meth:`set_panel_fabric`) and returns its number."""
        data = _encode(json)
        out = ctypes.c_uint32()
        _check(lib.toile_garment_add_fabric(self.handle, data, len(data), ctypes.byref(out)))
        return out.value

    def set_panel_fabric(self, panel: int, fabric: int) -> None:
        """Makes one panel of the fabric with this number."""
        _check(lib.toile_garment_set_panel_fabric(self.handle, panel, fabric))

    def set_blend_region(self, panel: int, polygon: Array, rings: int = 0) -> None:
        """Asks for every yarn inside a polygon of a panel, flat coordinates [m], shape (n, 2), with
        `rings` hybrid rings around it. Takes the place of the panel's earlier region; no corners take
        it away."""
        uv = _f64(polygon, 2, "polygon")
        _check(
            lib.toile_garment_set_blend_region(self.handle, panel, _pointer(uv), len(uv), rings)
        )

    def set_blend_vertices(self, alpha: Array, rings: int = 0) -> None:
        """Asks for every yarn in the triangles whose corners all have an `alpha` of 1, one number for each
        vertex of the garment's simulation, shape (vertices,), with `rings` hybrid rings around them, as
        :meth:`Sim.suggest_region` gives them. Takes the place of all earlier regions."""
        values = _real(alpha, "alpha")
        if values.ndim != 1:
            raise ValueError(f"alpha: shape {values.shape}, expected (vertices,)")
        _check(
            lib.toile_garment_set_blend_vertices(
                self.handle, _pointer(values), len(values), rings
            )
        )

    def clear_blend_regions(self) -> None:
        """Takes every blend region away."""
        _check(lib.toile_garment_clear_blend_region(self.handle))

    def check(self) -> None:
        """Raises :class:`DataError` naming panel, edge or seam if the garment cannot be."""
        _check(lib.toile_garment_check(self.handle))

    @property
    def panel_names(self) -> list[str]:
        """Names of the panels, by number."""
        count = ctypes.c_uint32()
        _check(lib.toile_garment_panel_count(self.handle, ctypes.byref(count)))
        return [_text(lib.toile_garment_panel_name, self.handle, i) for i in range(count.value)]

    def panel_index(self, name: str) -> int:
        """Number of the panel of this name."""
        out = ctypes.c_uint32()
        _check(lib.toile_garment_panel_index(self.handle, _encode(name), ctypes.byref(out)))
        return out.value

    @property
    def seam_count(self) -> int:
        """Number of seams."""
        out = ctypes.c_uint32()
        _check(lib.toile_garment_seam_count(self.handle, ctypes.byref(out)))
        return out.value

    @property
    def warnings(self) -> list[str]:
        """What the garment's and its fabrics' files contained that is not used."""
        return _text(lib.toile_garment_warnings, self.handle).splitlines()

    def to_json(self) -> str:
        """toile's own JSON of the garment."""
        return _text(lib.toile_garment_to_json, self.handle)

    def to_svg(self, seam_allowance: float = 0.01) -> str:
        """The flat pattern as SVG, with a seam allowance [m]."""
        return _text(lib.toile_garment_to_svg, self.handle, seam_allowance)


def _ends(edge: Union[Edge, tuple[int, int]]) -> tuple[int, int]:
    return (edge.start, edge.end) if isinstance(edge, Edge) else (edge[0], edge[1])
