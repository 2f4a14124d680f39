"""Puts the library into the package: `pip install ./python` from the source tree is all it takes.

The library is the file that `TOILE_LIBRARY` names, else what `cargo build --release` makes of the
source tree around this folder. An editable install copies nothing: it finds the tree's own build.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py
from setuptools.errors import ExecError, FileError

try:
    from setuptools.command.bdist_wheel import bdist_wheel
except ImportError:
    from wheel.bdist_wheel import bdist_wheel

TREE = Path(__file__).resolve().parents[1]
NAME = {"win32": "toile.dll", "darwin": "libtoile.dylib"}.get(sys.platform, "libtoile.so")


def library():
    """The library to carry, built if it has to be."""
    chosen = os.environ.get("TOILE_LIBRARY")
    if chosen:
        path = Path(chosen)
        if not path.is_file():
            raise FileError(f"TOILE_LIBRARY = {chosen} is not a file")
        return path
    if not (TREE / "Cargo.toml").is_file():
        raise FileError(f"{TREE} is not the source tree of toile: name the library in TOILE_LIBRARY")
    target = Path(os.environ.get("CARGO_TARGET_DIR") or TREE / "target")
    command = ["cargo", "build", "--release", "--lib", "--locked", "--target-dir", str(target)]
    try:
        subprocess.run(command, cwd=TREE, check=True)
    except FileNotFoundError as error:
        raise ExecError("building the library needs Rust: https://rustup.rs") from error
    except subprocess.CalledProcessError as error:
        raise ExecError(f"{' '.join(command)} ended with {error.returncode}") from error
    return target / "release" / NAME


class BuildWithLibrary(build_py):
    """Copies the library beside the modules."""

    def run(self):
        if self.editable_mode:
            super().run()
            return
        # what an earlier build left there would go into the wheel
        package = Path(self.build_lib) / "toile"
        shutil.rmtree(package, ignore_errors=True)
        super().run()
        shutil.copy2(library(), package / NAME)


class PlatformWheel(bdist_wheel):
    """A wheel for every Python 3 on one platform."""

    def finalize_options(self):
        super().finalize_options()
        self.root_is_pure = False

    def get_tag(self):
        return ("py3", "none", super().get_tag()[2])


setup(cmdclass={"build_py": BuildWithLibrary, "bdist_wheel": PlatformWheel})
