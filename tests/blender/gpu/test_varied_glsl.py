# SPDX-License-Identifier: GPL-3.0-or-later
"""The shaders' functions and models of varied strands equal their references in Python."""

from dataclasses import replace

import numpy as np
import pytest

from hair_addon.blender.gpu import hair_shading, strand_textures
from hair_addon.blender.gpu.programs import uniforms
from hair_addon.core.shading import appearance
from hair_addon.core.shading.appearance import Appearance
from hair_addon.core.shading.fibre import angles, elliptic_section, kajiya_kay, marschner, pigment, strand_variation
from hair_addon.core.shading.fibre.principled import varied_roughness
from hair_addon.core.shading.tables import absorption_slices, lookup_tables, strand_tables
from tests.blender.gpu.test_glsl import doubles, fibres, unit  # noqa: F401 (a fixture)
from tests.support.pictures import glsl

# Each differs in something of its own; the last is a little melanin, whose logarithm loses digits.
LOOKS = [
    Appearance(melanin=0.6, random_color=0.8, random_roughness=0.5, tip_absorption=0.3, tip_tint=(0.8, 0.1, 0.4)),
    Appearance(melanin=0.99, random_color=1.0, tint=(0.2, 0.5, 0.9), gradient_start=0.7, gradient_end=0.2),
    Appearance(parametrization="ABSORPTION", random_color=0.5, tip_absorption=4.0, coat=0.5, random_roughness=1.0),
    Appearance(parametrization="COLOR", color=(0.4, 0.2, 0.1), tip_tint=(0.3, 0.3, 0.3), gradient_start=0.0),
    Appearance(melanin=0.002, random_color=1.0),
]
COUNT = 2000

# The results of a function, one by one.
RETURNS = """
vec3 hair_return_part(float sine, int part) {
  vec3 parts[4];
  hair_return(sine, parts[0], parts[1], parts[2], parts[3]);
  return parts[part];
}
"""

# Inputs of a model from the rasterizer: the strand under a fragment.
STRAND = "int strand_index; float strand_position;\n"


@pytest.fixture
def strands(rng):
    """Return random numbers and positions of COUNT strands, including both ends."""
    ends = [grid.ravel() for grid in np.meshgrid([0.0, 1.0], [0.0, 0.5, 1.0])]
    return [np.concatenate([end, rng.random(COUNT - 6)]).astype(np.float32) for end in ends]


def block(instance, settings):
    """Return (declaration, value) of a uniform block for `glsl.evaluate`."""
    declared = uniforms.settings_block(type(settings), instance)
    return declared.source, (declared.type_name, uniforms.fill(settings))


@pytest.mark.parametrize("look", LOOKS)
def test_absorption_along_strands(look, strands):
    variation = appearance.strand_settings(look)
    random, position = strands
    source, record = block("variation", variation)
    gradient = "tip_gradient(variation.gradient_start, variation.gradient_end, position)"
    shader = glsl.evaluate(
        glsl.source("strands/strand_variation.glsl"),
        "vec3",
        f"sigma_a_along(variation, random, {gradient})",
        structs=source,
        blocks={"variation": record},
        random=random,
        position=position,
    )
    python = strand_variation.strand_sigma_a(variation, random.astype(float), position.astype(float))
    # 1 - melanin keeps seven digits, which near black its logarithm divides by what is left of light.
    np.testing.assert_allclose(shader, python, rtol=2e-3 if look.melanin > 0.9 else 1e-4, atol=1e-5)


def test_roughness_of_strands(rng):
    roughness, amount, random = rng.random((3, COUNT)).astype(np.float32)
    text = glsl.source("surfaces/principled.glsl")
    expression = "varied_roughness(roughness, amount, random)"
    shader = glsl.evaluate(text, "float", expression, roughness=roughness, amount=amount, random=random)
    np.testing.assert_allclose(shader, varied_roughness(roughness, amount, random), atol=1e-6)


@pytest.mark.parametrize(("low", "high"), [(0.0, 3.0), (0.2, 0.7), (0.5, 0.5)])
def test_place_among_slices(rng, low, high):
    """The interpolated position among slices equals the reference; the index may differ by one for values on a
    slice.
    """
    sigma_a = np.concatenate([[0.0, 99.0], np.square(rng.uniform(0.0, 3.0, COUNT))]).astype(np.float32)
    text = glsl.source("fibre/absorption_slices.glsl")
    shader = glsl.evaluate(text, "vec2", f"slice_of(x, {low}, {high}, 16)", x=sigma_a).sum(axis=1)
    python = np.sum(absorption_slices.slice_of(sigma_a.astype(float), low, high, 16), axis=0)
    if low < high:
        np.testing.assert_allclose(shader, python, atol=1e-4)
    assert (shader >= 0.0).all() and (shader <= 15.0).all()


def test_geometric_mix(rng):
    a, b = (np.where(rng.random((COUNT, 4)) < 0.1, 0.0, rng.random((COUNT, 4)) ** 4) for _ in range(2))
    fraction = rng.random(COUNT)
    text = glsl.source("fibre/absorption_slices.glsl")
    shader = glsl.evaluate(text, "vec4", "geometric_mix(a, b, fraction)", a=a, b=b, fraction=fraction)
    np.testing.assert_allclose(shader, absorption_slices.geometric_mix(a, b, fraction[:, None]), atol=1e-5)


def test_gaussian_lobes(rng):
    theta_h, roughness = rng.uniform(-1.5, 1.5, COUNT), rng.random(COUNT)
    expression = "gaussian_lobes(theta_h, 0.1, 1.5, beta_r_of(roughness), 0.0)"
    text = glsl.source("fibre/marschner.glsl")
    shader = glsl.evaluate(text, "vec3", expression, theta_h=theta_h, roughness=roughness)
    settings = marschner.Settings(tilt=0.1, shifts="PUBLISHED")
    python = marschner.gaussian_lobes(theta_h, settings, marschner.beta_r_of(roughness))
    np.testing.assert_allclose(shader, python, rtol=1e-4, atol=1e-4)


def test_color_and_highlight_of_strands(rng):
    sigma_a, roughness = rng.random((COUNT, 3)) * 5.0, rng.random(COUNT)
    text = glsl.source("fibre/kajiya_kay.glsl")
    shader = glsl.evaluate(text, "vec3", "color_from_falloff(sigma_a, 5.5)", sigma_a=sigma_a)
    np.testing.assert_allclose(shader, pigment.color_from_falloff(sigma_a, 5.5), atol=1e-6)
    shader = glsl.evaluate(text, "float", "highlight_exponent(roughness)", roughness=roughness)
    exponent = kajiya_kay.highlight_exponent(roughness)
    np.testing.assert_allclose(shader, exponent, rtol=1e-4)
    shader = glsl.evaluate(text, "float", "highlight_peak(0.08, exponent)", exponent=exponent)
    np.testing.assert_allclose(shader, kajiya_kay.highlight_peak(0.08, exponent), rtol=1e-5)


# Whole models


def model(fragment, expression, settings, textures, strands, **inputs):
    """Return a function of a fragment shader at (random, position) of strands."""
    random, position = strands
    blocks = [(name, *block(name, values)) for name, values in settings.items()]
    view = uniforms.VIEW.record()
    points = np.zeros((len(random), 2, 3), np.float32)
    uploaded = strand_textures.upload_strands(points, np.ones((len(random), 2), np.float32), random)
    view["row_strands"] = uploaded.row_strands
    arguments = "".join(f", {'float' if np.ndim(values) == 1 else 'vec3'} {name}" for name, values in inputs.items())
    probe = (
        f"vec3 probe(int index, float position{arguments})\n{{\n"
        f"  strand_index = index;\n  strand_position = position;\n  return {expression};\n}}\n"
    )
    return glsl.evaluate(
        STRAND + glsl.source(fragment) + RETURNS + probe,
        "vec3",
        f"probe({', '.join(('index', 'position', *inputs))})",
        structs=uniforms.VIEW.source + "".join(source for _name, source, _record in blocks),
        blocks={"view": ("View", view)} | {name: record for name, _source, record in blocks},
        textures=textures | {"strand_randoms": uploaded.randoms},
        volumes=("n_slices", "n_g_slices", "n_trt_slices", "dual_table"),
        index=np.arange(len(random)),
        position=position,
        **inputs,
    )


def as_halves(tables):
    """Return tables rounded to half floats, as in textures."""
    slices = tables.slices
    n, n_g = (None if texels is None else texels.astype(np.float16).astype(float) for texels in (slices.n, slices.n_g))
    return replace(tables, slices=replace(slices, n=n, n_g=n_g))


def directions(rng):
    """Return T, L, V, each (COUNT, 3) float32."""
    return dict(zip("TLV", unit(rng.normal(size=(3, COUNT, 3))).astype(np.float32), strict=True))


def regular(at):
    return np.minimum(np.cos(at.theta_i), np.cos(at.theta_o)) > 0.05


@pytest.fixture(params=["energy", "classic"])
def tables(request):
    look = replace(LOOKS[0], mode=request.param)
    base = lookup_tables.Settings(size=64)
    return strand_tables.bake(appearance.table_settings(look, base), appearance.strand_settings(look))


def settings_of(tables):
    return {"settings": tables.settings, "variation": tables.variation, "slices": tables.slices.range}


def test_marschner_models_read_the_slices(rng, tables, strands):
    """hair_bsdf() of both modes uses the absorption and roughness of each strand."""
    shading = hair_shading.marschner_strand_shading(tables)
    fragment = (
        "fibre/energy_conserving_varied.comp" if tables.settings.mode == "energy" else "fibre/marschner_varied.comp"
    )
    inputs = directions(rng)
    shader = model(fragment, "hair_bsdf(T, L, V, 0.0)", settings_of(tables), shading.samplers, strands, **inputs)
    at = angles.fibre_angles(*doubles(inputs))
    random, position = (values.astype(float) for values in strands)
    python = absorption_slices.sample_radiance(
        as_halves(tables).slices,
        at,
        strand_variation.strand_sigma_a(tables.variation, random, position),
        varied_roughness(tables.settings.roughness, tables.variation.random_roughness, random),
    )
    where = regular(at) & (np.cos(at.theta_d) > 0.05)
    # Texture units keep eight bits of the place between two texels.
    np.testing.assert_allclose(shader[where], python[where], rtol=1e-2, atol=2e-4)
    assert np.isfinite(shader).all() and (shader >= 0.0).all()


def test_inner_reflection_of_elliptic_fibres(rng, strands):
    """The major axis of each strand is its own; inner reflection along a strand's own direction has no axis."""
    look, base = replace(LOOKS[0], mode="classic"), lookup_tables.Settings(size=64, eccentricity=0.85)
    tables = strand_tables.bake(appearance.table_settings(look, base), appearance.strand_settings(look))
    shading = hair_shading.marschner_strand_shading(tables)
    inputs = directions(rng)
    shader = model(
        "fibre/marschner_elliptic.comp",
        "hair_bsdf(T, L, V, 0.0)",
        settings_of(tables),
        shading.samplers,
        strands,
        **inputs,
    )
    random, position = (values.astype(float) for values in strands)
    tangent, to_light, to_view = doubles(inputs)
    axis = elliptic_section.major_axis(tangent, random)
    at = angles.fibre_angles(tangent, to_light, to_view)
    python = absorption_slices.sample_radiance(
        as_halves(tables).slices,
        at,
        strand_variation.strand_sigma_a(tables.variation, random, position),
        varied_roughness(tables.settings.roughness, tables.variation.random_roughness, random),
        elliptic_section.cos_twice_phi_h(tangent, axis, to_light, to_view),
    )
    where = regular(at) & (np.cos(at.theta_d) > 0.05)
    np.testing.assert_allclose(shader[where], python[where], rtol=1e-2, atol=1e-3)
    assert np.isfinite(shader).all() and (shader >= 0.0).all()


def test_elliptic_section(rng, strands):
    text = glsl.source("fibre/elliptic_section.glsl")
    inputs = directions(rng)
    tangent, to_light, to_view = doubles(inputs)
    axis = elliptic_section.major_axis(tangent, strands[0].astype(float))
    shader = glsl.evaluate(text, "vec3", "major_axis(T, random)", T=inputs["T"], random=strands[0])
    np.testing.assert_allclose(shader, axis, atol=2e-3)  # of 1021 turns single precision keeps four digits
    shader = glsl.evaluate(text, "float", "cos_twice_phi_h(T, axis, L, V)", axis=axis, **inputs)
    cosine = elliptic_section.cos_twice_phi_h(tangent, axis, to_light, to_view)
    np.testing.assert_allclose(shader, cosine, atol=1e-4)
    shader = glsl.evaluate(text, "vec4", "layer_weights(cosine)", cosine=cosine)
    np.testing.assert_allclose(shader, elliptic_section.layer_weights(cosine), atol=1e-5)


def test_dual_scattering_among_strands_that_differ(rng, strands):
    look = LOOKS[0]
    settings = appearance.table_settings(look, lookup_tables.Settings(size=64))
    tables = strand_tables.bake(settings, appearance.strand_settings(look))
    shading = hair_shading.marschner_strand_shading(tables)
    front, behind = rng.uniform(0.0, 6.0, (2, COUNT)).astype(np.float32)
    inputs = directions(rng)
    shader = model(
        "fibre/energy_conserving_varied.comp",
        "hair_radiance(T, L, V, front, behind, 0.0)",
        settings_of(tables),
        shading.samplers,
        strands,
        front=front,
        behind=behind,
        **inputs,
    )
    at = angles.fibre_angles(*doubles(inputs))
    random, position = (values.astype(float) for values in strands)
    python = strand_tables.sample_radiance(
        as_halves(tables), at, random, position, front.astype(float), behind.astype(float)
    )
    np.testing.assert_allclose(shader[regular(at)], python[regular(at)], rtol=1e-2, atol=2e-4)


@pytest.mark.parametrize("row", range(4))
def test_even_light_takes_the_colour_of_the_place(rng, tables, strands, row):
    shading = hair_shading.marschner_strand_shading(tables)
    fragment = (
        "fibre/energy_conserving_varied.comp" if tables.settings.mode == "energy" else "fibre/marschner_varied.comp"
    )
    theta_o = rng.uniform(-1.5, 1.5, COUNT)
    expression = f"hair_return_part(sine, {row})"
    shader = model(
        fragment, expression, settings_of(tables), shading.samplers, strands, sine=np.sin(theta_o).astype(np.float32)
    )
    python = strand_tables.hair_return(tables, theta_o, *(values.astype(float) for values in strands))[row]
    np.testing.assert_allclose(shader, python, rtol=1e-2, atol=2e-3)


@pytest.mark.parametrize("look", LOOKS)
def test_kajiya_kay_of_strands_that_differ(rng, look, strands):
    settings = {
        "settings": appearance.kajiya_kay_strand_settings(look),
        "variation": appearance.strand_settings(look),
    }
    inputs = directions(rng)
    shader = model("fibre/kajiya_kay_varied.comp", "hair_bsdf(T, L, V, 0.0)", settings, {}, strands, **inputs)
    random, position = (values.astype(float) for values in strands)
    sigma_a = strand_variation.strand_sigma_a(settings["variation"], random, position)
    roughness = varied_roughness(look.roughness, look.random_roughness, random)
    python = kajiya_kay.kajiya_kay_of_strands(*doubles(inputs), settings["settings"], sigma_a, roughness)
    np.testing.assert_allclose(shader, python, rtol=1e-2, atol=1e-4)


def test_kajiya_kay_of_an_average_strand_is_that_of_even_hair(rng):
    look = replace(LOOKS[0], coat=0.2)
    T, L, V = doubles(directions(rng))
    even = kajiya_kay.kajiya_kay(T, L, V, appearance.kajiya_kay_settings(look))
    sigma_a = np.broadcast_to(appearance.sigma_a(look), (COUNT, 3))
    settings = appearance.kajiya_kay_strand_settings(look)
    np.testing.assert_allclose(
        kajiya_kay.kajiya_kay_of_strands(T, L, V, settings, sigma_a, look.roughness), even, rtol=1e-9
    )
