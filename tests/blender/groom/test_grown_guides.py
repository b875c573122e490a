# SPDX-License-Identifier: GPL-3.0-or-later
"""On a dome such as a scalp, the panel's operators drape new guides, unless growth settings are given."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.core.dynamics import draping
from hair_addon.core.errors import HairError
from tests.support.reading import points

FEW = {"guide_count": 30, "strand_count": 100}


@pytest.fixture
def dome(sphere):
    """Return the upper half of a sphere as a mask, like a scalp."""
    sphere.scale = (0.1,) * 3
    bpy.context.view_layer.update()
    return {"density_group": "top"}


def new_guides(**settings):
    assert bpy.ops.vellus.add_hair("EXEC_DEFAULT", True, **FEW, **settings) == {"FINISHED"}
    return bpy.context.object.data.vellus.guide_curves


def test_new_hair_on_a_dome_is_draped(dome):
    guides = new_guides(**dome)
    assert guides.vellus.guides.drape and not guides.vellus.status
    draped_height = points(bpy.data.objects["Hair Guides"])[..., 2].mean()
    bpy.context.view_layer.objects.active = bpy.data.objects["Sphere"]
    stiff = new_guides(**dome, drape=False)
    standing = next(o for o in bpy.data.objects if o.data == stiff)
    assert not stiff.vellus.guides.drape
    assert points(standing)[..., 2].mean() > draped_height + 0.02


def test_fur_stands(sphere):
    """New hair on closed surfaces and planes is short fur that is not draped."""
    assert not new_guides().vellus.guides.drape
    bpy.ops.mesh.primitive_plane_add()
    assert not new_guides().vellus.guides.drape


@pytest.mark.parametrize("given", [{"gravity": 0.75}, {"drape": False}, {"guide_count": 5000}])
def test_who_says_how_guides_grow_is_obeyed(dome, given):
    """A given *Gravity* or *Drape*, or more guides than can be draped in a second, prevent draping."""
    given = FEW | dome | given
    bpy.ops.vellus.distribute_guides(**{name: value for name, value in given.items() if name != "strand_count"})
    assert not bpy.data.objects["Guides"].data.vellus.guides.drape


def test_guides_of_scripts_and_files_are_draped_where_asked(dome):
    guides = api.distribute_guides(bpy.context.object, guide_count=30, **dome)
    assert not guides.vellus.guides.drape
    before = points(bpy.data.objects["Guides"])
    guides.vellus.guides.drape = True
    bpy.context.view_layer.update()
    assert points(bpy.data.objects["Guides"])[..., 2].mean() < before[..., 2].mean() - 0.02
    guides.vellus.guides.drape = False
    bpy.context.view_layer.update()
    assert np.array_equal(points(bpy.data.objects["Guides"]), before)


def test_the_redo_panel_shows_it_and_the_next_surface_decides_anew(dome):
    new_guides(**dome)
    assert bpy.context.window_manager.operator_properties_last("vellus.add_hair").drape
    bpy.ops.mesh.primitive_cube_add()
    assert not new_guides(density_group="").vellus.guides.drape


def test_guides_that_cannot_be_draped_stay_as_they_grow(dome, monkeypatch):
    def refuse(*_arguments):
        raise HairError("Guides cannot be draped on this surface: {cause}.", cause="it has no faces")

    monkeypatch.setattr(draping, "draped", refuse)
    guides = new_guides(**dome)
    assert len(guides.curves) == FEW["guide_count"]
    assert guides.vellus.status == "Guides cannot be draped on this surface: it has no faces."
