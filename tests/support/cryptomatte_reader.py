# SPDX-License-Identifier: GPL-3.0-or-later
"""A reader of Cryptomatte files, written from the specification [Friedman15], without the add-on's code."""

import json
import struct
from itertools import pairwise

import numpy as np
import OpenEXR


def name_number(name):
    """Return the float32 that stands for a name: MurmurHash3 with seed 0, made a normal number."""
    data = name.encode()
    blocks = struct.unpack(f"<{len(data) // 4}I", data[: len(data) // 4 * 4])
    h = np.uint64(0)
    mask = np.uint64(0xFFFFFFFF)

    def rotated(value, bits):
        return ((value << np.uint64(bits)) | (value >> np.uint64(32 - bits))) & mask

    def scrambled(k):
        return (rotated((np.uint64(k) * np.uint64(0xCC9E2D51)) & mask, 15) * np.uint64(0x1B873593)) & mask

    for block in blocks:
        h = (rotated(h ^ scrambled(block), 13) * np.uint64(5) + np.uint64(0xE6546B64)) & mask
    tail = data[len(blocks) * 4 :]
    h ^= scrambled(sum(byte << 8 * place for place, byte in enumerate(tail)))
    h ^= np.uint64(len(data))
    for shift, factor in ((16, 0x85EBCA6B), (13, 0xC2B2AE35), (16, 1)):
        h = ((h ^ (h >> np.uint64(shift))) * np.uint64(factor)) & mask
    bits = int(h)
    if bits >> 23 & 255 in (0, 255):
        bits ^= 1 << 23
    return struct.unpack("<f", struct.pack("<I", bits))[0]


def mattes(path, layer):
    """Return {name: (height, width) coverage} of a layer such as "ViewLayer.CryptoObject", first row at the bottom.

    Names come from the manifest; asserts that numbers in the file are those of names, and the conversion's name.
    """
    with OpenEXR.File(str(path), separate_channels=True) as file:
        header = dict(file.parts[0].header)
        channels = {n: np.array(c.pixels, np.float32)[::-1] for part in file.parts for n, c in part.channels.items()}
    keys = [name.rpartition("/")[0] for name, text in header.items() if name.endswith("/name") and text == layer]
    (key,) = keys
    assert header[f"{key}/hash"] == "MurmurHash3_32" and header[f"{key}/conversion"] == "uint32_to_float32"
    manifest = json.loads(header[f"{key}/manifest"])
    ranks = [
        (channels[f"{name}.{number}"], channels[f"{name}.{coverage}"])
        for name in sorted({channel.rpartition(".")[0] for channel in channels if channel.startswith(layer)})
        for number, coverage in (("R", "G"), ("B", "A"))
    ]
    found = {}
    for name, bits in manifest.items():
        number = np.float32(name_number(name))
        assert number.view(np.uint32) == int(bits, 16)
        found[name] = sum((np.where(numbers == number, cover, 0.0) for numbers, cover in ranks), np.float32(0.0))
    known = np.float32([0.0, *(name_number(name) for name in manifest)])
    assert all(np.isin(numbers, known).all() for numbers, _cover in ranks)
    for (_, higher), (_, lower) in pairwise(ranks):
        assert (higher >= lower).all()  # ranks are sorted
    return found
