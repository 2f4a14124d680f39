"""Garments on bodies: sewing patterns in, draped and moving garments out.

SI units throughout; points are rows of three. A call that the library refuses raises
:class:`ToileError` (or a subclass) with the library's own text, and leaves the object as it was.
"""

from __future__ import annotations

import ctypes
import enum
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, Optional, Sequence, Union

import numpy as np

from . import _ffi
from ._ffi import lib

__all__ = [
    "Body",
    "DataError",
    "Edge",
    "Energies",
    "Garment",
    "NumericsError",
    "Outcome",
    "Report",
    "Sim",
    "SystemInfo",
    "ToileError",
    "UsageError",
    "version",
]

PathLike = Union[str, "os.PathLike[str]"]
Array = Any
#: ``progress(fraction, stage, residual)``; returning ``False`` stops the drape.
ProgressCallback = Callable[[float, str, float], Optional[bool]]


class ToileError(Exception):
    """The library refused a call; ``status`` is its fixed code, ``name`` the code's name."""

    def __init__(self, status: int, text: str) -> None:
        super().__init__(text)
        self.status = status
        self.name: str = lib.toile_status_name(status).decode()


class UsageError(ToileError):
    """Wrong use: an argument, a handle, a state (-1 to -19)."""


class DataError(ToileError):
    """A file, pattern, mesh or fabric that cannot be (-20 to -39)."""


class NumericsError(ToileError):
    """No admissible state was found (-40 to -59)."""


def _check(status: int) -> None:
    if status == 0:
        return
    text = lib.toile_last_error().decode("utf-8", "replace")
    kind = ToileError
    for limit, candidate in ((-19, UsageError), (-39, DataError), (-59, NumericsError)):
        if status >= limit:
            kind = candidate
            break
    raise kind(status, text)


def version() -> int:
    """Version of the library that was loaded, as one number."""
    return int(lib.toile_version())


def _f64(array: Array, columns: int, what: str) -> np.ndarray:
    """A contiguous copy or view with `columns` columns."""
    a = np.ascontiguousarray(array, dtype=np.float64)
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
    a = np.asarray(values, dtype=np.float64).reshape(-1)
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


class Outcome(enum.IntEnum):
    """Why a step or a drape ended."""

    CONVERGED = 0
    SUBSTEPPED = 1
    ITERATION_LIMIT = 2
    CANCELLED = 3


@dataclass(frozen=True)
class Report:
    """Numbers of a step or a drape."""

    outcome: Outcome
    newton_iterations: int
    linear_iterations: int
    substeps: int
    #: Time advanced [s].
    advanced: float
    #: Largest force on a free vertex [N].
    residual: float
    max_edge_strain: float
    #: Smallest distance of a vertex to a body [m]; infinite without bodies.
    min_gap: float
    #: [J]
    kinetic_energy: float
    #: [J]
    potential_energy: float
    #: Largest distance across a seam [m].
    max_seam_gap: float


@dataclass(frozen=True)
class Energies:
    """Energies of the present state [J]."""

    kinetic: float
    gravity: float
    membrane: float
    bending: float
    seam: float
    contact: float
    yarn: float


@dataclass(frozen=True)
class SystemInfo:
    """What was built and what it costs."""

    vertices: int
    triangles: int
    yarn_nodes: int
    unknowns: int
    #: Mesh, terms and matrix.
    bytes: int
    #: Factor and work arrays.
    factor_bytes: int
    #: Smallest triangle angle [rad].
    min_angle: float


def _fields(value: Any) -> dict[str, Any]:
    skip = ("struct_size", "reserved")
    return {name: getattr(value, name) for name, _ in value._fields_ if name not in skip}


def _report(value: Any) -> Report:
    fields = _fields(value)
    fields["outcome"] = Outcome(fields["outcome"])
    return Report(**fields)


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

    def close(self) -> None:
        """Frees the object in the library; closing twice does nothing."""
        if self._handle is not None:
            handle, self._handle = self._handle, None
            type(self)._free(ctypes.c_void_p(handle))

    def __del__(self) -> None:
        # at interpreter exit parts of this module may be gone
        if getattr(self, "_handle", None) is not None and type(self)._free is not None:
            self.close()


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

    def __init__(self, name: str = "", edge_length: float = 0.02) -> None:
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
        garment = cls.__new__(cls)
        _Owner.__init__(garment)
        data = _encode(text)
        garment._take(lib.toile_garment_from_json, data, len(data), _dir(base_dir))
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

    def check(self) -> None:
        """Raises :class:`DataError` naming panel, edge or seam if the garment cannot be."""
        _check(lib.toile_garment_check(self.handle))

    @property
    def panel_names(self) -> list[str]:
        """Names of the panels, by number."""
        count = ctypes.c_uint32()
        _check(lib.toile_garment_panel_count(self.handle, ctypes.byref(count)))
        return [_text(lib.toile_garment_panel_name, self.handle, i) for i in range(count.value)]

    def to_json(self) -> str:
        """toile's own JSON of the garment."""
        return _text(lib.toile_garment_to_json, self.handle)

    def to_svg(self, seam_allowance: float = 0.01) -> str:
        """The flat pattern as SVG, with a seam allowance [m]."""
        return _text(lib.toile_garment_to_svg, self.handle, seam_allowance)


def _ends(edge: Union[Edge, tuple[int, int]]) -> tuple[int, int]:
    return (edge.start, edge.end) if isinstance(edge, Edge) else (edge[0], edge[1])


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
        data = np.ascontiguousarray(values, dtype=np.float64)
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


class Sim(_Owner):
    """A garment in a world."""

    _free = lib.toile_sim_free

    def __init__(
        self,
        garment: Garment,
        gravity: Array = (0, -9.81, 0),
        wind: Array = (0, 0, 0),
        pressure: float = 0.0,
        threads: int = 1,
    ) -> None:
        """Triangulates and compiles the garment. `gravity` [m/s^2], `wind` [m/s], `pressure` along
        the cloth's normal [Pa]; results do not depend on `threads`."""
        super().__init__()
        desc = _ffi.new("toile_sim_desc")
        desc.gravity = _vector(gravity, 3, "gravity")
        desc.wind = _vector(wind, 3, "wind")
        desc.pressure, desc.threads = pressure, threads
        self._take(lib.toile_sim_create, garment.handle, ctypes.byref(desc))

    @classmethod
    def from_scene(cls, text: str, base_dir: Optional[PathLike] = None) -> Sim:
        """The simulation of a scene (JSON), before anything is run."""
        sim = cls.__new__(cls)
        _Owner.__init__(sim)
        data = _encode(text)
        sim._take(lib.toile_sim_from_scene, data, len(data), _dir(base_dir))
        return sim

    @classmethod
    def from_file(cls, path: PathLike) -> Sim:
        """The same from a scene file."""
        path = Path(path)
        return cls.from_scene(path.read_text(encoding="utf-8"), path.parent)

    def __enter__(self) -> Sim:
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def add_body(
        self,
        body: Body,
        friction: Optional[float] = None,
        thickness: Optional[float] = None,
        stiffness: Optional[float] = None,
    ) -> int:
        """Puts a body into the world and returns its number. Coulomb `friction`, free gap
        `thickness` [m], penalty `stiffness` [Pa/m]; ``None`` takes the default."""
        desc = _ffi.new("toile_contact_desc")
        given = {"friction": friction, "thickness": thickness, "stiffness": stiffness}
        for name, value in given.items():
            if value is not None:
                setattr(desc, name, value)
        out = ctypes.c_uint32()
        _check(
            lib.toile_sim_set_body_sdf(
                self.handle, body.handle, ctypes.byref(desc), ctypes.byref(out)
            )
        )
        return out.value

    def set_body_pose(
        self, body: int, position: Array, quaternion_xyzw: Array = (0, 0, 0, 1)
    ) -> None:
        """Where a body is at the end of the next step [m]."""
        p = _vector(position, 3, "position")
        q = _vector(quaternion_xyzw, 4, "quaternion_xyzw")
        _check(lib.toile_sim_set_body_pose(self.handle, body, p, q))

    def set_body_vertices(self, body: int, positions: Array) -> None:
        """Vertices of a deforming mesh at the end of the next step, body frame [m], (n, 3)."""
        x = _f64(positions, 3, "positions")
        _check(lib.toile_sim_set_body_vertices(self.handle, body, _pointer(x), len(x)))

    def body_wrench(self, body: int) -> tuple[np.ndarray, np.ndarray]:
        """Force [N] and torque about the body's origin [N m] of the cloth, world axes."""
        force, torque = (ctypes.c_double * 3)(), (ctypes.c_double * 3)()
        _check(lib.toile_sim_body_wrench(self.handle, body, force, torque))
        return np.array(force), np.array(torque)

    def body_mesh(self, body: int) -> tuple[np.ndarray, np.ndarray]:
        """Mesh to draw a body: positions [m], shape (n, 3), triangles, shape (m, 3)."""
        x = _copy(lib.toile_sim_body_positions, np.float64, self.handle, body)
        t = _copy(lib.toile_sim_body_triangles, np.uint32, self.handle, body)
        return x.reshape(-1, 3), t.reshape(-1, 3)

    def pin(self, vertices: Array, targets: Optional[Array] = None) -> None:
        """Holds vertices; `targets` [m], shape (n, 3), are reached at the end of the next step,
        without them vertices are held where they are."""
        v = _u32(vertices, "vertices").reshape(-1)
        x = None if targets is None else _f64(targets, 3, "targets")
        if x is not None and len(x) != len(v):
            raise ValueError(f"{len(x)} targets for {len(v)} vertices")
        pointer = None if x is None else _pointer(x)
        _check(lib.toile_sim_pin(self.handle, _pointer(v), len(v), pointer))

    def unpin(self, vertices: Array) -> None:
        """Lets vertices go."""
        v = _u32(vertices, "vertices").reshape(-1)
        _check(lib.toile_sim_unpin(self.handle, _pointer(v), len(v)))

    def locate(self, panel: int, uv: Array) -> int:
        """Vertex of a panel nearest to a flat point [m]."""
        out = ctypes.c_uint32()
        _check(lib.toile_sim_locate(self.handle, panel, _vector(uv, 2, "uv"), ctypes.byref(out)))
        return out.value

    def step(self, dt: float) -> Report:
        """Advances by exactly `dt` [s]."""
        report = _ffi.new("toile_step_report")
        _check(lib.toile_sim_step(self.handle, dt, ctypes.byref(report)))
        return _report(report)

    def drape(
        self,
        force_tolerance: float = 0.0,
        max_steps: int = 0,
        progress: Optional[ProgressCallback] = None,
    ) -> Report:
        """Sews and drapes to rest; 0 takes the library's setting. An exception in `progress`
        stops the drape and comes out of this call."""
        desc = _ffi.new("toile_drape_desc")
        desc.force_tolerance, desc.max_steps = force_tolerance, max_steps
        raised: list[BaseException] = []

        def call(_user: Any, pointer: int) -> int:
            state = ctypes.cast(pointer, ctypes.POINTER(_ffi.types["toile_progress"])).contents
            try:
                stage = (state.stage or b"").decode()
                go_on = progress is None or progress(state.fraction, stage, state.residual)
                return 1 if go_on is False else 0
            except BaseException as e:
                raised.append(e)
                return 1

        callback = _ffi.progress_fn(call)
        if progress is not None:
            desc.progress = callback
        report = _ffi.new("toile_step_report")
        status = lib.toile_sim_drape(self.handle, ctypes.byref(desc), ctypes.byref(report))
        if raised:
            raise raised[0]
        _check(status)
        return _report(report)

    def report(self) -> Report:
        """Numbers of the present state without advancing it."""
        report = _ffi.new("toile_step_report")
        _check(lib.toile_sim_report(self.handle, ctypes.byref(report)))
        return _report(report)

    def _view(self, function: Any) -> np.ndarray:
        view = _ffi.new("toile_view_f64")
        _check(function(self.handle, ctypes.byref(view)))
        if view.count == 0:
            return np.zeros((0, 3))
        address = ctypes.cast(view.data, ctypes.c_void_p).value
        length = (view.count - 1) * view.stride + view.components * 8
        memory = (ctypes.c_uint8 * length).from_address(address)
        # the buffer refers to this object: the library's memory lives while a view does
        memory._owner = self
        out = np.ndarray(
            (view.count, view.components), np.float64, memory, strides=(view.stride, 8)
        )
        out.flags.writeable = False
        return out

    @property
    def positions(self) -> np.ndarray:
        """Positions [m], shape (vertices, 3): a read-only view without a copy, valid until the
        next call that changes this simulation. Copy it to keep it."""
        return self._view(lib.toile_sim_positions_view)

    @property
    def velocities(self) -> np.ndarray:
        """Velocities [m/s], shape (vertices, 3); a view like `positions`."""
        return self._view(lib.toile_sim_velocities_view)

    def set_positions(self, positions: Array, velocities: Optional[Array] = None) -> None:
        """Sets every position [m] and velocity [m/s], shape (vertices, 3); ``None`` is zero."""
        x = _f64(positions, 3, "positions")
        v = None if velocities is None else _f64(velocities, 3, "velocities")
        if v is not None and len(v) != len(x):
            raise ValueError(f"{len(v)} velocities for {len(x)} positions")
        pointer = None if v is None else _pointer(v)
        _check(lib.toile_sim_set_positions(self.handle, _pointer(x), pointer, len(x)))

    @property
    def normals(self) -> np.ndarray:
        """Unit vertex normals, shape (vertices, 3)."""
        return _copy(lib.toile_sim_normals, np.float64, self.handle).reshape(-1, 3)

    @property
    def triangles(self) -> np.ndarray:
        """Vertex triples, shape (triangles, 3)."""
        return _copy(lib.toile_sim_triangles, np.uint32, self.handle).reshape(-1, 3)

    @property
    def vertex_panels(self) -> np.ndarray:
        """Panel of each vertex, shape (vertices,)."""
        return _copy(lib.toile_sim_vertex_panels, np.uint32, self.handle)

    @property
    def vertex_uv(self) -> np.ndarray:
        """Flat coordinates [m], shape (vertices, 2)."""
        return _copy(lib.toile_sim_vertex_uv, np.float64, self.handle).reshape(-1, 2)

    @property
    def vertex_active(self) -> np.ndarray:
        """0 where a vertex follows the yarns above it, shape (vertices,)."""
        return _copy(lib.toile_sim_vertex_active, np.uint8, self.handle)

    @property
    def epoch(self) -> int:
        """Changes with every call that may invalidate a view."""
        return int(lib.toile_sim_epoch(self.handle))

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return float(lib.toile_sim_time(self.handle))

    @property
    def energies(self) -> Energies:
        """Energies of the present state [J]."""
        value = _ffi.new("toile_energies")
        _check(lib.toile_sim_energies(self.handle, ctypes.byref(value)))
        return Energies(**_fields(value))

    @property
    def info(self) -> SystemInfo:
        """Counts and bytes of what was built."""
        value = _ffi.new("toile_system_info")
        _check(lib.toile_sim_info(self.handle, ctypes.byref(value)))
        return SystemInfo(**_fields(value))

    @property
    def backend(self) -> str:
        """Name of the linear solver."""
        return _text(lib.toile_sim_backend, self.handle)

    def __getitem__(self, name: str) -> float:
        """A number by dotted name, such as ``solver.newton.max_iterations``."""
        out = ctypes.c_double()
        _check(lib.toile_sim_number(self.handle, _encode(name), ctypes.byref(out)))
        return out.value

    def __setitem__(self, name: str, value: float) -> None:
        _check(lib.toile_sim_set_number(self.handle, _encode(name), value))

    def save(self) -> bytes:
        """The state; restoring it continues bitwise."""
        return _copy(lib.toile_sim_save, np.uint8, self.handle).tobytes()

    def restore(self, data: bytes) -> None:
        """Restores a saved state of the same garment and bodies."""
        buffer = (ctypes.c_uint8 * len(data)).from_buffer_copy(data)
        _check(lib.toile_sim_restore(self.handle, buffer, len(data)))
