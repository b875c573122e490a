# SPDX-License-Identifier: GPL-3.0-or-later
"""Every style satisfies these laws, alone and in stacks, on hair of the sample head."""

from dataclasses import fields, replace
from itertools import pairwise

import numpy as np
import pytest
import warp as wp

from hair_addon.core.geometry.strands import from_numpy, segment_lengths
from hair_addon.core.grooming import style_binding
from hair_addon.core.styling import base, bend, clump, curl, frizz, kinds, lean, program, smooth, steps, trim, wet
from hair_addon.core.styling.masks import Inputs, Mask
from tests.support.devices import DEVICE
from tests.support.dynamics.stepped import UP, curved_strands, largest_move, rotation, stepped
from tests.support.strands.styled import head

STYLES = {name: offer.settings for name, offer in kinds.OFFERS.items()}
STYLES["TRIM"] = trim.Settings(factor=0.6, random=0.2)
ON_STRANDS = [name for name in STYLES if name not in {"LEAN", "LIFT"}]
# Strands of a braid stretch where they gather (test_braid.py), so that they do not slide along their tress.
KEEP_LENGTHS = [name for name in ON_STRANDS if name not in {"TRIM", "WET", "BRAID", "ROPE"}]
STACK = (clump.Settings(size=0.03), curl.Settings(seed=1), frizz.Settings(seed=2), smooth.Settings(amount=0.3))


@pytest.fixture(scope="module")
def hair():
    return head(400, 60)


@pytest.fixture(scope="module")
def made_again():
    """Return the same hair as new objects."""
    return head(400, 60)


@pytest.fixture(params=STYLES)
def style(request):
    return STYLES[request.param]


def masked(settings, weights, hair):
    """Return settings with a mask, and the `Inputs` for it: weights (V,) of the surface."""
    settings = replace(settings, mask="mask")
    return settings, Inputs(masks={program.mask_key(settings): Mask(weights.astype(np.float32)[hair.mesh.triangles])})


def test_roots_do_not_move(hair, style):
    np.testing.assert_array_equal(hair.styled(style)[:, 0], hair.plain[:, 0])


def test_every_style_does_something(hair, style):
    assert largest_move(hair.styled(style), hair.plain) > 1e-3


def require_same_lengths(after, before):
    """Assert equal lengths of segments and strands, up to rounding of coordinates of up to a meter."""
    after, before = (segment_lengths(points.astype(np.float64)) for points in (after, before))
    np.testing.assert_allclose(after, before, rtol=2e-5, atol=1e-7)
    np.testing.assert_allclose(after.sum(axis=1), before.sum(axis=1), rtol=2e-6, atol=2e-7)


@pytest.mark.parametrize("name", KEEP_LENGTHS)
def test_lengths_stay(hair, name):
    require_same_lengths(hair.styled(STYLES[name]), hair.plain)


def test_lengths_stay_in_a_stack(hair):
    require_same_lengths(hair.styled(*STACK), hair.plain)


# Multiples of the amplitude by which styles may go beyond the silhouette of the hair; 0 for those that only gather it.
BEYOND = {"CLUMP": 0.0, "SMOOTH": 0.0, "TRIM": 0.0, "BRAID": 2.0, "CURL": 2.0, "WAVE": 2.0, "FRIZZ": 3.0}


def silhouette_extents(points):
    """Return ((N, 32) extents [m] of points in horizontal directions, (N,) number of the slab of 1 cm)."""
    around = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)
    extents = points[..., :2].reshape(-1, 2) @ np.stack([np.cos(around), np.sin(around)])
    return extents, np.floor(points[..., 2].ravel() / 0.01).astype(int) + 100


@pytest.mark.parametrize("name", BEYOND)
def test_the_silhouette_stays_within_the_amplitude_of_styles(hair, name):
    """At each height, hair is within the silhouette of the hair without styles there, grown by the style's amplitude.

    Up to 1 % of the points may be outside: at partings, where hair falls to both sides, and at the lowest tips.
    """
    style = STYLES[name]
    amplitude = getattr(style, "radius", getattr(style, "amplitude", 0.0))
    extents, slabs = silhouette_extents(hair.plain)
    silhouette = np.full((201, 32), -np.inf)
    for shift in (-1, 0, 1):  # slabs above and below
        np.maximum.at(silhouette, slabs + shift, extents)
    after, its = silhouette_extents(hair.styled(style))
    beyond = (after - silhouette[its]).max(axis=1) - BEYOND[name] * amplitude
    assert np.mean(beyond > 2e-3) < 0.01


def test_a_style_without_effect_leaves_the_bits(hair, style):
    """A style that is off, or whose amount, mask or profile is zero, leaves the bits."""
    without = [replace(style, is_on=False), replace(style, amount=0.0)]
    if "root" in {field.name for field in fields(style)}:
        without.append(replace(style, root=0.0, tip=0.0))
    for settings in without:
        assert hair.bound(settings) is None
        np.testing.assert_array_equal(hair.styled(settings), hair.plain)
    settings, inputs = masked(style, np.zeros(len(hair.mesh.vertices)), hair)
    np.testing.assert_array_equal(hair.styled(settings, inputs=inputs), hair.plain)


@pytest.mark.parametrize("name", ON_STRANDS)
def test_strands_outside_a_mask_keep_their_bits(hair, name):
    """Strands outside a mask keep their bits, with any styles before and after, and next to strands within the mask."""
    settings, inputs = masked(STYLES[name], np.maximum(hair.mesh.vertices[:, 0], 0.0) * 10.0, hair)
    others = bend.Settings(), frizz.Settings()
    outside = inputs.masks[program.mask_key(settings)].of_strands(hair.binding) == 0.0
    assert 10 < outside.sum() < 390
    without, made = hair.styled(*others), hair.styled(others[0], settings, others[1], inputs=inputs)
    if name not in {"CLUMP", "BRAID", "ROPE", "WET"}:  # below a clump, curls and frizz take its locks' frames
        np.testing.assert_array_equal(made[outside], without[outside])
    alone = hair.styled(settings, inputs=inputs)
    if name != "WET":  # wet guides lean
        np.testing.assert_array_equal(alone[outside], hair.plain[outside])
    assert largest_move(alone[~outside], hair.plain[~outside]) > 1e-4


def test_half_a_mask_is_half_the_amount(hair, style):
    settings, inputs = masked(style, np.full(len(hair.mesh.vertices), 0.5), hair)
    if isinstance(style, wet.Settings | trim.Settings | clump.Settings):
        pytest.skip("Its amount is not a factor of one step")
    np.testing.assert_allclose(hair.styled(settings, inputs=inputs), hair.styled(replace(style, amount=0.5)), atol=2e-5)


def test_same_seed_same_strands(hair, made_again, style):
    np.testing.assert_array_equal(made_again.styled(style), hair.styled(style))


def test_another_seed_other_strands(hair):
    for settings in (curl.Settings(), frizz.Settings(), clump.Settings(), trim.Settings(random=0.3)):
        assert largest_move(hair.styled(replace(settings, seed=5)), hair.styled(settings)) > 1e-3


def test_the_place_in_the_list_of_another_style_does_not_matter(hair):
    """The place of a style that is off does not matter, as it draws no random numbers of others."""
    off = frizz.Settings(is_on=False, seed=9)
    np.testing.assert_array_equal(hair.styled(off, *STACK), hair.styled(*STACK))


def test_a_strand_does_not_depend_on_the_order_of_strands(hair, rng):
    order = rng.permutation(400)
    np.testing.assert_array_equal(hair.rooted(hair.binding.roots[order]).styled(*STACK), hair.styled(*STACK)[order])


def test_few_strands_are_among_many(hair):
    few = hair.rooted(hair.binding.roots[:40])
    np.testing.assert_array_equal(few.styled(*STACK), hair.styled(*STACK)[:40])
    for settings in STYLES.values():
        np.testing.assert_array_equal(few.styled(settings), hair.styled(settings)[:40])


def test_some_strands_are_as_among_all(hair, rng, style):
    chosen = np.sort(rng.choice(400, 37, replace=False)).astype(np.int32)
    np.testing.assert_array_equal(hair.styled(style, chosen=chosen), hair.styled(style)[chosen])
    np.testing.assert_array_equal(hair.styled(*STACK, chosen=chosen), hair.styled(*STACK)[chosen])


@pytest.mark.parametrize("width", [8])
def test_the_width_of_vectors_does_not_matter(rng, width):
    other = steps.variant(width, 64, wp.get_module(f"tests.strands_at_once_{width}"))
    strands = curved_strands(rng, 37)
    members = rng.integers(0, 5, 37)
    for settings in [*(STYLES[name] for name in ON_STRANDS), STACK]:
        styles = settings if isinstance(settings, tuple) else (settings,)
        made = [stepped(strands, *styles, members=members, version=version) for version in (None, other)]
        assert largest_move(*made) < 2e-6 * 0.2


@pytest.mark.parametrize("point_count", [41, 257])
def test_rounding_is_not_amplified(rng, point_count):
    """Rounding is not amplified: strands with coordinates rounded the other way are styled alike, with any point
    count.

    Half of the strands are longer than their lock's center: the direction of its last segment extends them.
    """
    strands = curved_strands(rng, 100, point_count=point_count)
    members = rng.integers(0, 5, 100)
    toward = np.where(rng.random(strands.shape) < 0.5, -1.0, 1.0).astype(np.float32)
    others = np.nextafter(strands, toward)
    others[:, 0] = strands[:, 0]
    for settings in [*(STYLES[name] for name in ON_STRANDS), STACK]:
        styles = settings if isinstance(settings, tuple) else (settings,)
        made = [stepped(points, *styles, members=members) for points in (strands, others)]
        assert largest_move(*made) < 1e-4 * 0.2


@pytest.mark.skipif(DEVICE == "cpu", reason="VELLUS_TEST_DEVICE names no GPU")
@pytest.mark.parametrize("point_count", [41, 121, 257])
def test_the_processor_and_a_gpu_agree(rng, point_count):
    strands = curved_strands(rng, 100, point_count=point_count)
    members = rng.integers(0, 5, 100)
    for settings in [*(STYLES[name] for name in ON_STRANDS), STACK]:
        styles = settings if isinstance(settings, tuple) else (settings,)
        made = [stepped(strands, *styles, members=members, device=device) for device in ("cpu", DEVICE)]
        assert largest_move(*made) < 2e-6 * 0.2


@pytest.mark.parametrize("is_mirrored", [False, True])
@pytest.mark.parametrize("name", ON_STRANDS)
def test_turned_moved_scaled_and_mirrored_before_or_after(rng, name, is_mirrored):
    """Styles commute with transforms if lengths are scaled, and the surface's axes and origin are transformed too."""
    strands = curved_strands(rng, 48)
    normals = rng.normal(UP, 0.2, (48, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    members = np.arange(48) // 8
    turn, scale, shift = rotation(rng), 3.0, np.array([0.4, -0.2, 0.3])
    if is_mirrored:
        turn = turn * (-1.0, 1.0, 1.0)
    from_own = np.eye(4)
    from_own[:3, :3], from_own[:3, 3] = scale * turn, shift
    style = STYLES[name]
    if name == "FRIZZ":
        style = replace(style, coherence=0.7)
    size = scale * np.ptp(strands)
    after = stepped(strands, style, normals=normals, members=members, centre_normals=normals[::8])
    after = scale * (after @ turn.T) + shift
    before = stepped(
        (scale * (strands @ turn.T) + shift).astype(np.float32),
        base.scaled(style, scale),
        normals=normals @ turn.T,
        members=members,
        centre_normals=normals[::8] @ turn.T,
        axes=style_binding.own_axes(from_own),
    )
    # Coherent waves, and strands that wind about each other, have large derivatives.
    tolerance = {"FRIZZ": 1e-5, "BRAID": 2e-5, "ROPE": 2e-5}.get(name, 1e-5)
    np.testing.assert_allclose(before, after, atol=tolerance * size)


def degenerate_strands(point_count):
    """Return {name: (P, 3)}."""
    line = np.linspace(0.0, 1.0, point_count)[:, None] * (0.1, 0.0, 0.2)
    doubled = np.repeat(line[::2], 2, axis=0)[:point_count]
    back = np.abs(np.linspace(-1.0, 1.0, point_count))[:, None] * (0.0, 0.0, 0.2)
    back -= back[:1]
    return {
        "no length": np.zeros((point_count, 3)),
        "doubled points": doubled - doubled[:1],
        "turning back": back,
        "to and fro": (np.arange(point_count) % 2)[:, None] * (0.0, 0.01, 0.0),
        "into the surface": -line,
        "tiny": 1e-6 * line,
        "huge": 1e6 * line,
        "one long segment": np.minimum(np.arange(point_count), 1)[:, None] * (0.2, 0.0, 0.0),
    }


@pytest.mark.parametrize("point_count", [2, 3, 41, 257])
def test_degenerate_strands_stay_finite(point_count):
    strands = np.array(list(degenerate_strands(point_count).values()), np.float32)
    for name in ON_STRANDS:
        for members in (None, np.arange(len(strands))):
            for normals in ((0.0, 0.0, 1.0), (0.0, 0.0, -1.0)):
                made = stepped(strands, STYLES[name], members=members, normals=normals, centre_normals=normals)
                assert np.isfinite(made).all(), name
                if name in KEEP_LENGTHS:
                    lengths = [segment_lengths(points.astype(np.float64)) for points in (strands, made)]
                    sizes = lengths[0].sum(axis=1, keepdims=True)
                    np.testing.assert_allclose(lengths[1] - lengths[0], 0.0 * lengths[0], atol=(3e-6 * sizes).max())


def test_strands_that_are_near_are_alike(rng):
    """Strands with roots 1e-5 apart in one lock are alike except for their own random numbers."""
    strands = np.repeat(curved_strands(rng, 20), 2, axis=0)
    strands[1::2] += (1e-5, 0.0, 0.0)
    normals = np.tile([0.0, 0.0, 1.0], (40, 1))
    normals[1::2] += (1e-4, 0.0, 0.0)
    members = np.arange(40) // 2
    calm = {
        "CURL": {"coherence": 1.0},
        "WAVE": {"coherence": 1.0},
        "FRIZZ": {"coherence": 1.0, "stray": 0.0},
        "CLUMP": {"stray": 0.0},
        "TRIM": {"random": 0.0},
    }
    for name in ON_STRANDS:
        if name in {"BRAID", "ROPE"}:  # tresses part strands of a lock
            continue
        style = replace(STYLES[name], **calm.get(name, {}))
        made = stepped(strands, style, normals=normals, members=members, centre_normals=normals[::2])
        assert np.linalg.norm(made[::2] - made[1::2], axis=2).max() < 1e-3 * 0.2, name


def test_other_points_a_strand_make_the_same_hair(hair):
    """With twice as many points every second point is near the former point, for styles that the points can show."""
    for settings in (bend.Settings(), curl.Settings(pitch=0.12), clump.Settings(), lean.Settings(), wet.Settings()):
        fine, coarse = hair.styled(settings, point_count=81), hair.styled(settings)
        assert np.median(np.linalg.norm(fine[:, ::2] - coarse, axis=2)) < 2e-3, settings
    assert hair.styled(point_count=81).shape == (400, 81, 3)


def test_strands_follow_moving_guides_steadily(hair):
    """Per frame no strand moves more than 1.5 times as far as the farthest unstyled strand."""
    combed = hair.guides.numpy()
    along = np.linspace(0.0, 1.0, combed.shape[1])[None, :, None] ** 2
    styles = clump.Settings(), curl.Settings(), frizz.Settings()
    frames = [], []
    for frame in range(12):
        swing = 0.05 * np.array([np.sin(0.25 * frame), 0.5 * np.sin(0.4 * frame + 1.0), 0.0])
        guides = from_numpy((combed + along * swing).astype(np.float32), hair.guides.roots, hair.device)
        frames[0].append(hair.styled(guides=guides))
        frames[1].append(hair.styled(*styles, guides=guides))
    plain, styled = (max(largest_move(*pair) for pair in pairwise(points)) for points in frames)
    assert styled < 1.5 * plain
