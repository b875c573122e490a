# SPDX-License-Identifier: GPL-3.0-or-later
"""Styles applied on the GPU equal those of Warp; a slider uploads only numbers."""

from dataclasses import replace

import gpu
import numpy as np
import pytest

from hair_addon.blender.gpu import strand_textures
from hair_addon.blender.gpu.programs import shaders, uniforms
from hair_addon.blender.gpu.strands import style_maker
from hair_addon.core.geometry.strands import from_numpy
from hair_addon.core.styling import bend, braid, clump, curl, frizz, kinds, lean, smooth, trim, wet
from hair_addon.core.styling.base import Cutter
from hair_addon.core.styling.masks import Mask
from hair_addon.core.styling.style_inputs import Inputs
from tests.support.pictures import drawn_strands
from tests.support.strands.styled import head

# Of a strand's length, by which it may differ: sums in single precision, in another order.
CLOSE = 1e-5
# Where hair is more sensitive than that, it may differ by twice as much as by a change of its guides' last digits: at
# tips of rolls, and where strands turn past the center of their clump.
SENSITIVE = 2.0
STRANDS = 150

STACKS = {
    "cut": (trim.Settings(factor=0.8, random=0.6, undercoat=0.3, vary=0.2),),
    "scaled": (trim.Settings(factor=1.5, to_length=0.25, method="SCALE"),),
    "cutter": (trim.Settings(cutter="Cutter"),),
    "bend": (bend.Settings(angle=2.0, turn=0.5, random_turn=0.4),),
    "roll": (bend.Settings(**bend.ROLL, vary=0.5),),
    "smooth": (bend.Settings(**bend.ROLL), smooth.Settings(length=0.08, amount=0.7)),
    "frizz": (frizz.Settings(amplitude=0.008, octaves=4, coherence=0.5, stray=0.2, keep_length=0.3),),
    "curl": (curl.Settings(radius=0.01, coherence=0.3, shape=0.8, vary=0.5),),
    "switchbacks": (curl.Settings(switchback=0.05, stretch=0.7, left_handed=0.2, keep_length=0.2),),
    "clump": (clump.Settings(size=0.04, twist=1.0, stray=0.2, root=0.3),),
    "locks that curl": (clump.Settings(size=0.04), curl.Settings(seed=1), frizz.Settings(seed=2)),
    "two clumps": (clump.Settings(size=0.04), curl.Settings(), clump.Settings(size=0.03, levels=1, seed=4)),
    "wet": (frizz.Settings(), wet.Settings(amount=0.8, lock=0.05)),
    "braid": (braid.Settings(),),
    "rope": (bend.Settings(amount=0.3), braid.Settings(pattern="ROPE", flatness=0.4)),
    "lean": (lean.Settings(amount=0.6), curl.Settings()),
}


@pytest.fixture(scope="module")
def hair(blender):
    return head(STRANDS, 60, device="cpu")


@pytest.fixture
def one_program(monkeypatch):
    """One program for all stacks, as compiling takes longest."""
    monkeypatch.setattr(style_maker, "_kinds_of", lambda _program: tuple(kinds.STEPS))


def uploaded(strands):
    radii = np.broadcast_to(np.linspace(2e-4, 1e-5, strands.shape[1], dtype=np.float32), strands.shape[:2])
    return strand_textures.upload_strands(np.zeros_like(strands), radii)


def made(maker, hair, styling, strands):
    """(S, P, 3) points after the GPU has made strands in an uploaded texture, whose bounds it knows."""
    on_gpu = maker.make(strands, styling.guides(hair.guides).numpy())
    points = drawn_strands.places(on_gpu)
    corners, close = points.reshape(-1, 3), drawn_strands.tolerance(points).max()
    np.testing.assert_allclose(on_gpu.bounds, [corners.min(axis=0), corners.max(axis=0)], rtol=0.0, atol=close)
    return points


def errors(hair, points, wanted):
    """(S,) greatest distances between points, as parts of the strands' lengths before styles."""
    lengths = np.linalg.norm(np.diff(hair.plain, axis=1), axis=2).sum(axis=1)
    return np.linalg.norm(points - wanted, axis=2).max(axis=1) / lengths


def shaken(hair, rng, wanted, *styles, **given):
    """Return (S,) sorted errors caused by rounding of the guides' coordinates: the largest of several trials."""
    found = np.zeros(STRANDS)
    for _ in range(3):
        points = hair.guides.numpy()
        points = points * (1.0 + rng.uniform(-6e-8, 6e-8, points.shape))
        guides = from_numpy(points.astype(np.float32), hair.guides.roots, hair.device)
        np.maximum(found, np.sort(errors(hair, hair.styled(*styles, guides=guides, **given), wanted)), out=found)
    return found


def assert_same(hair, rng, styles, axes=None, **given):
    """Assert that the GPU's strands equal Warp's; strands in other axes are rotated back first."""
    axes = np.eye(3) if axes is None else axes
    styling, wanted = hair.bound(*styles, **given), hair.styled(*styles, **given)
    assert style_maker.can_style(styling)
    before = uploaded(wanted)
    maker = style_maker.maker_of(hair.binding, styling, before.point_count, axes)
    points = made(maker, hair, styling, before)
    found = np.sort(errors(hair, points @ np.linalg.inv(axes).T.astype(np.float32), wanted))
    if found[-1] > CLOSE:
        assert (found <= np.maximum(CLOSE, SENSITIVE * shaken(hair, rng, wanted, *styles, **given))).all()
    return maker, before, wanted


@pytest.mark.parametrize("name", STACKS)
def test_strands_are_those_of_warp(hair, rng, one_program, name):
    normal = np.array([0.6, 0.0, -0.8])
    inputs = Inputs(cutters={"Cutter": Cutter(hair.plain.mean(axis=(0, 1)), normal)})
    wanted = assert_same(hair, rng, STACKS[name], inputs=inputs)[2]
    assert np.abs(wanted - hair.plain).max() > 0.01


def test_masks_that_are_painted(hair, rng, one_program):
    weights = rng.random(hair.mesh.triangles.shape).astype(np.float32)
    weights[: len(weights) // 2] = 0.0  # strands that no style touches
    masks = {("One", "", False): Mask(weights), ("Two", "", True): Mask(weights, is_inverted=True)}
    styles = (
        clump.Settings(size=0.04, mask="One"),
        curl.Settings(mask="Two", invert_mask=True),
        wet.Settings(lock=0.05, mask="One"),
    )
    assert_same(hair, rng, styles, inputs=Inputs(masks=masks))


@pytest.mark.parametrize("is_mirrored", [False, True])
def test_coordinates_that_are_drawn_and_the_surfaces_own_axes(hair, rng, one_program, is_mirrored):
    turned = head(STRANDS, 60, device="cpu")
    turned.axes = np.eye(4)
    turned.axes[:3] = [[0.0, -1.0, 0.0, 0.05], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, -0.02]]
    if is_mirrored:
        turned.axes[2] *= -1.0
    frizzed = (*STACKS["locks that curl"], frizz.Settings(coherence=0.8))
    assert_same(turned, rng, frizzed, axes=np.array([[0.0, -2.0, 0.0], [0.0, 0.0, 2.0], [-2.0, 0.0, 0.0]]))


@pytest.mark.parametrize("point_count", [7, 65])
def test_other_numbers_of_points(hair, rng, point_count):
    """Strands of any number of points agree, with a program for one kind of step."""
    assert_same(hair, rng, (bend.Settings(),), point_count=point_count)


def test_strands_that_are_made_in_parts_are_the_same(hair, monkeypatch, one_program):
    """The texture before styles contains a part of the strands, whose number is not a multiple of that part."""
    styling = hair.bound(*STACKS["locks that curl"])
    found = []
    for count in (STRANDS, 64):
        monkeypatch.setattr(style_maker, "MOST_AT_ONCE", count)
        maker = style_maker.maker_of(hair.binding, styling, 41, np.eye(3))
        found.append(made(maker, hair, styling, uploaded(hair.plain)))
    np.testing.assert_array_equal(*found)


def test_a_slider_uploads_numbers_alone(hair, monkeypatch, one_program):
    """A slider uploads only the rows of each pass, and the strands are those of the new settings."""
    styles = STACKS["locks that curl"]
    styling = hair.bound(*styles)
    maker = style_maker.maker_of(hair.binding, styling, 41, np.eye(3))
    strands = maker.make(uploaded(hair.plain), hair.guides.numpy())
    changed = styles[0], replace(styles[1], radius=0.02), styles[2]
    other, sizes = hair.bound(*changed), []
    programs = len(shaders.program_cache)
    with monkeypatch.context() as watched:
        buffer = gpu.types.Buffer
        watched.setattr(
            gpu.types, "Buffer", lambda kind, size, values: sizes.append(size) or buffer(kind, size, values)
        )
        watched.setattr(gpu.types, "GPUTexture", None)
        watched.setattr(gpu.types, "GPUUniformBuf", None)
        assert style_maker.maker_of(hair.binding, other, 41, np.eye(3), maker) is maker
        points = made(maker, hair, other, strands)
    assert sizes == [uniforms.STYLING.dtype.itemsize] * 3  # of strands, and of centers on two levels
    assert len(shaders.program_cache) == programs
    assert np.quantile(errors(hair, points, hair.styled(*changed)), 0.95) <= CLOSE


def test_masks_that_are_painted_further(hair, rng, one_program):
    """Painting or removing a mask uploads only the data per strand."""
    maker, strands = None, uploaded(hair.plain)
    for weights in (rng.random(hair.mesh.triangles.shape), rng.random(hair.mesh.triangles.shape), None):
        inputs = Inputs(masks={("Mask", "", False): Mask(None if weights is None else weights.astype(np.float32))})
        styles = clump.Settings(size=0.04), curl.Settings(mask="" if weights is None else "Mask")
        styling = hair.bound(*styles, inputs=inputs)
        before, maker = maker, style_maker.maker_of(hair.binding, styling, 41, np.eye(3), maker)
        assert before in (None, maker)
        points = made(maker, hair, styling, strands)
        assert np.quantile(errors(hair, points, hair.styled(*styles, inputs=inputs)), 0.95) <= CLOSE


def test_other_clumps_are_bound_again(hair, one_program):
    styling = hair.bound(clump.Settings(size=0.04))
    maker = style_maker.maker_of(hair.binding, styling, 41, np.eye(3))
    for styles in [(clump.Settings(size=0.03, levels=1),), ()]:
        other = style_maker.maker_of(hair.binding, hair.bound(*styles), 41, np.eye(3), maker)
        assert other is not maker


def test_some_stacks_are_left_to_warp(hair, monkeypatch):
    assert not style_maker.can_style(hair.bound(curl.Settings(), point_count=style_maker.MOST_POINTS + 1))
    assert style_maker.can_style(hair.bound(curl.Settings(), frizz.Settings()))
    assert not style_maker.can_style(hair.bound(*[bend.Settings()] * (uniforms.MOST_STEPS + 1)))
