"""The same bits, whoever drives: instances, threads, resets, FMI 2 and 3, FMPy, the C interface."""

import json
import math
import re
import threading
from ctypes import c_int

import numpy as np
import pytest

import scenes
from conftest import SCENES
from master import DISCARD, ERROR, OK


def drive(cloth, i):
    """Inputs of step `i`: the ball sinks into the sheet, the air moves, a pin is lifted."""
    if "body.ball.position[2]" in cloth.fmu.variables:
        cloth.put(
            {
                "body.ball.position[2]": 0.62 - 0.006 * (i + 1),
                "body.ball.quaternion[1]": 0.01 * i,
                "wind[1]": 0.2 * i,
                "pin[2].displacement[1]": 0.001 * i,
                "gravity[1]": 0.1 * i,
            }
        )


def course(cloth, steps=8):
    """Outputs after each of some driven steps."""
    out = []
    for i in range(steps):
        drive(cloth, i)
        assert cloth.step(i * 0.01, 0.01) == OK, cloth.logs
        out.append(cloth.outputs())
    return out


def fresh(fmu, **how):
    cloth = fmu.instance(**how)
    assert cloth.initialize() == OK, cloth.logs
    return cloth


@pytest.fixture
def reference(any_fmu):
    cloth = fresh(any_fmu)
    out = course(cloth)
    cloth.free()
    assert len(set(out)) == len(out), "the run stands still"
    return out


def test_instances_one_after_the_other(any_fmu, reference):
    cloth = fresh(any_fmu, name="ä other name".encode())
    assert course(cloth) == reference
    cloth.free()


def test_instances_interleaved_and_an_error_in_one(any_fmu, reference):
    a, b, c = fresh(any_fmu), fresh(any_fmu), fresh(any_fmu)
    for i, expected in enumerate(reference):
        for cloth in (a, b):
            drive(cloth, i)
            assert cloth.step(i * 0.01, 0.01) == OK
            assert cloth.outputs() == expected
        assert c.step(9.0, math.nan) == ERROR
    for cloth in (a, b, c):
        cloth.free()


def test_instances_in_threads_and_moved_between_threads(any_fmu, reference):
    found, wrong = {}, []

    def whole(k):
        try:
            cloth = fresh(any_fmu)
            found[k] = course(cloth)
            cloth.free()
        except BaseException as e:
            wrong.append(e)

    threads = [threading.Thread(target=whole, args=(k,)) for k in range(4)]
    [t.start() for t in threads]
    [t.join() for t in threads]
    assert not wrong and all(found[k] == reference for k in range(4))

    cloth, out = fresh(any_fmu), []

    def one(i):
        drive(cloth, i)
        out.append((cloth.step(i * 0.01, 0.01), cloth.outputs()))

    for i in range(len(reference)):
        thread = threading.Thread(target=one, args=(i,))
        thread.start()
        thread.join()
    assert out == [(OK, o) for o in reference]
    cloth.free()


def test_two_threads_on_one_instance_get_an_error_not_a_race(fmu):
    """An instance belongs to one thread at a time: the second one is refused."""
    cloth = fresh(fmu)
    statuses = []

    def step():
        statuses.append(cloth.step(0.0, 0.01))

    threads = [threading.Thread(target=step) for _ in range(8)]
    [t.start() for t in threads]
    [t.join() for t in threads]
    # whichever came first has stepped; the others found it busy, or at another time
    assert statuses.count(OK) == 1 and set(statuses) <= {OK, ERROR}
    cloth.free()


def test_any_number_of_threads_inside(any_fmu, reference):
    cloth = any_fmu.instance()
    assert cloth.put({"solver.threads": 3.0}) == OK
    assert cloth.initialize() == OK
    assert course(cloth) == reference
    cloth.free()


def test_reset_from_stepping_from_the_end_and_from_an_error(any_fmu, reference):
    cloth = fresh(any_fmu)
    assert course(cloth) == reference
    assert cloth.call("Reset") == OK
    assert cloth.initialize() == OK
    assert course(cloth, 3) == reference[:3]
    assert cloth.call("Terminate") == OK
    assert cloth.call("Reset") == OK and cloth.initialize() == OK
    assert course(cloth, 3) == reference[:3]
    assert cloth.step(77.0, 1.0) == ERROR
    assert cloth.call("Reset") == OK
    densities = [n for n in any_fmu.variables if re.fullmatch(r"fabric\.\w+\.density", n)]
    assert densities
    assert cloth.put({**dict.fromkeys(densities, 0.3), "gravity[3]": 2.0}) == OK
    assert cloth.initialize() == OK
    assert course(cloth, 3) != reference[:3]
    assert cloth.call("Reset") == OK and cloth.initialize() == OK
    assert course(cloth) == reference
    cloth.free()


def test_parameters_set_before_or_in_initialization_give_the_same(fmu):
    changed = {"fabric.cotton_lawn.density": 0.2, "solver.newton.velocity_tolerance": 1e-4}
    early, late = fmu.instance(), fmu.instance()
    assert early.put(changed) == OK and early.initialize() == OK
    assert late.enter() == OK
    late.outputs()
    assert late.put(changed) == OK
    late.outputs()
    assert late.call("ExitInitializationMode") == OK
    assert course(early) == course(late)
    early.free()
    late.free()


def test_versions_of_fmi_agree(unpacked):
    for scene in SCENES:
        two, three = fresh(unpacked[scene, 2]), fresh(unpacked[scene, 3])
        for i in range(6):
            for cloth in (two, three):
                drive(cloth, i)
                assert cloth.step(i * 0.01, 0.01) == OK
        for name in unpacked[scene, 2].names("output"):
            assert two.get(name) == three.get(name), name
        two.free()
        three.free()


@pytest.mark.parametrize("scene", ["woven", "mixed"])
def test_yarns_have_their_nodes_and_their_energy(unpacked, scene):
    toile = pytest.importorskip("toile")
    fmu = unpacked[scene, 3]
    cloth = fresh(fmu)
    with toile.Sim.from_file(fmu.resources / "scene.json") as sim:
        assert len(sim.yarn_nodes) > 50
        for i in range(5):
            assert cloth.step(i * 0.01, 0.01) == OK, cloth.logs
            sim.step(0.01)
        count = cloth.get("yarn.node.count")
        nodes = np.array(cloth.get("yarn.node.position")).reshape(-1, 3)
        assert fmu.variables["yarn.node.position"].shape == [count, 3]
        assert count == len(sim.yarn_nodes) == len(nodes)
        assert np.array_equal(nodes, sim.yarn_nodes)
        assert np.array_equal(cloth.get("vertex.position"), sim.positions)
    parts = ("kinetic", "gravity", "membrane", "bending", "seam", "contact", "yarn")
    total = sum(cloth.get(f"energy.{part}") for part in parts)
    assert cloth.get("energy.yarn") > 0
    assert math.isclose(total, cloth.get("energy.total"), rel_tol=1e-12)
    cloth.free()


def test_fmpy_gets_what_c_gets(archives, any_fmu, unpacked):
    fmpy = pytest.importorskip("fmpy")
    key = next(k for k, f in unpacked.items() if f is any_fmu)
    names = [n for n in any_fmu.names("output") if any_fmu.variables[n].kind != "Binary"]
    result = fmpy.simulate_fmu(
        str(archives[key]), stop_time=0.08, output_interval=0.01, output=names,
        apply_default_start_values=True,
    )
    # FMPy makes its own times: the master of the tests takes the same
    cloth = any_fmu.instance()
    assert cloth.initialize(stop=0.08) == OK
    for row, then in zip(result, list(result["time"][1:]) + [None]):
        for name in names:
            assert np.array_equal(np.ravel(row[name]), np.ravel(cloth.get(name))), name
        if then is not None:
            assert cloth.step(row["time"], then - row["time"]) == OK, cloth.logs
    cloth.free()


def test_c_interface_gets_the_same_bits(unpacked):
    """`toile_sim_*` driven directly: positions and wrench after every step."""
    toile = pytest.importorskip("toile")
    fmu = unpacked["hung", 3]
    cloth = fresh(fmu)
    with toile.Sim.from_file(fmu.resources / "scene.json") as sim:
        home = sim.positions.copy()
        held = [v for v in range(len(home)) if abs(abs(home[v, 2]) - 0.3) < 1e-9]
        second = [v for v in held if home[v, 2] < 0]
        assert len(second) * 2 == len(held)
        # a first pose is a placement; from the second on it is a motion
        sim.set_body_pose(0, (0.0, 0.62, 0.0), (0, 0, 0, 1))
        for i in range(8):
            drive(cloth, i)
            y = 0.62 - 0.006 * (i + 1)
            if i > 0:
                sim.set_body_pose(0, (0.0, y, 0.0), (0.01 * i, 0, 0, 1))
            else:
                # before the first step this interface takes a pose for a placement
                cloth.put({"body.ball.position[2]": 0.62})
            sim["wind.x"] = 0.2 * i
            sim["gravity.x"] = 0.1 * i
            sim.pin(second, home[second] + [0.001 * i, 0, 0])
            sim.step(0.01)
            assert cloth.step(i * 0.01, 0.01) == OK
            assert np.array_equal(sim.positions, cloth.get("vertex.position")), i
            force, torque = sim.body_wrench(0)
            assert list(force) == [cloth.get(f"body.ball.force[{k}]") for k in (1, 2, 3)]
            assert list(torque) == [cloth.get(f"body.ball.torque[{k}]") for k in (1, 2, 3)]
        assert cloth.get("body.ball.force[2]") > 0.005, "the ball is on the sheet"
    cloth.free()


def test_body_of_the_scene_follows_its_keyframes_unless_it_is_driven(unpacked):
    fmu = unpacked["moving", 3]
    body = "body._2nd_capsule__turned"
    assert fmu.variables[f"{body}.driven"].attributes["start"] == "false"
    free, driven = fresh(fmu), fmu.instance()
    assert driven.put({f"{body}.driven": True}) == OK
    assert driven.initialize() == OK
    free.run(15)
    driven.run(15)
    heights = [c.get("extent.max[2]") for c in (free, driven)]
    assert heights[0] > heights[1] + 0.01, heights
    free.free()
    driven.free()


def test_velocity_carries_a_body_through_a_step(fmu):
    """Pose and velocity at the start of a step mean the pose at its end."""
    ends, carried = fresh(fmu), fresh(fmu)
    for i in range(8):
        y = 0.62 - 0.006 * i
        ends.put({"body.ball.position[2]": y + 0.01 * -0.6})
        carried.put({"body.ball.position[2]": y, "body.ball.velocity[2]": -0.6})
        assert ends.step(i * 0.01, 0.01) == OK and carried.step(i * 0.01, 0.01) == OK
    a, b = ends.get("body.ball.force[2]"), carried.get("body.ball.force[2]")
    assert a > 0.005 and math.isclose(a, b, rel_tol=1e-9), (a, b)
    ends.free()
    carried.free()


def test_pin_that_is_let_go_falls_and_has_no_reaction(fmu):
    cloth = fresh(fmu)
    held = fmu.variables["pin[1].held"]
    assert cloth.put({"pin[1].held": False, "body.ball.position[2]": 5.0}) == OK
    cloth.run(20)
    assert cloth.get("extent.min[2]") < 0.4
    assert cloth.get("pin[1].reaction[2]") == 0.0 and cloth.get("pin[2].reaction[2]") < 0
    assert cloth.get("pin[1].held") in (0, False) and held.attributes["start"] == "true"
    cloth.free()


def test_pin_of_the_scene_lets_go_at_its_time(unpacked):
    cloth = fresh(unpacked["moving", 3])
    cloth.run(5)
    assert cloth.get("pin[1].reaction[2]") != 0.0
    cloth.run(1, first=5)
    assert cloth.get("pin[1].reaction[2]") == 0.0
    cloth.free()


def test_other_fabric_hangs_otherwise(folder):
    """Parameters reach the simulation: a heavier sheet pulls its pins harder, exactly so."""
    from conftest import pack
    from master import Fmu

    out = folder / "heavy" / "cloth.fmu"
    out.parent.mkdir()
    # begins at rest
    pack(scenes.hung(run={"drape": True}), out)
    fmu = Fmu(out, out.parent / "u")
    pulls = []
    for density in (0.1, 0.2):
        cloth = fmu.instance()
        assert cloth.put({"fabric.cotton_lawn.density": density, "drape": True}) == OK
        assert cloth.initialize() == OK, cloth.logs
        pulls.append(cloth.get("pin[1].reaction[2]") + cloth.get("pin[2].reaction[2]"))
        cloth.free()
    assert np.allclose(pulls, [-0.36 * d * 9.81 for d in (0.1, 0.2)], rtol=1e-3)


def test_libcosim_runs_the_fmi_2_archive(archives, unpacked):
    pytest.importorskip("libcosimpy")
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    fmu = unpacked["hung", 2]
    execution = CosimExecution.from_step_size(step_size=10_000_000)
    slave = CosimLocalSlave(fmu_path=str(archives["hung", 2]), instance_name="cloth")
    index = execution.add_local_slave(local_slave=slave)
    observer = CosimObserver.create_last_value()
    assert execution.add_observer(observer=observer)
    assert execution.step(step_count=10)
    names = [n for n in fmu.names("output") if fmu.variables[n].kind == "Real"]
    found = observer.last_real_values(
        slave_index=index, variable_references=[fmu.variables[n].reference for n in names]
    )
    cloth = fresh(fmu)
    # libcosim counts nanoseconds, and makes differences of them as seconds
    times = [k * 10_000_000 / 1e9 for k in range(11)]
    for now, then in zip(times, times[1:]):
        assert cloth.step(now, then - now) == OK
    assert [cloth.get(n) for n in names] == list(found)
    cloth.free()
