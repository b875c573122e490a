# SPDX-License-Identifier: GPL-3.0-or-later
"""Viewports draw hair with modifiers of the artist as Blender evaluates it, point for point."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.strands import curves
from hair_addon.blender.gpu import strand_textures
from hair_addon.blender.render import drawn_scene, modified_hair
from tests.blender.live.test_carried_strands import bend
from tests.blender.ui.test_own_modifiers import add_asset
from tests.support.pictures import drawn_strands
from tests.support.pictures.gpu_strands import CLOSE
from tests.support.reading import evaluated_points, points, write_points


def drawn():
    """Return (S, P, 3), the points of the hair that a viewport draws."""
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    ((strands, *_others),) = drawn_scene.read(bpy.context.scene, bpy.context.view_layer, depsgraph).hair
    return drawn_strands.places(strands)


@pytest.fixture
def modified(watched):
    """Return hair with Blender's own curls, in a window."""
    add_asset(watched, "Curl Hair Curves")
    return watched


def is_evaluated(hair):
    found = drawn()
    np.testing.assert_allclose(found, evaluated_points(hair), atol=CLOSE)
    return found


def test_viewports_draw_what_blender_evaluates_after_each_change(modified):
    curled = is_evaluated(modified)
    assert abs(curled[:, -1] - points(modified)[:, -1]).max() > 1e-3
    modified.modifiers[-1].show_viewport = False
    np.testing.assert_allclose(drawn(), points(modified), atol=CLOSE)
    modified.modifiers[-1].show_viewport = True
    bend(modified.data.surface, 0.5)
    bent = is_evaluated(modified)
    assert abs(bent - curled).max() > 0.01
    guides = bpy.data.objects["Guides"]
    combed = points(guides)
    combed[:, 1:] += np.float32([0.0, 0.1, 0.0])
    write_points(guides, combed)
    moved = is_evaluated(modified)
    assert abs(moved - bent).max() > 0.01
    modified.data.vellus.hair.seed += 1
    assert abs(is_evaluated(modified) - moved).max() > 0.01


def test_radii_are_those_of_the_evaluation(modified):
    """Radii that stay are read into an array that is reused; others are drawn."""
    for turn, radius in enumerate((0.004, 0.004, 0.004, 0.006, 0.006)):
        modified.data.vellus.hair.radius = radius
        bend(modified.data.surface, 0.1 * turn)
        drawn()
        on_gpu = modified_hair.modified_cache.get(modified.session_uid).on_gpu
        evaluated = modified.evaluated_get(bpy.context.evaluated_depsgraph_get())
        np.testing.assert_array_equal(on_gpu.radii.ravel(), curves.read_radii(evaluated.data))
        assert on_gpu.radii.max() == np.float32(radius)


def test_modifiers_may_change_the_number_of_strands(modified):
    add_asset(modified, "Duplicate Hair Curves")
    found = is_evaluated(modified)
    assert len(found) > len(modified.data.curves)
    for turn, is_shown in enumerate((False, False, True)):
        modified.modifiers[-1].show_viewport = is_shown
        bend(modified.data.surface, 0.1 * turn)
        assert (len(is_evaluated(modified)) == len(found)) == is_shown


def test_what_blender_did_not_evaluate_again_is_not_uploaded_again(modified, monkeypatch):
    drawn()
    uploads = []
    real = strand_textures.packed_texture
    monkeypatch.setattr(strand_textures, "packed_texture", lambda *given: uploads.append(1) or real(*given))
    bpy.data.objects["Sphere"].name = "Ball"
    drawn()
    assert not uploads
    bend(modified.data.surface, 0.3)
    drawn()
    assert uploads


def test_moved_points_are_all_that_is_uploaded(modified):
    drawn()
    strands = modified_hair.modified_cache.get(modified.session_uid).on_gpu
    bend(modified.data.surface, 0.3)
    is_evaluated(modified)
    moved = modified_hair.modified_cache.get(modified.session_uid).on_gpu
    assert moved.radii_texture is strands.radii_texture and moved.randoms is strands.randoms
    assert moved.texture is not strands.texture
    fresh = strand_textures.upload_strands(moved.points, moved.radii, moved.randoms_here, moved.wetness_here)
    np.testing.assert_array_equal(np.array(moved.texture.read()), np.array(fresh.texture.read()))
    assert moved.mean_length == fresh.mean_length
    np.testing.assert_array_equal(moved.box.exact, fresh.box.exact)
    modified.data.vellus.hair.radius *= 2.0
    assert is_evaluated(modified).shape == moved.points.shape
    wider = modified_hair.modified_cache.get(modified.session_uid).on_gpu
    np.testing.assert_allclose(wider.greatest_radius, 2.0 * moved.greatest_radius, rtol=1e-5)


def test_strands_of_removed_modifiers_and_deleted_objects_are_freed(modified):
    copy = modified.copy()
    bpy.context.scene.collection.objects.link(copy)
    bpy.context.view_layer.update()
    read_all()
    assert len(modified_hair.modified_cache) == 2
    bpy.data.objects.remove(copy)
    modified.modifiers[-1].show_viewport = False
    read_all()
    assert len(modified_hair.modified_cache) == 1
    modified.modifiers[-1].show_viewport = True
    read_all()
    assert [known.owner for known in modified_hair.modified_cache.values()] == [modified.session_uid]


def read_all():
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return drawn_scene.read(bpy.context.scene, bpy.context.view_layer, depsgraph).hair


@pytest.mark.parametrize("scale", [(0.01, 0.01, 0.01), (-1.0, 1.0, 1.0), (1.0, 3.0, 0.5)])
def test_places_and_widths_are_those_of_the_render_wherever_the_surface_stands(modified, scale):
    surface = modified.data.surface
    surface.location, surface.rotation_euler, surface.scale = (3.0, -2.0, 1.0), (0.4, 0.3, 1.0), scale
    bend(surface, 0.3)
    ((strands, _shading, to_world, _part),) = read_all()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    ((rendered, _shading, place, _part),) = drawn_scene.read_unlit(depsgraph, {}, None, None).hair
    places = [drawn_strands.places(one) @ m[:3, :3].T + m[:3, 3] for one, m in ((strands, to_world), (rendered, place))]
    np.testing.assert_allclose(*places, atol=CLOSE)
    np.testing.assert_allclose(*(np.array(one.radii_texture.read()) for one in (strands, rendered)))
