# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders do not depend on the viewport's level of subdivision when hair was generated or regenerated."""

import bmesh
import bpy
import numpy as np
import pytest
from mathutils import Vector

from hair_addon import api
from hair_addon.blender.data import scene as scene_data
from hair_addon.blender.data.simulation import guide_poses
from tests.support.dynamics.following import drawn_points, update
from tests.support.exchange.imported import select
from tests.support.pictures import render_probe
from tests.support.reading import attribute, evaluated_points, points, vertex_positions, write_points

RENDERED = (1, 2, 3)


def make_surface():
    """Return a mesh of bent quads, triangles and hexagons that a modifier subdivides, with UVs, masks and a shape
    key.
    """
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    edited = bmesh.new()
    edited.from_mesh(cube.data)
    bmesh.ops.subdivide_edges(edited, edges=edited.edges[:], cuts=2, use_grid_fill=True)
    for vertex in edited.verts:  # no face stays flat, and some are not convex
        vertex.co += 0.12 * Vector(np.sin(17.0 * np.array(vertex.co) + 31.0 * np.array(vertex.co.yzx)))
    bmesh.ops.dissolve_edges(edited, edges=edited.edges[:][:60:20])
    bmesh.ops.triangulate(edited, faces=[face for face in edited.faces if len(face.verts) == 4][:6])
    edited.to_mesh(cube.data)
    edited.free()
    assert {3, 4, 6} <= {len(polygon.vertices) for polygon in cube.data.polygons}
    fur, parted = (cube.vertex_groups.new(name=name) for name in ("fur", "left"))
    for vertex in cube.data.vertices:
        fur.add([vertex.index], 0.2 + 0.3 * vertex.co.x**2, "REPLACE")
        parted.add([vertex.index], float(vertex.co.x > 0.0), "REPLACE")
    cube.modifiers.new("Subdivision", "SUBSURF")
    cube.shape_key_add(name="Basis")
    key = cube.shape_key_add(name="Key")
    bent = vertex_positions(cube) * [1.0, 1.1, 0.9] + [0.0, 0.0, 0.1]
    key.data.foreach_set("co", bent.astype(np.float32).ravel())
    key.value = 0.7
    return cube


def show(levels):
    """Show a level in viewports: level 0 by disabling the modifier, level 1 by Simplify."""
    render, modifier = bpy.context.scene.render, bpy.data.objects["Cube"].modifiers["Subdivision"]
    render.use_simplify, render.simplify_subdivision, render.simplify_subdivision_render = levels == 1, 1, 6
    modifier.levels, modifier.show_viewport = 3 if levels == 1 else levels, levels > 0
    update()


def make_hair(levels):
    """Return new hair with styles, a mask and a region, generated while viewports show a level."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    surface = make_surface()
    show(levels)
    guides = api.GuideSettings(guide_count=30, density_group="fur")
    api.add_hair(surface, api.GroomSettings(guides, api.HairSettings(strand_count=200, region_group="left")))
    for style in ("CURL", "FRIZZ"):
        api.add_style(bpy.data.objects["Hair"].data, style, fit=False)
    update()


def rendered(render, at_levels):
    """Return {level: strands} of renders, and check that their roots are on the surface."""
    found = {}
    for levels in at_levels:
        bpy.data.objects["Cube"].modifiers["Subdivision"].render_levels = levels
        found[levels], apart = render("Hair", "Cube")
        assert apart < 1e-6
    return found


def made_of(render, at_levels=RENDERED):
    """Return stored data of hair that do not depend on the viewport's level, and renders."""
    guides, hair = bpy.data.objects["Guides"], bpy.data.objects["Hair"]
    state = guides.data.vellus.guides.length, hair.data.vellus.hair.radius, guides.data.vellus.status
    stored = points(guides), points(hair), attribute(hair, "id"), attribute(hair, "strand_random")
    # Of viewports too, as Blender and as Vellus draws them.
    np.testing.assert_allclose(drawn_points(hair), evaluated_points(hair), atol=1e-5)
    return state, stored, rendered(render, at_levels)


def require_same(found, wanted):
    """Assert that stored data are bit-identical, and renders equal up to the rounding of nearest points."""
    assert found[0] == wanted[0]
    for mine, its in zip(found[1], wanted[1], strict=True):
        np.testing.assert_array_equal(mine, its)
    for levels, strands in found[2].items():
        np.testing.assert_allclose(strands, wanted[2][levels], rtol=0.0, atol=2e-5)


@pytest.fixture
def render(scene):
    with render_probe.probing() as render:
        yield render


def test_hair_is_the_same_whatever_viewports_show(render, tmp_path):
    """New hair is the same at all viewport levels, and so is hair whose count or surface changes at another level."""
    path, first = str(tmp_path / "hair.blend"), {}

    def change(how):
        bpy.ops.wm.open_mainfile(filepath=path)
        show(opened)
        how()
        update()
        return made_of(render, (2,))

    def more():
        bpy.data.objects["Hair"].data.vellus.hair.strand_count = 220

    def edited():
        mesh = bpy.data.objects["Cube"].data
        for shape in (mesh.vertices, *(key.data for key in mesh.shape_keys.key_blocks)):
            shape[7].co.x += 0.05
        mesh.update()

    for made, opened in ((0, 2), (1, None), (2, None), (3, 1)):
        make_hair(made)
        found = {"new": made_of(render)}
        if opened is not None:
            bpy.ops.wm.save_as_mainfile(filepath=path)
            found |= {how.__name__: change(how) for how in (more, edited)}
            assert len(found["more"][1][1]) == 220
        for name, now in found.items():
            require_same(now, first.setdefault(name, now))


def test_cages_are_the_same_at_every_level(scene):
    """Cages have the same bits at every level, also behind a Mirror modifier and with flipped faces."""
    surface = make_surface()
    surface.add_rest_position_attribute = True
    for mirrors in (False, True):
        if mirrors:
            surface.modifiers.new("Mirror", "MIRROR")
            bpy.context.view_layer.objects.active = surface
            bpy.ops.object.modifier_move_to_index(modifier="Mirror", index=0)
        cages = []
        for levels in (0, 1, 2, 3):
            show(levels)
            read = scene_data.read_surface(surface, bpy.context.evaluated_depsgraph_get())
            assert read.cage.is_cage
            cages.append(read.cage)
        for cage in cages[1:]:
            assert cage.topology == cages[0].topology
            for name in ("rest", "posed"):
                np.testing.assert_array_equal(getattr(cage, name), getattr(cages[0], name))
            np.testing.assert_array_equal(cage.mesh.triangles, cages[0].mesh.triangles)
            if not mirrors:
                np.testing.assert_array_equal(cage.corner_uvs, cages[0].corner_uvs)


def test_guides_begin_on_the_surface_wherever_they_are_simulated_or_attached(scene):
    """Simulated and attached guides have their roots on the subdivided surface, not on the cage on which they were
    placed.
    """
    make_hair(2)
    guides, surface = bpy.data.objects["Guides"], bpy.data.objects["Cube"]
    pose = guide_poses.read(guides.data, bpy.context.evaluated_depsgraph_get(), 1.0)
    world = pose.to_world(points(guides))
    assert np.linalg.norm(pose.slides, axis=1).max() > 1e-3
    np.testing.assert_allclose(world[:, 0], pose.root_positions, atol=1e-6)
    np.testing.assert_allclose(pose.to_rest(world), points(guides), atol=1e-5)
    write_points(guides, points(guides) * np.float32([1.0, 1.0, 1.0 + 1e-6]))  # combed: it is to stay
    seen = evaluated_points(guides)
    mesh = bpy.data.meshes.new_from_object(surface.evaluated_get(bpy.context.evaluated_depsgraph_get()))
    other = bpy.data.objects.new("Other", mesh)
    bpy.context.scene.collection.objects.link(other)
    select(other, guides)
    assert bpy.ops.vellus.attach_to_surface() == {"FINISHED"}
    update()
    np.testing.assert_allclose(evaluated_points(guides), seen, atol=2e-5)
