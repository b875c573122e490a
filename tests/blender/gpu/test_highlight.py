# SPDX-License-Identifier: GPL-3.0-or-later
"""The highlight of a strand is on the mirror cone, shifted by the cuticle's tilt."""

import math

import gpu
import numpy as np
import pytest
from mathutils import Vector

from hair_addon.blender.gpu import drawing, hair_shading, strand_textures, visibility_buffer
from hair_addon.blender.gpu.programs import scene_programs, uniforms
from hair_addon.core.shading.fibre import kajiya_kay
from hair_addon.core.shading.fibre.angles import FibreAngles
from hair_addon.core.shading.tables import lookup_tables
from tests.support.pairs import pairs

SIZE = 8  # pixels along a side of the picture; the strand fills it
RADIUS = 0.5  # of the strand [m]
STEP = math.radians(0.5)


@pytest.fixture(scope="module")
def strand():
    """Return a straight strand along Z with its root below."""
    points = np.zeros((1, 9, 3), np.float32)
    points[0, :, 2] = np.linspace(-2.0, 2.0, 9)
    return strand_textures.upload_strands(points, np.full((1, 9), RADIUS, np.float32))


@pytest.fixture(scope="module")
def no_shadow_maps():
    """Return textures for the samplers of shadow maps, which no light of these tests has."""
    return {name: gpu.types.GPUTexture((1, 1), layers=2, format="R32F") for name in scene_programs.SHADOW_SAMPLERS}


def towards(theta, phi=0.0):
    """Return the unit vector at an inclination and an azimuth about the strand."""
    return Vector((math.cos(theta) * math.cos(phi), math.cos(theta) * math.sin(phi), math.sin(theta)))


def brightness(strand, shading, shadow_maps, to_light, to_view):
    """Return (3,) radiance of the strand under a sun of 1 W/m², in the middle of a picture."""
    lights = uniforms.LIGHTS.record()
    lights["count"] = 1
    lights["light"][0]["axis"][:3] = -to_light
    lights["light"][0]["power"][:3] = 1.0
    lights["light"][0]["shadow_layer"] = -1
    view_to_world = to_view.to_track_quat("Z", "Y").to_matrix().to_4x4()
    view_to_world.translation = 5.0 * to_view
    view_to_clip = np.diag([4.0, 4.0, -0.1, 1.0])
    view_to_clip[2, 3] = -1.0
    view = drawing.view_record(np.array(view_to_world.inverted()), view_to_clip, SIZE)
    buffer = visibility_buffer.VisibilityBuffer(SIZE, SIZE)
    with buffer.surfaces():
        pass
    buffer.add_hair([(strand, shading, np.eye(4), shadow_maps, drawing.Steps())], lights, view)
    middle = np.array(buffer.color.read(), np.float32).reshape(SIZE, SIZE, 4)[SIZE // 2, SIZE // 2]
    assert middle[3] == 1.0  # the strand is there
    return middle[:3]


def brightest_theta_o(strand, shading, shadow_maps, theta_i, phi=2.0):
    """Return the viewing inclination at which the strand is brightest, for a fixed light."""
    theta_o = np.arange(-1.3, 1.3, STEP)
    to_light = towards(theta_i, phi)
    seen = [brightness(strand, shading, shadow_maps, to_light, towards(theta)).sum() for theta in theta_o]
    return theta_o[np.argmax(seen)]


@pytest.mark.parametrize("theta_i", [-0.7, 0.0, 0.4])
def test_kajiya_kay_is_brightest_on_the_mirror_cone(strand, no_shadow_maps, theta_i):
    settings = kajiya_kay.Settings(diffuse_color=(0.2, 0.2, 0.2), specular_color=(0.5, 0.5, 0.5), exponent=200.0)
    shading = hair_shading.kajiya_kay_shading(settings)
    brightest = brightest_theta_o(strand, shading, no_shadow_maps, theta_i)
    assert brightest == pytest.approx(-theta_i, abs=STEP)
    # The color of the highlight is its brightness there; the diffuse part, sin(T, L) / pi², comes on top.
    seen = brightness(strand, shading, no_shadow_maps, towards(theta_i, 2.0), towards(-theta_i))
    expected = 0.5 + 0.2 * math.cos(theta_i) / math.pi**2
    np.testing.assert_allclose(seen, expected, rtol=2.0**-10)  # a half float, cut off


@pytest.mark.parametrize(("theta_i", "tilt"), pairs([-0.5, 0.0, 0.3], [math.radians(6.0), math.radians(-3.0)], 2))
def test_the_first_highlight_of_marschner_is_shifted_towards_the_root_by_twice_the_tilt(
    strand, no_shadow_maps, theta_i, tilt
):
    """The first highlight peaks where (theta_i + theta_o) / 2 = -tilt; a black fiber has no other path
    [Marschner03].
    """
    settings = lookup_tables.Settings(sigma_a=(50.0, 50.0, 50.0), tilt=tilt, beta_r=math.radians(3.0), glint_gain=0.0)
    shading = hair_shading.marschner_shading(lookup_tables.bake(settings))
    # Half a degree of leave: 1 / cos²(theta_d) and Fresnel's factor vary across the lobe, and texels are 0.7° wide.
    brightest = brightest_theta_o(strand, shading, no_shadow_maps, theta_i, phi=0.5)
    assert brightest == pytest.approx(-theta_i - 2.0 * tilt, abs=STEP + math.radians(0.5))


def test_marschner_reads_its_tables_as_bright_as_they_are(strand, no_shadow_maps):
    """The picture from any direction has the brightness of the tables."""
    tables = lookup_tables.bake(lookup_tables.Settings())
    shading = hair_shading.marschner_shading(tables)
    for theta_i, theta_o, phi in [(0.3, -0.2, 0.4), (-0.6, 0.5, 2.9), (0.1, 0.3, -1.5), (0.0, 0.0, 0.0)]:
        seen = brightness(strand, shading, no_shadow_maps, towards(theta_i, phi), towards(theta_o))
        at = FibreAngles(*np.array([theta_i, theta_o, phi]))
        expected = lookup_tables.sample_scattering(tables, at) * math.cos(theta_i)
        np.testing.assert_allclose(seen, expected, rtol=5e-3, atol=1e-4)
