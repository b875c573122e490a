# SPDX-License-Identifier: GPL-3.0-or-later
"""Groom settings are the same after writing and reading, and each error in a file is one message."""

import json
import math
import os
import re
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hair_addon.core.dynamics.rod.settings import DynamicsSettings
from hair_addon.core.errors import HairError
from hair_addon.core.files import settings_file
from hair_addon.core.files.settings_file import SECTIONS, GroomSettings, declared_in
from hair_addon.core.grooming.groom import GuideSettings, HairSettings
from hair_addon.core.maps.map_settings import MapSettings
from hair_addon.core.params import declared
from hair_addon.core.shading.appearance import Appearance
from hair_addon.core.styling import curl, frizz
from hair_addon.core.styling.kinds import KINDS


def values_of(default, details):
    """Generate values that a setting may have."""
    if isinstance(default, bool):
        return st.booleans()
    if isinstance(default, str):
        return (
            st.sampled_from([choice[0] for choice in details.choices])
            if details.choices
            else st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=20)
        )
    low = max(details.low, details.above)
    limits = {"min_value": None if math.isinf(low) else low, "max_value": details.high}
    if isinstance(default, int):
        return st.integers(int(limits["min_value"]), int(limits["max_value"]))
    numbers = st.floats(**limits, exclude_min=math.isfinite(details.above), allow_nan=False, allow_infinity=False)
    return st.tuples(*[numbers] * len(default)) if isinstance(default, tuple) else numbers


def any_settings(section):
    return st.builds(SECTIONS[section], **{name: values_of(*rest) for name, *rest in declared_in(section)})


def any_style(kind):
    return st.builds(KINDS[kind], **{name: values_of(*rest) for name, *rest in declared(KINDS[kind])})


STYLES = st.lists(st.one_of(*map(any_style, KINDS)), max_size=5)


@st.composite
def grooms(draw):
    """Generate any settings; some styles have names."""
    styles = draw(STYLES)
    text = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=20)
    names = draw(st.one_of(st.just([]), st.lists(text, min_size=len(styles), max_size=len(styles))))
    sections = {name: draw(any_settings(name)) for name in SECTIONS}
    return GroomSettings(**sections, styles=styles, style_names=names)


GROOMS = grooms()


def write(path, values):
    path.write_text(json.dumps(values), encoding="utf-8")
    return path


def head(**sections):
    """Return a file's values, with some sections."""
    return {"format": settings_file.FORMAT, "version": settings_file.VERSION, **sections}


@given(wanted=GROOMS)
@settings(max_examples=15)
def test_settings_come_back_as_they_went(tmp_path_factory, wanted):
    path = tmp_path_factory.mktemp("settings") / "groom.json"
    settings_file.write(path, wanted)
    assert settings_file.read(path) == wanted


@given(wanted=GROOMS)
@settings(max_examples=15)
def test_what_is_written_keeps_to_the_schema(wanted):
    check(json.loads(json.dumps(settings_file.to_object(wanted))), settings_file.schema())


def check(value, schema):
    """Assert that a value satisfies a JSON Schema, limited to the keywords of ours."""
    known = {"$schema", "title", "description", "default", "type", "required", "additionalProperties", "properties"}
    known |= {"const", "enum", "items", "minItems", "maxItems", "minimum", "exclusiveMinimum", "maximum", "anyOf"}
    assert set(schema) <= known
    if "anyOf" in schema:
        fitting = [s for s in schema["anyOf"] if s["properties"]["kind"]["const"] == value["kind"]]
        return check(value, *fitting)
    kinds = {"object": dict, "array": list, "string": str, "boolean": bool, "integer": int, "number": (int, float)}
    assert isinstance(value, kinds[schema.get("type", "object")]) or "const" in schema
    assert value == schema.get("const", value)
    assert value in schema.get("enum", [value])
    if schema.get("type") == "object":
        assert set(schema.get("required", ())) <= set(value) <= set(schema["properties"])
        for name, inner in value.items():
            check(inner, schema["properties"][name])
    if schema.get("type") == "array":
        assert schema["minItems"] <= len(value) <= schema["maxItems"]
        for inner in value:
            check(inner, schema["items"])
    if schema.get("type") in ("integer", "number"):
        assert schema.get("minimum", -math.inf) <= value <= schema.get("maximum", math.inf)
        assert value > schema.get("exclusiveMinimum", -math.inf)


def test_the_schema_knows_every_setting():
    sections = settings_file.schema()["properties"]
    for name in SECTIONS:
        assert list(sections[name]["properties"]) == [setting for setting, *_ in declared_in(name)]
    named = [setting for name in SECTIONS for setting in sections[name]["properties"]]
    everything = {setting for section in SECTIONS.values() for setting, *_ in declared(section)}
    of_styles = {
        kinds["properties"]["kind"]["const"]: kinds["properties"] for kinds in sections["styles"]["items"]["anyOf"]
    }
    assert {kind: list(found)[2:] for kind, found in of_styles.items()} == {
        kind: [name for name, *_ in declared(settings_class)] for kind, settings_class in KINDS.items()
    }
    # Settings of tables that come from the appearance are stored with the appearance, under its names.
    assert everything - {*named} == {"eta", "sigma_a", "beta_r"}
    pattern = sections["maps"]["items"]["properties"]["setting"]["anyOf"][1]["pattern"]
    varied = [name for found in KINDS.values() for name, _, p in declared(found) if p.may_vary or p.has_course]
    assert all(re.match(pattern, f"styles.Curl.001.{name}") for name in varied)


def test_what_a_file_leaves_out_is_at_its_default(tmp_path):
    assert settings_file.read(write(tmp_path / "a.json", head())) == GroomSettings()
    path = write(tmp_path / "b.json", head(hair={"strand_count": 5}, appearance={"tint": [1, 0, 0.5]}))
    expected = GroomSettings(hair=HairSettings(strand_count=5), appearance=Appearance(tint=(1.0, 0.0, 0.5)))
    assert settings_file.read(path) == expected


def test_styles_of_a_file_are_in_its_order(tmp_path):
    listed = [
        {"kind": "CURL", "radius": 0.004, "name": "Ringlets"},
        {"kind": "FRIZZ"},
        {"kind": "CURL", "is_on": False},
    ]
    read = settings_file.read(write(tmp_path / "a.json", head(styles=listed)))
    assert read.styles == (curl.Settings(radius=0.004), frizz.Settings(), curl.Settings(is_on=False))
    assert read.style_names == ("Ringlets", "", "")


def test_files_without_dynamics_are_read(tmp_path):
    """Files saved before dynamics existed are read with its defaults, or leave it as it is."""
    found = settings_file.to_object(GroomSettings(GuideSettings(seed=4)))
    del found["dynamics"]
    path = write(tmp_path / "a.json", found)
    assert settings_file.read(path) == GroomSettings(GuideSettings(seed=4))
    present = GroomSettings(dynamics=DynamicsSettings(hold=3.0))
    assert settings_file.read_partial(path).changed(present).dynamics == present.dynamics


@given(wanted=GROOMS, present=GROOMS, kept=st.sets(st.sampled_from([*SECTIONS, "styles"])))
@settings(max_examples=15)
def test_what_a_partial_file_leaves_out_stays(tmp_path_factory, wanted, present, kept):
    values = settings_file.to_object(wanted)
    path = tmp_path_factory.mktemp("partial") / "some.json"
    write(path, {name: part for name, part in values.items() if name not in kept})
    changed = settings_file.read_partial(path).changed(present)
    for name in SECTIONS:
        # Settings that follow from the surface are not stored.
        source = present if name in kept else wanted
        names = [setting for setting, *_ in declared_in(name) if getattr(source, name) is not None]
        found, expected = ({n: getattr(getattr(s, name), n) for n in names} for s in (changed, source))
        assert {n: v for n, v in found.items() if expected[n] is not None} == {
            n: v for n, v in expected.items() if v is not None
        }
    assert changed.styles == (present if "styles" in kept else wanted).styles


@pytest.mark.parametrize(
    ("given_styles", "reported"),
    [
        (curl.Settings(), "styles must be a list of styles"),
        ([HairSettings()], "A style must be the settings of a style"),
        ([None], "A style must be the settings of a style, not None"),
        ([curl.Settings()] * 65, "at most 64 styles"),
    ],
)
def test_what_is_no_list_of_styles_is_refused(given_styles, reported):
    with pytest.raises(HairError, match=reported):
        GroomSettings(styles=given_styles)


@pytest.mark.parametrize("names", ["ab", [1], ["a", "b"], ["\0"], None])
def test_names_of_styles_are_as_many_strings(names):
    with pytest.raises(HairError, match="style_names"):
        GroomSettings(styles=[curl.Settings()], style_names=names)


@pytest.mark.parametrize(
    ("values", "reported"),
    [
        (head(styles={}), '"styles" must be a list of styles'),
        (head(styles=[{"kind": "CURL"}, 3]), '"styles[1]" must be a group of settings'),
        (head(styles=[{}]), '"styles[0].kind" must be one of TRIM, CLUMP'),
        (head(styles=[{"kind": "PERM"}]), '"styles[0].kind" must be one of TRIM, CLUMP'),
        (head(styles=[{"kind": ["CURL"]}]), '"styles[0].kind" must be one of TRIM, CLUMP'),
        (head(styles=[{"kind": "CURL", "radios": 1}]), 'unknown setting "styles[0].radios"'),
        (head(styles=[{"kind": "CURL", "radius": "1"}]), '"styles[0].radius" must be a number'),
        (head(styles=[{"kind": "CURL", "radius": -1}]), 'invalid value for "styles[0].radius": Radius must be between'),
        (head(styles=[{"kind": "CLUMP", "levels": 1.5}]), '"styles[0].levels" must be a whole number'),
        (head(styles=[{"kind": "CURL", "name": 1}]), '"styles[0].name" must be a string'),
        (head(styles=[{"kind": "CURL", "name": "a\0"}]), '"styles[0].name" must be a string'),
        (head(styles=[{"kind": "CURL"}] * 65), '"styles" has 65 styles: hair has at most 64'),
        (head(hair={"strand_cuont": 5}), 'unknown setting "hair.strand_cuont"'),
        (head(styling={}), 'unknown section "styling"'),
        (head(hair=[1]), '"hair" must be a group'),
        (head(dynamics={"bend_stifness": 3}), 'unknown setting "dynamics.bend_stifness"'),
        (head(dynamics={"simulates": True}), 'unknown setting "dynamics.simulates"'),
        (head(dynamics={"substeps": 1.5}), '"dynamics.substeps" must be a whole number'),
        (head(dynamics={"hold": -1}), 'invalid value for "dynamics.hold": Hold must be between 0 and 10000'),
        (head(tables={"roughness": 0.3}), 'unknown setting "tables.roughness"'),
        (head(hair={"strand_count": "many"}), '"hair.strand_count" must be a whole number'),
        (head(hair={"strand_count": 5.5}), '"hair.strand_count" must be a whole number'),
        (head(hair={"strand_count": True}), '"hair.strand_count" must be a whole number'),
        (head(hair={"strand_count": 0}), 'invalid value for "hair.strand_count": Strand count must be between'),
        (head(hair={"radius": 10**400}), '"hair.radius" must be a number'),
        (head(hair={"guide_map": 1}), '"hair.guide_map" must be true or false'),
        (head(guides={"density_group": None}), '"guides.density_group" must be a string'),
        (head(appearance={"tint": [1, 1]}), '"appearance.tint" must be a list of 3 numbers'),
        (head(appearance={"tint": [1, 1, 9]}), 'invalid value for "appearance.tint": Tint must be between'),
        (head(appearance={"mode": "magic"}), 'invalid value for "appearance.mode": Marschner variant must be one of'),
        (head() | {"version": 99, "styling": {}}, "was saved by a newer Vellus"),
        (head() | {"version": 0}, "is not a groom settings file"),
        (head() | {"version": "2"}, "is not a groom settings file"),
        ({"version": 1, "melanin": 7}, "is not a groom settings file"),
        ({"name": "something else"}, "is not a groom settings file"),
        ([1, 2], "is not a groom settings file"),
    ],
)
def test_what_is_wrong_is_one_sentence_that_names_file_and_key(tmp_path, values, reported):
    path = write(tmp_path / "groom.json", values)
    with pytest.raises(HairError) as refused:
        settings_file.read(path)
    assert str(path) in str(refused.value) and reported in str(refused.value)
    assert str(refused.value).count("\n") == 0


@pytest.mark.parametrize(
    "content",
    [b"", b"{", b"\xff\xfe", b"[" * 100_000, b'{"version": NaN}', b'{"version": 2, "version": 2}', b" " * 2_000_000],
    ids=["empty", "cut short", "no text", "deep", "no number", "twice", "large"],
)
def test_what_is_no_json_is_refused(tmp_path, content):
    path = tmp_path / "groom.json"
    path.write_bytes(content)
    with pytest.raises(HairError, match=r"groom\.json"):
        settings_file.read(path)


def test_a_folder_a_pipe_and_nothing_are_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path, tmp_path / "pipe", tmp_path / "missing.json"):
        with pytest.raises(HairError, match="is not a file"):
            settings_file.read(path)


def test_a_file_that_cannot_be_replaced_stays(tmp_path):
    (tmp_path / "groom.json").mkdir()
    with pytest.raises(HairError, match="cannot be written"):
        settings_file.write(tmp_path / "groom.json", GroomSettings())
    assert [path.name for path in tmp_path.iterdir()] == ["groom.json"]


def test_settings_of_a_file_are_what_the_stages_take(tmp_path):
    settings_file.write(tmp_path / "groom.json", GroomSettings(replace(GuideSettings(), guide_count=9)))
    assert settings_file.read(tmp_path / "groom.json").guides.guide_count == 9


def test_maps_are_a_list_of_one_for_each_setting(tmp_path):
    """Maps are read as they were written, with the keys name, from and to; two maps of a setting are refused."""
    one = MapSettings(setting="look.melanin", kind="GROUP", source="dark", low=0.2, high=0.9)
    settings = settings_file.GroomSettings(maps=(one,))
    settings_file.write(tmp_path / "maps.json", settings)
    written = settings_file.to_object(settings)["maps"][0]
    assert (written["name"], written["from"], written["to"]) == ("dark", 0.2, 0.9)
    assert settings_file.read(tmp_path / "maps.json") == settings
    with pytest.raises(HairError, match="one map"):
        settings_file.GroomSettings(maps=(one, one))
    with pytest.raises(HairError, match="No map can vary"):
        settings_file.GroomSettings(maps=[MapSettings(setting="look.ior")])


def test_the_thickness_curve_is_text(tmp_path):
    """A file has the curve's text only if there is one; colors, numbers and other text are refused with the key."""
    assert "thickness_curve" not in settings_file.to_object(settings_file.GroomSettings())
    settings = settings_file.GroomSettings(thickness_curve="0:1 0.5:0.3 1:0.2")
    settings_file.write(tmp_path / "curve.json", settings)
    assert settings_file.read(tmp_path / "curve.json") == settings
    assert settings_file.read_partial(tmp_path / "curve.json").changed(settings_file.GroomSettings()) == settings
    for wrong in (1, [0, 1], "wide", "0:1/0/0"):
        found = {"format": settings_file.FORMAT, "version": 1, "thickness_curve": wrong}
        with pytest.raises(HairError, match="thickness_curve"):
            settings_file.from_object(found, "curve.json")
