"""The C interface as ctypes: structs, functions, and where the library is.

``STRUCTS`` and ``FUNCTIONS`` are the only places that know layouts and signatures; a test compares
both with ``include/toile.h``.
"""

from __future__ import annotations

import ctypes
import operator
import os
import sys
from ctypes import POINTER, c_char, c_char_p, c_double, c_int32, c_size_t, c_uint8, c_uint32
from ctypes import c_uint64, c_void_p
from pathlib import Path
from typing import Any

handle = c_void_p

log_fn = ctypes.CFUNCTYPE(None, c_void_p, c_uint32, c_char_p)
# the progress struct may grow: it is read through a pointer
progress_fn = ctypes.CFUNCTYPE(c_int32, c_void_p, c_void_p)

#: Fields of every struct after ``struct_size``, in the order of the header.
STRUCTS: dict[str, list[tuple[str, Any]]] = {
    "toile_garment_desc": [("name", c_char_p), ("edge_length", c_double)],
    "toile_panel_desc": [
        ("name", c_char_p),
        ("vertices", POINTER(c_double)),
        ("vertex_count", c_size_t),
        ("edges", POINTER(c_uint32)),
        ("edge_count", c_size_t),
        ("edge_kinds", POINTER(c_uint32)),
        ("edge_controls", POINTER(c_double)),
        ("hole_sizes", POINTER(c_uint32)),
        ("hole_count", c_size_t),
        ("position", c_double * 3),
        ("quaternion_xyzw", c_double * 4),
        ("grain", c_double),
        ("edge_length", c_double),
        ("fabric", c_uint32),
        ("reserved", c_uint32),
    ],
    "toile_seam_desc": [
        ("panel_a", c_uint32),
        ("edge_a", c_uint32),
        ("panel_b", c_uint32),
        ("edge_b", c_uint32),
        ("same_direction", c_uint32),
        ("reserved", c_uint32),
        ("rest_angle", c_double),
    ],
    "toile_sdf_grid_desc": [
        ("counts", c_uint32 * 3),
        ("reserved", c_uint32),
        ("origin", c_double * 3),
        ("cell_size", c_double),
        ("values", POINTER(c_double)),
        ("value_count", c_size_t),
    ],
    "toile_sim_desc": [
        ("gravity", c_double * 3),
        ("wind", c_double * 3),
        ("pressure", c_double),
        ("threads", c_uint32),
        ("reserved", c_uint32),
        ("max_vertices", c_uint64),
        ("log", log_fn),
        ("log_user", c_void_p),
        ("progress", progress_fn),
        ("progress_user", c_void_p),
    ],
    "toile_contact_desc": [
        ("friction", c_double),
        ("thickness", c_double),
        ("stiffness", c_double),
    ],
    "toile_progress": [
        ("fraction", c_double),
        ("stage", c_char_p),
        ("residual", c_double),
    ],
    "toile_drape_desc": [
        ("force_tolerance", c_double),
        ("max_steps", c_uint64),
        ("progress", progress_fn),
        ("progress_user", c_void_p),
    ],
    "toile_step_report": [
        ("outcome", c_uint32),
        ("reserved", c_uint32),
        ("newton_iterations", c_uint64),
        ("linear_iterations", c_uint64),
        ("substeps", c_uint64),
        ("advanced", c_double),
        ("residual", c_double),
        ("max_edge_strain", c_double),
        ("min_gap", c_double),
        ("kinetic_energy", c_double),
        ("potential_energy", c_double),
        ("max_seam_gap", c_double),
    ],
    "toile_energies": [
        ("kinetic", c_double),
        ("gravity", c_double),
        ("membrane", c_double),
        ("bending", c_double),
        ("seam", c_double),
        ("contact", c_double),
        ("yarn", c_double),
    ],
    "toile_system_info": [
        ("vertices", c_uint64),
        ("triangles", c_uint64),
        ("yarn_nodes", c_uint64),
        ("unknowns", c_uint64),
        ("bytes", c_uint64),
        ("factor_bytes", c_uint64),
        ("min_angle", c_double),
        ("active_triangles", c_uint64),
        ("carried_nodes", c_uint64),
    ],
    "toile_yarn_changes": [
        ("epoch", c_uint64),
        ("passages_gone", c_uint64),
        ("nodes_split", c_uint64),
        ("nodes_left", c_uint64),
    ],
    "toile_suggest_desc": [
        ("tolerance", c_double),
        ("budget", c_uint64),
        ("rings", c_uint32),
        ("left_out", c_uint32),
    ],
    "toile_suggestion": [
        ("tolerance", c_double),
        ("error", c_double),
        ("error_left", c_double),
        ("largest_left", c_double),
        ("full_triangles", c_uint64),
        ("yarn_nodes", c_uint64),
        ("carried_nodes", c_uint64),
        ("active_triangles", c_uint64),
        ("unknowns", c_uint64),
        ("bytes", c_uint64),
        ("time_ratio", c_double),
        ("all_yarn_nodes", c_uint64),
        ("all_time_ratio", c_double),
        ("iteration_ratio", c_double),
    ],
    "toile_view_f64": [
        ("data", POINTER(c_double)),
        ("count", c_uint64),
        ("components", c_uint64),
        ("stride", c_uint64),
        ("epoch", c_uint64),
    ],
}


class _Index(c_uint32):
    """An argument of 32 bits; ctypes alone would take any integer modulo 2^32."""

    @classmethod
    def from_param(cls, value: Any) -> Any:
        return c_uint32(_whole(value))


def _whole(value: Any) -> int:
    number = operator.index(value)
    if not 0 <= number < 2**32:
        raise ValueError(f"{number} must be from 0 to 2^32 - 1")
    return number


class _Struct(ctypes.Structure):
    def __setattr__(self, name: str, value: Any) -> None:
        if dict(type(self)._fields_).get(name) is c_uint32:
            try:
                value = _whole(value)
            except ValueError as e:
                raise ValueError(f"{name}: {e}") from None
        super().__setattr__(name, value)


def _struct(name: str) -> Any:
    fields = [("struct_size", c_size_t), *STRUCTS[name]]
    return type(name, (_Struct,), {"_fields_": fields})


types: dict[str, Any] = {name: _struct(name) for name in STRUCTS}

_f64 = POINTER(c_double)
_u32 = POINTER(c_uint32)
_size = POINTER(c_size_t)
_out = POINTER(handle)


def _p(name: str) -> Any:
    return POINTER(types[name])


_text = [POINTER(c_char), c_size_t, _size]
_copy_f64 = [handle, _f64, c_size_t, _size]
_copy_u32 = [handle, _u32, c_size_t, _size]

#: Result and arguments of every function that this package calls.
FUNCTIONS: dict[str, tuple[Any, list[Any]]] = {
    "toile_version": (c_uint32, []),
    "toile_last_error": (c_char_p, []),
    "toile_status_name": (c_char_p, [c_int32]),
    "toile_garment_desc_init": (c_int32, [_p("toile_garment_desc"), c_size_t]),
    "toile_panel_desc_init": (c_int32, [_p("toile_panel_desc"), c_size_t]),
    "toile_seam_desc_init": (c_int32, [_p("toile_seam_desc"), c_size_t]),
    "toile_sdf_grid_desc_init": (c_int32, [_p("toile_sdf_grid_desc"), c_size_t]),
    "toile_sim_desc_init": (c_int32, [_p("toile_sim_desc"), c_size_t]),
    "toile_contact_desc_init": (c_int32, [_p("toile_contact_desc"), c_size_t]),
    "toile_drape_desc_init": (c_int32, [_p("toile_drape_desc"), c_size_t]),
    "toile_step_report_init": (c_int32, [_p("toile_step_report"), c_size_t]),
    "toile_energies_init": (c_int32, [_p("toile_energies"), c_size_t]),
    "toile_system_info_init": (c_int32, [_p("toile_system_info"), c_size_t]),
    "toile_yarn_changes_init": (c_int32, [_p("toile_yarn_changes"), c_size_t]),
    "toile_suggest_desc_init": (c_int32, [_p("toile_suggest_desc"), c_size_t]),
    "toile_suggestion_init": (c_int32, [_p("toile_suggestion"), c_size_t]),
    "toile_view_f64_init": (c_int32, [_p("toile_view_f64"), c_size_t]),
    "toile_garment_create": (c_int32, [_p("toile_garment_desc"), _out]),
    "toile_garment_from_json": (c_int32, [c_char_p, c_size_t, c_char_p, _out]),
    "toile_garment_add_panel": (c_int32, [handle, _p("toile_panel_desc"), _u32]),
    "toile_garment_add_seam": (c_int32, [handle, _p("toile_seam_desc"), _u32]),
    "toile_garment_set_fabric": (c_int32, [handle, c_char_p, c_size_t]),
    "toile_garment_add_fabric": (c_int32, [handle, c_char_p, c_size_t, _u32]),
    "toile_garment_set_panel_fabric": (c_int32, [handle, c_uint32, c_uint32]),
    "toile_garment_set_blend_region": (c_int32, [handle, c_uint32, _f64, c_size_t, c_uint32]),
    "toile_garment_set_blend_vertices": (c_int32, [handle, _f64, c_size_t, c_uint32]),
    "toile_garment_clear_blend_region": (c_int32, [handle]),
    "toile_garment_check": (c_int32, [handle]),
    "toile_garment_panel_count": (c_int32, [handle, _u32]),
    "toile_garment_seam_count": (c_int32, [handle, _u32]),
    "toile_garment_panel_index": (c_int32, [handle, c_char_p, _u32]),
    "toile_garment_warnings": (c_int32, [handle, *_text]),
    "toile_garment_panel_name": (c_int32, [handle, c_uint32, *_text]),
    "toile_garment_to_json": (c_int32, [handle, *_text]),
    "toile_garment_to_svg": (c_int32, [handle, c_double, *_text]),
    "toile_garment_free": (None, [handle]),
    "toile_body_sphere": (c_int32, [c_double, _out]),
    "toile_body_capsule": (c_int32, [c_double, c_double, _out]),
    "toile_body_plane": (c_int32, [_f64, c_double, _out]),
    "toile_body_grid": (c_int32, [_p("toile_sdf_grid_desc"), _out]),
    "toile_body_mesh": (c_int32, [_f64, c_size_t, _u32, c_size_t, c_double, _out]),
    "toile_body_obj": (c_int32, [c_char_p, c_double, c_double, _out]),
    "toile_body_distance": (c_int32, [handle, _f64, _f64, _f64]),
    "toile_body_free": (None, [handle]),
    "toile_sim_create": (c_int32, [handle, _p("toile_sim_desc"), _out]),
    "toile_sim_from_scene": (c_int32, [c_char_p, c_size_t, c_char_p, _out]),
    "toile_sim_set_body_sdf": (c_int32, [handle, handle, _p("toile_contact_desc"), _u32]),
    "toile_sim_set_body_pose": (c_int32, [handle, c_uint32, _f64, _f64]),
    "toile_sim_set_body_vertices": (c_int32, [handle, c_uint32, _f64, c_size_t]),
    "toile_sim_body_wrench": (c_int32, [handle, c_uint32, _f64, _f64]),
    "toile_sim_pin": (c_int32, [handle, _u32, c_size_t, _f64]),
    "toile_sim_unpin": (c_int32, [handle, _u32, c_size_t]),
    "toile_sim_garment": (c_int32, [handle, _out]),
    "toile_sim_body_count": (c_int32, [handle, _u32]),
    "toile_sim_set_gravity": (c_int32, [handle, _f64]),
    "toile_sim_set_wind": (c_int32, [handle, _f64]),
    "toile_sim_set_blend_region": (c_int32, [handle, c_uint32, _f64, c_size_t, c_uint32]),
    "toile_sim_set_blend_vertices": (c_int32, [handle, _f64, c_size_t, c_uint32]),
    "toile_sim_set_number": (c_int32, [handle, c_char_p, c_double]),
    "toile_sim_number": (c_int32, [handle, c_char_p, _f64]),
    "toile_sim_set_positions": (c_int32, [handle, _f64, _f64, c_size_t]),
    "toile_sim_locate": (c_int32, [handle, c_uint32, _f64, _u32]),
    "toile_sim_step": (c_int32, [handle, c_double, _p("toile_step_report")]),
    "toile_sim_drape": (c_int32, [handle, _p("toile_drape_desc"), _p("toile_step_report")]),
    "toile_sim_report": (c_int32, [handle, _p("toile_step_report")]),
    "toile_sim_epoch": (c_uint64, [handle]),
    "toile_sim_time": (c_double, [handle]),
    "toile_sim_normals": (c_int32, _copy_f64),
    "toile_sim_vertex_panels": (c_int32, _copy_u32),
    "toile_sim_vertex_uv": (c_int32, _copy_f64),
    "toile_sim_vertex_active": (c_int32, [handle, POINTER(c_uint8), c_size_t, _size]),
    "toile_sim_triangles": (c_int32, _copy_u32),
    "toile_sim_yarn_nodes": (c_int32, _copy_f64),
    "toile_sim_yarn_offsets": (c_int32, _copy_u32),
    "toile_sim_yarn_indices": (c_int32, _copy_u32),
    "toile_sim_yarn_coordinates": (c_int32, _copy_f64),
    "toile_sim_yarn_tensions": (c_int32, _copy_f64),
    "toile_sim_yarn_compressions": (c_int32, _copy_f64),
    "toile_sim_yarn_slips": (c_int32, _copy_f64),
    "toile_sim_yarn_active": (c_int32, [handle, POINTER(c_uint8), c_size_t, _size]),
    "toile_sim_yarn_forces": (c_int32, _copy_f64),
    "toile_sim_yarn_radii": (c_int32, _copy_f64),
    "toile_sim_yarn_fabrics": (c_int32, _copy_u32),
    "toile_sim_yarn_panels": (c_int32, _copy_u32),
    "toile_sim_yarn_uv": (c_int32, _copy_f64),
    "toile_sim_yarn_curve_offsets": (c_int32, [handle, c_uint32, _u32, c_size_t, _size]),
    "toile_sim_yarn_curves": (c_int32, [handle, c_uint32, _f64, c_size_t, _size]),
    "toile_sim_yarn_nodes_along": (
        c_int32,
        [handle, c_uint32, c_uint32, _u32, c_size_t, _size],
    ),
    "toile_sim_suggest_region": (
        c_int32,
        [handle, _p("toile_suggest_desc"), _f64, c_size_t, _size, _p("toile_suggestion")],
    ),
    "toile_sim_vertex_errors": (c_int32, _copy_f64),
    "toile_sim_vertex_criteria": (c_int32, _copy_f64),
    "toile_sim_yarn_changes": (c_int32, [handle, _p("toile_yarn_changes")]),
    "toile_sim_locate_yarn_node": (c_int32, [handle, c_uint32, _f64, _u32]),
    "toile_sim_yarn_end": (c_int32, [handle, c_uint32, c_uint32, _u32]),
    "toile_sim_pin_yarn_nodes": (c_int32, [handle, _u32, c_size_t, _f64]),
    "toile_sim_unpin_yarn_nodes": (c_int32, [handle, _u32, c_size_t]),
    "toile_sim_body_positions": (c_int32, [handle, c_uint32, _f64, c_size_t, _size]),
    "toile_sim_body_triangles": (c_int32, [handle, c_uint32, _u32, c_size_t, _size]),
    "toile_sim_energies": (c_int32, [handle, _p("toile_energies")]),
    "toile_sim_info": (c_int32, [handle, _p("toile_system_info")]),
    "toile_sim_backend": (c_int32, [handle, *_text]),
    "toile_sim_save": (c_int32, [handle, POINTER(c_uint8), c_size_t, _size]),
    "toile_sim_restore": (c_int32, [handle, POINTER(c_uint8), c_size_t]),
    "toile_sim_free": (None, [handle]),
    "toile_sim_positions_array": (c_int32, [handle, _out]),
    "toile_sim_velocities_array": (c_int32, [handle, _out]),
    "toile_array_view": (c_int32, [handle, _p("toile_view_f64")]),
    "toile_array_free": (None, [handle]),
}


def library_path() -> Path:
    """File of the library: ``TOILE_LIBRARY``, the packaged copy, or the source tree's build."""
    chosen = os.environ.get("TOILE_LIBRARY")
    if chosen:
        return Path(chosen)
    name = {"win32": "toile.dll", "darwin": "libtoile.dylib"}.get(sys.platform, "libtoile.so")
    here = Path(__file__).resolve().parent
    places = [here / name, here.parents[1] / "target" / "release" / name]
    for place in places:
        if place.is_file():
            return place
    raise OSError(
        f"libtoile is not installed: set TOILE_LIBRARY, or build it ({' and '.join(map(str, places))}"
        " do not exist)"
    )


def load() -> ctypes.CDLL:
    """The library with the signatures of :data:`FUNCTIONS`."""
    library = ctypes.CDLL(str(library_path()))
    for name, (result, arguments) in FUNCTIONS.items():
        function = getattr(library, name)
        function.restype = result
        function.argtypes = [_Index if a is c_uint32 else a for a in arguments]
    return library


lib = load()


def new(name: str) -> Any:
    """A struct with the library's defaults."""
    value = types[name]()
    status = getattr(lib, name + "_init")(ctypes.byref(value), ctypes.sizeof(value))
    if status != 0:
        raise RuntimeError(f"{name}_init: status {status}")
    return value
