# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands with non-finite coordinates are left out and reported once; all other hair is drawn."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data.strands import curves
from hair_addon.blender.host import notices
from hair_addon.blender.render import drawn_scene, hair_cache
from hair_addon.core.errors import HairError
from tests.support.commands import run_here
from tests.support.interface.layout import draw
from tests.support.pictures.rendering import add_orthographic_camera, configure, rendered

SENTENCE = '"Hair" is drawn without the strands that have non-finite coordinates'
BROKEN, POINT = 7, 17


def break_strands(hair, value, strands):
    """Give a point of some strands another x coordinate."""
    points = curves.read_points(hair.data).reshape(len(hair.data.curves), -1, 3)
    points[strands, POINT, 0] = value
    hair.data.position_data.foreach_set("vector", points.ravel())
    hair.data.update_tag()
    bpy.context.view_layer.update()
    notices.printed_cache.clear()


def drawn_hair():
    """Return [`StrandsOnGPU`] as viewports have them."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    drawn = drawn_scene.read(bpy.context.scene, bpy.context.view_layer, depsgraph, None, hair_cache.refuse)
    return [strands for strands, *_ in drawn.hair]


@pytest.fixture
def seen(hair, scene):
    """Return the hair before a camera."""
    add_orthographic_camera(scene)
    return hair


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e20])
def test_one_strand_is_not_drawn_and_reported_once(seen, value, capsys):
    before, count = api.points(seen.data), len(seen.data.curves)
    break_strands(seen, value, [BROKEN])
    for _redraw in range(3):
        (strands,) = drawn_hair()
    np.testing.assert_array_equal(strands.points, np.delete(before, BROKEN, axis=0))
    assert strands.strand_count == len(strands.randoms_here) == count - 1
    reported = capsys.readouterr().err
    assert reported.count("Vellus:") == reported.count(SENTENCE) == 1 and "Traceback" not in reported
    assert SENTENCE in " ".join(draw(bpy.types.VELLUS_PT_interpolation).texts)


def test_the_picture_is_that_of_the_hair_without_the_strand(seen, tmp_path, capsys):
    settings = {"resolution_x": 48, "resolution_y": 48, "film_transparent": True}
    break_strands(seen, np.nan, [BROKEN])
    by_engine, drawn = rendered(tmp_path, **settings), api.draw(width=48, height=48, samples_per_side=2)
    assert capsys.readouterr().err.count(SENTENCE) == 1
    seen.data.remove_curves(indices=[BROKEN])
    seen.data.update_tag()
    bpy.context.view_layer.update()
    without = rendered(tmp_path, **settings)
    np.testing.assert_array_equal(by_engine["Combined"], without["Combined"])
    np.testing.assert_array_equal(drawn, api.draw(width=48, height=48, samples_per_side=2))
    assert by_engine["Combined"][..., 3].max() > 0.5


def test_hair_on_a_surface_that_moves_is_carried_without_it(seen, capsys):
    """Hair on a moving surface is deformed without its broken strand, and all drawn strands keep their own roots."""
    sphere = seen.data.surface
    bend = sphere.modifiers.new("Bend", "SIMPLE_DEFORM")
    bend.deform_method, bend.angle = "TWIST", 1.0
    bpy.context.view_layer.update()
    (whole,) = drawn_hair()
    break_strands(seen, np.nan, [BROKEN])
    (strands,) = drawn_hair()
    np.testing.assert_allclose(strands.points, np.delete(whole.points, BROKEN, axis=0), atol=1e-5)
    assert "Traceback" not in capsys.readouterr().err


def test_splines_of_unequal_counts_are_not_resampled_with_it(seen):
    """Splines of unequal point counts are drawn beside a broken one, which no kernel reads."""
    data = seen.data
    data.remove_curves()
    data.add_curves([5, 9, 4])
    data.set_types(type="CATMULL_ROM")
    points = np.random.default_rng(1).random((18, 3)).astype(np.float32)
    points[6] = np.nan
    data.position_data.foreach_set("vector", points.ravel())
    data.update_tag()
    bpy.context.view_layer.update()
    (strands,) = drawn_hair()
    assert strands.strand_count == 2 and np.isfinite(strands.points).all()
    np.testing.assert_allclose(strands.points[:, [0, -1]], points[[[0, 4], [14, 17]]], atol=1e-6)


def test_hair_of_which_nothing_is_left_is_refused_and_named(seen, tmp_path, capsys):
    break_strands(seen, np.nan, slice(None))
    assert not drawn_hair() and not drawn_hair()
    assert capsys.readouterr().err.count('"Hair" is not drawn: all of its strands have non-finite coordinates') == 1
    with pytest.raises(HairError, match='"Hair" is not drawn'):
        hair_cache.strand_cache.clear()
        api.draw(width=8, height=8)
    configure(resolution_x=8, resolution_y=8, sample_count=1)
    with pytest.raises(RuntimeError, match='"Hair" is not drawn'):
        bpy.ops.render.render()


def test_the_command_line_renders_the_frame(seen, tmp_path, capsys):
    break_strands(seen, np.nan, [BROKEN])
    file, picture = tmp_path / "broken.blend", tmp_path / "frame.png"
    bpy.ops.wm.save_as_mainfile(filepath=str(file))
    ended = run_here("render", file, "--out", picture, "--width", 16, "--height", 16, "--samples", 1)
    assert ended.status == 0 and picture.exists()
    assert capsys.readouterr().err.count(SENTENCE) == 1
