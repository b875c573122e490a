# SPDX-License-Identifier: GPL-3.0-or-later
"""A transferred hair system has the same guides, hair and settings on another mesh."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from hair_addon import api
from hair_addon.blender.data.strands import curves
from tests.support.dynamics.following import update
from tests.support.exchange.imported import select, stored, world

GUIDES, STRANDS = 30, 60
MATRICES = {
    "turned": Matrix.Translation((3.0, -1.0, 0.5)) @ Matrix.Rotation(0.7, 4, (1.0, 2.0, 0.5)) @ Matrix.Scale(1.6, 4),
    "mirrored": Matrix.Translation((3.0, 0.0, 0.0)) @ Matrix.Diagonal((-1.0, 1.0, 1.0, 1.0)),
}


@pytest.fixture
def hair(sphere):
    """Return hair on the upper half of a sphere, with combed guides, a style and a look of its own."""
    settings = {"strand_count": STRANDS, "radius": 0.002}
    guides = api.distribute_guides(sphere, guide_count=GUIDES, length=0.3, density_group="top")
    made = api.interpolate_hair(guides, styles=(api.Curl(radius=0.01),), **settings)
    points = curves.read_points(guides)
    bent = points + 0.05 * np.sin(9.0 * points) * np.linspace(0.0, 1.0, 41, dtype=np.float32)[None].repeat(
        GUIDES, 0
    ).reshape(-1, 1)
    guides.attributes["position"].data.foreach_set("vector", bent.astype(np.float32).ravel())
    guides.update_tag()
    api.shade(made, "AUBURN", roughness=0.31)
    update()
    return next(o for o in bpy.data.objects if o.data == made)


def other_sphere(subdivisions=4, matrix=None, name="Other"):
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=subdivisions, radius=1.0)
    made = bpy.context.object
    made.name = name
    if matrix is not None:
        made.matrix_world = matrix
    group = made.vertex_groups.new(name="top")
    group.add([v.index for v in made.data.vertices if v.co.z > 0.0], 1.0, "REPLACE")
    update()
    return made


def transfer(target, hair, **options):
    select(target, hair)
    assert bpy.ops.vellus.transfer_groom(**options) == {"FINISHED"}
    made = bpy.context.object
    guides = made.data.vellus.guide_curves
    update()
    assert guides.vellus.status == ""
    return made, next(o for o in bpy.data.objects if o.data == guides)


def guides_object(hair):
    return next(o for o in bpy.data.objects if o.data == hair.data.vellus.guide_curves)


@pytest.mark.parametrize("matrix", MATRICES)
@pytest.mark.parametrize(
    "options", [{"method": "UV"}, {"method": "NEAREST", "alignment": "LOCAL"}], ids=["uv", "local"]
)
def test_a_copy_of_the_mesh_gets_the_same_groom(hair, sphere, matrix, options):
    target = sphere.copy()
    target.data = sphere.data.copy()
    bpy.context.scene.collection.objects.link(target)
    target.matrix_world = MATRICES[matrix]
    update()
    made, guides = transfer(target, hair, **options)
    mapped = np.array(MATRICES[matrix])
    expected = world(guides_object(hair)) @ mapped[:3, :3].T + mapped[:3, 3]
    np.testing.assert_allclose(world(guides), expected, atol=2e-4)
    if matrix == "turned":  # strands of a mirrored mesh are drawn otherwise
        before, after = (world(one).reshape(STRANDS, -1, 3)[:, 0] for one in (hair, made))
        np.testing.assert_allclose(after, before @ mapped[:3, :3].T + mapped[:3, 3], atol=2e-4)


def test_everything_that_belongs_to_it_comes_along(hair, sphere):
    guides_object(hair).data.attributes.new("braid", "INT", "CURVE").data.foreach_set(
        "value", np.arange(GUIDES, dtype=np.int32)
    )
    made, guides = transfer(other_sphere(3, Matrix.Scale(2.0, 4)), hair)
    before, after = api.settings_of(hair), api.settings_of(made)
    assert after.appearance == before.appearance
    assert after.hair.radius == pytest.approx(2.0 * before.hair.radius, rel=0.02)
    assert after.styles[0].radius == pytest.approx(2.0 * before.styles[0].radius, rel=0.02)
    assert (after.hair.strand_count, after.guides.density_group) == (STRANDS, "top")
    assert made.data.vellus.guide_curves == guides.data != hair.data.vellus.guide_curves
    assert (made.parent.name, guides.parent.name) == ("Other", "Other")
    values = np.empty(len(guides.data.curves), np.int32)
    guides.data.attributes["braid"].data.foreach_get("value", values)
    assert np.array_equal(values, np.arange(GUIDES))
    assert curves.is_hand_made(guides.data)


def test_the_source_and_its_settings_stay_as_they_are(hair):
    points, settings = stored(hair).copy(), api.settings_of(hair)
    transfer(other_sphere(3, Matrix.Scale(0.5, 4)), hair)
    assert np.array_equal(stored(hair), points)
    assert api.settings_of(hair) == settings


def test_roots_are_on_the_new_surface_and_hair_follows_the_new_guides(hair):
    target = other_sphere(3)
    made, guides = transfer(target, hair)
    found = [target.closest_point_on_mesh(point)[1] for point in curves.first_points(guides.data).tolist()]
    np.testing.assert_allclose(curves.first_points(guides.data), np.array(found), atol=1e-6)
    before = stored(made).copy()
    guides.data.attributes["position"].data.foreach_set("vector", (1.2 * curves.read_points(guides.data)).ravel())
    guides.data.update_tag()
    update()
    assert not np.array_equal(stored(made), before)


def test_masks_that_the_mesh_lacks_are_transferred(hair, sphere, capfd):
    """Masks that the mesh lacks are transferred exactly if weights are a function of the position, and mask the same
    strands.
    """
    group, weights = sphere.vertex_groups["top"], np.empty(3 * len(sphere.data.vertices))
    sphere.data.vertices.foreach_get("co", weights)
    weights = np.clip(weights[2::3], 0.0, 1.0)
    for index, weight in enumerate(weights.tolist()):
        group.add([index], weight, "REPLACE")
    update()
    target = other_sphere(5, Matrix.Scale(2.0, 4))
    target.vertex_groups.clear()
    made, guides = transfer(target, hair)
    assert (guides.data.vellus.guides.density_group, made.data.vellus.hair.density_group) == ("top", "")
    assert '"Other" has new vertex groups: top.' in capfd.readouterr().out
    places = np.array([vertex.co[:] for vertex in target.data.vertices])
    found = [
        next((entry.weight for entry in vertex.groups if entry.group == target.vertex_groups["top"].index), 0.0)
        for vertex in target.data.vertices
    ]
    np.testing.assert_allclose(found, np.clip(places[:, 2], 0.0, 1.0), atol=0.05)  # flat faces of the coarser sphere
    assert curves.first_points(made.data)[:, 2].min() > -0.05


def test_names_that_neither_mesh_has_are_cleared_and_reported(hair, capfd):
    hair.data.vellus.styles[0].curl.mask = "elsewhere"
    guides_object(hair).data.attributes.new("elsewhere", "FLOAT", "CURVE")
    hair.data.vellus.hair.part_lines = ""
    target = other_sphere(3)
    update()
    made, _guides = transfer(target, hair)
    assert made.data.vellus.styles[0].curl.mask == "elsewhere"  # the guides carry this mask
    guides_object(hair).data.attributes.remove(guides_object(hair).data.attributes["elsewhere"])
    made, _guides = transfer(target, hair)
    assert made.data.vellus.styles[0].curl.mask == ""
    assert "cleared from the settings: elsewhere" in capfd.readouterr().out


@pytest.mark.parametrize("scales", [True, False])
def test_lengths_of_dynamics_grow_with_the_surface(hair, scales):
    dynamics = guides_object(hair).data.vellus.dynamics
    dynamics.collision_distance, dynamics.bend_stiffness = 0.003, 5.0
    _made, guides = transfer(other_sphere(3, Matrix.Scale(2.0, 4)), hair, scale_lengths=scales)
    after = guides.data.vellus.dynamics
    assert after.collision_distance == pytest.approx(0.006 if scales else 0.003, rel=0.02)
    assert after.bend_stiffness == 5.0


def test_guides_without_a_place_are_left_out_and_reported(hair, capfd):
    target = other_sphere(3)
    for vertex in target.data.vertices:
        vertex.co.x = max(vertex.co.x, 0.0)
    update()
    _made, guides = transfer(target, hair, alignment="LOCAL", reach=0.01)
    reported = capfd.readouterr().out
    assert 0 < len(guides.data.curves) < GUIDES
    assert f"{GUIDES - len(guides.data.curves)} of {GUIDES} guides could not be placed" in reported


@pytest.mark.parametrize("kind", ["groups", "empties"])
def test_landmarks_are_vertex_groups_or_empties_of_the_same_names(hair, sphere, kind):
    target = other_sphere(4, MATRICES["turned"])
    places = {"nose": (0.0, -1.0, 0.0), "left": (1.0, 0.0, 0.0), "right": (-1.0, 0.0, 0.0), "top": (0.0, 0.0, 1.0)}
    for owner in (sphere, target):
        for name, place in places.items():
            if kind == "groups":
                nearest = min(
                    owner.data.vertices, key=lambda vertex: (vertex.co - Matrix.Translation(place).translation).length
                )
                owner.vertex_groups.new(name=f"Landmark {name}").add([nearest.index], 1.0, "REPLACE")
            else:
                mark = bpy.data.objects.new(f"Landmark {name}", None)
                bpy.context.scene.collection.objects.link(mark)
                mark.parent, mark.location = owner, place
    update()
    _made, guides = transfer(target, hair, method="LANDMARKS")
    mapped = np.array(MATRICES["turned"])
    expected = world(guides_object(hair)) @ mapped[:3, :3].T + mapped[:3, 3]
    np.testing.assert_allclose(world(guides), expected, atol=2e-4)


def test_what_is_refused_leaves_nothing_behind(hair, sphere):
    target = other_sphere(3)
    while target.data.uv_layers:
        target.data.uv_layers.remove(target.data.uv_layers[0])
    before = len(bpy.data.objects), len(bpy.data.hair_curves), len(target.vertex_groups)
    for options, message in (
        ({"method": "UV"}, "UV map"),
        ({"method": "LANDMARKS"}, "no landmarks"),
        ({"alignment": "WORLD", "target": "nobody"}, "no mesh object"),
        ({"target": "Sphere"}, "another mesh"),
    ):
        select(target, hair)
        with pytest.raises(RuntimeError, match=message):
            bpy.ops.vellus.transfer_groom(**options)
    target.location.x = 50.0
    update()
    with pytest.raises(RuntimeError, match="found a place"):
        bpy.ops.vellus.transfer_groom(alignment="WORLD")
    assert (len(bpy.data.objects), len(bpy.data.hair_curves), len(target.vertex_groups)) == before


def test_hair_that_cannot_grow_there_leaves_nothing_behind(hair):
    hair.data.vellus.hair.density_image = "missing"
    target = other_sphere(3)
    before = len(bpy.data.objects), len(bpy.data.hair_curves), len(target.vertex_groups)
    select(target, hair)
    with pytest.raises(RuntimeError, match="no image"):
        bpy.ops.vellus.transfer_groom()
    assert (len(bpy.data.objects), len(bpy.data.hair_curves), len(target.vertex_groups)) == before


def test_undo_and_redo(hair):
    target = other_sphere(3)
    bpy.ops.ed.undo_push(message="before")
    transfer(target, hair)
    count = len(bpy.data.hair_curves)
    bpy.ops.ed.undo_push(message="transferred")
    bpy.ops.ed.undo()
    assert len(bpy.data.hair_curves) == count - 2
    bpy.ops.ed.redo()
    assert len(bpy.data.hair_curves) == count


def test_groups_of_maps_are_transferred(hair, sphere):
    """The other mesh gets the vertex groups of the maps of hair and guides, and the hair has these maps."""
    sphere.vertex_groups.new(name="short").add(list(range(60)), 1.0, "REPLACE")
    wanted = {api.set_map(hair, "strands.thickness", "group:short"), api.set_map(hair, "guides.tilt", "group:short")}
    update()
    target = other_sphere()
    made, _guides = transfer(target, hair)
    assert "short" in target.vertex_groups
    assert {*api.maps_of(made)} == wanted
    assert made.data.vellus.status == ""
