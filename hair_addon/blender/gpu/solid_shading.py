# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair in Solid shading: in the colors of the viewport's color type, and by matcaps."""

from dataclasses import dataclass, replace
from functools import partial

import gpu
import numpy as np

from ..host.caches import Cache
from .hair_shading import MixedShading
from .programs import uniforms
from .studio_lights import StudioImage
from .surface_shading import white

# (id of a shading, `Solid`) → (the shading, the same as it is shown). The id is of an object that the value keeps.
shading_cache = Cache(capacity=32)


@dataclass(frozen=True)
class Solid:
    """Changes by Solid shading: the tint of all strands, or a texture with a tint for each strand; and a matcap."""

    tint: tuple = (1.0, 1.0, 1.0)
    strand_tints: gpu.types.GPUTexture | None = None
    matcap: StudioImage | None = None
    has_highlights: bool = True


PLAIN = Solid()


def shown_as(shading, solid):
    """Return a `Shading` or `MixedShading` as it is shown by a `Solid`; the same object for the same arguments."""
    if solid == PLAIN:
        return shading
    return shading_cache.get((id(shading), solid), lambda: (shading, _made(shading, solid)))[1]


def _made(shading, solid):
    if isinstance(shading, MixedShading):
        return replace(shading, driest=_made(shading.driest, solid), wettest=_made(shading.wettest, solid))
    record = uniforms.SOLID.record()
    record["tint"][:3] = solid.tint
    record["highlights"] = solid.has_highlights
    record["has_matcap"], record["has_strand_tints"] = solid.matcap is not None, solid.strand_tints is not None
    textures = {
        "strand_tints": solid.strand_tints or white(),
        "matcap": white() if solid.matcap is None else solid.matcap.matcap(),
    }
    return replace(
        shading,
        program=shading.variant(is_solid=True),
        variant=partial(shading.variant, is_solid=True),
        blocks=shading.blocks | {"solid": uniforms.uniform_buffer(record)},
        samplers=shading.samplers | textures,
        tint=solid.tint,
        untinted=(id(shading), replace(solid, tint=PLAIN.tint)),
    )


def tint_texture(tints, row_strands):
    """Return a texture of (S, 3) tints, `row_strands` per row, as `strand_textures.numbers_texture`."""
    texels = np.ones((-(-len(tints) // row_strands), row_strands, 4), np.float32)
    texels.reshape(-1, 4)[: len(tints), :3] = tints
    data = gpu.types.Buffer("FLOAT", texels.size, texels.ravel())
    return gpu.types.GPUTexture(texels.shape[1::-1], format="RGBA16F", data=data)
