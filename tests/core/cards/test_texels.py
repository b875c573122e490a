# SPDX-License-Identifier: GPL-3.0-or-later
"""Card textures have the color, normal, depth and other values of samples, and empty texels those of neighbors."""

from dataclasses import replace

import numpy as np
import pytest

from hair_addon.core.cards import texels, texture_layouts
from hair_addon.core.cards.texels import NO_STRAND, PlacedStrands, TexelSums

SIZE = 32


@pytest.fixture
def strip():
    """Return a strand up the middle, 8 texels wide, from height 0 to 1 and from red to green."""
    places = np.array([[[0.5, 0.0, 0.0], [0.5, 0.5, 0.5], [0.5, 1.0, 1.0]]], np.float32)
    colors = np.array([[[1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.0, 1.0, 0.0]]], np.float32)
    return PlacedStrands(places, np.full((1, 3), 4.0 / SIZE), colors, np.array([0.25]), (0.0, 1.0))


def seen(strip, per_side=2):
    """Return the segment that each sample shows."""
    side = SIZE * per_side
    y, x = (np.indices((side, side)) + 0.5) / side
    return np.where(np.abs(x - 0.5) < strip.radii[0, 0], (y >= 0.5).astype(int), NO_STRAND)


def maps(strip, segments):
    sums = TexelSums(SIZE)
    for rows in (range(10), range(10, SIZE)):
        sums.add(segments[2 * rows.start : 2 * rows.stop], strip, 2, np.zeros(2), rows)
    return sums.maps()


def test_maps_are_those_of_the_strand(strip):
    found = maps(strip, seen(strip))
    v = (np.arange(SIZE) + 0.5) / SIZE
    inside = slice(SIZE // 2 - 4, SIZE // 2 + 4)
    np.testing.assert_array_equal(found["alpha"][:, inside], 1.0)
    assert found["alpha"].sum() == 8 * SIZE
    for name in ("root", "depth"):
        np.testing.assert_allclose(found[name][:, inside], np.broadcast_to(v[:, None], (SIZE, 8)), atol=1e-6)
    np.testing.assert_allclose(found["id"], 0.25, atol=1e-6)
    np.testing.assert_allclose(found["color"][:, 16, 1], v, atol=1e-6)


def test_normals_are_unit_and_lean_as_a_cylinder(strip):
    normals = 2.0 * maps(strip, seen(strip))["normal"] - 1.0
    np.testing.assert_allclose(np.linalg.norm(normals, axis=-1), 1.0, atol=1e-5)
    # The strand rises by 45°: its normals lie in the plane across it.
    middle = normals[16, SIZE // 2 - 4 : SIZE // 2 + 4]
    np.testing.assert_allclose(middle @ [0.0, 1.0, 1.0], 0.0, atol=1e-5)
    assert (np.diff(middle[:, 0]) > 0.0).all() and middle[0, 0] < -0.8 < 0.8 < middle[-1, 0]


def test_empty_texels_are_as_what_is_near(strip):
    found = maps(strip, seen(strip))
    assert (found["color"].sum(axis=-1) > 0.99).all()
    np.testing.assert_allclose(found["root"][:, 0], (np.arange(SIZE) + 0.5) / SIZE, atol=0.3)
    odd = texels._filled(np.eye(7, dtype=np.float32)[..., None] * 3.0, np.eye(7, dtype=np.float32))
    np.testing.assert_allclose(odd, 3.0, rtol=1e-6)
    empty = maps(strip, np.full((2 * SIZE, 2 * SIZE), NO_STRAND))
    assert not empty["alpha"].any() and np.isfinite(empty["normal"]).all()


def test_display_values_are_those_of_srgb():
    np.testing.assert_allclose(texels.srgb(np.array([0.0, 0.18, 1.0, 2.0])), [0.0, 0.46135613, 1.0, 1.0], atol=1e-6)
    np.testing.assert_allclose(texels.srgb(np.array([0.0031307, 0.0031309])), 0.04045, atol=1e-4)


def test_tangents_point_from_root_to_tip(strip):
    """A strand that rises by 45° along V has the tangent (0, √½, √½), and the opposite one if it runs downward."""
    found = 2.0 * maps(strip, seen(strip))["tangent"] - 1.0
    np.testing.assert_allclose(found[:, SIZE // 2], np.broadcast_to([0.0, 0.5**0.5, 0.5**0.5], (SIZE, 3)), atol=1e-5)
    backward = replace(strip, places=strip.places[:, ::-1])
    segments = seen(strip)
    other = np.where(segments == NO_STRAND, NO_STRAND, 1 - segments)
    np.testing.assert_allclose(2.0 * maps(backward, other)["tangent"] - 1.0, -found, atol=1e-5)


def test_packed_textures_have_their_values_in_unreals_channels(rng):
    """Each channel has the value that Unreal's list names; colors are in sRGB, other values unchanged."""
    parts = {name: rng.random((4, 4)).astype(np.float32) for name in ("alpha", "depth", "root", "id")}
    parts |= {name: rng.random((4, 4, 3)).astype(np.float32) for name in ("color", "normal", "tangent")}
    zero, rough = np.zeros((4, 4)), np.full((4, 4), 0.3)
    color = texels.srgb(parts["color"])
    wanted = {
        "UNREAL": {
            "Depth": [parts["depth"]],
            "Coverage": [parts["alpha"]],
            "Tangent": [parts["tangent"]],
            "Attributes": [zero, parts["root"], parts["id"]],
            "Material": [color, rough],
        },
        "UNREAL_COMPACT": {
            "TangentCoordU": [parts["tangent"], parts["root"]],
            "CoverageDepthSeed": [parts["alpha"], parts["depth"], parts["id"]],
            "ColorRoughness": [color, rough],
        },
        "SEPARATE": {},
    }
    for layout, textures in wanted.items():
        found = texture_layouts.packed(parts, layout, 0.3)
        assert set(found) == {f"unreal_{name}" for name in textures}
        for name, channels in textures.items():
            np.testing.assert_allclose(found[f"unreal_{name}"], np.dstack(channels), atol=1e-7)


def test_texels_have_the_roughness_of_their_strands(strip):
    """Two strands, side by side, of other roughness; packed textures have it too."""
    places = np.concatenate([strip.places + np.array([x, 0.0, 0.0]) for x in (-0.25, 0.25)])
    radii, colors = np.repeat(strip.radii, 2, axis=0), np.repeat(strip.colors, 2, axis=0)
    both = PlacedStrands(places, radii, colors, np.zeros(2), (0.0, 1.0), roughness=np.float32([0.2, 0.6]))
    x = (np.arange(2 * SIZE) + 0.5) / (2 * SIZE)
    segments = np.broadcast_to(
        np.where(np.abs(x - 0.25) < 0.1, 0, np.where(np.abs(x - 0.75) < 0.1, 2, NO_STRAND)), [64, 64]
    )
    sums = TexelSums(SIZE, has_roughness=True)
    sums.add(segments, both, 2, np.zeros(2), range(SIZE))
    found = sums.maps()
    np.testing.assert_allclose(found["roughness"][:, 6:10], 0.2, atol=1e-6)
    np.testing.assert_allclose(found["roughness"][:, 22:26], 0.6, atol=1e-6)
    for layout, name in (("UNREAL", "Material"), ("UNREAL_COMPACT", "ColorRoughness")):
        packed = texture_layouts.packed(found, layout, 0.9)[texture_layouts.PREFIX + name]
        np.testing.assert_array_equal(packed[..., 3], found["roughness"])
