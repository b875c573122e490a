# SPDX-License-Identifier: GPL-3.0-or-later
"""Random changes of files, as by accidents or attackers."""

import re

_WORD = re.compile(rb"-?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?|\"[^\"\n]*\"|true|false|null")
_WORDS = (
    *(b"0", b"-1", b"1", b"255", b"2147483648", b"-9223372036854775809", b"9" * 400, b"9" * 5000, b"1e30", b"1e999"),
    *(b"NaN", b"Infinity", b"-Infinity", b"null", b"true", b"[]", b"{}", b'""', b'"\\ud800"', b'"\\u0000"', b"[1, 2]"),
    *(b'{"a": 1}', b"[" * 2000, b'"' + b"\xc3\xa4" * 300 + b'"', b'"../../x"', b"\xff\xfe"),
)
_NUMBERS = (0, 1, 2**15, 2**16 - 1, 2**31 - 1, 2**31, 2**32 - 1, 2**63 - 1, 2**64 - 1)


def mutated(data, source, is_text=False):
    """Return bytes with one to eight changes; source: a `random.Random`; is_text: whether to swap words too."""
    data = bytearray(data)
    for _ in range(source.choice((1, 1, 1, 2, 3, 8))):
        if not data:
            break
        if is_text and source.random() < 0.5:
            _exchange_word(data, source)
        else:
            _change(data, source)
    return bytes(data)


def _change(data, source):
    place, kind = source.randrange(len(data)), source.randrange(8)
    if kind == 0:
        data[place] ^= 1 << source.randrange(8)
    elif kind == 1:
        data[place] = source.choice((0, 1, 0x7F, 0x80, 0xFF, source.randrange(256)))
    elif kind == 2:
        size = source.choice((2, 4, 8))
        number = source.choice(_NUMBERS) % 2 ** (8 * size)
        data[place : place + size] = number.to_bytes(size, source.choice(("little", "big")))
    elif kind == 3:
        del data[place : place + source.randrange(1, 20)]
    elif kind == 4:
        data[place:place] = data[source.randrange(len(data)) :][: source.randrange(1, 20)]
    elif kind == 5:
        start = source.randrange(len(data))
        part = data[start : start + source.randrange(1, 64)]
        data[place : place + len(part)] = part
    elif kind == 6:
        del data[place:]
    else:
        data[place : place + 32] = bytes(len(data[place : place + 32]))


def _exchange_word(data, source):
    words = list(_WORD.finditer(data))
    if words:
        word = source.choice(words)
        data[word.start() : word.end()] = source.choice((*_WORDS, source.choice(words)[0]))
