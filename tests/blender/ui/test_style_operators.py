# SPDX-License-Identifier: GPL-3.0-or-later
"""Style operators add, move, remove, duplicate, key, undo, save and append styles and presets, and the panel shows
them.
"""

import math
from types import SimpleNamespace

import bpy
import pytest

from hair_addon.blender.data.strands import curves
from hair_addon.blender.groom import bindings
from hair_addon.blender.groom.styles import hair_styles, style_notes
from hair_addon.blender.groom.transfer import groom_settings
from hair_addon.blender.settings import saved_styles, setting_properties, style_items
from hair_addon.blender.ui import look_previews, panels
from hair_addon.core.files import style_presets
from hair_addon.core.geometry import strands
from hair_addon.core.grooming import groom_defaults
from hair_addon.core.params import declared
from hair_addon.core.styling import clump, clump_trees, curl, fitting, frizz, lean, trim, wet
from hair_addon.core.styling.base import ProfiledSettings, scaled
from hair_addon.core.styling.kinds import KINDS, OFFERS, kind_of
from tests.support.interface.layout import draw, draw_all
from tests.support.invariants import operate
from tests.support.pairs import pairs, share_of
from tests.support.reading import points, write_points

SPHERE_FACTOR = groom_defaults.FUR_LENGTH * math.sqrt(4.0 * math.pi) / 0.12  # of the sphere's default hair length


def state():
    """Return the settings of the hair, also after undo has moved them in memory."""
    return bpy.data.hair_curves["Hair"].vellus


def styles():
    return style_items.styles_of(state())


def names():
    return style_items.names_of(state())


def undo():
    bpy.ops.ed.undo()


@pytest.fixture
def styled(hair):
    """Return hair with three styles, the second active."""
    for style in ("CLUMP", "CURL", "FRIZZ"):
        operate(bpy.ops.vellus.add_style, style=style)
    state().active_style = 1
    bpy.ops.ed.undo_push(message="styled")
    return hair


@pytest.fixture
def still(hair):
    """Stop updates of the hair, whose locks for a head would be tens of thousands."""
    state().is_live = False
    return hair


@pytest.mark.parametrize(("offer", "is_fitted"), pairs(OFFERS, [True, False], 2))
def test_the_menu_adds_its_styles(hair, offer, is_fitted):
    state().is_live = is_fitted  # locks for a head would be tens of thousands
    for _ in range(2):
        operate(bpy.ops.vellus.add_style, style=offer, is_fitted=is_fitted)
    assert names() == (OFFERS[offer].label, f"{OFFERS[offer].label}.001")
    assert [style.seed for style in styles()] == [0, 1] and state().active_style == 1
    wanted = scaled(OFFERS[offer].settings, SPHERE_FACTOR) if is_fitted else OFFERS[offer].settings
    for name, _default, details in declared(type(wanted)):
        if details.unit == "LENGTH":
            expected = getattr(wanted, name)
            if is_fitted and name in ("size", "lock"):  # locks of 500 strands on a sphere are larger
                expected = max(expected, 4.0 * math.sqrt(4.0 * math.pi / 500))
            assert getattr(styles()[0], name) == pytest.approx(expected, rel=0.02), name
    assert state().is_stale != is_fitted  # it waits, or the update has been


@pytest.mark.parametrize("active", ["Sphere", "Guides", "Hair"])
def test_styles_are_of_the_active_hair(hair, active):
    bpy.context.view_layer.objects.active = bpy.data.objects[active]
    operate(bpy.ops.vellus.add_style, style="WAVE")
    assert names() == ("Wave",)


def test_one_undo_takes_a_style_back(styled):
    before = styles(), names()
    for operator, arguments in (
        (bpy.ops.vellus.add_style, {"style": "TRIM"}),
        (bpy.ops.vellus.move_style, {"direction": "UP"}),
        (bpy.ops.vellus.move_style, {"direction": "DOWN"}),
        (bpy.ops.vellus.remove_style, {}),
        (bpy.ops.vellus.duplicate_style, {}),
        (bpy.ops.vellus.apply_style_preset, {"preset": "CURLY"}),
    ):
        operate(operator, **arguments)
        assert (styles(), names()) != before
        after = styles(), names()
        undo()
        assert (styles(), names()) == before
        bpy.ops.ed.redo()
        assert (styles(), names()) == after
        undo()


def test_styles_are_moved_removed_and_duplicated(styled):
    operate(bpy.ops.vellus.move_style, direction="UP")
    assert names() == ("Curl", "Clump", "Frizz") and state().active_style == 0
    operate(bpy.ops.vellus.move_style, direction="UP")  # it is at the top
    assert names() == ("Curl", "Clump", "Frizz")
    operate(bpy.ops.vellus.move_style, direction="DOWN")
    operate(bpy.ops.vellus.move_style, direction="DOWN")
    operate(bpy.ops.vellus.move_style, direction="DOWN")  # it is at the bottom
    assert names() == ("Clump", "Frizz", "Curl") and state().active_style == 2
    state().styles["Curl"].curl.radius = 0.5
    operate(bpy.ops.vellus.duplicate_style)
    assert names() == ("Clump", "Frizz", "Curl", "Curl.001") and state().active_style == 3
    assert styles()[3].radius == 0.5 and len({style.seed for style in styles()}) == 4
    for left in (3, 2, 1, 0):
        operate(bpy.ops.vellus.remove_style)
        assert len(names()) == left and state().active_style == max(left - 1, 0)
    for operator in (bpy.ops.vellus.remove_style, bpy.ops.vellus.move_style, bpy.ops.vellus.duplicate_style):
        assert not operator.poll()


def test_keyed_styles_are_moved_and_undone(styled):
    state().styles[1].curl.radius = 0.1
    styled.data.keyframe_insert("vellus.styles[1].curl.radius", frame=1)
    state().styles[1].curl.radius = 0.3
    styled.data.keyframe_insert("vellus.styles[1].curl.radius", frame=11)
    bpy.ops.ed.undo_push(message="keyed")

    def radius():
        bpy.context.scene.frame_set(1)
        bpy.context.scene.frame_set(11)
        return [style.radius for style in styles() if isinstance(style, curl.Settings)]

    assert radius() == [0.3]
    operate(bpy.ops.vellus.move_style, direction="DOWN")
    assert radius() == [0.3] and names()[2] == "Curl"
    operate(bpy.ops.vellus.duplicate_style)
    state().styles[3].curl.radius = 0.7  # the copy has no keys
    assert radius() == [0.3, 0.7]
    undo()
    undo()
    assert radius() == [0.3] and names()[1] == "Curl"
    operate(bpy.ops.vellus.remove_style)
    assert radius() == [] and names() == ("Clump", "Frizz")
    undo()
    assert radius() == [0.3]


def test_styles_are_saved_appended_and_copied_with_their_hair(styled, tmp_path):
    state().styles[1].curl.radius = 0.123
    styled.data.keyframe_insert("vellus.styles[1].curl.radius", frame=1)
    copy = styled.copy()
    copy.data = styled.data.copy()
    copy.data.vellus.styles[0].clump.size = 0.5
    assert state().styles[0].clump.size != 0.5
    wanted = styles(), names()
    path = str(tmp_path / "styled.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert (styles(), names()) == wanted
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(path) as (_source, target):
        target.objects = ["Hair"]
    assert (styles(), names()) == wanted
    assert bpy.data.hair_curves["Hair"].animation_data.action is not None


# Presets.


@pytest.mark.parametrize("preset", share_of(style_presets.PRESETS, 8))
def test_presets_replace_styles_and_leave_the_rest(styled, preset):
    before = groom_settings.settings_of(styled.data)
    state().is_live = False  # locks for a head would be tens of thousands
    operate(bpy.ops.vellus.apply_style_preset, preset=preset, is_fitted=False)
    after = groom_settings.settings_of(bpy.data.hair_curves["Hair"])
    wanted = style_presets.read(preset).changed(before)
    assert after.styles == tuple(map(setting_properties.as_stored, wanted.styles))
    assert (after.guides, after.appearance, after.tables) == (before.guides, before.appearance, before.tables)
    assert after.hair == setting_properties.as_stored(wanted.hair)


def test_locks_of_hair_that_is_not_live_are_placed_by_its_update(styled, monkeypatch):
    state().is_live = False
    placed, search = [], clump_trees.ClumpTrees.search
    monkeypatch.setattr(clump_trees.ClumpTrees, "search", lambda *given: placed.append(given) or search(*given))
    operate(bpy.ops.vellus.apply_style_preset, preset="CURLY")
    operate(bpy.ops.vellus.add_style, style="CLUMP")
    assert not placed and state().is_stale
    operate(bpy.ops.vellus.update_hair)
    assert placed and not state().is_stale


def test_presets_fit_the_surface(hair):
    operate(bpy.ops.vellus.apply_style_preset, preset="CURLY")
    (plain,) = (style for style in style_presets.read("CURLY").styles if isinstance(style, curl.Settings))
    (fitted,) = (style for style in styles() if isinstance(style, curl.Settings))
    (locks,) = (style for style in styles() if isinstance(style, clump.Settings))
    assert fitted.radius == pytest.approx(plain.radius * SPHERE_FACTOR, rel=0.02)
    assert fitted.coherence == plain.coherence
    factor, spacing = hair_styles.surface_fit(bpy.data.hair_curves["Hair"])
    assert factor == pytest.approx(SPHERE_FACTOR, rel=0.02)
    assert spacing == pytest.approx(math.sqrt(4.0 * math.pi / 500), rel=0.02)
    assert locks.size == pytest.approx(4.0 * spacing, rel=0.01)


def test_locks_of_presets_for_few_strands_are_explained(hair):
    """The panel shows the wanted size and, once there are more strands, the size that the preset then gives."""
    hair.data.vellus.hair.strand_count = 40
    operate(bpy.ops.vellus.apply_style_preset, preset="CURLY")
    item = next(item for item in state().styles if item.kind == "CLUMP")
    enlarged = item.clump.size
    (reported,) = style_notes.notes_of(hair.data, item)
    state().active_style = list(state().styles).index(item)
    assert "because there are few strands" in reported and reported in " ".join(draw(bpy.types.VELLUS_PT_styles).texts)
    hair.data.vellus.hair.strand_count = 400
    (reported,) = style_notes.notes_of(hair.data, item)
    assert reported.startswith("Strands are denser now")
    fitted = fitting.lock_size_for(*style_items.enlarged_of(item), 400)
    item.clump.size = 0.9 * enlarged  # an artist's own size
    assert style_notes.notes_of(hair.data, item) == []
    operate(bpy.ops.vellus.apply_style_preset, preset="CURLY")
    item = next(item for item in state().styles if item.kind == "CLUMP")
    assert item.clump.size == pytest.approx(fitted, rel=5e-3) and fitted < 0.5 * enlarged
    operate(bpy.ops.vellus.apply_style_preset, preset="CURLY", is_fitted=False)
    assert not any(map(style_items.enlarged_of, state().styles))


def test_a_style_is_added_to_hair_that_undo_read_again_meanwhile(hair):
    bpy.ops.ed.undo_push(message="Before")
    hair.data.vellus.hair.strand_count = 40
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="After")
    work = hair_styles.adding(bpy.data.hair_curves["Hair"], clump.Settings(), is_fitted=True)
    next(work)
    bpy.ops.ed.undo()
    with pytest.raises(StopIteration):
        work.send(None)
    assert [item.kind for item in state().styles] == ["CLUMP"]


def test_a_preset_may_come_after_the_present_styles(styled):
    before = styles()
    operate(bpy.ops.vellus.apply_style_preset, preset="WET", keeps_styles=True)
    assert styles()[:3] == before and isinstance(styles()[3], wet.Settings)
    assert len({style.seed for style in styles()}) == 4


def test_saved_presets_come_back(styled, tmp_path, monkeypatch):
    monkeypatch.setattr(saved_styles.FILES, "folder", lambda create: tmp_path)
    before = styles(), names()
    state().hair.tip_taper = 0.75
    assert bpy.ops.vellus.save_style_preset(name="My style") == {"FINISHED"}
    assert saved_styles.names() == ["My style"]
    operate(bpy.ops.vellus.apply_style_preset, preset="BUZZ")
    operate(bpy.ops.vellus.apply_saved_style, name="My style")
    assert (styles(), names()) == before and state().hair.tip_taper == 0.75
    drawn = draw(bpy.types.VELLUS_PT_style_presets).drawn
    assert drawn["vellus.apply_saved_style"] == drawn["vellus.remove_style_preset"] == 1
    bpy.ops.vellus.remove_style_preset(name="My style")
    assert saved_styles.names() == []
    with pytest.raises(RuntimeError, match="does not exist"):
        bpy.ops.vellus.apply_saved_style(name="My style")
    for name in ("", "  ", ".."):
        with pytest.raises(RuntimeError, match="The name is empty"):
            bpy.ops.vellus.save_style_preset(name=name)


def test_an_invalid_saved_preset_changes_nothing(styled, tmp_path, monkeypatch):
    monkeypatch.setattr(saved_styles.FILES, "folder", lambda create: tmp_path)
    before = groom_settings.settings_of(styled.data)
    (tmp_path / "bad.json").write_text(
        '{"format": "Vellus groom settings", "version": 1, "styles": [{"kind": "PERM"}]}'
    )
    with pytest.raises(RuntimeError, match=r"styles\[0\].kind"):
        bpy.ops.vellus.apply_saved_style(name="bad")
    assert groom_settings.settings_of(styled.data) == before


def test_curls_get_the_points_they_want(hair):
    with pytest.raises(RuntimeError, match="No style needs more points"):
        bpy.ops.vellus.use_points()
    style_items.assign(state(), [curl.Settings(radius=0.005, pitch=0.05)])
    assert "vellus.use_points" in draw(bpy.types.VELLUS_PT_styles).drawn
    operate(bpy.ops.vellus.use_points)
    assert state().hair.point_count == curl.points_wanted(styles()[0], 0.5)
    assert "vellus.use_points" not in draw(bpy.types.VELLUS_PT_styles).drawn
    state().styles[0].curl.pitch = state().styles[0].curl.radius = 1e-3
    operate(bpy.ops.vellus.use_points)
    assert state().hair.point_count == 257
    state().styles[0].curl.pitch = 1.0
    operate(bpy.ops.vellus.use_points)
    assert state().hair.point_count == 257  # it takes none away


def test_curls_on_hand_made_guides_get_the_points_for_their_mean_length(hair):
    guides = bpy.data.objects["Guides"]
    guides.data.vellus.written = curves.BY_HAND
    roots = points(guides)[:, :1]
    write_points(guides, roots + 0.8 * (points(guides) - roots))
    style_items.assign(state(), [curl.Settings(radius=0.005, pitch=0.05)])
    operate(bpy.ops.vellus.use_points)
    mean_length = float(strands.lengths(points(bpy.data.objects["Guides"])).mean())
    assert state().hair.point_count == curl.points_wanted(styles()[0], mean_length) < 257


# The panel.


@pytest.mark.parametrize("kind", KINDS)
def test_every_setting_of_a_style_has_a_row(still, kind):
    style_items.assign(state(), [KINDS[kind]()])
    drawn = draw_all([panel for panel in panels.CLASSES if panel.bl_idname.startswith("VELLUS_PT_styles")])
    names = [name for name, *_ in declared(KINDS[kind])]
    assert {name: drawn[name] for name in names} == dict.fromkeys(names, 1)
    is_profiled = issubclass(KINDS[kind], ProfiledSettings)
    assert (draw(bpy.types.VELLUS_PT_styles_profile) is not None) == is_profiled


def test_names_of_data_are_picked(still):
    sphere = bpy.data.objects["Sphere"]
    for settings, picked in ((trim.Settings(), "cutter"), (lean.Settings(), "target")):
        style_items.assign(state(), [settings])
        assert draw(bpy.types.VELLUS_PT_styles).picked == {picked: bpy.data.objects}
        found = draw(bpy.types.VELLUS_PT_styles_mask).picked
        assert found == {"mask": sphere.vertex_groups, "mask_image": bpy.data.images}


NOTES = {
    "disabled": (curl.Settings(is_on=False), "disabled"),
    "amount": (curl.Settings(amount=0.0), "amount is zero"),
    "profile": (curl.Settings(root=0.0, tip=0.0), "at root and tip"),
    "trim": (trim.Settings(), "No effect"),
    "radius": (curl.Settings(radius=0.0), "No effect"),
    "amplitude": (frizz.Settings(amplitude=0.0), "No effect"),
    "cutter": (trim.Settings(cutter="Lost"), 'No object "Lost"'),
    "target": (lean.Settings(direction="OBJECT", target="Lost"), 'No object "Lost"'),
    "no target": (lean.Settings(direction="OBJECT"), "Pick an object"),
    "mask": (curl.Settings(mask="lost"), 'attribute "lost"'),
    "image": (curl.Settings(mask_image="lost"), 'image "lost"'),
}
EFFECTIVE = [
    curl.Settings(mask="top"),
    trim.Settings(factor=0.5),
    trim.Settings(cutter="Sphere"),
    lean.Settings(target="Lost"),
    lean.Settings(direction="OBJECT", target="Sphere"),
    clump.Settings(amount=0.1),
    wet.Settings(),
]


@pytest.mark.parametrize("case", NOTES)
def test_why_a_style_does_nothing_is_shown(still, case):
    settings, words = NOTES[case]
    style_items.assign(state(), [settings])
    assert words in " ".join(draw(bpy.types.VELLUS_PT_styles).texts)


@pytest.mark.parametrize("settings", EFFECTIVE, ids=lambda settings: kind_of(settings))
def test_nothing_is_reported_of_others(still, settings):
    style_items.assign(state(), [settings])
    assert style_notes.notes_of(still.data, state().styles[0]) == []


def test_the_order_of_styles_is_explained(still):
    style_items.assign(state(), [wet.Settings(), curl.Settings(), lean.Settings()])
    first, second, third = (style_notes.notes_of(still.data, item) for item in state().styles)
    assert "Wet should be the last style" in first[0] and second == [] and "Lean acts on guides" in third[0]
    state().styles[1].curl.is_on = state().styles[2].lean.is_on = False
    assert style_notes.notes_of(still.data, state().styles[0]) == []


@pytest.mark.parametrize("settings", [clump.Settings(size=0.3, levels=2), wet.Settings(lock=0.3)], ids=kind_of)
def test_locks_that_are_too_small_are_explained(hair, settings, monkeypatch):
    style_items.assign(state(), [settings])
    bpy.context.view_layer.update()
    reported = style_notes.notes_of(hair.data, state().styles[0])
    assert reported == []
    monkeypatch.setattr(clump_trees, "MOST_SITES", 20)
    (reported,) = style_notes.notes_of(hair.data, state().styles[0])
    finest = math.sqrt(bindings.of(hair.data).styles.trees.area / (0.866 * 20))
    size = finest / (settings.ratio if kind_of(settings) == "CLUMP" else 0.32)
    assert reported == f"The locks are too small for this surface: a size of {size:.2f} m is used."
    assert reported in " ".join(draw(bpy.types.VELLUS_PT_styles).texts)


def test_presets_are_offered_with_pictures_where_there_are_some(hair, tmp_path, monkeypatch):
    assert draw(bpy.types.VELLUS_PT_styles).drawn["pictures of style"] == 1
    drawn = draw(bpy.types.VELLUS_PT_style_presets).drawn
    assert drawn["vellus.apply_style_preset"] == len(style_presets.PRESETS)
    monkeypatch.setattr(look_previews, "style_presets", SimpleNamespace(FOLDER=tmp_path))
    look_previews.unregister()
    assert look_previews.style_picture("CURLY") is None
    (tmp_path / "curly.png").write_bytes((look_previews.FOLDER / "BLOND.png").read_bytes())
    assert look_previews.style_picture("CURLY") is not None
    look_previews.unregister()


def test_a_click_on_a_picture_gives_its_styles(hair, tmp_path, monkeypatch):
    monkeypatch.setattr(saved_styles.FILES, "folder", lambda create: tmp_path)
    pictures = bpy.context.window_manager.vellus_pictures
    pictures.style = "CURLY"
    wanted = [style_items.styles_of(state())]
    bpy.ops.vellus.save_style_preset(name="Mine")
    pictures.style = "STRAIGHT"
    assert style_items.styles_of(state()) != wanted[0]
    bpy.ops.vellus.apply_style_preset(preset="CURLY")
    assert style_items.styles_of(state()) == wanted[0] != ()
    pictures.style = "STRAIGHT"
    pictures.style = "own Mine"
    assert [kind_of(style) for style in style_items.styles_of(state())] == [kind_of(style) for style in wanted[0]]
    assert pictures.style == "PRESENT"
