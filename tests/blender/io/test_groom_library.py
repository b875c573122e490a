# SPDX-License-Identifier: GPL-3.0-or-later
"""Grooms saved as assets are restored on the same surface and on copies; other files are refused."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from hair_addon import api
from hair_addon.blender.data.strands import attributes, gathered_groups, selection_sets
from hair_addon.blender.io import asset_catalogs, groom_library
from hair_addon.core.errors import HairError
from tests.support.dynamics.following import update
from tests.support.reading import vertex_positions

PICTURE = np.linspace(0.0, 1.0, 16 * 16 * 4, dtype=np.float32).reshape(16, 16, 4)


@pytest.fixture
def groom(sphere):
    """Return combed guides on the upper half of the sphere and their hair, with a mask, styles, a look and dynamics."""
    settings = api.GroomSettings(
        api.GuideSettings(guide_count=40, density_group="top", length=0.4),
        api.HairSettings(strand_count=200, radius=0.002),
        api.Appearance(melanin=0.7, roughness=0.2),
        styles=(api.Clump(size=0.2, mask="top", seed=3), api.Curl(radius=0.02, seed=4)),
        style_names=("Locks", ""),
        dynamics=api.DynamicsSettings(damping=0.4),
    )
    guides, hair = api.add_hair(sphere, settings)
    api.change_guides(guides, "SMOOTH", iterations=3)
    api.change_guides(guides, "LENGTH", method="SCALE", factor=0.8)
    update()
    return guides, hair


@pytest.fixture
def library(groom, tmp_path):
    """Return the file of the saved groom."""
    return api.save_groom(groom[1], tmp_path / "library", name="Bob", catalog="Hair/Short", picture=PICTURE)


def preview_of(datablock):
    """Return (height, width, 4) float32 of a datablock's preview, or None."""
    preview = datablock.preview
    if preview is None or not all(preview.image_size):
        return None
    pixels = np.empty((preview.image_size[1], preview.image_size[0], 4), np.float32)
    preview.image_pixels_float.foreach_get(pixels.ravel())
    return pixels


def datablocks():
    return [len(getattr(bpy.data, name)) for name in ("objects", "meshes", "hair_curves", "materials", "libraries")]


def test_the_same_surface_gets_the_same_groom(groom, library, sphere):
    guides, hair = api.apply_groom(sphere, library)
    np.testing.assert_allclose(api.points(guides), api.points(groom[0]), atol=1e-6)
    assert api.settings_of(hair) == api.settings_of(groom[1])
    assert list(sphere.vertex_groups.keys()) == ["top"]
    assert (guides.vellus.status, hair.vellus.status) == ("", "")
    update()
    np.testing.assert_allclose(api.points(hair), api.points(groom[1]), atol=1e-4)


@pytest.mark.parametrize("is_applied", [False, True], ids=["object", "mesh"])
def test_a_turned_and_scaled_copy_gets_it_exactly(groom, library, sphere, is_applied):
    mesh = sphere.data.copy()
    copy = bpy.data.objects.new("Copy", mesh)
    matrix = Matrix.Rotation(0.9, 4, (0.3, 1.0, -0.2)) @ Matrix.Scale(2.5, 4)
    if is_applied:
        mesh.transform(matrix)
    else:
        copy.matrix_world = Matrix.Translation((5.0, 0.0, 1.0)) @ matrix
    bpy.context.scene.collection.objects.link(copy)
    update()
    guides, hair = api.apply_groom(copy, library)
    whole = np.array(copy.matrix_world @ (matrix if is_applied else Matrix()))
    wanted = api.points(groom[0]) @ whole[:3, :3].T + whole[:3, 3]
    np.testing.assert_allclose(api.points(guides), wanted, atol=1e-5)
    before, after = api.settings_of(groom[1]), api.settings_of(hair)
    assert after.hair.radius == pytest.approx(2.5 * before.hair.radius, rel=1e-5)
    assert after.styles[1].radius == pytest.approx(2.5 * before.styles[1].radius, rel=1e-5)
    group = copy.vertex_groups["top"]
    weights = [next((g.weight for g in v.groups if g.group == group.index), 0.0) for v in mesh.vertices]
    np.testing.assert_allclose(weights, vertex_positions(sphere)[:, 2] > 0.0, atol=1e-4)


def test_regions_ties_and_selections_of_guides_come_along(groom, sphere, tmp_path):
    guides, hair = groom
    parts = (api.points(guides)[:, 0, 0] > 0.0).astype(np.int32)
    fractions = np.linspace(0.1, 0.9, len(parts), dtype=np.float32)
    gathered_groups.write(guides, gathered_groups.Gathered(1 + parts, fractions, fractions[::-1]))
    api.change_guides(guides, "LENGTH", method="SCALE", factor=0.5)  # a greater fraction is up to the tie
    gathered = gathered_groups.read(guides)
    attributes.write(guides, "parts", "INT", "CURVE", parts)
    selection_sets.write(guides, "Left", np.repeat(parts > 0, len(guides.points) // len(parts)))
    hair.vellus.hair.region_attribute = "parts"
    update()
    file = api.save_groom(hair, tmp_path, name="Parted", catalog="", picture=PICTURE)
    its_guides, its_hair = api.apply_groom(sphere, file)
    its = gathered_groups.read(its_guides)
    for name in ("groups", "held", "tie_fractions"):
        np.testing.assert_allclose(getattr(its, name), getattr(gathered, name), atol=1e-5)
    assert attributes.has(its_guides, "gathered_length", "FLOAT", "CURVE")
    np.testing.assert_array_equal(selection_sets.read_guides(its_guides, "Left"), parts > 0)
    assert api.settings_of(its_hair) == api.settings_of(hair) and its_hair.vellus.status == ""
    update()
    np.testing.assert_allclose(api.points(its_hair), api.points(hair), atol=1e-4)


def test_another_mesh_gets_it_and_says_what_fell_off(library):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16, radius=0.5)
    egg = bpy.context.object
    egg.data.transform(Matrix.Diagonal((1.0, 1.2, 1.4, 1.0)))
    update()
    guides, hair = api.apply_groom(egg, library, method="NEAREST")
    assert 30 < len(guides.curves) <= 40 and len(hair.curves) == 200
    roots = api.points(guides)[:, 0] / [0.5, 0.6, 0.7]
    np.testing.assert_allclose(np.linalg.norm(roots, axis=1), 1.0, atol=0.03)
    assert roots[:, 2].min() > -0.1


def test_an_own_group_of_that_name_stays(library, sphere):
    top = sphere.vertex_groups["top"]
    top.add(range(len(sphere.data.vertices)), 0.25, "REPLACE")
    update()
    _guides, hair = api.apply_groom(sphere, library)
    assert list(sphere.vertex_groups.keys()) == ["top", "top.001"]
    assert sphere.data.vertices[0].groups[0].weight == pytest.approx(0.25)
    assert api.settings_of(hair).styles[0].mask == "top.001"


def test_the_file_is_an_asset_with_a_picture_in_a_catalog(groom, library):
    assert api.groom_names(library) == ["Bob"]
    with bpy.data.libraries.load(str(library), assets_only=True) as (_there, wanted):
        wanted.objects = ["Bob"]
    asset = wanted.objects[0]
    assert asset.asset_data.catalog_id == asset_catalogs.read(library.parent, "Hair/Short").identifier
    np.testing.assert_allclose(preview_of(asset), PICTURE, atol=0.003)
    lines = (library.parent / asset_catalogs.FILE).read_text().splitlines()
    assert sum("Hair/Short" in line for line in lines) == 1


def test_saving_and_reading_leave_the_open_file_as_it_is(groom, tmp_path):
    bpy.data.objects.new("Bob", None)
    before = datablocks()
    path = api.save_groom(groom[1], tmp_path / "Bob.blend", name="Bob", catalog="", picture=PICTURE)
    groom_library.read(path)
    assert datablocks() == before and "Bob" in bpy.data.objects
    assert api.groom_names(path) == ["Bob"]


def write_foreign(path):
    other = bpy.data.objects.new("Bob", bpy.data.meshes.new("Bob"))
    other.asset_mark()
    bpy.data.libraries.write(str(path), {other})
    bpy.data.objects.remove(other)


def write_damaged(path, change):
    """Save a groom and replace some of the file's data."""
    with bpy.data.libraries.load(str(path), assets_only=True) as (_there, wanted):
        wanted.objects = ["Bob"]
    asset = wanted.objects[0]
    asset.name = "Bob"
    change(asset)
    bpy.data.libraries.write(str(path), {asset})
    bpy.data.objects.remove(asset)


def not_finite(asset):
    asset.data.attributes["position"].data[3].vector = (float("nan"), 0.0, 0.0)


def without_faces(asset):
    asset.data.surface.data.clear_geometry()


def without_settings(asset):
    del asset["vellus_groom"]


def other_settings(asset):
    asset["vellus_groom"] = '{"format": "Vellus groom settings", "version": 1, "hair": {"radius": "thick"}}'


@pytest.mark.parametrize("change", [not_finite, without_faces, without_settings, other_settings])
def test_a_damaged_groom_is_one_sentence(library, sphere, change):
    write_damaged(library, change)
    before = datablocks(), list(sphere.vertex_groups.keys())
    with pytest.raises(HairError) as refused:
        api.apply_groom(sphere, library)
    assert str(refused.value).count(". ") == 0 and "\n" not in str(refused.value)
    assert (datablocks(), list(sphere.vertex_groups.keys())) == before


def test_a_foreign_file_is_one_sentence(sphere, tmp_path):
    foreign, text, cut = (tmp_path / name for name in ("foreign.blend", "text.blend", "cut.blend"))
    write_foreign(foreign)
    text.write_text("hair")
    cut.write_bytes(foreign.read_bytes()[:100])
    before = datablocks()
    for path in (foreign, text, cut, tmp_path / "missing.blend", tmp_path):
        with pytest.raises(HairError, match=path.name):
            api.apply_groom(sphere, path)
    assert datablocks() == before


def test_operators_save_with_a_picture_and_apply_and_undo(groom, sphere, tmp_path):
    library = bpy.context.preferences.filepaths.asset_libraries.new(name="Grooms", directory=str(tmp_path))
    try:
        bpy.context.view_layer.objects.active, before = bpy.data.objects["Hair"], datablocks()
        assert bpy.ops.vellus.save_groom(name="Bob", library="Grooms", catalog="Hair") == {"FINISHED"}
        assert datablocks() == before and len(bpy.data.scenes) == 1 and not bpy.data.cameras
        with pytest.raises(RuntimeError, match="exists"):
            bpy.ops.vellus.save_groom(name="Bob", library="Grooms")
        bpy.context.view_layer.objects.active = sphere
        bpy.ops.ed.undo_push(message="before")
        wanted = {"asset_library_identifier": "Grooms", "relative_asset_identifier": "Bob.asset.blend/Object/Bob"}
        assert bpy.ops.vellus.apply_groom("EXEC_DEFAULT", True, asset_library_type="CUSTOM", **wanted) == {"FINISHED"}
        assert bpy.context.object.type == "CURVES" and len(bpy.data.hair_curves) == 4
        bpy.ops.ed.undo()
        assert len(bpy.data.hair_curves) == 2
    finally:
        bpy.context.preferences.filepaths.asset_libraries.remove(library)
    with bpy.data.libraries.load(str(tmp_path / "Bob.asset.blend"), assets_only=True) as (_there, wanted):
        wanted.objects = ["Bob"]
    pixels = preview_of(wanted.objects[0])
    assert pixels.shape == (256, 256, 4) and 0.1 < (pixels[..., 3] > 0.5).mean() < 0.9


def test_arguments_of_scripts_are_refused_in_one_sentence(groom, tmp_path):
    before = datablocks()
    for wrong in ({"name": 1}, {"name": "a\0b"}, {"catalog": None}, {"picture": "red"}, {"picture": np.zeros((4, 4))}):
        with pytest.raises(HairError):
            api.save_groom(groom[1], tmp_path, **({"picture": PICTURE} | wrong))
    assert datablocks() == before and not list(tmp_path.iterdir())


@pytest.mark.parametrize("names", [("Grün", "Grän"), ("Bob/1", "Bob:1")])
def test_a_groom_replaces_itself_and_no_other(groom, tmp_path, names):
    def save(name, count):
        return api.save_groom(groom[1], tmp_path, name=name, catalog="", picture=PICTURE[:count])

    paths = [save(name, 16) for name in names]
    assert [api.groom_names(path) for path in paths] == [[name] for name in names]
    others = paths[0].read_bytes()
    assert save(names[1], 8) == paths[1] and sorted(tmp_path.iterdir()) == sorted(paths)
    assert paths[0].read_bytes() == others


def test_files_with_more_than_grooms_are_not_replaced(groom, library, tmp_path):
    def refuse(path, reported):
        content = path.read_bytes()
        with pytest.raises(HairError, match=reported):
            api.save_groom(groom[1], path, picture=PICTURE)
        assert path.read_bytes() == content

    scene, asset = tmp_path / "scene.blend", tmp_path / "asset.blend"
    bpy.data.objects["Sphere"].asset_mark()
    bpy.data.libraries.write(str(asset), {bpy.data.objects["Sphere"]})
    bpy.ops.wm.save_as_mainfile(filepath=str(scene), copy=True)
    for path in (scene, asset):
        refuse(path, "other data than grooms")
    bpy.ops.wm.save_as_mainfile(filepath=str(scene))
    refuse(scene, "is the open file")
    assert api.save_groom(groom[1], library, name="Other", picture=PICTURE) == library
    assert api.groom_names(library) == ["Other"]


def test_names_that_are_no_file_names(groom, tmp_path):
    path = api.save_groom(groom[1], tmp_path, name="a/b: é", catalog="", picture=PICTURE)
    assert path.parent == tmp_path and api.groom_names(path) == ["a/b: é"]
    with pytest.raises(HairError, match="empty"):
        groom_library.path_of(tmp_path, " . ")
    assert groom_library.path_and_name("C:\\x.blend:Bob") == (type(path)("C:\\x.blend"), "Bob")
    assert groom_library.path_and_name("C:\\x.blend") == (type(path)("C:\\x.blend"), "")


def test_maps_of_vertex_groups_come_along(groom, sphere, tmp_path):
    """A saved groom has its maps of vertex groups with these groups and the ramps; maps of images are left out."""
    hair = groom[1]
    sphere.vertex_groups.new(name="short").add(list(range(40)), 1.0, "REPLACE")
    wanted = [api.set_map(hair, "guides.length", "group:short"), api.set_map(hair, "look.melanin", "clump")]
    wanted.append(api.set_map(hair, "strands.thickness", "group:short", ramp="0:0.5 1:1"))
    api.set_map(hair, "look.roughness", bpy.data.images.new("Coat", 4, 4))
    update()
    file = api.save_groom(hair, tmp_path, name="Mapped", catalog="", picture=PICTURE)
    sphere.vertex_groups.remove(sphere.vertex_groups["short"])
    guides, other = api.apply_groom(sphere, file)
    assert {*api.maps_of(other)} == {*wanted}
    assert "short" in sphere.vertex_groups
    update()
    assert (guides.vellus.status, other.vellus.status, other.vellus.shading_status) == ("", "", "")
    np.testing.assert_allclose(api.points(guides), api.points(groom[0]), atol=1e-6)
