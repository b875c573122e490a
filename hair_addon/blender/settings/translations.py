# SPDX-License-Identifier: GPL-3.0-or-later
"""Translation of the interface into Blender's language.

Blender translates labels and tooltips of properties and classes by itself; sentences with values in them come from
here. languages/ has a dictionary for each language, in gettext's format.
"""

import json
import string
import sys
from functools import lru_cache
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface, pgettext_rpt

from ...core.errors import HairError
from ...core.params import is_text

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


def status_text(status):
    """Translate a sentence that is stored in English with its values in it, as what is wrong with hair."""
    sentence, values = _taken_apart(status)
    text = interface_text(sentence)
    return _Stored().format(text, **values) if values else text


class _Stored(string.Formatter):
    """Fills in values that are texts already."""

    def format_field(self, value, _form):
        return value


@lru_cache(maxsize=64)  # panels ask with every redraw
def _taken_apart(status):
    """(sentence, {name: text}) of a status, of the sentence that has most words of its own; (status, {}) of none."""
    if status in _sentences():
        return status, {}
    for sentence, words, names in _patterns():
        values = _values_between(words, names, status)
        if values is not None:
            return sentence, values
    return status, {}


def _values_between(words, names, status):
    """{name: text} of a sentence with values that a status is; None where it is another.

    words: around its values, in turn; names: of these. Each value is as long as it may be, those before others first:
    so words are looked for from the end, which takes a hostile status no longer than its length.
    """
    if not (status.startswith(words[0]) and status.endswith(words[-1])):
        return None
    first, end, texts = len(words[0]), len(status) - len(words[-1]), []
    for some in reversed(words[1:-1]):
        place = status.rfind(some, first, end)
        if place < 0:
            return None
        texts.append(status[place + len(some) : end])
        end = place
    if end < first:
        return None
    texts.append(status[first:end])
    values = {}
    for name, text in zip(names, reversed(texts), strict=True):
        if values.setdefault(name, text) != text:  # it stands there twice
            return None
    return values


@lru_cache(maxsize=1)
def _sentences():
    return {sentence for texts in dictionaries().values() for sentence in texts}


@lru_cache(maxsize=1)
def _patterns():
    """[(sentence, words around its values, names of these)] of all with values, those with most words first."""
    found = []
    for sentence in _sentences():
        words, names = [""], []
        for some, name, _form, _conversion in string.Formatter().parse(sentence):
            words[-1] += some
            if name:
                names.append(name)
                words.append("")
        if names:
            found.append((-sum(map(len, words)), sentence, words, names))
    return [tuple(rest) for _length, *rest in sorted(found, key=lambda entry: entry[:2])]


def _filled(sentence, values):
    return sentence.format(**values) if values else sentence


def read_po(path):
    """{msgid: msgstr} of a .po file with one line for each; strings are written as in C, which JSON reads.

    Raises `HairError`.
    """
    texts, msgid = {}, ""
    try:
        for line in path.read_text(encoding="utf-8").splitlines():
            kind, _, quoted = line.partition(" ")
            if kind == "msgid":
                msgid = _text(quoted)
            elif kind == "msgstr":
                texts[msgid] = _text(quoted)
    except (OSError, ValueError, RecursionError) as error:
        raise HairError("{path} cannot be read: {cause}.", path=path, cause="it is damaged") from error
    return texts


def _text(quoted):
    text = json.loads(quoted)
    if not isinstance(text, str) or not is_text(text):
        raise ValueError(quoted)
    return text


def dictionaries():
    """{locale: {msgid: msgstr}} of all languages whose files can be read; the others are told of on the console."""
    found = {}
    for path in (Path(__file__).parent / "languages").glob("*.po"):
        try:
            found[path.stem] = read_po(path)
        except HairError as error:
            print(f"Vellus: {error}", file=sys.stderr)
    return found


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
