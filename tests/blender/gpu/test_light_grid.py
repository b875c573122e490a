# SPDX-License-Identifier: GPL-3.0-or-later
"""Programs read the light of voxels and of sample points along strands from one texture."""

import numpy as np
import pytest

from hair_addon.blender.gpu import light_grid
from hair_addon.blender.gpu.programs import shaders, uniforms
from hair_addon.core.shading.light_paths import light_texels
from tests.support.pictures import glsl

SHAPE, CORNER, VOXEL, COUNT = np.array([22, 5, 3]), np.array([1.0, -2.0, 0.5]), 0.25, 500


def between(values, at):
    """Return values (..., 4) between texels of the first axes, linear at places (N, axes) [texels], clamped."""
    sides = np.array(values.shape[:-1])
    at = np.clip(at - 0.5, 0.0, sides - 1.0)
    low = np.minimum(at.astype(int), np.maximum(sides - 2, 0))
    found = 0.0
    for corner in np.ndindex(*[2] * len(sides)):
        weight = np.prod(np.where(corner, at - low, 1.0 - (at - low)), axis=1)
        found = found + weight[:, None] * values[tuple(np.minimum(low + corner, sides - 1).T)]
    return found


@pytest.mark.parametrize(("strand_count", "nodes"), [(0, 0), (3, 11), (400, 4)])
@pytest.mark.parametrize("part", [1.0, 0.25])
def test_light_is_between_voxels_and_nodes(scene, rng, strand_count, nodes, part):
    voxels = rng.random((*SHAPE[::-1], 4)).astype(np.float32)
    of_nodes = rng.random((strand_count, nodes, 4)).astype(np.float32) if nodes else None
    lights = uniforms.LIGHTS.record()
    lights["grid_corner"] = *CORNER, part
    sides = light_texels.sides_of(SHAPE)
    lights["grid_scale"] = *(1.0 / (VOXEL * sides)), sides[2]
    position = CORNER + VOXEL * SHAPE * rng.uniform(-0.1, 1.1, (COUNT, 3))  # also outside
    strand, along = rng.integers(0, max(strand_count, 1), COUNT), rng.random(COUNT)
    found = glsl.evaluate(
        shaders.expand("light/light_grid.glsl")[0],
        "vec4",
        "light_among_strands(position, int(strand), along, true)",
        structs=uniforms.LIGHT.source + uniforms.LIGHTS.source,
        blocks={"lights": ("Lights", lights)},
        textures={"light_grid": light_grid.upload(light_texels.packed(voxels, of_nodes))},
        volumes=("light_grid",),
        position=position,
        strand=strand.astype(float),
        along=along,
    )
    expected = between(voxels, ((position - CORNER) / VOXEL)[:, ::-1])
    if nodes:
        one = np.array([between(of_nodes[s], np.array([[at * nodes]]))[0] for s, at in zip(strand, along, strict=True)])
        expected = np.concatenate([one[:, :3], np.zeros((COUNT, 1))], axis=1) + one[:, 3:] * expected
    expected = (1.0 - part) * np.array([0.0, 0.0, 0.0, 1.0]) + part * expected
    np.testing.assert_allclose(found, expected, atol=0.012)  # places between texels are rounded to 1/256
