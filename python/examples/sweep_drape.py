"""Drape coefficient against bending stiffness: one FMU, many runs beside each other, a plot.

    python3 python/examples/sweep_drape.py --runs 64

A round piece of cloth lies on a round table (it is held on the table's rim) and hangs over. The drape
coefficient is the part of the overhanging ring that its shadow covers: near 1 for card, near 0 for a
silk that hangs straight down (Cusick, 1968). Every run sets the bending stiffness, a fixed parameter of
the FMU, and drapes it anew while it initializes.

Soft cloth can come to rest in several ways, with more folds or fewer, and which one it finds depends on
how it began. So each stiffness is draped from several starts, with a faint air of other side and
strength each: the plot shows every run with its number of folds, and the median. Where the length
at which weight bends cloth, (bending / (density g))^(1/3), is below the edge length, the mesh decides
the folds and not the cloth: the plot shades it.

Needs FMPy and the built program; uses Dask (`distributed`) if it is installed, or the scheduler whose
address is given; draws with Matplotlib if that is installed and writes the numbers in any case.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
# the package beside this file, installed or not, for the workers as well
sys.path.insert(0, str(ROOT / "python"))
os.environ["PYTHONPATH"] = os.pathsep.join(
    [str(ROOT / "python"), *filter(None, [os.environ.get("PYTHONPATH")])]
)

from toile.fmu import sweep  # noqa: E402

CLOTH, TABLE = 0.15, 0.09  # radii [m]
SIDES, HELD = 48, 24
DENSITY, EDGE = 0.15, 0.015  # [kg/m^2], [m]
# softer cloth than this bends within one edge [N m]
RESOLVED = DENSITY * 9.81 * EDGE**3


def circle(radius, count):
    angles = 2 * np.pi * np.arange(count) / count
    return (radius * np.column_stack([np.cos(angles), np.sin(angles)])).round(12).tolist()


SCENE = {
    "toile": 1,
    "name": "Drape tester",
    "edge_length": EDGE,
    "garment": {
        "toile_garment": 1,
        "name": "Round",
        "fabrics": [
            {
                "name": "cloth",
                "density": DENSITY,
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
    "pins": [{"panel": "round", "uv": uv} for uv in circle(TABLE, HELD)] + [
        {"panel": "round", "uv": uv} for uv in circle(0.5 * TABLE, HELD // 2)
    ],
    "run": {"drape": False},
    "numbers": {"solver.drape.force_tolerance": 1e-4, "contact.self.enabled": 0},
}


def drape(outputs):
    """Drape coefficient and number of folds, from positions (n, 3) and triangles (m, 3).

    The coefficient is the shadow of the overhanging ring over its area. The folds are the waves of
    the shadow's rim: the strongest one of its radius as a Fourier series of the angle.
    """
    x, triangles = outputs["vertex.position"], outputs["triangle.vertices"]
    flat = x[:, [0, 2]]
    a, b, c = (flat[triangles[:, k]] for k in range(3))
    u, v = b - a, c - a
    shadow = 0.5 * np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]).sum()
    table, cloth = np.pi * TABLE**2, np.pi * CLOTH**2
    edges = np.sort(np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), 1)
    edges, count = np.unique(edges, axis=0, return_counts=True)
    rim = flat[np.unique(edges[count == 1])]
    angle, radius = np.arctan2(rim[:, 1], rim[:, 0]), np.hypot(rim[:, 0], rim[:, 1])
    even = np.linspace(-np.pi, np.pi, 256, endpoint=False)
    order = np.argsort(angle)
    waves = np.abs(np.fft.rfft(np.interp(even, angle[order], radius[order], period=2 * np.pi)))
    folds = int(np.argmax(waves[1:SIDES // 2]) + 1)
    # a rim that hardly waves has no folds
    flat_rim = waves[folds] / waves[0] < 0.01
    return float((shadow - table) / (cloth - table)), 0 if flat_rim else folds


def study(runs, starts=1, scheduler=None, workers=None, program=None, progress=None):
    """Bending stiffnesses [N m], shape (runs,), and for each the results of its `starts`."""
    program = program or ROOT / "target" / "release" / "toile"
    stiffness = np.geomspace(1e-7, 1e-3, runs)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        (folder / "scene.json").write_text(json.dumps(SCENE))
        archive = folder / "drape.fmu"
        command = [str(program), "fmu", str(folder / "scene.json"), "-o", str(archive), "--quiet"]
        subprocess.run(command, check=True)
        name, values = "fabric.cloth.bending.", []
        for b in stiffness:
            for k in range(starts):
                # air from somewhere starts the folds: flat cloth under exact symmetry has none
                side, strength = 0.46 + 2.4 * k, 0.02 * 2.0**k
                air = {"wind[1]": strength * np.cos(side), "wind[3]": strength * np.sin(side)}
                values.append({name + "warp": b, name + "weft": b, "drape": True, **air})
        more = {} if progress is None else {"progress": progress}
        results = sweep(
            archive, values, ["vertex.position", "triangle.vertices"], evaluate=drape,
            scheduler=scheduler, workers=workers, **more,
        )
    return stiffness, [results[i:i + starts] for i in range(0, len(results), starts)]


def falls(values):
    """How many steps of a list go down, and the largest such step."""
    steps = -np.diff(values)
    return int((steps > 0).sum()), float(max(steps.max(initial=0.0), 0.0))


def plot(stiffness, results, out):
    """Every run in the colour of its folds, and the median of each stiffness."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(7, 4.5))
    runs = [(b, *r.value) for b, all_of in zip(stiffness, results) for r in all_of if not r.error]
    x, y, folds = map(np.array, zip(*runs))
    dots = axes.scatter(x, y, c=folds, cmap="viridis", s=12, label="run")
    figure.colorbar(dots, label="folds")
    medians = [
        (b, np.median([r.value[0] for r in all_of if not r.error]))
        for b, all_of in zip(stiffness, results) if not all(r.error for r in all_of)
    ]
    axes.plot(*zip(*medians), "k-", linewidth=0.8, label="median")
    axes.set(xscale="log", xlabel="bending stiffness [N m]", ylabel="drape coefficient", ylim=(0, 1.02))
    axes.axvspan(stiffness[0], RESOLVED, color="0.9", label="folds finer than the mesh", zorder=0)
    axes.legend(loc="upper left")
    axes.grid(alpha=0.3)
    figure.tight_layout()
    figure.savefig(out, dpi=150)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=64, help="how many stiffnesses")
    parser.add_argument("--starts", type=int, default=3, help="how often each is draped")
    parser.add_argument("--workers", type=int, help="processes; default: one for each core")
    parser.add_argument("--scheduler", help="address of a Dask scheduler, or 'local', or 'processes'")
    parser.add_argument("--out", type=Path, default=Path("drape_coefficient"),
                        help="files to write, without ending")
    parser.add_argument("--program", type=Path, help="the program toile")
    arguments = parser.parse_args()
    stiffness, results = study(
        arguments.runs, arguments.starts, arguments.scheduler, arguments.workers, arguments.program
    )
    table = arguments.out.with_suffix(".csv")
    with table.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["bending [N m]", "start", "drape coefficient", "folds", "seconds", "error"])
        for b, all_of in zip(stiffness, results):
            for k, r in enumerate(all_of):
                writer.writerow([b, k, *(r.value or (None, None)), r.seconds, r.error])
    print(table)
    for b, all_of in zip(stiffness, results):
        for k, r in enumerate(all_of):
            if r.error is not None:
                print(f"bending {b:.3e} N m, start {k} failed: {r.error}", file=sys.stderr)
    good = [[r.value[0] for r in all_of if r.error is None] for all_of in results]
    if not any(good):
        sys.exit("every run failed")
    print(f"weight bends cloth within an edge of the mesh below {RESOLVED:.1e} N m")
    for name, wanted in (("below", stiffness < RESOLVED), ("above", stiffness >= RESOLVED)):
        whole = [c for c, w in zip(good, wanted) if w and len(c) == arguments.starts]
        if len(whole) < 2:
            continue
        for k in range(arguments.starts):
            count, largest = falls([c[k] for c in whole])
            print(f"{name}, start {k}: {count} of {len(whole) - 1} steps fall, the largest by {largest:.4f}")
        spread = max(max(c) - min(c) for c in whole)
        print(f"{name}: starts differ by up to {spread:.4f}")
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        print("no plot: Matplotlib is not installed", file=sys.stderr)
    else:
        picture = arguments.out.with_suffix(".png")
        plot(stiffness, results, picture)
        print(picture)


if __name__ == "__main__":
    main()
