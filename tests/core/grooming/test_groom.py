# SPDX-License-Identifier: GPL-3.0-or-later
"""The pipeline leads from a mesh to guides and strands, and refuses invalid input."""

import subprocess
import sys
from functools import partial

import numpy as np
import pytest
import warp as wp

from hair_addon.core.errors import HairError
from hair_addon.core.geometry import mesh as mesh_math
from hair_addon.core.geometry import strands
from hair_addon.core.geometry.mesh import SurfacePoints, TriMesh
from hair_addon.core.geometry.search import hash_grid
from hair_addon.core.geometry.strands import Strands
from hair_addon.core.grooming import following, groom
from hair_addon.core.grooming.groom import GuideSettings, HairSettings
from hair_addon.core.kernels import kernel_setup
from tests.support.devices import DEVICE
from tests.support.strands import hair as hair_of_arrays
from tests.support.strands.evenness import measure

bind_hair = partial(groom.bind_hair, device=DEVICE)
distribute_guides = partial(groom.distribute_guides, device=DEVICE)
from_numpy = partial(strands.from_numpy, device=DEVICE)
generate_hair = partial(hair_of_arrays.generate_hair, device=DEVICE)


@pytest.fixture(scope="module")
def guides(head, scalp):
    return distribute_guides(head, GuideSettings(guide_count=200), density=scalp)


@pytest.fixture(scope="module")
def hair_settings():
    return HairSettings(strand_count=2000)


@pytest.fixture(scope="module")
def hair(head, scalp, guides, hair_settings):
    return generate_hair(head, guides, hair_settings, density=scalp)


def test_guides_are_counted_rooted_and_finite(head, scalp, guides):
    points = guides.numpy()
    assert points.shape == (200, 41, 3)
    assert np.isfinite(points).all()
    np.testing.assert_allclose(points[:, 0], mesh_math.positions(head, guides.roots), atol=1e-6)
    assert mesh_math.interpolate(scalp, head, guides.roots).min() > 0.0


def test_strands_are_counted_rooted_and_finite(head, scalp, hair):
    points = hair.numpy()
    assert points.shape == (2000, 41, 3)
    assert np.isfinite(points).all()
    np.testing.assert_allclose(points[:, 0], mesh_math.positions(head, hair.roots), atol=1e-6)
    assert mesh_math.interpolate(scalp, head, hair.roots).min() > 0.0


def test_strands_look_like_the_guides_around_them(head, guides, hair):
    """Strands look like the guides around them: their tips are near some guide's tip, within the distance between
    guides.
    """
    tips, guide_tips = hair.numpy()[:, -1], guides.numpy()[:, -1]
    nearest = np.linalg.norm(tips[:, None] - guide_tips[None], axis=-1).min(axis=1)
    assert np.median(nearest) < 0.02 and nearest.max() < 0.1


def test_the_same_seed_gives_the_same_hair(head, scalp, guides, hair, hair_settings):
    again = distribute_guides(head, GuideSettings(guide_count=200), density=scalp)
    np.testing.assert_array_equal(again.numpy(), guides.numpy())
    np.testing.assert_array_equal(generate_hair(head, again, hair_settings, density=scalp).numpy(), hair.numpy())


@pytest.mark.skipif(DEVICE == "cpu", reason="needs VELLUS_TEST_DEVICE")
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_every_device_makes_the_same_hair(head, scalp, seed):
    """Every device gives the same hair to rounding, and guides that are equally even, as relaxation amplifies
    rounding.
    """
    settings = GuideSettings(seed=seed)
    guides = distribute_guides(head, settings, density=scalp)
    expected = groom.distribute_guides(head, settings, density=scalp)
    found, wanted = (measure(head, placed.roots, scalp) for placed in (guides, expected))
    np.testing.assert_allclose(found.relative_energy, wanted.relative_energy, rtol=0.01)
    assert found.share_variation < wanted.share_variation + 0.03
    settings = HairSettings(seed=seed)
    expected_hair = hair_of_arrays.generate_hair(head, expected, settings, density=scalp).numpy()
    # Guides that are on another device than the hair is wanted on come along.
    np.testing.assert_allclose(generate_hair(head, expected, settings, density=scalp).numpy(), expected_hair, atol=2e-6)


@pytest.mark.parametrize("stage", ["guides", "strands"])
def test_another_seed_gives_other_hair(head, scalp, guides, hair, stage):
    if stage == "guides":
        other = distribute_guides(head, GuideSettings(guide_count=200, seed=2), density=scalp)
        assert np.linalg.norm(other.numpy() - guides.numpy(), axis=-1).mean() > 0.01
    else:
        other = generate_hair(head, guides, HairSettings(strand_count=2000, seed=2), density=scalp)
        assert np.linalg.norm(other.numpy() - hair.numpy(), axis=-1).mean() > 0.01


def test_combing_searches_nothing(head, scalp, guides, hair, hair_settings, monkeypatch):
    """Combing searches nothing: moved guides move the strands that follow them by the same binding."""
    binding = bind_hair(head, guides, hair_settings, density=scalp)
    monkeypatch.setattr(hash_grid, "neighbours", None)
    np.testing.assert_array_equal(following.follow_guides(binding, guides).numpy(), hair.numpy())
    points = guides.numpy().copy()
    points[:, 1:] *= 1.01
    combed = following.follow_guides(binding, from_numpy(points, guides.roots)).numpy()
    np.testing.assert_array_equal(combed[:, 0], hair.numpy()[:, 0])
    assert np.linalg.norm(combed - hair.numpy(), axis=-1)[:, 1:].min() > 0.0


def test_strands_in_the_processors_memory(head, scalp, guides, hair, hair_settings):
    """Strands are copied from any device to new or given memory of the processor, all or some."""
    binding = bind_hair(head, guides, hair_settings, density=scalp)
    weights = following.weights_now(binding, guides)
    made, given = following.growing_points(binding, guides, weights).result(), np.full_like(hair.numpy(), np.nan)
    twice = 2.0 * np.eye(3)
    assert following.growing_points(binding, guides, weights, twice, given).result() is given
    np.testing.assert_array_equal(made, hair.numpy())
    np.testing.assert_array_equal(given, 2.0 * hair.numpy())
    chosen = np.arange(3, 2000, 7)
    some, _shares = following.follow_some(binding, guides, chosen)
    np.testing.assert_array_equal(some, made[chosen])
    some, _shares = following.follow_some(binding, guides, chosen, twice)
    np.testing.assert_array_equal(some, given[chosen])


def test_strands_have_as_many_points_as_the_guides(head, scalp, guides, hair_settings):
    coarse = from_numpy(guides.numpy()[:, ::8], guides.roots)
    assert generate_hair(head, coarse, hair_settings, density=scalp).numpy().shape == (2000, 6, 3)


def test_one_guide_is_enough(square):
    guide = distribute_guides(square, GuideSettings(guide_count=1, relax_iterations=0))
    hair = generate_hair(square, guide, HairSettings(strand_count=50)).numpy()
    shape = guide.numpy()[0] - guide.numpy()[0, 0]
    np.testing.assert_allclose(hair - hair[:, :1], np.broadcast_to(shape, hair.shape), atol=1e-6)


def test_influence_distance_is_obeyed(square):
    """With a tiny distance strands follow the nearest guide, with a huge distance the mean of all guides."""
    guides = distribute_guides(square, GuideSettings(guide_count=30))
    settings = {"strand_count": 300, "automatic_influence": False}
    narrow = generate_hair(square, guides, HairSettings(influence_distance=1e-6, **settings)).numpy()
    shapes, guide_shapes = narrow - narrow[:, :1], guides.numpy() - guides.numpy()[:, :1]
    apart = np.linalg.norm(narrow[:, None, 0] - guides.numpy()[None, :, 0], axis=-1)
    nearest, ordered = apart.argmin(axis=1), np.sort(apart, axis=1)
    alone = ordered[:, 1] > 1.25 * ordered[:, 0]
    assert alone.sum() > 200
    np.testing.assert_allclose(shapes[alone], guide_shapes[nearest][alone], atol=1e-5)
    settings |= {"keep_length": 0.0, "angle_limit": np.pi, "length_limit": 1e6}
    wide = generate_hair(square, guides, HairSettings(influence_distance=100.0, neighbour_limit=30, **settings))
    mean = np.broadcast_to(guide_shapes.mean(axis=0), narrow.shape)
    np.testing.assert_allclose(wide.numpy() - wide.numpy()[:, :1], mean, atol=1e-4)


def test_radii_run_from_root_to_tip():
    radii = groom.strand_radii(HairSettings(radius=1e-4, tip_taper=0.25))
    assert radii.shape == (41,) and radii.dtype == np.float32
    np.testing.assert_allclose(radii[[0, -1]], [1e-4, 0.25e-4])
    np.testing.assert_allclose(np.diff(radii, 2), 0.0, atol=1e-10)


def test_radii_that_no_surface_has_set_are_refused():
    with pytest.raises(HairError, match="radius is not set"):
        groom.strand_radii(HairSettings())


@pytest.mark.parametrize(
    ("settings_class", "values", "sentence"),
    [
        (GuideSettings, {"guide_count": 0}, "Guide count must be between 1 and"),
        (GuideSettings, {"guide_count": -5}, "Guide count"),
        (GuideSettings, {"length": 0.0}, "Length must be positive"),
        (GuideSettings, {"length": float("nan")}, "Length"),
        (GuideSettings, {"gravity": 1.5}, "Gravity must be between 0 and 1"),
        (GuideSettings, {"relax_iterations": -1}, "Even spacing"),
        (HairSettings, {"strand_count": 0}, "Strand count must be between 1 and"),
        (HairSettings, {"influence_distance": 0.0}, "Influence distance must be positive"),
        (HairSettings, {"influence_distance": -1.0}, "Influence distance"),
        (HairSettings, {"influence_distance": float("nan")}, "Influence distance"),
        (HairSettings, {"influence_distance": float("inf")}, "Influence distance"),
        (HairSettings, {"neighbour_limit": 33}, "Max guides per strand must be between 1 and 32"),
        (HairSettings, {"radius": 0.0}, "Radius must be positive"),
    ],
)
def test_refused_settings(settings_class, values, sentence):
    with pytest.raises(HairError, match=sentence):
        settings_class(**values)


@pytest.mark.parametrize(
    ("mesh", "density", "sentence"),
    [
        (TriMesh(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32)), None, "no faces"),
        (TriMesh(np.full((3, 3), np.nan, np.float32), np.array([(0, 1, 2)], np.int32)), None, "non-finite"),
        (TriMesh(np.ones((3, 3), np.float32), np.array([(0, 1, 2)], np.int32)), None, "zero area"),
        (TriMesh(np.eye(3, dtype=np.float32), np.array([(0, 1, 2)], np.int32)), np.zeros(3), "zero everywhere"),
        (TriMesh(np.eye(3, dtype=np.float32), np.array([(0, 1, 2)], np.int32)), np.ones(2), "one per vertex"),
    ],
)
def test_refused_surfaces(mesh, density, sentence, guides):
    rooted = SurfacePoints(np.zeros(1, np.int32), np.float32([[1, 0, 0]]))
    some = from_numpy(guides.numpy()[:1], rooted)
    with pytest.raises(HairError, match=sentence):
        distribute_guides(mesh, GuideSettings(), density=density)
    with pytest.raises(HairError, match=sentence):
        generate_hair(mesh, some, HairSettings(), density=density)


def test_refused_guides(head, guides, hair_settings):
    elsewhere = SurfacePoints(guides.roots.triangle + len(head.triangles), guides.roots.barycentric)
    with pytest.raises(HairError, match="200 guides are rooted on missing faces"):
        generate_hair(head, Strands(guides.points, elsewhere), hair_settings)
    none = from_numpy(np.zeros((0, 41, 3)), guides.roots[:0])
    with pytest.raises(HairError, match="no guides"):
        generate_hair(head, none, hair_settings)
    binding = bind_hair(head, guides, hair_settings)
    with pytest.raises(HairError, match="bound to 200 guides, but there are 10"):
        following.follow_guides(binding, from_numpy(guides.numpy()[:10], guides.roots[:10]))


def test_settings_do_not_import_warp():
    """Reading the settings' file does not import Warp, as Blender imports the file while it starts."""
    code = "import sys, hair_addon.core.grooming.groom; sys.exit('warp' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_every_kernel_is_compiled_in_the_step_that_says_so(head, monkeypatch):
    """Every kernel is loaded before its launch, so nobody waits for a compiler unannounced."""
    loaded, launched, launch = set(), set(), wp.launch
    monkeypatch.setattr(
        kernel_setup, "load", lambda modules, *_others: loaded.update(module.name for module in modules)
    )
    monkeypatch.setattr(
        wp, "launch", lambda kernel, *a, **k: (launched.add(kernel.module.name), launch(kernel, *a, **k))
    )
    guides = groom.distribute_guides(head, groom.GuideSettings(guide_count=50), device=DEVICE)
    generate_hair(head, guides, groom.HairSettings(strand_count=100), device=DEVICE)
    assert {name.rsplit(".", 1)[1] for name in launched} >= {"hash_grid", "guide_weights", "root_frames"}
    assert launched <= loaded
