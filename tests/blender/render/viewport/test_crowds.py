# SPDX-License-Identifier: GPL-3.0-or-later
"""Linked heads are drawn together, with the pictures of heads that are drawn one by one."""

import sys

import bpy
import gpu
import numpy as np
import pytest
from mathutils import Matrix

from hair_addon.blender.data.pictures import drawn_meshes, viewport_shading
from hair_addon.blender.gpu import ambient_visibility, shadows, solid_shading, strand_batches, surface_textures
from hair_addon.blender.gpu.programs import picture_programs, uniforms
from hair_addon.blender.gpu.visibility_buffer import NO_SEGMENT, NearestSamples
from hair_addon.blender.render import drawn_scene, light_paths, motion_vectors
from hair_addon.blender.render.viewport import hair_picture, history, picture_detail
from hair_addon.blender.render.viewport.outline import HairOutline, OutlineStyle
from hair_addon.core.imaging import ambient_cube
from hair_addon.core.shading.light_paths import strand_grid

SIZE = (96, 64)
WORLD_TO_VIEW = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, -9], [0, 0, 0, 1.0]])
VIEW_TO_CLIP = np.array([[1.0, 0, 0, 0], [0, 1.5, 0, 0], [0, 0, -1.002, -0.2002], [0, 0, -1, 0]])

PLACES = (
    Matrix.Translation((-3.0, 0.0, 1.5)),
    Matrix.Translation((0.0, -5.0, 1.0)) @ Matrix.Diagonal((-1.0, 1.0, 1.0, 1.0)),  # near, and mirrored
    Matrix.Translation((3.0, 0.0, -1.0)) @ Matrix.Diagonal((0.5, 0.5, 1.5, 1.0)),
    Matrix.Translation((-1.5, 20.0, -1.0)) @ Matrix.Rotation(1.0, 4, "X"),
    Matrix.Translation((900.0, 0.0, 0.0)),  # outside of the picture
    Matrix.Translation((0.0, 2.0, 0.2)) @ Matrix.Scale(0.01, 4),
    Matrix.Translation((2.0, 3.0, 1.5)),  # hidden
)


def link(hair, places):
    """Replace a head with hair by linked heads at (4, 4) places; returns their hair objects."""
    head, found = hair.parent, []
    for place in places:
        others = [one.copy() for one in (head, hair)]
        others[1].parent, others[0].matrix_world = others[0], place
        for one in others:
            bpy.context.scene.collection.objects.link(one)
        found.append(others[1])
    bpy.data.objects.remove(hair)
    head.hide_viewport = head.hide_render = True
    bpy.context.view_layer.update()
    return found


def read(**options):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return drawn_scene.read(bpy.context.scene, bpy.context.view_layer, depsgraph, **options)


def pictures(drawn, channels, is_shadowed=False):
    """Return the pixels of two passes of a picture and of an outline, and the hair at some pixels."""
    picture, outline = hair_picture.HairPicture(SIZE, 2), HairOutline(SIZE)
    outline.restart(channels, OutlineStyle((1.0, 0.5, 0.0), (0.8, 0.2, 0.0), 2.0, 1.0))
    for _turn in range(2):
        picture.add_pass(drawn, WORLD_TO_VIEW, VIEW_TO_CLIP, outline=outline, is_shadowed=is_shadowed)
    found = [picture.hair_at(x, y) for x in range(0, SIZE[0], 5) for y in range(0, SIZE[1], 5)]
    return picture.read(), np.array(outline._mask.read(), np.float32), found


def test_linked_heads_look_the_same_drawn_together_and_one_by_one(thin, monkeypatch):
    """Moved, mirrored, unevenly scaled, distant, tiny, hidden and selected heads have the same pixels."""
    linked = link(thin, PLACES)
    linked[-1].hide_render = True
    channels = {1: 0, 3: 1}
    drawn = read()
    assert [len(batch.indices) for batch in drawn.batches] == [len(PLACES) - 1] and len(drawn.occluders) == 1
    together, shadowed = pictures(drawn, channels), pictures(drawn, channels, is_shadowed=True)
    assert set(together[2]) >= {None, 0, 1, 2} and len(drawn.shadowed) == 1
    monkeypatch.setattr(strand_batches, "groups_of", lambda keys: [[index] for index, _key in enumerate(keys)])
    drawn = read()
    assert (len(drawn.batches), len(drawn.occluders)) == (len(PLACES) - 1, len(PLACES))
    for is_shadowed, found in ((False, together), (True, shadowed)):
        one_by_one = pictures(drawn, channels, is_shadowed)
        np.testing.assert_array_equal(found[0], one_by_one[0])
        np.testing.assert_array_equal(found[1], one_by_one[1])
        assert found[2] == one_by_one[2]
    assert together[0][..., 3].max() > 0.5 and together[1].max() > 0.5
    assert np.abs(shadowed[0] - together[0]).max() > 0.1


def test_heads_in_colors_of_their_own_are_drawn_together(thin, monkeypatch):
    """Heads in random colors have the pixels of heads that are drawn one by one.

    The looks are the same when the scene is read again.
    """
    link(thin, PLACES[:4])
    shown = viewport_shading.ViewportShading(color=viewport_shading.HairColor("RANDOM"))
    drawn = read(shown=shown)
    assert [len(batch.indices) for batch in drawn.batches] == [4]
    assert len({shading.tint for _strands, shading, *_ in drawn.hair}) == 4
    monkeypatch.setattr(solid_shading.shading_cache, "_least", 1)
    again = [read(shown=shown).hair for _turn in range(2)]
    assert all(one[1] is other[1] for one, other in zip(*again, strict=True))
    together = pictures(drawn, {})
    monkeypatch.setattr(strand_batches, "groups_of", lambda keys: [[index] for index, _key in enumerate(keys)])
    one_by_one = pictures(read(shown=shown), {})
    np.testing.assert_array_equal(together[0], one_by_one[0])
    assert np.ptp(together[0][together[0][..., 3] > 0.5], axis=0)[:3].min() > 0.1


def test_heads_with_light_grid_are_drawn_together_in_the_same_light(thin, monkeypatch):
    """Linked heads share the light of their paths: each head is as bright as with light of its own.

    Few paths leave noise: with dual scattering the heads are brighter by 40 %.
    """
    thin.data.vellus.hair.strand_count = 1000
    link(thin, (PLACES[0], PLACES[3], PLACES[6]))
    drawn, means = read(), []
    sums_of = strand_grid._sums_of
    for own in (sums_of, lambda systems: tuple(range(len(systems)))):
        monkeypatch.setattr(strand_grid, "_sums_of", own)
        lit = light_paths.with_grid(drawn, WORLD_TO_VIEW, VIEW_TO_CLIP, 10_000)
        means.append(pictures(lit, {})[0].reshape(2, 32, 2, 48, 4).sum(axis=(1, 3)))
        grids = {id(seen["light_grid"]) for seen in lit.hair_visibility}
        assert len(grids) == len(lit.batches) == (1 if own is sums_of else 3)
    near = means[0][..., 3] > 10.0  # pixels that hair covers: light of a few pixels is noise
    assert near.sum() == 2
    np.testing.assert_allclose(means[0][near], means[1][near], rtol=0.1)


def test_surfaces_of_a_crowd_are_uploaded_and_triangulated_once(thin, monkeypatch):
    """The caches make room for the surfaces of all heads."""
    link(thin, PLACES)
    for cache in (surface_textures.surface_cache, drawn_meshes.layout_cache):
        monkeypatch.setattr(cache, "_least", 2)
        monkeypatch.setattr(cache, "_capacity", 2)
        cache.clear()

    def textures():
        return [surface.places for surface, _parts in read().surfaces]

    def triangles():
        depsgraph = bpy.context.evaluated_depsgraph_get()
        return [mesh.triangles for mesh in drawn_meshes.read_drawn_meshes(depsgraph, is_moving=True)]

    triangles()  # learns the number of heads
    for read_all in (textures, triangles):
        before, after = read_all(), read_all()
        assert len(before) == len(PLACES) and all(one is other for one, other in zip(before, after, strict=True))


def test_one_head_alone_is_drawn_by_itself(thin):
    drawn = read()
    assert [batch.layers for batch in drawn.batches] == [None]
    assert isinstance(drawn.occluders[0], surface_textures.SurfaceOnGPU)


def test_heads_of_a_linked_library_are_drawn_together(thin, tmp_path):
    """Instances of a library's collection, in a scene of centimeters, share strands and look like local instances."""
    bpy.context.scene.unit_settings.scale_length = 0.01
    collection = bpy.data.collections.new("Head")
    for one in (thin.parent, thin):
        collection.objects.link(one)
        bpy.context.scene.collection.objects.unlink(one)
    path = str(tmp_path / "head.blend")
    bpy.data.libraries.write(path, {collection})
    with bpy.data.libraries.load(path, link=True) as (_found, chosen):
        chosen.collections = ["Head"]
    found = []
    for instanced in (collection, chosen.collections[0]):
        empties = [bpy.data.objects.new("Instance", None) for _place in PLACES[:3]]
        for empty, place in zip(empties, PLACES, strict=False):
            empty.instance_type, empty.instance_collection, empty.matrix_world = "COLLECTION", instanced, place
            bpy.context.scene.collection.objects.link(empty)
        bpy.context.view_layer.update()
        drawn = read()
        assert [len(batch.indices) for batch in drawn.batches] == [3] and len(drawn.occluders) == 1
        found.append(pictures(drawn, {0: 0})[0])
        for empty in empties:
            bpy.data.objects.remove(empty)
    np.testing.assert_allclose(found[1], found[0], rtol=0.0, atol=1.0 / 255.0)
    assert found[0][..., 3].max() > 0.5


def test_visibility_that_follows_moving_heads_becomes_that_of_heads_at_rest(thin):
    """Once all directions are renewed in motion, the visibility of the world is that of each head at rest."""
    thin.data.vellus.hair.strand_count = 200
    link(thin, (PLACES[0], PLACES[2]))
    drawn = read()
    placed = [(strands, to_world) for strands, _shading, to_world, _limits in drawn.hair]
    through = [(shading.opacity, shading.forward) for _strands, shading, *_ in drawn.hair]
    blockers = [blocker.surface for blocker in drawn.blockers]
    shared = drawn.hair_visibility[0]
    wanted = {name: np.array(texture.read()) for name, texture in shared.items()}
    for texture in shared.values():
        texture.clear(format="FLOAT", value=(0.0, 0.0, 0.0, 0.0))
    renewal, seen = ambient_visibility.Renewal(), (drawn.hair_visibility, drawn.surface_visibility)
    receivers = [surface for surface, _parts in drawn.surfaces]
    for _direction in ambient_cube.DIRECTIONS:
        seen = renewal.step(seen, placed, blockers, through, receivers)
    for name, values in wanted.items():
        found = np.array(seen[0][1][name].read(), float)
        assert np.quantile(np.abs(found - values), 0.98) <= 2.0 * values.max() / 255.0
    layers = wanted["visibility_x_y"].reshape(2, -1)
    assert (layers[0] != layers[1]).any()


class Calls:
    """Number of calls of Python functions and of the gpu module in a context."""

    def __enter__(self):
        self.count, self.draws = 0, 0
        sys.setprofile(self._add)
        return self

    def _add(self, _frame, event, function):
        self.count += event in ("call", "c_call")
        self.draws += event == "c_call" and function.__name__ in {"dispatch", "draw", "draw_range", "draw_instanced"}

    def __exit__(self, *_error):
        sys.setprofile(None)


@pytest.mark.parametrize("is_moved", [True, False], ids=["turning", "at rest"])
def test_calls_of_a_frame_do_not_grow_with_the_number_of_heads(thin, monkeypatch, is_moved):
    """A pass of 12 heads makes as many calls as one of 3: while a view turns, and at rest with shadows on surfaces.

    A shadow map of 12 heads has as many draw calls as a shadow map of 3.
    """
    monkeypatch.setattr(picture_detail, "_MOST_PER_SIDE", 2)  # smaller hair is not drawn in a part of the picture
    thin.data.vellus.hair.strand_count = 200
    hair, found = thin, []
    for count in (3, 12):
        places = [Matrix.Translation((2.0 * (index % 4) - 3.0, 3.0 * (index // 4), 0.0)) for index in range(count)]
        others = link(hair, places)
        uniforms.buffer_cache.clear()  # neither crowd finds buffers of the other
        drawn, picture = read(), hair_picture.HairPicture(SIZE, 2)
        view = WORLD_TO_VIEW.copy()
        for turn in range(3):
            view[0, 3] = 0.01 * turn * is_moved
            if turn:
                picture.restart(is_moved=is_moved)
            with Calls() as calls:
                picture.add_pass(drawn, view, VIEW_TO_CLIP, is_shadowed=not is_moved)
        maps, placed = shadows.ShadowMaps(64, 1), [(strands, to_world) for strands, _shading, to_world, _ in drawn.hair]
        with Calls() as shadow_calls:
            maps.draw(drawn.lights.copy(), placed, [blocker.surface for blocker in drawn.blockers])
        found.append((calls.count, calls.draws, shadow_calls.draws))
        hair = others[0]
        for one in others[1:]:
            bpy.data.objects.remove(one.parent)
            bpy.data.objects.remove(one)
    assert found[0] == found[1] and min(found[0]) > 3


def nearest_samples(picture):
    """Return the `NearestSamples` of a picture."""
    found, detail, record = history.History(SIZE), picture._detail, uniforms.HISTORY.record()
    found._allocate()
    record["samples_per_side"] = detail.per_side
    noise = gpu.types.GPUTexture((1, 1), format="RGBA16F")
    noise.clear(format="FLOAT", value=(1.0, 1.0, 1.0, 1.0))
    found._find_places(record, picture._pass, noise)
    return NearestSamples(found._places, detail.per_side, detail.corner, history._REACH)


def test_motion_of_linked_heads_is_found_together(thin, monkeypatch):
    """Heads that move apart have the motion vectors of heads one by one, with as many calls for 4 as for 2."""
    monkeypatch.setattr(picture_detail, "_MOST_PER_SIDE", 2)
    linked = link(thin, PLACES[:4])
    found, draws = [], []
    for count, is_single in ((4, False), (4, True), (2, False)):
        for hair in linked[count:]:
            hair.hide_viewport = hair.hide_render = True
        for place, hair in zip(PLACES, linked, strict=False):
            hair.parent.matrix_world = place
        bpy.context.view_layer.update()
        before = read()
        for index, hair in enumerate(linked):
            hair.parent.matrix_world = Matrix.Translation((0.1 * index, 0.0, 0.2)) @ hair.parent.matrix_world
        bpy.context.view_layer.update()
        after, picture = read(), hair_picture.HairPicture(SIZE, 2)
        picture.add_pass(after, WORLD_TO_VIEW, VIEW_TO_CLIP)
        camera = WORLD_TO_VIEW, VIEW_TO_CLIP
        now = motion_vectors.places(after, *camera)
        motion = motion_vectors.Motion(motion_vectors.places(before, *camera), now, now, SIZE)
        arguments = after, motion, picture._view, picture._pass, False
        with monkeypatch.context() as patch:
            if is_single:
                patch.setattr(motion_vectors, "_joined", lambda *_given, **_named: None)
            motion_vectors.draw(*arguments)
            with Calls() as calls:
                vectors = motion_vectors.draw(*arguments)
            of_pixels = gpu.types.GPUTexture(SIZE, format=picture_programs.CARRIED_MOTION_FORMAT)
            nearest = nearest_samples(picture)
            with Calls() as nearest_calls:
                motion_vectors.draw_nearest(after, motion, picture._pass, of_pixels, nearest)
        found.append(np.array(vectors.read(), np.float32))
        draws.append((calls.draws, nearest_calls.draws))
        places = np.array(nearest.texture.read(), np.int64).ravel()
        is_hair = np.array(picture._pass.segments.read(), np.int64).ravel()[places] < NO_SEGMENT
        shown, expected = np.array(of_pixels.read(), np.float32).reshape(-1, 2), found[-1].reshape(-1, 4)[places, :2]
        np.testing.assert_array_equal(shown[is_hair], expected[is_hair])
    np.testing.assert_array_equal(found[0], found[1])
    assert draws[0] == draws[2] < draws[1]
    assert np.abs(found[0]).max() > 0.5
