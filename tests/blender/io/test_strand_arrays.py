# SPDX-License-Identifier: GPL-3.0-or-later
"""Exported strands lie on the curves that Blender draws, and have their widths."""

import bpy
import numpy as np

from hair_addon.blender.data.strands import exported_curves
from hair_addon.blender.io import strand_arrays
from tests.support.exchange.imported import curves_object, select

CONTROLS = 6


def test_splines_are_exported_as_points_on_the_curve(sphere):
    """Exported points of half circles with few control points are on the circle, unlike lines between the controls."""
    angles = np.linspace(0.0, np.pi, CONTROLS)
    arc = np.stack([0.2 * np.sin(angles), np.zeros(CONTROLS), 1.2 - 0.2 * np.cos(angles)], axis=1)
    hair = curves_object([arc, arc[:4]], kind="CATMULL_ROM")
    radii = np.concatenate([np.linspace(0.004, 0.002, CONTROLS), np.full(4, 0.003)]).astype(np.float32)
    hair.data.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", radii)
    select(sphere, hair)
    bpy.ops.vellus.use_as_hair(guide_count=1)
    points = strand_arrays.world_points(hair.data)
    assert points.shape[0] == 2 and points.shape[1] > 4 * CONTROLS
    apart = np.abs(np.linalg.norm(points[0] - [0.0, 0.0, 1.2], axis=1) - 0.2)
    chord = 0.2 * (1.0 - np.cos(0.5 * np.pi / (CONTROLS - 1)))
    assert apart.max() < 0.6 * chord  # the ends bend less
    for strand, controls in zip(points, (arc, arc[:4]), strict=True):
        np.testing.assert_allclose(strand[[0, -1]], controls[[0, -1]], atol=1e-5)
    found = exported_curves.read_radii(hair.data, points.shape[1])(slice(None))
    np.testing.assert_allclose(found[:, [0, -1]], [[0.004, 0.002], [0.003, 0.003]], atol=1e-6)
    assert (np.diff(found[0]) < 0.0).all()
