# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair is not evaluated while guides are baked without a window, and is evaluated again after baking ends in any
way.
"""

import bpy
import pytest

from hair_addon.blender.groom.dynamics import frame_folders, guide_baking
from hair_addon.core.errors import HairError
from hair_addon.core.long_work import Stopped, run_now
from tests.support.dynamics.swung import simulate, swing


@pytest.fixture
def swung(hair, tmp_path):
    """Return (guides, hair) that simulate on a sphere that swings and waves."""
    sphere, guides = bpy.data.objects["Sphere"], bpy.data.objects["Guides"]
    swing(sphere)
    sphere.modifiers.new("Wave", "WAVE").height = 0.05
    simulate(guides, tmp_path / "frames")
    return guides, hair


def bake(guides, watch=lambda: None):
    run_now(guide_baking.baking([guides.data], 6, bpy.context.scene), lambda _step, _part: watch())
    folder = frame_folders.folder_of(guides.data)
    return {path.name: path.read_bytes() for path in folder.glob("*.npz")}


def are_evaluated(*objects):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return [curves_object.evaluated_get(depsgraph).is_evaluated for curves_object in objects]


def stop():
    raise Stopped


def fail():
    raise HairError("Full")


@pytest.mark.parametrize("ending", [None, stop, fail])
def test_hair_is_not_evaluated_meanwhile(swung, ending):
    guides, hair = swung
    hair.hide_viewport = True  # by the artist
    seen = []

    def watch():
        seen.append(are_evaluated(guides, hair))
        if ending is not None and len(seen) == 4:
            ending()

    if ending is None:
        bake(guides, watch)
    else:
        with pytest.raises((Stopped, HairError)):
            bake(guides, watch)
    assert len(seen) >= 4 and all(found == [False, False] for found in seen)
    assert (guides.hide_viewport, hair.hide_viewport) == (False, True)
    assert are_evaluated(guides) == [True]


def test_a_surface_that_only_hair_has_evaluated_is_baked_all_the_same(swung):
    """Guides are baked on a surface that is disabled in viewports and evaluated only because hair follows it."""
    guides, _hair = swung
    visible = bake(guides)
    bpy.data.objects["Sphere"].hide_viewport = True
    bpy.context.view_layer.update()
    guides.data.vellus.cache_folder += "_hidden"
    assert bake(guides) == visible
