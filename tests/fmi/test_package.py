"""The helpers of the Python package: one instance by names, and sweeps that outlive failed runs."""

import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from master import OK
from test_same_bits import fresh

toile_fmu = pytest.importorskip("toile.fmu")
sys.path.insert(0, str(Path(__file__).parents[2] / "python" / "examples"))


@pytest.mark.parametrize("version", [2, 3])
def test_cloth_by_names_has_the_bits_of_the_c_functions(archives, unpacked, version):
    raw = fresh(unpacked["hung", version])
    with toile_fmu.Cloth(archives["hung", version]) as cloth:
        cloth["wind[1]"] = 0.0
        cloth.initialize()
        for i in range(3):
            cloth.step(0.01)
            assert raw.step(cloth.time - 0.01, 0.01) == OK
        for name in unpacked["hung", version].names("output"):
            assert np.array_equal(cloth[name], raw.snapshot() if name == "snapshot" else raw.get(name))
        if version == 3:
            assert cloth["vertex.position"].shape == (cloth["vertex.count"], 3)
        with pytest.raises(KeyError, match="no.such"):
            cloth["no.such"]
        with pytest.raises(RuntimeError, match="wind"):
            cloth["wind[1]"] = math.nan
    with pytest.raises(ValueError, match="closed"):
        cloth.step(0.01)
    cloth.close()
    raw.free()


RUNS = [{"fabric.cotton_lawn.density": d} for d in (0.1, -1.0, 0.2, 0.4)]
NAMES = ["pin[1].reaction[2]", "time"]


def check(results):
    """One run of the four cannot be; the rest are kept, in order."""
    assert [r.parameters for r in results] == RUNS
    assert [r.error is None for r in results] == [True, False, True, True]
    assert "density" in results[1].error and results[1].value is None
    pulls = [r.value[NAMES[0]] for r in results if r.error is None]
    assert pulls[0] > pulls[1] > pulls[2], "heavier cloth pulls harder"
    assert all(math.isclose(r.value["time"], 0.05) for r in results if r.error is None)
    return pulls


@pytest.fixture(scope="module")
def alone(archives):
    archive = archives["hung", 3]
    good = [p for p in RUNS if p["fabric.cotton_lawn.density"] > 0]
    return [toile_fmu.run(archive, p, NAMES, 0.05, 0.01)[NAMES[0]] for p in good]


def test_sweep_in_processes(archives, alone):
    told = []
    results = toile_fmu.sweep(
        archives["hung", 3], RUNS, NAMES, 0.05, 0.01, workers=2, scheduler="processes",
        progress=lambda *counts: told.append(counts),
    )
    assert check(results) == alone
    assert [t[0] for t in told] == [1, 2, 3, 4] and told[-1] == (4, 4, 1)


def test_sweep_on_a_dask_cluster_and_on_a_scheduler_elsewhere(archives, alone):
    distributed = pytest.importorskip("distributed")
    how = dict(outputs=NAMES, duration=0.05, step=0.01, workers=2, progress=None)
    assert check(toile_fmu.sweep(archives["hung", 3], RUNS, scheduler="local", **how)) == alone
    cluster = distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None)
    try:
        address = cluster.scheduler_address
        assert check(toile_fmu.sweep(archives["hung", 3], RUNS, scheduler=address, **how)) == alone
    finally:
        cluster.close()


def test_lost_worker_costs_its_run_only_in_the_report(archives):
    """A worker that dies does not take the sweep with it."""
    results = toile_fmu.sweep(
        archives["hung", 3], RUNS[:1], NAMES, evaluate=die, workers=1, scheduler="processes",
        progress=None,
    )
    assert results[0].value is None and "Broken" in results[0].error


def test_lost_worker_does_not_take_the_other_runs_along(archives, alone):
    runs = [*RUNS, {"fabric.cotton_lawn.density": DEADLY}]
    results = toile_fmu.sweep(
        archives["hung", 3], runs, [*NAMES, "fabric.cotton_lawn.density"], 0.05, 0.01,
        evaluate=die_of_density, workers=2, scheduler="processes", progress=None,
    )
    assert results[-1].value is None and "Broken" in results[-1].error
    assert check(results[:-1]) == alone


DEADLY = 0.123


def die_of_density(outputs):
    if outputs.pop("fabric.cotton_lawn.density") == DEADLY:
        os._exit(3)
    return outputs


def die(_outputs):
    os._exit(3)


def test_drape_coefficient_rises_with_bending_stiffness(tmp_path):
    example = Path(__file__).parents[2] / "python" / "examples" / "sweep_drape.py"
    out = tmp_path / "drape"
    done = subprocess.run(
        [sys.executable, str(example), "--runs", "4", "--starts", "1", "--workers", "2", "--scheduler", "processes",
         "--program", os.environ["TOILE_PROGRAM"], "--out", str(out)],
        capture_output=True, text=True, timeout=300,
    )
    assert done.returncode == 0, done.stderr
    rows = [line.split(",") for line in out.with_suffix(".csv").read_text().splitlines()[1:]]
    coefficients = [float(r[2]) for r in rows]
    assert coefficients == sorted(coefficients) and len(rows) == 4
    assert coefficients[0] < 0.5 and 0.95 < coefficients[-1] <= 1.01
    folds = [int(r[3]) for r in rows]
    assert folds[0] > 2 and folds[-1] == 0 and out.with_suffix(".png").stat().st_size > 5000
