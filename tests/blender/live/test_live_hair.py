# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair follows its settings, guides and surface; hand-edited hair is kept."""

import math
from dataclasses import replace

import bpy
import numpy as np
import pytest
from mathutils import Vector

from hair_addon import api
from hair_addon.blender.data.strands import attributes
from hair_addon.blender.groom import bindings, pipeline
from hair_addon.blender.render import hair_cache
from hair_addon.blender.settings import properties, setting_properties
from hair_addon.core.grooming import groom
from hair_addon.core.grooming.groom import GuideSettings, HairSettings
from hair_addon.core.params import declared
from hair_addon.core.shading import appearance
from hair_addon.core.shading.appearance import Appearance
from hair_addon.core.shading.tables import lookup_tables
from tests.support.pictures import render_probe
from tests.support.reading import attribute, points, vertex_positions, write_points


def update():
    bpy.context.view_layer.update()


def test_a_changed_setting_makes_hair_again(hair):
    hair.data.vellus.hair.strand_count = 200
    hair.data.vellus.hair.seed = 9
    update()
    assert len(hair.data.curves) == 200
    again = points(hair)
    bpy.ops.vellus.interpolate_hair(strand_count=200, seed=9, radius=0.004)
    assert np.array_equal(points(hair), again)


def test_a_changed_guide_setting_makes_guides_and_their_hair_again(hair):
    guides = bpy.data.objects["Guides"]
    before = points(hair)
    guides.data.vellus.guides.length = 0.8
    update()
    lengths = np.linalg.norm(np.diff(points(guides), axis=1), axis=-1).sum(axis=1)
    assert lengths.mean() == pytest.approx(0.8, rel=0.1)
    assert not np.array_equal(points(hair), before)


@pytest.mark.usefixtures("made_anew")
def test_radii_are_written_where_they_are_others(hair, monkeypatch):
    """Radii are written again only if others have changed them."""
    written = []
    write = attributes.write
    monkeypatch.setattr(attributes, "write", lambda *args: (written.append(args[1]), write(*args)))
    before = attribute(hair, "radius")
    settings = setting_properties.to_settings(hair.data.vellus.hair, HairSettings)

    def make(seed):
        guides, depsgraph = hair.data.vellus.guide_curves, bpy.context.evaluated_depsgraph_get()
        pipeline.interpolate_hair(guides, replace(settings, seed=seed), depsgraph, hair.data)
        update()

    make(2)
    make(3)
    assert "id" in written and "radius" not in written
    hair.data.attributes["radius"].data.foreach_set("value", 3.0 * before)
    hair.data.update_tag()
    update()
    make(4)
    assert written.count("radius") == 1
    np.testing.assert_array_equal(attribute(hair, "radius"), before)


def test_strands_edited_before_blender_reports_our_write_are_drawn(hair):
    """Strands that are edited before Blender reports the handler's write are drawn, although Blender reports one
    change.
    """
    hair_cache.strands_on_gpu(hair.data)
    hair.data.vellus.hair.seed = 9
    update()  # its handler writes the strands
    edited = points(hair)
    edited[:, -1] += np.float32(0.1)
    write_points(hair, edited)
    assert np.array_equal(hair_cache.strands_on_gpu(hair.data).points, edited)


@pytest.mark.usefixtures("made_anew")
def test_radii_edited_by_hand_are_drawn(hair):
    """Radii edited by hand are drawn for bound hair too, and while its guides are combed."""
    guides = bpy.data.objects["Guides"]
    hair.data.vellus.hair.seed = 9
    update()
    hair_cache.strands_on_gpu(hair.data)
    assert bindings.of(hair.data) is not None
    edited = 3.0 * attribute(hair, "radius")
    edited[41:82] *= 2.0
    hair.data.attributes["radius"].data.foreach_set("value", edited)
    hair.data.update_tag()
    update()
    assert np.array_equal(hair_cache.strands_on_gpu(hair.data).radii.ravel(), edited)
    combed = points(guides)
    combed[:, -1] += 0.1
    write_points(guides, combed)
    assert np.array_equal(hair_cache.strands_on_gpu(hair.data).radii.ravel(), edited)


def test_hair_follows_a_combed_guide(hair):
    guides = bpy.data.objects["Guides"]
    before, combed = points(hair), points(guides)
    combed[0] += np.linspace(0.0, 0.3, 41)[:, None] * np.array([0.0, 0.0, 1.0], np.float32)
    write_points(guides, combed)
    moved = np.abs(points(hair) - before).max(axis=(1, 2)) > 1e-6
    near = np.linalg.norm(before[:, 0] - combed[0, 0], axis=1)
    assert moved.any() and not moved.all()
    assert near[moved].max() < near[~moved].max()
    assert np.array_equal(points(hair)[:, 0], before[:, 0])


def test_a_combed_guide_is_not_taken_away_by_a_slider(hair):
    guides = bpy.data.objects["Guides"]
    combed = points(guides)
    combed[:, -1] += 0.1
    write_points(guides, combed)
    guides.data.vellus.guides.guide_count = 10
    update()
    assert np.array_equal(points(guides), combed)
    assert "Hand-edited" in guides.data.vellus.status
    bpy.context.view_layer.objects.active = guides
    bpy.ops.vellus.distribute_guides(guide_count=10)
    assert len(guides.data.curves) == 10 and guides.data.vellus.status == ""


def test_a_moved_surface_vertex_moves_the_roots(hair, sphere):
    sphere.data.transform(((2, 0, 0, 0), (0, 2, 0, 0), (0, 0, 2, 0), (0, 0, 0, 1)))
    sphere.data.update()
    update()
    np.testing.assert_allclose(np.linalg.norm(points(hair)[:, 0], axis=1), 2.0, atol=0.01)


def test_edits_of_a_script_that_changes_the_frame_at_once_are_in_that_frame(hair, sphere):
    """If a script edits guides, vertices, weights or settings and then changes the frame, the hair is as after an
    update.
    """
    guides, scene = bpy.data.objects["Guides"], bpy.context.scene
    weights = sphere.vertex_groups.new(name="Length")
    weights.add(range(len(sphere.data.vertices)), 1.0, "REPLACE")
    api.set_map(hair, "strands.strand_length", "group:Length")
    update()

    def comb():
        combed = 0.5 * (points(guides) + points(guides)[:, :1])
        guides.data.attributes["position"].data.foreach_set("vector", combed.ravel())
        guides.data.update_tag()

    def stretch():
        sphere.data.vertices.foreach_set("co", (vertex_positions(sphere) * (1.0, 1.0, 1.5)).ravel().astype(np.float32))
        sphere.data.update()

    def paint():
        weights.add(range(len(sphere.data.vertices)), 0.5, "REPLACE")
        sphere.data.update()

    def set_count():
        hair.data.vellus.hair.strand_count = 200

    for frame, edit in enumerate((comb, stretch, paint, set_count), scene.frame_current + 1):
        before = points(hair)
        edit()
        scene.frame_set(frame)
        after = points(hair)
        assert not np.array_equal(after, before), edit.__name__
        for edited in (sphere.data, guides.data, hair.data):
            edited.update_tag()
        update()
        np.testing.assert_array_equal(points(hair), after, err_msg=edit.__name__)


@pytest.mark.parametrize("when", ["frame_change_pre", "frame_change_post"])
def test_hair_follows_guides_that_a_handler_of_a_script_moves_in_each_frame(hair, when):
    guides = bpy.data.objects["Guides"]
    rest, length = points(guides), np.linalg.norm(np.diff(points(hair), axis=1), axis=-1).sum(axis=1).mean()

    def shorten(scene, _depsgraph):
        part = np.float32(1.0 - 0.05 * scene.frame_current)
        moved = rest[:, :1] + part * (rest - rest[:, :1])
        guides.data.attributes["position"].data.foreach_set("vector", moved.ravel())
        guides.data.update_tag()

    def shown(depsgraph):
        strands = render_probe.read_points(depsgraph.objects["Hair"].data)
        return np.linalg.norm(np.diff(strands, axis=1), axis=-1).sum(axis=1).mean() / length

    handlers = getattr(bpy.app.handlers, when)
    handlers.append(shorten)
    try:
        with render_probe.reading(shown) as render:
            np.testing.assert_allclose(render(frames=(2, 6, 2)), [0.9, 0.8, 0.7], atol=0.01)
        bpy.context.scene.frame_set(9)
        assert shown(bpy.context.evaluated_depsgraph_get()) == pytest.approx(0.55, abs=0.01)
    finally:
        handlers.remove(shorten)


def test_handlers_of_scripts_read_the_hair_of_the_frame(hair):
    """A handler that an exporter appends to `frame_change_post` reads hair of keyed guides of the same frame."""
    settings, scene, found = bpy.data.objects["Guides"].data.vellus.guides, bpy.context.scene, {}
    for frame in (1, 9):
        settings.length = 0.1 * frame
        settings.keyframe_insert("length", frame=frame)

    def mean_length():
        return float(np.linalg.norm(np.diff(points(hair), axis=1), axis=-1).sum(axis=1).mean())

    def read(scene, _depsgraph):
        found[scene.frame_current] = mean_length()

    bpy.app.handlers.frame_change_post.append(read)
    try:
        for frame in (2, 5, 8):
            scene.frame_set(frame)
    finally:
        bpy.app.handlers.frame_change_post.remove(read)
    for frame, length in found.items():
        scene.frame_set(frame)
        assert length == pytest.approx(mean_length(), rel=1e-6)
    assert found[8] > 1.5 * found[2]


def _stretched(depsgraph):
    """Return the evaluated height of a sphere whose Z is scaled, and the largest distance of roots from it."""
    vertices = render_probe.read_mesh(depsgraph.objects["Sphere"].data).vertices
    roots = render_probe.read_points(depsgraph.objects["Hair"].data)[:, 0]
    height = vertices[:, 2].max()
    return height, np.abs(np.linalg.norm(roots / np.float32([1.0, 1.0, height]), axis=1) - 1.0).max()


@pytest.mark.parametrize("when", ["frame_change_pre", "frame_change_post"])
def test_hair_stays_on_a_mesh_that_a_handler_of_a_script_edits_in_each_frame(hair, when):
    mesh, rest = bpy.data.objects["Sphere"].data, vertex_positions(bpy.data.objects["Sphere"])

    def stretch(scene, _depsgraph):
        moved = rest * np.float32([1.0, 1.0, 1.0 + 0.2 * scene.frame_current])
        mesh.vertices.foreach_set("co", moved.ravel())
        mesh.update()

    handlers = getattr(bpy.app.handlers, when)
    handlers.append(stretch)
    try:
        with render_probe.reading(_stretched) as render:
            heights, apart = zip(*render(frames=(2, 6, 2)), strict=True)
        np.testing.assert_allclose(heights, [1.4, 1.8, 2.2], atol=0.01)
        assert max(apart) < 0.01
        bpy.context.scene.frame_set(9)
        height, apart = _stretched(bpy.context.evaluated_depsgraph_get())
        assert height == pytest.approx(2.8, abs=0.01) and apart < 0.01
    finally:
        handlers.remove(stretch)


def test_hair_follows_a_script_that_edits_a_mesh_with_keyed_shape_keys_before_it_changes_the_frame(hair):
    sphere = bpy.data.objects["Sphere"]
    basis, key = (sphere.shape_key_add(name=name) for name in ("Basis", "Smile"))
    for frame in (1, 100):
        key.value = frame / 100.0
        key.keyframe_insert("value", frame=frame)
    bpy.context.scene.frame_set(2)
    rest = vertex_positions(sphere)
    for edited in (basis.data, key.data, sphere.data.vertices):
        edited.foreach_set("co", (rest * np.float32([1.0, 1.0, 2.0])).ravel())
    sphere.data.update()
    bpy.context.scene.frame_set(3)
    height, apart = _stretched(bpy.context.evaluated_depsgraph_get())
    assert height == pytest.approx(2.0, abs=0.01) and apart < 0.01


def test_nothing_is_made_again_while_live_is_off(hair):
    hair.data.vellus.is_live = False
    hair.data.vellus.hair.strand_count = 200
    update()
    assert len(hair.data.curves) == 500
    hair.data.vellus.is_live = True
    hair.data.update_tag()
    update()
    assert len(hair.data.curves) == 200


def test_a_nan_setting_keeps_the_hair_and_is_reported(hair):
    before = points(hair)
    hair.data.vellus.hair.automatic_influence = False
    hair.data.vellus.hair.influence_distance = math.nan
    update()
    assert np.array_equal(points(hair), before)
    assert "Influence distance" in hair.data.vellus.status


def test_an_update_that_changes_nothing_makes_nothing_again(hair):
    hair.data.attributes["radius"].data[0].value = 0.123
    bpy.data.objects["Sphere"].location.x = 3.0
    update()
    update()
    assert attribute(hair, "radius")[0] == pytest.approx(0.123)


def test_undo_brings_back_settings_and_hair_together(hair):
    bpy.ops.ed.undo_push(message="made")
    before = points(hair)
    hair.data.vellus.hair.strand_count = 200
    update()
    bpy.ops.ed.undo_push(message="fewer")
    bpy.ops.ed.undo()
    update()
    hair = bpy.data.objects["Hair"]
    assert hair.data.vellus.hair.strand_count == 500
    assert np.array_equal(points(hair), before)


def test_everything_survives_save_and_load(hair, tmp_path):
    hair.data.vellus.appearance.cuticle_angle = 0.12
    hair.data.vellus.marschner.size = 128
    hair.data.vellus.model = "KAJIYA_KAY"
    update()
    made, guides_made = points(hair), points(bpy.data.objects["Guides"])
    path = str(tmp_path / "groom with spaces.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.open_mainfile(filepath=path)
    update()
    hair = bpy.data.objects["Hair"]
    assert np.array_equal(points(hair), made)
    assert np.array_equal(points(bpy.data.objects["Guides"]), guides_made)
    assert hair.data.vellus.guide_curves == bpy.data.objects["Guides"].data
    kept = setting_properties.to_settings(hair.data.vellus.hair, HairSettings)
    assert kept == HairSettings(strand_count=500, radius=0.004, influence_distance=0.03)
    assert properties.look_of(hair.data.vellus) == Appearance(cuticle_angle=0.12)
    assert hair.data.vellus.marschner.size == 128
    assert hair.data.vellus.model == "KAJIYA_KAY"


@pytest.mark.parametrize(
    ("group", "settings_class"),
    [
        ("guides", GuideSettings),
        ("hair", HairSettings),
        ("appearance", Appearance),
    ],
)
def test_a_fresh_datablock_has_the_declared_defaults(scene, group, settings_class):
    state = bpy.data.hair_curves.new("Fresh").vellus
    defaults = {name: default for name, default, _details in declared(settings_class)}
    assert setting_properties.to_settings(getattr(state, group), settings_class) == settings_class(**defaults)


@pytest.mark.parametrize(
    ("group", "settings_class", "skip"),
    [
        ("guides", GuideSettings, ()),
        ("hair", HairSettings, ()),
        ("appearance", Appearance, ()),
        ("marschner", lookup_tables.Settings, appearance.TABLE_FIELDS),
    ],
)
@pytest.mark.parametrize("end", ["low", "high"])
def test_a_slider_at_its_end_is_within_the_range(scene, group, settings_class, skip, end):
    """A slider at the end of its range is valid, although single precision rounds 15 degrees up."""
    owner = getattr(bpy.data.hair_curves.new("Fresh").vellus, group)
    for name, default, details in declared(settings_class):
        limit = getattr(details, end)
        if name not in skip and isinstance(default, float) and math.isfinite(limit):
            setattr(owner, name, limit)
            assert getattr(setting_properties.to_settings(owner, settings_class, skip), name) == limit


def hair_node(hair):
    return next(n for n in hair.data.materials[0].node_tree.nodes if n.bl_idname == "ShaderNodeBsdfHairPrincipled")


def assert_material_is(hair, look):
    """Assert that every socket of the hair's material has the value of a look."""
    sockets = hair_node(hair).inputs
    for name, value in appearance.principled_sockets(look).items():
        np.testing.assert_allclose(np.array(sockets[name].default_value), value, rtol=1e-6, err_msg=name)


# Every field differs from its default.
LOOKS = [
    {"melanin": 0.2, "redness": 0.3, "tint": (0.5, 0.4, 0.9), "random_roughness": 0.2},
    {"parametrization": "COLOR", "color": (0.5, 0.2, 0.1), "roughness": 0.5, "radial_roughness": 0.6},
    {"parametrization": "ABSORPTION", "absorption": (0.1, 0.2, 0.3), "ior": 1.4, "coat": 0.5, "cuticle_angle": 0.1},
]


@pytest.mark.parametrize("changes", LOOKS)
def test_material_and_viewport_follow_the_same_look(hair, changes):
    state = hair.data.vellus
    assert_material_is(hair, Appearance())
    for name, value in changes.items():
        setattr(state.appearance, name, value)
    update()
    look = Appearance(**changes)
    assert_material_is(hair, look)
    assert properties.look_of(state) == look
    asked, found = appearance.table_settings(look), properties.table_settings_of(state)
    for name in appearance.TABLE_FIELDS:
        if name != "mode":
            np.testing.assert_allclose(getattr(found, name), getattr(asked, name), rtol=1e-6, err_msg=name)
    flat = hair.data.materials[0].diffuse_color[:3]
    np.testing.assert_allclose(flat, appearance.mean_color(look), rtol=1e-6)


def test_tables_differ_by_what_artists_do_not_set(hair):
    state = hair.data.vellus
    state.marschner.size, state.marschner.glint_gain = 64, 2.0
    state.appearance.mode = "classic"
    found = properties.table_settings_of(state)
    assert (found.mode, found.size, found.glint_gain) == ("classic", 64, 2.0)


def test_a_node_of_another_parametrization_is_filled_too(hair):
    hair_node(hair).parametrization = "MELANIN"
    hair.data.vellus.appearance.ior = 1.4
    update()
    assert hair_node(hair).inputs["IOR"].default_value == pytest.approx(1.4)


def test_a_nan_look_keeps_the_material_and_is_reported(hair):
    hair.data.vellus.appearance.roughness = math.nan
    update()
    assert_material_is(hair, Appearance())
    assert "Roughness" in hair.data.vellus.shading_status
    hair.data.vellus.appearance.roughness = 0.3
    update()
    assert hair.data.vellus.shading_status == ""


def test_a_deleted_surface_is_reported(hair):
    bpy.data.objects.remove(bpy.data.objects["Sphere"])
    hair.data.vellus.hair.strand_count = 100
    update()
    assert "mesh" in hair.data.vellus.status
    assert len(hair.data.curves) == 500


def test_an_operator_computes_once(sphere, monkeypatch):
    """An operator computes its result once, as its own changes do not count as changes of its inputs."""
    calls = {"distribute_guides": 0, "bind_hair": 0}

    def counted(name):
        real = getattr(groom, name)

        def wrapper(*args, **kwargs):
            calls[name] += 1
            return real(*args, **kwargs)

        return wrapper

    for name in calls:
        monkeypatch.setattr(groom, name, counted(name))
    bpy.ops.vellus.distribute_guides(guide_count=20)
    bpy.ops.vellus.interpolate_hair(strand_count=100)
    update()
    assert calls == {"distribute_guides": 1, "bind_hair": 1}
    sphere.location.x = 2.0  # hair is parented: it moves along
    update()
    assert calls == {"distribute_guides": 1, "bind_hair": 1}


def flatten(surface, is_flat):
    surface.scale = (0.0, 1.0, 1.0) if is_flat else (1.0, 1.0, 1.0)
    update()


@pytest.mark.parametrize("is_combed", [False, True])
def test_hair_waits_while_the_surface_has_a_scale_of_zero(hair, is_combed):
    """Changes of settings, guides and the mesh while the scale is zero are followed once it is not zero."""
    surface, guides = hair.data.surface, bpy.data.objects["Guides"]
    if is_combed:
        write_points(guides, points(guides) + np.float32(0.01))
        update()
    flatten(surface, True)
    for vertex in surface.data.vertices:
        vertex.co *= 2.0
    surface.data.update()
    update()
    flatten(surface, False)
    roots = points(guides)[:, 0]
    assert _distance_to(surface, roots) < 1e-4 + 0.02 * is_combed
    flatten(surface, True)
    if is_combed:
        write_points(guides, 1.5 * points(guides))
    else:
        guides.data.vellus.guides.length = 0.8
    update()
    assert "scale of zero" in (hair if is_combed else guides).data.vellus.status
    flatten(surface, False)
    assert [one.data.vellus.status for one in (hair, guides)] == ["", ""]
    waited = points(hair)
    pipeline.evaluate(hair.data, bpy.context.evaluated_depsgraph_get())
    np.testing.assert_array_equal(points(hair), waited)


def _distance_to(surface, roots):
    """Return the largest distance of (N, 3) points to a mesh, in its coordinates."""
    return max((surface.closest_point_on_mesh(root)[1] - Vector(root)).length for root in roots)


@pytest.mark.parametrize(
    ("scale", "angle"),
    [((2.0, 2.0, 2.0), 0.0), ((0.5, 1.0, 1.7), 0.6), ((-1.0, 1.0, 1.0), 0.0), ((1.0, 1.0, 1.0), 0.8)],
)
def test_styles_have_the_present_scale_of_the_surface(hair, scale, angle):
    """A changed style of hair on a surface that was scaled since gives the same strands as hair that is bound anew."""
    bpy.context.view_layer.objects.active = hair
    bpy.ops.vellus.add_style(style="CLUMP")
    bpy.ops.vellus.add_style(style="CURL")
    surface = hair.data.surface
    surface.scale, surface.rotation_euler.z = scale, angle
    update()
    hair.data.vellus.styles[1].curl.radius = 0.03
    update()
    followed = points(hair)
    bindings.invalidate(hair.data)
    pipeline.evaluate(hair.data, bpy.context.evaluated_depsgraph_get())
    np.testing.assert_allclose(points(hair), followed, rtol=0.0, atol=1e-5)


def test_hair_of_a_scaled_surface_stays_while_its_masks_do(hair):
    """A reported mesh whose weights did not change keeps the strands of hair that was bound at another scale."""
    bpy.context.view_layer.objects.active = hair
    bpy.ops.vellus.add_style(style="TRIM")
    surface, trim = hair.data.surface, hair.data.vellus.styles[0].trim
    surface.vertex_groups.new(name="Cut").add(range(len(surface.data.vertices)), 0.5, "REPLACE")
    trim.mask, trim.to_length = "Cut", 0.1
    update()
    surface.scale = (2.0, 2.0, 2.0)
    update()
    before = points(hair)
    surface.data.update()
    update()
    np.testing.assert_array_equal(points(hair), before)
    trim.to_length = 0.1001
    update()
    assert np.abs(points(hair) - before).max() > 0.01
