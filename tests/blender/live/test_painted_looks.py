# SPDX-License-Identifier: GPL-3.0-or-later
"""Looks by painted images change the picture immediately, and the hair's Curves after the stroke."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.maps import strand_maps
from hair_addon.blender.data.strands import attributes
from hair_addon.blender.live import live_hair
from hair_addon.blender.render import hair_cache
from hair_addon.blender.settings import map_items
from hair_addon.core.maps.map_settings import MapSettings


@pytest.fixture
def coat(hair, in_window):
    """Return an image of one color that gives the color to the hair, which is drawn."""
    image = bpy.data.images.new("Coat", 32, 32, alpha=True)
    hair.data.vellus.appearance.parametrization = "COLOR"
    map_items.keep(hair.data.vellus, MapSettings(setting="look.color", source=image.name))
    bpy.context.view_layer.update()
    live_hair.write_all()
    hair_cache.strands_on_gpu(hair.data)
    return image


def paint(image, color):
    pixels = np.tile(np.float32([*color, 1.0]), len(image.pixels) // 4)
    image.pixels.foreach_set(pixels)
    image.update_tag()
    bpy.context.view_layer.update()


def evaluate_again(hair):
    hair.data.vellus.is_shading_stale = True
    hair.data.update_tag()
    bpy.context.view_layer.update()


def stored(hair):
    return attributes.read(hair.data, strand_maps.ROOT, "FLOAT_VECTOR", "CURVE")


def test_strokes_are_drawn_at_once_and_written_at_their_end(hair, coat):
    """After a stroke the drawn looks are new and the stored ones old; at the end both are new."""
    before = stored(hair)
    paint(coat, (0.9, 0.1, 0.1))
    paint(coat, (0.8, 0.2, 0.1))
    np.testing.assert_array_equal(stored(hair), before)
    shown = strand_maps.read_looks(hair.data)
    assert not np.array_equal(shown.root, before)
    drawn = next(known for known in hair_cache.strand_cache.values() if known.looks is not None)
    assert drawn.looks.is_same(shown)
    live_hair.write_all()
    np.testing.assert_array_equal(stored(hair), shown.root)
    assert not strand_maps.is_pending(hair.data)


def test_looks_are_written_before_a_save(hair, coat, tmp_path):
    """A file that is saved during a stroke has the new looks."""
    paint(coat, (0.9, 0.1, 0.1))
    shown = strand_maps.read_looks(hair.data).root
    coat.pack()
    path, name = str(tmp_path / "painted.blend"), hair.name
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    bpy.ops.wm.open_mainfile(filepath=path)
    np.testing.assert_array_equal(stored(bpy.data.objects[name]), shown)


def test_undo_restores_looks_that_were_not_written(hair, coat):
    """An undo step from within a stroke has older looks; after undo, hair has the looks of its maps."""
    paint(coat, (0.9, 0.1, 0.1))
    bpy.ops.ed.undo_push(message="Within a stroke")
    hair.data.vellus.appearance.roughness = 0.5
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="Roughness")
    name = hair.name
    bpy.ops.ed.undo()
    bpy.context.view_layer.update()
    live_hair.write_all()
    found = bpy.data.objects[name]
    np.testing.assert_array_equal(stored(found), strand_maps.looks_of(found.data)[0].root)


def test_other_looks_are_written_at_once(hair, coat):
    """Looks with a first radial roughness, looks that Blender draws, and removed looks are not left for later."""
    map_items.keep(hair.data.vellus, MapSettings(setting="look.radial_roughness", kind="STRAND"))
    bpy.context.view_layer.update()
    assert strand_maps.has_radial(hair.data) and not strand_maps.is_pending(hair.data)
    hair.data.vellus.is_drawn = False
    bpy.context.view_layer.update()
    paint(coat, (0.9, 0.1, 0.1))
    assert not strand_maps.is_pending(hair.data)
    np.testing.assert_array_equal(stored(hair), strand_maps.looks_of(hair.data)[0].root)
    hair.data.vellus.is_drawn = True
    paint(coat, (0.1, 0.9, 0.1))
    assert strand_maps.is_pending(hair.data)
    hair.data.vellus.maps.clear()
    evaluate_again(hair)
    assert not strand_maps.has(hair.data) and not strand_maps.is_pending(hair.data)


def test_the_same_look_leaves_the_material(hair, coat):
    """Shading that is evaluated without a change writes nothing to the material, so Blender builds no shader again."""
    reported = []

    def note(_scene, depsgraph):
        reported.extend(update.id.original for update in depsgraph.updates)

    bpy.app.handlers.depsgraph_update_post.append(note)
    try:
        evaluate_again(hair)
        bpy.context.view_layer.update()
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(note)
    assert hair.data in reported
    assert hair.data.materials[0] not in reported
