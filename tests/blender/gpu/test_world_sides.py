# SPDX-License-Identifier: GPL-3.0-or-later
"""World light on strands, channel by channel, by the functions of shaders/light/world.glsl."""

import numpy as np
import pytest

from hair_addon.blender.gpu import ambient_visibility, strand_textures, surface_textures
from hair_addon.blender.gpu.programs import shaders, uniforms
from tests.support.pictures import glsl

COUNT = 200

pytestmark = pytest.mark.usefixtures("fine_world")


def sides_of(seen, opacity, forward, channels):
    """Return (N, 6, 3) radiance that arrives from the sides of a white world."""
    lights = uniforms.LIGHTS.record()
    lights["world"] = 1.0
    text = shaders.expand("light/world.glsl")[0]
    text += """
vec3 one_side(int side, vec4 x_y, vec2 z, float opacity, vec3 forward, vec3 channels)
{
  mat3 plus;
  mat3 minus;
  strand_sides(x_y, z, opacity, forward, channels, plus, minus);
  return (side % 2 == 0) ? plus[side / 2] : minus[side / 2];
}
"""
    inputs = {"x_y": seen[:, :4], "z": seen[:, 4:], "opacity": opacity, "given": forward, "channels": channels}
    return np.stack(
        [
            glsl.evaluate(
                text,
                "vec3",
                "one_side(int(side), x_y, z, opacity, given, channels)",
                structs=uniforms.LIGHT.source + uniforms.LIGHTS.source,
                blocks={"lights": ("Lights", lights)},
                side=np.full(len(seen), float(side)),
                **inputs,
            )
            for side in range(6)
        ],
        axis=1,
    )


def test_strands_color_light_and_surfaces_do_not(scene, rng):
    """Surfaces block all channels equally; strands block each channel by its own opacity."""
    forward = rng.uniform(0.1, 0.95, (COUNT, 3))
    opacity = 1.0 - forward.mean(axis=1)
    open_parts = rng.uniform(0.0, 1.0, (COUNT, 6))
    found = sides_of(open_parts, opacity, forward, np.repeat(open_parts.sum(axis=1)[:, None], 3, axis=1))
    np.testing.assert_allclose(found, np.repeat(open_parts[..., None], 3, axis=2), atol=2e-3)
    counts = rng.uniform(0.1, 4.0, (COUNT, 6, 1))
    through = np.exp(-counts * (1.0 - forward[:, None]))
    found = sides_of(np.exp(-counts[..., 0] * opacity[:, None]), opacity, forward, through.sum(axis=1))
    np.testing.assert_allclose(found, through, rtol=0.01, atol=2e-3)


def test_a_floor_hides_half_of_the_world_of_every_channel(scene, rng):
    """A floor hides half of the world in every channel from strands just above it, with any transmittance."""
    roots = np.append(rng.uniform(-1.0, 1.0, (50, 2)), np.zeros((50, 1)), axis=1)
    points = roots[:, None] + np.linspace(0.0, 0.3, 5)[:, None] * np.array([0.3, 0.0, 1.0])
    hair = strand_textures.upload_strands(points.astype(np.float32), np.full((50, 5), 1e-7, np.float32))
    corners = 99.0 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    floor = surface_textures.upload_surface(corners.astype(np.float32), np.arange(6, dtype=np.int32))
    forward = np.array([0.9, 0.5, 0.1])
    (seen,), _surfaces = ambient_visibility.measure([(hair, np.eye(4))], [floor], [0.5], [], forwards=[forward])
    texture = seen["visibility_channels"]
    found = (np.array(texture.read(), float).reshape(-1, 2, 4)[:50, 1] / 255.0) ** 2  # at the tips
    np.testing.assert_allclose(found[:, :3], np.repeat(found[:, :1], 3, axis=1), atol=1e-3)
    assert found[:, :3].mean() == pytest.approx(0.5, abs=0.06)
    assert found[:, 3].mean() == pytest.approx(0.5, abs=0.06)  # where it sees the floor
