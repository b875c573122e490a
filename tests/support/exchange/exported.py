# SPDX-License-Identifier: GPL-3.0-or-later
"""Exported grooms, and the hair to compare them with."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.groom.dynamics import guide_baking
from hair_addon.blender.io import groom_export, groom_sources
from hair_addon.core.files.export_settings import ExportSettings
from hair_addon.core.long_work import run_now
from tests.support.dynamics.following import update
from tests.support.dynamics.swung import simulate, swing
from tests.support.exchange import alembic_reader
from tests.support.reading import attribute, evaluated_points

LAST = 4  # frame that `bake` bakes


def export(path, **settings):
    return run_now(
        groom_export.exporting(path, groom_sources.all_hair(), ExportSettings(**settings), bpy.context.scene)
    )


def world(curves_object):
    """Return the (S, P, 3) [m] points of strands as rendered by Blender."""
    matrix = np.array(curves_object.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world)
    return evaluated_points(curves_object) @ matrix[:3, :3].T + matrix[:3, 3]


def widths(curves_object):
    """Return the (N,) [m] diameters as rendered by Blender."""
    scale = abs(np.linalg.det(np.array(curves_object.matrix_world)[:3, :3])) ** (1.0 / 3.0)
    return 2.0 * scale * attribute(curves_object, "radius")


def shape(archive, name):
    """Return {name: Property} of the geometry of an object of the archive, with its parameters."""
    (path,) = (p for p in alembic_reader.objects(archive) if p.endswith(f"/{name}Shape"))
    found = alembic_reader.objects(archive)[path].properties[".geom"].children
    return found | found[".arbGeomParams"].children


def twist(hair):
    """Turn, move, scale and twist the sphere of hair; returns the objects of the hair and of its guides."""
    sphere = bpy.data.objects["Sphere"]
    sphere.location, sphere.rotation_euler, sphere.scale = (1.0, 2.0, 3.0), (0.3, 0.2, 0.5), (2.0, 2.0, 2.0)
    twist = sphere.modifiers.new("Twist", "SIMPLE_DEFORM")
    twist.deform_method, twist.angle = "TWIST", 1.0
    update()
    return hair, bpy.data.objects["Guides"]


def bake(folder):
    """Let the sphere swing and its guides simulate, and bake their frames; returns the object of the guides."""
    swing(bpy.data.objects["Sphere"])
    guides = bpy.data.objects["Guides"]
    simulate(guides, folder / "frames", collides_with_surface=False, automatic_substeps=False, substeps=2)
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, LAST
    run_now(guide_baking.baking([guides.data], LAST, bpy.context.scene))
    update()
    return guides


@pytest.fixture
def twisted(hair):
    """Return hair of a sphere that is turned, moved, scaled and twisted, and its guides."""
    return twist(hair)


@pytest.fixture
def baked(hair, tmp_path):
    """Return guides that simulate on a swinging sphere, with baked frames."""
    return bake(tmp_path)
