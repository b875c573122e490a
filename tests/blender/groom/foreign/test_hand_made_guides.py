# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves of any origin become guides in one click: no point moves in the world, and they are never regenerated."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from hair_addon.blender.data.strands import curves
from hair_addon.blender.groom import pipeline
from hair_addon.blender.host import running
from hair_addon.blender.live import live_hair
from hair_addon.core.grooming.groom import GuideSettings
from hair_addon.core.params import declared
from tests.support.dynamics.following import surface_points, update
from tests.support.exchange.imported import curves_object, lines_on, select, stored, use, world
from tests.support.reading import attribute, write_points

# ------------------------------------------------------------------------------------------ where the hair is


def made_of_quick_fur(head, _folder):
    select(head)
    bpy.ops.object.quick_fur(density="LOW", length=0.2, view_percentage=0.3)
    return next(o for o in bpy.data.objects if o.type == "CURVES")


def made_of_particles(head, _folder):
    select(head)
    bpy.ops.object.particle_system_add()
    settings = head.particle_systems[0].settings
    settings.type, settings.count, settings.hair_length = "HAIR", 40, 0.3
    update()
    bpy.ops.curves.convert_from_particle_system()
    made = bpy.context.object
    head.modifiers.clear()
    return made


def made_of_empty_hair(head, _folder):
    """Return Empty Hair with curves as by the Add brush: Catmull-Rom splines with few points."""
    select(head)
    bpy.ops.object.curves_empty_hair_add()
    made = bpy.context.object
    made.data.add_curves([8] * 30)
    lines = lines_on(head, np.random.default_rng(3), 30, 8, 8)
    local = np.linalg.inv(np.array(made.matrix_world))
    points = np.concatenate([line @ local[:3, :3].T + local[:3, 3] for line in lines])
    made.data.attributes["position"].data.foreach_set("vector", points.astype(np.float32).ravel())
    update()
    return made


def made_of_a_file(write, read, ending):
    def made(head, folder):
        curves_object(list(lines_on(head, np.random.default_rng(4))), "Strands")
        path = str(folder / f"strands{ending}")
        write(path)
        bpy.data.objects.remove(bpy.data.objects["Strands"])
        before = set(bpy.data.objects)
        read(path)
        update()
        new = set(bpy.data.objects) - before
        for other in [o for o in new if o.type == "MESH"]:
            bpy.data.objects.remove(other)
        return next(o for o in bpy.data.objects if o.type == "CURVES")

    return made


def made_of_legacy_curves(head, _folder):
    """Return legacy curve objects: Bezier, NURBS and polylines, as tubes."""
    datablock = bpy.data.curves.new("Legacy", "CURVE")
    datablock.dimensions, datablock.bevel_depth = "3D", 0.01
    rng = np.random.default_rng(5)
    for kind, line in zip(("BEZIER", "NURBS", "POLY"), lines_on(head, rng, 3, 4, 4), strict=True):
        spline = datablock.splines.new(kind)
        if kind == "BEZIER":
            spline.bezier_points.add(3)
            for point, place in zip(spline.bezier_points, line, strict=True):
                point.co, point.handle_left_type, point.handle_right_type = place, "AUTO", "AUTO"
        else:
            spline.points.add(3)
            for point, place in zip(spline.points, line, strict=True):
                point.co = (*place, 1.0)
            spline.use_endpoint_u = True
    made = bpy.data.objects.new("Legacy", datablock)
    bpy.context.scene.collection.objects.link(made)
    update()
    return made


def as_seen(made):
    """Return (N, 3) points in the world; for a tube those of its axis."""
    if made.type != "CURVE":
        return world(made)
    made.data.bevel_depth = 0.0
    update()
    nodes_free = world_of_polylines(made)
    made.data.bevel_depth = 0.01
    update()
    return nodes_free


def world_of_polylines(made):
    """Return (N, 3) vertices of the mesh edges that Blender makes of thin curves."""
    mesh = made.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    points = np.array([vertex.co for vertex in mesh.vertices])
    matrix = np.array(made.matrix_world)
    return points @ matrix[:3, :3].T + matrix[:3, 3]


SOURCES = {
    "quick fur": made_of_quick_fur,
    "particles": made_of_particles,
    "empty hair": made_of_empty_hair,
    "legacy": made_of_legacy_curves,
    "usd": made_of_a_file(
        lambda path: bpy.ops.wm.usd_export(filepath=path), lambda path: bpy.ops.wm.usd_import(filepath=path), ".usdc"
    ),
    "alembic": made_of_a_file(
        lambda path: bpy.ops.wm.alembic_export(filepath=path, as_background_job=False, end=1),
        lambda path: bpy.ops.wm.alembic_import(filepath=path, as_background_job=False),
        ".abc",
    ),
}


@pytest.mark.parametrize("source", SOURCES)
def test_hair_stays_where_the_artist_sees_it(head, tmp_path, source):
    """Hair of a posed head stays in place, and its guides are stored at the rest pose."""
    made = SOURCES[source](head, tmp_path)
    twist = head.modifiers.new("Twist", "SIMPLE_DEFORM")
    twist.deform_method, twist.angle = "TWIST", 0.4
    update()
    before, name = as_seen(made), made.name
    assert use(made, surface="Sphere") == {"FINISHED"}
    np.testing.assert_allclose(world(made), before, atol=2e-5)
    assert (made.name, made.type, made.data.vellus.kind, made.parent) == (name, "CURVES", "GUIDES", head)
    np.testing.assert_allclose(np.array(made.matrix_local), np.eye(4), atol=1e-6)
    np.testing.assert_array_equal(np.array(made.matrix_basis), np.eye(4))
    assert [modifier.name for modifier in made.modifiers] == ["Follow Surface"]
    assert "Hair" in bpy.data.objects and bpy.data.objects["Hair"].data.vellus.status == ""


def test_names_materials_and_attributes_of_the_curves_are_kept(imported, head):
    use(imported)
    assert [m.name for m in imported.data.materials] == ["Artist's"]
    np.testing.assert_array_equal(attribute(imported, "clump"), np.arange(60))
    assert sorted(set(curves.point_counts(imported.data))) == list(range(2, 13))


def test_guides_follow_only_their_surface(imported, head, scene):
    """A separate parent, an offset and a constraint are removed, and guides stay in place."""
    holder = bpy.data.objects.new("Holder", None)
    scene.collection.objects.link(holder)
    holder.location, imported.parent, imported.delta_location = (0.0, 0.1, 0.0), holder, (0.0, 0.0, 0.05)
    holder.rotation_euler.z = 0.02
    imported.constraints.new("COPY_ROTATION").target = holder
    update()
    before = world(imported)
    use(imported, surface="Sphere")
    np.testing.assert_allclose(world(imported), before, atol=2e-5)
    holder.location.x = 5.0
    update()
    np.testing.assert_allclose(world(imported), before, atol=2e-5)


def test_curves_in_place_keep_their_bits(head, tmp_path):
    made = made_of_empty_hair(head, tmp_path)
    before = stored(made)
    made.modifiers.clear()
    use(made)
    np.testing.assert_array_equal(stored(made), before)


def test_curves_from_tip_to_root_are_turned_with_their_attributes(head, rng):
    made = curves_object([line[::-1] for line in lines_on(head, rng)])
    radii = made.data.attributes.new("radius", "FLOAT", "POINT")
    along = np.concatenate([np.linspace(0.0, 1.0, count) for count in curves.point_counts(made.data)])
    radii.data.foreach_set("value", along.astype(np.float32))
    before = np.sort(world(made).round(4), axis=0)
    use(made)
    np.testing.assert_allclose(np.sort(world(made).round(4), axis=0), before, atol=2e-4)
    counts = curves.point_counts(made.data)
    firsts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    size = np.cbrt(abs(head.matrix_world.determinant()))  # of the head, whose units the widths are in now
    np.testing.assert_allclose(size * curves.read_radii(made.data)[firsts], 1.0, rtol=1e-5)
    np.testing.assert_allclose(stored(made)[firsts], surface_points(made), atol=0.02)  # a polyhedron's faces


def test_the_surface_carries_them(imported, head):
    use(imported)
    before, places = world(imported), surface_points(imported)
    firsts = np.concatenate([[0], np.cumsum(curves.point_counts(imported.data))[:-1]])
    apart = np.linalg.norm(stored(imported)[firsts] - places, axis=1)
    twist = head.modifiers.new("Twist", "SIMPLE_DEFORM")
    twist.deform_method, twist.angle = "TWIST", 1.0
    update()
    assert np.abs(world(imported) - before).max() > 0.1
    local = np.linalg.inv(np.array(head.matrix_world))
    carried = (world(imported) @ local[:3, :3].T + local[:3, 3])[firsts]
    np.testing.assert_allclose(np.linalg.norm(carried - surface_points(imported), axis=1), apart, atol=1e-5)


def roots_of_strands():
    """Return (S, 3) roots in the surface's coordinates."""
    hair = bpy.data.objects["Hair"]
    return stored(hair).reshape(len(hair.data.curves), -1, 3)[:, 0]


@pytest.mark.parametrize("levels", [0, 1])
def test_hair_grows_where_the_guides_are(head, rng, levels):
    """Hair of guides on the upper half grows only there, also on a subdivided surface and when it is regenerated."""
    if levels:
        head.modifiers.new("Subdivision", "SUBSURF").levels = levels
    matrix = np.linalg.inv(np.array(head.matrix_world))
    lines = [line for line in lines_on(head, rng, 600) if (line[0] @ matrix[:3, :3].T + matrix[:3, 3])[2] > 0.3]
    use(curves_object(lines), strand_count=1000)
    group = bpy.data.objects["Hair"].data.vellus.hair.density_group
    assert group in head.vertex_groups
    assert_near_guides()
    assert roots_of_strands()[:, 2].max() > 0.9
    before = roots_of_strands()
    bpy.data.objects["Hair"].data.vellus.hair.keep_length = 0.5
    head.data.update_tag()
    update()
    np.testing.assert_array_equal(roots_of_strands(), before)
    bpy.data.objects["Hair"].data.vellus.hair.seed = 9
    update()
    assert not np.array_equal(roots_of_strands(), before)
    assert_near_guides()


def assert_near_guides():
    """Assert that each root is near a guide's root: within the spacing of guides and an edge of the surface."""
    counts = curves.point_counts(bpy.data.objects["Imported"].data)
    guides = stored(bpy.data.objects["Imported"])[np.cumsum(counts) - counts]
    apart = np.linalg.norm(guides[:, None] - guides, axis=-1)
    from_guides = np.linalg.norm(roots_of_strands()[:, None] - guides, axis=-1).min(axis=1)
    assert from_guides.max() < 1.3 * np.sort(apart, axis=1)[:, 4].max() + 0.15


def test_guides_all_over_need_no_group(head, rng):
    use(curves_object(list(lines_on(head, rng, 600))))
    assert bpy.data.objects["Hair"].data.vellus.hair.density_group == "" and len(head.vertex_groups) == 1


# ------------------------------------------------------------------------------------------ never made again


def test_hand_made_guides_are_never_regenerated(imported, head, tmp_path):
    use(imported)
    before = stored(imported)
    for name, default, details in declared(GuideSettings):
        value = not default if isinstance(default, bool) else "" if isinstance(default, str) else details.high
        setattr(imported.data.vellus.guides, name, min(value, 7) if isinstance(value, int | float) else value)
        update()
        np.testing.assert_array_equal(stored(imported), before)
    path = str(tmp_path / "kept.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    imported = bpy.data.objects["Imported"]
    imported.data.vellus.guides.length = 3.0
    update()
    np.testing.assert_array_equal(stored(imported), before)
    with pytest.raises(Exception, match="Hand-made"):
        pipeline.require_uncombed(imported.data)


def test_an_edited_surface_carries_them_and_they_stay_hand_made(imported, head):
    use(imported)
    before = world(imported)
    head.data.transform(Matrix.Translation((0.0, 0.0, 0.5)))
    head.data.update()
    update()
    lift = np.array(head.matrix_world)[:3, :3] @ [0.0, 0.0, 0.5]
    np.testing.assert_allclose(world(imported), before + lift, atol=1e-4)
    assert curves.is_hand_made(imported.data)
    imported.data.vellus.guides.length = 2.0
    update()
    np.testing.assert_allclose(world(imported), before + lift, atol=1e-4)


def test_hair_follows_them_while_they_are_combed(imported, monkeypatch):
    """In a window, strands follow a stroke on guides of unequal point counts without being bound again."""
    use(imported)
    monkeypatch.setattr(running, "has_window", lambda: True)
    hair = bpy.data.objects["Hair"]
    before = stored(hair)
    bound = live_hair.bindings.of(hair.data)
    combed = stored(imported)
    combed[5:40] += np.float32([0.0, 0.1, 0.05])
    firsts = np.concatenate([[0], np.cumsum(curves.point_counts(imported.data))[:-1]])
    combed[firsts] = stored(imported)[firsts]
    write_points(imported, combed)
    assert live_hair.bindings.of(hair.data) is bound
    live_hair.write_all()
    assert np.abs(stored(hair) - before).max() > 0.02
    depsgraph = bpy.context.evaluated_depsgraph_get()
    wanted = pipeline.bind_hair(*pipeline.inputs_of(hair.data), depsgraph).points.reshape(-1, 3)
    np.testing.assert_allclose(stored(hair), wanted, atol=1e-6)


def test_roots_off_the_surface_are_remembered_and_not_searched_again(head, rng, monkeypatch):
    made = curves_object(list(lines_on(head, rng, lift=0.05)))
    use(made)
    searched = []
    real = curves.nearest_roots
    monkeypatch.setattr(curves, "nearest_roots", lambda surface, places: (searched.append(1), real(surface, places))[1])
    surface = pipeline.scene.read_surface(head, bpy.context.evaluated_depsgraph_get())
    curves.read_guides(made.data, surface, "cpu")
    assert searched == []
