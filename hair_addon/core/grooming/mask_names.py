# SPDX-License-Identifier: GPL-3.0-or-later
"""Names by which artists call the vertex group that hair grows in, in several languages."""

import re
import unicodedata
from collections.abc import Iterable

# The first that is there is taken: what is on a head comes before what is on a face.
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
    """The name that says most clearly that hair grows there: `scalp`, `Head_Hair`, `Kopfhaar.001`; empty for none."""
    ranked = [(rank, place, name) for place, name in enumerate(names) if (rank := _rank(name)) is not None]
    return min(ranked)[2] if ranked else ""


def _rank(name):
    words = _words_of(name)
    if _NOT & set(words):
        return None
    return min((_RANKS[word] for word in words if word in _RANKS), default=None)


def _words_of(name):
    """The words of a name without marks above letters: `HeadHair_L` gives head, hair and l."""
    return re.findall(r"[^\W\d_]+", _plain(re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)))


def _plain(text):
    letters = unicodedata.normalize("NFKD", text.casefold())
    return "".join(letter for letter in letters if not unicodedata.combining(letter)).replace("ł", "l")


_RANKS = {_plain(word): rank for rank, word in reversed(list(enumerate(_WORDS)))}
