# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene's lights for all receivers: the most important lights one by one, the others as ambient light."""

from dataclasses import dataclass

import numpy as np

from ...core.imaging import lamps
from ..data.pictures.light_linking import ALL
from . import world_texture
from .programs import uniforms
from .shadows import ShadowMaps

_MAP_SIZE = 512  # texels along each side of a light's map: 0.8 mm on a head
_MOST_PLACES = 128  # maximum number of places at which importance is computed
_PLACES = 16  # places on a surface, or sampled strands of hair


@dataclass(frozen=True)
class Receiver:
    """A lit object: session UIDs of its instancer, or 0, and of the object; (P, 3) places [m] on it."""

    owner: tuple
    places: np.ndarray


@dataclass(frozen=True)
class SceneLights:
    """The lights of a scene.

    record: `uniforms.LIGHTS`, to which `ShadowMaps.draw` adds its part; links: of each of its lights, from
    `light_linking.read_links`; rest, rest_links: `uniforms.LIGHT` records of the light beyond the capacity, and their
    links; lamps: records of all lamps, without bright parts of the world; patterns: `light_panoramas.Panorama` of each
    layer of patterns.
    """

    record: np.ndarray
    links: list
    rest: np.ndarray
    rest_links: list
    lamps: np.ndarray
    patterns: list

    def lit(self, receivers):
        """Return (R,) `uniforms.LIGHTS`, for each `Receiver`: without unlinked lights, and with `rest` as ambient
        light.
        """
        records = np.repeat(self.record[None], len(receivers))
        for record, receiver in zip(records, receivers, strict=True):
            is_linked = np.array([links.has(receiver.owner) for links, _blockers in self.links], bool)
            record["light"]["power"][: len(is_linked)][~is_linked] = 0.0
            reaches = [links.has(receiver.owner) for links, _blockers in self.rest_links]
            record["world"][:, :3] += lamps.ambient_sides(self.rest[np.array(reaches, bool)], receiver.places)
        return records

    @property
    def are_alike(self):
        """Whether all receivers get the same light."""
        return not len(self.rest) and all(receivers == ALL for receivers, _blockers in self.links)

    @property
    def are_linked_to_all(self):
        """Whether every light lights everything, and everything blocks every light."""
        return all(pair == (ALL, ALL) for pair in (*self.links, *self.rest_links))

    def casters(self, hair, hair_owners, surfaces, surface_owners):
        """Return a function from a light's index to the (hair, surfaces) that cast its shadow; None if all do."""
        if all(blockers == ALL for _receivers, blockers in self.links):
            return None

        def chosen(index):
            blockers = self.links[index][1]
            pairs = (hair, hair_owners), (surfaces, surface_owners)
            return tuple(
                [one for one, owner in zip(some, owners, strict=True) if blockers.has(owner)] for some, owners in pairs
            )

        return chosen


def gather(found, links, patterns, world, receivers):
    """Return the `SceneLights` of the lights, links and patterns of `lights.read_lights`, and of a `World`.

    receivers: of the hair, by which the importance of lights is computed.
    """
    lobes, sides = world_texture.light_of(world)
    suns = np.zeros(len(lobes), uniforms.LIGHT.dtype)
    for sun, lobe in zip(suns, lobes, strict=True):
        sun["kind"], sun["casts_shadow"] = lamps.SUN, True
        sun["axis"][:3], sun["power"][:3] = -lobe.direction, lobe.irradiance
        sun["group"] = world.group
        sun["radius"] = 2.0 * np.sqrt(lobe.variance)  # a disk's variance along an axis is a quarter of its radius²
    own, found = found, uniforms.joined([found, suns])
    links = [*links, *([(ALL, ALL)] * len(suns))]
    importance = _importance(found, links, receivers)
    order = np.argsort(-importance, kind="stable")
    found, links, importance = found[order], [links[index] for index in order], importance[order]
    one_by_one = lamps.shares(importance, uniforms.LIGHT_CAPACITY)
    rest, rest_links = (
        found[one_by_one < 1.0].copy(),
        [one for one, part in zip(links, one_by_one, strict=True) if part < 1.0],
    )
    rest["power"][:, :3] *= 1.0 - one_by_one[one_by_one < 1.0, None]
    count = int(np.count_nonzero(one_by_one > 0.0))
    found["power"][:, :3] *= one_by_one[:, None]
    record = uniforms.LIGHTS.record()
    record["light"][:count], record["count"] = found[:count], count
    record["world"][:, :3] = sides
    return SceneLights(record, links[:count], rest, rest_links, own, patterns)


# Lights of Solid shading that are drawn one by one: they may follow the view, which draws their maps with each turn.
_STUDIO_COUNT = 2


def of_studio(found, ambient):
    """Return the `SceneLights` of Solid shading; found, ambient: from `studio_lights.lamps_of`. They light
    everything.
    """
    importance = found["power"][:, :3].mean(axis=1)
    order = np.argsort(-importance, kind="stable")
    found, one_by_one = found[order], lamps.shares(importance[order], _STUDIO_COUNT)
    rest = found[one_by_one < 1.0].copy()
    rest["power"][:, :3] *= 1.0 - one_by_one[one_by_one < 1.0, None]
    count = int(np.count_nonzero(one_by_one > 0.0))
    record = uniforms.LIGHTS.record()
    record["light"][:count], record["count"] = found[:count], count
    record["light"][:count]["power"][:, :3] *= one_by_one[:count, None]
    record["world"][:, :3] = ambient
    record["world"][:, :3] += lamps.ambient_sides(rest, np.zeros((1, 3)))
    return SceneLights(record, [(ALL, ALL)] * count, found[:0], [], found, [])


def _importance(found, links, receivers):
    """Return (N,) the greatest irradiance of the receivers, averaged over the channels."""
    if not receivers:
        return found["power"][:, :3].mean(axis=1)
    importance = np.zeros(len(found))
    step = -(-sum(len(receiver.places) for receiver in receivers) // _MOST_PLACES)
    places = [receiver.places[::step] for receiver in receivers]
    irradiance = lamps.irradiance(found, np.concatenate(places)).mean(axis=-1)
    of_each = np.split(irradiance, np.cumsum([len(some) for some in places])[:-1], axis=1)
    for receiver, arriving in zip(receivers, of_each, strict=True):
        is_linked = np.array([of_receivers.has(receiver.owner) for of_receivers, _blockers in links], bool)
        importance = np.maximum(importance, np.where(is_linked, arriving.max(axis=1), 0.0))
    return importance


def places_of_hair(points, to_world):
    """Return (P, 3) places [m]: a subset of the (S, N, 3) points of strands, transformed by `to_world` (4, 4)."""
    some = points[:: -(-len(points) // _PLACES), :: max((points.shape[1] - 1) // 2, 1)].reshape(-1, 3)
    return some @ to_world[:3, :3].T + to_world[:3, 3]


def places_on_surface(vertices, triangles, to_world):
    """Return (P, 3) places [m]: a subset of the corners (N,) of triangles with (V, 3) vertices, transformed by
    `to_world`.
    """
    some = vertices[triangles[:: -(-len(triangles) // _PLACES)]].astype(float)
    return some @ to_world[:3, :3].T + to_world[:3, 3]


def new_maps(record, is_wide):
    """`ShadowMaps` for a `uniforms.LIGHTS` record; is_wide: as in `ShadowMaps`."""
    return ShadowMaps(_MAP_SIZE, max(1, int(record["count"])), is_wide=is_wide)
