# SPDX-License-Identifier: GPL-3.0-or-later
"""Radial roughness by maps is in exported files, strand by strand."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.maps import strand_maps
from hair_addon.blender.settings import map_items
from hair_addon.core.maps.map_settings import MapSettings
from hair_addon.core.shading import presets
from tests.support.exchange import alembic_reader
from tests.support.exchange.exported import export, shape
from tests.support.reading import attribute

STRANDS = "/groom/Hair/strands"
NAME = "groom_radial_roughness"


@pytest.fixture
def varied(hair):
    """Return the hair with a radial roughness that differs between its strands."""
    map_items.keep(hair.data.vellus, MapSettings(setting="look.radial_roughness", kind="STRAND", low=0.5, high=1.5))
    hair.data.update_tag()
    bpy.context.view_layer.update()
    assert np.ptp(attribute(hair, strand_maps.RADIAL)) > 0.2
    return hair


def radial_of(stage, level, look):
    from pxr import UsdGeom

    group = stage.GetPrimAtPath("/groom/Hair")
    for set_name, variant in (("lod", level), ("look", look)):
        group.GetVariantSet(set_name).SetVariantSelection(variant)
    return UsdGeom.PrimvarsAPI(stage.GetPrimAtPath(STRANDS)).GetPrimvar(NAME)


def test_each_strand_keeps_its_radial_roughness(varied, tmp_path):
    """Alembic, USD in all levels, and .npz have the values of the attribute; a USD look has one value."""
    wanted = attribute(varied, strand_maps.RADIAL)
    export(tmp_path / "groom.abc")
    found = shape(alembic_reader.read(tmp_path / "groom.abc"), "Hair")[NAME]
    assert found.scope == "uniform"
    np.testing.assert_array_equal(found.only, wanted)
    export(tmp_path / "groom.usdc", level_count=2, looks="Black")
    bpy.utils.expose_bundled_modules()
    from pxr import Usd

    stage = Usd.Stage.Open(str(tmp_path / "groom.usdc"))
    for level, step in (("full", 1), ("half", 2)):
        found = radial_of(stage, level, "present")
        assert found.GetInterpolation() == "uniform"
        np.testing.assert_array_equal(found.Get(), wanted[::step])
    found = radial_of(stage, "full", "Black")
    assert found.GetInterpolation() == "constant"
    assert found.Get()[0] == pytest.approx(presets.PRESETS["BLACK"][1].radial_roughness)
    export(tmp_path / "groom.npz")
    np.testing.assert_array_equal(np.load(tmp_path / "groom.npz")["strand_radial_roughness"], wanted)


def test_only_varied_radial_roughness_is_written(varied, tmp_path):
    """Files without colors, and files of hair without such a map, lack the attribute."""
    export(tmp_path / "groom.abc", has_color=False)
    assert NAME not in shape(alembic_reader.read(tmp_path / "groom.abc"), "Hair")
    varied.data.vellus.maps.clear()
    varied.data.vellus.is_shading_stale = True
    varied.data.update_tag()
    bpy.context.view_layer.update()
    export(tmp_path / "groom.abc")
    assert NAME not in shape(alembic_reader.read(tmp_path / "groom.abc"), "Hair")
