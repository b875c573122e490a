# SPDX-License-Identifier: GPL-3.0-or-later
"""blender --command vellus: the installed extension's command line, in a Blender without a window."""

import json
import re

import bpy
import numpy as np
import pytest

from tests.support.commands import HEAD, load, run

pytestmark = pytest.mark.desktop

SMALL = ("--guides", 40, "--strands", 300, "--seed", 5)


@pytest.fixture(scope="module")
def vellus(desktop, extension, tmp_path_factory):
    """Return a function that calls blender --command vellus in a profile with the extension; `.folder` is visible to
    both.
    """
    profile = tmp_path_factory.mktemp("profile")
    installing = ("--command", "extension", "install-file", "--repo", "user_default", "--enable")
    installed = desktop.command(*installing, extension, profile=profile)
    assert installed.returncode == 0, installed.stdout + installed.stderr

    def call(*arguments):
        return desktop.command("--command", "vellus", *arguments, profile=profile)

    call.folder = profile
    return call


def results(done):
    """Return the lines of JSON, as Blender may print lines before the command begins."""
    return [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]


def test_it_makes_the_arrays_that_python_does(vellus, tmp_path):
    """The installed command makes the same arrays as Python, up to rounding, on another Python and NumPy."""
    out = vellus.folder / "head.npz"
    done = vellus("groom", HEAD, *SMALL, "--out", out, "--json")
    assert done.returncode == 0, done.stderr
    assert results(done)[0]["strands"] == 300
    assert done.stdout.splitlines()[-1].startswith("{")
    assert run("groom", HEAD, *SMALL, "--out", tmp_path / "head.npz").status == 0
    expected, found = load(tmp_path / "head.npz"), load(out)
    for name, array in expected.items():
        if array.dtype.kind == "U":  # the axis that points up
            np.testing.assert_array_equal(found[name], array)
        else:
            np.testing.assert_allclose(found[name], array, atol=1e-5)


def test_a_groom_is_made_told_of_and_drawn(vellus):
    blend = vellus.folder / "head.blend"
    assert vellus("groom", HEAD, *SMALL, "--preset", "BLOND", "--out", blend).returncode == 0
    told = results(vellus("info", blend, "--json"))[0]
    assert told["hair"][0]["strands"] == 300
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0.0, 0.0, 3.0)
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    # The process of the command starts another, which renders a panorama for each frame.
    world = bpy.context.scene.world = bpy.data.worlds.new("Sky")
    noise = world.node_tree.nodes.new("ShaderNodeTexNoise")
    world.node_tree.links.new(noise.outputs["Color"], world.node_tree.nodes["Background"].inputs["Color"])
    noise.inputs["Scale"].driver_add("default_value").driver.expression = "frame"
    bpy.ops.wm.save_as_mainfile(filepath=str(vellus.folder / "shot.blend"))
    render = ("render", vellus.folder / "shot.blend", "--frames", "1-2", "--width", 64, "--height", 48)
    drawn = vellus(*render, "--out", vellus.folder / "f_#.png", "--json")
    assert [result["frame"] for result in results(drawn)] == [1, 2], drawn.stderr
    assert (vellus.folder / "f_1.png").exists() and (vellus.folder / "f_2.png").exists()
    assert len(list(vellus.folder.rglob("worlds/*.exr"))) == 2


def test_it_ends_as_it_should(vellus):
    missing = vellus("groom", "missing.obj", "--out", "x.npz")
    assert missing.returncode == 1 and missing.stderr == "vellus: missing.obj does not exist: check the path.\n"
    assert vellus("comb").returncode == 2
    helped = vellus("groom", "--help")
    assert helped.returncode == 0 and "usage: blender --command vellus groom" in helped.stdout
    # Debian's Blender is built without USD.
    refused = vellus("groom", HEAD, *SMALL, "--out", vellus.folder / "a.usdc")
    assert (refused.returncode, len(refused.stderr.splitlines())) in ((1, 1), (0, 0))


# Frames 1 and 2, and the one after, are baked of an animation of five.
BAKE = """
import bpy
scene = bpy.context.scene
guides = next(o for o in scene.objects if o.type == "CURVES" and o.data.vellus.kind == "GUIDES")
guides.data.vellus.simulates, guides.data.vellus.cache_folder = True, "//frames"
scene.frame_start, scene.frame_end, scene.render.engine = 1, 2, "BLENDER_WORKBENCH"
scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
scene.collection.objects.link(scene.camera)
scene.render.filepath = "//f_"
scene.render.resolution_x = scene.render.resolution_y = 16
bpy.context.view_layer.objects.active = guides
assert bpy.ops.vellus.bake_dynamics() == {"FINISHED"}
scene.frame_end = 5
bpy.ops.wm.save_mainfile()
"""


def test_another_engine_ends_before_a_frame_that_is_not_baked(vellus, desktop):
    """Another engine with `-a` writes the frames before a missing baked frame, then ends with status 1 and one
    sentence.
    """
    folder = vellus.folder / "unbaked"
    folder.mkdir()
    shot = folder / "shot.blend"
    assert vellus("groom", HEAD, *SMALL, "--out", shot).returncode == 0
    made = desktop.command("-b", shot, "--python-exit-code", 5, "--python-expr", BAKE, profile=vellus.folder)
    assert made.returncode == 0, made.stderr
    done = desktop.command("-b", shot, "-a", profile=vellus.folder)
    reported = [line for line in done.stderr.splitlines() if line.startswith("Vellus:")]
    assert done.returncode == 1 and len(reported) == 1, done.stderr
    assert re.fullmatch(r'Vellus: Frame 4 of the guides ".+" is not baked: bake their dynamics first\.', reported[0])
    assert sorted(path.name for path in folder.glob("f_*.png")) == [f"f_{frame:04}.png" for frame in (1, 2, 3)]
    baked = desktop.command("-b", shot, "-f", 3, profile=vellus.folder)
    assert baked.returncode == 0 and "Vellus:" not in baked.stderr
