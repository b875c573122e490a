# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair on surfaces with any transform, and the law of its place: hair moves with its surface."""

import functools
import tempfile
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from hair_addon.blender.settings import style_items
from tests.support.exchange.imported import curves_object, select

GUIDES, STRANDS = 8, 24

# Lasts as long as the process, which Blender's temporary folder need not.
_FOLDER = tempfile.TemporaryDirectory(prefix="vellus_grown_")


def files_in(folder, add=lambda _body: None):
    """Return a function from a name in `PLACES` to the path of a file with hair on such a surface, saved once.

    add: adds other data to the scene before it is saved.
    """
    files = {}

    def file_of(place):
        if place not in files:
            bpy.ops.wm.read_homefile(filepath=_grown(place))
            bpy.context.preferences.edit.use_global_undo = True
            bpy.context.view_layer.update()
            add(bpy.data.objects["Body"])
            files[place] = str(folder / f"{len(files)}.blend")
            bpy.ops.wm.save_as_mainfile(filepath=files[place], copy=True)
        return files[place]

    return file_of


@functools.cache
def _grown(place):
    """Return the path of a file with hair on a surface at a place, which is grown once per process."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.context.preferences.edit.use_global_undo = True
    grow(place)
    path = str(Path(tempfile.mkdtemp(dir=_FOLDER.name)) / "grown.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    return path


def add_body():
    """Add a mesh of 1 m without any symmetry, off its origin."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, radius=0.5)
    body = bpy.context.object
    body.name = body.data.name = "Body"
    for vertex in body.data.vertices:
        x, y, z = vertex.co
        vertex.co = (1.3 * x + 0.3 if x > 0.0 else x + 0.3, 0.8 * y + 0.1 * x, z + 0.2 * x * y - 0.1)
    body.data.update()
    return body


def placed(location=(0, 0, 0), rotation=(0, 0, 0), scale=(1, 1, 1)):
    def place(body):
        body.location, body.rotation_euler, body.scale = location, rotation, scale

    return place


def _on_a_rig(scale, has_inverse):
    def place(body):
        rig = bpy.data.objects.new("Rig", None)
        bpy.context.collection.objects.link(rig)
        rig.location, rig.rotation_euler, rig.scale = (1.0, -2.0, 0.5), (0.3, 0.1, -0.4), scale
        bpy.context.view_layer.update()
        body.parent = rig
        if has_inverse:
            body.matrix_parent_inverse = rig.matrix_world.inverted()
        body.location, body.rotation_euler, body.scale = (0.5, 0.2, 1.0), (0.1, 0.6, 0.2), (1.5, 1.5, 1.5)

    return place


def _in_centimeters(body):
    bpy.context.scene.unit_settings.scale_length = 0.01
    body.location, body.scale = (150.0, 20.0, -30.0), (100.0, 100.0, 100.0)


def _subdivided(levels, place):
    def place_subdivided(body):
        place(body)
        modifier = body.modifiers.new("Subdivision", "SUBSURF")
        modifier.levels = modifier.render_levels = levels

    return place_subdivided


_FAR, _TURNED = (3.0, 1.0, -2.0), (0.4, -0.3, 1.2)

# Transforms of a surface: {kind: function of the body}.
PLACES = {
    "moved": placed(_FAR),
    "turned": placed((0.2, 0.0, 0.1), _TURNED),
    "small": placed(_FAR, _TURNED, (0.01, 0.01, 0.01)),
    "large": placed(_FAR, _TURNED, (100.0, 100.0, 100.0)),
    "uneven": placed(_FAR, _TURNED, (2.0, 0.5, 1.2)),
    "mirrored": placed(_FAR, _TURNED, (-1.0, 1.0, 1.0)),
    "mirrored and uneven": placed(_FAR, _TURNED, (1.5, -0.8, 1.0)),
    "on a scaled rig": _on_a_rig((2.0, 2.0, 2.0), False),
    "on a rig in centimeters": _on_a_rig((0.01, 0.01, 0.01), False),
    "on a sheared rig": _on_a_rig((2.0, 0.6, 1.0), False),
    "with a parent inverse": _on_a_rig((2.0, 2.0, 2.0), True),
    "in a scene of centimeters": _in_centimeters,
}

# The same with a modifier that subdivides the surface.
SUBDIVIDED = {f"mirrored, subdivided {levels}": _subdivided(levels, PLACES["mirrored"]) for levels in (1, 2)}
SUBDIVIDED["uneven, subdivided 2"] = _subdivided(2, PLACES["uneven"])


def bend(body):
    """Deform a surface by a shape key that rotates its faces by up to 45°."""
    body.shape_key_add(name="Basis")
    key = body.shape_key_add(name="Bent")
    for point in key.data:
        x, y, z = point.co
        point.co = (x + 0.3 * z, y + 0.4 * z * z, z - 0.2 * x * x)
    key.value = 1.0
    bpy.context.view_layer.update()


def grow(place):
    """Grow combed guides with styled hair, kept hair, and hand-made guides on a body at one of `PLACES` or
    `SUBDIVIDED`.
    """
    body = add_body()
    (PLACES | SUBDIVIDED)[place](body)
    bpy.context.view_layer.update()
    size = world_scale(body)
    select(body)
    bpy.ops.vellus.add_hair(guide_count=GUIDES, strand_count=STRANDS, length=0.3 * size, radius=0.001 * size)
    hair, guides = bpy.data.objects["Hair"], bpy.data.objects["Hair Guides"]
    guides.name = guides.data.name = "Guides"
    for style in ("CURL", "FRIZZ"):
        bpy.context.view_layer.objects.active = hair
        bpy.ops.vellus.add_style(style=style)
    style_items.group_of(hair.data.vellus.styles[1]).coherence = 0.5  # noise then depends on the place on the surface
    comb(guides)
    uses = {"Kept": bpy.ops.vellus.use_as_hair, "Made": lambda: bpy.ops.vellus.use_as_guides(grows_hair=False)}
    for name, use in uses.items():
        own = curves_object(outward(body, 12), name)
        own.data.attributes.new("radius", "FLOAT", "POINT").data.foreach_set(
            "value", np.linspace(0.002, 0.001, len(own.data.points)) * size
        )
        select(body, own)
        use()
    comb(bpy.data.objects["Kept"].data.vellus.guide_curves)
    bpy.context.view_layer.update()
    return body


def outward(body, count):
    """Return outward lines (P, 3) in the world on a mesh object, with unequal point counts."""
    matrix, size = body.matrix_world, world_scale(body)
    middle = sum((matrix @ v.co for v in body.data.vertices), matrix.translation * 0.0) / len(body.data.vertices)
    chosen = list(body.data.vertices)[:: len(body.data.vertices) // count][:count]
    lines = []
    for index, vertex in enumerate(chosen):
        root = matrix @ vertex.co
        away = (root - middle).normalized() * 0.25 * size
        steps = np.linspace(0.0, 1.0, 4 + index % 3)[:, None]
        lines.append(np.array(root) + steps * np.array(away) + steps**2 * np.float32([0.0, 0.0, 0.05 * size]))
    return lines


def comb(guides, amount=0.15):
    """Bend guides as a brush does, in their local units; guides: an object or its Curves."""
    curves = getattr(guides, "data", guides)
    points = np.empty((len(curves.points), 3), np.float32)
    curves.attributes["position"].data.foreach_get("vector", points.ravel())
    starts = np.array([c.first_point_index for c in curves.curves] + [len(points)])
    for first, end in pairwise(starts):
        along = np.linspace(0.0, 1.0, end - first)[:, None] ** 2
        length = np.linalg.norm(points[end - 1] - points[first])
        points[first:end] += along * amount * length * np.float32([1.0, -0.5, 0.3])
    curves.attributes["position"].data.foreach_set("vector", points.ravel())
    curves.update_tag()
    bpy.context.view_layer.update()


def world_scale(an_object):
    """Return the mean factor from an object's local units to the world's."""
    return abs(an_object.matrix_world.to_3x3().determinant()) ** (1.0 / 3.0)


@dataclass
class Placed:
    """A surface and its hair in the world, as evaluated.

    vertices: (V, 3); strands: {name of a Curves object: ((N, 3) points, (N,) radii, (S,) lengths)} as evaluated.
    """

    vertices: np.ndarray
    strands: dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]

    @property
    def size(self):
        return float(np.ptp(self.vertices, axis=0).max())


def seen(body_name="Body"):
    """Return the current `Placed`."""
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    body = bpy.data.objects[body_name].evaluated_get(depsgraph)
    vertices = np.empty((len(body.data.vertices), 3), np.float32)
    body.data.vertices.foreach_get("co", vertices.ravel())
    found = {o.name: _strands(o.evaluated_get(depsgraph)) for o in bpy.data.objects if o.type == "CURVES"}
    return Placed(_in_world(vertices, body.matrix_world), found)


def _strands(evaluated):
    curves = evaluated.data
    points, radii = np.empty((len(curves.points), 3), np.float32), np.empty(len(curves.points), np.float32)
    curves.attributes["position"].data.foreach_get("vector", points.ravel())
    curves.attributes["radius"].data.foreach_get("value", radii)
    points = _in_world(points, evaluated.matrix_world)
    starts = np.empty(len(curves.curves) + 1, np.int32)
    curves.curve_offset_data.foreach_get("value", starts)
    steps = np.linalg.norm(np.diff(points, axis=0, append=points[-1:]), axis=1)
    steps[starts[1:] - 1] = 0.0  # from a tip to the next root
    lengths = np.add.reduceat(steps, starts[:-1])
    return points, radii * world_scale(evaluated), lengths


def _in_world(points, matrix):
    matrix = np.array(matrix, np.float64)
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def went(before, after):
    """Return the (4, 4) map from the vertices of a `Placed` to those of another; fails if it is not affine."""
    ones = np.ones((len(before.vertices), 1))
    found, *_ = np.linalg.lstsq(np.hstack([before.vertices, ones]), after.vertices, rcond=None)
    moved = np.hstack([before.vertices, ones]) @ found
    np.testing.assert_allclose(moved, after.vertices, atol=_tolerance(before, after, 1e-5), rtol=0.0)
    matrix = np.eye(4)
    matrix[:3] = found.T
    return matrix


def require_carried(before, after, points=2e-5, names=None, lengths=1e-3):
    """Check the law: points of strands moved with the surface, and widths and lengths scaled with its size.

    points: tolerance as a fraction of the surface's size; names: of objects, None for all; lengths: relative tolerance.
    """
    matrix = went(before, after)
    factor = abs(np.linalg.det(matrix[:3, :3])) ** (1.0 / 3.0)
    is_even = np.allclose(matrix[:3, :3].T @ matrix[:3, :3], factor**2 * np.eye(3), atol=1e-4 * factor**2)
    assert names is not None or before.strands.keys() == after.strands.keys()
    tolerance = _tolerance(before, after, points)
    for name in before.strands if names is None else names:
        (were, radii, long), (are, radii_now, long_now) = before.strands[name], after.strands[name]
        assert were.shape == are.shape, name
        apart = np.linalg.norm(_in_world(were, matrix) - are, axis=1)
        assert apart.max() <= tolerance, f"{name}: {apart.max():.3g} off, of a size of {after.size:.3g}"
        np.testing.assert_allclose(radii_now, factor * radii, rtol=1e-4, err_msg=f"widths of {name}")
        if is_even:
            np.testing.assert_allclose(long_now, factor * long, rtol=lengths, err_msg=f"lengths of {name}")


def _tolerance(before, after, part):
    """Return a tolerance: a fraction of the size plus the rounding of single precision."""
    farthest = max(abs(before.vertices).max(), abs(after.vertices).max())
    return part * after.size + 1e-6 * farthest


def move_elsewhere(an_object):
    """Return a new object that has the same mesh in the world, but another transform."""
    matrix = Matrix.Translation((0.5, -1.0, 2.0)) @ Matrix.Rotation(1.0, 4, "X") @ Matrix.Scale(0.01, 4)
    mesh = an_object.data.copy()
    mesh.transform(matrix.inverted() @ an_object.matrix_world)
    other = bpy.data.objects.new("Other", mesh)
    bpy.context.collection.objects.link(other)
    other.matrix_world = matrix
    bpy.context.view_layer.update()
    return other
