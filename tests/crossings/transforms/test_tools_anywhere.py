# SPDX-License-Identifier: GPL-3.0-or-later
"""Guide tools on transformed surfaces have the same result in the world as after applying the transform."""

import bmesh
import bpy
import numpy as np
import pytest

from tests.support import placed_hair
from tests.support.exchange.imported import select
from tests.support.guide_tools import SHAPING, select_guides
from tests.support.pairs import pairs
from tests.support.placed_hair import PLACES, require_carried, seen
from tests.support.reading import points, write_points

# Tools with values, and those whose new guides are compared alone: hair follows these by numbers at random.
TOOLS = {(tool,): values for tool, values in SHAPING.items()} | {
    ("copy_guide_shape", "nearest"): {"source": "top", "mapping": "NEAREST", "copy_length": False},
    ("change_guide_count", "fewer"): {"factor": 0.5},
    ("change_guide_count", "more"): {"factor": 2.0},
}
# Values in meters, fitted to the size of the surface.
SIZED = {"attract_guides": ["clearance"], "push_outside": ["clearance"]}


@pytest.fixture(scope="module")
def placed_files(blender, tmp_path_factory):
    """Return a function from one of `PLACES` to the file of a surface there, with a plane to trim by."""
    return placed_hair.files_in(tmp_path_factory.mktemp("placed"), _add_cutter)


def _add_cutter(body):
    """Add a plane to trim by, and a vertex group."""
    size, middle = placed_hair.world_scale(body), seen().vertices.mean(axis=0)
    bpy.ops.mesh.primitive_plane_add(location=middle, rotation=(0.4, 0.2, 0.0))
    bpy.context.object.name = "Cutter"
    bpy.context.object.scale = (size, size, size)
    group = body.vertex_groups.new(name="top")
    group.add(range(0, len(body.data.vertices), 3), 1.0, "REPLACE")


def after_tool(path, tool, values, is_applied):
    """Return the visible hair and surface after a tool in a file."""
    bpy.ops.wm.read_homefile(filepath=path)
    bpy.context.view_layer.update()
    size = placed_hair.world_scale(bpy.data.objects["Body"])
    if is_applied:
        select(bpy.data.objects["Body"])
        bpy.ops.object.transform_apply(location=True, rotation=True, scale=True)
    select(bpy.data.objects["Guides"])
    values = dict(values)
    for name in SIZED.get(tool, []):
        values[name] *= size
    assert getattr(bpy.ops.vellus, tool)("EXEC_DEFAULT", True, **values) == {"FINISHED"}
    return seen()


@pytest.mark.parametrize(
    ("name", "place"), pairs(TOOLS, PLACES, 9), ids=lambda one: one if isinstance(one, str) else " ".join(one)
)
def test_tools_do_the_same_in_the_world(placed_files, place, name):
    tool, values = name[0], TOOLS[name]
    if tool in {"drape_guides", "push_outside"} and place in {"small", "on a rig in centimeters"}:
        pytest.skip("contacts of hair of 3 mm follow the last bits of coordinates at 3 m")
    path = placed_files(place)
    applied = after_tool(path, tool, values, True)
    as_it_is = after_tool(path, tool, values, False)
    # An applied body is 3 m from its origin: single precision turns segments of a body of 1 cm by a part in 300.
    tolerances = {"points": 0.02, "lengths": 0.01} if applied.size < 0.1 else {"points": 1e-3}
    # Relaxation stops when roots move less than this. Pushes depend on the last bits, and curls turn with guides.
    if name[-1] in {"more", "push_outside"}:
        tolerances = {"points": 0.02, "lengths": 0.01}
    require_carried(applied, as_it_is, names=["Guides"] if name[-1] == "more" else ["Guides", "Hair"], **tolerances)


@pytest.fixture(scope="module")
def symmetric_file(blender, tmp_path_factory):
    """Return a file with combed guides on a body that is symmetric across its X axis."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, radius=0.5)
    body = bpy.context.object
    body.name = "Body"
    for vertex in body.data.vertices:
        x, y, z = vertex.co
        vertex.co = (x, 0.8 * y + 0.3 * x * x, 1.1 * z + 0.2 * y)
    made = bmesh.new()
    made.from_mesh(body.data)
    bmesh.ops.bisect_plane(made, geom=[*made.verts, *made.edges, *made.faces], plane_co=(0, 0, 0), plane_no=(1, 0, 0))
    bmesh.ops.triangulate(made, faces=made.faces)
    bmesh.ops.symmetrize(made, input=[*made.verts, *made.edges, *made.faces], direction="X")
    made.to_mesh(body.data)
    made.free()
    select(body)
    bpy.ops.vellus.add_hair(guide_count=16, strand_count=10, length=0.3, radius=0.001)
    (guides,) = (o for o in bpy.data.objects if o.type == "CURVES" and o.data.vellus.kind == "GUIDES")
    guides.name = "Guides"
    placed_hair.comb(guides)
    path = str(tmp_path_factory.mktemp("symmetric") / "symmetric.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    return path


def mirrored_in(path, place):
    """Return local points of guides (G, P, 3), mirrored, combed on one side, and copied from that side."""
    bpy.ops.wm.read_homefile(filepath=path)
    PLACES.get(place, lambda _body: None)(bpy.data.objects["Body"])
    bpy.context.view_layer.update()
    guides = bpy.data.objects["Guides"]
    select(guides)
    assert bpy.ops.vellus.mirror_guides() == {"FINISHED"}
    mirrored = points(guides)
    combed = mirrored.copy()
    is_right = combed[:, 0, 0] > 1e-3
    combed[is_right] += np.linspace(0.0, 1.0, combed.shape[1])[:, None] ** 2 * np.float32([0.02, 0.05, 0.08])
    write_points(guides, combed)
    select_guides(guides, is_right)
    assert bpy.ops.vellus.copy_guide_shape(mapping="MIRRORED") == {"FINISHED"}
    copied = points(guides)
    np.testing.assert_array_equal(copied[is_right], combed[is_right])
    return mirrored, copied


@pytest.mark.parametrize("place", ["turned", "large", "uneven", "mirrored and uneven", "on a sheared rig"])
def test_guides_are_mirrored_across_the_objects_own_axis(symmetric_file, place):
    """Guides are mirrored in the object's coordinates, since a sheared object is no mirror image in the world."""
    wanted, found = mirrored_in(symmetric_file, "origin"), mirrored_in(symmetric_file, place)
    # Normals of a sheared surface, by which copies are turned, are no images of each other.
    for step in range(1 if place == "on a sheared rig" else 2):
        np.testing.assert_allclose(found[step], wanted[step], rtol=0.0, atol=1e-4)
        tips = found[step][:, -1]
        images = tips * (-1.0, 1.0, 1.0)
        assert np.linalg.norm(tips[:, None] - images[None], axis=2).min(axis=1).max() < 1e-3
