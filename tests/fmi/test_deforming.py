"""Vertices of a deforming mesh body as an input: an array of FMI 3."""

import json

import numpy as np
import pytest

import scenes
from conftest import pack
from master import ERROR, OK, Fmu

RATE = 100.0


def ball(stretch):
    """Vertices (n, 3) of a sphere of radius 0.1 m that is stretched along y, and its triangles."""
    rings, around = 7, 12
    points = [[0.0, 0.1 * stretch, 0.0]]
    for i in range(1, rings):
        a = np.pi * i / rings
        for j in range(around):
            b = 2 * np.pi * j / around
            points.append(
                [0.1 * np.sin(a) * np.cos(b), 0.1 * stretch * np.cos(a), -0.1 * np.sin(a) * np.sin(b)]
            )
    points.append([0.0, -0.1 * stretch, 0.0])
    faces, last = [], len(points) - 1
    at = lambda i, j: 1 + (i - 1) * around + j % around
    for j in range(around):
        faces.append([0, at(1, j), at(1, j + 1)])
        faces.append([last, at(rings - 1, j + 1), at(rings - 1, j)])
        for i in range(1, rings - 1):
            faces.append([at(i, j), at(i + 1, j), at(i + 1, j + 1)])
            faces.append([at(i, j), at(i + 1, j + 1), at(i, j + 1)])
    return np.array(points), np.array(faces)


def stretch(i):
    return 1.0 + 0.07 * i


def write(folder, name, frames):
    """Packs a sheet under a ball that has `frames` shapes; the FMU."""
    place = folder / name
    place.mkdir()
    files = []
    for i in range(frames):
        points, faces = ball(stretch(i))
        lines = [f"v {float(x)!r} {float(y)!r} {float(z)!r}" for x, y, z in points]
        lines += ["f " + " ".join(str(v + 1) for v in face) for face in faces]
        files.append(f"ball{i}.obj")
        (place / files[-1]).write_text("\n".join(lines) + "\n")
    body = {
        "name": "ball", "shape": "mesh", "file": files[0],
        "motion": {
            "keyframes": [{"time": 0, "position": [0, 0.602, 0]}], "frames": files, "rate": RATE
        },
    }
    (place / "scene.json").write_text(json.dumps(scenes.hung(bodies=[body])))
    pack(place / "scene.json", place / "cloth.fmu")
    return Fmu(place / "cloth.fmu", place / "unpacked")


@pytest.fixture(scope="module")
def still(folder):
    return write(folder, "still", 1)


@pytest.fixture(scope="module")
def moving(folder):
    return write(folder, "frames", 6)


NAME = "body.ball.vertex.position"


def fresh(fmu, **values):
    cloth = fmu.instance()
    assert cloth.put(values) == OK and cloth.initialize() == OK, cloth.logs
    return cloth


def course(cloth, first=0, steps=5):
    out = []
    for i in range(first, first + steps):
        assert cloth.put({NAME: ball(stretch(i + 1))[0]}) == OK, cloth.logs
        assert cloth.step(i * 0.01, 0.01) == OK, cloth.logs
        out.append(cloth.outputs())
    return out


def test_vertices_are_an_input_with_the_mesh_as_its_start(still):
    v = still.variables[NAME]
    points, _ = ball(1.0)
    assert v.attributes["causality"] == "input" and v.shape == list(points.shape)
    start = np.array(v.attributes["start"].split(), float).reshape(points.shape)
    assert np.array_equal(start, points)
    cloth = fresh(still)
    assert np.array_equal(cloth.get(NAME), points)
    cloth.free()


def test_vertices_set_have_the_bits_of_the_c_interface(still):
    toile = pytest.importorskip("toile")
    cloth = fresh(still)
    with toile.Sim.from_file(still.resources / "scene.json") as sim:
        sim.set_body_pose(0, (0, 0.602, 0))
        for i in range(5):
            points = ball(stretch(i))[0]
            # before the first step the C interface takes this for a placement
            sim.set_body_vertices(0, points)
            assert cloth.put({NAME: points}) == OK
            sim.step(0.01)
            assert cloth.step(i * 0.01, 0.01) == OK, cloth.logs
            assert np.array_equal(sim.positions, cloth.get("vertex.position")), i
            force, _ = sim.body_wrench(0)
            assert list(force) == [cloth.get(f"body.ball.force[{k}]") for k in (1, 2, 3)]
    assert cloth.get("body.ball.force[2]") > 0.005, "the ball has grown into the sheet"
    cloth.free()


def test_vertices_set_and_frames_of_the_scene_are_the_same_motion(still, moving):
    assert moving.variables["body.ball.vertex.driven"].attributes["start"] == "false"
    frames, driven = fresh(moving), fresh(moving, **{"body.ball.vertex.driven": True})
    frames.run(5)
    course(driven)
    course(alone := fresh(still))
    for cloth in (driven, alone):
        x = [c.get("vertex.position") for c in (frames, cloth)]
        assert np.abs(x[0] - x[1]).max() < 1e-7
    for cloth in (frames, driven, alone):
        cloth.free()


def test_state_and_reset_know_the_vertices(still):
    cloth = fresh(still)
    course(cloth, 0, 2)
    status, state = cloth.get_state()
    assert status == OK
    data, expected = cloth.serialize(state), course(cloth, 2, 3)
    assert cloth.set_state(state) == OK
    assert np.array_equal(cloth.get(NAME), ball(stretch(2))[0])
    assert course(cloth, 2, 3) == expected
    other = fresh(still)
    status, read = other.deserialize(data)
    assert status == OK and other.set_state(read) == OK
    assert course(other, 2, 3) == expected
    assert cloth.free_state(state) == OK and other.free_state(read) == OK
    other.free()
    assert cloth.call("Reset") == OK
    assert np.array_equal(cloth.get(NAME), ball(1.0)[0])
    assert cloth.initialize() == OK
    assert course(cloth)[2:] == expected
    cloth.free()


def test_vertices_before_the_run_are_a_placement(still):
    """The ball is there at once, as in the C interface before the first step."""
    toile = pytest.importorskip("toile")
    small, large = fresh(still), still.instance()
    assert large.enter() == OK
    assert large.put({NAME: ball(1.05)[0]}) == OK
    assert large.call("ExitInitializationMode") == OK
    assert 0.003 < small.get("gap.min") - large.get("gap.min") < 0.006
    with toile.Sim.from_file(still.resources / "scene.json") as sim:
        sim.set_body_pose(0, (0, 0.602, 0))
        sim.set_body_vertices(0, ball(1.05)[0])
        assert sim.report().min_gap == large.get("gap.min")
    for cloth in (small, large):
        cloth.free()


def test_wrong_vertices_are_refused(still):
    points = ball(1.0)[0]
    bad = points.copy()
    bad[3, 1] = np.nan
    for values, why in ((points[:-1], "values were given"), (bad, NAME)):
        cloth = fresh(still)
        assert cloth.put({NAME: values}) == ERROR
        assert why in cloth.logs[-1][2], cloth.logs
        assert cloth.call("Reset") == OK and cloth.initialize() == OK
        cloth.free()
    # inside out: the field cannot be
    cloth = fresh(still)
    assert cloth.put({NAME: 0 * points}) == OK
    assert cloth.step(0.0, 0.01) == ERROR and cloth.logs, cloth.logs
    cloth.free()


def test_helpers_of_the_package_take_arrays(still, folder):
    toile_fmu = pytest.importorskip("toile.fmu")
    raw = fresh(still)
    with toile_fmu.Cloth(folder / "still" / "cloth.fmu") as cloth:
        cloth.initialize()
        with pytest.raises(ValueError, match="shape"):
            cloth[NAME] = np.zeros((3, 3))
        cloth[NAME] = ball(1.02)[0]
        cloth.step(0.01)
        assert raw.put({NAME: ball(1.02)[0]}) == OK and raw.step(0.0, 0.01) == OK
        assert np.array_equal(cloth["vertex.position"], raw.get("vertex.position"))
    raw.free()
