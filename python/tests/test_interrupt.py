"""Ctrl-C stops a drape and comes out as KeyboardInterrupt."""

import os
import signal
import sys
import threading
import time

import pytest

import toile
from square import square

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="sends signals")


@pytest.fixture(autouse=True)
def pythons_own_handler():
    """Jobs in the background of a shell begin with Ctrl-C ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def hung():
    """Takes far longer to drape than these tests wait."""
    sim = toile.Sim(square(0.006))
    sim.pin([sim.locate(0, (0, 0)), sim.locate(0, (0.4, 0))])
    return sim


def press():
    os.kill(os.getpid(), signal.SIGINT)


def test_ctrl_c_stops_a_drape_without_progress():
    with hung() as sim:
        before, handler = sim.positions, signal.getsignal(signal.SIGINT)
        timer = threading.Timer(0.3, press)
        begun = time.monotonic()
        timer.start()
        with pytest.raises(KeyboardInterrupt):
            sim.drape(force_tolerance=1e-12)
        assert time.monotonic() - begun < 30
        assert signal.getsignal(signal.SIGINT) is handler
        # the simulation goes on from where it was stopped
        assert (sim.positions != before).any()
        sim.step(0.001)


def test_ctrl_c_stops_a_drape_with_progress():
    with hung() as sim:
        calls = []

        def progress(*_):
            calls.append(1)
            if len(calls) == 2:
                press()

        with pytest.raises(KeyboardInterrupt):
            sim.drape(force_tolerance=1e-12, progress=progress)
        assert 2 <= len(calls) <= 3


def test_a_handler_of_the_program_is_called_after_the_drape():
    seen = []
    before = signal.signal(signal.SIGINT, lambda number, frame: seen.append(number))
    try:
        with hung() as sim:
            report = sim.drape(force_tolerance=1e-12, progress=lambda *_: press())
        assert report.outcome == toile.Outcome.CANCELLED and seen == [signal.SIGINT]
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        with toile.Sim(square()) as sim:
            sim.pin([0])
            report = sim.drape(progress=lambda *_: press())
        assert report.outcome != toile.Outcome.CANCELLED
    finally:
        signal.signal(signal.SIGINT, before)


def test_a_drape_in_another_thread_is_left_to_the_main_thread():
    """Signals come to the main thread: there Ctrl-C raises, and here the drape goes on to its end."""
    reports = []
    with toile.Sim(square()) as sim:
        sim.pin([0])
        thread = threading.Thread(target=lambda: reports.append(sim.drape()))
        thread.start()
        thread.join()
    assert reports[0].outcome != toile.Outcome.CANCELLED
