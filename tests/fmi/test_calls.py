"""Every call in and out of order, with good and bad arguments: a status, and a line in the log."""

import ctypes
import json
import math
import shutil
from ctypes import byref, c_bool, c_char_p, c_double, c_int, c_size_t, c_uint32, c_uint8, c_void_p

import numpy as np
import pytest

from master import DISCARD, ERROR, LOG2, LOG3, OK, Callbacks2, Instance


def refused(cloth, status, *words):
    """The call was an error, the log says why, and only a way back is open."""
    assert status == ERROR
    level, category, message = cloth.logs[-1]
    assert level == ERROR and category == "logStatusError"
    for word in words:
        assert word in message, message
    assert cloth.step(cloth.fmu and 0.0, 0.01) == ERROR
    assert "Terminated" in cloth.logs[-1][2]
    assert cloth.call("Reset") == OK


def test_versions(unpacked):
    library = unpacked["hung", 3].library
    for name, expected in [
        ("fmi3GetVersion", b"3.0"), ("fmi2GetVersion", b"2.0"), ("fmi2GetTypesPlatform", b"default"),
    ]:
        function = getattr(library, name)
        function.restype = c_char_p
        assert function() == expected


def test_wrong_tokens_and_paths_give_no_instance_and_a_line(fmu, tmp_path):
    uri = "file://" if fmu.version == 2 else ""
    empty = tmp_path / "empty"
    empty.mkdir()
    for how, word in [
        (dict(token=b"{wrong}"), "{wrong}"),
        (dict(token=b""), "token"),
        (dict(resources=b""), "esource"),
        (dict(resources=f"{uri}/no/such/folder".encode()), "/no/such/folder"),
        (dict(resources=f"{uri}{empty}".encode()), str(empty)),
        (dict(resources=b"\xff\xfe"), "UTF-8"),
    ]:
        made = Instance(fmu, **how)
        assert made.pointer is None, how
        assert made.logs and made.logs[-1][0] == ERROR and word in made.logs[-1][2], made.logs
        assert Instance(fmu, callback=False, **how).pointer is None


def test_null_texts_give_no_instance(fmu):
    library = fmu.library
    good = (b"cloth", fmu.token.encode(), str(fmu.resources).encode())
    for missing in range(3):
        texts = [c_char_p(None if i == missing else t) for i, t in enumerate(good)]
        if fmu.version == 3:
            make = library.fmi3InstantiateCoSimulation
            make.restype = c_void_p
            rest = [c_bool(0)] * 4 + [None, c_size_t(0), None, None, None]
            assert make(*texts, *rest) is None
        else:
            make = library.fmi2Instantiate
            make.restype = c_void_p
            name, token, path = texts
            assert make(name, c_int(1), token, path, None, c_int(0), c_int(0)) is None


def test_resources_are_found_with_and_without_separator_and_with_escapes(fmu, tmp_path):
    place = tmp_path / "with space and ä"
    shutil.copytree(fmu.resources, place)
    if fmu.version == 3:
        paths = [str(place), str(place) + "/"]
    else:
        paths = [place.as_uri(), place.as_uri() + "/", "file:" + place.as_uri()[7:]]
        assert "%20" in paths[0]
    for path in paths:
        cloth = Instance(fmu, resources=path.encode())
        assert cloth.pointer, cloth.logs
        assert cloth.initialize() == OK
        cloth.free()


def test_damaged_resources_give_no_instance_and_a_line_that_names_the_place(fmu, tmp_path):
    uri = "file://" if fmu.version == 2 else ""
    about = json.loads((fmu.resources / "fmu.json").read_text())

    def attempt(name, change, word):
        place = tmp_path / name
        shutil.copytree(fmu.resources, place)
        change(place)
        made = Instance(fmu, resources=f"{uri}{place}".encode())
        assert made.pointer is None and word in made.logs[-1][2], (name, made.logs)

    attempt("missing", lambda p: (p / "scene.json").unlink(), "scene.json")
    attempt("broken", lambda p: (p / "scene.json").write_text('{"toile": 1, '), "scene.json")
    attempt("bytes", lambda p: (p / "scene.json").write_bytes(b"\xff" * 9), "scene.json")
    attempt("about", lambda p: (p / "fmu.json").write_text("[]"), "fmu.json")
    attempt(
        "newer", lambda p: (p / "fmu.json").write_text(json.dumps({**about, "toile_fmu": 9})), "9"
    )
    other = json.loads((fmu.resources / "scene.json").read_text())
    other["edge_length"] = 0.2
    attempt(
        "other", lambda p: (p / "scene.json").write_text(json.dumps(other)), "model description"
    )


def test_other_kinds_of_instances_are_refused(unpacked):
    library, fmu = unpacked["hung", 3].library, unpacked["hung", 3]
    lines = []
    log = LOG3(lambda e, s, c, m: lines.append((s, m.decode())))
    texts = [c_char_p(b"x"), c_char_p(fmu.token.encode()), c_char_p(str(fmu.resources).encode())]
    make = library.fmi3InstantiateModelExchange
    make.restype = c_void_p
    assert make(*texts, c_bool(0), c_bool(0), None, log) is None
    make = library.fmi3InstantiateScheduledExecution
    make.restype = c_void_p
    assert make(*texts, c_bool(0), c_bool(0), None, log, None, None, None) is None
    make = library.fmi3InstantiateCoSimulation
    make.restype = c_void_p
    flags = [c_bool(0), c_bool(0), c_bool(1), c_bool(0)]
    assert make(*texts, *flags, None, c_size_t(0), None, log, None) is None
    assert [s for s, _ in lines] == [ERROR] * 3
    assert "model exchange" in lines[0][1] and "Event Mode" in lines[2][1]
    two = unpacked["hung", 2]
    callbacks = Callbacks2()
    log2 = LOG2(lambda *a: lines.append(a[2:]))
    callbacks.logger = ctypes.cast(log2, c_void_p)
    make = library.fmi2Instantiate
    make.restype = c_void_p
    made = make(
        c_char_p(b"x"), c_int(0), c_char_p(two.token.encode()),
        c_char_p(two.resources.as_uri().encode()), byref(callbacks), c_int(0), c_int(0),
    )
    assert made is None and len(lines) == 4


def test_calls_out_of_order_are_errors_that_end_the_run(fmu):
    cloth = fmu.instance()
    refused(cloth, cloth.step(0.0, 0.01), "DoStep", "Instantiated", "Step Mode")
    refused(cloth, cloth.call("ExitInitializationMode"), "ExitInitializationMode")
    refused(cloth, cloth.call("Terminate"), "Terminate")
    assert cloth.enter() == OK
    refused(cloth, cloth.call("EnterInitializationMode", *_times(fmu)), "Initialization Mode")
    assert cloth.enter() == OK
    refused(cloth, cloth.step(0.0, 0.01), "Initialization Mode")
    assert cloth.initialize() == OK
    refused(cloth, cloth.call("ExitInitializationMode"), "Step Mode")
    assert cloth.initialize() == OK
    assert cloth.call("Terminate") == OK
    # what was reached may still be read
    assert cloth.get("time") == 0.0
    refused(cloth, cloth.call("Terminate"), "Terminated")
    cloth.free()


def _times(fmu):
    if fmu.version == 2:
        return []
    return [c_bool(0), c_double(0), c_double(0), c_bool(0), c_double(0)]


def test_times_of_the_run_are_checked(fmu):
    cloth = fmu.instance()
    for how in [
        dict(start=math.nan), dict(start=math.inf), dict(stop=math.nan), dict(start=1.0, stop=1.0),
        dict(start=1.0, stop=0.5), dict(tolerance=math.nan), dict(tolerance=-1.0),
    ]:
        assert cloth.enter(**how) == ERROR, how
        assert cloth.call("Reset") == OK
    assert cloth.enter(start=-2.0, stop=3.0, tolerance=1e-4) == OK
    assert cloth.call("ExitInitializationMode") == OK
    assert cloth.get("time") == -2.0
    cloth.run(2, at=-2.0)
    cloth.free()


def test_steps_with_bad_arguments_are_errors(fmu):
    cloth = fmu.instance()
    for time, size, word in [
        (0.0, 0.0, "size 0"), (0.0, -0.01, "-0.01"), (0.0, math.nan, "NaN"), (0.0, math.inf, "inf"),
        (math.nan, 0.01, "NaN"), (0.5, 0.01, "0.5"), (1e-9, 0.01, "not the time"),
        (0.0, 0.2001, "stop time"),
    ]:
        assert cloth.initialize(stop=0.2) == OK
        refused(cloth, cloth.step(time, size), word)
    cloth.free()


def test_times_added_up_in_floating_point_are_accepted(fmu):
    cloth = fmu.instance()
    assert cloth.initialize(stop=0.1) == OK
    time = 0.0
    for _ in range(10):
        assert cloth.step(time, 0.01) == OK, cloth.logs
        time += 0.01
    assert time != 0.1 and abs(cloth.get("time") - 0.1) < 1e-12
    if fmu.version == 3:
        assert cloth.last.value == cloth.get("time")
    cloth.free()


def test_impossible_step_is_discarded_and_changes_nothing(fmu):
    cloth = fmu.instance(logging=True)
    assert cloth.initialize() == OK
    cloth.run(2)
    before = cloth.outputs()
    # a pin that must fly a kilometre in a millisecond
    assert cloth.put({"pin[1].displacement[2]": 1000.0}) == OK
    assert cloth.step(0.02, 0.001) == DISCARD
    level, category, message = cloth.logs[-1]
    assert level == DISCARD and category == "logStatusDiscard" and "no admissible state" in message
    assert cloth.outputs() == before
    if fmu.version == 3:
        assert cloth.last.value == 0.02
    else:
        value, ended = c_double(), c_int(7)
        assert cloth.call("GetRealStatus", c_int(2), byref(value)) == OK and value.value == 0.02
        assert cloth.call("GetBooleanStatus", c_int(3), byref(ended)) == OK and ended.value == 0
    assert cloth.put({"pin[1].displacement[2]": 0.0}) == OK
    cloth.run(3, first=2)
    after = cloth.outputs()
    cloth.free()
    other = fmu.instance()
    assert other.initialize() == OK
    other.run(5)
    assert other.outputs() == after
    other.free()


def test_sizes_must_agree_and_nothing_is_written_beyond(fmu3):
    cloth = fmu3.instance()
    assert cloth.initialize() == OK
    position = fmu3.variables["vertex.position"]
    count = int(np.prod(position.shape))
    for announced in (0, 1, count - 1, count + 1, 2**62):
        status, values = cloth.get_raw("Float64", [position.reference], announced, count + 8)
        assert list(values) == [0.0] * (count + 8)
        refused(cloth, status, str(count))
        assert cloth.initialize() == OK
    status, values = cloth.get_raw("Float64", [position.reference], count, count + 8)
    assert status == OK and list(values[count:]) == [0.0] * 8 and any(values[:count])
    refused(cloth, cloth.set_raw("Float64", [fmu3.variables["gravity[1]"].reference], [1.0, 2.0]))
    cloth.free()


def test_unknown_references_and_wrong_types_are_errors(fmu):
    cloth = fmu.instance()
    real, integer = ("Float64", "Int32") if fmu.version == 3 else ("Real", "Integer")
    for kind, reference, word in [
        (real, 10**6, "1000000"), (real, 2**32 - 1, "4294967295"),
        (real, fmu.variables["step.substeps"].reference, "step.substeps"),
        (integer, fmu.variables["energy.total"].reference, "energy.total"),
        ("Boolean", fmu.variables["wind[1]"].reference, "wind[1]"),
    ]:
        refused(cloth, cloth.get_raw(kind, [reference])[0], word)
        refused(cloth, cloth.set_raw(kind, [reference], [1]), word)
    cloth.free()


def test_null_and_misaligned_arrays_are_errors(fmu):
    cloth = fmu.instance()
    real = "GetFloat64" if fmu.version == 3 else "GetReal"
    refs, values = (c_uint32 * 2)(1, 2), (c_double * 3)()
    last = [c_size_t(2)] if fmu.version == 3 else []
    odd = c_void_p(ctypes.addressof(values) + 3)
    for arguments in [
        (None, c_size_t(2), values), (refs, c_size_t(2), None), (refs, c_size_t(2), odd),
        (refs, c_size_t(2**62), values),
    ]:
        refused(cloth, cloth.call(real, *arguments, *last))
    # nothing asked for: pointers are not looked at
    zero = [c_size_t(0)] if fmu.version == 3 else []
    assert cloth.call(real, None, c_size_t(0), None, *zero) == OK
    cloth.free()


def test_numbers_that_cannot_be_are_refused_and_nothing_is_set(fmu):
    cloth = fmu.instance()
    real = "Float64" if fmu.version == 3 else "Real"
    reference = lambda name: fmu.variables[name].reference
    for name, value in [
        ("wind[1]", math.nan), ("wind[1]", math.inf), ("gravity[2]", -math.inf),
        ("fabric.cotton_lawn.density", -1.0), ("fabric.cotton_lawn.density", 0.0),
        ("body.ball.contact.friction", -0.1), ("solver.newton.max_iterations", 0.0),
        ("solver.newton.max_iterations", 1e9),
    ]:
        pair = [reference("wind[2]"), reference(name)]
        refused(cloth, cloth.set_raw(real, pair, [5.0, value]), name)
        assert cloth.initialize() == OK
        assert cloth.get("wind[2]") == 0.0
        assert cloth.call("Reset") == OK
    # consistent one by one, but not together: told when the simulation is made
    assert cloth.put({"fabric.cotton_lawn.membrane.coupling": 1000.0}) == OK
    assert cloth.enter() == OK
    refused(cloth, cloth.call("ExitInitializationMode"), "cotton lawn", "coupling")
    assert cloth.put({f"body.ball.quaternion[{k}]": 0.0 for k in range(1, 5)}) == OK
    assert cloth.enter() == OK
    refused(cloth, cloth.call("ExitInitializationMode"), "quaternion")
    cloth.free()


def test_variability_decides_when_a_variable_may_be_set(fmu):
    cloth = fmu.instance()
    fixed, tunable = "fabric.cotton_lawn.bending.warp", "solver.newton.velocity_tolerance"
    assert cloth.put({fixed: 1e-6, tunable: 1e-4, "wind[1]": 0.5}) == OK
    assert cloth.enter() == OK
    assert cloth.put({fixed: 2e-6, tunable: 2e-4, "wind[1]": 0.25, "drape": False}) == OK
    assert cloth.call("ExitInitializationMode") == OK
    assert cloth.get(fixed, tunable, "wind[1]") == [2e-6, 2e-4, 0.25]
    assert cloth.put({tunable: 1e-3, "wind[1]": 0.0}) == OK
    cloth.run(1)
    refused(cloth, cloth.put({fixed: 1e-6}), fixed, "Step Mode")
    assert cloth.initialize() == OK
    refused(cloth, cloth.put({"drape": True}), "drape")
    for name in ("energy.total", "time", "step.substeps"):
        refused(cloth, cloth.put({name: 1}), name)
    cloth.free()


def test_sizes_are_set_in_configuration_mode_only_and_keep_their_value(fmu3):
    cloth = fmu3.instance()
    count = cloth.get("vertex.count")
    assert count == fmu3.variables["vertex.position"].shape[0]
    refused(cloth, cloth.put({"vertex.count": count}), "vertex.count", "Configuration Mode")
    assert cloth.call("EnterConfigurationMode") == OK
    assert cloth.put({"vertex.count": count}) == OK
    assert cloth.call("ExitConfigurationMode") == OK
    assert cloth.call("EnterConfigurationMode") == OK
    refused(cloth, cloth.put({"vertex.count": count + 1}), "vertex.count", str(count))
    assert cloth.call("EnterConfigurationMode") == OK
    refused(cloth, cloth.put({"wind[1]": 1.0}), "wind[1]")
    assert cloth.initialize() == OK
    refused(cloth, cloth.call("EnterConfigurationMode"), "Instantiated")
    refused(cloth, cloth.call("ExitConfigurationMode"), "Configuration Mode")
    cloth.free()


UNSUPPORTED3 = """EnterEventMode EnterStepMode EvaluateDiscreteStates UpdateDiscreteStates GetClock
SetClock GetIntervalDecimal GetIntervalFraction GetShiftDecimal GetShiftFraction SetIntervalDecimal
SetIntervalFraction SetShiftDecimal SetShiftFraction ActivateModelPartition EnterContinuousTimeMode
CompletedIntegratorStep SetTime SetContinuousStates GetContinuousStateDerivatives GetEventIndicators
GetContinuousStates GetNominalsOfContinuousStates GetNumberOfEventIndicators
GetNumberOfContinuousStates GetOutputDerivatives GetDirectionalDerivative GetAdjointDerivative
GetNumberOfVariableDependencies GetVariableDependencies"""
UNSUPPORTED2 = """GetDirectionalDerivative SetRealInputDerivatives GetRealOutputDerivatives CancelStep
GetStatus GetIntegerStatus GetStringStatus EnterEventMode NewDiscreteStates EnterContinuousTimeMode
CompletedIntegratorStep SetTime SetContinuousStates GetDerivatives GetEventIndicators
GetContinuousStates GetNominalsOfContinuousStates"""


def test_what_is_not_offered_is_an_error_with_a_line(fmu):
    cloth = fmu.instance()
    for name in (UNSUPPORTED3 if fmu.version == 3 else UNSUPPORTED2).split():
        # no pointer of these calls is looked at
        refused(cloth, cloth.call(name, *[None] * 9), name)
    if fmu.version == 3:
        for kind in "Float32 Int8 UInt8 Int16 UInt16 Int64 String".split():
            for what in ("Get", "Set"):
                assert cloth.call(what + kind, None, c_size_t(0), None, c_size_t(0)) == OK
                status = cloth.call(what + kind, None, c_size_t(1), None, c_size_t(1))
                refused(cloth, status, kind)
        assert cloth.call("SetBinary", None, c_size_t(0), None, None, c_size_t(0)) == OK
        refused(cloth, cloth.call("SetBinary", None, c_size_t(1), None, None, c_size_t(1)))
    else:
        for what in ("GetString", "SetString"):
            assert cloth.call(what, None, c_size_t(0), None) == OK
            refused(cloth, cloth.call(what, None, c_size_t(1), None), "String")
    cloth.free()


def test_arrays_and_bytes_agree_with_each_other(fmu3):
    cloth = fmu3.instance()
    assert cloth.initialize() == OK
    cloth.run(3)
    x, v, n = cloth.get("vertex.position", "vertex.velocity", "vertex.normal")
    triangles = cloth.get("triangle.vertices")
    assert x.shape == v.shape == n.shape == (cloth.get("vertex.count"), 3)
    assert triangles.shape == (cloth.get("triangle.count"), 3) and triangles.max() == len(x) - 1
    assert np.allclose(np.linalg.norm(n, axis=1), 1)
    assert [cloth.get(f"extent.min[{k}]") for k in (1, 2, 3)] == x.min(axis=0).tolist()
    assert [cloth.get(f"extent.max[{k}]") for k in (1, 2, 3)] == x.max(axis=0).tolist()
    rim = cloth.get("curve.rim.position")
    assert rim.shape == (cloth.get("curve.rim.count"), 3)
    steps = np.linalg.norm(np.diff(rim, axis=0), axis=1)
    assert math.isclose(cloth.get("curve.rim.length"), steps.sum())
    parts = "kinetic gravity membrane bending seam contact".split()
    total = sum(cloth.get(f"energy.{p}") for p in parts)
    assert math.isclose(cloth.get("energy.total"), total)
    assert cloth.snapshot().startswith(b"TOILESNP")
    cloth.free()


def test_snapshot_is_what_the_c_interface_restores(fmu3):
    toile = pytest.importorskip("toile")
    cloth = fmu3.instance()
    assert cloth.initialize() == OK
    cloth.run(3)
    with toile.Sim.from_file(fmu3.resources / "scene.json") as sim:
        sim.restore(cloth.snapshot())
        assert np.array_equal(sim.positions, cloth.get("vertex.position"))
    cloth.free()


def test_log_speaks_of_errors_always_and_of_the_rest_when_asked(fmu):
    quiet = fmu.instance(logging=False)
    assert quiet.initialize() == OK
    quiet.run(3)
    assert quiet.put({"pin[1].displacement[2]": 1000.0}) == OK
    assert quiet.step(0.03, 0.001) == DISCARD
    assert quiet.logs == []
    assert quiet.step(9.0, 0.1) == ERROR
    assert len(quiet.logs) == 1
    names = (c_char_p * 1)(b"logStatusDiscard")
    assert quiet.call("Reset") == OK
    flag = c_bool(True) if fmu.version == 3 else c_int(1)
    assert quiet.call("SetDebugLogging", flag, c_size_t(1), names) == OK
    assert quiet.initialize() == OK
    assert quiet.put({"pin[1].displacement[2]": 1000.0}) == OK
    assert quiet.step(0.0, 0.001) == DISCARD
    assert [c for _, c, _ in quiet.logs[1:]] == ["logStatusDiscard"]
    names = (c_char_p * 1)(b"logNoise")
    assert quiet.call("SetDebugLogging", flag, c_size_t(1), names) == ERROR
    assert "logNoise" in quiet.logs[-1][2]
    listed = {c.get("name") for c in fmu.root.find("LogCategories")}
    assert {c for _, c, _ in quiet.logs} <= listed
    quiet.free()
    mute = fmu.instance(callback=False)
    assert mute.step(0.0, 0.01) == ERROR
    mute.free()


def test_pointers_of_nobody_are_errors(fmu):
    cloth = fmu.instance()
    kept = cloth.pointer
    cloth.free()
    for pointer in (kept, None, 1, 2**63 + 5, id(cloth)):
        cloth.pointer = pointer
        assert cloth.call("Reset") == ERROR and cloth.step(0.0, 0.01) == ERROR
        assert cloth.get_raw("Float64" if fmu.version == 3 else "Real", [0])[0] == ERROR
        cloth.free()
    if fmu.version == 2:
        made = fmu.instance()
        assert made.initialize() == OK
        wrong = c_double()
        assert made.call("GetRealStatus", c_int(0), byref(wrong)) == ERROR
        made.free()
