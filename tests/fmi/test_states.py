"""Saved states: bits, bytes, and bytes that somebody has been at."""

import random
from ctypes import byref, c_char_p, c_size_t, c_uint8, c_void_p

import pytest

from master import ERROR, OK
from test_same_bits import course, drive, fresh


def advance(cloth, first, count):
    for i in range(first, first + count):
        drive(cloth, i)
        assert cloth.step(i * 0.01, 0.01) == OK, cloth.logs


def test_restored_state_has_the_outputs_at_once_and_goes_on_with_the_same_bits(any_fmu):
    cloth = fresh(any_fmu)
    advance(cloth, 0, 5)
    status, state = cloth.get_state()
    assert status == OK and state.value
    here = cloth.outputs()
    advance(cloth, 5, 4)
    there = cloth.outputs()
    assert here != there
    for _ in range(3):
        assert cloth.set_state(state) == OK
        assert cloth.outputs() == here
        advance(cloth, 5, 4)
        assert cloth.outputs() == there
    # works after an error
    assert cloth.step(99.0, 1.0) == ERROR
    assert cloth.set_state(state) == OK
    assert cloth.outputs() == here
    # overwritten in place
    advance(cloth, 5, 4)
    before = state.value
    status, state = cloth.get_state(state)
    assert status == OK and state.value == before
    assert cloth.call("Reset") == OK
    assert cloth.set_state(state) == OK and cloth.outputs() == there
    assert cloth.free_state(state) == OK and state.value is None
    assert cloth.free_state(state) == OK
    cloth.free()


def test_state_of_another_mode_brings_the_mode_back(fmu):
    cloth = fmu.instance()
    assert cloth.put({"wind[1]": 0.5}) == OK
    assert cloth.enter() == OK
    _, state = cloth.get_state()
    assert cloth.call("ExitInitializationMode") == OK
    first = course(cloth, 3)
    assert cloth.call("Terminate") == OK
    assert cloth.set_state(state) == OK
    assert cloth.get("wind[1]") == 0.5
    assert cloth.call("ExitInitializationMode") == OK
    assert course(cloth, 3) == first
    cloth.free()


def test_state_with_other_parameters_builds_their_simulation(fmu):
    heavy = fmu.instance()
    assert heavy.put({"fabric.cotton_lawn.density": 0.4}) == OK
    assert heavy.initialize() == OK
    heavy.put({"solver.newton.velocity_tolerance": 1e-5})
    advance(heavy, 0, 3)
    _, state = heavy.get_state()
    data = heavy.serialize(state)
    here = heavy.outputs()
    advance(heavy, 3, 3)
    there = heavy.outputs()
    light = fresh(fmu)
    status, copy = light.deserialize(data)
    assert status == OK
    assert light.set_state(copy) == OK and light.outputs() == here
    advance(light, 3, 3)
    assert light.outputs() == there
    # a state may be handed over without bytes too
    assert light.call("Reset") == OK
    assert light.set_state(state) == OK and light.outputs() == here
    heavy.free()
    light.free()


def test_bytes_are_the_same_for_the_same_run_and_load_in_another_instance(any_fmu):
    a, b = fresh(any_fmu), fresh(any_fmu)
    advance(a, 0, 4)
    advance(b, 0, 4)
    _, one = a.get_state()
    _, two = b.get_state()
    data = a.serialize(one)
    assert data == b.serialize(two) and data.startswith(b"TOILEFMU")
    advance(a, 4, 3)
    there = a.outputs()
    b.call("Reset")
    status, copy = b.deserialize(data)
    assert status == OK and b.set_state(copy) == OK
    advance(b, 4, 3)
    assert b.outputs() == there
    a.free()
    b.free()


def test_bytes_of_another_fmu_are_refused(unpacked):
    a, b = fresh(unpacked["hung", 3]), fresh(unpacked["moving", 3])
    _, state = a.get_state()
    assert b.deserialize(a.serialize(state))[0] == ERROR
    assert "another FMU" in b.logs[-1][2]
    a.free()
    b.free()


def test_wrong_room_and_pointers_of_nobody_are_errors(fmu):
    cloth = fresh(fmu)
    _, state = cloth.get_state()
    size = len(cloth.serialize(state))
    name = "SerializeFMUState" if fmu.version == 3 else "SerializeFMUstate"
    sizes = "SerializedFMUStateSize" if fmu.version == 3 else "SerializedFMUstateSize"
    room = (c_uint8 * (size + 16))()
    for announced in (0, size - 1, size + 1):
        assert cloth.call(name, state, room, c_size_t(announced)) == ERROR
        assert bytes(room) == bytes(size + 16)
        assert str(size) in cloth.logs[-1][2]
    assert cloth.call(name, state, None, c_size_t(size)) == ERROR
    assert cloth.call(sizes, state, None) == ERROR
    for nobody in (c_void_p(1), c_void_p(), c_void_p(cloth.pointer), c_void_p(2**63)):
        assert cloth.set_state(nobody) == ERROR
        assert cloth.call(name, nobody, room, c_size_t(size)) == ERROR
        if nobody.value:
            assert cloth.free_state(nobody) == ERROR
            assert cloth.get_state(nobody)[0] == ERROR
    get = "GetFMUState" if fmu.version == 3 else "GetFMUstate"
    assert cloth.call(get, None) == ERROR
    # the state itself is still good
    assert cloth.set_state(state) == OK
    assert cloth.free_state(state) == OK
    cloth.free()


def test_ten_thousand_mutations_do_no_harm(fmu):
    cloth = fresh(fmu)
    advance(cloth, 0, 3)
    _, state = cloth.get_state()
    data, here = cloth.serialize(state), cloth.outputs()
    rng = random.Random(7 + fmu.version)
    for k in range(10_000):
        bad = bytearray(data)
        what = k % 4
        if what == 0:
            bad[rng.randrange(len(bad))] ^= 1 << rng.randrange(8)
        elif what == 1:
            del bad[rng.randrange(len(bad)) :]
        elif what == 2:
            at = rng.randrange(len(bad))
            bad[at : at + 8] = rng.randbytes(8)
        else:
            bad += rng.randbytes(rng.randrange(1, 9))
        if bytes(bad) == data:
            continue
        status, made = cloth.deserialize(bytes(bad))
        assert status == ERROR and not made.value, k
        assert "FMU state" in cloth.logs[-1][2]
        cloth.logs.clear()
    assert cloth.set_state(state) == OK and cloth.outputs() == here
    cloth.free()


def fnv(data):
    value = 0xCBF29CE484222325
    for b in data:
        value = (value ^ b) * 0x100000001B3 & 0xFFFFFFFFFFFFFFFF
    return value


def test_forged_checksums_do_no_harm(fmu):
    """Mutations that pass the checksum reach the decoder: an error or a state, never a crash."""
    cloth = fresh(fmu)
    advance(cloth, 0, 2)
    _, state = cloth.get_state()
    data, here = cloth.serialize(state), cloth.outputs()
    rng = random.Random(11)
    loaded = 0
    for _ in range(400):
        bad = bytearray(data[:-8])
        for _ in range(rng.randrange(1, 4)):
            at = rng.randrange(28, len(bad))
            bad[at] = rng.randrange(256)
        bad += fnv(bytes(bad)).to_bytes(8, "little")
        status, made = cloth.deserialize(bytes(bad))
        if status == OK:
            loaded += 1
            if cloth.set_state(made) == OK and cloth.step(0.02, 0.01) == OK:
                cloth.outputs()
            assert cloth.set_state(state) == OK
            assert cloth.free_state(made) == OK
        else:
            assert cloth.set_state(state) == OK
    assert loaded > 10, "no mutation got through: the test tests nothing"
    assert cloth.outputs() == here
    cloth.free()
