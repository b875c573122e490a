# SPDX-License-Identifier: GPL-3.0-or-later
"""Styles as properties: values are stored exactly, names are unique, and keyframes follow their style."""

import math

import bpy
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hair_addon.blender.settings import animated, setting_properties, style_items
from hair_addon.core.errors import HairError
from hair_addon.core.params import declared
from hair_addon.core.styling import bend, clump, curl, frizz, wet
from hair_addon.core.styling.kinds import KINDS, LABELS, MOST_STYLES, OFFERS, kind_of

CURL, FRIZZ, CLUMP = curl.Settings(radius=0.004), frizz.Settings(amplitude=0.002), clump.Settings(size=0.5)


@pytest.fixture
def state(hair):
    """Return the settings of hair without styles, whose strands are not updated."""
    hair.data.vellus.is_live = False
    return hair.data.vellus


def keyed(state, path, values):
    """Key a setting with a value in every tenth frame."""
    for place, value in enumerate(values):
        owner, name = path.rsplit(".", 1)
        setattr(state.path_resolve(owner), name, value)
        state.id_data.keyframe_insert(f"vellus.{path}", frame=1 + 10 * place)


def paths(curves):
    """Return the data paths of all keys of Curves, including NLA strips."""
    animation = curves.animation_data
    users = [animation, *(strip for track in animation.nla_tracks for strip in track.strips)]
    bags = [
        strip.channelbag(user.action_slot)
        for user in users
        if user.action is not None
        for layer in user.action.layers
        for strip in layer.strips
    ]
    return sorted(curve.data_path for bag in bags for curve in bag.fcurves)


def animated_values(state, frame):
    """Return {(kind, name): values} of all styles in a frame."""
    bpy.context.scene.frame_set(frame)
    return {(item.kind, item.name): style_items.values_of(item) for item in state.styles}


def test_all_offers_come_back_as_they_went(state):
    wanted = tuple(setting_properties.as_stored(offer.settings) for offer in OFFERS.values())
    style_items.assign(state, wanted)
    assert style_items.styles_of(state) == wanted
    assert [item.kind for item in state.styles] == [kind_of(settings) for settings in wanted]
    names = style_items.names_of(state)
    assert len(set(names)) == len(names)
    style_items.assign(state, ())
    assert style_items.styles_of(state) == ()


@pytest.mark.parametrize("kind", KINDS)
def test_the_ends_of_all_ranges_come_back(state, kind):
    """Ends of ranges are restored: rounded to single precision they are still within the range."""
    for name, default, details in declared(KINDS[kind]):
        ends = [choice[0] for choice in details.choices]
        if not isinstance(default, str | bool):
            ends = [end for end in (details.low, details.high, details.soft_high) if math.isfinite(end)]
        for end in ends:
            wanted = KINDS[kind](**{name: end})
            style_items.assign(state, [wanted])
            assert style_items.styles_of(state) == (setting_properties.as_stored(wanted),), (name, end)


def test_a_style_marks_its_hair_and_the_same_styles_do_not(state):
    for change in (
        lambda: style_items.add(state, CURL),
        lambda: setattr(state.styles[0].curl, "radius", 0.01),
        lambda: style_items.add(state, FRIZZ),
        lambda: style_items.move(state, 0, 1),
        lambda: style_items.remove(state, 0),
        lambda: style_items.assign(state, [CLUMP, CURL]),
    ):
        state.is_stale = False
        change()
        assert state.is_stale
    state.is_stale = state.is_shading_stale = False
    style_items.assign(state, style_items.styles_of(state), style_items.names_of(state))
    style_items.assign(state, style_items.styles_of(state))
    assert not state.is_stale and not state.is_shading_stale
    style_items.assign(state, [wet.Settings()])
    state.is_shading_stale = False
    state.styles[0].wet.amount = 0.5
    assert state.is_shading_stale  # water is seen


def test_names_differ(state):
    for _ in range(3):
        style_items.add(state, CURL)
    assert style_items.names_of(state) == ("Curl", "Curl.001", "Curl.002")
    state.styles[2].name = "Curl"
    assert style_items.names_of(state) == ("Curl", "Curl.001", "Curl.002")
    state.styles[0].name = "Waves"
    state.styles[1].name = "  "
    assert style_items.names_of(state) == ("Waves", "Curl", "Curl.002")
    style_items.assign(state, [CURL, CURL], ["A", "A"])
    assert style_items.names_of(state) == ("A", "A.001")


def test_a_new_seed_is_of_no_other_style(state):
    for _ in range(5):
        style_items.add(state, curl.Settings(seed=style_items.new_seed(state)))
    assert sorted(settings.seed for settings in style_items.styles_of(state)) == [0, 1, 2, 3, 4]


def test_more_styles_than_possible_are_refused(state):
    style_items.assign(state, [CURL] * MOST_STYLES)
    with pytest.raises(HairError, match="at most 64"):
        style_items.add(state, CURL)
    with pytest.raises(HairError, match="at most 64"):
        style_items.assign(state, [CURL] * (MOST_STYLES + 1))
    assert len(state.styles) == MOST_STYLES


@pytest.mark.parametrize("kind", KINDS)
def test_structural_settings_and_seeds_cannot_be_keyed(state, kind):
    item = style_items.add(state, KINDS[kind]()) or state.styles[0]
    group = style_items.group_of(item)
    for name, _default, details in declared(KINDS[kind]):
        if details.is_structural or name == "seed":
            with pytest.raises(TypeError):
                group.keyframe_insert(name)
        elif not details.choices and not isinstance(getattr(group, name), str):
            assert group.keyframe_insert(name), name


# Keys.


@pytest.fixture
def keyed_styles(state):
    """Return three styles; the radius of the curl and the amplitude of the frizz have keys, also in an NLA strip."""
    style_items.assign(state, [CLUMP, CURL, FRIZZ])
    keyed(state, "styles[1].curl.radius", [0.001, 0.009])
    keyed(state, "styles[2].frizz.amplitude", [0.002, 0.008])
    animation = state.id_data.animation_data
    strip = animation.nla_tracks.new().strips.new("Strip", 1, animation.action)
    strip.action = strip.action.copy()
    strip.action.name = "In the NLA"
    return state


def test_moved_styles_take_their_keys_with_them(keyed_styles):
    state, before = keyed_styles, animated_values(keyed_styles, 6)
    for place, to in ((0, 2), (2, 1), (1, 0), (0, 1)):
        style_items.move(state, place, to)
        assert animated_values(state, 6) == before
        state.styles["Curl"].curl.radius = 0.5
        animated_values(state, 1)
        assert animated_values(state, 6) == before
    assert paths(state.id_data) == sorted(
        2
        * [
            f"vellus.styles[{state.styles.find(name)}].{setting}"
            for name, setting in (("Curl", "curl.radius"), ("Frizz", "frizz.amplitude"))
        ]
    )


def test_removed_styles_take_their_keys_away(keyed_styles):
    state, before = keyed_styles, animated_values(keyed_styles, 6)
    style_items.remove(state, 1)
    del before["CURL", "Curl"]
    assert animated_values(state, 6) == before
    assert paths(state.id_data) == ["vellus.styles[1].frizz.amplitude"] * 2
    style_items.add(state, CURL, place=0)
    assert animated_values(state, 6) == before | {("CURL", "Curl"): style_items.values_of(state.styles[0])}


def test_assigned_styles_keep_keys_by_their_names(keyed_styles):
    state = keyed_styles
    style_items.assign(state, [FRIZZ, wet.Settings(), CLUMP])
    assert paths(state.id_data) == ["vellus.styles[0].frizz.amplitude"] * 2


def test_drivers_follow(keyed_styles):
    state, curves = keyed_styles, keyed_styles.id_data
    driver = curves.driver_add("vellus.styles[2].frizz.gain").driver
    driver.expression = "0.25"
    reader = bpy.data.objects["Sphere"].driver_add("location", 0).driver
    reader.type = "SUM"
    target = reader.variables.new().targets[0]
    target.id_type, target.id, target.data_path = "CURVES", curves, "vellus.styles[2].frizz.amplitude"
    style_items.move(state, 2, 0)
    assert [curve.data_path for curve in curves.animation_data.drivers] == ["vellus.styles[0].frizz.gain"]
    assert target.data_path == "vellus.styles[0].frizz.amplitude"
    style_items.remove(state, 0)
    assert not curves.animation_data.drivers
    assert target.data_path == 'vellus.styles["Frizz"].frizz.amplitude'  # nothing is there


def test_paths_by_name_are_renamed(keyed_styles):
    state, curves = keyed_styles, keyed_styles.id_data
    bag = curves.animation_data.action.layers[0].strips[0].channelbags[0]
    bag.fcurves.new('vellus.styles["Curl"].curl.pitch')
    state.styles["Curl"].name = 'My "curl"'
    assert r'vellus.styles["My \"curl\""].curl.pitch' in paths(curves)
    style_items.move(state, 1, 0)
    assert r'vellus.styles["My \"curl\""].curl.pitch' in paths(curves)
    style_items.remove(state, 0)
    assert paths(curves) == ["vellus.styles[1].frizz.amplitude"] * 2


def test_keys_of_other_hair_and_other_settings_stay(keyed_styles):
    """Keys of other hair and of other settings stay, also if the hair shares the action."""
    state, curves = keyed_styles, keyed_styles.id_data
    curves.keyframe_insert("vellus.appearance.melanin", frame=1)
    other = curves.copy()
    assert other.animation_data.action == curves.animation_data.action
    before = paths(other)
    style_items.move(state, 1, 0)
    style_items.remove(state, 2)
    assert paths(other) == before
    assert "vellus.styles[0].curl.radius" in paths(curves) and "vellus.appearance.melanin" in paths(curves)
    assert "vellus.appearance.melanin" in paths(other)


def test_an_action_that_waits_follows(keyed_styles):
    """An unused action with the slot of this hair follows its styles too."""
    state, animation = keyed_styles, keyed_styles.id_data.animation_data
    waiting = animation.action
    animation.action = None
    style_items.move(state, 1, 0)
    animation.action = waiting
    animation.action_slot = waiting.slots[0]
    assert "vellus.styles[0].curl.radius" in paths(state.id_data)


def test_undo_brings_keys_back(keyed_styles):
    curves, before = keyed_styles.id_data, paths(keyed_styles.id_data)
    bpy.ops.ed.undo_push(message="before")
    style_items.remove(curves.vellus, 0)
    style_items.move(curves.vellus, 0, 1)
    bpy.ops.ed.undo_push(message="after")
    assert paths(curves) != before
    bpy.ops.ed.undo()
    assert paths(bpy.data.hair_curves["Hair"]) == before
    assert style_items.names_of(bpy.data.hair_curves["Hair"].vellus) == ("Clump", "Curl", "Frizz")


STEPS = st.lists(st.tuples(st.sampled_from(["move", "remove", "add", "rename"]), st.integers(0, 9), st.integers(0, 9)))


@given(steps=STEPS)
@settings(max_examples=60)
def test_any_order_of_changes_leaves_each_key_with_its_style(steps):
    """After any changes of the order, each style has the keys with its own value."""
    curves = bpy.data.hair_curves.new("Any")
    state = curves.vellus
    style_items.assign(state, [bend.Settings(angle=0.1 * place) for place in range(5)])
    curves.animation_data_create()
    for item in state.styles:
        item.bend.keyframe_insert("angle", frame=1)
    wanted = {item.name: item.bend.angle for item in state.styles}
    for step, a, b in steps:
        count = len(state.styles)
        if step == "add":
            style_items.add(state, CURL, place=a % (count + 1))
        elif count and step == "move":
            style_items.move(state, a % count, b % count)
        elif count and step == "remove":
            wanted.pop(state.styles[a % count].name, None)
            style_items.remove(state, a % count)
        elif count:
            item = state.styles[a % count]
            value = wanted.pop(item.name, None)
            item.name = f"Style {b}"
            if value is not None:
                wanted[item.name] = value
    bag = curves.animation_data.action.layers[0].strips[0].channelbags[0]
    found = {
        state.path_resolve(curve.data_path.removeprefix("vellus.").rsplit(".", 2)[0]).name: curve.evaluate(1)
        for curve in bag.fcurves
    }
    assert found == wanted
    bpy.data.actions.remove(curves.animation_data.action)
    bpy.data.hair_curves.remove(curves)


def test_a_keyed_amount_marks_its_hair(state):
    style_items.assign(state, [CLUMP, CURL])
    keyed(state, "styles[1].curl.amount", [0.0, 1.0])
    scene = bpy.context.scene
    scene.frame_set(1)
    state.is_stale = False
    animated.value_cache.clear()
    animated.remember()
    marked = []
    bpy.app.handlers.depsgraph_update_pre.append(lambda *_: marked.append(state.is_stale))
    scene.frame_set(6)
    assert state.styles[1].curl.amount == pytest.approx(0.5, abs=0.01)
    values, _paths = animated.value_cache.get(state.id_data.session_uid)
    assert values["CURL", "Curl"]["amount"] == state.styles[1].curl.amount


def test_labels_are_names_of_new_styles(state):
    for kind in KINDS:
        style_items.add(state, KINDS[kind]())
    assert style_items.names_of(state) == tuple(LABELS.values())
