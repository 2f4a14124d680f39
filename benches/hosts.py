"""What hosts cost: the layers of FMI and Python beside the C interface, on the same bits.

    target/venv/bin/python benches/hosts.py

Processor seconds of one sheet of more than 10,000 vertices that hangs over a ball, driven in turn
through the FMI 3 functions and through the C functions; both take the same steps to the same bits, so
that the solver's work is the same. Of several rounds the least is taken, step by step. Needs the built
program and library, FMPy is not needed.
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

STEP, STEPS, ROUNDS = 0.01, 3, 5
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


def steps_and_arrays(fmu):
    rooms = [room(fmu, name) for name in ARRAYS]
    rows = {"step, FMI": [], "step, C": [], "arrays, FMI": [], "arrays, C": []}
    for k in range(ROUNDS):
        cloth, sim, arrays = by_fmi(fmu), by_c(fmu), {}

        def copy():
            arrays.update(p=sim.positions.copy(), v=sim.velocities.copy(), n=sim.normals)

        found = {name: [] for name in rows}
        for i in range(STEPS):
            calls = [
                ("step, FMI", lambda: cloth.run(1, STEP, first=i)),
                ("step, C", lambda: sim.step(STEP)),
                ("arrays, FMI", lambda: read_fmi(cloth, rooms)),
                ("arrays, C", copy),
            ]
            # neither is always the first to find the caches cold
            if (i + k) % 2:
                calls[:2] = reversed(calls[:2])
            for name, call in calls:
                found[name].append(spent(call))
            assert np.array_equal(rooms[0][1], arrays["p"]), "other bits, other work"
        for name, values in found.items():
            rows[name].append(values)
        cloth.free()
        sim.close()
    return {name: np.min(values, axis=0).mean() for name, values in rows.items()}


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
    for i in range(STEPS):
        cloth.run(1, STEP, first=i)
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
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include "toile.h"
int main(int count, char **argument) {
    if (count != 5) return 2;
    FILE *file = fopen(argument[1], "rb");
    char *text = malloc(1 << 24);
    size_t length = fread(text, 1, 1 << 24, file), needed = 0;
    fclose(file);
    toile_sim *sim = NULL;
    if (toile_sim_from_scene(text, length, argument[2], &sim)) return 3;
    toile_sim_positions(sim, NULL, 0, &needed);
    double *x = malloc(needed * sizeof *x), sum = 0;
    clock_t begun = clock();
    for (int i = 0; i < atoi(argument[3]); ++i) {
        if (toile_sim_step(sim, atof(argument[4]), NULL)) return 4;
        if (toile_sim_positions(sim, x, needed, &needed)) return 5;
        sum += x[1];
    }
    printf("%.6f %.17g\n", (double)(clock() - begun) / CLOCKS_PER_SEC, sum);
    return 0;
}
"""
PYTHON = """
import sys, time
import toile
from pathlib import Path
text, folder, steps, dt = Path(sys.argv[1]).read_text(), sys.argv[2], int(sys.argv[3]), float(sys.argv[4])
sim, total = toile.Sim.from_scene(text, folder), 0.0
begun = time.process_time()
for _ in range(steps):
    sim.step(dt)
    x = sim.positions
    total += x[0, 1]
print(f"{time.process_time() - begun:.6f} {total:.17g}")
"""


def python_and_c(fmu, folder):
    source, program = folder / "drive.c", folder / "drive"
    source.write_text(C)
    subprocess.run(
        ["cc", "-std=c11", "-O2", f"-I{ROOT / 'include'}", source, "-o", program, f"-L{RELEASE}",
         "-ltoile", f"-Wl,-rpath,{RELEASE}"], check=True,
    )
    scene = fmu.resources / "scene.json"
    arguments = [scene, scene.parent, str(STEPS), str(STEP)]
    times, sums = {"C": [], "Python": []}, set()
    for _ in range(ROUNDS):
        for name, command in (("Python", [sys.executable, "-c", PYTHON]), ("C", [program])):
            done = subprocess.run(
                [*command, *arguments], check=True, capture_output=True, text=True,
                env={**os.environ, "PYTHONPATH": str(ROOT / "python")},
            )
            seconds, total = done.stdout.split()
            times[name].append(float(seconds) / STEPS)
            sums.add(total)
    assert len(sums) == 1, "other bits, other work"
    return {name: min(t) for name, t in times.items()}


def main():
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        large = pack(folder, "large", 0.0062)
        n = large.variables["vertex.count"].attributes["start"]
        print(f"{n} vertices")
        rows = steps_and_arrays(large)
        for name, seconds in rows.items():
            print(f"{name:24s} {1e3 * seconds:9.2f} ms")
        one, other = (sum(rows[k] for k in rows if k.endswith(w)) for w in ("FMI", "C"))
        print(f"FMI over C, arrays read: {100 * (one / other - 1):+.2f} %")
        print(f"the arrays beside a step: {100 * rows['arrays, FMI'] / rows['step, FMI']:.2f} %")
        for name, (ms, share) in outputs(large, rows["step, FMI"]).items():
            print(f"  {name:24s} {ms:9.3f} ms {share:6.2f} %")
        both = python_and_c(large, folder)
        print(", ".join(f"{k} {1e3 * v:.1f} ms a step" for k, v in both.items()), end=": ")
        print(f"Python over C {100 * (both['Python'] / both['C'] - 1):+.2f} %")
        whole, scene = loading(large)
        print(f"load {whole:.3f} s, the scene's own {scene:.3f} s: the rest {whole - scene:+.3f} s")
        walls = scaling(pack(folder, "small", 0.02))
        for count in (1, 8):
            print(f"{count} threads: FMI {walls['FMI', count]:.3f} s, C {walls['C', count]:.3f} s")


if __name__ == "__main__":
    main()
