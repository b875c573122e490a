# SPDX-License-Identifier: GPL-3.0-or-later
"""Translation of the interface into Blender's language.

Blender translates labels and tooltips of properties and classes by itself; sentences with values in them come from
here. languages/ has a dictionary for each language, in gettext's format.
"""

import json
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface, pgettext_rpt

# A context of our own: in Blender "Guides" are drawing guides, and its dictionary is searched first.
CONTEXT = "Vellus"

_NAME = __package__  # under which Blender keeps our dictionaries


def interface_text(sentence, **values):
    """Translate a label with values."""
    return _filled(pgettext_iface(sentence, CONTEXT), values)


def report_text(sentence, **values):
    """Translate an operator's report."""
    return _filled(pgettext_rpt(sentence, CONTEXT), values)


def error_text(error):
    """Translate a `HairError`."""
    return report_text(error.sentence, **error.values)


def _filled(sentence, values):
    return sentence.format(**values) if values else sentence


def read_po(path):
    """{msgid: msgstr} of a .po file with one line for each; strings are written as in C, which JSON reads."""
    texts, msgid = {}, ""
    for line in path.read_text(encoding="utf-8").splitlines():
        kind, _, quoted = line.partition(" ")
        if kind == "msgid":
            msgid = json.loads(quoted)
        elif kind == "msgstr":
            texts[msgid] = json.loads(quoted)
    return texts


def dictionaries():
    """{locale: {msgid: msgstr}} of all languages."""
    return {path.stem: read_po(path) for path in (Path(__file__).parent / "languages").glob("*.po")}


def register():
    """Offer our translations to Blender: tooltips are looked up in no context, some buttons in that of operators."""
    entries = {
        locale: {(context, msgid): text for msgid, text in texts.items() for context in ("*", "Operator", CONTEXT)}
        for locale, texts in dictionaries().items()
    }
    bpy.app.translations.register(_NAME, entries)


def unregister():
    """Take them away again."""
    bpy.app.translations.unregister(_NAME)
