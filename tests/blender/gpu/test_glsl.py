# SPDX-License-Identifier: GPL-3.0-or-later
"""The shaders' functions equal their references in Python; functions without a reference satisfy their laws."""

import numpy as np
import pytest

from hair_addon.blender.gpu import hair_shading, strand_textures
from hair_addon.blender.gpu.programs import uniforms
from hair_addon.core.shading import appearance
from hair_addon.core.shading.fibre import angles, energy_conserving, kajiya_kay, longitudinal, marschner
from hair_addon.core.shading.fibre.principled import variance_from_roughness
from hair_addon.core.shading.tables import dual_scattering, lookup_tables
from tests.support.pictures import drawn_strands, glsl

AXES = ["ANGLES", "COSINES"]  # in the order of AXES_ANGLES and AXES_COSINES in fibre/marschner.glsl

# Dot products that rounding has carried past one, and grazing ones.
EDGE_COSINES = np.array([-1.0000001, -1.0, -0.9999999, -0.9999, -1e-7, 0.0, 1e-7, 0.9999, 0.9999999, 1.0, 1.0000001])


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


@pytest.fixture
def fibres(rng):
    """Return T, L, V, each (N, 3) float32: random, with L or V across, along, nearly along and opposite to the
    fiber.
    """
    T, L, V = unit(rng.normal(size=(3, 3000, 3)))
    along = np.array([0.0, 0.0, 1.0])
    special = unit(np.array([[0, 0, 1], [0, 0, -1], [1, 0, 0], [-1, 0, 0], [1e-3, 0, 1], [1, 0, 1e-4], [3, 4, 1]]))
    to_light, to_view = (values.reshape(-1, 3) for values in np.broadcast_arrays(special[:, None], special[None]))
    T = np.concatenate([T, np.broadcast_to(along, to_light.shape)])
    return {
        "T": T.astype(np.float32),
        "L": np.concatenate([L, to_light]).astype(np.float32),
        "V": np.concatenate([V, to_view]).astype(np.float32),
    }


def doubles(vectors):
    """Return the same directions for the reference, including their rounding to float32."""
    return (vectors[name].astype(np.float64) for name in "TLV")


@pytest.fixture(scope="module")
def sines():
    """Return all pairs of sines between -1 and 1 and of edge cases."""
    values = np.concatenate([np.linspace(-1.0, 1.0, 51), EDGE_COSINES]).astype(np.float32)
    return [grid.ravel() for grid in np.meshgrid(values, values)]


def assert_twins(shader, python, atol):
    np.testing.assert_allclose(shader, python, rtol=0.0, atol=atol)


# Angles


def test_sine_from_cosine(sines):
    x = np.concatenate([sines[0], 1.0 - np.geomspace(1e-7, 1.0, 500)]).astype(np.float32)
    shader = glsl.evaluate(glsl.source("fibre/fibre.glsl"), "float", "sin_from_cos(x)", x=x)
    # To the last digits near one too, where 1 - cos² has lost them.
    np.testing.assert_allclose(shader, angles.sin_from_cos(x.astype(np.float64)), rtol=1e-6)


def test_cosine_of_the_difference_angle(sines):
    sin_i, sin_o = sines
    shader = glsl.evaluate(glsl.source("fibre/fibre.glsl"), "float", "cos_theta_d(i, o)", i=sin_i, o=sin_o)
    python = angles.cos_theta_d(sin_i.astype(np.float64), sin_o.astype(np.float64))
    # Where it is near zero a root has lost half of the digits; its square is what counts.
    assert_twins(shader**2, python**2, 1e-6)
    assert_twins(shader, python, 5e-4)


def test_relative_azimuth(fibres):
    shader = glsl.evaluate(glsl.source("fibre/fibre.glsl"), "float", "relative_azimuth(T, L, V)", **fibres)
    T, L, V = doubles(fibres)
    # The azimuth of a direction is as uncertain as the direction's part across the fiber is short.
    across = np.minimum(angles.sin_from_cos(np.sum(T * L, axis=-1)), angles.sin_from_cos(np.sum(T * V, axis=-1)))
    error = np.abs(shader - np.abs(angles.relative_azimuth(T, L, V)))
    assert (error * np.maximum(across, 1e-2)).max() < 1e-5
    assert (shader[across == 0.0] == 0.0).all()


# Kajiya and Kay


def test_kajiya_kay_diffuse(fibres):
    shader = glsl.evaluate(glsl.source("fibre/kajiya_kay.glsl"), "float", "kajiya_kay_diffuse(T, L)", **fibres)
    T, L, _V = doubles(fibres)
    # Along the fiber sin(T, L) is the root of what rounding left of 1 - cos².
    assert_twins(shader**2, kajiya_kay.kajiya_kay_diffuse(T, L) ** 2, 1e-6)


@pytest.mark.parametrize("exponent", [1.0, 60.0, 500.0])
def test_kajiya_kay_specular(fibres, exponent):
    expression = f"kajiya_kay_specular(T, L, V, {exponent})"
    shader = glsl.evaluate(glsl.source("fibre/kajiya_kay.glsl"), "float", expression, **fibres)
    # A cosine that is off by a rounding error is off by `exponent` of them after the power.
    assert_twins(shader, kajiya_kay.kajiya_kay_specular(*doubles(fibres), exponent), 1e-5 + 5e-7 * exponent)


def test_kajiya_kay_reflection(fibres):
    settings = kajiya_kay.Settings(diffuse_color=(0.9, 0.4, 0.1), specular_color=(0.3, 0.2, 0.7), exponent=30.0)
    shader = shading_model("fibre/kajiya_kay.comp", settings, "hair_bsdf(T, L, V, 0.0)", **fibres)
    T, L, V = doubles(fibres)
    regular = angles.sin_from_cos(np.sum(T * L, axis=-1)) > 1e-2  # its diffuse part is a root, see above
    assert_twins(shader[regular], kajiya_kay.kajiya_kay(T, L, V, settings)[regular], 1e-5)


@pytest.mark.parametrize(("exponent", "tolerance"), [(1.0, 0.05), (10.0, 0.005), (60.0, 0.002), (400.0, 0.002)])
def test_kajiya_kay_albedo_is_the_mean_answer_to_a_uniform_surrounding(exponent, tolerance):
    """The mean radiance over all directions of light and view, in light of radiance one, equals the albedo that the
    shader uses.
    """
    settings = kajiya_kay.Settings(diffuse_color=(0.3, 0.0, 0.2), specular_color=(0.0, 0.3, 0.2), exponent=exponent)
    theta = np.pi * ((np.arange(180) + 0.5) / 180 - 0.5)
    theta_i, theta_o = (grid.ravel() for grid in np.meshgrid(theta, theta))
    directions = [np.stack([np.cos(t), np.zeros_like(t), np.sin(t)], axis=-1) for t in (theta_i, theta_o)]
    T = np.broadcast_to([0.0, 0.0, 1.0], directions[0].shape)
    reflected = shading_model(
        "fibre/kajiya_kay.comp", settings, "hair_bsdf(T, L, V, 0.0)", T=T, L=directions[0], V=directions[1]
    )
    # It does not depend on the azimuth, which is 2 pi of the solid angle 2 pi cos(theta) d(theta).
    over_lights = 2.0 * np.pi * (reflected * np.cos(theta_i)[:, None]).reshape(180, 180, 3).sum(axis=1) * np.pi / 180
    mean = np.average(over_lights, axis=0, weights=np.cos(theta))
    returned = (
        "vec3 returned(float sin_theta_o)\n{\n  vec3 all, towards, zonal_1, zonal_2;\n"
        "  hair_return(sin_theta_o, all, towards, zonal_1, zonal_2);\n  return all;\n}\n"
    )
    albedo = shading_model("fibre/kajiya_kay.comp", settings, "returned(T.x)", more=returned, T=T[:1])[0]
    np.testing.assert_allclose(albedo, mean, rtol=tolerance)


def shading_model(fragment, settings, expression, textures=None, more="", **inputs):
    """Return a function of a fragment shader or of GLSL that follows it, with its settings in a uniform block."""
    structs = uniforms.VIEW.source + uniforms.settings_block(type(settings)).source
    view = uniforms.VIEW.record()
    blocks = {"view": ("View", view), "settings": ("Settings", uniforms.fill(settings))}
    text = glsl.source(fragment) + more
    return glsl.evaluate(text, "vec3", expression, structs=structs, blocks=blocks, textures=textures, **inputs)


@pytest.mark.parametrize("model", ["fibre/kajiya_kay.comp", "fibre/energy_conserving.comp"])
@pytest.mark.parametrize("width", [0.1, 0.5])
def test_a_wide_light_is_as_many_narrow_ones(rng, model, width):
    """The light of a wide stripe of inclinations [rad] equals the sum of its narrow parts."""
    if model == "fibre/kajiya_kay.comp":
        settings, textures = kajiya_kay.Settings(diffuse_color=(0.0, 0.0, 0.0), exponent=60.0), {}
    else:
        settings = lookup_tables.Settings(mode="energy", size=64, roughness=0.3)
        textures = hair_shading.marschner_shading(lookup_tables.bake(settings)).samplers
    theta_i, theta_o = rng.uniform(-0.4, 0.4, (2, 200))
    phi = rng.uniform(0.0, np.pi, 200)
    tangent = np.broadcast_to([0.0, 0.0, 1.0], (200, 3))
    view = np.stack([np.cos(theta_o), np.zeros(200), np.sin(theta_o)], axis=-1)

    def radiance(theta, blur):
        light = np.stack([np.cos(theta) * np.cos(phi), np.cos(theta) * np.sin(phi), np.sin(theta)], axis=-1)
        expression = f"hair_bsdf(T, L, V, {blur})"
        return shading_model(model, settings, expression, textures=textures, T=tangent, L=light, V=view)

    stripe = width * ((np.arange(24) + 0.5) / 24 - 0.5)
    many = np.mean([radiance(theta_i + offset, 0.0) for offset in stripe], axis=0)
    once = radiance(theta_i, width**2 / 12.0)
    np.testing.assert_allclose(once, many, rtol=0.05, atol=0.08 * many.max())
    if width > 0.2:  # it is seen at all
        assert np.abs(radiance(theta_i, 0.0) - many).max() > 0.16 * many.max()


# Marschner


@pytest.mark.parametrize("axes", AXES)
def test_coordinates_of_the_tables(sines, axes):
    first, second = sines
    text = glsl.source("fibre/marschner.glsl")
    shader = glsl.evaluate(text, "vec2", f"m_coordinates(i, o, {AXES.index(axes)})", i=first, o=second)
    python = lookup_tables.m_coordinates(first.astype(np.float64), second.astype(np.float64), axes)
    assert_twins(shader, np.stack(python, axis=-1), 1e-5)

    phi = (np.pi * np.abs(np.clip(first, -1.0, 1.0))).astype(np.float32)
    shader = glsl.evaluate(text, "vec2", f"n_coordinates(phi, cosine, {AXES.index(axes)})", phi=phi, cosine=second)
    assert_twins(shader, np.stack(lookup_tables.n_coordinates(phi, second, axes), axis=-1), 1e-6)


def test_lobes_are_put_together(rng):
    m, n, n_trt = rng.random((2000, 3)), rng.random((2000, 4)), rng.random((2000, 3))
    cosine = np.concatenate([[0.0, 1e-9, 1e-4, 1e-3, 1.0], rng.random(1995)])
    expression = "marschner_scattering(m, n, n_trt, cosine)"
    text = glsl.source("fibre/marschner.glsl")
    shader = glsl.evaluate(text, "vec3", expression, m=m, n=n, n_trt=n_trt, cosine=cosine)
    np.testing.assert_allclose(shader, marschner.marschner_scattering(m, n, n_trt, cosine), rtol=1e-5)


@pytest.mark.parametrize("axes", AXES)
def test_marschner_reflection_is_read_from_the_tables(fibres, axes):
    """The complete hair_bsdf() on real textures equals the tables' own sampling times cos(theta_i)."""
    tables = lookup_tables.bake(lookup_tables.Settings(size=64, axes=axes))
    textures = hair_shading.marschner_shading(tables).samplers
    shader = shading_model(
        "fibre/marschner.comp", tables.settings, "hair_bsdf(T, L, V, 0.0)", textures=textures, **fibres
    )
    halves = lookup_tables.Tables(*(texels(table) for table in (tables.m, tables.n, tables.n_trt)), tables.settings)
    at = angles.fibre_angles(*doubles(fibres))
    python = lookup_tables.sample_scattering(halves, at) * np.cos(at.theta_i)[:, None]
    # Along the fiber S cos(theta_i) is nothing times infinity; a degree away rounding is all that differs, and texture
    # units that keep eight bits of the place between two texels.
    regular = (np.minimum(np.cos(at.theta_i), np.cos(at.theta_o)) > 0.02) & (np.cos(at.theta_d) > 0.02)
    np.testing.assert_allclose(shader[regular], python[regular], rtol=5e-3, atol=1e-4)
    assert np.isfinite(shader).all() and (shader >= 0.0).all()


# The energy-conserving mode


def test_bessel_function_without_its_overflow():
    x = np.concatenate([[0.0, 3.75, 3.7500002], np.geomspace(1e-6, 1e6, 2000)]).astype(np.float32)
    shader = glsl.evaluate(glsl.source("fibre/longitudinal.glsl"), "float", "i0e(x)", x=x)
    np.testing.assert_allclose(shader, longitudinal.i0e(x.astype(np.float64)), rtol=3e-6)


@pytest.mark.parametrize("roughness", [0.1, 0.3, 1.0])
def test_longitudinal_lobes(sines, roughness):
    sin_i, sin_o = (np.clip(values, -1.0, 1.0) for values in sines)
    text, expression = glsl.source("fibre/longitudinal.glsl"), f"m_lobes(i, o, 0.1, 4.0, {roughness}, 0.4, 0.0)"
    shader = glsl.evaluate(text, "vec4", expression, i=sin_i, o=sin_o)
    settings = lookup_tables.Settings(mode="energy", tilt=0.1, roughness=roughness, coat=0.4)
    python = energy_conserving.m_lobes(*(np.arcsin(values.astype(np.float64)) for values in (sin_i, sin_o)), settings)
    # Rounding of a sine near one moves its angle by 3e-4, a hundredth of the narrowest lobe's deviation or less.
    np.testing.assert_allclose(shader, python, rtol=1e-4, atol=1e-4 / variance_from_roughness(0.6 * roughness) ** 0.5)


@pytest.mark.parametrize("axes", AXES)
def test_energy_conserving_reflection_is_read_from_the_tables(fibres, axes):
    settings = lookup_tables.Settings(mode="energy", size=64, axes=axes, roughness=0.4, coat=0.5)
    tables = lookup_tables.bake(settings)
    textures = hair_shading.marschner_shading(tables).samplers
    shader = shading_model(
        "fibre/energy_conserving.comp", settings, "hair_bsdf(T, L, V, 0.0)", textures=textures, **fibres
    )
    arrays = (tables.m, tables.n, tables.n_trt, tables.n_res)
    m, n, n_trt, n_res = (texels(table) for table in arrays)
    halves = lookup_tables.Tables(m, n, n_trt, settings, n_res)
    at = angles.fibre_angles(*doubles(fibres))
    python = lookup_tables.sample_radiance(halves, at)
    regular = np.minimum(np.cos(at.theta_i), np.cos(at.theta_o)) > 0.02
    np.testing.assert_allclose(shader[regular], python[regular], rtol=5e-3, atol=1e-4)
    assert np.isfinite(shader).all() and (shader >= 0.0).all()


def test_dual_scattering_is_read_from_the_tables(fibres, rng):
    settings = lookup_tables.Settings(mode="energy", size=64, roughness=0.4, sigma_a=(0.1, 0.3, 0.8))
    tables = lookup_tables.bake(settings)
    textures = hair_shading.marschner_shading(tables).samplers
    front, behind = rng.uniform(0.0, 6.0, (2, len(fibres["T"]))).astype(np.float32)
    expression = "hair_radiance(T, L, V, front, behind, 0.0)"
    numbers = {"front": front, "behind": behind}
    shader = shading_model("fibre/energy_conserving.comp", settings, expression, textures=textures, **numbers, **fibres)
    halves = lookup_tables.Tables(*map(texels, (tables.m, tables.n, tables.n_trt)), settings, texels(tables.n_res))
    at = angles.fibre_angles(*doubles(fibres))
    python = dual_scattering.sample_radiance(
        halves, dual_scattering.bake(tables), at, *(n.astype(np.float64) for n in (front, behind))
    )
    regular = np.minimum(np.cos(at.theta_i), np.cos(at.theta_o)) > 0.05
    np.testing.assert_allclose(shader[regular], python[regular], rtol=1e-2, atol=2e-4)
    assert np.isfinite(shader).all() and (shader >= 0.0).all()


def texels(table):
    """Return a table rounded to half floats."""
    return table.astype(np.float16).astype(np.float64)


# Strands


@pytest.fixture(scope="module")
def strip():
    """Return (V, 3) integers strand, point, side of the triangle strip of 5 strands of 7 points."""
    text = glsl.source("strands/strip.glsl") + (
        "vec3 strip(int vertex) { int s, p; float side; strip_vertex(vertex, 7, s, p, side); "
        "return vec3(float(s), float(p), side); }\n"
    )
    return glsl.evaluate(text, "vec3", "strip(vertex)", vertex=np.arange(5 * (2 * 7 + 2))).astype(int)


def test_strip_covers_every_strand_between_its_points_and_nothing_else(strip):
    corners = np.stack([strip[:-2], strip[1:-1], strip[2:]], axis=1)  # (triangles, 3, strand point side)
    drawn = [triangle for triangle in corners.tolist() if len({tuple(corner) for corner in triangle}) == 3]
    assert all(len({strand for strand, _point, _side in triangle}) == 1 for triangle in drawn)
    spans = [(triangle[0][0], tuple(sorted({point for _strand, point, _side in triangle}))) for triangle in drawn]
    expected = [(strand, (point, point + 1)) for strand in range(5) for point in range(6)]
    assert sorted(spans) == sorted(2 * expected)  # two triangles a segment


def test_strip_passes_every_side_of_every_point_once_apart_from_its_ends(strip):
    found, counts = np.unique(strip, axis=0, return_counts=True)
    assert len(found) == 5 * 7 * 2
    is_end = (found[:, 1:] == [0, -1]).all(axis=1) | (found[:, 1:] == [6, 1]).all(axis=1)
    np.testing.assert_array_equal(counts, np.where(is_end, 2, 1))


STRAND_PLACE = """
vec3 place_of(int strand, int point, int point_count, int row_strands)
{
  ivec2 first = packed_first(strand, 0, point_count, row_strands);
  return packed_place(strands, first, packed_head(strands, first), point);
}
"""


@pytest.mark.parametrize(("strand_count", "point_count"), [(1, 2), (1000, 41), (3, 5000)])
def test_strand_texture_holds_the_points_where_the_shader_looks(rng, strand_count, point_count):
    points = rng.random((strand_count, point_count, 3), dtype=np.float32)
    radii = rng.random((strand_count, point_count), dtype=np.float32)
    uploaded = strand_textures.upload_strands(points, radii)
    strand, point = (grid.ravel() for grid in np.indices((strand_count, point_count)))
    found = glsl.evaluate(
        glsl.source("strands/packed_strand.glsl") + STRAND_PLACE,
        "vec3",
        f"place_of(strand, point, {point_count}, {uploaded.row_strands})",
        textures={"strands": uploaded.texture},
        strand=strand,
        point=point,
    ).reshape(points.shape)
    assert drawn_strands.are_drawn(found, points)
    np.testing.assert_allclose(found, drawn_strands.places(uploaded), rtol=0.0, atol=2.0**-22)
    step = radii.max() / 65535.0  # of 16 bits, to the nearest of which radii are rounded
    np.testing.assert_allclose(drawn_strands.radii(uploaded), radii, rtol=0.0, atol=0.51 * step)


def test_strip_side_is_a_unit_vector_across_the_strand_that_faces_the_viewer(fibres):
    T, V = fibres["T"], fibres["V"]
    side = glsl.evaluate(glsl.source("strands/strip.glsl"), "vec3", "strip_side(T, V)", T=T, V=V)
    np.testing.assert_allclose(np.linalg.norm(side, axis=1), 1.0, atol=1e-5)
    across = np.linalg.norm(np.cross(T, V), axis=1)
    np.testing.assert_allclose(np.sum(side * T, axis=1) * np.maximum(across, 1e-3), 0.0, atol=1e-6)
    np.testing.assert_allclose(np.sum(side * V, axis=1) * across, 0.0, atol=1e-6)


# Deep opacity


@pytest.mark.parametrize("least, most", [(0.0, 1.0), (0.25, 0.75), (0.0, 0.8)])
def test_share_of_the_wet_look(rng, least, most):
    wetness = np.concatenate([rng.random(500), np.linspace(0.0, 1.0, 11), [0.2501, 0.7499]]).astype(np.float32)
    text, expression = glsl.source("fibre/wet_share.glsl"), f"wet_share(wetness, {least}, {most})"
    shader = glsl.evaluate(text, "float", expression, wetness=wetness)
    assert_twins(shader, appearance.wet_share(wetness, least, most), 1e-6)
