# SPDX-License-Identifier: GPL-3.0-or-later
"""Light among strands: `core.shading.light_paths` of a `DrawnScene` from a camera."""

from dataclasses import replace

import numpy as np

from ...core.imaging import lamps
from ...core.long_work import no_progress, part_of
from ...core.shading import appearance, light_paths
from ...core.shading.fibre import strand_variation
from ...core.shading.fibre.principled import varied_roughness
from ..gpu import drawing, light_grid, light_patterns, world_texture
from ..settings import preferences
from . import seen_strands

_PATHS_A_PIXEL = 2
_LEAST_PATHS, _MOST_PATHS = 20_000, 300_000  # over the part of the picture that contains the hair
SAMPLES_A_PATH = 2  # samples of the picture per path
NOISE = 0.1  # relative standard error of the light of voxels, above which more paths are traced

# Maximum factor of paths, if the part is mostly empty or few of its paths reach light; on a GPU also for noisy voxels,
# up to a number of paths that takes 0.3 s on an H200.
_MOST_TIMES, _MOST_TIMES_ON_GPU, _MOST_ON_GPU = 4, 32, 2_400_000

_OTHER_MODEL = "Hair is lit by Dual Scattering: Light Grid needs Marschner with Energy Conserving for all hair."
_LINKED = "Hair is lit by Dual Scattering: Light Grid does not support light linking."


def path_count(blender_scene, size):
    """Number of paths for a picture; 0 with dual scattering. size: (width, height) [pixels]."""
    if blender_scene.vellus.multiple_scattering == "DUAL":
        return 0
    return min(max(_PATHS_A_PIXEL * size[0] * size[1], _LEAST_PATHS), _MOST_PATHS)


def most_paths(device, count, step_count=1):
    """Return the maximum number of paths on a Warp device for a picture of `count` paths.

    step_count: number of motion steps, which share the maximum of a frame.
    """
    most = _MOST_TIMES * count
    return most if device.is_cpu else max(most, min(_MOST_TIMES_ON_GPU * count, _MOST_ON_GPU // step_count))


def most_paths_at_rest(device, count):
    """Return the maximum number of paths on a Warp device for a viewport at rest, which begins with `count` paths.

    A GPU adds paths between redraws even if the hair is small in the picture.
    """
    return _MOST_TIMES * count if device.is_cpu else max(_MOST_TIMES * count, _MOST_ON_GPU)


def with_grid(drawn, world_to_view, view_to_clip, count, seed=0, progress=no_progress, step_count=1):
    """Return a `DrawnScene` whose hair is lit by `count` paths through a grid, for a view with these (4, 4)
    matrices. step_count: number of motion steps; their mean has less noise than a step.

    Returns the scene unchanged, for dual scattering of all hair, if `count` is 0, no hair with an area is in view, no
    path starts in sight, hair is too large for its width, any light is linked, or any hair is not shaded by the
    energy-conserving model.
    """
    if not count or not drawn.hair:
        return drawn
    window = None if obstacle(drawn) else window_of(drawn.hair, world_to_view, view_to_clip)
    if window is None:
        return drawn
    systems, fibres = strands_of(drawn)
    if not light_paths.strand_grid.has_area(systems):
        return drawn
    device = preferences.device()
    progress(light_paths.gather.FOLLOWING, 0.0)
    grid = light_paths.strand_grid.build(systems, fibres, device=device)
    if not grid.is_resolved:
        return drawn
    progress(light_paths.gather.FOLLOWING, 0.15)
    shown = seen_strands.draw(drawn, (world_to_view, view_to_clip), window, SAMPLES_A_PATH * count, seed)
    seen = shown.seen(grid)
    if not len(seen.segments):
        return drawn
    progress(light_paths.gather.FOLLOWING, 0.3)
    most = most_paths(grid.device, count, step_count)
    # On a processor, paths take more time than all other work.
    noise = np.inf if grid.device.is_cpu else NOISE * np.sqrt(step_count)
    starting = -(-len(seen.segments) // SAMPLES_A_PATH)
    tracing = part_of(progress, 0.3, 1.0)
    sums = light_paths.gather.gather(grid, surroundings_of(drawn), seen, starting, seed, most, tracing, noise)
    if not sums.taken:
        return drawn
    return lit_by(drawn, grid, light_paths.gather.of_each(light_grid.upload, sums.texels()))


def obstacle(drawn):
    """Why hair of a `DrawnScene` cannot be lit by paths, as a sentence; empty if it can."""
    if any(layer.fibre is None for _strands, shading, *_ in drawn.hair for layer, _mix in shading.layers):
        return _OTHER_MODEL
    return "" if drawn.lamps.are_linked_to_all else _LINKED


def strands_of(drawn):
    """Return ([`strand_grid.Strands`] of the hair of a `DrawnScene`, settings of all looks)."""
    fibres = [layer.fibre[0] for _strands, shading, *_ in drawn.hair for layer, _mix in shading.layers]
    firsts = np.cumsum([0, *(len(shading.layers) for _strands, shading, *_ in drawn.hair)])
    return [_strands_of(*hair[:3], first) for hair, first in zip(drawn.hair, firsts[:-1], strict=True)], fibres


def lit_by(drawn, grid, textures, part=1.0, shift=0.0):
    """Return a `DrawnScene` whose hair is lit by textures of `light_grid.upload`, one for each hair, over a
    `StrandGrid`.

    part: how much of this light replaces dual scattering, from 0 to 1; shift: (3,) motion of the hair since the grid
    was built [m].
    """
    visibility = [
        {**seen, "light_grid": texture} for seen, texture in zip(drawn.hair_visibility, textures, strict=True)
    ]
    lights = drawn.lights.copy()
    lights["grid_corner"][:3] = grid.corner + shift
    lights["grid_corner"][3] = part
    sides = light_paths.light_texels.sides_of(grid.shape)
    lights["grid_scale"] = *(1.0 / (grid.voxel * sides)), sides[2]
    return replace(drawn, lights=lights, hair_lights=None, hair_visibility=visibility)


def window_of(hair, world_to_view, view_to_clip):
    """Return (low, high) corners (2,) in clip space of the part of a picture that contains all hair; None if
    outside.
    """
    world_to_clip = np.asarray(view_to_clip, float) @ np.asarray(world_to_view, float)
    centre, radius = drawing.bounding_sphere([(strands, to_world) for strands, _shading, to_world, *_ in hair])
    box = centre + radius * (2.0 * np.indices((2, 2, 2)).reshape(3, -1).T - 1.0)
    clip = np.concatenate([box, np.ones((8, 1))], axis=1) @ world_to_clip.T
    low, high = np.full(2, -1.0), np.full(2, 1.0)
    if (clip[:, 3] > 1e-6).all():
        at = clip[:, :2] / clip[:, 3:]
        low, high = np.clip(at.min(axis=0), -1.0, 1.0), np.clip(at.max(axis=0), -1.0, 1.0)
    return None if (high <= low).any() else (low, high)


def _strands_of(strands, shading, to_world, first):
    """`strand_grid.Strands` of hair on the GPU; first: index of its first look."""
    count, point_count = strands.points.shape[:2]
    randoms = np.full(count, 0.5) if strands.randoms_here is None else strands.randoms_here
    layers = shading.layers
    is_wettest = np.zeros(count, int)
    if len(layers) > 1:  # a strand between two looks gets one of them at random, by its share
        shares = appearance.wet_share(strands.wetness_here, *shading.wetness_range)
        is_wettest = (np.random.default_rng(0).random(count) < shares).astype(int)
    fibres = [layer.fibre for layer, _mix in layers]
    looks = strands.looks_here
    factors = 1.0 if looks is None else looks.roughness.astype(float)
    roughness = [
        varied_roughness(
            settings.roughness * factors, 0.0 if variation is None else variation.random_roughness, randoms
        )
        for settings, variation in fibres
    ]

    settings, variation = fibres[0]  # water does not change pigments
    ends, gradient = np.array([0.0, 1.0]), np.zeros(point_count)
    if variation is not None:
        places = np.linspace(0.0, 1.0, point_count)
        gradient = strand_variation.tip_gradient(variation.gradient_start, variation.gradient_end, places)

    def absorption(chosen):
        if looks is not None:
            return looks[chosen].sigma_a(ends[None])
        if variation is None:
            return np.broadcast_to(np.asarray(settings.sigma_a, float), (1, 2, 3))
        return strand_variation.sigma_a_along(variation, randoms[chosen, None], ends)

    return light_paths.strand_grid.Strands(
        strands.points,
        strands.radii * drawing.scale_of(to_world),
        absorption,
        gradient,
        np.stack(roughness)[is_wettest, np.arange(count)],
        first + is_wettest,
        to_world,
        (id(strands), id(shading)),
        None if looks is None else looks.radial,
    )


def surroundings_of(drawn):
    """`media.Surroundings` of a `DrawnScene`."""
    found = drawn.lamps.lamps
    centre, radius = drawing.bounding_sphere([(strands, to_world) for strands, _shading, to_world, *_ in drawn.hair])
    places = centre + 0.5 * radius * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
    importance = lamps.irradiance(found, places).mean(axis=(1, 2)) if len(found) else np.zeros(0)
    corners, normals, materials = ([blocker.mesh[index] for blocker in drawn.blockers] for index in range(3))
    is_seen = [np.full(len(rows), blocker.is_seen) for rows, blocker in zip(materials, drawn.blockers, strict=True)]
    colors, gloss = np.split(np.concatenate([np.zeros((0, 6)), *materials]), 2, axis=1)
    return light_paths.media.Surroundings(
        np.concatenate([np.zeros((0, 3), np.float32), *corners]),
        np.concatenate([np.zeros((0, 3), np.float32), *normals]),
        colors,
        found,
        importance,
        world_texture.picture_of(drawn.world),
        gloss,
        np.concatenate([np.zeros(0, bool), *is_seen]),
        light_patterns.of_paths(drawn.lamps.patterns),
    )
