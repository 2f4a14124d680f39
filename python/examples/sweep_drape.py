"""Drape coefficient against bending stiffness: one FMU, many runs beside each other, a plot.

    python3 python/examples/sweep_drape.py --runs 64

A round piece of cloth lies on a round table (it is held on the table's rim) and hangs over. The drape
coefficient is the part of the overhanging ring that its shadow covers: near 1 for card, near 0 for a
silk that hangs straight down (Cusick, 1968). Every run sets the bending stiffness, a fixed parameter of
the FMU, and drapes it anew while it initializes.

Needs FMPy and the built program; uses Dask (`distributed`) if it is installed, or the scheduler whose
address is given; draws with Matplotlib if that is installed and writes the numbers in any case.
"""

from __future__ import annotations

import argparse
import csv
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from toile.fmu import sweep

ROOT = Path(__file__).resolve().parents[2]
CLOTH, TABLE = 0.15, 0.09  # radii [m]
SIDES, HELD = 48, 24


def circle(radius, count):
    angles = 2 * np.pi * np.arange(count) / count
    return (radius * np.column_stack([np.cos(angles), np.sin(angles)])).round(12).tolist()


SCENE = {
    "toile": 1,
    "name": "Drape tester",
    "edge_length": 0.015,
    "garment": {
        "toile_garment": 1,
        "name": "Round",
        "fabrics": [
            {
                "name": "cloth",
                "density": 0.15,
                "membrane": {"warp": 500, "weft": 500, "shear": 150},
                "bending": {"warp": 1e-5, "weft": 1e-5},
            }
        ],
        "panels": [
            {
                "name": "round",
                "placement": {"translation": [0, 0.5, 0], "rotation_deg": [-90, 0, 0]},
                "vertices": circle(CLOTH, SIDES),
                "edges": [[k, (k + 1) % SIDES] for k in range(SIDES)],
            }
        ],
        "seams": [],
    },
    # a velocity from place to place starts the folds: flat cloth under exact symmetry has none
    "wind": [0.02, 0, 0.01],
    "pins": [{"panel": "round", "uv": uv} for uv in circle(TABLE, HELD)] + [
        {"panel": "round", "uv": uv} for uv in circle(0.5 * TABLE, HELD // 2)
    ],
    "run": {"drape": False},
    "numbers": {"solver.drape.force_tolerance": 1e-4, "contact.self.enabled": 0},
}


def drape_coefficient(outputs):
    """From positions (n, 3) and triangles (m, 3): shadow of the overhanging ring over its area."""
    x, triangles = outputs["vertex.position"], outputs["triangle.vertices"]
    flat = x[:, [0, 2]]
    a, b, c = (flat[triangles[:, k]] for k in range(3))
    u, v = b - a, c - a
    shadow = 0.5 * np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]).sum()
    table, cloth = np.pi * TABLE**2, np.pi * CLOTH**2
    return float((shadow - table) / (cloth - table))


def study(runs, scheduler=None, workers=None, program=None, progress=None):
    """Bending stiffnesses [N m] and the results of the runs."""
    program = program or ROOT / "target" / "release" / "toile"
    stiffness = np.geomspace(1e-7, 1e-3, runs)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        (folder / "scene.json").write_text(json.dumps(SCENE))
        archive = folder / "drape.fmu"
        command = [str(program), "fmu", str(folder / "scene.json"), "-o", str(archive), "--quiet"]
        subprocess.run(command, check=True)
        name = "fabric.cloth.bending."
        values = [{name + "warp": b, name + "weft": b, "drape": True} for b in stiffness]
        more = {} if progress is None else {"progress": progress}
        results = sweep(
            archive, values, ["vertex.position", "triangle.vertices"], evaluate=drape_coefficient,
            scheduler=scheduler, workers=workers, **more,
        )
    return stiffness, results


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=64)
    parser.add_argument("--workers", type=int, help="processes; default: one for each core")
    parser.add_argument("--scheduler", help="address of a Dask scheduler, or 'local', or 'processes'")
    parser.add_argument("--out", type=Path, default=Path("drape_coefficient"),
                        help="files to write, without ending")
    parser.add_argument("--program", type=Path, help="the program toile")
    arguments = parser.parse_args()
    stiffness, results = study(
        arguments.runs, arguments.scheduler, arguments.workers, arguments.program
    )
    table = arguments.out.with_suffix(".csv")
    with table.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["bending [N m]", "drape coefficient", "seconds", "error"])
        for b, r in zip(stiffness, results):
            writer.writerow([b, r.value, r.seconds, r.error])
    print(table)
    good = [(b, r.value) for b, r in zip(stiffness, results) if r.error is None]
    for b, r in zip(stiffness, results):
        if r.error is not None:
            print(f"bending {b:.3e} N m failed: {r.error}", file=sys.stderr)
    try:
        import matplotlib
    except ImportError:
        print("no plot: Matplotlib is not installed", file=sys.stderr)
    else:
        matplotlib.use("Agg")
        from matplotlib import pyplot

        figure, axes = pyplot.subplots(figsize=(6, 4))
        axes.semilogx(*zip(*good), "o-", markersize=3)
        axes.set(xlabel="bending stiffness [N m]", ylabel="drape coefficient", ylim=(0, 1))
        axes.grid(alpha=0.3)
        figure.tight_layout()
        plot = arguments.out.with_suffix(".png")
        figure.savefig(plot, dpi=150)
        print(plot)
    if not good:
        sys.exit("every run failed")


if __name__ == "__main__":
    main()
