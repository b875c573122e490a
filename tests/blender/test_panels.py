# SPDX-License-Identifier: GPL-3.0-or-later
"""Every panel draws for every kind of active object, with a row for each setting and no work."""

import math

import bpy
import pytest

from hair_addon.blender import menus, panels, running, scene
from hair_addon.core import estimate
from hair_addon.core.groom import GuideSettings, HairSettings
from hair_addon.core.long_work import Job
from hair_addon.core.params import declared
from hair_addon.core.shading import appearance, lookup_tables
from hair_addon.core.shading.appearance import Appearance
from tests.blender.layout import draw, draw_all

TAB = [panel for panel in panels.CLASSES if panel.bl_region_type == "UI"]


def named(name):
    return getattr(bpy.types, f"VELLUS_PT_{name}")


def make_active(name):
    bpy.context.view_layer.objects.active = bpy.data.objects.get(name)


@pytest.mark.parametrize("active", ["nothing", "Sphere", "Guides", "Hair"])
def test_panels_draw_whatever_is_active(hair, active):
    make_active(active)
    before = {c.name: (len(c.curves), c.vellus.is_stale) for c in bpy.data.hair_curves}
    draw_all(panels.CLASSES)
    if active != "nothing":  # Blender shows the menu for a mesh and for hair
        draw_all(menus.CLASSES)
    assert {c.name: (len(c.curves), c.vellus.is_stale) for c in bpy.data.hair_curves} == before


@pytest.mark.parametrize("settings_class", [GuideSettings, HairSettings])
@pytest.mark.parametrize("active", ["Sphere", "Hair"])
def test_every_setting_has_a_row(hair, settings_class, active):
    make_active(active)
    owner = "guides" if settings_class is GuideSettings else "interpolation"
    drawn = draw_all([panel for panel in TAB if panel.bl_idname.startswith(f"VELLUS_PT_{owner}")])
    names = [name for name, *_ in declared(settings_class)]
    assert {name: drawn[name] for name in names} == dict.fromkeys(names, 1)


@pytest.mark.parametrize("parametrization", appearance.COLOR_FIELDS)
@pytest.mark.parametrize("model", ["KAJIYA_KAY", "MARSCHNER"])
def test_shading_offers_what_changes_the_picture(hair, model, parametrization):
    """One kind of colour, and all else of the appearance once."""
    state = hair.data.vellus
    state.model, state.appearance.parametrization = model, parametrization
    drawn = draw_all([panel for panel in TAB if panel.bl_idname.startswith("VELLUS_PT_shading")])
    assert drawn["model"] == drawn["VELLUS_PT_looks"] == 1
    assert drawn["mode"] == (model == "MARSCHNER")
    for name, *_ in declared(Appearance):
        other_colors = [n for kind, names in appearance.COLOR_FIELDS.items() if kind != parametrization for n in names]
        assert name == "mode" or drawn[name] == (name not in other_colors), name


@pytest.mark.parametrize(("mode", "has_glints"), [("classic", True), ("energy", False)])
def test_tables_offer_what_the_appearance_does_not(hair, mode, has_glints):
    hair.data.vellus.appearance.mode = mode
    drawn = draw(named("tables")).drawn
    shown = {name for name, *_ in declared(lookup_tables.Settings) if drawn[name]}
    assert {"size", "axes", "shifts"} <= shown
    assert not shown & set(appearance.TABLE_FIELDS)
    assert ("glint_gain" in shown) == ("caustic" in shown) == has_glints


def test_tables_belong_to_marschner(hair):
    hair.data.vellus.model = "KAJIYA_KAY"
    assert draw(named("tables")) is None


def test_the_tab_follows_the_pipeline():
    tops = [panel.bl_label for panel in TAB if not hasattr(panel, "bl_parent_id")]
    assert tops == ["Surface", "Guides", "Interpolation", "Shading", "Tables", "Output"]
    assert {panel.bl_category for panel in TAB} == {"Hair"}


@pytest.mark.parametrize("strand_count", [1, 1000, 7777])
def test_the_cost_that_is_shown_is_what_curves_take(guides, strand_count):
    bpy.ops.vellus.interpolate_hair(strand_count=strand_count)
    curves = bpy.data.hair_curves["Hair"]
    widths = {"FLOAT": 4, "INT": 4, "INT8": 1, "FLOAT2": 8, "FLOAT_VECTOR": 12, "BOOLEAN": 1}
    taken = sum(len(a.data) * widths[a.data_type] for a in curves.attributes) + 4 * strand_count
    assert estimate.curves_bytes(strand_count, slot_count=curves.vellus.hair.neighbour_limit) == taken


WARNINGS = {
    "no UV map": (lambda sphere: sphere.data.uv_layers.remove(sphere.data.uv_layers[0]), "vellus.make_uv_map"),
    "a renamed UV map": (lambda sphere: setattr(sphere.data.uv_layers[0], "name", "Other"), "vellus.use_uv_map"),
    "a scale": (lambda sphere: setattr(sphere, "scale", (1.0, 2.0, 1.0)), "vellus.apply_scale"),
    "a lost surface": (lambda sphere: bpy.data.objects.remove(sphere), "vellus.attach_to_surface"),
    "no guides' object": (lambda _: bpy.data.objects.remove(bpy.data.objects["Guides"]), "vellus.restore_guides"),
}


@pytest.mark.parametrize("case", WARNINGS)
def test_what_is_amiss_is_said_beside_what_mends_it(hair, case):
    break_it, operator = WARNINGS[case]
    assert operator not in draw(named("surface")).drawn
    break_it(bpy.data.objects["Sphere"])
    assert draw(named("surface")).drawn[operator] == 1


@pytest.mark.parametrize("is_locked", [False, True])
def test_what_keys_need_of_a_render_is_offered_while_it_is_not_so(hair, is_locked):
    bpy.context.scene.render.use_lock_interface = is_locked
    assert not draw(named("output")).drawn["use_lock_interface"]
    hair.data.keyframe_insert("vellus.appearance.melanin", frame=1)
    assert draw(named("output")).drawn["use_lock_interface"] == (not is_locked)


@pytest.mark.parametrize(("setting", "words"), [("part_lines", "part line"), ("region_group", "vertex group")])
def test_what_parts_hair_and_is_missing_is_said(hair, setting, words):
    assert not any(words in " ".join(draw(named(name)).texts) for name in ("surface", "interpolation_parting"))
    setattr(hair.data.vellus.hair, setting, "Lost")
    for name in ("surface", "interpolation_parting"):
        assert words in " ".join(draw(named(name)).texts) and "Lost" in " ".join(draw(named(name)).texts)


def test_sentences_are_wrapped_to_the_sidebar(hair):
    hair.data.vellus.status = '"Hair" was combed and is kept: run its operator again to replace it.'
    lines = draw(named("interpolation")).texts
    assert hair.data.vellus.status in " ".join(lines)
    assert max(map(len, lines)) <= 32


def test_work_under_way_is_a_bar_and_nothing_else(hair, monkeypatch):
    def compute(progress):
        progress("Growing guides", 0.25)

    job = Job(compute)
    job.wait()
    monkeypatch.setattr(running, "_job", job)
    drawn = draw(named("surface"))
    assert drawn.drawn["progress"] == 1 and "Growing guides" in drawn.texts
    assert not [name for name in drawn.drawn if name.startswith("vellus.")]


def test_memory_grows_with_the_count():
    assert estimate.gpu_bytes(2000) == 2 * estimate.gpu_bytes(1000)
    assert math.isfinite(estimate.hair_seconds(HairSettings(), 1)) and estimate.guide_seconds(GuideSettings(), 1) > 0.0


def test_long_work_is_announced_and_short_work_is_not(hair):
    """By what the surface has once its modifiers are evaluated, and by what was asked for."""
    sphere, guides = bpy.data.objects["Sphere"], bpy.data.objects["Guides"]

    def announced():
        return [
            any(text.startswith("Takes about") for text in draw(named(name)).texts)
            for name in ("guides", "interpolation")
        ]

    assert announced() == [False, False]
    guides.data.vellus.is_live = hair.data.vellus.is_live = False
    guides.data.vellus.guides.guide_count = 50_000
    assert announced() == [True, False]
    hair.data.vellus.hair.strand_count = 1_000_000
    assert announced() == [True, True]
    guides.data.vellus.guides.guide_count, hair.data.vellus.hair.strand_count = 60, 500
    sphere.modifiers.new("Subdivision", "SUBSURF").levels = 4
    bpy.context.view_layer.update()
    assert scene.triangle_count(sphere, bpy.context.view_layer) == 1280 * 3 * 4**3 * 2
    assert announced() == [True, False]
    bpy.data.hair_curves.remove(guides.data)
    bpy.data.hair_curves.remove(hair.data)
    bpy.context.view_layer.objects.active = sphere
    assert any(text.startswith("Takes about") for text in draw(named("guides")).texts)


def test_labels_leave_room_for_their_values():
    """At the sidebar's own width a name has 95 pixels, some fifteen letters; longer ones are cut."""
    for settings_class in (GuideSettings, HairSettings, Appearance):
        for name, _default, details in declared(settings_class):
            assert isinstance(_default, bool) or len(details.label or name) <= 18, name


@pytest.mark.parametrize("menu", ["VIEW3D_MT_curve_add", "VIEW3D_MT_object"])
def test_menus_are_extended_once(menu):
    ours = [f for f in getattr(bpy.types, menu).draw._draw_funcs if f.__module__ == menus.__name__]
    assert len(ours) == 1
