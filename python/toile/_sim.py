"""Simulations: a garment in a world, stepped, draped, read."""

from __future__ import annotations

import ctypes
from pathlib import Path
from typing import Any, Callable, Optional, Sequence

import numpy as np

from . import _ffi
from ._arrays import (
    Array,
    PathLike,
    _copy,
    _dir,
    _encode,
    _f64,
    _pointer,
    _real,
    _text,
    _u32,
    _vector,
)
from ._body import Body
from ._errors import _check
from ._ffi import lib
from ._garment import Garment
from ._interrupt import _Interrupts
from ._kept import _kept
from ._owner import _Owner
from ._report import CRITERIA, Energies, Report, Suggestion, SystemInfo, YarnChanges, _fields, _report

#: ``progress(fraction, stage, residual)``; returning ``False`` stops the drape.
ProgressCallback = Callable[[float, str, float], Optional[bool]]


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
        """Where a body is at the end of the next step [m]; placed at once before the first step or
        drape."""
        p = _vector(position, 3, "position")
        q = _vector(quaternion_xyzw, 4, "quaternion_xyzw")
        _check(lib.toile_sim_set_body_pose(self.handle, body, p, q))

    def set_body_vertices(self, body: int, positions: Array) -> None:
        """Vertices of a deforming mesh at the end of the next step, body frame [m], (n, 3)."""
        x = _f64(positions, 3, "positions")
        _check(lib.toile_sim_set_body_vertices(self.handle, body, _pointer(x), len(x)))

    @property
    def body_count(self) -> int:
        """Number of bodies."""
        out = ctypes.c_uint32()
        _check(lib.toile_sim_body_count(self.handle, ctypes.byref(out)))
        return out.value

    @property
    def garment(self) -> Garment:
        """A copy of the garment that the simulation was made of."""
        return Garment._of(lib.toile_sim_garment, self.handle)

    def set_gravity(self, gravity: Array) -> None:
        """Acceleration of gravity [m/s^2], shape (3,)."""
        _check(lib.toile_sim_set_gravity(self.handle, _vector(gravity, 3, "gravity")))

    def set_wind(self, wind: Array) -> None:
        """Velocity of the air [m/s], shape (3,)."""
        _check(lib.toile_sim_set_wind(self.handle, _vector(wind, 3, "wind")))

    def set_blend_region(self, panel: int, polygon: Array, rings: int = 0) -> None:
        """Moves the region of a panel in which every yarn is simulated, as
        :meth:`Garment.set_blend_region` says it, with the state carried over: yarns come into the triangles as
        these are. The yarns' arrays change."""
        uv = _f64(polygon, 2, "polygon")
        _check(lib.toile_sim_set_blend_region(self.handle, panel, _pointer(uv), len(uv), rings))

    def set_blend_vertices(self, alpha: Array, rings: int = 0) -> None:
        """Moves all regions at once, as :meth:`Garment.set_blend_vertices` says them, with the state carried
        over; takes what :meth:`suggest_region` gives."""
        values = _real(alpha, "alpha")
        if values.ndim != 1:
            raise ValueError(f"alpha: shape {values.shape}, expected (vertices,)")
        _check(
            lib.toile_sim_set_blend_vertices(self.handle, _pointer(values), len(values), rings)
        )

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

    def pin_yarn_nodes(self, nodes: Array, targets: Optional[Array] = None) -> None:
        """Holds nodes of yarns as :meth:`pin` holds vertices; yarns do not slide where they are held."""
        n = _u32(nodes, "nodes").reshape(-1)
        x = None if targets is None else _f64(targets, 3, "targets")
        if x is not None and len(x) != len(n):
            raise ValueError(f"{len(x)} targets for {len(n)} nodes")
        pointer = None if x is None else _pointer(x)
        _check(lib.toile_sim_pin_yarn_nodes(self.handle, _pointer(n), len(n), pointer))

    def unpin_yarn_nodes(self, nodes: Array) -> None:
        """Lets nodes of yarns go."""
        n = _u32(nodes, "nodes").reshape(-1)
        _check(lib.toile_sim_unpin_yarn_nodes(self.handle, _pointer(n), len(n)))

    def locate_yarn_node(self, panel: int, uv: Array) -> int:
        """Node of a panel's yarns that was laid nearest to a flat point [m]."""
        out = ctypes.c_uint32()
        place = _vector(uv, 2, "uv")
        _check(lib.toile_sim_locate_yarn_node(self.handle, panel, place, ctypes.byref(out)))
        return out.value

    def yarn_end(self, yarn: int, end: int) -> int:
        """Node at the first (0) or the last (1) end of a yarn."""
        out = ctypes.c_uint32()
        _check(lib.toile_sim_yarn_end(self.handle, yarn, end, ctypes.byref(out)))
        return out.value

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
        """Sews and drapes to rest; 0 takes the library's setting. An exception in `progress`, or
        Ctrl-C, stops the drape where it is and comes out of this call."""
        desc = _ffi.new("toile_drape_desc")
        desc.force_tolerance, desc.max_steps = force_tolerance, max_steps
        raised: list[BaseException] = []
        interrupts = _Interrupts()

        def call(_user: Any, pointer: int) -> int:
            try:
                if interrupts.asked:
                    return 1
                if progress is None:
                    return 0
                state = ctypes.cast(pointer, ctypes.POINTER(_ffi.types["toile_progress"])).contents
                stage = (state.stage or b"").decode()
                return 1 if progress(state.fraction, stage, state.residual) is False else 0
            except BaseException as e:
                raised.append(e)
                return 1

        callback = _ffi.progress_fn(call)
        desc.progress = callback
        report = _ffi.new("toile_step_report")
        with interrupts:
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

    @property
    def positions(self) -> np.ndarray:
        """Positions [m] as they are now, shape (vertices, 3), read-only, in the library's own memory.

        Later calls neither change nor invalidate the array, nor does closing the simulation: the
        library makes a copy for itself if it has to change them while the array is still there.
        """
        return _kept(lib.toile_sim_positions_array, self.handle)

    @property
    def velocities(self) -> np.ndarray:
        """Velocities [m/s], shape (vertices, 3), like `positions`."""
        return _kept(lib.toile_sim_velocities_array, self.handle)

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
    def yarn_nodes(self) -> np.ndarray:
        """Positions of the yarns' nodes [m], shape (nodes, 3); empty without yarns."""
        return _copy(lib.toile_sim_yarn_nodes, np.float64, self.handle).reshape(-1, 3)

    @property
    def yarn_offsets(self) -> np.ndarray:
        """Where each yarn begins in :attr:`yarn_indices`, shape (yarns + 1,)."""
        return _copy(lib.toile_sim_yarn_offsets, np.uint32, self.handle)

    @property
    def yarn_indices(self) -> np.ndarray:
        """Nodes of the yarns, yarn after yarn, shape (passages,)."""
        return _copy(lib.toile_sim_yarn_indices, np.uint32, self.handle)

    @property
    def yarn_coordinates(self) -> np.ndarray:
        """Arc length at rest of each yarn at its nodes [m], shape (passages,)."""
        return _copy(lib.toile_sim_yarn_coordinates, np.float64, self.handle)

    @property
    def yarn_tensions(self) -> np.ndarray:
        """Tension from each passage to the next of its yarn [N], 0 at the last, shape (passages,)."""
        return _copy(lib.toile_sim_yarn_tensions, np.float64, self.handle)

    @property
    def yarn_compressions(self) -> np.ndarray:
        """Largest normal force between two yarns at each node [N], shape (nodes,)."""
        return _copy(lib.toile_sim_yarn_compressions, np.float64, self.handle)

    @property
    def yarn_slips(self) -> np.ndarray:
        """How far each yarn has slid since it was laid [m], shape (passages,)."""
        return _copy(lib.toile_sim_yarn_slips, np.float64, self.handle)

    @property
    def yarn_active(self) -> np.ndarray:
        """Whether each node moves by itself, shape (nodes,); triangles carry the others."""
        return _copy(lib.toile_sim_yarn_active, np.uint8, self.handle).astype(bool)

    @property
    def yarn_forces(self) -> np.ndarray:
        """Force on each node [N], shape (nodes, 3): on a held one what its holder bears."""
        return _copy(lib.toile_sim_yarn_forces, np.float64, self.handle).reshape(-1, 3)

    @property
    def yarn_radii(self) -> np.ndarray:
        """Radius of each yarn [m], shape (yarns,)."""
        return _copy(lib.toile_sim_yarn_radii, np.float64, self.handle)

    @property
    def yarn_fabrics(self) -> np.ndarray:
        """Fabric of each yarn, counted as in the garment, shape (yarns,)."""
        return _copy(lib.toile_sim_yarn_fabrics, np.uint32, self.handle)

    @property
    def yarn_panels(self) -> np.ndarray:
        """Panel in which each yarn was laid, shape (yarns,)."""
        return _copy(lib.toile_sim_yarn_panels, np.uint32, self.handle)

    @property
    def yarn_uv(self) -> np.ndarray:
        """Where each node was laid in its panel [m], shape (nodes, 2)."""
        return _copy(lib.toile_sim_yarn_uv, np.float64, self.handle).reshape(-1, 2)

    def yarn_curves(self, samples: int = 4) -> list[np.ndarray]:
        """Yarns as they are drawn: for each the points of its smooth centre line [m], shape (points, 3), `samples` pieces
        between two nodes; a tube of :attr:`yarn_radii` around it is the yarn."""
        starts = _copy(lib.toile_sim_yarn_curve_offsets, np.uint32, self.handle, samples)
        points = _copy(lib.toile_sim_yarn_curves, np.float64, self.handle, samples)
        return np.split(points.reshape(-1, 3), starts[1:-1]) if len(starts) > 1 else []

    def yarn_nodes_along(self, panel: int, edge: int) -> np.ndarray:
        """Nodes of the border of a panel's yarns along one of its edges, as a pin with `edge` in a scene holds them."""
        return _copy(lib.toile_sim_yarn_nodes_along, np.uint32, self.handle, panel, edge)

    def suggest_region(
        self,
        tolerance: float = 0.0,
        budget: int = 0,
        rings: int = 0,
        left_out: Sequence[str] = (),
    ) -> tuple[np.ndarray, Suggestion]:
        """Where yarns would change the answer, from the present state of triangles alone: `alpha` of each
        vertex, shape (vertices,), for :meth:`set_blend_vertices`, here or of a garment, and what it leaves and costs. At least
        one of `tolerance`, the error around a vertex above which triangles give way, and `budget`, the most nodes
        of yarns. `left_out` are those of :data:`CRITERIA` that do not count in the error."""
        if not 0 <= budget < 2**64:
            raise ValueError(f"budget: {budget} must be from 0 to 2^64 - 1")
        desc = _ffi.new("toile_suggest_desc")
        unknown = set(left_out) - set(CRITERIA)
        if unknown:
            raise ValueError(f"left_out: {sorted(unknown)} are none of {CRITERIA}")
        desc.tolerance, desc.budget, desc.rings = tolerance, budget, rings
        desc.left_out = sum(1 << CRITERIA.index(name) for name in set(left_out))
        out = _ffi.new("toile_suggestion")
        alpha = np.empty(len(self.vertex_panels))
        _check(
            lib.toile_sim_suggest_region(
                self.handle,
                ctypes.byref(desc),
                _pointer(alpha),
                len(alpha),
                None,
                ctypes.byref(out),
            )
        )
        return alpha, Suggestion(**_fields(out))

    @property
    def vertex_errors(self) -> np.ndarray:
        """Estimated error of the deformation's gradient of triangles at each vertex, shape (vertices,); 0 where
        the fabric has no yarns."""
        return _copy(lib.toile_sim_vertex_errors, np.float64, self.handle)

    @property
    def vertex_criteria(self) -> np.ndarray:
        """What :attr:`vertex_errors` is made of, shape (vertices, 6): the estimate by each of :data:`CRITERIA`; the
        error is the root of the sum of their squares."""
        values = _copy(lib.toile_sim_vertex_criteria, np.float64, self.handle)
        return values.reshape(-1, len(CRITERIA))

    @property
    def yarn_changes(self) -> YarnChanges:
        """Contacts that yarns came out of since they were laid; the sizes of the yarns' arrays
        change with its epoch."""
        value = _ffi.new("toile_yarn_changes")
        _check(lib.toile_sim_yarn_changes(self.handle, ctypes.byref(value)))
        return YarnChanges(**_fields(value))

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
