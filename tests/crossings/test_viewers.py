# SPDX-License-Identifier: GPL-3.0-or-later
"""Khronos' validator finds no errors in files of cards, and three.js with three-vrm swings their hair."""

import os
import shutil
from pathlib import Path

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.io import mesh_export
from tests.blender.io.test_vrm import humanoid
from tests.support.viewers import viewer

pytestmark = [pytest.mark.farm, pytest.mark.skipif(not viewer.IS_THERE, reason=viewer.MISSING)]


@pytest.mark.parametrize("name", ["avatar.vrm", "head.glb"])
def test_hair_is_valid_and_swings(hair, tmp_path, name):
    """Hair is at rest at first, swings when the model moves, and comes back."""
    is_avatar = name.endswith(".vrm")
    if is_avatar:
        humanoid(bpy.data.objects["Sphere"])
    made = api.make_hair_cards(hair, card_count=60, segment_count=6, texture_size=512, chain_count=8)
    mesh_export.write(tmp_path / name, made)
    issues = viewer.issues_of(tmp_path / name)
    assert issues["numErrors"] == 0, issues["messages"]
    found = viewer.seen_by_three(tmp_path / name, tmp_path)
    if "VELLUS_VIEWERS_PICTURES" in os.environ:
        shutil.copy(found["picture"], Path(os.environ["VELLUS_VIEWERS_PICTURES"]) / f"{name}.png")
    assert found["isVrm"] == is_avatar and found["tips"] == 8 and found["joints"] >= 8
    assert found["triangles"] >= 60 * 6 * 2
    assert found["atRest"] < 1e-5 < 0.01 * found["size"] < found["swung"] and found["back"] < 0.02 * found["swung"]
    image = bpy.data.images.load(str(found["picture"]))
    assert np.ptp(np.reshape(image.pixels, (*image.size, 4))[..., :3], axis=(0, 1)).min() > 0.1
