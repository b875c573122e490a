# SPDX-License-Identifier: GPL-3.0-or-later
"""Cryptomatte [Friedman15]: hashes of names as numbers, and the coverage of each pixel by objects with these numbers.

Mattes are labels (…, M) int32, 0 for no object, with coverages (…, M) float32, largest first.
"""

import json
from collections.abc import Mapping, Sequence

import numpy as np

_WORD = 0xFFFFFFFF


def name_hash(name: str) -> int:
    """Return the 32-bit hash of a name: MurmurHash3_x86_32 [Appleby08] of its UTF-8 text, with seed 0."""
    data, value = name.encode("utf-8"), 0
    whole = len(data) // 4 * 4
    for place in range(0, whole, 4):
        value ^= _mixed(int.from_bytes(data[place : place + 4], "little"))
        value = (_turned(value, 13) * 5 + 0xE6546B64) & _WORD
    if whole < len(data):
        value ^= _mixed(int.from_bytes(data[whole:], "little"))
    value ^= len(data)
    value = ((value ^ value >> 16) * 0x85EBCA6B) & _WORD
    value = ((value ^ value >> 13) * 0xC2B2AE35) & _WORD
    return value ^ value >> 16


def _mixed(word):
    return _turned(word * 0xCC9E2D51 & _WORD, 15) * 0x1B873593 & _WORD


def _turned(word, count):
    return (word << count | word >> 32 - count) & _WORD


def hash_numbers(hashes: Sequence[int]) -> np.ndarray:
    """Return hashes as float32 with the same bits; one bit is flipped if the result is not a normal number."""
    bits = np.array(hashes, np.uint32)
    exponents = bits >> np.uint32(23) & np.uint32(255)
    return np.where((exponents == 0) | (exponents == 255), bits ^ np.uint32(1 << 23), bits).view(np.float32)


def metadata(layer: str, names: Sequence[str]) -> dict[str, str]:
    """Return the metadata of a file, with the manifest of names, for a layer such as "ViewLayer.CryptoObject"."""
    start = f"cryptomatte/{name_hash(layer):08x}"[: len("cryptomatte/") + 7]
    manifest = {name: f"{bits:08x}" for name in names for bits in [int(hash_numbers([name_hash(name)]).view("u4")[0])]}
    values = {
        "name": layer,
        "hash": "MurmurHash3_32",
        "conversion": "uint32_to_float32",
        "manifest": json.dumps(manifest, ensure_ascii=False, separators=(",", ":")),
    }
    return {f"{start}/{key}": value for key, value in values.items()}


def combined(labels: np.ndarray, coverages: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return mattes (N, count) in which each label occurs once, with the sum of its coverages.

    labels, coverages: (N, M), in any order. Labels with the smallest coverages are dropped.
    """
    row_count, width = labels.shape
    order = np.argsort(labels, axis=1, kind="stable")
    labels = np.take_along_axis(labels, order, axis=1)
    coverages = np.where(labels > 0, np.take_along_axis(coverages, order, axis=1), 0.0)
    group = np.zeros(labels.shape, np.int64)
    group[:, 1:] = np.cumsum(labels[:, 1:] != labels[:, :-1], axis=1)
    group += width * np.arange(row_count)[:, None]
    sums = np.bincount(group.ravel(), coverages.ravel(), row_count * width).reshape(row_count, width)
    found = np.zeros(row_count * width, labels.dtype)
    found[group.ravel()] = labels.ravel()
    found = found.reshape(row_count, width)
    order = np.argsort(-sums, axis=1, kind="stable")[:, :count]
    sums = np.take_along_axis(sums, order, axis=1).astype(np.float32)
    found = np.where(sums > 0.0, np.take_along_axis(found, order, axis=1), 0)
    if order.shape[1] < count:
        more = ((0, 0), (0, count - order.shape[1]))
        return np.pad(found, more), np.pad(sums, more)
    return found, sums


def added(mattes: tuple[np.ndarray, np.ndarray], others: tuple[np.ndarray, np.ndarray]) -> None:
    """Add the coverages of other mattes (H, W, M) to mattes of the same shape, in place."""
    labels, coverages = mattes
    is_same = (labels == others[0]).all(axis=-1)
    coverages[is_same] += others[1][is_same]
    rest = ~is_same
    if rest.any():
        all_labels = np.concatenate([labels[rest], others[0][rest]], axis=1)
        all_coverages = np.concatenate([coverages[rest], others[1][rest]], axis=1)
        labels[rest], coverages[rest] = combined(all_labels, all_coverages, labels.shape[-1])


def passes(
    labels: np.ndarray, coverages: np.ndarray, names: Mapping[int, str], depth: int, kind: str
) -> dict[str, np.ndarray]:
    """Return {pass: (H, W, 4) float32} for mattes (H, W, M); each pass has two numbers with their coverages.

    names: {label: name}, in which several labels may share a name; depth: number of ranks; kind: such as
    "CryptoObject".
    """
    unique = sorted(set(names.values()))
    places = {name: place for place, name in enumerate(unique, 1)}
    of_label = np.zeros(max(names, default=0) + 1, np.int32)
    for label, name in names.items():
        of_label[label] = places[name]
    ranks = 2 * -(-depth // 2)
    height, width = labels.shape[:2]
    flat = of_label[labels.reshape(height * width, -1)]
    found, sums = combined(flat, coverages.reshape(height * width, -1), ranks)
    found[:, depth:], sums[:, depth:] = 0, 0.0
    numbers = np.append(np.float32(0.0), hash_numbers([name_hash(name) for name in unique]))
    values = np.stack([numbers[found], sums], axis=-1).astype(np.float32).reshape(height, width, ranks // 2, 4)
    return {f"{kind}{index:02d}": values[:, :, index] for index in range(ranks // 2)}
