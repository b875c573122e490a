# SPDX-License-Identifier: GPL-3.0-or-later
"""Photographic measures of the demo's portrait, computed from its picture.

`python blend_samples/heads/portrait_figures.py out/demo/dual_scattering.png`; luminance is that of the display, linear.
"""

import argparse
import sys
from pathlib import Path

import bpy
import numpy as np
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector
from mathutils.bvhtree import BVHTree

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.heads import portrait
from hair_addon import api

_SOLID_COUNT = 3  # strands in a pixel of the closed mass of hair
_FLYING_DISTANCE = 3  # pixels beyond that mass: about two millimeters
_DEPTH_TOLERANCE = 0.004  # [m] of the strands that are seen
_SKIN_DEPTH = 0.004  # [m] of hair through which skin is not seen
_SQUARE = 4  # pixels for which one ray finds the surface
# Places of skin [m]: lit, and in the shadow of hair or chin.
_CHEEK, _NECK = (-0.030, -0.14, 0.69), (0.010, -0.075, 0.625)
_FOREHEAD, _HAIRLINE = (-0.010, -0.16, 0.785), (0.060, -0.12, 0.775)


def main():
    """Grow the portrait again, and print the figures of its picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("picture", type=Path)
    luminance = _luminance(parser.parse_args().picture)
    hair_addon.register()
    head_object, _guides, hair = portrait.build()
    portrait.light()
    strands = api.points(hair.data)
    column, row, depth = _projected(strands, luminance.shape)
    surface = _surface_depths([head_object, bpy.data.objects["Bust"]], luminance.shape)
    nearest = np.full(luminance.shape, np.inf)
    np.minimum.at(nearest, (row.ravel(), column.ravel()), depth.ravel())
    counts = np.zeros(luminance.shape, int)
    np.add.at(counts, (row.ravel(), column.ravel()), 1)
    dense = _closed(counts >= _SOLID_COUNT)
    hair_seen = _closed((counts >= _SOLID_COUNT) & (nearest < surface))
    seen = (depth < nearest[row, column] + _DEPTH_TOLERANCE) & hair_seen[row, column]
    value, part = luminance[row, column], np.broadcast_to(np.linspace(0.0, 1.0, strands.shape[1]), depth.shape)
    covered = seen & (surface > nearest + _SKIN_DEPTH)[row, column]
    roots, middles = (value[covered & (part >= low) & (part < high)].mean() for low, high in ((0.01, 0.1), (0.25, 0.6)))
    solid = dense | np.isfinite(surface)
    border = dense & _grown(~solid, 1)
    flying = (~_grown(solid, _FLYING_DISTANCE)[row, column]).any(axis=1)
    pixel = np.linalg.norm(np.array(portrait.CAMERA) - portrait.LOOK_AT) * 36.0 / portrait.LENS / luminance.shape[1]
    smooth = _blurred(luminance)[hair_seen & ~_grown(~hair_seen, 6)]
    rim = hair_seen & _grown(~solid, 4) & ~_grown(~solid, 1)
    inside = hair_seen & ~_grown(~solid, 20)
    figures = {
        "bands: 90th over 25th percentile of luminance": np.percentile(smooth, 90) / np.percentile(smooth, 25),
        "roots over middles of strands": roots / middles,
        "rim over the hair inside": luminance[rim].mean() / luminance[inside].mean(),
        "forehead at the hairline over its middle": _skin(luminance, _HAIRLINE) / _skin(luminance, _FOREHEAD),
        "neck over cheek": _skin(luminance, _NECK) / _skin(luminance, _CHEEK),
        "single strands at the silhouette, per cm": flying.sum() / (border.sum() * 100.0 * pixel),
    }
    for name, figure in figures.items():
        print(f"{name:46} {figure:.2f}")


def _luminance(path):
    """Return (height, width) linear luminance of the display, first row at the bottom."""
    image = bpy.data.images.load(str(path.resolve()))
    pixels = np.empty((image.size[1], image.size[0], image.channels), np.float32)
    image.pixels.foreach_get(pixels.ravel())
    linear = np.where(pixels <= 0.04045, pixels / 12.92, ((pixels + 0.055) / 1.055) ** 2.4)
    return linear[..., :3] @ np.array([0.2126, 0.7152, 0.0722])


def _projected(points, shape):
    """Columns and rows of pixels and depths [m] of (..., 3) points."""
    camera = bpy.context.scene.camera
    matrix = np.array(camera.matrix_world.inverted())
    local = points @ matrix[:3, :3].T + matrix[:3, 3]
    scale = camera.data.lens / camera.data.sensor_width * max(shape)
    place = [0.5 * shape[1 - axis] - scale * local[..., axis] / local[..., 2] for axis in range(2)]
    column, row = (np.clip(place[axis].astype(int), 0, shape[1 - axis] - 1) for axis in range(2))
    return column, row, -local[..., 2]


def _surface_depths(solids, shape):
    """Return (height, width) depths of surfaces [m], infinite where there is none; of squares of pixels."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    trees = [BVHTree.FromObject(solid, depsgraph) for solid in solids]
    camera = bpy.context.scene.camera
    origin, turn = camera.matrix_world.translation, camera.matrix_world.to_3x3()
    tangent = 0.5 * camera.data.sensor_width / camera.data.lens
    places = [2.0 * (np.arange(0, size, _SQUARE) + 0.5 * _SQUARE) / size - 1.0 for size in shape]
    depths = np.full([len(line) for line in places], np.inf)
    for i, up in enumerate(places[0]):
        for j, right in enumerate(places[1]):
            ray = Vector((tangent * right, tangent * up, -1.0))
            hits = [tree.ray_cast(origin, turn @ ray.normalized())[3] for tree in trees]
            found = [hit for hit in hits if hit is not None]
            if found:
                depths[i, j] = min(found) / ray.length
    return depths.repeat(_SQUARE, axis=0).repeat(_SQUARE, axis=1)[: shape[0], : shape[1]]


def _closed(mask):
    """Return a mask without gaps of four pixels."""
    return ~_grown(~_grown(mask, 2), 2)


def _blurred(values):
    """Means over some pixels, in which single strands are not seen."""
    for _pass in range(12):
        for axis in range(2):
            values = 0.25 * np.roll(values, 1, axis) + 0.5 * values + 0.25 * np.roll(values, -1, axis)
    return values


def _grown(mask, pixels):
    """Return a mask grown by a number of pixels."""
    for _step in range(pixels):
        mask = mask | np.roll(mask, 1, 0) | np.roll(mask, -1, 0) | np.roll(mask, 1, 1) | np.roll(mask, -1, 1)
    return mask


def _skin(luminance, place):
    """Mean luminance about a place [m]."""
    seen = world_to_camera_view(bpy.context.scene, bpy.context.scene.camera, Vector(place))
    row, column = int(seen.y * luminance.shape[0]), int(seen.x * luminance.shape[1])
    return luminance[row - 4 : row + 5, column - 4 : column + 5].mean()


if __name__ == "__main__":
    main()
