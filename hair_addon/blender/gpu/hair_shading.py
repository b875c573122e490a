# SPDX-License-Identifier: GPL-3.0-or-later
"""A model's settings and tables → the shader program of strands and its inputs."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import gpu
import numpy as np

from ...core.shading.appearance import wet_share
from ...core.shading.fibre import kajiya_kay, strand_variation
from ...core.shading.tables import albedo, dual_scattering
from ...core.shading.tables.radial_tables import RadialTables
from .programs import scene_programs, uniforms

# Files and tables of the two modes of the Marschner model; the energy-conserving mode evaluates M.
_TABLES = {
    "classic": ("fibre/marschner.comp", ("m", "n", "n_trt")),
    "energy": ("fibre/energy_conserving.comp", ("n", "n_trt", "n_res")),
}
_VARIED = {"classic": "fibre/marschner_varied.comp", "energy": "fibre/energy_conserving_varied.comp"}


@dataclass(frozen=True)
class Shading:
    """Inputs of a strand shader, apart from the scene."""

    program: gpu.types.GPUShader
    variant: Callable[..., gpu.types.GPUShader]  # the program with options of `shading_program`; compiled on demand
    blocks: dict = field(default_factory=dict)  # {instance: GPUUniformBuf}
    samplers: dict = field(default_factory=dict)
    forward: np.ndarray = field(default_factory=lambda: np.zeros(3))  # fraction passed on to strands behind
    reflectance: np.ndarray = field(default_factory=lambda: np.zeros(3))  # of infinitely many strands
    is_varied: bool = False  # whether strands differ by their random numbers
    is_mapped: bool = False  # whether strands have looks of their own
    is_radial: bool = False  # whether their looks differ in radial roughness
    tint: tuple = (1.0, 1.0, 1.0)  # color of all strands, relative to that of the look
    untinted: tuple = ()  # a key of all but the tint: equal for shadings of linked hair that is drawn together
    # For the energy-conserving model: (`lookup_tables.Settings`, `strand_variation.Settings` or None).
    fibre: tuple | None = None

    @cached_property
    def opacity(self):
        """Opacity of a strand, averaged over the channels."""
        return _opacity(self.forward)

    @property
    def key(self):
        """A key that is equal for shadings that differ at most in their tint."""
        return self.untinted or (id(self),)

    @property
    def layers(self):
        """[(`Shading`, `Mix`)] that are drawn over each other; `Mix` is None for the whole light."""
        return [(self, None)]


@dataclass(frozen=True)
class Mix:
    """The share of a `Shading` in a strand's light: constants of shaders/fibre/mixed_looks.glsl."""

    wetness_range: tuple  # wetness of the driest and of the wettest look
    is_wet: bool  # whether this is the share of the wettest look, or of the driest


@dataclass(frozen=True)
class MixedShading:
    """Shading of strands that differ in wetness: a mix of two, by the wetness of each."""

    driest: Shading
    wettest: Shading
    wetness_range: tuple
    mean_share: float  # of the wettest look, averaged over the strands

    @property
    def forward(self):
        """`Shading.forward`, averaged over the strands."""
        return (1.0 - self.mean_share) * self.driest.forward + self.mean_share * self.wettest.forward

    @property
    def reflectance(self):
        """`Shading.reflectance`, averaged over the strands."""
        return (1.0 - self.mean_share) * self.driest.reflectance + self.mean_share * self.wettest.reflectance

    @cached_property
    def opacity(self):
        """Opacity of a strand, averaged over the channels and strands."""
        return _opacity(self.forward)

    @property
    def key(self):
        """A key that is equal for shadings that differ at most in their tint."""
        return *self.driest.key, *self.wettest.key, self.wetness_range

    @property
    def tint(self):
        """`Shading.tint`."""
        return self.driest.tint

    @property
    def layers(self):
        """`Shading.layers`: the driest look first."""
        return [(self.driest, Mix(self.wetness_range, False)), (self.wettest, Mix(self.wetness_range, True))]


def mixed(driest, wettest, wetness, wetness_range):
    """Return the `MixedShading` of two `Shading`s for strands with (S,) wetness; wetness_range: wetness of the two
    looks.
    """
    return MixedShading(driest, wettest, wetness_range, float(wet_share(wetness, *wetness_range).mean()))


def _opacity(forward):
    return max(1.0 - float(np.mean(forward)), 0.05)


def kajiya_kay_shading(settings):
    """Return the `Shading` of the Kajiya-Kay model. The cylinder is opaque: half of its scattering is forward."""
    forward = 0.5 * kajiya_kay.mean_albedo(settings)
    return _shading("fibre/kajiya_kay.comp", {"settings": settings}, {}, forward)


def kajiya_kay_strand_shading(settings, variation):
    """Return the `Shading` of varied strands, from `kajiya_kay.StrandSettings` and `strand_variation.Settings`."""
    forward = 0.5 * kajiya_kay.mean_albedo_of_strands(settings, strand_variation.sample_sigma_a(variation))
    blocks = {"settings": settings, "variation": variation}
    return _shading("fibre/kajiya_kay_varied.comp", blocks, {}, forward, is_varied=True)


def marschner_shading(tables):
    """Return the `Shading` of the Marschner model, from baked `lookup_tables.Tables`."""
    file, names = _TABLES[tables.settings.mode]
    arrays = {f"{name}_table": getattr(tables, name) for name in names}
    forward, backward = albedo.mean_parts(tables.lobes, tables.settings)
    if tables.settings.mode == "energy":
        dual = dual_scattering.bake(tables)
        arrays |= {"dual_table": dual.theta, "n_g_table": dual.n_g, "n_g_trt_table": dual.n_g_trt}
    arrays["return_table"] = albedo.azimuthal_moments(tables)
    shading = _shading(file, {"settings": tables.settings}, arrays, *_deep(tables.settings, forward, backward))
    return replace(shading, fibre=_fibre(tables.settings, None))


def marschner_strand_shading(tables):
    """Return the `Shading` of the Marschner model for varied strands, from `strand_tables.StrandTables`."""
    deep = _deep(tables.settings, tables.forward, tables.backward)
    shading = _shading(*_sliced(tables), *deep, is_varied=True)
    return replace(shading, fibre=_fibre(tables.settings, tables.variation))


def kajiya_kay_look_shading(settings, variation, sigma_a, is_radial=False):
    """Return the `Shading` of strands with looks of their own; sigma_a (..., 3): absorption of some strands, which
    gives their colors with the radial roughness of the settings; is_radial: whether strands differ in radial roughness.
    """
    forward = 0.5 * kajiya_kay.mean_albedo_of_strands(settings, sigma_a)
    blocks = {"settings": settings, "variation": variation}
    options = {"is_varied": True, "is_mapped": True, "is_radial": is_radial}
    return _shading("fibre/kajiya_kay_varied.comp", blocks, {}, forward, **options)


def marschner_look_shading(tables):
    """Return a function that returns the `Shading` of strands with looks of their own. Its arguments are sigma_a (S,
    ..., 3) and, if it varies, the radial roughness (S,) of some strands.

    tables: `look_tables.LookTables` or `radial_tables.RadialTables`; the given strands define the light that strands
    pass on to others.
    """
    is_radial = isinstance(tables, RadialTables)
    file, blocks, arrays = _layered(tables) if is_radial else _sliced(tables)
    shading = _shading(file, blocks, arrays, np.zeros(3), is_varied=True, is_mapped=True, is_radial=is_radial)
    shading = replace(shading, fibre=_fibre(tables.settings, tables.variation))

    def fitted(sigma_a, *radial):
        forward, reflectance = _deep(tables.settings, *tables.mean_parts(sigma_a, *radial))
        return replace(shading, forward=forward, reflectance=np.array(reflectance))

    return fitted


def _sliced(tables):
    """Return (file, blocks, tables) of `_shading` for strands whose absorptions differ; tables: with slices of
    absorptions.
    """
    slices = tables.slices
    blocks = {"settings": tables.settings, "variation": tables.variation, "slices": slices.range}
    arrays = {"return_slices": tables.returned, "n_slices": slices.n}
    if tables.settings.mode == "energy":
        arrays |= {"n_g_slices": slices.n_g, "dual_table": tables.dual}
    file = _VARIED[tables.settings.mode]
    if slices.n_trt is not None:
        file, arrays["n_trt_slices"] = "fibre/marschner_elliptic.comp", slices.n_trt
    return file, blocks, arrays


def _layered(tables):
    """Return (file, blocks, tables) of `_shading` for `RadialTables`: the layers one after the other."""
    (file, blocks, _first), *_others = every = [_sliced(layer) for layer in tables.tables]
    arrays = {name: np.concatenate([arrays[name] for *_rest, arrays in every]) for name in every[0][2]}
    return file, blocks | {"layers": tables.layers}, arrays


def _fibre(settings, variation):
    return (settings, variation) if settings.mode == "energy" else None


def _deep(settings, forward, backward):
    """Return (fraction passed on by one strand, reflectance) in deep hair; forward, backward: (3,) scattered by a
    strand.
    """
    if settings.mode != "energy":
        return forward, np.zeros(3)
    attenuation, reflectance = dual_scattering.deep_hair(forward, backward)
    return 1.0 - attenuation, reflectance


def _shading(
    file, blocks, arrays, forward, reflectance=(0.0, 0.0, 0.0), is_varied=False, is_mapped=False, is_radial=False
):
    """Return the `Shading` of a .comp with blocks {instance: settings} and tables {sampler: (H, W, C) or (D, H, W,
    C)}.
    """
    kinds = [(name, "FLOAT_2D" if array.ndim == 3 else "FLOAT_3D") for name, array in arrays.items()]
    if is_varied:
        kinds.append(("strand_looks" if is_mapped else "strand_randoms", "FLOAT_2D"))
    if is_radial:
        kinds.append(("strand_radial", "FLOAT_2D"))
    classes = tuple((instance, type(settings)) for instance, settings in blocks.items())
    wanted = file, classes, tuple(kinds), is_mapped, is_radial
    program = scene_programs.shading_program(*wanted)
    variant = partial(scene_programs.shading_program, *wanted)
    buffers = {instance: uniforms.uniform_buffer(uniforms.fill(settings)) for instance, settings in blocks.items()}
    textures = {name: _table_texture(array) for name, array in arrays.items()}
    return Shading(program, variant, buffers, textures, forward, np.array(reflectance), is_varied, is_mapped, is_radial)


def _table_texture(array):
    *size, channel_count = array.shape  # (H, W) or (D, H, W)
    texels = np.zeros((*size, 4), np.float32)
    texels[..., :channel_count] = array
    texture = gpu.types.GPUTexture(
        tuple(size[::-1]), format="RGBA16F", data=gpu.types.Buffer("FLOAT", texels.size, texels.ravel())
    )
    texture.filter_mode(True)
    texture.extend_mode("EXTEND")
    return texture
