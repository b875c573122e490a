# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers of guides ↔ attributes of their Curves.

The base and the frames of roots are layer_base, layer_normal and layer_tangent; each layer has layer_<id>_turn and
layer_<id>_stretch per point, and layer_<id>_mask per guide if a mask limits it. All are in local coordinates.
"""

import numpy as np

from ....core.grooming import guide_layers
from ....core.grooming.guide_layers import GuideLayers
from . import attributes, curves

_BASE, _NORMAL, _TANGENT = "layer_base", "layer_normal", "layer_tangent"


def has_base(datablock):
    """Whether guides store the base and the frames of layers."""
    return attributes.has(datablock, _BASE, "FLOAT_VECTOR", "POINT")


def read(datablock, identities, weights):
    """Return the `GuideLayers` of guides; identities: of the layers, weights (L, G). Missing values count as none."""
    point_count = len(datablock.points)
    turns = np.empty((len(identities), point_count, 4), np.float32)
    stretches = np.empty((len(identities), point_count), np.float32)
    for place, identity in enumerate(identities):
        attributes.read_into(datablock, _turn(identity), "QUATERNION", "POINT", turns[place])
        attributes.read_into(datablock, _stretch(identity), "FLOAT", "POINT", stretches[place])
        # Each layer is checked while it is in the processor's cache.
        for values_of_layer in (turns[place], stretches[place]):
            finite = _finite(values_of_layer)
            if finite is not values_of_layer:
                values_of_layer[...] = finite
    return _on_base(datablock, turns, stretches, weights, attributes.read)


def in_place(datablock, identities, weights):
    """Return `GuideLayers` like `read`, with base, turns and stretches in Blender's memory.

    Copies would take most of the time of recording. The arrays are valid until the next evaluation.
    """
    point_count, layers = len(datablock.points), []
    for identity in identities:
        values = []
        for name, data_type, shape in (
            (_turn(identity), "QUATERNION", (point_count, 4)),
            (_stretch(identity), "FLOAT", (point_count,)),
        ):
            found = attributes.view(datablock, name, data_type, "POINT")
            values.append(np.zeros(shape, np.float32) if found is None else found)
        layers.append(values)
    turns, stretches = (tuple(values[place] for values in layers) for place in (0, 1))
    return _on_base(datablock, turns, stretches, weights, attributes.view)


def _on_base(datablock, turns, stretches, weights, read_attribute):
    """Return `GuideLayers` with the base and the frames of guides, from `attributes.read` or `attributes.view`."""
    counts = curves.point_counts(datablock)

    def values(name, domain, count):
        found = read_attribute(datablock, name, "FLOAT_VECTOR", domain)
        return np.zeros((count, 3), np.float32) if found is None else _finite(found)

    base = values(_BASE, "POINT", len(datablock.points))
    axes = (values(name, "CURVE", len(counts)) for name in (_NORMAL, _TANGENT))
    weights = np.asarray(weights, np.float32).reshape(len(turns), len(counts))
    return GuideLayers(base, counts, *axes, turns, stretches, weights)


def _finite(values):
    """Return values with zeros for those that are not finite."""
    with np.errstate(over="ignore", invalid="ignore"):
        if np.isfinite(values.sum()):  # a sum of others is not finite
            return values
    return np.where(np.isfinite(values), values, np.float32(0.0))


def write(datablock, layers, identities):
    """Write the base, the frames and all turns of `GuideLayers`; identities: of the layers."""
    attributes.write(datablock, _BASE, "FLOAT_VECTOR", "POINT", layers.base)
    attributes.write(datablock, _NORMAL, "FLOAT_VECTOR", "CURVE", layers.normals)
    attributes.write(datablock, _TANGENT, "FLOAT_VECTOR", "CURVE", layers.tangents)
    for place, identity in enumerate(identities):
        write_layer(datablock, layers, identity, place)


def write_layer(datablock, layers, identity, place):
    """Write the turns and stretches of one of the `GuideLayers`."""
    attributes.write(datablock, _turn(identity), "QUATERNION", "POINT", layers.turns[place])
    attributes.write(datablock, _stretch(identity), "FLOAT", "POINT", layers.stretches[place])


def read_mask(datablock, identity):
    """Return the mask (G,) of a layer that the present points are composed with, in [0, 1]; None if none is stored."""
    found = attributes.read(datablock, _mask(identity), "FLOAT", "CURVE")
    return None if found is None else np.clip(np.nan_to_num(found), 0.0, 1.0)


def write_mask(datablock, identity, mask):
    """Store the mask (G,) of a layer, or remove it if it is None."""
    if mask is not None:
        attributes.write(datablock, _mask(identity), "FLOAT", "CURVE", mask)
    elif _mask(identity) in datablock.attributes:
        datablock.attributes.remove(datablock.attributes[_mask(identity)])


def forget(datablock, identity=None):
    """Remove the attributes of a layer, or of all layers and their base."""
    names = [_turn(identity), _stretch(identity), _mask(identity)]
    if identity is None:
        names = [one.name for one in datablock.attributes if one.name.startswith("layer_")]
    for name in names:
        if name in datablock.attributes:
            datablock.attributes.remove(datablock.attributes[name])


def move(datablock, function):
    """Let layers follow a function that moves the points (N, 3) of guides."""
    identities = [item.identity for item in datablock.vellus.layers]
    if not identities or not has_base(datablock) or not len(datablock.points):
        return
    ones = np.ones((len(identities), len(datablock.curves)))
    write(datablock, guide_layers.moved(read(datablock, identities, ones), function), identities)


def _turn(identity):
    return f"layer_{identity}_turn"


def _stretch(identity):
    return f"layer_{identity}_stretch"


def _mask(identity):
    return f"layer_{identity}_mask"
