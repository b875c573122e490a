# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension's zip is built, validated, installed into a clean profile, enabled, used, and removed without a
trace.

Blender runs in a Python that has the bpy wheel and what it requires, and nothing else of the project's: neither Warp
nor OpenEXR, so that both must come out of the zip.
"""

import compileall
import json
import os
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

from hair_addon.blender.settings import asset_libraries
from hair_addon.blender.ui import operators
from tools import build_extension, compile_kernels, manual_pages

pytestmark = pytest.mark.farm  # each test starts Blender or reads the extension that others start

WALK = Path(__file__).with_name("support") / "walk" / "walk_installed.py"
ROOT = build_extension.ROOT


@pytest.fixture(scope="session")
def extension():
    """Return the extension's zip of this platform, validated by Blender's own tool.

    It is built from a checkout that has run, so that there is bytecode to leave out. A build takes half a second once
    wheels are there.
    """
    compileall.compile_dir(build_extension.ROOT / "hair_addon" / "core", quiet=1)
    return build_extension.build(compile_kernels.this_platform(), "tests")


@pytest.fixture(scope="session")
def bare_python():
    """Return a Python with bpy and its requirements, in the versions of requirements.lock, reused between runs."""
    folder = ROOT / "build" / "bare-venv"
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    uv = [sys.executable, "-m", "uv", "--quiet"]
    if not python.exists():
        subprocess.run([*uv, "venv", "--clear", "--no-project", "--python", sys.executable, folder], check=True)
    bpy = re.search(r"^bpy==\S+", (ROOT / "requirements.lock").read_text(encoding="utf-8"), re.MULTILINE)[0]
    pins = ["--require-hashes", "--constraint", ROOT / "requirements.lock"]
    subprocess.run([*uv, "pip", "install", "--python", python, *pins, bpy], check=True)
    return python


@pytest.fixture(scope="session")
def walk(extension, bare_python, tmp_path_factory):
    """Return a function that uses the installed extension in one way, each in a Blender of its own, in one profile."""
    home = tmp_path_factory.mktemp("home")
    profile = tmp_path_factory.mktemp("profile")
    environment = {"PATH": os.environ["PATH"], "HOME": str(home), "BLENDER_USER_RESOURCES": str(profile)}
    environment |= {name: os.environ[name] for name in ("SYSTEMROOT", "LD_LIBRARY_PATH") if name in os.environ}

    def run(verb):
        command = [bare_python, "-I", WALK, verb, extension, tmp_path_factory.mktemp("walk")]
        done = subprocess.run(command, cwd=home, env=environment, capture_output=True, text=True, timeout=1200)
        assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"
        return json.loads(done.stdout.splitlines()[-1])

    run.profile, run.home = profile, home
    run.used = run("install")
    return run


@pytest.fixture(scope="session")
def used(walk):
    """Return what operators and scripts made, in the Blender that installed the extension."""
    return walk.used


def test_zip_holds_what_blender_runs_and_nothing_else(extension):
    with zipfile.ZipFile(extension) as archive:
        names = archive.namelist()
        manifest = tomllib.loads(archive.read("blender_manifest.toml").decode())
    platform = compile_kernels.this_platform()
    assert {name.split("/")[0] for name in names} == {
        "__init__.py", "LICENSE", "blender_manifest.toml", "hair_addon", "kernels", "manual", "shaders", "wheels",
    }  # fmt: skip
    assert not [name for name in names if "__pycache__" in name or "/." in name]
    blends = {name for name in names if name.endswith(".blend")}
    grooms = {f"hair_addon/grooms/{file.name}" for file in asset_libraries.SHIPPED.glob("*.blend")}
    assert grooms and blends == {"hair_addon/blender/data/strands/follow_nodes.blend"} | grooms
    # Warp compiles kernels from their source, and the shaders are read as files.
    for folder in ("hair_addon", "shaders"):
        sources = [path for path in (ROOT / folder).rglob("*") if path.is_file() and path.suffix != ".pyc"]
        assert {path.relative_to(ROOT).as_posix() for path in sources} <= set(names)
    # The manual as a browser shows it.
    pages = {f"manual/{path.stem}.html" for path in manual_pages.SOURCE.glob("*.md")}
    pictures = {f"manual/{path.name}" for path in manual_pages.SOURCE.iterdir() if path.suffix in {".png", ".jpg"}}
    assert {name for name in names if name.startswith("manual/") and not name.endswith("/")} == pages | pictures
    assert manifest["platforms"] == [platform]
    assert {Path(wheel).name for wheel in manifest["wheels"]} == {
        wheel.name for wheel in build_extension.wheels_of(platform)
    }
    assert {name for name in names if name.endswith(".whl")} == {
        wheel.removeprefix("./") for wheel in manifest["wheels"]
    }


def test_bare_python_has_neither_warp_nor_openexr(bare_python):
    """Bare Python has neither Warp nor OpenEXR; otherwise the next tests would pass without the zip's wheels."""
    for name in ("warp", "OpenEXR"):
        found = subprocess.run([bare_python, "-I", "-c", f"import {name}"], capture_output=True, text=True)
        assert "ModuleNotFoundError" in found.stderr


def test_installs_and_enables(walk):
    assert walk.used["installed"] == {"result": ["FINISHED"], "enabled": True}


def test_installed_operators_run(walk, used):
    made = used["operators"]
    assert made["results"] == [["FINISHED"]] * 6
    assert made["grooms"] == sorted(file.name for file in asset_libraries.SHIPPED.glob("*.blend"))
    assert made["curves"] == {"Guides": 30, "Hair": 300}
    assert made["finite"]
    names = ("m", "n", "n_trt", "n_res", "dual", "n_g", "n_g_trt")
    assert made["tables"] == sorted(f"{name}.exr" for name in names)
    assert made["cached"] == ["n.exr"]  # what the picture was drawn with
    width, height, contrast = made["picture"]
    assert (width, height) == (160, 120) and contrast > 0.01
    assert all(Path(wheel).is_relative_to(walk.profile) for wheel in made["wheels"])


def test_code_of_readme_and_docstrings_runs_in_the_extension(used):
    ran = used["scripts"]
    assert ran["failed"] == []
    assert (ran["blocks"], ran["examples"] > 60) == (3, True)


def test_enabling_and_disabling_twice_leaves_nothing_behind(walk):
    before, enabled, disabled, enabled_again, disabled_again = walk("twice")["states"]
    assert enabled["operators"] == sorted(operator.bl_idname.split(".")[1] for operator in operators.CLASSES)
    assert enabled["handlers"] != before["handlers"]
    # Blender keeps the modules of a disabled add-on; they must not multiply.
    modules = [state.pop("modules") for state in (before, enabled, disabled, enabled_again, disabled_again)]
    assert modules[1] == modules[3]
    assert disabled == before
    assert disabled_again == before
    for state in (enabled, enabled_again):
        state["handlers"] = [re.sub(" at 0x[0-9a-f]+", "", handler) for handler in state["handlers"]]
        state["draw handlers"] = len(state["draw handlers"])
    assert enabled_again == enabled


@pytest.mark.usefixtures("used")
def test_nothing_is_written_outside_the_profile(walk):
    """Nothing is written outside the profile, except Warp's kernel cache of a user and Blender's own thumbnails."""
    written = {path.relative_to(walk.home).parts[:2] for path in walk.home.rglob("*") if path.is_file()}
    assert written <= {(".cache", "warp"), (".cache", "thumbnails")}
    package = walk.profile / "extensions" / "user_default" / "vellus"
    with zipfile.ZipFile(build_extension.zip_path(compile_kernels.this_platform())) as archive:
        shipped = set(archive.namelist())
    present = {path.relative_to(package).as_posix() for path in package.rglob("*") if path.is_file()}
    assert {name for name in present if "__pycache__" not in name} == shipped
