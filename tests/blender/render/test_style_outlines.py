# SPDX-License-Identifier: GPL-3.0-or-later
"""On the sample head, coily hair is narrower than curly, frizzy hair wider than straight, and wet hair darker."""

import functools

import bpy
import pytest

from blend_samples.pictures import styles
from hair_addon import api
from hair_addon.blender.render import offscreen
from hair_addon.core.imaging.pixel_sampling import PictureSettings
from tests.support.scenes import shrink_shadows

WIDTH, HEIGHT = 96, 112


@pytest.fixture(scope="module")
def pictures():
    """Return a function that returns (HEIGHT, WIDTH, 4) linear pixels of the hair alone with a preset, drawn once, with
    the gallery's light and camera.

    Dual scattering is used, as the light grid would take more than half of the time and changes no outline.
    """
    hair = styles.build(strand_count=2000)
    bpy.context.scene.vellus.multiple_scattering = "DUAL"
    bpy.data.objects["Head"].hide_render = True
    with pytest.MonkeyPatch.context() as patch:
        shrink_shadows(patch)
        yield functools.cache(functools.partial(drawn, hair))


def drawn(hair, preset):
    api.set_styles(hair, [])
    api.apply_style_preset(hair, preset)
    bpy.context.view_layer.update()
    return offscreen.draw_picture(PictureSettings(width=WIDTH, height=HEIGHT, samples_per_side=2, is_transparent=True))


def width(picture):
    """Return the number of pixels from the first to the last column with hair, without single stray strands."""
    shown = (picture[..., 3] > 0.1).sum(axis=0) > 2
    return shown.nonzero()[0][-1] - shown.nonzero()[0][0]


def luminance(picture):
    """Return the mean luminance of pixels with hair."""
    return picture[..., :3].sum() / picture[..., 3].sum()


@pytest.mark.long
def test_coily_hair_is_narrower_than_curly(pictures):
    assert width(pictures("COILY")) < width(pictures("CURLY"))


def test_frizzy_hair_is_wider_than_straight(pictures):
    assert width(pictures("FRIZZY")) > width(pictures("STRAIGHT"))


def test_wet_hair_is_darker_than_dry(pictures):
    assert luminance(pictures("WET")) < 0.9 * luminance(pictures("STRAIGHT"))
