# SPDX-License-Identifier: GPL-3.0-or-later
"""Common names, in several languages, of the vertex group that hair grows in."""

import re
import unicodedata
from collections.abc import Iterable

# In order of preference: hair of the head comes before facial hair.
_WORDS = (
    *(
        "scalp",
        "kopfhaut",
        "chevelu",
        "cabelludo",
        "cabeludo",
        "capelluto",
        "hoofdhuid",
        "скальп",
        "skalp",
        "頭皮",
        "头皮",
    ),
    *("hair", "hairs", "hairmask", "haircap", "haar", "haare", "kopfhaar", "kopfhaare", "cheveux", "cabello", "pelo"),
    *("cabelo", "capelli", "wlosy", "волосы", "har", "hår", "頭髮", "头发", "髪", "머리카락"),
    *("fur", "fell", "fourrure", "pelage", "pelaje", "pelliccia", "pelo", "vacht", "futro", "мех", "шерсть", "毛"),
    *("mane", "mahne", "criniere", "crin", "criniera", "beard", "bart", "barbe", "barba", "baard", "broda", "борода"),
    *("ひげ", "胡子", "moustache", "mustache", "schnurrbart", "bigote", "baffi", "stubble", "stoppeln"),
    *("eyebrow", "eyebrows", "brow", "brows", "augenbrauen", "brauen", "sourcils", "cejas", "sopracciglia", "brwi"),
    *("брови", "眉", "眉毛", "eyelash", "eyelashes", "lashes", "wimpern", "cils", "pestanas", "ciglia", "睫毛"),
)
_NOT = {"no", "not", "non", "without", "ohne", "kein", "keine", "sans", "sin", "senza", "less", "bald", "glatze"}


def suggested(names: Iterable[str]) -> str:
    """Return the name that most likely denotes hair, such as `scalp`, `Head_Hair`, `Kopfhaar.001`; "" for none."""
    ranked = [(rank, place, name) for place, name in enumerate(names) if (rank := _rank(name)) is not None]
    return min(ranked)[2] if ranked else ""


def _rank(name):
    words = _words_of(name)
    if _NOT & set(words):
        return None
    return min((_RANKS[word] for word in words if word in _RANKS), default=None)


def _words_of(name):
    """Return the lowercase words of a name without diacritics: `HeadHair_L` gives head, hair and l."""
    return re.findall(r"[^\W\d_]+", _plain(re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)))


def _plain(text):
    letters = unicodedata.normalize("NFKD", text.casefold())
    return "".join(letter for letter in letters if not unicodedata.combining(letter)).replace("ł", "l")


_RANKS = {_plain(word): rank for rank, word in reversed(list(enumerate(_WORDS)))}
