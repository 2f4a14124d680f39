"""What hosts cost: the layers of FMI and Python beside the C interface, on the same bits.

    target/venv/bin/python benches/hosts.py

Processor seconds of one sheet of more than 10,000 vertices that hangs over a ball. Two simulations of
it in this process take the same short steps to the same bits, one through the layer that is measured, one
through C; whose turn is first alternates. What a busy machine adds to one step it adds to its neighbour,
too: the median of the ratios of pairs is told, with the quartiles. Needs the built program and library
and a C compiler.
"""

import ctypes
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "python"), str(ROOT / "tests" / "fmi")]
RELEASE = Path(os.environ.get("TOILE_RELEASE", ROOT / "target" / "release"))
os.environ.setdefault("TOILE_LIBRARY", str(RELEASE / "libtoile.so"))

import scenes  # noqa: E402
import toile  # noqa: E402
from master import OK, Fmu  # noqa: E402

STEP, ROUNDS = 0.01, 5
# short steps, so that there are many pairs
SHORT, PAIRS = 0.001, 41
ARRAYS = ["vertex.position", "vertex.velocity", "vertex.normal"]


def spent(call, clock=time.process_time):
    begun = clock()
    call()
    return clock() - begun


def pack(folder, name, edge_length):
    place = folder / name
    place.mkdir()
    scene = scenes.hung(edge_length=edge_length)
    (place / "scene.json").write_text(json.dumps(scene))
    command = [RELEASE / "toile", "fmu", place / "scene.json", "-o", place / "cloth.fmu", "--quiet"]
    subprocess.run(command, check=True)
    return Fmu(place / "cloth.fmu", place / "unpacked")


def by_fmi(fmu):
    cloth = fmu.instance()
    assert cloth.initialize() == OK, cloth.logs
    return cloth


def by_c(fmu):
    """The simulation of the same scene, pins and ball as the FMU has them."""
    return toile.Sim.from_file(fmu.resources / "scene.json")


def room(fmu, name):
    v = fmu.variables[name]
    return (ctypes.c_uint32 * 1)(v.reference), np.empty(v.shape)


def read_fmi(cloth, rooms):
    for reference, values in rooms:
        status = cloth.library.fmi3GetFloat64(
            ctypes.c_void_p(cloth.pointer), reference, ctypes.c_size_t(1),
            ctypes.c_void_p(values.ctypes.data), ctypes.c_size_t(values.size),
        )
        assert status == OK


def pairs(one, other):
    """Processor seconds of two calls, made in turn `PAIRS` times: medians of both, and quartiles of the
    ratio."""
    times = np.empty((PAIRS, 2))
    for i in range(PAIRS):
        for side, call in ((0, one), (1, other))[:: -1 if i % 2 else 1]:
            times[i, side] = call(i)
    return *np.median(times, axis=0), np.quantile(times[:, 0] / times[:, 1], [0.25, 0.5, 0.75])


def percent(quartiles):
    low, middle, high = 100 * (quartiles - 1)
    return f"{middle:+.2f} % (quartiles {low:+.2f} to {high:+.2f})"


def layer_and_c(fmu):
    """A step and all arrays, through FMI and through C; the arrays alone."""
    rooms = [room(fmu, name) for name in ARRAYS]
    cloth, sim, arrays, alone = by_fmi(fmu), by_c(fmu), {}, []

    def by_layer(i):
        step = spent(lambda: cloth.run(1, SHORT, first=i))
        alone.append(spent(lambda: read_fmi(cloth, rooms)))
        return step + alone[-1]

    def directly(_):
        def call():
            sim.step(SHORT)
            arrays.update(p=sim.positions.copy(), v=sim.velocities.copy(), n=sim.normals)

        return spent(call)

    found = pairs(by_layer, directly)
    assert np.array_equal(rooms[0][1], arrays["p"]), "other bits, other work"
    cloth.free()
    sim.close()
    return *found, np.median(alone)


def outputs(fmu, step):
    """The first reading of each kind of output after a step; a second one is a look-up."""
    groups = {
        "energies": ["energy.total"], "wrench of the body": ["body.ball.force[1]"],
        "reactions of the pins": ["pin[1].reaction[2]"], "report": ["strain.max", "gap.min"],
        "extents, centre": ["extent.min[1]", "extent.max[2]", "centre_of_mass[3]"],
        "probe, curve": ["probe.middle.position[1]", "curve.rim.length"],
        **{name: [name] for name in [*ARRAYS, "triangle.vertices"]}, "snapshot": [],
    }
    times = {name: [] for name in groups}
    cloth = by_fmi(fmu)
    for i in range(ROUNDS):
        cloth.run(1, SHORT, first=i)
        for name, variables in groups.items():
            call = (lambda: cloth.get(*variables)) if variables else cloth.snapshot
            if variables and fmu.variables[variables[0]].shape:
                kind = fmu.variables[name].kind
                count = int(np.prod(fmu.variables[name].shape))
                call = lambda: cloth.get_raw(kind, [fmu.variables[name].reference], count)
            times[name].append(spent(call))
    cloth.free()
    return {name: (1e3 * min(t), 100 * min(t) / step) for name, t in times.items()}


def loading(fmu):
    """Processor seconds from the file of the library to an instance, and of the scene alone."""
    program = (
        "import sys, time; sys.path.insert(0, sys.argv[1]); from master import Fmu; import ctypes;"
        "b = time.process_time(); f = Fmu(sys.argv[2], sys.argv[3]); c = f.instance();"
        "print(time.process_time() - b); c.free()"
    )
    archive = fmu.folder.parent / "cloth.fmu"
    whole = [
        float(subprocess.run(
            [sys.executable, "-c", program, ROOT / "tests" / "fmi", archive, fmu.folder.parent / "l"],
            check=True, capture_output=True, text=True,
        ).stdout) for _ in range(ROUNDS)
    ]
    scene = [spent(lambda: by_c(fmu).close()) for _ in range(ROUNDS)]
    return min(whole), min(scene)


def in_threads(make, step, count):
    """Wall seconds of `count` simulations, one in each thread."""
    made = [make() for _ in range(count)]
    threads = [threading.Thread(target=lambda s=s: [step(s, i) for i in range(4)]) for s in made]
    begun = time.perf_counter()
    [t.start() for t in threads]
    [t.join() for t in threads]
    wall = time.perf_counter() - begun
    for s in made:
        s.free() if hasattr(s, "free") else s.close()
    return wall


def scaling(fmu):
    found = {}
    for _ in range(ROUNDS):
        for count in (1, 8):
            for name, how in {
                "FMI": (lambda: by_fmi(fmu), lambda s, i: s.run(1, STEP, first=i)),
                "C": (lambda: by_c(fmu), lambda s, i: s.step(STEP)),
            }.items():
                found.setdefault((name, count), []).append(in_threads(*how, count))
    return {key: min(walls) for key, walls in found.items()}


C = r"""
#include <time.h>
#include "toile.h"
static double now(void) {
    struct timespec at;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &at);
    return at.tv_sec + 1e-9 * at.tv_nsec;
}
/* Processor seconds of a step and of reading the positions; negative if a call failed. */
double drive(toile_sim *sim, double dt, double *x, size_t count) {
    double begun = now();
    size_t needed = 0;
    if (toile_sim_step(sim, dt, NULL)) return -1;
    if (toile_sim_positions(sim, x, count, &needed)) return -1;
    return now() - begun;
}
"""


def python_and_c(fmu, folder):
    """A step and the positions, in Python and in C."""
    source, built = folder / "drive.c", folder / "drive.so"
    source.write_text(C)
    subprocess.run(
        ["cc", "-std=gnu11", "-O2", "-shared", "-fPIC", f"-I{ROOT / 'include'}", source, "-o", built,
         os.environ["TOILE_LIBRARY"]], check=True,
    )
    drive = ctypes.CDLL(str(built)).drive
    drive.restype = ctypes.c_double
    drive.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_void_p, ctypes.c_size_t]
    one, other, seen = by_c(fmu), by_c(fmu), {}
    x = np.empty(one.positions.shape)

    def in_python(_):
        def call():
            one.step(SHORT)
            seen["x"] = one.positions

        return spent(call)

    def in_c(_):
        seconds = drive(other.handle, SHORT, x.ctypes.data, x.size)
        assert seconds > 0
        return seconds

    found = pairs(in_python, in_c)
    assert np.array_equal(seen["x"], x), "other bits, other work"
    one.close()
    other.close()
    return found


def main():
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        large = pack(folder, "large", 0.0062)
        n = large.variables["vertex.count"].attributes["start"]
        print(f"{n} vertices")
        layer, direct, ratio, arrays = layer_and_c(large)
        print(f"step and arrays: FMI {1e3 * layer:.2f} ms, C {1e3 * direct:.2f} ms: {percent(ratio)}")
        print(f"the arrays alone: {1e3 * arrays:.2f} ms, {100 * arrays / layer:.2f} % of that")
        for name, (ms, share) in outputs(large, layer).items():
            print(f"  {name:24s} {ms:9.3f} ms {share:6.2f} % of a step")
        python, c, ratio = python_and_c(large, folder)
        print(f"step and positions: Python {1e3 * python:.2f} ms, C {1e3 * c:.2f} ms: {percent(ratio)}")
        whole, scene = loading(large)
        print(f"load {whole:.3f} s, the scene's own {scene:.3f} s: the rest {whole - scene:+.3f} s")
        walls = scaling(pack(folder, "small", 0.02))
        for count in (1, 8):
            print(f"{count} threads: FMI {walls['FMI', count]:.3f} s, C {walls['C', count]:.3f} s")


if __name__ == "__main__":
    main()
