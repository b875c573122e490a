# SPDX-License-Identifier: GPL-3.0-or-later
"""Cryptomatte uses the hashes of its specification, and coverages are added and ranked without loss."""

import numpy as np
import pytest

from hair_addon.core.imaging import cryptomatte
from tests.support.cryptomatte_reader import name_number


@pytest.mark.parametrize(
    ("name", "number"),
    [
        ("hello", 6.0705627102400005616e-17),
        ("cube", -4.08461912519e15),
        ("sphere", 2.79018604383e15),
        ("plane", 3.66557617593e-11),
    ],
)
def test_names_have_the_numbers_of_the_specification(name, number):
    assert cryptomatte.hash_numbers([cryptomatte.name_hash(name)])[0] == pytest.approx(number, rel=1e-6)


def test_numbers_are_normal_and_those_of_another_implementation():
    """The law holds for names beyond ASCII, and for hashes whose bits would be infinite or denormal."""
    names = ["", "a", "ab", "abc", "Haar.001", "Größe", "毛", *(f"Hair.{n:03}" for n in range(3000))]
    ours = cryptomatte.hash_numbers([cryptomatte.name_hash(name) for name in names])
    np.testing.assert_array_equal(ours.view("u4"), np.float32([name_number(name) for name in names]).view("u4"))
    exponents = cryptomatte.hash_numbers([0, 0x7F800001, 0xFF812345, 0x007FFFFF]).view("u4") >> 23 & 255
    assert exponents.tolist() == [1, 254, 254, 1]


def test_added_coverages_keep_their_sums(rng):
    """Labels of two mattes are joined; the smallest are dropped beyond the number of slots."""
    shape = (5, 7, 6)
    labels = [np.argsort(rng.random((5, 7, 20)), axis=-1)[..., :6].astype(np.int32) for _ in range(2)]
    labels[1][0] = labels[0][0]
    weights = [np.where(one > 0, rng.random(shape), 0.0).astype(np.float32) for one in labels]
    whole = np.zeros((5, 7, 20))
    for one, weight in zip(labels, weights, strict=True):
        np.put_along_axis(whole, one, np.take_along_axis(whole, one, axis=-1) + weight, axis=-1)
    cryptomatte.added((labels[0], weights[0]), (labels[1], weights[1]))
    for y, x in np.ndindex(5, 7):
        largest = np.sort(whole[y, x, 1:])[::-1][:6]
        np.testing.assert_allclose(np.sort(weights[0][y, x])[::-1], largest, rtol=1e-6)
        for label, weight in zip(labels[0][y, x], weights[0][y, x], strict=True):
            assert weight == pytest.approx(whole[y, x, label] if label else 0.0, rel=1e-6)


def test_labels_of_one_name_share_a_rank():
    labels = np.array([[[1, 2, 3, 0]]], np.int32)
    coverages = np.float32([[[0.2, 0.3, 0.4, 0.0]]])
    found = cryptomatte.passes(labels, coverages, {1: "a", 2: "b", 3: "a"}, 3, "CryptoObject")
    assert sorted(found) == ["CryptoObject00", "CryptoObject01"]
    first = found["CryptoObject00"][0, 0]
    np.testing.assert_allclose(first, [name_number("a"), 0.6, name_number("b"), 0.3], rtol=1e-6)
    assert (found["CryptoObject01"] == 0.0).all()
