# SPDX-License-Identifier: GPL-3.0-or-later
"""Every panel is drawn for every kind of active object, with a row for each setting and without other work."""

import math
import os
from dataclasses import replace
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from hair_addon.blender.data import scene
from hair_addon.blender.host import running
from hair_addon.blender.settings import fitted_sizes, picture_choices, properties, saved_looks, setting_properties
from hair_addon.blender.ui import keymap, look_previews, menus, panels
from hair_addon.blender.ui.panels import tab
from hair_addon.core.grooming import cost
from hair_addon.core.grooming.groom import GuideSettings, HairSettings
from hair_addon.core.long_work import Job
from hair_addon.core.params import declared
from hair_addon.core.shading import appearance
from hair_addon.core.shading.appearance import Appearance
from hair_addon.core.shading.presets import PRESETS
from hair_addon.core.shading.tables import lookup_tables
from tests.support.interface.layout import Context, Layout, draw, draw_all
from tests.support.reading import points, write_points

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
    declarations = declared(settings_class)
    # A radius is shown as its diameter.
    names = [details.diameter[0] if details.diameter else name for name, _default, details in declarations]
    assert {name: drawn[name] for name in names} == dict.fromkeys(names, 1)
    assert not any(drawn[name] for name, _default, details in declarations if details.diameter)


@pytest.mark.parametrize("parametrization", appearance.COLOR_FIELDS)
@pytest.mark.parametrize("model", ["KAJIYA_KAY", "MARSCHNER"])
def test_shading_offers_what_changes_the_picture(hair, model, parametrization):
    """The Shading panel shows one kind of color and each other setting that changes the picture once."""
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
    assert tops == [
        "Progress",
        "Hair Systems",
        "Surface",
        "Guides",
        "Layers",
        "Strands",
        "Dynamics",
        "Styles",
        "Shading",
        "Advanced: Lookup Tables",
        "Output",
    ]
    assert {panel.bl_category for panel in TAB} == {"Hair"}


@pytest.mark.parametrize(("strand_count", "guide_map"), [(1, True), (1000, False), (7777, True)])
def test_the_cost_that_is_shown_is_what_curves_take(guides, strand_count, guide_map):
    bpy.ops.vellus.interpolate_hair(strand_count=strand_count, guide_map=guide_map)
    curves = bpy.data.hair_curves["Hair"]
    widths = {"FLOAT": 4, "INT": 4, "INT8": 1, "FLOAT2": 8, "FLOAT_VECTOR": 12, "BOOLEAN": 1}
    taken = sum(len(a.data) * widths[a.data_type] for a in curves.attributes) + 4 * strand_count
    slot_count = curves.vellus.hair.neighbour_limit if guide_map else 0
    assert cost.curves_bytes(strand_count, slot_count=slot_count) == taken


def delete(sphere):
    """Delete an object as the X key does, which keeps its hair's data in the file."""
    with bpy.context.temp_override(selected_objects=[sphere]):
        bpy.ops.object.delete()


def join_to_cube(sphere):
    bpy.ops.mesh.primitive_cube_add()
    with bpy.context.temp_override(selected_editable_objects=[sphere, bpy.context.object]):
        bpy.ops.object.join()
    make_active("Hair")


def turn_over(sphere):
    sphere.data.flip_normals()
    sphere.data.update()
    bpy.context.view_layer.update()


def move_hair(_sphere):
    bpy.data.objects["Hair"].location.x = 0.5
    bpy.context.view_layer.update()


def clear_parent(_sphere):
    with bpy.context.temp_override(selected_editable_objects=[bpy.data.objects["Hair"]]):
        bpy.ops.object.parent_clear(type="CLEAR_KEEP_TRANSFORM")


WARNINGS = {
    "no UV map": (lambda sphere: sphere.data.uv_layers.remove(sphere.data.uv_layers[0]), "vellus.make_uv_map"),
    "a renamed UV map": (lambda sphere: setattr(sphere.data.uv_layers[0], "name", "Other"), "vellus.use_uv_map"),
    "a scale": (lambda sphere: setattr(sphere, "scale", (1.0, 2.0, 1.0)), "vellus.apply_scale"),
    "a lost surface": (lambda sphere: bpy.data.objects.remove(sphere), "vellus.attach_to_surface"),
    "a deleted surface": (delete, "vellus.attach_to_surface"),
    "a surface joined to another": (join_to_cube, "vellus.attach_to_surface"),
    "moved hair": (move_hair, "vellus.attach_to_surface"),
    "hair without a parent": (clear_parent, "vellus.attach_to_surface"),
    "normals inward": (lambda sphere: turn_over(sphere), "vellus.flip_normals"),
    "no guides' object": (lambda _: bpy.data.objects.remove(bpy.data.objects["Guides"]), "vellus.restore_guides"),
}


@pytest.mark.parametrize("case", WARNINGS)
def test_problems_are_shown_with_the_button_that_fixes_them(hair, case):
    break_it, operator = WARNINGS[case]
    assert operator not in draw(named("surface")).drawn
    break_it(bpy.data.objects["Sphere"])
    assert draw(named("surface")).drawn[operator] == 1


@pytest.mark.parametrize("apart", [move_hair, clear_parent])
def test_hair_apart_from_its_surface_is_attached_again(hair, apart):
    """Hair apart from its surface can be attached again, combed guides too; hair that moves with its surface is not
    apart.
    """
    sphere, guides = bpy.data.objects["Sphere"], bpy.data.objects["Guides"]
    sphere.matrix_world = Matrix.Translation((1.0, 2.0, 300.0)) @ Matrix.Rotation(1.0, 4, "X")
    write_points(guides, points(guides) * np.float32(1.1))
    bpy.context.view_layer.update()
    assert not draw(named("surface")).drawn["vellus.attach_to_surface"]
    apart(sphere)
    assert draw(named("surface")).drawn["vellus.attach_to_surface"] == 1
    combed = points(guides)
    make_active("Hair")
    assert bpy.ops.vellus.attach_to_surface() == {"FINISHED"}
    bpy.context.view_layer.update()
    assert not draw(named("surface")).drawn["vellus.attach_to_surface"]
    assert hair.parent == sphere and np.allclose(hair.matrix_world, sphere.matrix_world)
    np.testing.assert_array_equal(points(guides), combed)
    assert guides.data.vellus.status == hair.data.vellus.status == ""


def test_a_surface_that_no_scene_shows_is_not_missing(hair):
    """A surface in an excluded collection or in another scene does not count as missing."""
    sphere = bpy.data.objects["Sphere"]
    other = bpy.data.collections.new("Characters")
    other.objects.link(sphere)
    for owner in set(sphere.users_collection) - {other}:
        owner.objects.unlink(sphere)
    assert sphere.users_scene == ()
    assert not draw(named("surface")).drawn["vellus.attach_to_surface"]


def test_hair_is_not_attached_to_its_deleted_surface(hair):
    delete(bpy.data.objects["Sphere"])
    assert hair.data.surface is not None
    assert not bpy.ops.vellus.attach_to_surface.poll()


@pytest.mark.parametrize("is_locked", [False, True])
def test_locking_the_interface_is_offered_for_animated_settings(hair, is_locked):
    bpy.context.scene.render.use_lock_interface = is_locked
    assert not draw(named("output")).drawn["use_lock_interface"]
    hair.data.keyframe_insert("vellus.appearance.melanin", frame=1)
    assert draw(named("output")).drawn["use_lock_interface"] == (not is_locked)


@pytest.mark.parametrize(("setting", "words"), [("part_lines", "part line"), ("region_group", "vertex group")])
def test_missing_partings_are_reported(hair, setting, words):
    assert not any(words in " ".join(draw(named(name)).texts) for name in ("surface", "interpolation_parting"))
    setattr(hair.data.vellus.hair, setting, "Lost")
    for name in ("surface", "interpolation_parting"):
        assert words in " ".join(draw(named(name)).texts) and "Lost" in " ".join(draw(named(name)).texts)


def test_sentences_are_wrapped_to_the_sidebar(hair):
    hair.data.vellus.status = "Hand-edited: these settings no longer apply. Regenerate Strands discards the edits."
    lines = draw(named("interpolation")).texts
    assert hair.data.vellus.status in " ".join(lines)
    assert max(map(len, lines)) <= 32


def test_work_under_way_is_a_bar_at_the_top_of_the_tab(hair, monkeypatch):
    def compute(progress):
        progress("Growing guides", 0.25)

    assert draw(named("progress")) is None and panels.CLASSES[0] == named("progress")
    job = Job(compute)
    job.wait()
    monkeypatch.setattr(running, "_job", job)
    drawn = draw(named("progress"))
    assert drawn.drawn["progress"] == 1 and "Growing guides" in drawn.texts
    assert not [name for name in drawn.drawn if name.startswith("vellus.")]


def test_memory_grows_with_the_count():
    assert cost.gpu_bytes(2000) == 2 * cost.gpu_bytes(1000)
    assert math.isfinite(cost.hair_seconds(HairSettings(), 1)) and cost.guide_seconds(GuideSettings(), 1) > 0.0


def test_long_work_is_announced_and_short_work_is_not(hair, monkeypatch):
    """Long work is announced, and short work is not, by the evaluated surface and the requested amount."""
    monkeypatch.setattr(tab, "LONG", 0.05 * tab.LONG)  # a surface of half a million triangles takes seconds to make
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
    sphere.modifiers.new("Subdivision", "SUBSURF").levels = 2
    bpy.context.view_layer.update()
    assert scene.triangle_count(sphere, bpy.context.view_layer) == 1280 * 3 * 4 * 2
    assert announced() == [True, False]
    bpy.data.hair_curves.remove(guides.data)
    bpy.data.hair_curves.remove(hair.data)
    bpy.context.view_layer.objects.active = sphere
    assert any(text.startswith("Takes about") for text in draw(named("guides")).texts)


@pytest.mark.parametrize(
    "menu",
    [
        "VIEW3D_MT_curve_add",
        "VIEW3D_MT_object",
        "VIEW3D_MT_object_context_menu",
        "VIEW3D_MT_edit_curves_context_menu",
        "TOPBAR_MT_file_export",
    ],
)
def test_menus_are_extended_once(menu):
    ours = [f for f in getattr(bpy.types, menu).draw._draw_funcs if f.__module__ == menus.__name__]
    assert len(ours) == 1


@pytest.mark.parametrize(
    ("menu", "active", "entry"),
    [
        ("VIEW3D_MT_object_context_menu", "Hair", "VELLUS_MT_hair"),
        ("VIEW3D_MT_object_context_menu", "Sphere", "VELLUS_MT_hair"),
        ("VIEW3D_MT_edit_curves_context_menu", "Guides", "VELLUS_MT_guide_tools"),
    ],
)
def test_a_right_click_offers_hair(hair, menu, active, entry):
    """Right-click menus of hair, its surface and its guides have an entry for hair; those of a camera have none."""
    (ours,) = (f for f in getattr(bpy.types, menu).draw._draw_funcs if f.__module__ == menus.__name__)
    for name, wanted in ((active, [entry]), ("Camera", [])):
        if name == "Camera":
            camera = bpy.data.objects.new(name, bpy.data.cameras.new(name))
            bpy.context.scene.collection.objects.link(camera)
        make_active(name)
        layout = Layout()
        ours(SimpleNamespace(layout=layout), Context())
        assert list(layout.drawn) == wanted


def test_blenders_panel_of_cavity_says_that_hair_has_none(hair):
    (ours,) = (f for f in bpy.types.VIEW3D_PT_shading_cavity.draw._draw_funcs if f.__module__ == menus.__name__)
    for is_drawn in (True, False):
        bpy.data.objects["Hair"].data.vellus.is_drawn = is_drawn
        layout = Layout()
        ours(SimpleNamespace(layout=layout), Context())
        assert layout.texts == ["Cavity changes meshes, not hair"] * is_drawn


@pytest.mark.parametrize("active", ["Hair", "Guides", "Sphere"])
def test_the_pie_menu_offers_grooming(hair, active):
    """The pie menu has eight entries on hair, its guides and its surface, and one on a bare mesh; none elsewhere."""
    make_active(active)
    drawn = draw(menus.VELLUS_MT_hair_pie).drawn
    assert drawn.total() == 8 and drawn["vellus.comb_guides"] == drawn["VELLUS_MT_guide_tools"] == 1
    bpy.ops.mesh.primitive_plane_add()
    assert list(draw(menus.VELLUS_MT_hair_pie).drawn) == ["vellus.add_hair"]
    bpy.ops.object.camera_add()
    assert draw(menus.VELLUS_MT_hair_pie) is None


class Keymaps:
    """A key configuration of keymaps by name, as an add-on extends it."""

    def __init__(self):
        self.found = {"Object Mode": [SimpleNamespace(idname="wm.call_menu_pie", properties=SimpleNamespace(name="X"))]}

    def new(self, name, **_details):
        items = self.found.setdefault(name, [])

        def add(idname, *_event, **_modifiers):
            items.append(SimpleNamespace(idname=idname, properties=SimpleNamespace(name="")))
            return items[-1]

        return SimpleNamespace(keymap_items=SimpleNamespace(new=add))

    def __iter__(self):
        for items in self.found.values():
            yield SimpleNamespace(keymap_items=Items(items))


class Items:
    def __init__(self, items):
        self._items = items

    def __iter__(self):
        return iter(self._items)

    def remove(self, item):
        self._items.remove(item)


def test_the_shortcut_of_the_pie_menu_is_removed_with_the_add_on(monkeypatch):
    """Registering adds a shortcut that names the pie menu to each mode; unregistering leaves those of others."""
    keymaps = Keymaps()
    manager = SimpleNamespace(keyconfigs=SimpleNamespace(addon=SimpleNamespace(keymaps=keymaps)))
    monkeypatch.setattr(keymap, "bpy", SimpleNamespace(context=SimpleNamespace(window_manager=manager)))
    keymap.register()
    pies = [item.properties.name for items in keymaps.found.values() for item in items if "pie" in item.idname]
    assert sorted(pies) == ["VELLUS_MT_hair_pie"] * 3 + ["X"] and hasattr(bpy.types, keymap.PIE)
    keymap.unregister()
    assert [item.properties.name for items in keymaps.found.values() for item in items] == ["X"]


REDO = {
    "distribute_guides": ("Sphere", GuideSettings),
    "interpolate_hair": ("Guides", HairSettings),
    "add_hair": ("Sphere", GuideSettings),
}


def redo(operator):
    """Return the `Layout` of an operator's redo panel."""
    rna = getattr(bpy.ops.vellus, operator).get_rna_type()
    values = {name: entry.default for name, entry in rna.properties.items() if hasattr(entry, "default")}
    layout = Layout()
    # An operator's own RNA has none of its settings: `properties` has them.
    drawn = SimpleNamespace(layout=layout, properties=SimpleNamespace(bl_rna=rna, **values))
    getattr(bpy.types, f"VELLUS_OT_{operator}").draw(drawn, Context())
    return layout


@pytest.mark.parametrize("operator", REDO)
def test_the_redo_panel_draws_every_property_once(hair, operator):
    make_active(REDO[operator][0])
    own = set(getattr(bpy.types, f"VELLUS_OT_{operator}").__annotations__)
    own -= {"radius", fitted_sizes.SHOWN}  # shown as a diameter: thickness; not for artists
    layout = redo(operator)
    drawn = layout.drawn
    assert {name: drawn[name] for name in own} == dict.fromkeys(own, 1)
    assert not drawn["radius"]
    assert sum((drawn - layout.folded)[name] for name in own) <= 17  # rows before the user opens panels


@pytest.mark.parametrize("operator", REDO)
def test_names_of_data_are_picked_in_the_redo_panel(hair, operator):
    """Names of vertex groups, images and attributes are picked from lists in the redo panel."""
    sphere = bpy.data.objects["Sphere"]
    make_active(REDO[operator][0])
    own = set(getattr(bpy.types, f"VELLUS_OT_{operator}").__annotations__)
    pickers = {
        "density_group": sphere.vertex_groups,
        "density_image": bpy.data.images,
        "region_group": sphere.vertex_groups,
        "region_attribute": sphere.data.attributes,
    }  # part lines and flow lines have a `search` of their own
    assert redo(operator).picked == {name: data for name, data in pickers.items() if name in own}


@pytest.mark.parametrize(
    ("operator", "owner"), [("distribute_guides", "guides"), ("interpolate_hair", "interpolation")]
)
def test_the_redo_panel_follows_the_order_of_the_panels(hair, operator, owner):
    make_active(REDO[operator][0])
    names = set(getattr(bpy.types, f"VELLUS_OT_{operator}").__annotations__)
    in_panels = draw_all([panel for panel in TAB if panel.bl_idname.startswith(f"VELLUS_PT_{owner}")])
    assert [name for name in in_panels if name in names] == [name for name in redo(operator).drawn if name in names]


def test_looks_have_pictures_of_their_own(hair):
    """Each built-in look has its own picture, which is loaded when it is first drawn."""
    look_previews.unregister()
    assert look_previews._previews is None
    assert draw(named("shading")).drawn["pictures of look"] == 1
    assert draw(named("looks")).drawn["vellus.apply_preset"] == len(PRESETS)
    pictures = bpy.context.window_manager.vellus_pictures
    assert pictures.look == picture_choices.PRESENT  # new hair has a color of its own, which is shown
    assert len(look_previews._previews) == len(PRESETS) + 1
    files = {path.stem: path.read_bytes() for path in look_previews.FOLDER.glob("*.png")}
    assert set(files) == set(PRESETS) and len(set(files.values())) == len(files)
    look_previews.unregister()
    assert look_previews._previews is None


def test_a_click_on_a_picture_gives_its_look(hair, tmp_path, monkeypatch):
    """A click on a picture applies its look by an operator with undo, and the shown picture is that of the current
    look.
    """
    monkeypatch.setattr(saved_looks.FILES, "folder", lambda create: tmp_path)
    mine = Appearance(parametrization="COLOR", color=(0.5, 0.01, 0.01))
    saved_looks.write("Mine", mine)
    pictures, state = bpy.context.window_manager.vellus_pictures, hair.data.vellus
    state.appearance.mode = "classic"
    for name in ("AUBURN", "WET_BLOND", "DYED_BLUE"):
        pictures.look = name
        assert pictures.look == name
        assert properties.own_look_of(state) == setting_properties.as_stored(replace(PRESETS[name][1], mode="classic"))
    pictures.look = "own Mine"
    assert properties.own_look_of(state) == setting_properties.as_stored(replace(mine, mode="classic"))
    assert pictures.look == picture_choices.PRESENT
    pictures.look = picture_choices.PRESENT
    assert properties.own_look_of(state) == setting_properties.as_stored(replace(mine, mode="classic"))


def test_a_saved_look_has_a_swatch_of_its_color(hair, tmp_path, monkeypatch):
    """A saved look has a swatch of its color, which follows the file; without a window icons have no numbers."""
    monkeypatch.setattr(saved_looks.FILES, "folder", lambda create: tmp_path)
    look_previews.unregister()
    red, blue = (Appearance(parametrization="COLOR", color=color) for color in ((0.5, 0.01, 0.01), (0.01, 0.01, 0.5)))
    saved_looks.write("Mine", red)
    os.utime(tmp_path / "Mine.json", ns=(0, 0))
    look_previews.swatch("Mine")
    look_previews.swatch("Mine")
    saved_looks.write("Mine", blue)
    look_previews.swatch("Mine")
    saved_looks.write("Soaked", replace(blue, wetness=1.0))
    look_previews.swatch("Soaked")
    (tmp_path / "Broken.json").write_text("{")
    look_previews.swatch("Broken")
    colors = [np.array(preview.icon_pixels_float[:3]) for preview in look_previews._previews.values()]
    assert [int(np.argmax(color)) for color in colors] == [0, 2, 2]
    assert (colors[2] < 0.97 * colors[1]).all()  # wet hair is darker
    look_previews.unregister()
