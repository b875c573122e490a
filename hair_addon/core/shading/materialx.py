# SPDX-License-Identifier: GPL-3.0-or-later
"""A look as a network of MaterialX nodes [MaterialX25]: the hair shader of [Chiang16], which other renderers have.

The network is that of an average strand at its root, as in Principled Hair.
"""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import appearance
from .appearance import Appearance
from .fibre.pigment import EUMELANIN, PHEOMELANIN

VERSION = "1.39"

Values = dict[str, tuple[str, Any]]  # input → (type, value), in MaterialX's types
Links = dict[str, tuple[str, str, str]]  # input → (type, node, output)

SURFACE = "mtlx_surface"  # node of the network's result

# MaterialX raises darker colors to this value.
_DARKEST = 1e-3


@dataclass(frozen=True)
class Node:
    """A node: name of its definition, values and links of its inputs."""

    definition: str
    values: Values = field(default_factory=dict)
    links: Links = field(default_factory=dict)


def network(look: Appearance) -> dict[str, Node]:
    """Return {name: Node} of a look, each after the nodes that it is linked to; `SURFACE` is the last."""
    dry = appearance.shaded(look)
    nodes, values, links = _absorption(look)
    nodes["roughness"] = _roughness(dry.roughness, dry.radial_roughness)
    links |= {f"roughness_{lobe}": ("vector2", "roughness", f"roughness_{lobe}") for lobe in ("TT", "TRT")}
    coated = "roughness"
    if dry.coat > 0.0:  # Cycles' Coat narrows only the first highlight
        coated = "coat_roughness"
        nodes[coated] = _roughness((1.0 - dry.coat) * dry.roughness, dry.radial_roughness)
    links["roughness_R"] = ("vector2", coated, "roughness_R")
    values["ior"] = ("float", dry.ior)
    values["cuticle_angle"] = ("float", 0.5 + dry.cuticle_angle / math.pi)  # from -π/2 to π/2
    nodes["hair"] = Node("ND_chiang_hair_bsdf", values, links)
    nodes[SURFACE] = Node("ND_surface", links={"bsdf": ("BSDF", "hair", "out")})
    return nodes


def _roughness(longitudinal, azimuthal):
    values = {"longitudinal": ("float", longitudinal), "azimuthal": ("float", azimuthal)}
    return Node("ND_chiang_hair_roughness", values)


def _absorption(look: Appearance) -> tuple[dict[str, Node], Values, Links]:
    """Return (nodes, values, links) of the absorption per radius: the last two belong to the hair's node."""
    color = look.color if look.parametrization == "COLOR" else look.tint
    if look.parametrization == "ABSORPTION" or min(color) < _DARKEST:
        return {}, {"absorption_coefficient": ("vector3", appearance.sigma_a(look))}, {}
    nodes = {}
    if look.parametrization == "MELANIN":
        amount: Values = {"melanin_concentration": ("float", look.melanin), "melanin_redness": ("float", look.redness)}
        pigments: Values = {
            "eumelanin_color": ("color3", tuple(map(float, np.exp(-EUMELANIN)))),
            "pheomelanin_color": ("color3", tuple(map(float, np.exp(-PHEOMELANIN)))),
        }
        nodes["melanin"] = Node("ND_deon_hair_absorption_from_melanin", amount | pigments)
    if look.parametrization == "COLOR" or min(color) < 1.0:
        values = {"color": ("color3", color), "azimuthal_roughness": ("float", look.radial_roughness)}
        nodes["color"] = Node("ND_chiang_hair_absorption_from_color", values)
    sources = [("vector3", name, "absorption") for name in nodes]
    if len(sources) == 2:
        nodes["absorption"] = Node("ND_add_vector3", links=dict(zip(("in1", "in2"), sources, strict=True)))
        sources = [("vector3", "absorption", "out")]
    return nodes, {}, {"absorption_coefficient": sources[0]}
