# SPDX-License-Identifier: GPL-3.0-or-later
"""A map of the look gives each strand its own color and roughness."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data.maps import strand_maps
from hair_addon.blender.render import offscreen
from hair_addon.blender.settings import map_items
from hair_addon.command_line import map_options
from hair_addon.core.errors import HairError
from hair_addon.core.imaging.pixel_sampling import PictureSettings
from hair_addon.core.maps.map_settings import MapSettings
from hair_addon.core.shading import appearance

RED, BLUE = (0.6, 0.1, 0.05), (0.05, 0.1, 0.6)


def image_of(pixels, name="coat", **options):
    """Return a generated Non-Color image of (H, W, 4) pixels."""
    height, width, _channels = pixels.shape
    image = bpy.data.images.new(name, width, height, alpha=True, float_buffer=True, is_data=True, **options)
    image.pixels.foreach_set(np.ascontiguousarray(pixels, np.float32).ravel())
    image.update_tag()
    return image


def halves():
    """Return (8, 64, 4) pixels: red on the left, blue on the right."""
    pixels = np.ones((8, 64, 4))
    pixels[:, :32, :3], pixels[:, 32:, :3] = RED, BLUE
    return pixels


def vary(hair, setting, **changes):
    map_items.keep(hair.vellus, MapSettings(setting=setting, **changes))
    bpy.context.view_layer.update()
    return strand_maps.read_looks(hair)


@pytest.fixture
def coat(hair):
    """Return hair with a color."""
    hair.data.vellus.appearance.parametrization = "COLOR"
    bpy.context.view_layer.update()
    return hair.data


def test_a_constant_map_is_the_constant(coat):
    """A map of one color gives each strand, bit for bit, the absorption of this color."""
    pixels = np.ones((4, 4, 4))
    pixels[..., :3] = RED
    image_of(pixels)
    looks = vary(coat, "look.color", source="coat")
    stored = np.float32(RED)
    look = appearance.Appearance(parametrization="COLOR", color=tuple(map(float, stored)))
    np.testing.assert_array_equal(looks.root, np.tile(np.float32(appearance.sigma_a(look)), (len(looks), 1)))
    np.testing.assert_array_equal(looks.tip, looks.root)
    np.testing.assert_array_equal(looks.roughness, 1.0)


def test_two_looks_are_the_two_grooms(coat):
    """Strands on each half of an image have, bit for bit, the look of a groom with the color of this half."""
    image = image_of(halves())
    material = bpy.data.materials.new("Painted")  # Blender reports changes of images that a material shows
    material.node_tree.nodes.new("ShaderNodeTexImage").image = image
    bpy.data.objects["Sphere"].data.materials.append(material)
    both = vary(coat, "look.color", source="coat")
    found = np.zeros(len(both), int)
    for color in (RED, BLUE):
        pixels = np.ones((8, 64, 4))
        pixels[..., :3] = color
        image.pixels.foreach_set(np.float32(pixels).ravel())
        image.update_tag()
        bpy.context.view_layer.update()
        found += (strand_maps.read_looks(coat).root == both.root).all(axis=1)
    assert (found == 1).mean() > 0.5  # others are mixed, as their share of the surface has both
    assert (found <= 1).all()


def test_numbers_are_factors(hair):
    """A map from 0 to 1 multiplies melanin; From, To and Invert change the factor; roughness varies by its factor."""
    group = bpy.data.objects["Sphere"].vertex_groups["top"]
    curves = hair.data
    curves.vellus.appearance.melanin, curves.vellus.appearance.redness = 0.5, 0.0
    dark = vary(curves, "look.melanin", kind="GROUP", source=group.name).root[:, 0]
    whole = appearance.sigma_a(appearance.Appearance(melanin=0.5, redness=0.0))[0]
    assert dark.min() == 0.0
    assert dark.max() == np.float32(whole)
    light = vary(curves, "look.melanin", kind="GROUP", source=group.name, is_inverted=True).root[:, 0]
    np.testing.assert_array_equal(np.sort(light[(dark == 0.0) | (dark == dark.max())])[[0, -1]], [0.0, dark.max()])
    rough = vary(curves, "look.roughness", kind="GROUP", source=group.name, low=0.5, high=2.0).roughness
    np.testing.assert_allclose([rough.min(), rough.max()], [0.5, 2.0], rtol=1e-6)


def test_radial_roughness_varies(coat):
    """A map gives each strand its own radial roughness, with the absorption for its color; nothing stays of a removed
    map.
    """
    look = coat.vellus.appearance
    look.color, look.radial_roughness = RED, 0.25
    group = bpy.data.objects["Sphere"].vertex_groups["top"]
    looks = vary(coat, "look.radial_roughness", kind="GROUP", source=group.name, low=1.0, high=3.0)
    np.testing.assert_allclose([looks.radial.min(), looks.radial.max()], [0.25, 0.75], rtol=1e-6)
    for value in (0.25, 0.75):
        even = appearance.Appearance(parametrization="COLOR", color=tuple(look.color), radial_roughness=value)
        own = looks.root[looks.radial == value]
        assert len(own)
        np.testing.assert_allclose(own, np.tile(appearance.sigma_a(even), (len(own), 1)), rtol=1e-6)
    assert "Vellus Radial Roughness" in coat.materials[0].node_tree.nodes
    map_items.remove(coat.vellus, "look.radial_roughness")
    bpy.context.view_layer.update()
    assert strand_maps.read_looks(coat) is None and not strand_maps.has_radial(coat)
    looks = vary(coat, "look.roughness", kind="STRAND")
    assert looks.radial is None and "Vellus Radial Roughness" not in coat.materials[0].node_tree.nodes


def test_random_colors_differ_by_place(hair):
    """Where a map of *Random Color* is 0 or 1, strands have the colors of a groom with the value at From or To."""
    sphere, curves = bpy.data.objects["Sphere"], hair.data
    group = sphere.vertex_groups.new(name="half")
    group.add([v.index for v in sphere.data.vertices if v.co.x > 0.0], 1.0, "REPLACE")
    look = curves.vellus.appearance
    look.random_color = 0.8
    even, whole = (
        vary(curves, "look.random_color", kind="STRAND", low=factor, high=factor).root for factor in (0.25, 1.0)
    )
    assert np.ptp(whole[:, 0]) > 2.0 * np.ptp(even[:, 0]) > 0.01
    look.random_color = 0.2
    np.testing.assert_array_equal(vary(curves, "look.random_color", kind="STRAND", low=1.0, high=1.0).root, even)
    look.random_color = 0.8
    found = vary(curves, "look.random_color", kind="GROUP", source="half", low=0.25, high=1.0).root
    counts = [(found == other).all(axis=1).mean() for other in (even, whole)]
    assert min(counts) > 0.3 and sum(counts) > 0.7


def test_every_source_is_read(coat):
    """Attributes of each domain, the hair's own attributes and random numbers give each strand its value."""
    mesh, curves = bpy.data.objects["Sphere"].data, coat
    for domain in ("POINT", "EDGE", "FACE", "CORNER"):
        made = mesh.attributes.new(f"of {domain}", "FLOAT_COLOR", domain)
        made.data.foreach_set("color", np.tile(np.float32([*RED, 1.0]), len(made.data)))
    own = curves.attributes.new("own", "FLOAT_VECTOR", "CURVE")
    own.data.foreach_set("vector", np.tile(np.float32(RED), len(own.data)))
    wanted = np.float32(
        appearance.sigma_a(appearance.Appearance(parametrization="COLOR", color=tuple(map(float, np.float32(RED)))))
    )
    for domain in ("POINT", "EDGE", "FACE", "CORNER"):
        looks = vary(curves, "look.color", kind="ATTRIBUTE", source=f"of {domain}")
        np.testing.assert_allclose(looks.root, np.tile(wanted, (len(looks), 1)), rtol=1e-5)
    looks = vary(curves, "look.color", kind="CURVES", source="own")
    np.testing.assert_array_equal(looks.root, np.tile(wanted, (len(looks), 1)))
    random = vary(curves, "look.color", kind="STRAND", seed=3)
    assert len(np.unique(random.root[:, 0])) > 0.9 * len(random)
    assert not random.is_same(vary(curves, "look.color", kind="STRAND", seed=4))
    assert random.is_same(vary(curves, "look.color", kind="STRAND", seed=3))


def test_a_missing_source_is_a_status_and_the_value_is_used(coat):
    """Hair whose map has a missing source uses the value of the setting, and a status names the source."""
    coat.vellus.appearance.color = RED
    for kind in ("GROUP", "ATTRIBUTE", "CURVES"):
        looks = vary(coat, "look.color", kind=kind, source="lost")
        assert "lost" in coat.vellus.shading_status
        look = appearance.Appearance(parametrization="COLOR", color=tuple(coat.vellus.appearance.color))
        np.testing.assert_allclose(looks.root, np.tile(appearance.sigma_a(look), (len(looks), 1)), rtol=1e-6)
    image_of(halves())
    vary(coat, "look.color", source="coat")
    assert coat.vellus.shading_status == ""
    bpy.data.images.remove(bpy.data.images["coat"])
    vary(coat, "look.roughness", kind="STRAND")
    assert "image" in coat.vellus.shading_status


def test_maps_follow_a_moved_turned_and_scaled_surface(coat):
    """A moved, turned, mirrored or scaled object keeps the look of each strand, as looks belong to roots."""
    image_of(halves())
    before = vary(coat, "look.color", source="coat")
    sphere = bpy.data.objects["Sphere"]
    for scale in ((0.01, 0.01, 0.01), (-1.0, 1.0, 1.0), (1.0, 2.0, 0.5)):
        sphere.location, sphere.rotation_euler, sphere.scale = (3.0, 1.0, 0.0), (0.3, 0.2, 1.0), scale
        bpy.context.view_layer.update()
        coat.vellus.appearance.color = coat.vellus.appearance.color
        bpy.context.view_layer.update()
        after = strand_maps.read_looks(coat)
        # Rounding of the areas changes shares a little; uneven scales change the areas themselves.
        is_near = np.isclose(after.root, before.root, rtol=1e-3, atol=1e-3).all(axis=1)
        assert is_near.all() if abs(scale[0]) == abs(scale[1]) else is_near.mean() > 0.5


def test_maps_are_saved_with_their_images(coat, tmp_path):
    """A saved and loaded file has the same maps and looks; a renamed image stays the map's image."""
    image_of(halves()).pack()
    before = vary(coat, "look.color", source="coat")
    bpy.data.images["coat"].name = "renamed"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "maps.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "maps.blend"))
    hair = bpy.data.objects["Hair"].data
    assert [settings.source for settings in map_items.maps_of(hair.vellus)] == ["renamed"]
    assert strand_maps.read_looks(hair).is_same(before)
    hair.vellus.maps[0].is_inverted = hair.vellus.maps[0].is_inverted
    bpy.context.view_layer.update()
    assert strand_maps.read_looks(hair).is_same(before)


SIZE = 32


def picture():
    """Return the picture (SIZE, SIZE, 4), linear."""
    settings = PictureSettings(width=SIZE, height=SIZE, samples_per_side=1, is_transparent=True)
    return offscreen.draw_picture(settings).astype(np.float64)


MODELS = [("KAJIYA_KAY", "energy"), ("MARSCHNER", "energy")]


@pytest.mark.parametrize(
    ("model", "mode"), [MODELS[1], *(pytest.param(*each, marks=pytest.mark.long) for each in MODELS[:1])]
)
def test_a_constant_map_draws_the_constant(lit, model, mode):
    """Hair with a map of one color is drawn as hair of this color, within 1.5/255; without the map, bit for bit."""
    state = lit.data.vellus
    state.marschner.size, state.hair.radius = 32, 0.02
    state.model, state.appearance.mode, state.appearance.parametrization = model, mode, "COLOR"
    state.appearance.color = RED
    bpy.context.view_layer.update()
    plain = picture()
    state.appearance.color = BLUE
    pixels = np.ones((4, 4, 4))
    pixels[..., :3] = RED
    image_of(pixels)
    vary(lit.data, "look.color", source="coat")
    mapped = picture()
    np.testing.assert_allclose(mapped, plain, atol=1.5 / 255.0)
    map_items.remove(state, "look.color")
    state.appearance.color = RED
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(picture(), plain)


@pytest.mark.parametrize(
    ("model", "mode"),
    [
        ("MARSCHNER", "energy"),
        *(pytest.param(*each, marks=pytest.mark.long) for each in (("KAJIYA_KAY", "energy"), ("MARSCHNER", "classic"))),
    ],
)
def test_a_constant_map_of_the_radial_roughness_draws_the_constant(lit, model, mode):
    """Hair whose map gives one radial roughness is drawn as hair with this setting, within 1.5/255."""
    state = lit.data.vellus
    state.marschner.size, state.hair.radius = 32, 0.02
    state.model, state.appearance.mode, state.appearance.parametrization = model, mode, "COLOR"
    state.appearance.color, state.appearance.radial_roughness = RED, 0.6
    bpy.context.view_layer.update()
    plain = picture()
    state.appearance.radial_roughness = 0.25
    vary(lit.data, "look.radial_roughness", kind="STRAND", low=2.4, high=2.4)
    np.testing.assert_allclose(picture(), plain, atol=1.5 / 255.0)


def test_a_map_is_set_by_panel_script_and_command_line(coat):
    """A new map in the panel changes nothing until it has a source; scripts and options give the same map."""
    bpy.context.view_layer.objects.active = bpy.data.objects["Hair"]
    bpy.ops.vellus.edit_map(setting="look.color")
    bpy.context.view_layer.update()
    assert strand_maps.read_looks(coat) is None
    assert coat.vellus.shading_status == ""
    with pytest.raises(HairError, match="No map can vary"):
        api.set_map(coat, "look.ior", "strand")
    wanted = api.set_map(coat, "look.color", "strand", seed=5, amount=0.5)
    assert api.maps_of(coat) == (wanted,) == (map_options.parsed_map("look.color=strand,seed=5,amount=0.5"),)
    bpy.context.view_layer.update()
    assert strand_maps.read_looks(coat) is not None
    bpy.ops.vellus.remove_map(setting="look.color")
    bpy.context.view_layer.update()
    assert strand_maps.read_looks(coat) is None
