# SPDX-License-Identifier: GPL-3.0-or-later
"""Every string of the interface is in every dictionary, with the same placeholders, and nothing else."""

import itertools
import random
import re
import string

import bpy
import numpy as np
import pytest

from hair_addon.blender.data import scene
from hair_addon.blender.data.strands import style_inputs
from hair_addon.blender.groom import pipeline
from hair_addon.blender.host import paths
from hair_addon.blender.settings import translations
from hair_addon.core.errors import HairError
from hair_addon.core.geometry import sampling
from hair_addon.core.geometry.mesh import TriMesh, check_mesh
from tests.support.interface import interface_strings
from tests.support.interface.layout import draw

LANGUAGES = translations.dictionaries()


def fields(sentence):
    """Return the fields of a message and their formats."""
    return sorted((name, form) for _, name, form, _ in string.Formatter().parse(sentence) if name is not None)


@pytest.mark.parametrize("locale", LANGUAGES)
def test_every_string_is_translated(locale):
    wanted = interface_strings.strings_of_classes() | interface_strings.strings_of_sources()
    missing = {text: where for text, where in wanted.items() if text not in LANGUAGES[locale]}
    assert not missing, f"give these their lines in languages/{locale}.po: {missing}"


@pytest.mark.parametrize("locale", LANGUAGES)
def test_dictionaries_have_no_unused_strings(locale):
    sources = "".join(path.read_text(encoding="utf-8") for path in interface_strings.ADDON.rglob("*.py"))
    wanted = interface_strings.strings_of_classes() | interface_strings.strings_of_sources()
    quoted = sources.replace('\\"', '"')
    assert [text for text in LANGUAGES[locale] if text not in wanted and text not in quoted] == []


@pytest.mark.parametrize("locale", LANGUAGES)
def test_translations_keep_placeholders(locale):
    for msgid, msgstr in LANGUAGES[locale].items():
        assert msgstr and fields(msgid) == fields(msgstr), msgid


def test_labels_have_the_translation_context_of_vellus():
    """Labels have the translation context of Vellus, as guides in Blender's dictionaries are lines that help to
    draw.
    """
    for cls in interface_strings.blender.CLASSES:
        if issubclass(cls, (bpy.types.Operator, bpy.types.Panel, bpy.types.Menu)):
            assert cls.bl_translation_context == translations.CONTEXT, cls
        for entry in interface_strings.properties_of(cls):
            if not entry.is_hidden and entry.name != entry.identifier:
                assert entry.translation_context == translations.CONTEXT, (cls, entry.identifier)


def test_an_error_keeps_its_sentence_apart_from_its_values(monkeypatch):
    error = HairError('"{name}" is linked: make a library override.', name="Head {1}")
    assert str(error) == '"Head {1}" is linked: make a library override.'
    assert translations.error_text(error) == str(error)  # Blender speaks English here
    german = LANGUAGES["de_DE"]
    monkeypatch.setattr(translations, "pgettext_rpt", lambda sentence, _context: german[sentence])
    assert translations.error_text(error) == "„Head {1}“ ist verknüpft: Erstellen Sie einen Bibliotheks-Override."


@pytest.fixture
def german(monkeypatch):
    """Return {msgid: msgstr} while Blender translates by it, as its interface has no language in background mode."""
    texts = LANGUAGES["de_DE"]
    for name in ("pgettext_iface", "pgettext_rpt"):
        monkeypatch.setattr(translations, name, lambda sentence, _context: texts.get(sentence, sentence))
    return texts


def test_a_stored_sentence_is_translated_as_it_was_raised(german):
    """A stored error is translated like a raised one: hair stores it in English with its values."""
    reported = {}  # sentence → translations: some sentences differ in the names of their values alone
    for msgid, msgstr in german.items():
        values = {name: 7 if form else f"Head {i}" for i, (name, form) in enumerate(fields(msgid))}
        reported.setdefault(msgid.format(**values), set()).add(msgstr.format(**values))
    assert [sentence for sentence, texts in reported.items() if translations.status_text(sentence) not in texts] == []


def test_a_stored_sentence_of_nobody_is_shown_as_it_is(german):
    assert translations.status_text("Something {else} went wrong.") == "Something {else} went wrong."


def test_values_are_as_long_as_they_may_be(german):
    """Values in messages are found to be as long as by a greedy regular expression, which would take hours for a
    hostile status.
    """
    texts = ("a", "b", ": ", '"', " ", "of ", "x")
    sentences = [sentence for sentence, _words, _names in translations._patterns()][:40]
    generator = random.Random(5)
    for sentence in sentences:
        pattern, names = "", set()
        for words, name, _form, _conversion in string.Formatter().parse(sentence):
            pattern += re.escape(words)
            if name:
                pattern += f"(?P={name})" if name in names else f"(?P<{name}>.*)"
                names.add(name)
        words, held = next(entry[1:] for entry in translations._patterns() if entry[0] == sentence)
        for _try in range(5):
            values = {name: "".join(generator.choices(texts, k=4)) for name in names}
            status = "".join(w + values.get(n, "") for w, n in itertools.zip_longest(words, held, fillvalue=""))
            expected = re.fullmatch(pattern, status, re.DOTALL)
            found = translations._values_between(words, held, status)
            assert found == (expected and expected.groupdict()) or len(names) < len(held), (sentence, status)


class Counted(str):
    """A text that counts the characters that are searched in it."""

    searched = 0

    def rfind(self, words, first, end):
        Counted.searched += max(end - first, 0)
        return super().rfind(words, first, end)


@pytest.mark.parametrize("repeated", ['": ', "of ", '"', "x"])
def test_a_hostile_status_is_searched_once_for_each_word_of_a_sentence(repeated):
    status = Counted(repeated * (30_000 // len(repeated)))
    for _sentence, words, names in translations._patterns():
        for around in (words, ["", *words[1:-1], ""]):  # as if its ends fitted
            Counted.searched = 0
            translations._values_between(around, names, status)
            assert Counted.searched <= len(names) * len(status)


def test_a_panel_shows_the_beginning_of_a_hostile_status(hair):
    hair.data.vellus.status = 'of ": ' * 5000
    assert len("".join(draw(bpy.types.VELLUS_PT_interpolation).texts)) < 3000


def lost_guides(hair):
    hair.data.vellus.guide_curves = None
    pipeline.inputs_of(hair.data)


def flat(sphere):
    sphere.scale = (0.0, 1.0, 1.0)
    bpy.context.view_layer.update()
    scene.read_surface(sphere, bpy.context.evaluated_depsgraph_get())


def mesh_of(*vertices):
    return TriMesh(np.array(vertices, np.float32), np.array([[0, 1, 2]], np.int32))


REFUSALS = {
    "a lost vertex group": lambda hair: scene.read_vertex_group(
        hair.data.surface, bpy.context.evaluated_depsgraph_get(), "lost"
    ),
    "a scale of zero": lambda hair: flat(hair.data.surface),
    "hair without guides": lost_guides,
    "a style's lost object": lambda _hair: style_inputs._matrix_of("lost", "Trim"),
    "a path beside no file": lambda _hair: paths.resolve("//folder"),
    "vertices without a place": lambda _hair: check_mesh(mesh_of((0, 0, 0), (1, 0, 0), (0, np.nan, 0))),
    "a surface out of reach": lambda _hair: check_mesh(mesh_of((0, 0, 0), (1e20, 0, 0), (0, 1, 0))),
    "a negative density": lambda _hair: sampling.check_density(
        mesh_of((0, 0, 0), (1, 0, 0), (0, 1, 0)), np.array([1.0, -1.0, 1.0])
    ),
}


@pytest.mark.parametrize("refusal", REFUSALS)
def test_refusals_with_values_are_translated(hair, monkeypatch, request, refusal):
    with pytest.raises(HairError) as caught:
        REFUSALS[refusal](hair)
    german = request.getfixturevalue("german")
    reported = translations.error_text(caught.value)
    assert reported != str(caught.value) and reported == german[caught.value.sentence].format(**caught.value.values)
    assert translations.status_text(str(caught.value)) == reported


def test_a_sentence_with_braces_and_no_values_is_left_alone():
    assert str(HairError("{} is no file")) == "{} is no file"
    assert translations.error_text(HairError("{} is no file")) == "{} is no file"
