# SPDX-License-Identifier: GPL-3.0-or-later
"""Grooms that come with the add-on are applied to the sample's head and to Suzanne, and are an asset library."""

import hashlib
from dataclasses import replace
from functools import cache

import bpy
import numpy as np
import pytest

from blend_samples.heads import head
from hair_addon import api
from hair_addon.blender.data import scene
from hair_addon.blender.data.made import groom_assets
from hair_addon.blender.groom.transfer import library_groom
from hair_addon.blender.io import asset_catalogs, groom_library
from hair_addon.blender.settings import asset_libraries
from hair_addon.core.grooming import groom_passage, groom_transfer
from hair_addon.core.grooming.groom_transfer import TransferSurface
from hair_addon.core.long_work import run_now
from tests.support.meshes import octahedron
from tests.support.pairs import share_of

FILES = sorted(asset_libraries.SHIPPED.glob("*.blend"))
MOST_BYTES = 3_000_000  # of all files together


def suzanne():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_monkey_add()
    return bpy.context.object


@pytest.fixture(scope="module")
def surfaces():
    """Return a function: the `TransferSurface` of the sample's head, or of Suzanne, which is ten times its size."""
    return cache(lambda build: TransferSurface(*groom_assets.read_surface(build())))


def lengths(points, counts):
    """Return the lengths (G,) of guides with equal numbers of points."""
    guides = points.astype(np.float64).reshape(len(counts), -1, 3)
    return np.linalg.norm(np.diff(guides, axis=1), axis=2).sum(axis=1)


def size(mesh):
    """Return the geometric mean of the edges of a mesh's bounding box [m]."""
    return np.cbrt(np.prod(np.ptp(mesh.vertices.astype(np.float64), axis=0)))


@pytest.mark.parametrize("build", [suzanne, pytest.param(head.build, marks=pytest.mark.long)], ids=["suzanne", "head"])
@pytest.mark.parametrize("file", share_of(FILES, 5), ids=lambda file: file.name)
def test_guides_have_places_on_other_heads_and_lengths_in_proportion(file, build, surfaces):
    groom, target = groom_library.read(file), surfaces(build)
    found = groom_passage.passage(groom.source, target, groom.roots)
    places = found.places
    is_own = _is_fur(file) == (build == suzanne)
    assert found.method == ("UV" if is_own else "NEAREST")
    # A third of a beard's roots face the other way on Suzanne's muzzle, and fur of her ears has no place on the head.
    least = 0.99 if is_own else 0.6 if "Beard" in file.name else 0.84 if _is_fur(file) else 0.94
    assert len(places.kept) > least * len(groom.counts)
    points = groom_transfer.carried(groom.source.mesh, target.mesh, groom.roots, groom.points, groom.counts, places)
    ratio = size(target.mesh) / size(groom.source.mesh)
    wanted = ratio * lengths(groom.points, groom.counts)[places.kept]
    np.testing.assert_allclose(lengths(points, places.kept), wanted, rtol=0.15)


def _is_fur(file):
    return "Fur" in file.name


def test_a_mesh_of_another_shape_gets_a_note(hair):
    """Guides of a ball are far from their places on an octahedron in the same box."""
    faces, mesh = octahedron(), bpy.data.meshes.new("Octahedron")
    mesh.from_pydata(faces.vertices.tolist(), [], faces.triangles.tolist())
    surface = bpy.data.objects.new("Octahedron", mesh)
    bpy.context.scene.collection.objects.link(surface)
    bpy.context.view_layer.update()
    depsgraph = scene.present_depsgraph()
    groom = library_groom.take(hair.data, "Groom", depsgraph)
    applied = run_now(library_groom.adding_groom(surface, groom, depsgraph))
    far = "{count} of {all} guides are far from their places, as this mesh has another shape."
    assert far in dict(applied.notes())
    assert far not in dict(replace(applied, aside_count=applied.guide_count // 5).notes())


@pytest.mark.long
@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_grooms_are_applied_with_their_numbers_and_without_messages(file):
    surface, groom = suzanne() if _is_fur(file) else head.build(), groom_library.read(file)

    def with_few_strands(settings):
        return replace(settings, hair=replace(settings.hair, strand_count=40))

    work = library_groom.adding_groom(surface, groom, scene.present_depsgraph(), changed=with_few_strands)
    applied = run_now(work)
    guides, hair = applied.made.guides, applied.made.hair
    assert applied.notes() == [] and (guides.vellus.status, hair.vellus.status) == ("", "")
    assert (len(guides.curves), len(hair.curves)) == (len(groom.counts), 40)


def test_files_are_listed_small_and_in_catalogs():
    """The list of digests names all files; together they are small."""
    lines = [f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {file.name}" for file in FILES]
    assert (asset_libraries.SHIPPED / "SHA256SUMS").read_text(encoding="utf-8").splitlines() == lines
    assert len(FILES) == 10 and sum(file.stat().st_size for file in FILES) < MOST_BYTES
    assert "CC0 1.0" in (asset_libraries.SHIPPED / "LICENSE.txt").read_text(encoding="utf-8")
    for catalog in ("Hair/Head", "Hair/Face", "Hair/Fur"):
        assert asset_catalogs.read(asset_libraries.SHIPPED, catalog).text is None


def test_a_button_adds_the_library_once_and_nothing_is_saved_to_it(sphere):
    libraries = bpy.context.preferences.filepaths.asset_libraries
    before = list(libraries.keys())
    try:
        assert asset_libraries.shipped_name() == ""
        for _press in range(2):
            assert bpy.ops.vellus.add_grooms() == {"FINISHED"}
        assert list(libraries.keys()) == [*before, "Vellus"]
        assert asset_libraries.folder_of("Vellus") == asset_libraries.SHIPPED
        assert asset_libraries.first_name() == "".join(before[:1])
        assert asset_libraries._names(None, None, "") == before  # what the field of Save Groom to Library lists
        settings = api.GroomSettings(api.GuideSettings(guide_count=5), api.HairSettings(strand_count=5))
        _guides, hair = api.add_hair(sphere, settings)
        bpy.context.view_layer.objects.active = bpy.data.objects[hair.name]
        with pytest.raises(RuntimeError, match="choose another asset library"):
            bpy.ops.vellus.save_groom(name="Mine", library="Vellus")
    finally:
        libraries.remove(libraries["Vellus"])


def test_the_button_moves_the_library_of_another_version_and_no_other(tmp_path):
    """Another version of Blender has the add-on in another folder, which may be deleted, or not."""
    libraries = bpy.context.preferences.filepaths.asset_libraries
    before = list(libraries.keys())
    gone, kept, own = (tmp_path.joinpath(name, *asset_libraries.SHIPPED.parts[-2:]) for name in ("gone", "kept", "own"))
    for folder in (kept, own):
        folder.mkdir(parents=True)
    (kept / "SHA256SUMS").touch()
    for folder in (gone, kept):
        try:
            libraries.new(name="Vellus", directory=str(own))
            libraries.new(name="Vellus", directory=str(folder))
            assert bpy.ops.vellus.add_grooms() == {"FINISHED"}
            assert list(libraries.keys()) == [*before, "Vellus", "Vellus.001"]
            assert asset_libraries.folder_of("Vellus") == own
            assert asset_libraries.folder_of("Vellus.001") == asset_libraries.SHIPPED
        finally:
            for library in [library for library in libraries if library.name not in before]:
                libraries.remove(library)
