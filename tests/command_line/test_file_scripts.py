# SPDX-License-Identifier: GPL-3.0-or-later
"""An untrusted .blend does not run scripts unless the user allows it."""

import bpy
import pytest

from tests.support.commands import run, run_here

VERBS = {
    "groom": lambda blend, out: ("groom", blend, "--guides", 5, "--strands", 10, "--out", out / "a.npz"),
    "info": lambda blend, out: ("info", blend),
    "render": lambda blend, out: ("render", blend, "--width", 16, "--height", 16, "--out", out / "a.png"),
}


@pytest.fixture
def stranger(lit, tmp_path):
    """Return a .blend with a script that registers itself and with a driver, each of which writes a file beside it."""
    script = bpy.data.texts.new("script.py")
    script.use_module = True
    script.write(f"open({str(tmp_path / 'from_script')!r}, 'w').close()\n")
    driver = bpy.data.objects["Sphere"].driver_add("location", 0).driver
    driver.expression = f"0.0 * bool(open({str(tmp_path / 'from_driver')!r}, 'w').write('x'))"
    blend = tmp_path / "stranger.blend"
    bpy.context.preferences.filepaths.use_scripts_auto_execute = False
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    for name in ("from_script", "from_driver"):
        (tmp_path / name).unlink(missing_ok=True)
    return blend


def written(folder):
    return {path.name for path in folder.iterdir()} & {"from_script", "from_driver"}


@pytest.mark.farm
@pytest.mark.parametrize(("verb", "run"), [*((verb, run_here) for verb in VERBS), ("info", run)])
def test_nothing_of_its_own_runs(stranger, tmp_path, verb, run):
    """No script or driver of a file runs in a separate process, where no test has given permission."""
    ended = run(*VERBS[verb](stranger, tmp_path))
    assert ended.status == 0, ended.errors
    assert written(tmp_path) == set()
    assert "scripts or drivers that were not run" in ended.errors and "--enable-scripts" in ended.errors
    assert len(ended.errors.splitlines()) == 1


@pytest.mark.farm
def test_all_of_it_runs_when_the_user_asks(stranger, tmp_path):
    """All scripts and drivers run in a new process if the user allows it, which Blender remembers per process."""
    ended = run(*VERBS["groom"](stranger, tmp_path), "--enable-scripts")
    assert (ended.status, ended.errors) == (0, "")
    assert written(tmp_path) == {"from_script", "from_driver"}


def test_quiet_prints_errors_only(stranger, tmp_path):
    ended = run_here(*VERBS["groom"](stranger, tmp_path), "--quiet")
    assert (ended.status, ended.out, ended.errors) == (0, "", "")
    assert written(tmp_path) == set()
