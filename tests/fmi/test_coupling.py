"""A ball and a cloth, two FMUs, exchange pose and force: the ball bounces and energy is accounted for."""

import os
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "python" / "examples"))
validation = pytest.importorskip("fmpy.validation")
import ball_on_cloth  # noqa: E402

PROGRAM = os.environ["TOILE_PROGRAM"]
SIZES = [0.02, 0.01, 0.005]


@pytest.fixture(scope="module")
def study():
    lines = []
    runs, wholes = ball_on_cloth.study(SIZES, 3, PROGRAM, lines.append)
    print("\n".join(lines))
    return runs, wholes


def test_ball_is_a_clean_fmu(tmp_path):
    assert validation.validate_fmu(str(ball_on_cloth.pack_ball(tmp_path))) == []


def test_ball_sinks_in_and_bounces(study):
    runs, wholes = study
    for run in (*runs.values(), *wholes.values()):
        assert 0.49 < run.lowest < 0.53, "the cloth holds the ball"
        assert run.rebound > run.lowest + 0.05, "the ball comes back"
        assert run.rebound < ball_on_cloth.START, "it does not come back higher"


def test_monolithic_run_gains_no_energy(study):
    """Backward Euler takes energy and never gives any."""
    for whole in study[1].values():
        gains = [b - a for a, b in zip(whole.energies, whole.energies[1:])]
        # the ball moves by the exact parabola, the cloth by Euler: gravity's share differs by h^2
        assert max(gains) < 2e-3 * (whole.energies[0] - min(whole.energies)), max(gains)


def test_coupling_error_falls_faster_than_the_step(study):
    """The energy that the exchange adds or loses: more than halved with each halving of the step."""
    errors = [abs(run.interface) for run in study[0].values()]
    for coarse, fine in zip(errors, errors[1:]):
        assert fine < 0.5 * coarse, errors


def test_path_comes_to_the_monolithic_one(study):
    runs, wholes = study
    deviations = [runs[h].deviation(wholes[h]) for h in SIZES]
    for coarse, fine in zip(deviations, deviations[1:]):
        assert fine < 0.6 * coarse, deviations
    assert deviations[-1] < 4e-3, deviations


def test_versions_of_fmi_couple_alike(study):
    runs, _ = ball_on_cloth.study([0.02], 2, PROGRAM, lambda line: None)
    assert runs[0.02].heights == study[0][0.02].heights
