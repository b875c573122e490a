# SPDX-License-Identifier: GPL-3.0-or-later
"""Translation of the interface into Blender's language.

Blender translates labels and tooltips of properties and classes itself; this module translates sentences with values.
languages/ has a dictionary for each language, in gettext's format.
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

# Own context: in Blender's dictionary, which is searched first, "Guides" are drawing guides.
CONTEXT = "Vellus"

_NAME = __package__  # identifier of our dictionaries in Blender


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
    """Translate a status that is stored in English with its values filled in."""
    sentence, values = _taken_apart(status)
    text = interface_text(sentence)
    return _Stored().format(text, **values) if values else text


class _Stored(string.Formatter):
    """A formatter for values that are strings already."""

    def format_field(self, value, _form):
        return value


@lru_cache(maxsize=64)  # panels call this with every redraw
def _taken_apart(status):
    """Split a status into (sentence, {name: text}) of the longest matching sentence; (status, {}) without a match."""
    if status in _sentences():
        return status, {}
    for sentence, words, names in _patterns():
        values = _values_between(words, names, status)
        if values is not None:
            return sentence, values
    return status, {}


def _values_between(words, names, status):
    """Return {name: text} of the values of a sentence in a status; None if the status does not match.

    words: texts around the values, in order; names: of the values. Values match greedily from the left, so words are
    searched from the end, in linear time even for a hostile status.
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
        if values.setdefault(name, text) != text:  # a name may occur twice
            return None
    return values


@lru_cache(maxsize=1)
def _sentences():
    return {sentence for texts in dictionaries().values() for sentence in texts}


@lru_cache(maxsize=1)
def _patterns():
    """Return [(sentence, texts around its values, names of the values)], sentences with the longest texts first."""
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
    """Read {msgid: msgstr} of a .po file with one line each; its C strings are parsed as JSON.

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
    """Return {locale: {msgid: msgstr}} of all readable languages; errors of others are printed to the console."""
    found = {}
    for path in (Path(__file__).parent / "languages").glob("*.po"):
        try:
            found[path.stem] = read_po(path)
        except HairError as error:
            print(f"Vellus: {error}", file=sys.stderr)
    return found


def register():
    """Register translations; Blender looks up tooltips without a context, and some buttons in that of operators."""
    entries = {
        locale: {(context, msgid): text for msgid, text in texts.items() for context in ("*", "Operator", CONTEXT)}
        for locale, texts in dictionaries().items()
    }
    bpy.app.translations.register(_NAME, entries)


def unregister():
    """Unregister the translations."""
    bpy.app.translations.unregister(_NAME)
