"""The ctypes tables say what include/toile.h says."""

import ctypes
import re
from pathlib import Path

import pytest

import toile
from toile import _ffi

HEADER = Path(__file__).resolve().parents[2] / "include" / "toile.h"

SCALARS = {
    "double": ctypes.c_double,
    "uint8_t": ctypes.c_uint8,
    "uint32_t": ctypes.c_uint32,
    "uint64_t": ctypes.c_uint64,
    "int32_t": ctypes.c_int32,
    "size_t": ctypes.c_size_t,
    "toile_status": ctypes.c_int32,
    "char": ctypes.c_char,
}
CALLBACKS = {"toile_log_fn": _ffi.log_fn, "toile_progress_fn": _ffi.progress_fn}
HANDLES = {"toile_garment", "toile_body", "toile_sim", "toile_array"}


@pytest.fixture(scope="module")
def header():
    text = HEADER.read_text()
    return re.sub(r"/\*.*?\*/", "", text, flags=re.S)


def matches(declaration, kind):
    """Whether a ctypes type is that of a C declaration such as ``const double *values``."""
    declaration = declaration.replace("const", " ").replace("struct ", " ")
    array = re.search(r"\[(\d+)\]", declaration)
    stars = declaration.count("*")
    base = re.match(r"\s*(\w+)", declaration).group(1)
    if base in CALLBACKS:
        return kind is CALLBACKS[base]
    if base in HANDLES:
        return kind is (ctypes.POINTER(ctypes.c_void_p) if stars == 2 else ctypes.c_void_p)
    if base == "void":
        return kind is ctypes.c_void_p
    if base in _ffi.types:
        return stars == 1 and kind is ctypes.POINTER(_ffi.types[base])
    scalar = SCALARS[base]
    if array:
        # an array argument is a pointer
        return kind in (scalar * int(array.group(1)), ctypes.POINTER(scalar))
    if stars == 1 and base == "char":
        return kind in (ctypes.c_char_p, ctypes.POINTER(ctypes.c_char))
    return kind is (ctypes.POINTER(scalar) if stars else scalar)


def test_structs_have_the_fields_of_the_header(header):
    found = dict(re.findall(r"typedef struct (\w+) \{(.*?)\} \w+;", header, flags=re.S))
    assert set(found) == set(_ffi.STRUCTS)
    for name, body in found.items():
        fields = [line.strip() for line in body.split(";") if line.strip()]
        kinds = [("struct_size", ctypes.c_size_t), *_ffi.STRUCTS[name]]
        assert len(fields) == len(kinds), name
        for declaration, (field, kind) in zip(fields, kinds):
            assert re.search(rf"\b{field}(\[\d+\])?$", declaration), (name, declaration, field)
            assert matches(declaration, kind), (name, declaration, kind)


def test_functions_have_the_signatures_of_the_header(header):
    found = {
        name: (result, arguments)
        for result, name, arguments in re.findall(
            r"^([\w ]+?[ *]+)(toile_\w+)\(([^;]*?)\);", header, flags=re.S | re.M
        )
    }
    for name, (result, arguments) in _ffi.FUNCTIONS.items():
        assert name in found, name
        c_result, c_arguments = found[name]
        if c_result.strip() == "void":
            assert result is None, name
        else:
            assert matches(c_result, result), (name, c_result)
        listed = [a.strip() for a in c_arguments.split(",") if a.strip() != "void"]
        assert len(listed) == len(arguments), name
        for declaration, kind in zip(listed, arguments):
            assert matches(declaration, kind), (name, declaration, kind)


#: Functions of the header that Python reaches by another way.
OTHERWISE = {
    "toile_sim_positions": "Sim.positions",
    "toile_sim_velocities": "Sim.velocities",
    "toile_sim_positions_view": "Sim.positions",
    "toile_sim_velocities_view": "Sim.velocities",
    "toile_sim_vertex_count": "Sim.info",
    "toile_sim_triangle_count": "Sim.info",
}


def test_every_function_of_the_header_has_its_way(header):
    found = set(re.findall(r"\b(toile_\w+)\(", header))
    # the defaults of structs: `_ffi.new` calls these by name
    found -= {name + "_init" for name in _ffi.STRUCTS}
    package = Path(_ffi.__file__).parent
    code = "".join(p.read_text() for p in package.glob("*.py"))
    called = set(re.findall(r"\blib\.(toile_\w+)", code))
    assert found - called == set(OTHERWISE)
    for way in OTHERWISE.values():
        kind, name = way.split(".")
        assert hasattr(getattr(toile, kind), name), way
