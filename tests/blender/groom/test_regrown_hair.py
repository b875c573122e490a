# SPDX-License-Identifier: GPL-3.0-or-later
"""Regenerated hair reuses the memory of the strands that it replaces, and nothing else."""

from dataclasses import replace

import bpy
import numpy as np
import pytest

from hair_addon.blender.groom import bindings, pipeline, writing
from hair_addon.core.errors import HairError
from tests.support.reading import points


def regrown(hair, **changes):
    """Regenerate strands with other settings, and return their `BoundHair`."""
    guides, settings = pipeline.inputs_of(hair.data)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    pipeline.interpolate_hair(guides, replace(settings, **changes), depsgraph, hair.data)
    bpy.context.view_layer.update()
    return bindings.of(hair.data)


def grown_from_nothing(hair):
    bindings.invalidate(hair.data)
    return pipeline.bind_hair(*pipeline.inputs_of(hair.data), bpy.context.evaluated_depsgraph_get()).points


def test_as_many_strands_come_to_lie_where_those_before_lay(hair):
    before = regrown(hair, seed=2).points
    address, shape_before = before.__array_interface__["data"], before.copy()
    after = regrown(hair, seed=3)
    assert after.points.__array_interface__["data"] == address
    assert np.abs(after.points - shape_before).max() > 0.01
    np.testing.assert_array_equal(points(hair), after.points)
    np.testing.assert_array_equal(after.points, grown_from_nothing(hair))


@pytest.mark.parametrize("changes", [{"strand_count": 300}, {"point_count": 20}, {"strand_count": 700, "seed": 4}])
def test_others_have_memory_of_their_own(hair, changes):
    before = regrown(hair, seed=2).points
    after = regrown(hair, **changes).points
    assert not np.shares_memory(before, after)
    np.testing.assert_array_equal(points(hair), after)
    np.testing.assert_array_equal(after, grown_from_nothing(hair))


def test_binding_hair_without_writing_it_leaves_its_points(hair):
    before = regrown(hair, seed=2).points
    kept = before.copy()
    guides, settings = pipeline.inputs_of(hair.data)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    other = pipeline.bind_hair(guides, replace(settings, seed=3), depsgraph, hair.data).points
    assert not np.shares_memory(before, other)
    np.testing.assert_array_equal(before, kept)


def test_hair_that_cannot_be_written_is_what_it_was(hair, monkeypatch):
    """Hair that cannot be written keeps the points in its datablock, and can be regenerated."""
    regrown(hair, seed=2)
    before = points(hair)

    def refuse(*_given):
        raise HairError("Refused.")

    with monkeypatch.context() as refusing:
        refusing.setattr(writing, "write_hair", refuse)
        with pytest.raises(HairError, match="Refused"):
            regrown(hair, seed=3)
    np.testing.assert_array_equal(points(hair), before)
    np.testing.assert_array_equal(points(hair), regrown(hair, seed=2).points)
    np.testing.assert_array_equal(points(hair), before)
