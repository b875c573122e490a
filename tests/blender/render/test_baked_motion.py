# SPDX-License-Identifier: GPL-3.0-or-later
"""Baked hair has motion blur in Cycles, and motion vectors in Vellus."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.groom.dynamics import frame_folders, guide_baking
from hair_addon.blender.render import motion_vectors
from hair_addon.core.files import frame_cache
from hair_addon.core.geometry import packed_strands
from hair_addon.core.long_work import run_now
from tests.support.dynamics.swung import simulate, swing
from tests.support.pictures import drawn_strands
from tests.support.pictures.rendering import rendered
from tests.support.reading import points

FRAME = 8
FRAME_RATE = 24
SMALL = {"engine": "CYCLES", "resolution_x": 32, "resolution_y": 24}


@pytest.fixture
def baked(lit, tmp_path):
    """Return thick hair on a sphere that swings before a camera, with baked frames."""
    swing(bpy.data.objects["Sphere"])
    lit.data.vellus.hair.radius = 0.03
    simulate(bpy.data.objects["Guides"], tmp_path / "frames", substeps=4)
    run_now(guide_baking.baking([bpy.data.objects["Guides"].data], FRAME + 1, bpy.context.scene))
    bpy.context.scene.frame_set(FRAME)
    return lit


def at(hair, time):
    bpy.context.scene.frame_set(int(time // 1), subframe=time % 1)
    return points(hair)


def bake_linear_motion(guides):
    """Replace the baked frames by frames in which guides bend to the side at constant speed."""
    folder = frame_folders.folder_of(guides.data)
    combed = points(guides)
    bend = np.float32([0.02, 0.006, -0.004]) * np.linspace(0.0, 1.0, combed.shape[1], dtype=np.float32)[:, None] ** 2
    with frame_cache.baking(folder, frame_cache.FrameCache(folder).manifest) as writer:
        for frame in range(FRAME - 2, FRAME + 3):
            writer.write_frame(frame, combed + (frame - FRAME) * bend, 32 * "0")
        writer.complete()
    frame_folders.forget(guides.data)


@pytest.mark.gate(id="V23")
@pytest.mark.long
def test_cycles_blurs_as_velocities_of_the_points_do(baked, tmp_path):
    bpy.data.objects["Camera"].data.lens = 200.0
    baked.data.vellus.hair.neighbour_limit, baked.data.vellus.hair.keep_length = 1, 0.0
    bake_linear_motion(bpy.data.objects["Guides"])
    scene = bpy.context.scene
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 0.5
    scene.cycles.samples, scene.cycles.seed, scene.cycles.device = 512, 3, "CPU"
    scene.cycles.max_bounces = 0  # a path that goes another way by a rounding is a 512th of a pixel
    # Segments of thick strands overlap: whether one shades the next is decided by roundings where they meet.
    bpy.data.objects["Sun"].data.use_shadow = False
    before, now, after = (at(baked, FRAME + offset) for offset in (-0.25, 0.0, 0.25))
    is_bent = abs(before + after - 2.0 * now).max(axis=(1, 2)) > 1e-5  # by sums of guides that disagree: not shown
    radii = np.where(is_bent, 0.0, 0.03).repeat(now.shape[1])
    baked.data.attributes["radius"].data.foreach_set("value", radii)
    scene.frame_set(FRAME)
    followed = rendered(tmp_path, **SMALL)["Combined"]
    frozen = baked.copy()
    frozen.data = baked.data.copy()
    frozen.data.vellus.kind = "NONE"
    frozen.modifiers.clear()
    scene.collection.objects.link(frozen)
    baked.hide_render = True
    still = rendered(tmp_path, **SMALL)["Combined"]
    velocity = frozen.data.attributes.new("velocity", "FLOAT_VECTOR", "POINT")
    velocity.data.foreach_set("vector", ((after - before) / 0.5 * FRAME_RATE).ravel())
    by_velocity = rendered(tmp_path, **SMALL)["Combined"]
    # A few of a pixel's paths go another way, by the processor's rounding.
    assert abs(followed - by_velocity).max() <= 2.0 / 255.0
    assert abs(followed - still).max() > 6.0 / 255.0


@pytest.mark.gate(id="V22")
def test_vectors_lead_from_frame_to_frame(baked, tmp_path, monkeypatch):
    seen = []
    draw = motion_vectors.draw

    def drawing(drawn, motion, *others):
        for moment in (motion.before, motion.now, motion.after):
            ((texture, (strand_count, point_count), *_place),) = moment.hair.values()
            texels = drawn_strands.texels(texture, strand_count, packed_strands.texel_count(point_count))
            seen.append(packed_strands.unpack(texels))
        return draw(drawn, motion, *others)

    monkeypatch.setattr(motion_vectors, "draw", drawing)
    bpy.context.view_layer.use_pass_vector = True
    rendered(tmp_path, sample_count=1)
    expected = [at(baked, FRAME + offset) for offset in (-1, 0, 1)]
    for found, there in zip(seen, expected, strict=True):
        np.testing.assert_allclose(found, there, atol=1e-6)
    assert abs(expected[0] - expected[2]).max() > 0.01
