# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair of a scene that is not shown grows on its own scene's surface, with its modifiers."""

import bpy
import numpy as np

from tests.support.reading import points

SEED = 9


def regrow(hair, seed):
    hair.data.vellus.guide_curves.vellus.guides.seed = hair.data.vellus.hair.seed = seed
    bpy.context.view_layer.update()


def strands_of(hair):
    return points(hair), points(bpy.data.objects["Guides"])


def test_hair_of_another_scene_grows_as_if_it_were_shown(hair):
    surface = hair.data.surface
    surface.modifiers.new("Subdivision", "SUBSURF").levels = 1
    surface.modifiers.new("Array", "ARRAY").count = 2
    bpy.context.view_layer.update()
    regrow(hair, SEED)
    expected = strands_of(hair)
    regrow(hair, SEED + 1)
    assert not np.array_equal(points(hair), expected[0])
    bpy.context.window.scene = bpy.data.scenes.new("Other")
    regrow(hair, SEED)
    assert not hair.data.vellus.status and not hair.data.vellus.is_stale
    for found, wanted in zip(strands_of(hair), expected, strict=True):
        assert np.array_equal(found, wanted)


def test_a_file_beside_another_scene_stores_the_same_roots(hair, tmp_path):
    """A file saved beside another scene stores the same roots, also of hair with its own transform, as after
    *Apply*.
    """
    surface = hair.data.surface
    surface.modifiers.new("Subdivision", "SUBSURF").levels = 1
    bpy.context.view_layer.update()
    before = [datablock.vellus.topology for datablock in bpy.data.hair_curves]
    bpy.context.window.scene = bpy.data.scenes.new("Other")
    bpy.data.objects["Guides"].location.x = hair.location.x = 0.5
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "other.blend"))
    assert [datablock.vellus.topology for datablock in bpy.data.hair_curves] == before
