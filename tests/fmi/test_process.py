"""What an FMU does to its process: nothing that stays. Each test has a process of its own."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import master

fmpy = pytest.importorskip("fmpy")
HERE = Path(__file__).parent


def run(program, *arguments, timeout=300):
    done = subprocess.run(
        [sys.executable, "-c", program, *map(str, arguments)],
        capture_output=True, text=True, timeout=timeout, cwd=HERE,
        env={**os.environ, "PYTHONPATH": str(HERE), "PYTHONDONTWRITEBYTECODE": "1"},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


START = """
import ctypes, os, sys, _ctypes
from master import Fmu, OK
archive, folder = sys.argv[1:3]
import time
def threads(): return len(os.listdir("/proc/self/task"))
def settled(count):
    # the kernel lists a thread for a moment after it was joined
    end = time.monotonic() + 5
    while threads() != count and time.monotonic() < end: time.sleep(0.001)
    return threads()
"""


def test_no_thread_stays_after_free(archives, tmp_path):
    run(
        START + """
before = threads()
fmu = Fmu(archive, folder)
cloths = [fmu.instance() for _ in range(3)]
for cloth in cloths:
    assert cloth.put({"solver.threads": 4.0}) == OK
    assert cloth.initialize() == OK
    cloth.run(2)
assert threads() >= before + 12, (before, threads())
for cloth in cloths:
    cloth.free()
assert settled(before) == before, threads()
""",
        archives["hung", 3], tmp_path,
    )


@pytest.mark.parametrize("version", [2, 3])
def test_library_unloads_again_and_again(archives, tmp_path, version):
    """No thread is left when the library is let go, and it works when it is loaded once more. (Matrix
    products keep a buffer for each of the master's threads, and the C library keeps what owns such a
    buffer in memory until that thread ends: the library stays mapped, which is safe.)"""
    run(
        START + """
fmu = Fmu(archive, folder)
out, before = set(), threads()
for i in range(30):
    cloth = fmu.instance()
    assert cloth.put({"solver.threads": 2.0}) == OK
    assert cloth.initialize() == OK
    cloth.run(1)
    out.add(cloth.outputs())
    cloth.free()
    _ctypes.dlclose(fmu.library._handle)
    assert settled(before) == before, i
    fmu.library = ctypes.CDLL(str(fmu.binary))
assert len(out) == 1
""",
        archives["hung", version], tmp_path,
    )


def test_library_leaves_memory_with_the_thread_that_used_it(archives, tmp_path):
    """What the C library waits for is the end of that thread: after it, nothing stays mapped."""
    run(
        START + """
import threading
fmu = Fmu(archive, folder)
def mapped():
    return [line for line in open("/proc/self/maps") if str(fmu.binary) in line]
def work():
    cloth = fmu.instance()
    assert cloth.put({"solver.threads": 2.0}) == OK
    assert cloth.initialize() == OK
    cloth.run(2)
    cloth.outputs()
    cloth.free()
before = threads()
for i in range(3):
    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    # Python's join returns before the system's thread has ended
    assert settled(before) == before and mapped()
    _ctypes.dlclose(fmu.library._handle)
    assert not mapped(), mapped()
    fmu.library = ctypes.CDLL(str(fmu.binary))
""",
        archives["hung", 3], tmp_path,
    )


def test_process_settings_are_left_alone(archives, tmp_path):
    run(
        START + """
import locale
libm = ctypes.CDLL("libm.so.6")
fmu = Fmu(archive, folder)
def settings():
    status = open("/proc/self/status").read()
    signals = [l for l in status.splitlines() if l.startswith(("SigCgt", "SigIgn", "SigBlk"))]
    return os.getcwd(), locale.setlocale(locale.LC_ALL), libm.fegetround(), signals, dict(os.environ)
FE_UPWARD = 0x800
for rounding in (0, FE_UPWARD):
    assert libm.fesetround(rounding) == 0
    before = settings()
    assert before[2] == rounding
    cloth = fmu.instance()
    assert cloth.initialize() == OK
    assert settings() == before
    cloth.run(2)
    cloth.outputs()
    assert cloth.step(9.0, 1.0) != OK
    assert settings() == before
    cloth.free()
    assert settings() == before
""",
        archives["hung", 3], tmp_path,
    )


def test_resources_are_only_read(archives, tmp_path):
    """A folder without write permission will do, and stays as it was."""
    fmu = master.Fmu(archives["hung", 3], tmp_path)
    before = {p: p.stat().st_mtime_ns for p in fmu.resources.rglob("*")}
    for p in [*before, fmu.resources]:
        p.chmod(0o555 if p.is_dir() else 0o444)
    cloth = fmu.instance()
    assert cloth.initialize() == master.OK
    cloth.run(2)
    cloth.free()
    fmu.resources.chmod(0o755)
    assert {p: p.stat().st_mtime_ns for p in fmu.resources.rglob("*")} == before


def build(folder, *flags):
    program = folder / "host"
    headers = Path(fmpy.__path__[0]) / "c-code"
    done = subprocess.run(
        ["cc", "-std=c11", "-g", "-Wall", "-Wextra", "-Wpedantic", "-Werror", *flags,
         f"-isystem{headers}", str(HERE / "host.c"), "-o", str(program), "-ldl"],
        capture_output=True, text=True,
    )
    assert done.returncode == 0, done.stderr
    return program


def arguments(fmu, cycles):
    resources = str(fmu.resources) if fmu.version == 3 else fmu.resources.as_uri()
    reference = fmu.variables["probe.middle.position[2]"].reference
    return [str(fmu.binary), str(fmu.version), fmu.token, resources, str(reference), str(cycles)]


def test_c_master_over_the_official_headers(fmu, tmp_path):
    program = build(tmp_path, "-fsanitize=undefined", "-fno-sanitize-recover=all")
    done = subprocess.run([program, *arguments(fmu, 30)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    cloth = fmu.instance()
    assert cloth.put({"gravity[1]": 0.5}) == master.OK
    assert cloth.initialize() == master.OK
    time = 0.0
    for _ in range(6):
        assert cloth.step(time, 0.01) == master.OK
        time += 0.01
    assert float.fromhex(done.stdout.split()[0]) == cloth.get("probe.middle.position[2]")
    cloth.free()


def test_a_thousand_cycles_leak_nothing(fmu, tmp_path):
    """Load, step, save, restore, unload: what is allocated in the last 100 cycles is what was in the second 100."""
    program = build(tmp_path)
    done = subprocess.run([program, *arguments(fmu, 1000)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    early, late = map(int, done.stdout.split()[1:])
    assert abs(late - early) < 1000, (early, late)


def test_c_master_is_clean_under_valgrind(fmu, tmp_path):
    if not shutil.which("valgrind"):
        if os.environ.get("CI") == "true":
            pytest.fail("valgrind is not installed and CI may skip nothing")
        pytest.skip("valgrind is not installed")
    program = build(tmp_path)
    done = subprocess.run(
        ["valgrind", "--quiet", "--error-exitcode=9", "--leak-check=full",
         "--errors-for-leak-kinds=definite,indirect,possible", str(program), *arguments(fmu, 2)],
        capture_output=True, text=True,
    )
    assert done.returncode == 0, done.stderr
