# SPDX-License-Identifier: GPL-3.0-or-later
"""Calls of guide tools, and the resulting hair and guides."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.groom import pipeline
from tests.support.dynamics.following import update
from tests.support.reading import points, write_points

# Tools that move points without adding any, each with values that change every guide.
SHAPING = {
    "guide_length": {"factor": 0.5},
    "trim_guides": {"cutter": "Cutter"},
    "smooth_guides": {"strength": 0.9, "iterations": 30},
    "lift_guides": {"amount": 0.8},
    "attract_guides": {"amount": 0.8, "clearance": 0.02},
    "drape_guides": {"stiffness": 0.1, "seconds": 0.5},
    "copy_guide_shape": {"source": "top"},
    "push_outside": {"clearance": 0.2},
}
TOOLS = SHAPING | {"change_guide_count": {"factor": 1.5}, "mirror_guides": {}}
CHOSEN = sorted(TOOLS.keys() - {"copy_guide_shape"})  # tools whose guides are chosen by selection and mask


def wave(guides):
    combed = points(guides)
    along = np.linspace(0.0, 1.0, combed.shape[1])[:, None]
    waves = 0.05 * np.sin(9.0 * along + np.arange(len(combed))[:, None, None]) * np.roll(combed[:, :1], 1, axis=2)
    write_points(guides, combed + along * waves)


def use_tool(name, **values):
    """Call a tool as a click does, with an undo step; returns guides and hair afterwards."""
    assert getattr(bpy.ops.vellus, name)("EXEC_DEFAULT", True, **TOOLS[name] | values) == {"FINISHED"}
    update()
    return points(bpy.data.objects["Guides"]), points(bpy.data.objects["Hair"])


def said_by(name, **values):
    """Return the message of a tool that refuses to run."""
    with pytest.raises(RuntimeError) as error:
        getattr(bpy.ops.vellus, name)(**TOOLS[name] | values)
    assert "Traceback" not in str(error.value)
    return str(error.value)


def select_guides(guides, chosen, domain="CURVE", kind="BOOLEAN"):
    """Store a selection as Sculpt Mode does."""
    attributes = guides.data.attributes
    if ".selection" in attributes:
        attributes.remove(attributes[".selection"])
    values = np.repeat(chosen, 41) if domain == "POINT" else chosen
    made = attributes.new(".selection", kind, domain)
    made.data.foreach_set("value", np.asarray(values, np.float32 if kind == "FLOAT" else bool))


def grown_from_nothing(hair):
    """Return (S, P, 3) interpolated from the present guides, without caches."""
    return pipeline.bind_hair(*pipeline.inputs_of(hair.data), bpy.context.evaluated_depsgraph_get()).points


def lengths_of(strands):
    return np.linalg.norm(np.diff(strands.astype(np.float64), axis=1), axis=2).sum(axis=1)
