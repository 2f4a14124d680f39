"""Calls in no order."""

import math
import random
from ctypes import c_void_p

from master import DISCARD, ERROR, OK


def test_random_calls_do_no_harm(fmu):
    """Thousands of calls in no order, with good and bad arguments: statuses of FMI, never a crash,
    and after a reset the same run as ever."""
    real, integer = ("Float64", "Int32") if fmu.version == 3 else ("Real", "Integer")
    fresh = fmu.instance()
    assert fresh.initialize() == OK
    fresh.run(2)
    expected = fresh.outputs()
    fresh.free()
    rng = random.Random(3 + fmu.version)
    numbers = [0.0, 1.0, -1.0, 0.01, 1e-300, 1e300, math.nan, math.inf, -math.inf, 5e-324]
    names = list(fmu.variables)
    transitions = "ExitInitializationMode Terminate Reset".split()
    if fmu.version == 3:
        transitions += ["EnterConfigurationMode", "ExitConfigurationMode"]
    cloths = [fmu.instance(), fmu.instance()]
    states, seen = [c_void_p()], set()
    for _ in range(4000):
        cloth = rng.choice(cloths)
        what = rng.randrange(9)
        if what == 0:
            status = cloth.call(rng.choice(transitions))
        elif what == 1:
            status = cloth.enter(rng.choice([0.0, 0.0, 0.0, math.nan]), rng.choice([None, 1.0]))
        elif what in (2, 3):
            now = rng.choice([cloth.get("time"), cloth.get("time"), rng.choice(numbers)])
            status = cloth.step(now, rng.choice([0.01, 0.01, rng.choice(numbers)]))
        elif what == 4:
            name = rng.choice(names)
            kind = rng.choice([fmu.variables[name].kind, real, integer])
            if kind == "Binary":
                continue
            count = rng.choice([1, 1, 0, 3, 2**40])
            status, _ = cloth.get_raw(kind, [fmu.variables[name].reference], count, room=20000)
        elif what == 5:
            picked = [fmu.variables[rng.choice(names)].reference for _ in range(rng.randrange(4))]
            status = cloth.set_raw(real, picked, [rng.choice(numbers) for _ in picked])
        elif what == 6:
            status, state = cloth.get_state()
            states.append(state)
        elif what == 7:
            status = cloth.set_state(rng.choice(states))
        else:
            status = cloth.free_state(states[rng.randrange(len(states))])
        assert status in (OK, 1, DISCARD, ERROR)
        seen.add((what, status))
        cloth.logs.clear()
        # errors end a run: without a way back nothing but errors would follow
        if status == ERROR and rng.random() < 0.6:
            assert cloth.call("Reset") == OK
            if rng.random() < 0.7:
                assert cloth.initialize() == OK
    assert {(w, s) for w in (0, 1, 2, 4, 5, 6, 7) for s in (OK, ERROR) if (w, s) != (6, ERROR)} <= seen
    for cloth in cloths:
        assert cloth.call("Reset") == OK
        assert cloth.initialize() == OK, cloth.logs
        cloth.run(2)
        assert cloth.outputs() == expected
        cloth.free()
