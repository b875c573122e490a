# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertex groups named after hair are recognized."""

import pytest

from hair_addon.core.grooming.mask_names import suggested


@pytest.mark.parametrize(
    "name",
    [
        *("scalp", "Head_Hair", "hairMask", "Kopfhaar.001", "KOPFHAUT", "cuir chevelu", "cuero cabelludo", "Capelli"),
        *(
            "Włosy",
            "hår",
            "Волосы",
            "скальп",
            "头发",
            "頭皮",
            "髪",
            "머리카락",
            "Mähne.L",
            "fur2",
            "Bart",
            "pestañas",
            "ひげ",
        ),
        *("eyebrowsMask", "Brows.R", "Beard"),
    ],
)
def test_names_of_hair_are_known(name):
    assert suggested(["Group", "hips", name]) == name


@pytest.mark.parametrize("name", ["Group", "ChairLeg", "armpit", "no_hair", "Hairless", "ohne Haare", "bald scalp", ""])
def test_other_names_are_not(name):
    assert suggested([name]) == ""


def test_the_scalp_comes_before_hair_and_hair_before_a_beard():
    assert suggested(["beard", "fur", "hair", "Scalp mask"]) == "Scalp mask"
    assert suggested(["beard", "fur", "hair"]) == "hair"
    assert suggested(["hair.001", "hair"]) == "hair.001"
    assert suggested([]) == ""
