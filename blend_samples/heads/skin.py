# SPDX-License-Identifier: GPL-3.0-or-later
"""Skin for the sample's head: images of its color and roughness, painted by place: lips, cheeks, nose, ears."""

import bpy
import numpy as np

COLOR = (0.56, 0.335, 0.240)  # linear RGB: the mean
_SIZE = 512  # pixels
_SAMPLES_PER_TEXEL = 6
_DILATIONS = 6  # texels that colors reach past the seams of the UV map

# Places [m] on the right and left, radii [m], and what they add to the color.
_FLUSH = np.array([0.05, -0.045, -0.04])
_SPOTS = (
    ((0.046, -0.118, 0.682), 0.020, _FLUSH),  # cheeks
    ((0.0, -0.166, 0.690), 0.012, 0.9 * _FLUSH),  # nose
    ((0.0, -0.140, 0.622), 0.014, 0.4 * _FLUSH),  # chin
    ((0.078, -0.010, 0.700), 0.030, 1.1 * _FLUSH),  # ears
    ((0.032, -0.138, 0.722), 0.009, np.array([-0.06, -0.065, -0.045])),  # below the eyes
    ((0.032, -0.140, 0.738), 0.008, np.array([-0.10, -0.09, -0.065])),  # eyelids
    ((0.0, -0.140, 0.775), 0.035, np.array([0.025, 0.03, 0.025])),  # forehead
)
_LIPS = np.array([0.44, 0.155, 0.135])
_MOUTH = (0.6612, 0.0262, 0.0100, 0.0108)  # [m]: height of its line, half width, heights of the upper and lower lip


def paint(head_object):
    """Give the head's material images of its color and roughness."""
    place = _places(head_object.data)
    lips = _lips(place)[..., None]
    rng = np.random.default_rng(2)
    color = np.asarray(COLOR) + sum(_spot(place, *spot) for spot in _SPOTS)
    color = color * (1.0 + 0.05 * _blotches(place, rng))[..., None]
    color = (1.0 - lips) * color + lips * _LIPS * (1.0 + 0.08 * _blotches(3.0 * place, rng))[..., None]
    oily = np.exp(-np.square(np.linalg.norm((place - (0.0, -0.155, 0.74)) / (0.03, 0.05, 0.06), axis=-1)))
    roughness = 0.52 - 0.10 * oily - 0.20 * lips[..., 0] + 0.03 * rng.standard_normal(place.shape[:2])
    material = head_object.data.materials[0]
    _link(material, "Base Color", _image("Skin color", np.clip(color, 0.0, 1.0) ** (1.0 / 2.2), is_data=False))
    grey = np.repeat(np.clip(roughness, 0.0, 1.0)[..., None], 3, axis=2)
    _link(material, "Roughness", _image("Skin roughness", grey, is_data=True))


def _places(mesh):
    """Return (_SIZE, _SIZE, 3) [m]: where each texel of the UV map is, and next to it beyond the map's seams."""
    mesh.calc_loop_triangles()
    loops = np.empty((len(mesh.loop_triangles), 3), np.int32)
    mesh.loop_triangles.foreach_get("loops", loops.ravel())
    corner_vertices, vertices = np.empty(len(mesh.loops), np.int32), np.empty((len(mesh.vertices), 3), np.float32)
    mesh.loops.foreach_get("vertex_index", corner_vertices)
    mesh.vertices.foreach_get("co", vertices.ravel())
    uvs = np.empty((len(mesh.loops), 2), np.float32)
    mesh.uv_layers.active.uv.foreach_get("vector", uvs.ravel())
    corners, flat = vertices[corner_vertices[loops]], uvs[loops] * _SIZE
    sides = flat[:, 1:] - flat[:, :1]
    area = 0.5 * np.abs(sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0])
    counts = np.ceil(_SAMPLES_PER_TEXEL * area).astype(int) + 1
    triangle = np.repeat(np.arange(len(loops)), counts)
    u, v = np.random.default_rng(1).random((2, len(triangle)))
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    weights = np.stack([1.0 - u - v, u, v], axis=1)
    texel = np.einsum("nc,ncd->nd", weights, flat[triangle]).astype(int).clip(0, _SIZE - 1)
    place, known = np.zeros((_SIZE, _SIZE, 3)), np.zeros((_SIZE, _SIZE), bool)
    place[texel[:, 1], texel[:, 0]] = np.einsum("nc,ncd->nd", weights, corners[triangle])
    known[texel[:, 1], texel[:, 0]] = True
    for _step in range(_DILATIONS):
        for axis, way in ((0, 1), (0, -1), (1, 1), (1, -1)):
            fill = ~known & np.roll(known, way, axis)
            place[fill] = np.roll(place, way, axis)[fill]
            known |= fill
    return place


def _spot(place, center, radius, change):
    """Return the color that a soft spot and its mirror image add."""
    near = np.abs(place[..., :1]), place[..., 1:]
    squares = np.square(np.concatenate(near, axis=-1) - np.array(center)).sum(axis=-1) / radius**2
    return np.exp(-0.5 * squares)[..., None] * change


def _lips(place):
    """1 on the lips, 0 elsewhere."""
    line, half_width, upper, lower = _MOUTH
    across = np.abs(place[..., 0]) / half_width
    round_off = np.sqrt(np.clip(1.0 - across**2, 0.0, 1.0))
    bow = 1.0 - 0.16 * np.exp(-((across / 0.14) ** 2))
    above = place[..., 2] - line
    height = np.where(above > 0.0, upper * round_off**1.1 * bow, lower * round_off)
    inside = np.clip((height - np.abs(above)) / 0.0028 + 0.5, 0.0, 1.0)
    return np.where((place[..., 1] < -0.125) & (across < 1.0), inside, 0.0)


def _blotches(place, rng):
    """Noise of about unit size, some centimeters wide and finer."""
    noise = np.zeros(place.shape[:2])
    for _wave in range(24):
        waves = rng.normal(0.0, 1.0, 3) * rng.choice([120.0, 300.0, 800.0])
        noise += np.sin(place @ waves + rng.uniform(0.0, 2.0 * np.pi))
    return noise / np.sqrt(12.0) * 0.7


def _image(name, pixels, is_data):
    image = bpy.data.images.new(name, _SIZE, _SIZE, is_data=is_data)
    image.pixels.foreach_set(np.dstack([pixels, np.ones((_SIZE, _SIZE))]).astype(np.float32).ravel())
    image.update()
    image.pack()
    return image


def _link(material, socket, image):
    tree = material.node_tree
    principled = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    principled.inputs["Base Color"].default_value = (*COLOR, 1.0)
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    tree.links.new(node.outputs["Color"], principled.inputs[socket])
