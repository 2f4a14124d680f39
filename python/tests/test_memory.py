"""Arrays over the library's memory: no copy, and no way to reach memory that is gone."""

import gc
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import toile
from square import square


def address(array):
    return array.__array_interface__["data"][0]


def test_reading_copies_nothing_and_later_calls_change_nothing():
    with toile.Sim(square()) as sim:
        x, again = sim.positions, sim.positions
        assert address(x) == address(again), "both are the simulation's own memory"
        assert x.base is not None and not x.flags.owndata
        expected, where = x.copy(), address(x)
        sim.step(0.01)
        assert address(sim.positions) != where, "the simulation has gone on in memory of its own"
        assert address(x) == where
        np.testing.assert_array_equal(x, expected)
        assert not np.array_equal(sim.positions, expected)
        # nobody holds an array of this state: nothing is copied
        where = address(sim.velocities)
        sim["air.drag"] = 1.0
        assert address(sim.velocities) == where


def test_arrays_are_read_only_whatever_one_tries():
    with toile.Sim(square()) as sim:
        x = sim.positions
        with pytest.raises(ValueError):
            x[0] = 1.0
        with pytest.raises(ValueError):
            x[:, 1][0] = 1.0
        with pytest.raises(ValueError):
            x.flags.writeable = True
        with pytest.raises((ValueError, TypeError, BufferError)):
            memoryview(x)[0, 0] = 1.0


def test_arrays_and_their_slices_outlive_steps_and_the_simulation():
    sim = toile.Sim(square())
    whole, heights = sim.positions, sim.positions[::2, 1]
    speeds = sim.velocities.T
    expected = whole.copy(), heights.copy(), speeds.copy()
    for _ in range(3):
        sim.step(0.01)
    kept = sim.positions
    last = kept.copy()
    sim.close()
    del sim
    gc.collect()
    filler = [np.full(kept.shape, 7.0) for _ in range(1000)]
    for array, then in zip((whole, heights, speeds, kept), (*expected, last)):
        np.testing.assert_array_equal(array, then)
    del whole
    gc.collect()
    np.testing.assert_array_equal(heights, expected[1])
    assert len(filler) == 1000


def test_simulation_collected_in_a_cycle_leaves_its_arrays():
    class Scene:
        pass

    scene = Scene()
    scene.self, scene.sim = scene, toile.Sim(square())
    scene.positions = x = scene.sim.positions
    expected = x.copy()
    del scene
    assert gc.collect() > 0
    filler = [np.full(x.shape, 7.0) for _ in range(1000)]
    np.testing.assert_array_equal(x, expected)
    assert len(filler) == 1000


def test_errors_leave_arrays_alone():
    with toile.Sim(square()) as sim:
        x = sim.positions
        expected = x.copy()
        with pytest.raises(toile.ToileError):
            sim.step(-1.0)
        with pytest.raises(toile.ToileError):
            sim.restore(b"no state")
        np.testing.assert_array_equal(x, expected)
        np.testing.assert_array_equal(sim.positions, expected)


def test_threads_read_while_another_steps():
    with toile.Sim(square(0.03)) as sim:
        arrays, done, wrong = [], threading.Event(), []

        def read():
            while not done.is_set():
                for pair, expected in list(arrays):
                    if tuple(float(a.sum()) for a in pair) != expected:
                        wrong.append(expected)

        def take():
            pair = sim.positions, sim.velocities
            arrays.append((pair, tuple(float(a.sum()) for a in pair)))

        readers = [threading.Thread(target=read) for _ in range(3)]
        [t.start() for t in readers]
        take()
        for i in range(12):
            sim.step(0.01)
            if i == 6:
                # some are let go while they are read
                arrays.clear()
                gc.collect()
            take()
        done.set()
        [t.join() for t in readers]
        assert not wrong


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc/self/statm")
def test_arrays_that_are_let_go_leak_nothing():
    def pages():
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1])

    with toile.Sim(square(0.01)) as sim:
        home = sim.positions.copy()

        def cycle():
            for _ in range(400):
                x, v = sim.positions, sim.velocities
                sim.set_positions(home)
                assert x.shape == v.shape

        cycle()
        before = pages()
        cycle()
        grown, held = 4096 * (pages() - before), 400 * 2 * home.nbytes
        assert held > 20e6 and grown < held / 10, (grown, held)


EXIT = """
import toile
from square import square
sim = toile.Sim(square())
x, v = sim.positions, sim.velocities
sim.step(0.01)
class Late:
    def __del__(self, x=x, sim=sim):
        assert x.sum() == x.sum()
        sim.close()
        assert x.sum() == x.sum()
late = Late()
print(float(x.sum()))
"""


def test_arrays_alive_at_the_end_of_the_program_do_no_harm():
    done = subprocess.run(
        [sys.executable, "-X", "dev", "-c", EXIT], cwd=__file__.rsplit("test_memory", 1)[0] or ".",
        capture_output=True, text=True, timeout=60,
    )
    assert done.returncode == 0 and not done.stderr, done.stderr
    assert float(done.stdout) != 0


def test_python_adds_under_a_hundredth_to_a_step_of_ten_thousand_vertices():
    """The work of this package beside one step: its calls, reading positions and velocities, and the
    copy that the library makes because they are held."""
    garment = toile.Garment("large", 0.0115)
    garment.add_panel("large", [[0, 0], [1.1, 0], [1.1, 1.1], [0, 1.1]])
    with toile.Sim(garment) as sim, toile.Sim(square(0.2)) as small:
        assert sim.info.vertices > 10_000
        corners = [sim.locate(0, (0, 1.1)), sim.locate(0, (1.1, 1.1))]
        sim.pin(corners)

        def best(count, call):
            times = []
            for _ in range(count):
                begun = time.process_time_ns()
                call()
                times.append(time.process_time_ns() - begun)
            return min(times) * 1e-9

        step = best(3, lambda: sim.step(1 / 60))
        held = [None]

        def read():
            held[0] = sim.positions, sim.velocities

        def change():
            read()
            sim.pin(corners)

        # what a step of a few vertices takes is more than what its call from Python takes
        calls = best(50, lambda: small.step(1e-9))
        added = best(50, read) + best(50, change) + calls
        assert added < 0.01 * step, (added, step)
