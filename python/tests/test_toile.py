"""The package against the library: small garments, real calls."""

import copy
import ctypes
import json
import os
import pickle
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

import toile
from square import SQUARE, square
from weave import WEAVE, pull, weave

def test_arrays_have_the_shapes_and_values_that_were_asked_for():
    with toile.Sim(square()) as sim:
        n = sim.info.vertices
        assert sim.positions.shape == (n, 3) and sim.vertex_uv.shape == (n, 2)
        assert sim.normals.shape == (n, 3) and sim.vertex_panels.tolist() == [0] * n
        assert sim.triangles.shape[1] == 3 and sim.triangles.max() == n - 1
        assert sim.vertex_active.tolist() == [1] * n
        # flat, at y = 0.5, facing up
        np.testing.assert_allclose(sim.positions[:, 1], 0.5, atol=1e-12)
        np.testing.assert_allclose(sim.normals, np.tile([0, 1, 0], (n, 1)), atol=1e-9)
        u = sim.vertex_uv
        np.testing.assert_allclose(sim.positions[:, 0], u[:, 0] - 0.2, atol=1e-12)
        assert not sim.positions.flags.writeable


def test_free_fall_is_backward_euler_to_the_last_digits():
    with toile.Sim(square()) as sim:
        sim["air.drag"] = 0.0
        sim["air.tangential"] = 0.0
        sim["contact.self.enabled"] = 0.0
        dt, steps = 0.01, 10
        for _ in range(steps):
            assert sim.step(dt).advanced == dt
        fall = 9.81 * dt * dt * steps * (steps + 1) / 2
        np.testing.assert_allclose(sim.positions[:, 1], 0.5 - fall, atol=1e-6)
        assert abs(sim.time - 0.1) < 1e-12


def test_cloth_comes_to_rest_on_a_sphere_and_the_wrench_is_its_weight():
    with square(0.04) as garment, toile.Body.sphere(0.2) as ball, toile.Sim(garment) as sim:
        index = sim.add_body(ball, friction=0.5)
        sim.set_body_pose(index, (0, 0.25, 0))
        seen = []
        report = sim.drape(progress=lambda fraction, stage, residual: seen.append(fraction))
        assert report.outcome == toile.Outcome.CONVERGED
        assert report.min_gap > -1e-3 and seen == sorted(seen)
        assert ball.distance((0, 0.3, 0))[0] == pytest.approx(0.1)
        weight = 0.4 * 0.4 * 0.2 * 9.81
        force, _ = sim.body_wrench(index)
        np.testing.assert_allclose(force, [0, -weight, 0], atol=0.02 * weight)


def test_an_exception_in_progress_comes_out_and_false_stops():
    with toile.Sim(square()) as sim:
        sim.pin([sim.locate(0, (0, 0)), sim.locate(0, (0.4, 0))])

        def fail(*_):
            raise KeyError("from the callback")

        with pytest.raises(KeyError):
            sim.drape(progress=fail)
        assert sim.drape(progress=lambda *_: False).outcome == toile.Outcome.CANCELLED


def test_saved_state_continues_bitwise():
    with toile.Sim(square()) as sim:
        sim.pin([0])
        sim.step(0.01)
        state = sim.save()
        sim.step(0.01)
        expected = sim.positions.copy()
        sim.restore(state)
        sim.step(0.01)
        assert expected.tobytes() == sim.positions.tobytes()
        with pytest.raises(toile.ToileError):
            sim.restore(state[: len(state) // 2])
        assert expected.tobytes() == sim.positions.tobytes()


def test_errors_carry_the_text_of_the_library():
    with pytest.raises(toile.UsageError, match="-1") as e:
        toile.Body.sphere(-1.0)
    assert e.value.status == -1 and e.value.name
    with pytest.raises(toile.DataError):
        toile.Garment.from_json("{")
    with pytest.raises(toile.ToileError, match="no.such"):
        toile.Sim(square())["no.such"] = 1.0
    garment = square()
    garment.close()
    garment.close()
    with pytest.raises(ValueError, match="closed"):
        garment.to_json()
    with pytest.raises(ValueError, match="shape"):
        toile.Body.mesh([[0, 0]], [[0, 1, 2]])
    with pytest.raises(ValueError, match="32 bits"):
        toile.Body.mesh(np.zeros((3, 3)), [[0, 1, -2]])


@pytest.mark.parametrize("wrong", [1j, True, "1.0", None], ids=repr)
def test_what_is_no_real_number_is_refused_and_not_converted(wrong):
    with toile.Sim(square()) as sim:
        x = np.full(sim.positions.shape, wrong)
        for call in (
            lambda: sim.set_positions(x),
            lambda: sim.set_positions(sim.positions, x),
            lambda: sim.pin([0], x[:1]),
            lambda: sim.pin(x[:, 0]),
            lambda: sim.set_body_pose(0, x[0]),
            lambda: toile.Body.mesh(x, [[0, 1, 2]]),
            lambda: toile.Body.grid(np.full((3, 3, 3), wrong), (0, 0, 0), 0.1),
        ):
            with pytest.raises(ValueError, match="must be"):
                call()


def test_wrong_shapes_are_refused():
    with toile.Sim(square()) as sim:
        n = len(sim.positions)
        with pytest.raises(ValueError, match="shape"):
            sim.set_positions(np.zeros((n, 2)))
        with pytest.raises(ValueError, match="shape"):
            sim.set_positions(np.zeros(3 * n))
        with pytest.raises(toile.UsageError, match=str(n)):
            sim.set_positions(np.zeros((n - 1, 3)))
        with pytest.raises(ValueError, match="2 targets for 1"):
            sim.pin([0], np.zeros((2, 3)))


def test_use_after_close_is_refused():
    sim = toile.Sim(square())
    sim.close()
    for call in (
        lambda: sim.positions, lambda: sim.velocities, lambda: sim.normals, lambda: sim.epoch,
        lambda: sim.time, lambda: sim.step(0.01), lambda: sim.drape(), lambda: sim.save(),
        lambda: sim.pin([0]), lambda: sim["gravity.y"], lambda: sim.energies,
    ):
        with pytest.raises(ValueError, match="this Sim is closed"):
            call()


def test_two_threads_on_one_simulation_raise():
    """While one drapes, another may neither step nor read; afterwards both may."""
    with toile.Sim(square()) as sim:
        sim.pin([0])
        refused = []

        def attempt(call):
            try:
                call()
            except toile.UsageError as e:
                refused.append(str(e))

        def progress(*_):
            calls = [lambda: sim.step(0.01), lambda: sim.positions, lambda: sim.time]
            threads = [threading.Thread(target=attempt, args=(c,)) for c in calls[:2]]
            [t.start() for t in threads]
            [t.join() for t in threads]
            attempt(calls[0])
            return False

        sim.drape(progress=progress)
        assert len(refused) == 3 and all("another call" in text for text in refused), refused
        sim.step(0.01)


def test_json_and_svg_come_back():
    garment = toile.Garment("two", 0.1)
    a = garment.add_panel("a", SQUARE)
    curved = [toile.Edge(0, 1), toile.Edge(1, 2, [0.5, 0.2]), (2, 3), toile.Edge(3, 0, radius=0.3)]
    b = garment.add_panel("b", SQUARE, curved, position=(0, 0, -0.1))
    assert garment.add_seam((a, 1), (b, 3)) == 0
    garment.check()
    again = toile.Garment.from_json(garment.to_json())
    assert again.panel_names == ["a", "b"]
    assert json.loads(again.to_json()) == json.loads(garment.to_json())
    assert "<svg" in garment.to_svg()


def test_a_scene_is_read_with_its_bodies_and_numbers():
    scene = {
        "toile": 1,
        "garment": json.loads(square().to_json()),
        "bodies": [{"shape": "sphere", "radius": 0.2}],
        "numbers": {"solver.newton.max_iterations": 17},
    }
    with toile.Sim.from_scene(json.dumps(scene)) as sim:
        assert sim["solver.newton.max_iterations"] == 17
        positions, triangles = sim.body_mesh(0)
        np.testing.assert_allclose(np.linalg.norm(positions, axis=1), 0.2, rtol=1e-6)
        assert len(triangles) > 10


def test_a_real_pattern_is_read():
    data = os.environ.get("TOILE_DATA")
    if not data:
        assert os.environ.get("CI") != "true", "TOILE_DATA is unset"
        pytest.skip("TOILE_DATA is unset")
    path = Path(data) / "garmentcode" / "gen_tshirt_specification.json"
    garment = toile.Garment.from_file(path)
    assert len(garment.panel_names) > 3


def test_yarns_of_a_panel_are_read_and_held():
    garment = {
        "toile_garment": 1,
        "name": "swatch",
        "edge_length": 0.01,
        "panels": [
            {
                "name": "p",
                "fabric": "y",
                "vertices": [[0, 0], [0.02, 0], [0.02, 0.018], [0, 0.018]],
                "edges": [[0, 1], [1, 2], [2, 3], [3, 0]],
            }
        ],
        "fabrics": [{"name": "y", "yarns": {"preset": "jersey"}}],
        "blend_regions": [{"panel": "p", "polygon": [[-1, -1], [1, -1], [1, 1], [-1, 1]]}],
    }
    with toile.Sim(toile.Garment.from_json(json.dumps(garment))) as sim:
        x, nodes = sim.yarn_nodes, sim.yarn_indices
        assert sim.info.yarn_nodes == len(x) > 100
        assert sim.yarn_offsets[-1] == len(nodes) and nodes.max() < len(x)
        assert not sim.vertex_active.any()
        held = nodes[[0, -1]]
        target = x[held] + [0, 0, 1e-4]
        sim.pin_yarn_nodes(held, target)
        # what begins to slip at the end of a step slides in the next
        sim.step(1e-3)
        sim.step(1e-3)
        np.testing.assert_array_equal(sim.yarn_nodes[held], target)
        assert sim.yarn_tensions.shape == sim.yarn_slips.shape == nodes.shape
        assert sim.yarn_compressions.min() >= 0 and np.abs(sim.yarn_slips).max() > 0
        for start, end in zip(sim.yarn_offsets, sim.yarn_offsets[1:]):
            assert (np.diff(sim.yarn_coordinates[start:end]) > 0).all()
        curves = sim.yarn_curves(3)
        assert len(curves) == len(sim.yarn_radii) == len(sim.yarn_offsets) - 1
        assert (sim.yarn_radii == 7.5e-4).all()
        assert not sim.yarn_fabrics.any() and not sim.yarn_panels.any()
        for curve, start, end in zip(curves, sim.yarn_offsets, sim.yarn_offsets[1:]):
            assert curve.shape == (3 * (end - start - 1) + 1, 3)
            # crossing yarns lie beside each other, and ends where they are
            apart = np.linalg.norm(curve[::3] - sim.yarn_nodes[nodes[start:end]], axis=1)
            assert apart.max() < 7.6e-4 and apart[0] == apart[-1] == 0
        with pytest.raises(toile.UsageError, match="samples"):
            sim.yarn_curves(0)
        uv = sim.yarn_uv
        assert np.allclose(uv[:, 0], x[:, 0]) and np.allclose(uv[:, 1], x[:, 1])
        top = sim.yarn_nodes_along(0, 2)
        assert len(top) >= 12 and (uv[top, 1] > uv[:, 1].max() - 1e-3).all()
        with pytest.raises(toile.UsageError, match="no edge 4"):
            sim.yarn_nodes_along(0, 4)
        sim.unpin_yarn_nodes(held)
        with pytest.raises(toile.ToileError):
            sim.unpin_yarn_nodes(held)
        with pytest.raises(ValueError):
            sim.pin_yarn_nodes(held, target[:1])


LAWN = '{"name": "lawn", "density": 0.08, "membrane": {"warp": 200, "weft": 200, "shear": 40}}'


def test_garments_are_edited_and_read():
    garment = square()
    assert garment.seam_count == 0 and garment.warnings == []
    lawn = garment.add_fabric(LAWN)
    garment.set_panel_fabric(0, lawn)
    assert garment.panel_index(garment.panel_names[0]) == 0
    with pytest.raises(toile.ToileError, match="gone"):
        garment.panel_index("gone")
    garment.set_blend_region(0, [[0, 0], [0.1, 0], [0.1, 0.1]])
    assert json.loads(garment.to_json())["blend_regions"][0].get("rings", 0) == 0
    garment.set_blend_region(0, [[0, 0], [0.1, 0], [0.1, 0.1]], rings=3)
    assert json.loads(garment.to_json())["blend_regions"][0]["rings"] == 3
    garment.set_blend_region(0, np.empty((0, 2)))
    assert not json.loads(garment.to_json()).get("blend_regions")
    garment.set_blend_region(0, [[0, 0], [0.1, 0], [0.1, 0.1]])
    garment.clear_blend_regions()
    with toile.Sim(garment) as sim:
        copy = sim.garment
        assert copy.to_json() == garment.to_json()
        assert sim.body_count == 0
        sim.add_body(toile.Body.sphere(0.1))
        assert sim.body_count == 1
        sim.set_gravity((0, 1, 2))
        sim.set_wind((3, 4, 5))
        assert [sim[f"gravity.{k}"] for k in "xyz"] == [0, 1, 2]
        assert [sim[f"wind.{k}"] for k in "xyz"] == [3, 4, 5]
        sim.set_blend_region(0, np.empty((0, 2)))
        with pytest.raises(toile.UsageError, match="has no yarns"):
            sim.set_blend_region(0, [[0, 0], [0.1, 0], [0.1, 0.1]])


def test_a_weft_is_pulled_out_of_a_weave():
    with weave() as sim:
        assert sim.yarn_end(7, 1) == sim.locate_yarn_node(0, (0.005, 0.0025))
        assert sim.yarn_changes == toile.YarnChanges(1, 0, 0, 0)
        passages = len(sim.yarn_indices)
        pulled = pull(sim, 70)
        changes = sim.yarn_changes
        assert changes.passages_gone == 5 and changes.epoch == 6
        assert len(sim.yarn_indices) == len(sim.yarn_slips) == passages - 5
        assert pulled[-1] < 0.2 * max(pulled)


def test_a_half_pulled_weft_goes_on_bit_by_bit_in_another_process(tmp_path):
    with weave() as sim:
        pull(sim, 30)
        assert 0 < sim.yarn_changes.passages_gone < 5
        half = tmp_path / "half"
        half.write_bytes(sim.save())
        pull(sim, 20)
        whole = sim.save()
    program = Path(__file__).with_name("weave.py")
    subprocess.run([sys.executable, program, half, "20"], check=True)
    assert half.read_bytes() == whole


def test_handles_are_not_copied_and_numbers_do_not_wrap():
    with toile.Sim(square(0.1)) as sim:
        body = toile.Body.sphere(0.1)
        sim.add_body(body)
        for thing in (sim, body, sim.garment):
            for way in (copy.copy, copy.deepcopy, pickle.dumps):
                with pytest.raises(TypeError, match="neither pickled nor copied"):
                    way(thing)
        for wrong in (2**32, -1):
            with pytest.raises(ctypes.ArgumentError, match="2\\^32"):
                sim.set_body_pose(wrong, (0, -5, 0))
        assert sim.time == 0
    with pytest.raises(ValueError, match="threads: -1"):
        toile.Sim(square(0.1), threads=-1)


def test_a_suggested_region_goes_into_the_garment():
    garment = toile.Garment.from_json(json.dumps({**WEAVE, "blend_regions": []}))
    with toile.Sim(garment, gravity=(0, 0, 0)) as sim:
        positions = sim.positions.copy()
        alpha, nothing = sim.suggest_region(tolerance=0.01)
        assert not alpha.any() and nothing.full_triangles == 0
        positions[:, 2] += 4e-4 * np.sin(3e3 * positions[:, 0])
        sim.set_positions(positions)
        alpha, found = sim.suggest_region(tolerance=0.01, budget=100)
        assert alpha.shape == (len(positions),) and set(alpha) <= {0.0, 1.0}
        assert 0 < found.yarn_nodes <= 100 and sim.vertex_errors.max() > 0.01
        with pytest.raises(toile.UsageError, match="tolerance or a budget"):
            sim.suggest_region()
        criteria = sim.vertex_criteria
        assert criteria.shape == (len(positions), len(toile.CRITERIA))
        assert np.allclose(np.sqrt((criteria**2).sum(1)), sim.vertex_errors)
        rest = [name for name in toile.CRITERIA if name != "seam"]
        assert not sim.suggest_region(tolerance=0.01, left_out=rest)[0].any()
        with pytest.raises(ValueError, match="none of"):
            sim.suggest_region(tolerance=0.01, left_out=["bend"])
        with pytest.raises(ValueError):
            sim.suggest_region(budget=-1)
        # live: vertices stay where they are
        before = sim.positions.copy()
        sim.set_blend_vertices(alpha)
        assert (sim.positions == before).all() and len(sim.yarn_nodes) > 0
        assert sim.info.active_triangles == found.active_triangles
        sim.step(1e-4)
        sim.set_blend_region(0, np.empty((0, 2)))
        assert len(sim.yarn_nodes) == 0
        with pytest.raises(ValueError):
            sim.set_blend_vertices(np.ones((2, 2)))
    garment.set_blend_vertices(alpha)
    with toile.Sim(garment) as sim:
        assert sim.info.active_triangles == found.active_triangles
