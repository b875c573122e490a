# SPDX-License-Identifier: GPL-3.0-or-later
"""Scattering of a path at a surface: value and sampling of a diffuse surface below a rough dielectric, or of metal, as
in surface_light.glsl.

Microfacets have the GGX distribution [Walter07]. Directions are sampled from visible microfacets [Heitz18] or from the
diffuse part, in proportion to their albedos; the density is that of the mixture.
"""

import warp as wp

from .fibre_walk import PI, reflectance

wp.set_module_options({"enable_backward": False, "fast_math": True})

_LEAST_COSINE = wp.constant(1e-3)
_SMOOTHEST = wp.constant(0.03)  # least roughness, as in shaders/surfaces/surface_material.glsl
_GRAZING = wp.constant(50.0)  # one over the reflectance below which less is reflected at any angle


@wp.struct
class Surface:
    """A surface's material where a path hits it: a Principled BSDF, as in `SurfaceMaterial`.

    alpha: the square of the roughness; diffuse, reflected: fractions of uniform light that both parts scatter to the
    viewer, RGB; gain: factor of one reflection that includes further reflections.
    """

    normal: wp.vec3
    viewer: wp.vec3
    color: wp.vec3
    alpha: float
    metallic: float
    normal_reflectance: float
    diffuse: wp.vec3
    reflected: wp.vec3
    gain: wp.vec3


@wp.func
def _table_at(table: wp.array2d[wp.vec4], n_dot_v: float, roughness: float):
    """Interpolate `surface_albedo.table`; the centers of the first and the last texel are at 0 and 1."""
    last = table.shape[0] - 1
    x = wp.clamp(n_dot_v, 0.0, 1.0) * float(last)
    y = wp.clamp(roughness, 0.0, 1.0) * float(last)
    column = wp.min(int(x), last - 1)
    row = wp.min(int(y), last - 1)
    u = x - float(column)
    v = y - float(row)
    below = (1.0 - u) * table[row, column] + u * table[row, column + 1]
    above = (1.0 - u) * table[row + 1, column] + u * table[row + 1, column + 1]
    return (1.0 - v) * below + v * above


@wp.func
def surface_of(normal: wp.vec3, viewer: wp.vec3, color: wp.vec3, gloss: wp.vec3, table: wp.array2d[wp.vec4]):
    """Return the `Surface` for a viewer; normal, viewer: unit vectors; gloss: roughness, metallic, reflectance at
    normal incidence; table: `surface_albedo.table`.
    """
    surface = Surface()
    surface.normal = normal
    surface.viewer = viewer
    surface.color = color
    roughness = wp.clamp(gloss[0], _SMOOTHEST, 1.0)
    surface.alpha = roughness * roughness
    surface.metallic = gloss[1]
    surface.normal_reflectance = gloss[2]
    surface.diffuse = color
    if gloss[1] > 0.0 or gloss[2] > 0.0:
        share = _table_at(table, wp.dot(normal, viewer), roughness)
        once = gloss[2] * (share[0] - share[2]) + share[2] * wp.min(_GRAZING * gloss[2], 1.0)
        ones = wp.vec3(1.0, 1.0, 1.0)
        straight = gloss[1] * color + (1.0 - gloss[1]) * gloss[2] * ones
        # Light reflected more than once [Kulla17].
        mean = (20.0 * straight + ones) / 21.0
        again = wp.cw_div(share[3] * mean, ones - (1.0 - share[3]) * mean)
        surface.gain = ones + again * ((1.0 - share[0]) / wp.max(share[0], 0.05))
        of_metal = (share[0] - share[1]) * color + share[1] * ones
        coat = once * surface.gain
        surface.diffuse = (1.0 - gloss[1]) * wp.cw_mul(ones - coat, color)
        surface.reflected = (1.0 - gloss[1]) * coat + gloss[1] * wp.cw_mul(surface.gain, of_metal)
    return surface


@wp.func
def _fresnel(surface: Surface, cosine: float):
    """Return the Fresnel reflectance of a microfacet, a mix of dielectric and metal."""
    root = wp.sqrt(wp.min(surface.normal_reflectance, 0.99))
    dielectric = reflectance(cosine, (1.0 + root) / (1.0 - root))
    rest = wp.pow(1.0 - wp.clamp(cosine, 0.0, 1.0), 5.0)
    ones = wp.vec3(1.0, 1.0, 1.0)
    metal = surface.color + rest * (ones - surface.color)
    return (1.0 - surface.metallic) * dielectric * ones + surface.metallic * metal


@wp.func
def _part_reflected(surface: Surface, weight: wp.vec3):
    """Return the probability of sampling the microfacets, for a path of a weight."""
    of_reflected = wp.dot(weight, surface.reflected)
    return of_reflected / wp.max(of_reflected + wp.dot(weight, surface.diffuse), 1e-30)


@wp.func
def surface_value(surface: Surface, light: wp.vec3, weight: wp.vec3):
    """Return (radiance towards the viewer for unit irradiance perpendicular to the light's direction, density [1/sr]
    with which `surface_turn` samples that direction for a path of this weight).
    """
    n_dot_l = wp.dot(surface.normal, light)
    value = wp.vec3(0.0, 0.0, 0.0)
    density = float(0.0)
    if n_dot_l > 0.0:
        chance = _part_reflected(surface, weight)
        value = surface.diffuse * (n_dot_l / PI)
        density = (1.0 - chance) * n_dot_l / PI
        if chance > 0.0:
            n_dot_v = wp.max(wp.dot(surface.normal, surface.viewer), _LEAST_COSINE)
            half = wp.normalize(surface.viewer + light)
            n_dot_h = wp.dot(surface.normal, half)
            squared = surface.alpha * surface.alpha
            spread = 1.0 + (squared - 1.0) * n_dot_h * n_dot_h
            facets = squared / (PI * spread * spread)
            to_viewer = n_dot_v + wp.sqrt(squared + (1.0 - squared) * n_dot_v * n_dot_v)
            seen = wp.sqrt(squared + (1.0 - squared) * n_dot_v * n_dot_v)
            lit = wp.sqrt(squared + (1.0 - squared) * n_dot_l * n_dot_l)
            both = 0.5 / wp.max(n_dot_l * seen + n_dot_v * lit, 1e-7)  # [Heitz14, Eq. 99] over 4 (N·L) (N·V)
            fresnel = wp.cw_mul(surface.gain, _fresnel(surface, wp.dot(surface.viewer, half)))
            value += fresnel * (facets * both * n_dot_l)
            density += chance * 0.5 * facets / to_viewer
    return value, density


@wp.func
def surface_turn(surface: Surface, x: wp.vec3, weight: wp.vec3, random: wp.uint32):
    """Sample the direction of light that is reflected to the viewer.

    Returns (direction, new weight of the path, random state). x: unit, tangent to the surface. The weight is zero for
    directions below the surface.
    """
    state = random
    y = wp.cross(surface.normal, x)
    chosen = wp.randf(state)
    first = wp.randf(state)
    angle = 2.0 * PI * wp.randf(state)
    around = wp.cos(angle) * x + wp.sin(angle) * y
    direction = wp.sqrt(first) * around + wp.sqrt(wp.max(0.0, 1.0 - first)) * surface.normal
    if chosen < _part_reflected(surface, weight):
        # A microfacet that the viewer sees [Heitz18], from the cap of a sphere [Dupuy23].
        n_dot_v = wp.max(wp.dot(surface.normal, surface.viewer), _LEAST_COSINE)
        beside = surface.viewer - wp.dot(surface.normal, surface.viewer) * surface.normal
        stretched = wp.normalize(surface.alpha * beside + n_dot_v * surface.normal)
        high = wp.dot(stretched, surface.normal)
        z = (1.0 - first) * (1.0 + high) - high
        half = wp.sqrt(wp.max(0.0, 1.0 - z * z)) * around + z * surface.normal + stretched
        up = wp.dot(half, surface.normal)
        half = wp.normalize(surface.alpha * (half - up * surface.normal) + wp.max(up, 0.0) * surface.normal)
        direction = 2.0 * wp.dot(surface.viewer, half) * half - surface.viewer
    direction = wp.normalize(direction)
    value, density = surface_value(surface, direction, weight)
    return direction, wp.cw_mul(weight, value) / wp.max(density, 1e-12), state
