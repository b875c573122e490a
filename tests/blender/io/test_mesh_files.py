# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays are in meters and in the axes of the surface's file, whatever Blender's importer does."""

import base64
import json
import struct

import bpy
import numpy as np
import pytest

from hair_addon.blender.io.mesh_files import _is_y_up
from tests.support.commands import TETRAHEDRON, distance_to, load, run_here, write_obj
from tests.support.pairs import pairs

VERTICES, TRIANGLES = TETRAHEDRON
# A warning of Blender's FBX exporter.
pytestmark = pytest.mark.filterwarnings("ignore:Setting the shape:DeprecationWarning")

MOVED = np.array([5.0, -1.0, 2.0])


def obj(path):
    write_obj(path, VERTICES, TRIANGLES)
    return VERTICES


def ply(path):
    header = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    header += "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    rows = [" ".join(map(str, vertex)) for vertex in VERTICES] + [f"3 {a} {b} {c}" for a, b, c in TRIANGLES]
    path.write_text(header + "\n".join(rows) + "\n")
    return VERTICES


def stl(path):
    corners = VERTICES[TRIANGLES].astype("<f4")
    body = b"".join(bytes(12) + triangle.tobytes() + bytes(2) for triangle in corners)
    path.write_bytes(bytes(80) + struct.pack("<I", len(TRIANGLES)) + body)
    return VERTICES


def stl_text(path):
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n{}endloop\nendfacet\n".format(
            "".join("vertex {} {} {}\n".format(*corner) for corner in triangle)
        )
        for triangle in VERTICES[TRIANGLES]
    )
    path.write_text(f"solid s\n{facets}endsolid s\n")
    return VERTICES


def gltf_content(uri):
    """Return the bytes of a glTF mesh and a node that is moved, turned a quarter about Y and twice as large."""
    points, indices = VERTICES.astype("<f4").tobytes(), TRIANGLES.astype("<u2").tobytes()
    least, most = VERTICES.min(axis=0).tolist(), VERTICES.max(axis=0).tolist()
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {
                "mesh": 0,
                "translation": MOVED.tolist(),
                "rotation": [0.0, 0.5**0.5, 0.0, 0.5**0.5],
                "scale": [2.0, 2.0, 2.0],
            }
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": least, "max": most},
            {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": len(points)},
            {"buffer": 0, "byteOffset": len(points), "byteLength": len(indices)},
        ],
        "buffers": [{"byteLength": len(points) + len(indices)} | ({"uri": uri(points + indices)} if uri else {})],
    }
    x, y, z = 2.0 * VERTICES.T
    return document, points + indices, np.stack([z, y, -x], axis=1) + MOVED


def gltf(path):
    def uri(data):
        return "data:application/octet-stream;base64," + base64.b64encode(data).decode()

    document, _data, expected = gltf_content(uri)
    path.write_text(json.dumps(document))
    return expected


def glb(path):
    document, data, expected = gltf_content(None)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    data += bytes(-len(data) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    path.write_bytes(b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks)
    return expected


def usd(up, unit):
    def write(path):
        points = ", ".join("({}, {}, {})".format(*vertex) for vertex in VERTICES)
        indices = ", ".join(map(str, TRIANGLES.ravel()))
        path.write_text(f"""#usda 1.0
(
    metersPerUnit = {unit}
    upAxis = "{up}"
)
def Xform "Place"
{{
    double3 xformOp:translate = ({MOVED[0]}, {MOVED[1]}, {MOVED[2]})
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Mesh "Tetrahedron"
    {{
        point3f[] points = [{points}]
        int[] faceVertexCounts = [3, 3, 3, 3]
        int[] faceVertexIndices = [{indices}]
    }}
}}
""")
        return (VERTICES + MOVED) * unit

    return write


def build(scale_length):
    """Build the tetrahedron in Blender, moved, in a scene with a given unit of length."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.context.scene.unit_settings.scale_length = scale_length
    mesh = bpy.data.meshes.new("Tetrahedron")
    mesh.from_pydata(VERTICES.tolist(), [], TRIANGLES.tolist())
    tetrahedron = bpy.data.objects.new("Tetrahedron", mesh)
    tetrahedron.location = MOVED
    bpy.context.scene.collection.objects.link(tetrahedron)
    bpy.context.view_layer.update()


def blend(path):
    build(0.01)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return (VERTICES + MOVED) * 0.01


def fbx(forward, up):
    def write(path):
        """Write an FBX file with Blender, which uses centimeters in it."""
        build(1.0)
        bpy.ops.export_scene.fbx(filepath=str(path), axis_forward=forward, axis_up=up)
        x, y, z = (VERTICES + MOVED).T
        return np.stack([x, z, -y] if up == "Y" else [x, y, z], axis=1)

    return write


def alembic(path):
    """Write Alembic with Blender, which uses Y up."""
    build(1.0)
    bpy.ops.wm.alembic_export(filepath=str(path), start=1, end=1, as_background_job=False)
    x, y, z = (VERTICES + MOVED).T
    return np.stack([x, z, -y], axis=1)


Y, Z = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
FILES = {
    "obj": ("a.obj", obj, Z, ()),
    "obj, Y up": ("a.OBJ", obj, Y, ("--up", "Y")),
    "ply": ("a.ply", ply, Z, ()),
    "ply, Y up": ("a.ply", ply, Y, ("--up", "Y")),
    "stl": ("a.stl", stl, Z, ()),
    "stl, Y up": ("a.stl", stl, Y, ("--up", "Y")),
    "stl as text": ("a.stl", stl_text, Z, ()),
    "gltf": ("a.gltf", gltf, Y, ()),
    "glb": ("a.glb", glb, Y, ()),
    "vrm": ("a.vrm", glb, Y, ()),
    "fbx, Y up": ("a.fbx", fbx("-Z", "Y"), Y, ()),
    "fbx, Z up": ("a.fbx", fbx("Y", "Z"), Z, ()),
    "usda, Y up, centimeters": ("a.usda", usd("Y", 0.01), Y, ()),
    "usda, Z up, meters": ("a.usda", usd("Z", 1.0), Z, ()),
    "blend, centimeters": ("a.blend", blend, Z, ()),
    "abc": ("a.abc", alembic, Y, ()),
}


@pytest.mark.parametrize("kind", FILES)
def test_arrays_are_in_meters_and_the_axes_of_the_file(scene, tmp_path, kind):
    name, write, up, options = FILES[kind]
    expected = write(tmp_path / name)
    # As long a strand for the surface whatever the unit; hanging straight down, or growing straight out.
    size = float(np.ptp(expected, axis=0).max())
    tips = []
    for gravity in (0.0, 1.0):
        groom = (
            "groom",
            tmp_path / name,
            "--guides",
            30,
            "--strands",
            200,
            "--gravity",
            gravity,
            "--tilt",
            0,
            "--relax-iterations",
            0,
            *options,
        )
        length = 10.0 if kind.startswith("blend") else 0.1 * size
        ended = run_here(*groom, "--length", length, "--out", tmp_path / "out.npz")
        assert ended.status == 0, ended.errors
        arrays = load(tmp_path / "out.npz")
        assert str(arrays.pop("up")) == "YZ"[up is Z]
        assert {name: array.shape for name, array in arrays.items()} == {
            "roots": (200, 3),
            "guide_points": (30, 41, 3),
            "guide_widths": (30, 41),
            "strand_points": (200, 41, 3),
            "strand_widths": (200, 41),
        }
        assert all(array.dtype == np.float32 for array in arrays.values())
        np.testing.assert_array_equal(arrays["roots"], arrays["strand_points"][:, 0])
        for points in (arrays["strand_points"], arrays["guide_points"]):
            assert distance_to(points[:, 0], expected, TRIANGLES).max() < 1e-5 * size
            # Outwards: no other surface has these roots.
            assert distance_to(points[:, 1], expected, TRIANGLES).max() > 1e-4 * size
        tips.append((arrays["guide_points"][:, -1] - arrays["guide_points"][:, 0]) @ up)
    assert (tips[1] - tips[0]).mean() < -0.02 * size


@pytest.mark.parametrize(
    ("ending", "scale_length"), [*pairs([".usda", ".usdc", ".abc"], [1.0, 0.01], 2), (".usdz", 1.0)]
)  # a .usdz file with another unit is refused
def test_exchange_files_hold_the_same_points_in_meters(scene, tmp_path, ending, scale_length):
    build(scale_length)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    groom = ("groom", tmp_path / "a.blend", "--guides", 12, "--strands", 50, "--length", 0.4)
    arrays, exchange = tmp_path / "a.npz", tmp_path / f"a{ending}"
    for out in (arrays, exchange):
        assert run_here(*groom, "--out", out).status == 0
    expected = load(arrays)["strand_points"]
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    found = (alembic_strands if ending == ".abc" else usd_strands)(str(exchange))
    assert sorted(found) == [12, 50]
    np.testing.assert_allclose(found[50].reshape(50, 41, 3), expected, atol=1e-5 * np.abs(expected).max())


def usd_strands(path):
    """Return {number of strands: points [m]} from the file's own positions and units, with Z up."""
    bpy.utils.expose_bundled_modules()
    from pxr import Usd, UsdGeom

    stage, found = Usd.Stage.Open(path), {}
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    assert len([prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]) == 1
    for prim in (prim for prim in stage.Traverse() if prim.IsA(UsdGeom.BasisCurves)):
        matrix = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(Usd.TimeCode.EarliestTime()))
        points = np.array(UsdGeom.PointBased(prim).GetPointsAttr().Get(Usd.TimeCode.EarliestTime()))
        counts = UsdGeom.Curves(prim).GetCurveVertexCountsAttr().Get(Usd.TimeCode.EarliestTime())
        found[len(counts)] = (points @ matrix[:3, :3] + matrix[3, :3]) * UsdGeom.GetStageMetersPerUnit(stage)
    return found


def alembic_strands(path):
    """Return {number of strands: points [m]} in Blender's axes."""
    bpy.ops.wm.alembic_import(filepath=path, as_background_job=False)
    found = {}
    for shown in (o for o in bpy.context.scene.objects if o.type == "CURVES"):
        points, matrix = np.array([point.position for point in shown.data.points]), np.array(shown.matrix_world)
        found[len(shown.data.curves)] = points @ matrix[:3, :3].T + matrix[:3, 3]
    return found


def test_usdz_with_another_unit_is_refused(scene, tmp_path):
    build(0.01)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    ended = run_here("groom", tmp_path / "a.blend", "--guides", 5, "--strands", 5, "--out", tmp_path / "a.usdz")
    assert ended.status == 1 and "write a .usdc" in ended.errors
    assert [path.name for path in tmp_path.iterdir()] == ["a.blend"]


def test_strands_are_where_the_surface_is_in_its_frame(arm, scene, tmp_path):
    scene.frame_set(11)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "arm.blend"))
    groom = ("groom", tmp_path / "arm.blend", "--guides", 40, "--strands", 300, "--out", tmp_path / "a.npz")
    assert run_here(*groom).status == 0
    roots = load(tmp_path / "a.npz")["roots"]
    evaluated = bpy.context.scene.objects["Grid"].evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()
    mesh.calc_loop_triangles()
    vertices = np.array([evaluated.matrix_world @ vertex.co for vertex in mesh.vertices])
    triangles = np.array([triangle.vertices[:] for triangle in mesh.loop_triangles])
    evaluated.to_mesh_clear()
    assert np.ptp(vertices[:, 0]) < 3.5  # it is bent
    assert distance_to(roots, vertices, triangles).max() < 1e-4


@pytest.mark.parametrize(
    ("stored", "is_y"),
    [
        (b'Property: "UpAxis", "int", "",1', True),
        (b'Property: "UpAxis", "int", "",2', False),
        (b'P: "UpAxis", "int", "Integer", "",2', False),
        (b"S\x06\0\0\0UpAxisS\x03\0\0\0intS\0\0\0\0I\x02\0\0\0", False),
        (b"S\x06\0\0\0UpAxisS\x03\0\0\0intS\x07\0\0\0IntegerS\0\0\0\0I\x02\0\0\0", False),
    ],
)
def test_the_up_axis_of_fbx_files_of_version_6_and_7(tmp_path, stored, is_y):
    """Files of version 6 state the axis after all objects and without its second type; others at their start."""
    path = tmp_path / "a.fbx"
    path.write_bytes(b"; FBX 6.1.0 project file\n" + bytes(3 << 20) + stored + b"\n")
    assert _is_y_up(path, ".fbx") is is_y
