"""A ball falls onto a hung cloth and bounces: two FMUs, coupled by a master of a few lines.

    python3 python/examples/ball_on_cloth.py

The cloth is an FMU of toile, the ball one of its own in C (``examples_c/ball``). At every
communication point the master hands the ball's pose and velocity to the cloth, lets the cloth step,
hands the force and torque of the cloth to the ball, and lets the ball step. The table tells, for one
communication step size after the other, what this loose coupling costs in energy, and how far the
ball's path is from the monolithic run of the same step: ball and cloth advanced together through the
C interface, every step repeated until force and motion agree. What both lose alike is the damping of
the cloth's own time integration, backward Euler, which falls with the step.

Needs FMPy, a C compiler and the built program and library (``cargo build --release``).
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
import zipfile
from dataclasses import dataclass, field
from pathlib import Path

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

ROOT = Path(__file__).resolve().parents[2]
# the package beside this file, installed or not
sys.path.insert(0, str(ROOT / "python"))
AXES = (1, 2, 3)
START = 0.75  # height of the ball's centre [m]
END = 0.5  # [s]

SCENE = {
    "toile": 1,
    "name": "Hung cloth",
    "edge_length": 0.05,
    "garment": {
        "toile_garment": 1,
        "name": "Cloth",
        "fabrics": [
            {
                "name": "cotton",
                "density": 0.1,
                "membrane": {"warp": 400, "weft": 400, "shear": 80},
                "bending": {"warp": 4e-6, "weft": 4e-6},
            }
        ],
        "panels": [
            {
                "name": "cloth",
                "placement": {"translation": [0, 0.5, 0], "rotation_deg": [-90, 0, 0]},
                "vertices": [[-0.3, -0.3], [0.3, -0.3], [0.3, 0.3], [-0.3, 0.3]],
                "edges": [[0, 1], [1, 2], [2, 3], [3, 0]],
            }
        ],
        "seams": [],
    },
    "bodies": [
        {"name": "ball", "shape": "sphere", "radius": 0.1, "pose": {"position": [0, START, 0]}}
    ],
    "pins": [{"panel": "cloth", "edge": e} for e in range(4)],
    "run": {"drape": True, "duration": END, "dt": 0.01},
}


@dataclass
class Run:
    """What was seen of one run; energies [J]."""

    times: list = field(default_factory=list)
    heights: list = field(default_factory=list)
    energies: list = field(default_factory=list)
    #: work of the cloth on its moving body, less the work that the ball took
    interface: float = 0.0
    seconds: float = 0.0

    def add(self, now, height, energy):
        self.times.append(now)
        self.heights.append(height)
        self.energies.append(energy)

    @property
    def lowest(self):
        return min(self.heights)

    @property
    def rebound(self):
        """Greatest height after the lowest one."""
        return max(self.heights[int(np.argmin(self.heights)) :])

    def deviation(self, other):
        """Largest distance from another run's path, at this run's times."""
        path = np.interp(self.times, other.times, other.heights)
        return float(np.abs(path - self.heights).max())


class Part:
    """An FMU by variable names, FMI 2 or 3."""

    def __init__(self, archive, folder):
        self.description = fmpy.read_model_description(str(archive))
        fmpy.extract(str(archive), str(folder))
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.three = self.description.fmiVersion != "2.0"
        kind = FMU3Slave if self.three else FMU2Slave
        self.fmu = kind(
            guid=self.description.guid,
            unzipDirectory=str(folder),
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName="part",
        )
        self.fmu.instantiate()

    def start(self, **values):
        if not self.three:
            self.fmu.setupExperiment(startTime=0.0)
        self.set(values)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def get(self, *names):
        get = self.fmu.getFloat64 if self.three else self.fmu.getReal
        return np.array(get([self.references[n] for n in names]))

    def set(self, values):
        put = self.fmu.setFloat64 if self.three else self.fmu.setReal
        put([self.references[n] for n in values], [float(v) for v in values.values()])

    def vector(self, name, axes=AXES):
        return self.get(*(f"{name}[{k}]" for k in axes))

    def step(self, now, size):
        self.fmu.doStep(currentCommunicationPoint=now, communicationStepSize=size)

    def close(self):
        self.fmu.terminate()
        self.fmu.freeInstance()


def vector(name, values):
    return {f"{name}[{k + 1}]": v for k, v in enumerate(values)}


def pack_ball(folder):
    """Compiles the ball and packs it: FMI 2.0, this machine's platform."""
    source = ROOT / "examples_c" / "ball"
    binary = folder / "ball.so"
    headers = Path(fmpy.__path__[0]) / "c-code"
    subprocess.run(
        ["cc", "-std=c11", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-shared", "-fPIC",
         f"-I{headers}", str(source / "ball.c"), "-o", str(binary), "-lm"],
        check=True,
    )
    archive = folder / "ball.fmu"
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as z:
        z.write(source / "modelDescription.xml", "modelDescription.xml")
        z.write(binary, f"binaries/{fmpy.platform}/ball.so")
    return archive


def pack_cloth(folder, version, program):
    scene = folder / "scene.json"
    scene.write_text(json.dumps(SCENE))
    archive = folder / "cloth.fmu"
    command = [str(program), "fmu", str(scene), "-o", str(archive), "--fmi", str(version), "--quiet"]
    subprocess.run(command, check=True)
    return archive


def coupled(cloth_archive, ball_archive, folder, size):
    """The two FMUs, communicating every `size` [s]."""
    cloth = Part(cloth_archive, folder / "cloth")
    ball = Part(ball_archive, folder / "ball")
    cloth.start()
    ball.start(**vector("position", [0, START, 0]))
    run, begun = Run(), time.perf_counter()
    seen = ball.vector("position")
    energies = ("energy.kinetic", "energy.potential")
    run.add(0.0, seen[1], cloth.get("energy.total")[0] + ball.get(*energies).sum())
    for n in range(round(END / size)):
        now = n * size
        place, velocity = ball.vector("position"), ball.vector("velocity")
        cloth.set(
            {
                **vector("body.ball.position", place),
                **vector("body.ball.quaternion", ball.vector("quaternion", (1, 2, 3, 4))),
                **vector("body.ball.velocity", velocity),
                **vector("body.ball.angular_velocity", ball.vector("angular_velocity")),
            }
        )
        cloth.step(now, size)
        force = cloth.vector("body.ball.force")
        ball.set({**vector("force", force), **vector("torque", cloth.vector("body.ball.torque"))})
        ball.step(now, size)
        # the cloth has moved its body to where the velocity led, the ball is where the force led it
        led = place + size * velocity
        arrived = ball.vector("position")
        run.interface += force @ (arrived - place) - force @ (led - seen)
        seen = led
        total = cloth.get("energy.total")[0] + ball.get(*energies).sum()
        run.add(now + size, arrived[1], total)
    run.seconds = time.perf_counter() - begun
    cloth.close()
    ball.close()
    return run


def monolithic(resources, size, mass=0.05, gravity=-9.81):
    """Cloth and ball through the C interface; every step is repeated until the force on the ball at
    the step's end is the one that took it there."""
    import toile

    run, begun = Run(), time.perf_counter()
    with toile.Sim.from_file(resources / "scene.json") as sim:
        y, v = START, 0.0

        def energy():
            e = sim.energies
            cloth = e.kinetic + e.gravity + e.membrane + e.bending + e.seam + e.contact
            return cloth + 0.5 * mass * v * v - mass * gravity * y

        run.add(0.0, y, energy())
        for n in range(round(END / size)):
            saved = sim.save()

            def arrive(end):
                """Where the ball goes if the cloth sees it at `end`; its force."""
                sim.restore(saved)
                sim.set_body_pose(0, (0.0, end, 0.0))
                sim.step(size)
                force = sim.body_wrench(0)[0][1]
                return y + size * v + 0.5 * size * size * (force / mass + gravity), force

            a = y + size * v
            fa, force = arrive(a)
            b = fa
            for _ in range(60):
                if abs(fa - a) < 1e-12:
                    break
                fb, force = arrive(b)
                if abs(fb - b) < 1e-12:
                    break
                slope = ((fb - b) - (fa - a)) / (b - a) if b != a else -1.0
                a, fa, b = b, fb, b - (fb - b) / slope
            else:
                raise RuntimeError(f"step {n}: force and motion do not agree")
            y, v = y + size * v + 0.5 * size * size * (force / mass + gravity), v + size * (
                force / mass + gravity
            )
            run.add((n + 1) * size, y, energy())
    run.seconds = time.perf_counter() - begun
    return run


def study(sizes, version=3, program=None, say=print):
    """Runs and prints everything; the coupled and the monolithic runs by step size."""
    program = program or ROOT / "target" / "release" / "toile"
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        cloth = pack_cloth(folder, version, program)
        ball = pack_ball(folder)
        runs, wholes = {}, {}
        for size in sizes:
            place = folder / f"run{size}"
            runs[size] = coupled(cloth, ball, place, size)
            wholes[size] = monolithic(place / "cloth" / "resources", size)
    finest = wholes[min(sizes)]
    fall = 0.05 * 9.81 * (START - finest.lowest)

    def kept(run):
        return 100 * (1 + (run.energies[-1] - run.energies[0]) / fall)

    say(f"ball of 50 g onto a hung cloth, {END} s; the fall releases {1e3 * fall:.1f} mJ")
    say("          lowest [mm]      rebound [mm]    energy kept [%]   coupling    path        wall [s]")
    say("  step    FMUs  together   FMUs  together   FMUs  together   error [mJ]  error [mm]  FMUs")
    for size, run in runs.items():
        whole = wholes[size]
        say(
            f"{1e3 * size:6g} {1e3 * run.lowest:8.2f} {1e3 * whole.lowest:8.2f}"
            f" {1e3 * run.rebound:8.2f} {1e3 * whole.rebound:8.2f} {kept(run):7.2f} {kept(whole):8.2f}"
            f" {1e3 * run.interface:12.4f} {1e3 * run.deviation(whole):11.3f} {run.seconds:8.1f}"
        )
    return runs, wholes


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--steps", type=float, nargs="+", default=[0.01, 0.005, 0.0025, 0.00125],
                        help="communication step sizes [s], coarsest first")
    parser.add_argument("--fmi", type=int, choices=(2, 3), default=3, help="version of the cloth FMU")
    parser.add_argument("--program", type=Path, help="the program toile")
    arguments = parser.parse_args()
    runs, wholes = study(arguments.steps, arguments.fmi, arguments.program)
    every = (*runs.values(), *wholes.values())
    bounced = all(run.rebound > run.lowest + 0.02 for run in every)
    if not bounced:
        sys.exit("the ball did not bounce")


if __name__ == "__main__":
    main()
