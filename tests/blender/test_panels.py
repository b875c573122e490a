# SPDX-License-Identifier: GPL-3.0-or-later
"""Every panel draws for every kind of active object, with a row for each setting and no work."""

from collections import Counter

import bpy
import pytest

from hair_addon.blender import panels
from hair_addon.core.groom import GuideSettings, HairSettings
from hair_addon.core.params import declared
from hair_addon.core.shading import appearance, lookup_tables
from hair_addon.core.shading.appearance import Appearance


class Layout:
    """Stands in for UILayout and notes what was drawn; every property must exist on its owner."""

    def __init__(self):
        self.drawn = Counter()

    def row(self):
        return self

    def label(self, *, text, icon="NONE"):
        self.drawn["label"] += 1

    def prop(self, owner, name):
        assert name in owner.bl_rna.properties
        self.drawn[name] += 1

    def prop_search(self, owner, name, source, collection):
        assert hasattr(source, collection)
        self.prop(owner, name)

    def operator(self, name, text="", icon="NONE"):
        category, operator = name.split(".")
        assert operator in dir(getattr(bpy.ops, category))
        self.drawn[name] += 1

    def operator_menu_enum(self, name, choice, text=""):
        category, operator = name.split(".")
        choices = getattr(getattr(bpy.ops, category), operator).get_rna_type().properties[choice].enum_items
        assert len(choices) > 1
        self.operator(name)


class Panel:
    """A panel's self: its layout, and what the class itself has."""

    def __init__(self, panel):
        self.layout, self.panel = Layout(), panel

    def __getattr__(self, name):
        return getattr(self.panel, name)


def draw(panel):
    """What a panel draws in the present context; None where it is not shown."""
    if hasattr(panel, "poll") and not panel.poll(bpy.context):
        return None
    drawing = Panel(panel)
    panel.draw(drawing, bpy.context)
    return drawing.layout.drawn


@pytest.mark.parametrize("panel", panels.CLASSES, ids=lambda panel: panel.bl_label)
@pytest.mark.parametrize("active", ["nothing", "Sphere", "Guides", "Hair"])
def test_panels_draw_whatever_is_active(hair, panel, active):
    bpy.context.view_layer.objects.active = bpy.data.objects.get(active)
    before = len(bpy.data.hair_curves)
    draw(panel)
    assert len(bpy.data.hair_curves) == before


@pytest.mark.parametrize(
    ("panel", "settings_class"),
    [(panels.VELLUS_PT_guides, GuideSettings), (panels.VELLUS_PT_interpolation, HairSettings)],
)
def test_every_setting_has_one_row(hair, panel, settings_class):
    drawn = draw(panel)
    assert {name: drawn[name] for name, *_ in declared(settings_class)} == dict.fromkeys(
        (name for name, *_ in declared(settings_class)), 1
    )


@pytest.mark.parametrize("parametrization", appearance.COLOR_FIELDS)
@pytest.mark.parametrize("model", ["KAJIYA_KAY", "MARSCHNER"])
def test_shading_offers_what_changes_the_picture(hair, model, parametrization):
    """One kind of colour; nothing that differs between strands, which the viewport does not draw."""
    state = hair.data.vellus
    state.model, state.appearance.parametrization = model, parametrization
    drawn = draw(panels.VELLUS_PT_shading)
    assert drawn["model"] == drawn["vellus.apply_preset"] == 1
    assert drawn["mode"] == (model == "MARSCHNER")
    for name, *_ in declared(Appearance):
        other_colors = [n for kind, names in appearance.COLOR_FIELDS.items() if kind != parametrization for n in names]
        is_hidden = name in other_colors or name in appearance.STRAND_FIELDS
        assert name == "mode" or drawn[name] == (not is_hidden), name


@pytest.mark.parametrize(("mode", "has_glints"), [("classic", True), ("energy", False)])
def test_tables_offer_what_the_appearance_does_not(hair, mode, has_glints):
    hair.data.vellus.appearance.mode = mode
    drawn = draw(panels.VELLUS_PT_tables)
    shown = {name for name, *_ in declared(lookup_tables.Settings) if drawn[name]}
    assert {"size", "axes", "shifts"} <= shown
    assert not shown & set(appearance.TABLE_FIELDS)
    assert ("glint_gain" in shown) == ("caustic" in shown) == has_glints


def test_tabs_follow_the_pipeline():
    assert [p.bl_label for p in panels.CLASSES] == ["Guides", "Interpolation", "Shading", "Tables", "Output"]
    assert {p.bl_category for p in panels.CLASSES} == {"Hair"}
