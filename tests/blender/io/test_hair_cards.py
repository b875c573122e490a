# SPDX-License-Identifier: GPL-3.0-or-later
"""Cards and tubes in the scene have the announced counts, textures show the strands, and undo removes everything."""

import itertools

import bmesh
import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.io import hair_cards
from hair_addon.blender.render import card_pictures
from hair_addon.blender.settings import properties
from hair_addon.core.cards import best_placement, texels
from hair_addon.core.cards.card_settings import CardSettings
from hair_addon.core.errors import HairError
from hair_addon.core.long_work import run_now
from tests.support.dynamics.following import update
from tests.support.exchange.exported import world
from tests.support.reading import attribute

SIZE = 256


def pixels(image):
    found = np.empty((*image.size[::-1], 4), np.float32)
    image.pixels.foreach_get(found.ravel())
    return found


def coordinates(mesh):
    found = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", found.ravel())
    return found


def test_levels_have_the_polygons_and_textures_that_were_promised(hair):
    settings = CardSettings(card_count=24, segment_count=4, level_count=2, texture_size=SIZE)
    made = run_now(hair_cards.making_cards(hair.data, settings))
    sphere = bpy.data.objects["Sphere"]
    for index, (level, wanted) in enumerate(zip(made, settings.levels(500), strict=True)):
        mesh = level.mesh_object.data
        assert level.mesh_object.name == f"Hair Cards LOD{index}" and level.mesh_object.parent == sphere
        assert len(mesh.polygons) * 2 == level.triangle_count == wanted.triangle_count
        assert len(mesh.vertices) == wanted.vertex_count and not mesh.validate()
        assert level.mesh_object.hide_render == (index > 0)
        assert set(level.images) == set(texels.MAPS)
        assert {tuple(image.size) for image in level.images.values()} == {(wanted.texture_size,) * 2}
        assert all(image.packed_file for image in level.images.values())
        normals = 2.0 * pixels(level.images["normal"])[..., :3] - 1.0
        assert np.abs(np.linalg.norm(normals, axis=-1) - 1.0).max() < 0.02  # of 8 bits
        color = pixels(level.images["color"])
        np.testing.assert_array_equal(color[..., 3], pixels(level.images["alpha"])[..., 0])
        assert 0.1 < (color[..., 3] > 0.0).mean() < 1.0 and (color[..., :3].max(axis=-1) > 0.05).all()
    assert {o.name for o in bpy.data.collections["Hair Cards"].objects} == {o.mesh_object.name for o in made}


def test_cards_are_where_the_strands_are(head, rng):
    """On a turned, moved and scaled surface, the boxes of hair and cards differ by less than a card."""
    bpy.context.view_layer.objects.active = head
    bpy.ops.vellus.add_hair(guide_count=30, strand_count=200, length=0.4)
    update()
    strands = world(bpy.context.object).reshape(-1, 3)
    (cards,) = api.make_hair_cards(bpy.context.object, card_count=60, texture_size=SIZE)
    update()
    places = coordinates(cards.data) @ np.array(cards.matrix_world)[:3, :3].T + np.array(cards.matrix_world)[:3, 3]
    for found, wanted in ((places.min(axis=0), strands.min(axis=0)), (places.max(axis=0), strands.max(axis=0))):
        np.testing.assert_allclose(found, wanted, atol=0.15)
    tubes = api.make_hair_tubes(bpy.context.object, tube_count=0, point_count=41, thickness=1e-3)
    places = coordinates(tubes.data) @ np.array(head.matrix_world)[:3, :3].T + np.array(head.matrix_world)[:3, 3]
    np.testing.assert_allclose(places.min(axis=0), strands.min(axis=0), atol=1e-2)


def test_a_card_covers_as_much_as_its_strands_from_the_same_side(scene):
    """A card of a tuft on a plane covers as much as its strands seen along the card's normal, within 3 percent."""
    bpy.ops.mesh.primitive_plane_add(size=0.1)
    bpy.ops.vellus.add_hair(
        guide_count=12, strand_count=60, length=0.2, length_variation=0.3, gravity=0.0, tilt=0.1, radius=4e-4
    )
    hair = bpy.context.object
    settings = CardSettings(card_count=1, segment_count=1, texture_size=512)
    (made,) = run_now(hair_cards.making_cards(hair.data, settings))
    update()
    mesh = made.mesh_object.data
    face, corners = mesh.polygons[0], coordinates(mesh)[list(mesh.polygons[0].vertices)]
    along = (corners[3] - corners[0]) / np.linalg.norm(corners[3] - corners[0])
    across = np.cross(along, np.array(face.normal))
    radii = attribute(hair, "radius").reshape(60, -1)
    seen = drawn_area(world(hair) @ np.stack([across, along], axis=1), radii)
    uvs = np.array([mesh.uv_layers[0].uv[i].vector for i in face.loop_indices])
    scale = np.ptp(uvs[:, 1]) / np.linalg.norm(corners[3] - corners[0])
    covered = pixels(made.images["alpha"])[..., 0].mean() / scale**2
    assert covered == pytest.approx(seen, rel=0.03)


def drawn_area(points, radii, step=1.5e-4):
    """Return the area [m²] that (S, P, 2) strands with (S, P) radii cover together, by squares of a given side."""
    low = points.min(axis=(0, 1)) - 0.01
    found = np.zeros(np.ceil((points.max(axis=(0, 1)) + 0.01 - low) / step).astype(int), bool)
    for strand, its_radii in zip(points, radii, strict=True):
        for first, second, radius in zip(strand[:-1], strand[1:], its_radii, strict=False):
            begin, end = ((np.sort([first, second], axis=0)[[0, 1]] - low) / step).astype(int)
            begin, end = begin - 8, end + 9
            places = (np.stack(np.mgrid[begin[0] : end[0], begin[1] : end[1]], axis=-1) + 0.5) * step + low
            edge = second - first
            part = np.clip((places - first) @ edge / (edge @ edge), 0.0, 1.0)
            away = np.linalg.norm(places - first - part[..., None] * edge, axis=-1)
            found[begin[0] : end[0], begin[1] : end[1]] |= away < radius
    return found.sum() * step**2


def test_samples_show_the_nearest_strand_there(rng):
    """Each sample shows the nearest strand by brute force, for strands that cross at several heights."""
    places = rng.uniform(0.1, 0.9, (9, 4, 3)).astype(np.float32)
    places[..., 2] *= 0.2
    radii = np.full((9, 4), 0.02, np.float32)
    strands = texels.PlacedStrands(places, radii, np.ones((9, 4, 3)), np.zeros(9), (0.0, 1.0))
    picture = card_pictures.CardPicture(strands, 64)
    found = [picture.segments(rows, 0)[0] for rows in picture.strips()]
    found = np.concatenate(found)
    y, x = (np.indices(found.shape) + 0.5) / len(found)
    highest, wanted, border = np.full(found.shape, -1.0), np.full(found.shape, texels.NO_STRAND), np.zeros(found.shape)
    for index, (first, second) in enumerate((a, b) for strand in places for a, b in itertools.pairwise(strand)):
        edge = second[:2] - first[:2]
        part = ((x - first[0]) * edge[0] + (y - first[1]) * edge[1]) / (edge @ edge)
        away = np.abs((x - first[0]) * edge[1] - (y - first[1]) * edge[0]) / np.linalg.norm(edge)
        height = first[2] + part * (second[2] - first[2])
        is_seen = (away < 0.02) & (part > 0.0) & (part < 1.0) & (height > highest)
        highest[is_seen], wanted[is_seen] = height[is_seen], index
        border += (np.abs(away - 0.02) < 0.01) | ((np.abs(part * (1.0 - part)) < 0.1) & (away < 0.03))
    inside = border == 0
    assert inside.mean() > 0.2 and (wanted[inside] >= 0).any()
    assert (found == wanted)[inside].mean() > 0.99


def test_textures_are_written_to_a_folder(hair, tmp_path):
    bpy.ops.vellus.hair_cards(card_count=10, segment_count=2, texture_size=SIZE, folder=str(tmp_path / "textures"))
    names = {path.name for path in (tmp_path / "textures").iterdir()}
    assert names == {f"Hair_Cards_LOD0_{kind}.png" for kind in texels.MAPS}
    made = bpy.data.images["Hair Cards LOD0 depth"]
    assert made.filepath == str(tmp_path / "textures" / "Hair_Cards_LOD0_depth.png") and not made.packed_file
    again = bpy.data.images.load(made.filepath)
    again.colorspace_settings.name = "Non-Color"
    np.testing.assert_array_equal(pixels(again), pixels(made))


def test_all_textures_are_saved_with_the_file_and_appended_with_the_cards(hair, tmp_path):
    bpy.ops.vellus.hair_cards(card_count=4, segment_count=2, texture_size=64, level_count=1)
    found = {image.name: pixels(image) for image in bpy.data.images if image.name.startswith("Hair Cards")}
    assert {*found} == {f"Hair Cards LOD0 {kind}" for kind in texels.MAPS}
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "cards.blend"))
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "cards.blend")) as (_there, here):
        here.objects = ["Hair Cards LOD0"]
    for name, values in found.items():
        np.testing.assert_array_equal(pixels(bpy.data.images[name]), values)
    bpy.data.objects.remove(here.objects[0])
    bpy.ops.outliner.orphans_purge(do_recursive=True)
    assert not [image for image in bpy.data.images if image.name.startswith("Hair Cards")]


def test_textures_replace_those_of_the_same_hair_and_of_no_other(hair, tmp_path):
    def files(name):
        hair.data.name = name
        (made,) = api.make_hair_cards(hair, card_count=2, segment_count=1, texture_size=128, folder=tmp_path)
        nodes = made.data.materials[0].node_tree.nodes
        return {node.image.filepath for node in nodes if node.bl_idname == "ShaderNodeTexImage"}

    first, second = files("Top/L"), files("Top:L")
    assert first and first.isdisjoint(second) and len([*tmp_path.iterdir()]) == 2 * len(texels.MAPS)
    assert (files("Top/L"), files("Top:L")) == (first, second)


def test_undo_takes_cards_and_tubes_away(hair):
    bpy.ops.ed.undo_push(message="hair")
    before = {kind: len(getattr(bpy.data, kind)) for kind in ("objects", "meshes", "collections", "materials")}
    for operator, settings in (
        (bpy.ops.vellus.hair_cards, {"card_count": 5, "segment_count": 2, "texture_size": SIZE}),
        (bpy.ops.vellus.hair_tubes, {"tube_count": 5}),
    ):
        operator(**settings)
        bpy.ops.ed.undo_push(message="made")
        assert len(bpy.data.objects) == before["objects"] + 1
        assert bpy.context.object.name == "Hair"  # redo begins from here
        bpy.ops.ed.undo()
        assert {kind: len(getattr(bpy.data, kind)) for kind in before} == before


def test_tubes_are_closed_in_blender_too(hair):
    made = api.make_hair_tubes(hair, tube_count=7, side_count=5, point_count=6)
    mesh = bmesh.new()
    mesh.from_mesh(made.data)
    assert len(mesh.verts) == 7 * 5 * 6 and all(edge.is_manifold and edge.is_contiguous for edge in mesh.edges)
    assert mesh.calc_volume(signed=True) > 0.0
    mesh.free()
    assert len(made.data.materials) == 1 and not made.data.validate()


def test_what_cannot_be_made_is_refused_and_leaves_nothing(hair, tmp_path):
    count = len(bpy.data.objects), len(bpy.data.images)
    with pytest.raises(HairError, match="exceed 5000000"):
        api.make_hair_tubes(hair, tube_count=0, side_count=32, point_count=512)
    (tmp_path / "file").touch()
    with pytest.raises(HairError, match="cannot be written"):
        api.make_hair_cards(hair, folder=tmp_path / "file")
    with pytest.raises(HairError, match=r"relative to the \.blend"):
        api.make_hair_cards(hair, folder="//textures")
    bpy.data.hair_curves["Hair"].surface = None
    with pytest.raises(HairError, match="no surface"):
        api.make_hair_cards(hair)
    assert (len(bpy.data.objects), len(bpy.data.images)) == count


def test_the_error_of_cards_is_reported_and_changes_nothing(hair):
    settings = {"card_count": 24, "segment_count": 3, "texture_size": SIZE}
    (plain,) = api.make_hair_cards(hair, **settings)
    assert "flip_error" not in plain
    (measured,) = api.make_hair_cards(hair, **settings, error_measure="MEASURED")
    np.testing.assert_array_equal(coordinates(measured.data), coordinates(plain.data))
    assert 0.0 < measured["coverage_error"] + measured["flip_error"] < 2.0


@pytest.mark.long
def test_a_minimized_placement_has_less_error_with_as_many_polygons(hair, monkeypatch):
    for name, values in (("_CROSSED", (1.0,)), ("_OUTWARD", ()), ("_TIP", ())):
        monkeypatch.setattr(best_placement, name, values)
    monkeypatch.setattr(best_placement, "MOST_EXCHANGES", 2)
    settings = {"card_count": 60, "segment_count": 3, "texture_size": SIZE}
    (measured,) = api.make_hair_cards(hair, **settings, error_measure="MEASURED")
    (best,) = api.make_hair_cards(hair, **settings, error_measure="MINIMIZED")
    assert len(best.data.polygons) == len(measured.data.polygons)
    errors = [one["coverage_error"] + one["flip_error"] for one in (measured, best)]
    assert 0.0 < errors[1] < errors[0] < 2.0


def test_crossed_cards_flyaways_and_caps_are_part_of_the_cards(hair):
    settings = {"card_count": 20, "segment_count": 2, "texture_size": SIZE}
    made = api.make_hair_cards(hair, **settings, crossed=0.5, flyaways=0.2, caps=0.2)
    assert len(made[0].data.polygons) == 40 and not made[0].data.validate()


def test_files_of_unreals_layouts_have_the_values_of_the_separate_textures(hair, tmp_path):
    """Files of packed textures, read again, have the bytes of separate textures in their channels."""
    settings = {"card_count": 6, "segment_count": 2, "texture_size": 128, "texture_layout": "UNREAL_COMPACT"}
    api.make_hair_cards(hair, **settings, folder=tmp_path)

    def read(kind):
        image = bpy.data.images.load(str(tmp_path / f"Hair_Cards_LOD0_{kind}.png"))
        image.colorspace_settings.name, image.alpha_mode = "Non-Color", "CHANNEL_PACKED"
        return pixels(image)

    assert len([*tmp_path.iterdir()]) == len(texels.MAPS) + 3
    coverage, depth = read("unreal_CoverageDepthSeed"), read("depth")
    for channel, kind in enumerate(("alpha", "depth", "id")):
        np.testing.assert_array_equal(coverage[..., channel], read(kind)[..., 0])
    assert np.ptp(depth[..., 0]) > 0.5
    np.testing.assert_array_equal(read("unreal_TangentCoordU")[..., 3], read("root")[..., 0])
    rough = read("unreal_ColorRoughness")
    np.testing.assert_array_equal(rough[..., :3], read("color")[..., :3])
    np.testing.assert_allclose(rough[..., 3], properties.look_of(hair.data.vellus).roughness, atol=1 / 255)
