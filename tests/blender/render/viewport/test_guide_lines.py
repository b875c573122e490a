# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides in viewports are antialiased lines of constant width, in the chosen colors, and as opaque as set."""

import bpy
import gpu
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data import scene
from hair_addon.blender.data.strands import curves, frozen_points, gathered_groups
from hair_addon.blender.gpu import drawing
from hair_addon.blender.groom import bindings
from hair_addon.blender.render import drawn_scene
from hair_addon.blender.render.viewport import guide_lines
from hair_addon.core.geometry import strands
from hair_addon.core.geometry.strands import ragged_lengths
from tests.support.interface.layout import draw
from tests.support.reading import write_points

SIZE = 128
LEVEL = 2.0  # of the background


def read(guides, distance=1.0):
    """Return (SIZE, SIZE, 3) values over an even background."""
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    world_to_view, view_to_clip = scene.read_camera(bpy.context.scene, depsgraph, SIZE, SIZE)
    world_to_view = world_to_view.copy()
    world_to_view[2, 3] *= distance
    lights = drawn_scene.read(bpy.context.scene, bpy.context.view_layer, depsgraph).lights
    texture = gpu.types.GPUTexture((SIZE, SIZE), format="RGBA32F")
    depth = gpu.types.GPUTexture((SIZE, SIZE), format="DEPTH_COMPONENT32F")
    target = gpu.types.GPUFrameBuffer(color_slots=texture, depth_slot=depth)
    view = drawing.view_record(world_to_view, view_to_clip, SIZE, guide_lines.strip_width())
    with target.bind():
        target.clear(color=(LEVEL, LEVEL, LEVEL, 1.0), depth=1.0)
        guide_lines.draw(guides, view, lights, None)
        return np.array(target.read_color(0, 0, SIZE, SIZE, 4, 0, "FLOAT"))[..., :3]


@pytest.fixture
def guides(lit):
    return bpy.data.objects["Guides"]


@pytest.fixture
def upright(guides):
    """Return one upright guide beside the camera's axis."""
    points = np.zeros((len(guides.data.points), 3), np.float32)
    count = len(guides.data.points) // len(guides.data.curves)
    points[:count, 2] = np.linspace(-0.4, 0.4, count)
    points[count:] = points[0]  # others have no length
    points[:, 0] += 0.3
    guides.data.attributes["position"].data.foreach_set("vector", points.ravel())
    guides.data.update_tag()
    return guides


def row(picture):
    return LEVEL - picture[SIZE // 2].min(axis=0), picture[SIZE // 2]


@pytest.mark.parametrize("distance", [1.0, 2.0])
def test_a_line_is_as_wide_at_any_distance(upright, distance):
    """A line has the width of the settings at any distance: its opacity, summed across, is its width with the dark
    edges.
    """
    upright.data.vellus.guide_opacity = 1.0
    found = read(upright, distance)[SIZE // 2]
    line = guide_lines.strip_width() - guide_lines._FRINGE
    edges = 2.0 * 0.35 * 1.0  # two dark pixels; the ramps of both sides overlap within the line
    lost = LEVEL * SIZE - found.sum(axis=0)
    plain = np.array(guide_lines._PLAIN)
    np.testing.assert_allclose(lost, (LEVEL - plain) * line + LEVEL * edges, atol=0.35 * LEVEL)


def test_opacity_scales_all_of_it(upright):
    lost = []
    for opacity in (1.0, 0.5, 0.0):
        upright.data.vellus.guide_opacity = opacity
        lost.append(LEVEL - read(upright))
    assert lost[0].max() > 0.5
    np.testing.assert_allclose(lost[1], 0.5 * lost[0], atol=1e-3)
    assert not lost[2].any()


@pytest.mark.parametrize("part", [0.5, 1.0])
def test_frozen_points_are_drawn_faded(upright, part):
    """Frozen points of a guide are drawn with a quarter of the opacity, and other points as before."""
    upright.data.vellus.guide_opacity = 1.0
    before = LEVEL - read(upright)
    count = len(upright.data.points) // len(upright.data.curves)
    are_frozen = np.zeros(len(upright.data.points), bool)
    are_frozen[: round(part * count)] = True
    frozen_points.write(upright.data, are_frozen)
    lost = LEVEL - read(upright)
    rows = np.flatnonzero(before.sum(axis=(1, 2)) > 0.1)
    ratios = lost[rows].sum(axis=(1, 2)) / before[rows].sum(axis=(1, 2))
    upper, lower = ratios[-len(rows) // 5 :], ratios[: len(rows) // 5]
    np.testing.assert_allclose(lower, 0.25, atol=0.03)
    np.testing.assert_allclose(upper, 0.25 if part == 1.0 else 1.0, atol=0.03)
    frozen_points.write(upright.data, np.zeros(len(are_frozen), bool))
    np.testing.assert_allclose(LEVEL - read(upright), before, atol=1e-6)


def test_guides_are_colored_by_their_length(guides):
    """The shortest guides are blue and the longest ones red; guides of one length are green, whatever the length is."""
    guides.data.vellus.guide_opacity, guides.data.vellus.guide_colors = 1.0, "LENGTH"
    points, starts = curves.read_points(guides.data), curves.curve_offsets(guides.data)
    roots = np.repeat(points[starts[:-1]], np.diff(starts), axis=0)
    unit = points - roots
    sizes = ragged_lengths(points, starts)
    unit /= np.repeat(sizes, np.diff(starts))[:, None]

    def mean_color(lengths):
        write_points(guides, roots + np.repeat(lengths, np.diff(starts))[:, None] * unit)
        picture = read(guides)
        seen = picture[np.ptp(picture, axis=-1) > 0.02]
        return seen.mean(axis=0) / seen.mean()

    count, length = len(starts) - 1, sizes.mean()
    straight = mean_color(np.full(count, length))
    assert straight[1] > straight[[0, 2]].max()
    is_long = np.arange(count) < 1
    mostly_short = mean_color(length * np.where(is_long, 1.0, 0.9))
    mostly_long = mean_color(length * np.where(is_long, 0.9, 1.0))
    assert mostly_short[2] > mostly_short[0] and mostly_long[0] > mostly_long[2]


def test_colors_of_lengths_are_computed_once_per_change(guides, monkeypatch):
    """A redraw that nothing changed computes no lengths; changed guides have new colors."""
    guides.data.vellus.guide_opacity, guides.data.vellus.guide_colors = 1.0, "LENGTH"
    measured, real = [], ragged_lengths
    monkeypatch.setattr(strands, "ragged_lengths", lambda *given: measured.append(1) or real(*given))
    points = curves.read_points(guides.data)
    before = read(guides)
    np.testing.assert_array_equal(read(guides), before)
    assert len(measured) == 1
    points[0] += 0.3
    write_points(guides, points)
    assert np.abs(read(guides) - before).max() > 0.1 and len(measured) == 2


def test_guides_of_a_tie_share_a_color(guides):
    """Gathered guides have a color for each tie, others the plain one."""
    guides.data.vellus.guide_opacity, guides.data.vellus.guide_colors = 1.0, "PLAIN"
    plain = read(guides)
    guides.data.vellus.guide_colors = "TIE"
    np.testing.assert_array_equal(read(guides), plain)
    count = len(guides.data.curves)
    groups = np.arange(count) % 3
    gathered_groups.write(guides.data, gathered_groups.Gathered(groups, *np.zeros((2, count), np.float32)))
    assert len(hues(plain)) < len(hues(read(guides))) and abs(read(guides) - plain).max() > 0.05


def test_guides_of_a_clump_share_a_color(guides):
    """A guide has the color of the clump of most of its strands; a guide without a clump has the plain color."""
    guides.data.vellus.guide_opacity, guides.data.vellus.guide_colors = 1.0, "PLAIN"
    plain = read(guides)
    guides.data.vellus.guide_colors = "CLUMP"
    np.testing.assert_array_equal(read(guides), plain)
    hair = api.interpolate_hair(guides, strand_count=400)
    api.add_style(hair, "CLUMP", size=0.8)
    bpy.context.view_layer.update()
    numbers = bindings.of(hair).styles.styling.lock_numbers()
    nearest = bindings.of(hair).binding.guide_weights.indices.numpy()[:, 0]
    found = guide_lines._hues_of_clumps(len(guides.data.curves), numbers, nearest)
    for guide in np.unique(nearest):
        own = list(numbers[nearest == guide])
        assert own.count(found[guide]) == max(map(own.count, own))
    assert 3 < len(np.unique(found)) < 0.6 * len(found)
    colored = read(guides)
    assert abs(colored - plain).max() > 0.05 and len(hues(plain)) < len(hues(colored))


def test_guides_that_hair_does_not_follow_yet_are_not_colored_by_its_clumps(guides):
    """Guides that were added have no clump, and no number in the texture, until the hair follows them."""
    hair = api.interpolate_hair(guides, strand_count=400)
    api.add_style(hair, "CLUMP", size=0.8)
    guides.data.vellus.guide_colors = "CLUMP"
    bpy.context.view_layer.update()
    assert size_of_hues(guides) == len(guides.data.curves)
    hair.vellus.is_live = False
    bpy.context.view_layer.objects.active = guides
    bpy.ops.vellus.change_guide_count(guide_count=2 * len(guides.data.curves))
    bpy.context.view_layer.update()
    assert size_of_hues(guides) >= len(guides.data.curves)


def test_the_panel_says_when_clumps_are_unknown(guides):
    """As after a file was opened or a step was undone, until the hair changes."""
    hair = api.interpolate_hair(guides, strand_count=400)
    api.add_style(hair, "CLUMP", size=0.8)
    bpy.context.view_layer.update()
    bpy.context.view_layer.objects.active = guides
    guides.select_set(True)
    sentence = "Clumps are colored after the next change of the hair."
    for colors in ("CLUMP", "PLAIN"):
        guides.data.vellus.guide_colors = colors
        bindings.invalidate(hair)
        assert (sentence in note()) == (colors == "CLUMP")
    guides.data.vellus.guide_colors = "CLUMP"
    bpy.ops.vellus.guide_length(method="SCALE", factor=1.1)
    bpy.context.view_layer.update()
    assert bindings.of(hair) is not None and sentence not in note()


def note():
    """Return the text of the panel of hair systems."""
    return " ".join(draw(bpy.types.VELLUS_PT_systems).texts)


def size_of_hues(guides):
    texture = guide_lines._hues_texture(guides.data)
    return texture.width * texture.height


def hues(picture):
    """Return the distinct directions of color of pixels that differ from the background."""
    seen = picture[np.ptp(picture, axis=-1) > 0.02]
    return np.unique(np.round(seen / np.linalg.norm(seen, axis=-1, keepdims=True), 1), axis=0)


def test_guides_share_a_color_or_have_their_own(guides):
    guides.data.vellus.guide_opacity = 1.0
    found = {}
    for colors in ("PLAIN", "SYSTEM", "GUIDE"):
        guides.data.vellus.guide_colors = colors
        found[colors] = read(guides)
    assert len(hues(found["GUIDE"])) > 4 * len(hues(found["PLAIN"]))
    assert abs(found["SYSTEM"] - found["PLAIN"]).max() > 0.05
    guides.data.vellus.guide_colors = "SYSTEM"
    guides.data.name = "Beard Guides"
    assert abs(read(guides) - found["SYSTEM"]).max() > 0.05
