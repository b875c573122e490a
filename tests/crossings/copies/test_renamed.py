# SPDX-License-Identifier: GPL-3.0-or-later
"""Data that settings refer to are followed or reported when renamed, deleted, unlinked or appended."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data.simulation import simulated_world
from hair_addon.blender.data.strands import simulated_guides
from hair_addon.blender.groom import pipeline, staleness
from hair_addon.blender.groom.dynamics import guide_baking
from hair_addon.blender.groom.systems import diagnostics
from hair_addon.blender.live import file_changes
from hair_addon.core.errors import HairError
from tests.support.dynamics.swung import simulate
from tests.support.reading import points

LAST = 4


@pytest.fixture
def collider(guides, tmp_path):
    """Add a ball among the guides, which collide with it, in a collection of the scene."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, radius=0.5, location=(1.3, 0.0, 0.0))
    ball, body = bpy.context.object, bpy.data.collections.new("Body")
    bpy.context.scene.collection.children.link(body)
    bpy.context.scene.collection.objects.unlink(ball)
    body.objects.link(ball)
    simulate(guides, tmp_path / "frames", colliders="Body", collides_with_surface=False)
    bpy.context.view_layer.update()
    return ball


def baked(guides):
    """Return (G, P, 3) points of guides in the last frame, local at rest."""
    api.bake_dynamics(guides, LAST, starts_over=True)
    bpy.context.scene.frame_set(LAST)
    return simulated_guides.point_cache.get(guides.data.session_uid).copy()


def test_a_renamed_collection_of_colliders_is_followed(guides, collider):
    """A collection renamed by a script is followed without an update; a collection in no scene collides too."""
    as_set = baked(guides)
    bpy.data.collections["Body"].name = "COL body"
    np.testing.assert_array_equal(baked(guides), as_set)
    assert guides.data.vellus.dynamics.colliders == "COL body"
    bpy.context.scene.collection.children.unlink(bpy.data.collections["COL body"])
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(baked(guides), as_set)
    guides.data.vellus.dynamics.colliders = ""
    assert not np.array_equal(baked(guides), as_set)


@pytest.mark.parametrize(
    ("lose", "sentence"),
    [
        (lambda ball: bpy.data.collections.remove(bpy.data.collections["Body"]), 'no collection "Body" of colliders'),
        (lambda ball: bpy.data.objects.remove(ball), '"Body" has no meshes to collide with'),
    ],
    ids=["deleted", "emptied"],
)
def test_a_bake_without_its_colliders_is_refused(guides, collider, lose, sentence):
    lose(collider)
    with pytest.raises(HairError, match=sentence):
        api.bake_dynamics(guides, LAST)
    assert simulated_world.collider_problem(guides.data.vellus.dynamics) is not None  # the panel reports it


def test_a_bake_whose_collider_is_not_evaluated_is_refused(guides, collider, monkeypatch):
    """A bake is refused if a collider is not evaluated, as in a library override, where it would stand still or be
    at the origin.
    """
    del guides.data["vellus_named"]
    for module in (file_changes, guide_baking):
        monkeypatch.setattr(module.followed_names, "follow", lambda: None)
    collider.hide_viewport = True
    bpy.context.view_layer.update()
    with pytest.raises(HairError, match='The collider "Icosphere" is not evaluated'):
        api.bake_dynamics(guides, LAST)


@pytest.fixture
def line(hair):
    """Add a part line across the sphere, which also cuts hair, and an image that is painted on one half."""
    curve = bpy.data.curves.new("Line", "CURVE")
    curve.dimensions = "3D"
    spline = curve.splines.new("POLY")
    spline.points.add(1)
    for point, x in zip(spline.points, (-1.0, 1.0), strict=True):
        point.co = (x, 0.0, 1.0, 1.0)
    drawn = bpy.data.objects.new("Line", curve)
    bpy.context.scene.collection.objects.link(drawn)
    image = bpy.data.images.new("Paint", 8, 8, float_buffer=True)
    image.pixels.foreach_set(np.tile(np.float32([1, 1, 1, 1, 0.5, 0.5, 0.5, 1]), 32))
    api.set_styles(hair, [api.Trim(cutter="Line", mask_image="Paint")])
    hair.data.vellus.hair.part_lines, hair.data.vellus.hair.density_image = "Line", "Paint"
    bpy.context.view_layer.update()
    assert hair.data.vellus.status == ""
    return drawn


def test_renamed_objects_and_images_are_followed_and_nothing_becomes_stale(hair, line, monkeypatch):
    before = points(hair)
    monkeypatch.setattr(pipeline, "evaluate", lambda *_args: pytest.fail("nothing but names has changed"))
    line.name, bpy.data.images["Paint"].name = "Parting", "Density"
    bpy.data.objects.new("Line", None)  # another object under the name that was
    bpy.context.view_layer.update()
    state = hair.data.vellus
    assert (state.hair.part_lines, state.hair.density_image) == ("Parting", "Density")
    assert (state.styles[0].trim.cutter, state.styles[0].trim.mask_image) == ("Parting", "Density")
    assert not staleness.has_other_mask(hair.data, bpy.context.evaluated_depsgraph_get())
    monkeypatch.undo()
    state.hair.radius = 0.02
    bpy.context.view_layer.update()
    assert state.status == ""
    np.testing.assert_array_equal(points(hair), before)


def test_a_deleted_part_line_is_reported_and_does_not_part_on(hair, line):
    with bpy.context.temp_override(selected_objects=[line]):
        bpy.ops.object.delete()
    hair.data.vellus.hair.radius = 0.02
    bpy.context.view_layer.update()
    assert hair.data.vellus.status == 'There is no object "Line": pick a curve for the lines, or clear the field.'
    assert diagnostics.parting_warnings(hair.data)


def test_appended_hair_keeps_what_it_names_under_another_name(hair, line, tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "hair.blend"))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.data.images.new("Paint", 4, 4)
    bpy.ops.wm.append(directory=f"{tmp_path / 'hair.blend'}/Object/", filename="Hair")
    state = bpy.data.objects["Hair"].data.vellus
    assert state.hair.density_image == state.styles[0].trim.mask_image == "Paint.001"
    assert bpy.data.images["Paint.001"].size[0] == 8
