# SPDX-License-Identifier: GPL-3.0-or-later
"""Groom settings as a file: they come back as they went, and what is wrong with a file is said in one sentence."""

import json
import math
import os
from dataclasses import asdict, replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hair_addon.core.errors import HairError
from hair_addon.core.files import settings_file
from hair_addon.core.files.settings_file import SECTIONS, GroomSettings, declared_in
from hair_addon.core.grooming.groom import GuideSettings, HairSettings
from hair_addon.core.params import declared
from hair_addon.core.shading.appearance import Appearance
from hair_addon.core.shading.presets import PRESETS


def values_of(default, details):
    """Values that a setting may have."""
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


GROOMS = st.builds(GroomSettings, **{name: any_settings(name) for name in SECTIONS})


def write(path, values):
    path.write_text(json.dumps(values), encoding="utf-8")
    return path


def head(**sections):
    """A file's values, with some sections."""
    return {"format": settings_file.FORMAT, "version": settings_file.VERSION, **sections}


@given(wanted=GROOMS)
@settings(max_examples=100)
def test_settings_come_back_as_they_went(tmp_path_factory, wanted):
    path = tmp_path_factory.mktemp("settings") / "groom.json"
    settings_file.write(path, wanted)
    assert settings_file.read(path) == wanted


@given(wanted=GROOMS)
@settings(max_examples=30)
def test_what_is_written_keeps_to_the_schema(wanted):
    check(json.loads(json.dumps(settings_file.to_object(wanted))), settings_file.schema())


def check(value, schema):
    """Assert that a value keeps to a JSON Schema, of the words that ours is written in."""
    known = {"$schema", "title", "description", "default", "type", "required", "additionalProperties", "properties"}
    known |= {"const", "enum", "items", "minItems", "maxItems", "minimum", "exclusiveMinimum", "maximum"}
    assert set(schema) <= known
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
    # What tables take from the appearance stands there, under the names that it has there.
    assert everything - {*named} == {"eta", "sigma_a", "beta_r"}


def test_what_a_file_leaves_out_is_at_its_default(tmp_path):
    assert settings_file.read(write(tmp_path / "a.json", head())) == GroomSettings()
    path = write(tmp_path / "b.json", head(hair={"strand_count": 5}, appearance={"tint": [1, 0, 0.5]}))
    expected = GroomSettings(hair=HairSettings(strand_count=5), appearance=Appearance(tint=(1.0, 0.0, 0.5)))
    assert settings_file.read(path) == expected


def test_a_look_as_it_was_saved_alone_is_read(tmp_path):
    look = PRESETS["GINGER"][1]
    path = write(tmp_path / "look.json", {"version": 1, **asdict(look)})
    assert settings_file.read(path) == GroomSettings(appearance=look)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        (head(hair={"strand_cuont": 5}), 'unknown setting "hair.strand_cuont"'),
        (head(styling={}), 'unknown section "styling"'),
        (head(hair=[1]), '"hair" must be a group'),
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
        ({"version": 1, "melanin": 7}, 'invalid value for "appearance.melanin"'),
        ({"name": "something else"}, "is not a groom settings file"),
        ([1, 2], "is not a groom settings file"),
    ],
)
def test_what_is_wrong_is_one_sentence_that_names_file_and_key(tmp_path, values, said):
    path = write(tmp_path / "groom.json", values)
    with pytest.raises(HairError) as refused:
        settings_file.read(path)
    assert str(path) in str(refused.value) and said in str(refused.value)
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
