# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves not created by Vellus, for tests: creating, reading and using them as guides."""

import bpy
import numpy as np

from hair_addon.blender.data.strands import curves
from tests.support.dynamics.following import update


def select(*chosen):
    """Select objects; the last is active."""
    for other in bpy.context.view_layer.objects:
        other.select_set(other in chosen)
    bpy.context.view_layer.objects.active = chosen[-1]


def use(*chosen, **options):
    """Select objects and use them as guides, as with a click."""
    select(*chosen)
    return bpy.ops.vellus.use_as_guides(**{"strand_count": 200, **options})


def world(curves_object):
    """Return (N, 3) float64: all points in the world as Blender shows them, after modifiers."""
    evaluated = curves_object.evaluated_get(bpy.context.evaluated_depsgraph_get())
    geometry = evaluated.evaluated_geometry()
    points = np.empty((len(geometry.curves.points), 3), np.float32)
    geometry.curves.attributes["position"].data.foreach_get("vector", points.ravel())
    matrix = np.array(evaluated.matrix_world)
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def stored(curves_object):
    """Return the (N, 3) stored points, with any point counts."""
    return curves.read_points(curves_object.data)


def lines_on(sphere, rng, count=60, least=2, most=12, lift=0.0):
    """Return polylines that start on the unit sphere of an object, in the world, each with its own number of points."""
    matrix = np.array(sphere.matrix_world)
    for _ in range(count):
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        along = np.linspace(0.0, 1.0, rng.integers(least, most + 1))[:, None]
        line = direction * (1.0 + lift + 0.4 * along) + [0.0, 0.0, -0.1] * along**2
        yield line @ matrix[:3, :3].T + matrix[:3, 3]


def curves_object(lines, name="Imported", kind="POLY"):
    """Return an object of curves through polylines (P, 3)."""
    datablock = bpy.data.hair_curves.new(name)
    datablock.add_curves([len(line) for line in lines])
    datablock.set_types(type=kind)
    points = np.concatenate(lines).astype(np.float32)
    datablock.attributes["position"].data.foreach_set("vector", points.ravel())
    made = bpy.data.objects.new(name, datablock)
    bpy.context.scene.collection.objects.link(made)
    update()
    return made
