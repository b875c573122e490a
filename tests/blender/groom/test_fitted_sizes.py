# SPDX-License-Identifier: GPL-3.0-or-later
"""Sizes are fitted to the surface and its mask until they are set by hand, whichever is chosen first."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.host import running
from hair_addon.blender.live import live_hair
from tests.support.counting import counts_of
from tests.support.reading import points, write_points

OF_GUIDES, OF_HAIR = ("length", "gravity", "drape"), ("radius", "influence_distance")
COUNTS = {"guide_count": 30, "strand_count": 300, "relax_iterations": 0}
MASKED = COUNTS | {"density_group": "top"}


def guides_of(hair):
    return hair.vellus.guide_curves


def sizes_of(hair):
    of_guides = {name: getattr(guides_of(hair).vellus.guides, name) for name in OF_GUIDES}
    return of_guides | {name: getattr(hair.vellus.hair, name) for name in OF_HAIR}


def add(**given):
    bpy.ops.vellus.add_hair("EXEC_DEFAULT", True, **given)
    return bpy.context.object.data


def choose_mask(hair, group="top"):
    guides_of(hair).vellus.guides.density_group = group
    bpy.context.view_layer.update()


@pytest.fixture
def mask_first(sphere):
    """Return the fitted sizes of hair with a mask and of hair without a mask."""
    masked = sizes_of(add(**MASKED))
    bpy.ops.vellus.delete_hair()
    bpy.context.view_layer.objects.active = sphere
    return masked


def test_a_mask_that_is_chosen_after_gives_the_same_sizes(mask_first):
    hair = add(**COUNTS)
    whole = sizes_of(hair)
    assert not any(whole[name] == value for name, value in mask_first.items()), "all of them depend on the mask"
    choose_mask(hair)
    assert sizes_of(hair) == mask_first
    length = np.linalg.norm(np.diff(points(bpy.data.objects["Hair Guides"]), axis=1), axis=-1).sum(axis=1)
    assert np.median(length) == pytest.approx(mask_first["length"], rel=0.1)
    width = np.empty(len(hair.points), np.float32)
    hair.attributes["radius"].data.foreach_get("value", width)
    assert width.max() == pytest.approx(mask_first["radius"])
    choose_mask(hair, "")
    assert sizes_of(hair) == whole


def test_a_mask_that_is_chosen_in_the_redo_panel_does_too(mask_first):
    add(**COUNTS)
    shown = bpy.context.window_manager.operator_properties_last("vellus.add_hair")
    given = {name: getattr(shown, name) for name in ("shown_sizes", "thickness", *OF_GUIDES, *OF_HAIR)}
    bpy.ops.ed.undo()
    assert sizes_of(add(**MASKED, **given)) == mask_first
    bpy.ops.ed.undo()
    assert sizes_of(add(**MASKED, **given | {"length": 0.3})) == mask_first | {"length": np.float32(0.3)}


def test_what_is_set_by_hand_stays(mask_first):
    hair = add(**COUNTS)
    guides = guides_of(hair)
    guides.vellus.guides.length, hair.vellus.hair.thickness = 0.3, 5.0
    choose_mask(hair)
    assert sizes_of(hair) == mask_first | {"length": np.float32(0.3), "radius": pytest.approx(0.0025)}
    guides.vellus.guides.fits_length = True  # as a click on its icon
    bpy.context.view_layer.update()
    assert sizes_of(hair)["length"] == mask_first["length"]


def test_what_an_operator_or_a_script_gives_stays(mask_first, sphere):
    hair = add(**COUNTS, length=0.3, drape=False)
    choose_mask(hair)
    assert sizes_of(hair) == mask_first | {"length": np.float32(0.3), "drape": False}
    scripted = api.interpolate_hair(
        api.distribute_guides(sphere, guide_count=30, relax_iterations=0, gravity=0.1), strand_count=300
    )
    choose_mask(scripted)
    assert sizes_of(scripted) == mask_first | {"gravity": np.float32(0.1), "drape": False}
    api.apply_settings(scripted, api.GroomSettings(api.GuideSettings(guide_count=30, density_group="top")))
    bpy.context.view_layer.update()
    choose_mask(scripted, "")
    assert sizes_of(scripted)["gravity"] != np.float32(0.1)  # None: it follows again


@pytest.mark.parametrize("is_undone", [False, True])
def test_a_style_preset_leaves_sizes_fitted(mask_first, is_undone):
    """A preset of styles sets no sizes: these are still fitted to the next mask, also after undo and redo."""
    add(**COUNTS)
    assert bpy.ops.vellus.apply_style_preset("EXEC_DEFAULT", True, preset="CURLY") == {"FINISHED"}
    if is_undone:
        bpy.ops.ed.undo()
        bpy.ops.ed.redo()
    hair = bpy.data.objects["Hair"].data
    choose_mask(hair)
    assert sizes_of(hair) == mask_first


def test_regenerated_guides_follow_on(mask_first):
    hair = add(**COUNTS)
    guides = bpy.data.objects["Hair Guides"]
    write_points(guides, points(guides) * np.float32(1.2))
    bpy.context.view_layer.update()
    combed = sizes_of(hair)
    choose_mask(hair)
    assert {name: sizes_of(hair)[name] for name in OF_GUIDES} == {name: combed[name] for name in OF_GUIDES}  # combed
    bpy.context.view_layer.objects.active = guides
    asked = SimpleNamespace(shown_sizes="")  # as a click on Regenerate Guides, which only a window can invoke
    bpy.types.VELLUS_OT_distribute_guides.prefill(asked, bpy.context)
    bpy.ops.vellus.distribute_guides(**vars(asked))
    bpy.context.view_layer.update()
    assert sizes_of(hair) == mask_first
    guides.data.vellus.guides.gravity = 0.5
    bpy.types.VELLUS_OT_distribute_guides.prefill(asked, bpy.context)
    bpy.ops.vellus.distribute_guides(**vars(asked))
    choose_mask(hair, "")
    assert sizes_of(hair)["gravity"] == 0.5 and sizes_of(hair)["length"] < mask_first["length"]


def test_a_driven_size_is_its_drivers(mask_first):
    hair = add(**COUNTS)
    driver = guides_of(hair).driver_add("vellus.guides.length").driver
    driver.expression = "0.3"
    bpy.context.scene.frame_set(2)
    choose_mask(hair)
    bpy.context.scene.frame_set(3)
    assert sizes_of(hair) == mask_first | {"length": pytest.approx(0.3)}


def test_other_frames_and_levels_change_no_size(sphere):
    """Sizes do not change when a surface moves or is subdivided differently."""
    hair = add(**COUNTS)
    before = sizes_of(hair)
    sphere.modifiers.new("Cast", "CAST").factor = -0.5
    bpy.context.view_layer.update()
    hair.vellus.hair.tip_taper = 0.5
    hair.vellus.hair.angle_limit = 0.5
    bpy.context.view_layer.update()
    assert sizes_of(hair) == before


def test_a_window_shows_sizes_before_strands_are_written(mask_first, monkeypatch):
    hair = add(**COUNTS)
    monkeypatch.setattr(running, "has_window", lambda: True)
    counts = counts_of(monkeypatch)
    choose_mask(hair)
    assert sizes_of(hair) == mask_first
    searches = counts["searches"]
    bpy.context.view_layer.update()
    hair.update_tag()
    bpy.context.view_layer.update()
    assert counts["searches"] == searches  # nothing is bound again before it is written
    live_hair.write_all()
    assert sizes_of(hair) == mask_first
    live_hair.cancel_writing()


def test_a_group_that_is_named_like_hair_is_picked(sphere):
    """A group named after hair is picked before hair is made and in the panel, unless it is a bone's, empty or used
    by hair. An artist's choice is for one hair system.
    """
    sphere.vertex_groups["top"].name = "Kopfhaar"
    for name, vertices in (("scalp", []), ("hair", range(40)), ("beard", range(40))):
        sphere.vertex_groups.new(name=name).add(list(vertices), 1.0, "REPLACE")
    rig = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.scene.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    rig.data.edit_bones.new("hair").tail = (0.0, 0.0, 1.0)
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.objects.active = sphere
    sphere.modifiers.new("Armature", "ARMATURE").object = rig
    new = sphere.vellus_new_hair
    assert new.mask == "scalp"
    assert _asked().density_group == ""  # it is empty: hair on the whole mesh is better than none
    sphere.vertex_groups.remove(sphere.vertex_groups["scalp"])
    assert new.mask == _asked().density_group == "Kopfhaar"
    hair = add(**COUNTS, density_group="Kopfhaar")
    bpy.context.view_layer.objects.active = sphere
    assert new.mask == _asked().density_group == "beard"
    new.mask = ""
    assert new.mask == _asked().density_group == ""  # an artist's choice
    new.mask = "hair"
    assert new.mask == _asked().density_group == "hair"
    assert guides_of(hair).vellus.guides.density_group == "Kopfhaar"
    add(**COUNTS, density_group="hair")
    bpy.context.view_layer.objects.active = sphere
    assert new.mask == _asked().density_group == "beard"  # the next system does not grow in the same group


def _asked():
    """Return the settings that *New Hair System* proposes when it is clicked."""
    asked = SimpleNamespace(density_group="", properties=SimpleNamespace(is_property_set=lambda name: False))
    bpy.types.VELLUS_OT_add_hair.prefill(asked, bpy.context)
    return asked
