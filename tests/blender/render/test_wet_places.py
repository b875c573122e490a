# SPDX-License-Identifier: GPL-3.0-or-later
"""Each strand of partly wet hair is drawn by its own wetness."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.strands import attributes, curves
from hair_addon.blender.gpu import visibility_buffer
from hair_addon.blender.groom import bindings
from hair_addon.blender.render import film, hair_cache, offscreen
from hair_addon.blender.settings import style_items
from hair_addon.core.imaging.pixel_sampling import PictureSettings
from hair_addon.core.styling import wet
from tests.support.pairs import share_of
from tests.support.pictures.rendering import light_up, rendered
from tests.support.scenes import even_guides

AMOUNT = 0.8
SIZE = 64

# (model, mode, random color): of each program a variant draws shares.
MODELS = [
    ("KAJIYA_KAY", "energy", 0.0),
    ("MARSCHNER", "classic", 0.0),
    ("MARSCHNER", "energy", 0.0),
    ("MARSCHNER", "energy", 0.5),
]


def picture():
    """Return the picture (SIZE, SIZE, 4), linear."""
    settings = PictureSettings(width=SIZE, height=SIZE, samples_per_side=2, is_transparent=True)
    return offscreen.draw_picture(settings).astype(np.float64)


def wetten(hair, **changes):
    style_items.assign(hair.data.vellus, [wet.Settings(**{"amount": AMOUNT, "lock": 0.3} | changes)])
    bpy.context.view_layer.update()
    return picture()


def soak(hair, wetness):
    """Set a wetness (S,) of still strands, or one of all by None; returns the picture."""
    if wetness is None:
        hair.data.attributes.remove(hair.data.attributes["wetness"])
    else:
        attributes.write(hair.data, "wetness", "FLOAT", "CURVE", wetness)
    for _report in ("of what we wrote before", "of this"):
        hair.data.update_tag()
        bpy.context.view_layer.update()
    return picture()


def group(name, weights):
    """Return a vertex group of the sphere with the given weights."""
    made = bpy.data.objects["Sphere"].vertex_groups.new(name=name)
    for index, weight in enumerate(weights):
        made.add([index], float(weight), "REPLACE")


@pytest.fixture
def small(lit):
    state = lit.data.vellus
    state.marschner.size, state.hair.radius = 32, 0.02
    return lit


def test_a_mask_of_one_is_wet_and_of_zero_is_dry(small):
    """A mask of one is drawn as wet and a mask of zero as dry hair, up to rounding of interpolated weights."""
    count = len(bpy.data.objects["Sphere"].data.vertices)
    group("all", np.ones(count))
    group("none", np.zeros(count))
    for amount in (1.0, 0.3):
        whole = wetten(small, amount=amount)
        np.testing.assert_allclose(wetten(small, amount=amount, mask="all"), whole, atol=1e-4)
    # Swelling is of all strands.
    dry = wetten(small, amount=0.0)
    np.testing.assert_array_equal(wetten(small, mask="none", swelling=0.0), dry)
    assert "wetness" in small.data.attributes
    assert abs(wetten(small, swelling=0.0) - dry).mean() > 1e-3
    assert "wetness" not in small.data.attributes


@even_guides
@pytest.mark.parametrize("look", share_of(MODELS, 2))
def test_half_of_the_hair_is_wet(small, look, monkeypatch):
    """Away from the border, each half looks as in the picture of all dry and of all wet hair.

    Surfaces are shaded in each sample: shared light would pass noise, and so the hair, from sample to sample.
    """
    monkeypatch.setattr(film, "VisibilityBuffer", lambda *size, **_options: visibility_buffer.VisibilityBuffer(*size))
    state = small.data.vellus
    state.model, state.appearance.mode, state.appearance.random_color = look
    group("any", np.ones(len(bpy.data.objects["Sphere"].data.vertices)))
    wetten(small, mask="any")
    roots = curves.first_points(small.data)
    ones = np.ones(len(roots), np.float32)
    dry, wettest = soak(small, 0.0 * ones), soak(small, AMOUNT * ones)
    half = soak(small, AMOUNT * (roots[:, 0] > 0.0))
    seen = abs(wettest - dry)
    for columns, expected, other in ((slice(16, 26), dry, wettest), (slice(38, 48), wettest, dry)):
        assert seen[:, columns].mean() > 1e-4
        error = abs(half - expected)[:, columns]
        assert error.mean() < 0.1 * abs(half - other)[:, columns].mean()
    middle = soak(small, 0.5 * AMOUNT * ones)
    np.testing.assert_allclose(middle[..., :3], 0.5 * (dry + wettest)[..., :3], atol=5e-3)
    np.testing.assert_array_equal(middle[..., 3], dry[..., 3])
    np.testing.assert_array_equal(soak(small, None), wettest)


def test_a_wet_look_leaves_no_strand_dry(small):
    """With a wet look, no strand is drier than the look, and strands are as wet as their style if that is more."""
    group("any", np.ones(len(bpy.data.objects["Sphere"].data.vertices)))
    wetten(small, mask="any")
    ones = np.ones(len(small.data.curves), np.float32)
    small.data.vellus.appearance.wetness = 0.4
    np.testing.assert_array_equal(soak(small, 0.4 * ones), soak(small, 0.0 * ones))
    small.data.vellus.appearance.wetness = 0.9
    np.testing.assert_array_equal(soak(small, AMOUNT * ones), soak(small, 0.0 * ones))


def test_passes_of_the_light_add_up(small, tmp_path):
    """Each pass of a render mixes both looks as the picture does, so that passes add up."""
    light_up()
    wetten(small, vary=1.0)
    bpy.data.objects["Sphere"].is_holdout = True
    bpy.context.view_layer.vellus.has_lobes = True
    passes = rendered(tmp_path, film_transparent=True)
    light = passes["Combined"][..., :3]
    np.testing.assert_allclose(sum(passes[name] for name in film.LOBES), light, atol=2e-3 * light.max())
    assert light.mean() > 1e-3


def test_hair_ahead_of_its_datablock_is_drawn_as_wet_as_it_will_be_written(small):
    group("half", np.linspace(0.0, 1.0, len(bpy.data.objects["Sphere"].data.vertices)))
    wetten(small, mask="half")
    stored = curves.read_wetness(small.data)
    bound = bindings.of(small.data)
    np.testing.assert_array_equal(bound.styles.wetness, stored)
    np.testing.assert_array_equal(hair_cache.strands_on_gpu(small.data).wetness_here, stored)
    bound.is_written = False
    hair_cache.strand_cache.clear()
    np.testing.assert_array_equal(hair_cache.strands_on_gpu(small.data).wetness_here, stored)
    bound.is_written = True


def test_hostile_wetness_is_held_to_its_range(small):
    wetten(small)
    wetness = np.linspace(-3.0, 3.0, len(small.data.curves), dtype=np.float32)
    wetness[:3] = np.nan, np.inf, -np.inf
    assert np.isfinite(soak(small, wetness)).all()
    found = curves.read_wetness(small.data)
    assert found.min() == 0.0 and found.max() == 1.0
