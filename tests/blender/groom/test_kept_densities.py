# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides and strands with a density keep it when their surface, its scale or its mask changes."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from hair_addon import api
from hair_addon.blender.groom.transfer import system_transfer
from hair_addon.core.grooming.transfer_settings import TransferSettings
from hair_addon.core.long_work import run_now

COUNT, GUIDE_COUNT = 200, 20
TRANSFORMS = [(0.01,) * 3, (100.0,) * 3, (1.0, 2.0, 0.3), (-1.0, 1.0, 1.0)]


def area_of(surface, weights=None):
    """Return the area [cm²] of a mesh object in the world, with weights (V,) of vertices."""
    mesh, axes = surface.data, np.array(surface.matrix_world.to_3x3())
    mesh.calc_loop_triangles()
    triangles = np.array([list(one.vertices) for one in mesh.loop_triangles])
    corners = (np.array([list(vertex.co) for vertex in mesh.vertices]) @ axes.T)[triangles]
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    shares = 1.0 if weights is None else weights[triangles].mean(axis=1)
    return 1e4 * bpy.context.scene.unit_settings.scale_length**2 * float((areas * shares).sum())


def update():
    bpy.context.view_layer.update()


def grow(surface, area=None):
    """Return hair with a density for `COUNT` strands and `GUIDE_COUNT` guides on an area [cm²]."""
    update()
    area = area_of(surface) if area is None else area
    guides = api.GuideSettings(guide_density=GUIDE_COUNT / area, relax_iterations=0)
    return api.add_hair(surface, api.GroomSettings(guides, api.HairSettings(strand_density=COUNT / area)))[1]


def require_density(hair, factor=1.0):
    """Check the numbers of hair and of its guides against those of `grow`."""
    guides = hair.vellus.guide_curves
    assert abs(len(hair.curves) - factor * COUNT) <= 1 and len(hair.curves) == hair.vellus.hair.strand_count
    assert abs(len(guides.curves) - factor * GUIDE_COUNT) <= 1
    assert len(guides.curves) == guides.vellus.guides.guide_count
    assert not hair.vellus.status and not hair.vellus.is_stale


@pytest.mark.parametrize("scale", TRANSFORMS)
def test_a_density_is_kept_when_the_surface_is_scaled(sphere, scale):
    sphere.scale = scale
    hair = grow(sphere)
    require_density(hair)
    sphere.location, sphere.rotation_euler = (3.0, 1.0, 0.0), (0.5, 0.2, 0.1)
    update()
    before = hair.vellus.root_key
    require_density(hair)
    sphere.scale = 1.5 * np.array(scale)
    update()
    require_density(hair, 1.5**2)
    assert hair.vellus.root_key != before


def test_square_centimeters_are_those_of_the_scenes_units(sphere):
    bpy.context.scene.unit_settings.scale_length = 0.01
    assert area_of(sphere) < 20.0
    require_density(grow(sphere))


def test_a_density_is_kept_when_the_unit_scale_changes(sphere):
    """The next update of any object after a change of Unit Scale sets the numbers."""
    hair = grow(sphere)
    for unit in (2.0, 1.0, 1e5, 1.0):
        bpy.context.scene.unit_settings.scale_length = unit
        sphere.location.x += 1.0
        update()
        if unit == 1e5:
            assert "decrease Strand Density" in hair.vellus.status
        else:
            require_density(hair, unit**2)


def test_a_density_is_kept_where_the_mask_is_painted(sphere):
    weights = np.linspace(0.0, 1.0, len(sphere.data.vertices), dtype=np.float32)
    group = sphere.vertex_groups.new(name="Half")
    for vertex, weight in enumerate(weights):
        group.add([vertex], weight, "REPLACE")
    hair = grow(sphere)
    hair.vellus.guide_curves.vellus.guides.density_group = "Half"
    update()
    require_density(hair, area_of(sphere, weights) / area_of(sphere))
    for vertex in range(len(weights)):
        group.add([vertex], 0.5, "REPLACE")
    sphere.data.update_tag()
    update()
    require_density(hair, 0.5)


def test_a_density_is_kept_when_the_mesh_is_edited_and_undone(sphere):
    hair, name = grow(sphere), sphere.name
    bpy.ops.ed.undo_push(message="Grown")
    sphere.scale = (2.0,) * 3
    update()
    bpy.ops.ed.undo_push(message="Scaled")
    require_density(hair, 4.0)
    bpy.ops.ed.undo()
    require_density(bpy.data.hair_curves["Hair"])
    bpy.ops.ed.redo()
    require_density(bpy.data.hair_curves["Hair"], 4.0)
    mesh = bpy.data.objects[name].data
    mesh.transform(Matrix.Scale(0.5, 4))
    mesh.update()
    update()
    require_density(bpy.data.hair_curves["Hair"])


def test_a_density_goes_to_another_mesh(sphere):
    hair = grow(sphere)
    copy = sphere.copy()
    copy.data = sphere.data.copy()
    copy.scale = (2.0,) * 3
    bpy.context.collection.objects.link(copy)
    update()
    guides, settings = hair.vellus.guide_curves, TransferSettings(alignment="LOCAL")
    work = system_transfer.transferring(guides, hair, copy, settings, bpy.context.evaluated_depsgraph_get())
    carried = run_now(work).hair
    assert abs(len(carried.curves) - 4 * COUNT) <= 1
    assert len(carried.vellus.guide_curves.curves) == len(guides.curves), "combed guides are carried, not placed"
    require_density(hair)


def test_hair_of_another_file_keeps_its_number(sphere, tmp_path):
    grow(sphere)
    path, collection = str(tmp_path / "character.blend"), bpy.data.collections.new("Character")
    bpy.context.scene.collection.children.link(collection)
    for part in (*bpy.context.scene.collection.objects, *(o for o in bpy.data.objects if o.type == "CURVES")):
        if part.name not in collection.objects:
            collection.objects.link(part)
    bpy.data.libraries.write(path, {collection})
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(path, link=True) as (_there, here):
        here.collections = ["Character"]
    bpy.context.scene.collection.children.link(bpy.data.collections["Character"])
    bpy.data.collections["Character"].override_hierarchy_create(bpy.context.scene, bpy.context.view_layer)
    update()
    surface = next(o for o in bpy.context.view_layer.objects if o.type == "MESH" and o.override_library is not None)
    surface.scale = (2.0,) * 3
    update()
    hair = next(o.data for o in bpy.context.view_layer.objects if o.type == "CURVES" and o.data.vellus.kind == "HAIR")
    assert len(hair.curves) == hair.vellus.hair.strand_count == COUNT and not hair.vellus.status


def test_combed_guides_keep_their_number(sphere):
    hair = grow(sphere)
    guides = hair.vellus.guide_curves
    guides.points[-1].position *= 1.1
    guides.update_tag()
    update()
    sphere.scale = (2.0,) * 3
    update()
    assert len(guides.curves) == GUIDE_COUNT and not guides.vellus.status
    assert abs(len(hair.curves) - 4 * COUNT) <= 1


def test_keep_density_keeps_the_number_and_a_second_press_stops(sphere):
    bpy.ops.vellus.add_hair(guide_count=GUIDE_COUNT, strand_count=COUNT, relax_iterations=0)
    hair = bpy.context.object.data
    positions = np.array([list(point.position) for point in hair.points])
    for keep in (bpy.ops.vellus.keep_strand_density, bpy.ops.vellus.keep_guide_density):
        assert keep() == {"FINISHED"}
    update()
    require_density(hair)
    np.testing.assert_array_equal([list(point.position) for point in hair.points], positions)
    assert hair.vellus.hair.strand_density == pytest.approx(COUNT / area_of(sphere))
    bpy.ops.vellus.keep_strand_density()
    sphere.scale = (2.0,) * 3
    update()
    assert len(hair.curves) == COUNT and hair.vellus.hair.strand_density == 0.0
    assert abs(len(hair.vellus.guide_curves.curves) - 4 * GUIDE_COUNT) <= 1


def test_without_auto_update_the_number_waits_until_it_is_on(sphere):
    hair = grow(sphere)
    hair.vellus.guide_curves.vellus.guides.guide_density = 0.0
    hair.vellus.hair.strand_density *= 1.0  # in single precision, as hair is bound now
    update()
    hair.vellus.is_live = False
    sphere.scale = (2.0,) * 3
    update()
    assert len(hair.curves) == COUNT and hair.vellus.is_stale
    hair.vellus.is_live = True
    hair.update_tag()
    update()
    assert abs(len(hair.curves) - 4 * COUNT) <= 1 and not hair.vellus.is_stale
    assert len(hair.vellus.guide_curves.curves) == GUIDE_COUNT


def test_too_many_strands_are_refused_in_one_sentence(sphere):
    hair = grow(sphere)
    hair.vellus.hair.strand_density = 1e6
    update()
    assert "decrease Strand Density" in hair.vellus.status and len(hair.curves) == COUNT
