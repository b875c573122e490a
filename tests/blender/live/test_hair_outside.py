# SPDX-License-Identifier: GPL-3.0-or-later
"""Keep Hair Outside: renders read strands that are outside of a ball that passes between their guides."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.groom.dynamics import guide_baking
from hair_addon.blender.live import dynamics_state
from hair_addon.blender.render import hair_cache
from hair_addon.core.long_work import run_now
from tests.support.dynamics.swung import simulate
from tests.support.pictures import drawn_strands
from tests.support.reading import evaluated_points, points

RADIUS, LAST = 0.15, 8


@pytest.fixture
def baked(hair, tmp_path):
    """Return (guides, hair) that sag, baked, with a ball that moves into the hair between them until frame 8."""
    guides = bpy.data.objects["Guides"]
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4, radius=RADIUS)
    ball = bpy.context.object
    ball.name = "Ball"
    middles = points(hair)[:, 25]
    distances = np.linalg.norm(middles[:, None] - points(guides)[:, 25], axis=2).min(axis=1)
    there = middles[distances.argmax()]
    for frame, place in ((1, 3.0 * there), (LAST, there)):
        ball.location = place
        ball.keyframe_insert("location", frame=frame)
    body = bpy.data.collections.new("Body")
    bpy.context.scene.collection.children.link(body)
    body.objects.link(ball)
    simulate(guides, tmp_path, colliders="Body", sag_free=False, gravity=0.1)
    run_now(guide_baking.baking([guides.data], LAST, bpy.context.scene))
    return guides, hair


def world_points(hair):
    matrix = np.array(hair.matrix_world)
    return points(hair) @ matrix[:3, :3].T + matrix[:3, 3]


def deepest(hair):
    """Return how far the deepest point of rendered hair is inside the ball [m], below its facets."""
    ball = bpy.data.objects["Ball"]
    faces = np.array([face.center.length for face in ball.data.polygons])
    middle = np.array(ball.matrix_world.translation)
    return faces.min() - np.linalg.norm(world_points(hair) - middle, axis=-1).min()


def test_no_strand_is_inside_the_ball(baked):
    guides, hair = baked
    scene = bpy.context.scene
    scene.frame_set(LAST)
    through = points(hair)
    assert deepest(hair) > 0.01
    guides.data.vellus.dynamics.keeps_hair_outside = True
    bpy.context.view_layer.update()
    assert deepest(hair) < 1e-5
    kept = points(hair)
    assert drawn_strands.are_drawn(drawn_strands.places(hair_cache.strands_on_gpu(hair.data)), kept)
    np.testing.assert_array_equal(kept[:, 0], through[:, 0])
    sizes = [np.linalg.norm(np.diff(p, axis=1), axis=2).sum(axis=1) for p in (kept, through)]
    assert abs(sizes[0] / sizes[1] - 1.0).max() < 0.05
    for frame in (3, 6, LAST):
        scene.frame_set(frame)
        assert deepest(hair) < 1e-5
    np.testing.assert_array_equal(points(hair), kept)
    assert dynamics_state.state_of(guides.data)[0] == "Frames {first} to {last} are baked"
    assert run_now(guide_baking.baking([guides.data], LAST, scene))[0].simulated == 0
    guides.data.vellus.dynamics.keeps_hair_outside = False
    bpy.context.view_layer.update()
    np.testing.assert_allclose(points(hair), through, atol=1e-6)


def test_a_ball_among_guides_that_do_not_move_is_kept_out_too(baked):
    """Strands are kept outside of a ball that moves among resting guides."""
    guides, hair = baked
    guides.data.vellus.dynamics.keeps_hair_outside = True
    scene = bpy.context.scene
    scene.frame_set(LAST)
    ball = bpy.data.objects["Ball"]
    ball.animation_data_clear()
    for _ in range(2):
        ball.location.z += 0.05
        scene.frame_set(LAST)
        assert deepest(hair) < 1e-5


def test_what_cycles_reads_is_outside(baked):
    """Strands evaluated for Cycles are outside after nodes have moved them with their surface."""
    guides, hair = baked
    guides.data.vellus.dynamics.keeps_hair_outside = True
    bpy.context.scene.frame_set(LAST)
    ball = bpy.data.objects["Ball"]
    to_ball = np.array(ball.matrix_world.inverted() @ hair.matrix_world)
    seen = evaluated_points(hair) @ to_ball[:3, :3].T + to_ball[:3, 3]
    assert np.linalg.norm(seen, axis=-1).min() > min(face.center.length for face in ball.data.polygons) - 1e-5
