# SPDX-License-Identifier: GPL-3.0-or-later
"""Ambient visibility of strands in one byte per number: shaders/light/visibility_bytes.glsl."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.gpu import ambient_visibility, strand_textures
from hair_addon.blender.gpu.programs import seen_programs, shaders
from hair_addon.blender.render import offscreen
from hair_addon.core.imaging import ambient_cube
from hair_addon.core.imaging.pixel_sampling import PictureSettings
from tests.support.pictures import glsl

COUNT = 500
STEP = 0.5 / 255.0 + 1e-5  # the largest error of a number between zero and one

_ROUND_TRIP = """
vec4 kept(vec4 x_y, vec4 z, vec4 surface, vec4 channels, vec4 color, int which)
{
  Seen seen;
  seen.x_y = x_y;
  seen.z = z;
  seen.surface = surface;
  seen.channels = channels;
  seen.color = color;
  Seen bytes = seen_to_bytes(seen);
  bytes.x_y = floor(255.0 * bytes.x_y + 0.5) / 255.0;
  bytes.z = floor(255.0 * bytes.z + 0.5) / 255.0;
  bytes.surface = floor(255.0 * bytes.surface + 0.5) / 255.0;
  bytes.channels = floor(255.0 * bytes.channels + 0.5) / 255.0;
  bytes.color = floor(255.0 * bytes.color + 0.5) / 255.0;
  seen = seen_from_bytes(bytes);
  return which == 0   ? seen.x_y :
         which == 1 ? seen.z :
         which == 2 ? seen.surface :
         which == 3 ? seen.channels :
                      seen.color;
}
"""


def sums(rng):
    """Return five (N, 4) sums over directions, as by light/world_visibility.comp, of dark and of open places."""
    axes, weights = ambient_cube.DIRECTIONS, 6.0 * ambient_cube.WEIGHTS

    def parts(*more):
        return rng.random((COUNT, len(axes), *more)) ** rng.uniform(0.2, 8.0, (COUNT, 1, *[1] * len(more)))

    is_hidden = parts() * (rng.random((COUNT, 1)) < 0.8)
    seen, left = weights * (1.0 - is_hidden) * parts(), parts()
    sides = np.stack([(seen * np.maximum(s * axes[:, a], 0.0) ** 2).sum(1) for a in range(3) for s in (1.0, -1.0)], 1)
    tangents = rng.normal(size=(COUNT, 3))
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    second = 1.5 * (tangents @ axes.T) ** 2 - 0.5
    z = np.column_stack([sides[:, 4:], (seen * left).sum(1), (seen * second).sum(1)])
    through = weights * is_hidden * left**2
    surface = np.column_stack([through @ -axes, through.sum(1)])
    channels = np.column_stack(
        [(weights[:, None] * (1.0 - is_hidden)[..., None] * parts(3)).sum(1), (weights * is_hidden).sum(1)]
    )
    color = rng.random((COUNT, 4)) * surface[:, 3:]
    return sides[:, :4], z, surface, channels, color


def test_bytes_keep_what_strands_see(fine_world, rng):
    """Stored sums and ratios are exact to half a step of their square root, the direction of surfaces to a third of a
    degree.
    """
    given = sums(rng)
    names = dict(zip(("x_y", "z", "surface", "channels", "tint"), given, strict=True))
    text = shaders.expand("light/visibility_bytes.glsl")[0] + _ROUND_TRIP
    found = [glsl.evaluate(text, "vec4", f"kept(x_y, z, surface, channels, tint, {i})", **names) for i in range(5)]
    np.testing.assert_allclose(np.sqrt(found[0]), np.sqrt(given[0]), rtol=0.0, atol=STEP)
    np.testing.assert_allclose(np.sqrt(found[1][:, :2]), np.sqrt(given[1][:, :2]), rtol=0.0, atol=STEP)
    np.testing.assert_allclose(np.sqrt(found[3] / 6.0), np.sqrt(given[3] / 6.0), rtol=0.0, atol=STEP)
    of_all, of_found = (x_y.sum(1) + z[:, :2].sum(1) for x_y, z in (given[:2], found[:2]))
    left, left_found = given[1][:, 2] / of_all, found[1][:, 2] / of_found
    np.testing.assert_allclose(np.sqrt(left_found), np.sqrt(left), rtol=0.0, atol=2.0 * STEP)
    np.testing.assert_allclose(found[1][:, 3] / of_found, given[1][:, 3] / of_all, rtol=0.0, atol=2.0 * STEP)
    has_surface = given[3][:, 3] > 0.05
    assert 0 < has_surface.sum() < COUNT
    some = (array[has_surface, :3] for array in (found[2], given[2]))
    directions, wanted = (array / np.linalg.norm(array, axis=1)[:, None] for array in some)
    assert np.degrees(np.linalg.norm(directions - wanted, axis=1).max()) < 0.4
    np.testing.assert_array_equal(found[2][given[3][:, 3] == 0.0], 0.0)
    colors, wanted = (one[4][has_surface, :3] / one[2][has_surface, 3:] for one in (found, given))
    np.testing.assert_allclose(np.sqrt(colors), np.sqrt(wanted), rtol=0.0, atol=2.0 * STEP)


def test_bytes_of_visibility_are_no_visible_step_in_pictures(thin, monkeypatch):
    """Under world light, pictures differ from those of single-precision textures by less than a step of a display."""
    bpy.data.objects["Sun"].hide_render = True
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.5, 0.45, 0.4, 1.0)
    bpy.context.view_layer.update()
    settings = PictureSettings(120, 120, 2)
    kept = offscreen.draw_picture(settings)
    monkeypatch.setattr(seen_programs, "BYTES", "RGBA32F")
    wide = offscreen.draw_picture(settings)
    shown, wanted = (255.0 * np.clip(picture[..., :3], 0.0, 1.0) ** (1.0 / 2.2) for picture in (kept, wide))
    bpy.context.view_layer.update()
    apart = np.abs(shown - wanted)[(wide[..., 3] > 0.0) & (wide != wide[0, 0]).any(axis=2)]
    assert wanted[wide[..., 3] > 0.5].std() > 10.0  # there is light and shade
    assert 0.0 < apart.mean() < 0.15 and np.percentile(apart, 99.9) < 1.0


@pytest.mark.parametrize("point_count", [5, 41])
def test_memory_of_visibility_is_as_it_is_counted(scene, rng, point_count):
    """Ambient visibility takes a byte for each of twenty numbers, at every fourth point and the tip."""
    points = rng.random((50, point_count, 3)).astype(np.float32)
    strands = strand_textures.upload_strands(points, np.full((50, point_count), 1e-4, np.float32))
    (seen,), _surfaces = ambient_visibility.measure([(strands, np.eye(4))], [], [0.5], [])
    bytes_each = {"RGBA8": 4}
    held = sum(texture.width * texture.height * bytes_each[texture.format] for texture in seen.values())
    assert held == strand_textures.seen_bytes(strands)
    assert held == 20 * strands.texture.height * strands.row_strands * (-(-(point_count - 1) // 4) + 1)
