# SPDX-License-Identifier: GPL-3.0-or-later
"""Every string that an artist reads is in every dictionary, with the same values in it, and nothing else is."""

import string

import bpy
import pytest

from hair_addon.blender.settings import translations
from hair_addon.core.errors import HairError
from tests.support.interface import spoken

LANGUAGES = translations.dictionaries()


def fields(sentence):
    """What is filled into a sentence, and how."""
    return sorted((name, form) for _, name, form, _ in string.Formatter().parse(sentence) if name is not None)


@pytest.mark.parametrize("locale", LANGUAGES)
def test_every_string_is_translated(locale):
    wanted = spoken.strings_of_classes() | spoken.strings_of_sources()
    missing = {text: where for text, where in wanted.items() if text not in LANGUAGES[locale]}
    assert not missing, f"give these their lines in languages/{locale}.po: {missing}"


@pytest.mark.parametrize("locale", LANGUAGES)
def test_dictionaries_have_no_unused_strings(locale):
    sources = "".join(path.read_text(encoding="utf-8") for path in spoken.ADDON.rglob("*.py"))
    wanted = spoken.strings_of_classes() | spoken.strings_of_sources()
    quoted = sources.replace('\\"', '"')
    assert [text for text in LANGUAGES[locale] if text not in wanted and text not in quoted] == []


@pytest.mark.parametrize("locale", LANGUAGES)
def test_translations_keep_placeholders(locale):
    for msgid, msgstr in LANGUAGES[locale].items():
        assert msgstr and fields(msgid) == fields(msgstr), msgid


def test_labels_have_the_translation_context_of_vellus():
    """In Blender's own dictionaries guides are lines that help to draw."""
    for cls in spoken.blender.CLASSES:
        if issubclass(cls, (bpy.types.Operator, bpy.types.Panel, bpy.types.Menu)):
            assert cls.bl_translation_context == translations.CONTEXT, cls
        for entry in spoken.properties_of(cls):
            if not entry.is_hidden and entry.name != entry.identifier:
                assert entry.translation_context == translations.CONTEXT, (cls, entry.identifier)


def test_an_error_keeps_its_sentence_apart_from_its_values(monkeypatch):
    error = HairError('"{name}" is linked: make a library override.', name="Head {1}")
    assert str(error) == '"Head {1}" is linked: make a library override.'
    assert translations.error_text(error) == str(error)  # Blender speaks English here
    german = LANGUAGES["de_DE"]
    monkeypatch.setattr(translations, "pgettext_rpt", lambda sentence, _context: german[sentence])
    assert translations.error_text(error) == "„Head {1}“ ist verknüpft: Erstellen Sie einen Bibliotheks-Override."


def test_a_sentence_with_braces_and_no_values_is_left_alone():
    assert str(HairError("{} is no file")) == "{} is no file"
    assert translations.error_text(HairError("{} is no file")) == "{} is no file"
