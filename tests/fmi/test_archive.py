"""What is in an archive, and what is said about it."""

import json
import subprocess
import zipfile

import pytest

import scenes
from conftest import SCENES, pack
from master import Fmu

lxml = pytest.importorskip("lxml.etree")
fmpy = pytest.importorskip("fmpy")
validation = pytest.importorskip("fmpy.validation")


def members(path):
    with zipfile.ZipFile(path) as z:
        return {i.filename: i for i in z.infolist()}


def test_members_stand_where_fmi_wants_them(archives):
    for (scene, version), path in archives.items():
        found = members(path)
        binary = {3: "binaries/x86_64-linux/cloth.so", 2: "binaries/linux64/cloth.so"}[version]
        picture = {3: "terminalsAndIcons/icon.png", 2: "model.png"}[version]
        expected = {
            "modelDescription.xml", binary, picture, "documentation/index.html",
            "documentation/licenses/license.txt", "resources/scene.json", "resources/fmu.json",
        }
        assert expected <= set(found), found.keys()
        for name, info in found.items():
            assert info.compress_type in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
            assert not name.startswith("/") and ".." not in name and "\\" not in name


def test_picture_page_and_licences_have_content(archives):
    for path in archives.values():
        with zipfile.ZipFile(path) as z:
            names = z.namelist()
            picture = next(n for n in names if n.endswith(".png"))
            assert z.read(picture).startswith(b"\x89PNG\r\n")
            page = z.read("documentation/index.html").decode()
            assert "providesDirectionalDerivatives" in page and "energy.kinetic" in page
            licences = z.read("documentation/licenses/license.txt").decode()
            for crate in ("nalgebra", "faer", "rayon", "zip", "quick-xml"):
                assert f"\n{crate} " in licences


def test_fmpy_finds_no_problem(archives):
    for key, path in archives.items():
        assert validation.validate_fmu(str(path)) == [], key


def test_terminals_are_valid_and_name_variables(archives, unpacked):
    schema = fmpy.__path__[0] + "/schema/fmi3/fmi3TerminalsAndIcons.xsd"
    schema = lxml.XMLSchema(lxml.parse(schema))
    for scene in SCENES:
        fmu = unpacked[scene, 3]
        page = lxml.parse(str(fmu.folder / "terminalsAndIcons/terminalsAndIcons.xml"))
        assert schema.validate(page), schema.error_log
        named = [m.get("variableName") for m in page.iter("TerminalMemberVariable")]
        assert named and set(named) <= set(fmu.variables)


def test_same_input_gives_same_bytes(archives, folder):
    for version in (2, 3):
        again = folder / f"again{version}" / "cloth.fmu"
        again.parent.mkdir()
        pack(scenes.hung(), again, "--fmi", version, "--threads", "2")
        first = archives["hung", version].read_bytes()
        # the number of threads is a parameter of the FMU: give none
        pack(scenes.hung(), again, "--fmi", version)
        assert again.read_bytes() == first


def test_another_scene_has_another_token(unpacked):
    tokens = {fmu.token for fmu in unpacked.values()}
    assert len(tokens) == len(unpacked)


def test_binary_needs_system_libraries_only(unpacked):
    told = subprocess.run(
        ["readelf", "-d", str(unpacked["hung", 3].binary)], capture_output=True, text=True
    ).stdout
    needed = [l.split("[")[1].rstrip("]") for l in told.splitlines() if "NEEDED" in l]
    allowed = ("libc.so", "libm.so", "libgcc_s.so", "ld-linux", "libpthread", "libdl")
    assert needed and all(n.startswith(allowed) for n in needed), needed


def test_every_function_of_the_official_headers_is_exported(unpacked):
    told = subprocess.run(
        ["nm", "-D", "--defined-only", str(unpacked["hung", 3].binary)],
        capture_output=True, text=True,
    ).stdout
    exported = {l.split()[-1] for l in told.splitlines()}
    headers = fmpy.__path__[0] + "/c-code/"
    for version, count in ((3, 75), (2, 44)):
        text = open(f"{headers}fmi{version}Functions.h").read()
        prefix = f"FMI{version}_Export"
        words = [l.split()[-1].rstrip(";") for l in text.splitlines() if l.strip().startswith(prefix)]
        names = {w for w in words if w.startswith(f"fmi{version}")}
        assert len(names) == count
        assert {n for n in exported if n.startswith(f"fmi{version}")} == names


def test_capabilities_are_the_ones_that_hold(unpacked):
    about = unpacked["hung", 3].root.find("CoSimulation").attrib
    true = {k for k, v in about.items() if v == "true"}
    assert true == {
        "canGetAndSetFMUState", "canSerializeFMUState", "canHandleVariableCommunicationStepSize",
    }
    about = unpacked["hung", 2].root.find("CoSimulation").attrib
    true = {k for k, v in about.items() if v == "true"}
    assert true == {
        "canGetAndSetFMUstate", "canSerializeFMUstate", "canHandleVariableCommunicationStepSize",
        "canNotUseMemoryManagementFunctions",
    }


def test_variables_have_starts_units_and_unique_references(any_fmu):
    variables = any_fmu.variables
    assert len({v.reference for v in variables.values()}) == len(variables)
    assert [n for n, v in variables.items() if v.attributes.get("causality") == "independent"] == [
        "time"
    ]
    units = {u.get("name") for u in any_fmu.root.find("UnitDefinitions")}
    for name, v in variables.items():
        settable = v.attributes["causality"] in ("input", "parameter", "structuralParameter")
        assert (v.attributes.get("start") is not None) == settable, name
        assert v.attributes.get("unit", "s") in units, name
    listed = any_fmu.root.find("LogCategories")
    assert "logStatusError" in {c.get("name") for c in listed}


def test_structure_lists_every_output_once(any_fmu):
    structure = any_fmu.root.find("ModelStructure")
    variables = list(any_fmu.root.find("ModelVariables"))
    outputs = [v for v in variables if v.get("causality") == "output"]
    for name in ("Output", "InitialUnknown"):
        if any_fmu.version == 3:
            listed = [int(e.get("valueReference")) for e in structure.findall(name)]
            expected = [int(v.get("valueReference")) for v in outputs]
        else:
            listed = [int(e.get("index")) for e in structure.find(name + "s")]
            expected = [i + 1 for i, v in enumerate(variables) if v in outputs]
        assert listed == expected


def test_names_that_hosts_rely_on(any_fmu):
    assert "energy.yarn" in any_fmu.variables
    name = any_fmu.root.get("modelName")
    yarns = "Woven" in name or "Mixed" in name
    assert ("yarn.node.count" in any_fmu.variables) == yarns
    assert ("yarn.node.position" in any_fmu.variables) == (yarns and any_fmu.version == 3)
    if "Woven" in name:
        return
    body = "_2nd_capsule__turned" if "Moving" in name else "ball"
    for name in (
        f"body.{body}.position[1]", f"body.{body}.quaternion[4]", f"body.{body}.velocity[3]",
        f"body.{body}.force[2]", f"body.{body}.torque[3]", "gravity[2]", "wind[1]", "pressure",
        "pin[1].displacement[2]", "pin[1].reaction[3]", "fabric.cotton_lawn.bending.warp",
        "energy.total", "strain.max", "gap.min", "probe.middle.position[2]", "curve.rim.length",
        "solver.newton.max_iterations", "step.newton_iterations", "drape",
    ):
        assert name in any_fmu.variables, name
    arrays = {"vertex.position", "vertex.velocity", "triangle.vertices", "curve.rim.position"}
    assert (arrays <= set(any_fmu.variables)) == (any_fmu.version == 3)


def test_scene_with_files_is_packed_whole(folder):
    place = folder / "files"
    (place / "parts").mkdir(parents=True)
    cube = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"
    cube += "f 1 3 2\nf 1 4 3\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\nf 2 3 7\nf 2 7 6\n"
    cube += "f 3 4 8\nf 3 8 7\nf 4 1 5\nf 4 5 8\n"
    (place / "parts" / "cube.obj").write_text(cube)
    (place / "parts" / "lawn.json").write_text(json.dumps(scenes.SHEET["fabrics"][0]))
    garment = {**scenes.SHEET, "fabrics": ["lawn.json"]}
    (place / "parts" / "sheet.json").write_text(json.dumps(garment))
    body = {"name": "cube", "shape": "mesh", "file": "parts/cube.obj", "scale": 0.1}
    scene = scenes.hung(garment={"file": "parts/sheet.json"}, bodies=[body])
    (place / "scene.json").write_text(json.dumps(scene))
    pack(place / "scene.json", place / "cloth.fmu", "--set", "gravity.y=-3", "--set", "run.dt=0.02")
    fmu = Fmu(place / "cloth.fmu", place / "unpacked")
    # nothing outside of the archive is needed
    (place / "parts").rename(place / "gone")
    (place / "scene.json").unlink()
    cloth = fmu.instance()
    assert cloth.initialize() == 0, cloth.logs
    assert cloth.get("gravity[2]") == -3.0
    assert fmu.root.find("DefaultExperiment").get("stepSize") == "0.02"
    cloth.run(2, 0.02)
    cloth.free()


def test_bare_garment_is_sewn_and_falls(folder):
    """Two sheets, one seam, nothing else: packed with the seam closed; then only gravity acts."""
    out = folder / "bare" / "pair.fmu"
    out.parent.mkdir()
    left = scenes.SHEET["panels"][0]
    place = {"translation": [0.62, 0.5, 0], "rotation_deg": [-90, 0, 0]}
    pair = {
        **scenes.SHEET,
        "edge_length": 0.15,
        "panels": [left, {**left, "name": "right", "placement": place}],
        "seams": [{"a": ["sheet", 1], "b": ["right", 3]}],
    }
    done = pack(pair, out)
    assert "draped without gravity" in done.stderr
    assert validation.validate_fmu(str(out)) == []
    fmu = Fmu(out, out.parent / "unpacked")
    cloth = fmu.instance()
    assert cloth.put({"air.drag": 0.0, "air.tangential": 0.0}) == 0
    assert cloth.initialize() == 0
    assert cloth.get("seam.gap.max") < 1e-3
    before = cloth.get("centre_of_mass[2]")
    cloth.run(10)
    # backward Euler with its own substeps: between g h^2 n^2 / 2 and g h^2 n (n + 1) / 2
    fallen = before - cloth.get("centre_of_mass[2]")
    assert 0.049 <= fallen <= 0.054, fallen
    cloth.free()


def test_draped_scene_begins_at_rest(folder):
    out = folder / "draped" / "cloth.fmu"
    out.parent.mkdir()
    pack(scenes.hung(run={"drape": True}), out)
    fmu = Fmu(out, out.parent / "unpacked")
    cloth = fmu.instance()
    assert cloth.initialize() == 0
    before = cloth.get("probe.middle.position[2]")
    assert 0.4 < before < 0.49
    cloth.run(5)
    assert abs(cloth.get("probe.middle.position[2]") - before) < 1e-4
    # the weight of the sheet hangs on its pins
    held = sum(cloth.get("pin[1].reaction[2]", "pin[2].reaction[2]"))
    assert abs(held + 0.36 * 0.1 * 9.81) < 1e-3, held
    cloth.free()


def test_archives_of_two_platforms_are_merged(archives, folder, unpacked):
    place = folder / "merge"
    (place / "a").mkdir(parents=True)
    (place / "b").mkdir()
    other = place / "other.so"
    other.write_bytes(unpacked["hung", 3].binary.read_bytes() + b"other")
    pack(scenes.hung(), place / "a" / "cloth.fmu", "--library", f"aarch64-linux={other}")
    pack(scenes.hung(), place / "b" / "cloth.fmu", "--merge", place / "a" / "cloth.fmu")
    binaries = [n for n in members(place / "b" / "cloth.fmu") if n.startswith("binaries/")]
    assert binaries == ["binaries/aarch64-linux/cloth.so", "binaries/x86_64-linux/cloth.so"]
    assert Fmu(place / "b" / "cloth.fmu", place / "u").token == unpacked["hung", 3].token


def test_what_cannot_be_packed_is_refused_with_its_reason(archives, folder):
    place = folder / "refused"
    place.mkdir()
    (place / "text.so").write_text("no library")
    (place / "bytes.fmu").write_bytes(b"PK\x03\x04" + bytes(100))
    truncated = archives["hung", 3].read_bytes()[:-2000]
    (place / "short.fmu").write_bytes(truncated)
    cases = [
        (["--library", f"x86_64-linux={place}/text.so"], "not one of toile's"),
        (["--library", f"vax-linux={place}/text.so"], "vax-linux"),
        (["--library", "x86_64-linux=/no/such.so"], "/no/such.so"),
        (["--merge", place / "bytes.fmu"], "bytes.fmu"),
        (["--merge", place / "short.fmu"], "short.fmu"),
        (["--merge", archives["moving", 3]], "another scene"),
        (["--merge", archives["hung", 3]], "no binary that is not here"),
        (["--set", "solver.unknown=1"], "solver.unknown"),
        (["--edge-length=-1"], "-1"),
    ]
    out = place / "cloth.fmu"
    for arguments, why in cases:
        done = pack(scenes.hung(), out, *arguments, check=False)
        assert done.returncode == 1 and why in done.stderr, (arguments, done.stderr)
        assert not out.exists()
    done = pack(place / "none.json", out, check=False)
    assert done.returncode == 1 and "none.json" in done.stderr
