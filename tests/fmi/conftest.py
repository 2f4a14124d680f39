"""Archives for the tests, made once by the program that was just built."""

import json
import os
import subprocess
from pathlib import Path

import pytest

import scenes
from master import Fmu

SCENES = {
    "hung": scenes.hung(),
    "moving": scenes.moving(),
    "woven": scenes.woven(),
    "mixed": scenes.mixed(),
}
PROGRAM = os.environ["TOILE_PROGRAM"]


def pack(scene, out, *arguments, check=True):
    """Runs `toile fmu` on a scene (or a file); what it printed."""
    out = Path(out)
    if isinstance(scene, dict):
        file = out.with_suffix(".json")
        file.write_text(json.dumps(scene))
        scene = file
    command = [PROGRAM, "fmu", str(scene), "-o", str(out), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    if check:
        assert done.returncode == 0, done.stderr
    return done


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("fmi")


@pytest.fixture(scope="session")
def archives(folder):
    """Paths by (scene, version)."""
    made = {}
    for name, scene in SCENES.items():
        for version in (2, 3):
            # the file's name decides the model's: one folder each
            out = folder / f"{name}{version}" / "cloth.fmu"
            out.parent.mkdir()
            pack(scene, out, "--fmi", version)
            made[name, version] = out
    return made


@pytest.fixture(scope="session")
def unpacked(archives, folder):
    return {
        key: Fmu(path, folder / f"{key[0]}{key[1]}" / "unpacked") for key, path in archives.items()
    }


@pytest.fixture(params=[3, 2], ids=["fmi3", "fmi2"])
def fmu(request, unpacked):
    """The hung sheet."""
    return unpacked["hung", request.param]


@pytest.fixture
def fmu3(unpacked):
    return unpacked["hung", 3]


@pytest.fixture(params=[(name, version) for name in SCENES for version in (3, 2)], ids=str)
def any_fmu(request, unpacked):
    return unpacked[request.param]
