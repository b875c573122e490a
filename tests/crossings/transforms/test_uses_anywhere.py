# SPDX-License-Identifier: GPL-3.0-or-later
"""Results from hair on surfaces with any transform: files, cards, tubes, transfers, simulated guides.

Files have points and widths where Blender shows them. The rest is in the world what it is where the transform was
applied first.
"""

from functools import partial

import bpy
import numpy as np
import pytest

from hair_addon.blender.groom.dynamics import guide_baking
from hair_addon.blender.groom.transfer import library_groom, system_transfer
from hair_addon.blender.io import groom_export, groom_files, groom_library, groom_sources, hair_cards, hair_meshes
from hair_addon.core.cards.card_settings import CardSettings, TubeSettings
from hair_addon.core.files.export_settings import ExportSettings
from hair_addon.core.grooming.transfer_settings import TransferSettings
from hair_addon.core.long_work import run_now
from tests.support import placed_hair
from tests.support.exchange import alembic_reader
from tests.support.exchange.imported import select
from tests.support.pairs import pairs, share_of
from tests.support.placed_hair import PLACES, require_carried, seen, world_scale

LAST = 4
FROM_Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])  # axes of Blender's Alembic files → its own


@pytest.fixture(scope="module")
def placed_files(blender, tmp_path_factory):
    """Return a function from one of `PLACES` to the file of a surface there, created once."""
    return placed_hair.files_in(tmp_path_factory.mktemp("placed"))


def opened(path, is_applied=False):
    """Open a file, and apply the transform of its surface."""
    bpy.ops.wm.read_homefile(filepath=path)
    bpy.context.view_layer.update()
    if is_applied:
        select(bpy.data.objects["Body"])
        bpy.ops.object.transform_apply(location=True, rotation=True, scale=True)
        bpy.context.view_layer.update()


def data(name):
    return bpy.data.objects[name].data


# ------------------------------------------------------------------------------------------ files


def usd_curves(path):
    """Return {path in a USD file: (points (N, 3), widths (N,))} [m]."""
    bpy.utils.expose_bundled_modules()
    from pxr import Usd, UsdGeom

    stage, places, found = Usd.Stage.Open(str(path)), UsdGeom.XformCache(), {}
    meters = UsdGeom.GetStageMetersPerUnit(stage)
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.BasisCurves):
            made, matrix = UsdGeom.BasisCurves(prim), np.array(places.GetLocalToWorldTransform(prim)).T
            points, widths = np.array(made.GetPointsAttr().Get()), np.array(made.GetWidthsAttr().Get())
            found[str(prim.GetPath())] = in_world(points, widths, matrix, meters)
    return found


def alembic_curves(path, meters, axes):
    """Return the same of an Alembic file in some unit, by (3, 3) axes of the file → Blender's."""
    objects, found = alembic_reader.objects(alembic_reader.read(path)), {}
    for name, one in objects.items():
        if ".geom" not in one.properties or "nVertices" not in one.properties[".geom"].children:
            continue
        matrix, parts = np.eye(4), name.split("/")
        for end in range(len(parts), 1, -1):
            above = objects["/".join(parts[:end])].properties.get(".xform")
            if above is not None and ".vals" in above.children:
                matrix = above.children[".vals"].samples[0].reshape(4, 4).T @ matrix
        shape = one.properties[".geom"].children
        matrix[:3] = axes @ matrix[:3]
        found[name] = in_world(shape["P"].only.reshape(-1, 3), shape["width"].only, matrix, meters)
    return found


def in_world(points, widths, matrix, meters):
    factor = abs(np.linalg.det(matrix[:3, :3])) ** (1.0 / 3.0)
    return meters * (points @ matrix[:3, :3].T + matrix[:3, 3]), meters * factor * widths


def array_curves(path):
    arrays = np.load(path)
    kinds = {"/Hair": "strand", "/Guides": "guide"}
    return {
        name: (arrays[f"{kind}_points"].reshape(-1, 3), arrays[f"{kind}_widths"].ravel())
        for name, kind in kinds.items()
    }


def export(path):
    run_now(groom_export.exporting(path, groom_sources.all_hair(), ExportSettings(), bpy.context.scene))


def write_groom(path):
    groom_files.write(path, data("Guides"), data("Hair"), np.eye(3))


UNREAL = partial(alembic_curves, meters=0.01, axes=np.eye(3))
OF_EXPORTS = {"/Hair/strands": "Hair", "/Hair/guides": "Guides", "/Kept/strands": "Kept", "/Kept/guides": "Guides.001"}
OF_UNREAL = {
    "/groom/Hair/HairShape": "Hair",
    "/groom/Hair_guides/Hair_guidesShape": "Guides",
    "/groom/Kept/KeptShape": "Kept",
    "/groom/Kept_guides/Kept_guidesShape": "Guides.001",
}
OF_GROOMS = {"/Hair": "Hair", "/Guides": "Guides"}
# {file: (function that writes it, function that reads it, {end of a path in it: object})}.
FILES = {
    "export.usdc": (export, usd_curves, OF_EXPORTS),
    "export.abc": (export, UNREAL, OF_UNREAL),
    "groom.usdc": (write_groom, usd_curves, OF_GROOMS),
    "groom.abc": (write_groom, partial(alembic_curves, meters=1.0, axes=FROM_Y_UP), OF_GROOMS),
    "groom.npz": (write_groom, array_curves, OF_GROOMS),
}


@pytest.mark.parametrize("place", share_of(PLACES, 5))
def test_files_have_hair_where_it_is_shown(placed_files, tmp_path, place):
    opened(placed_files(place))
    before, meters = seen(), bpy.context.scene.unit_settings.scale_length
    tolerance = meters * (1e-6 * before.size + 5e-7 * abs(before.vertices).max())
    for name, (write, read, objects) in FILES.items():
        write(tmp_path / name)
        found = read(tmp_path / name)
        assert len(found) == len(objects), found.keys()
        for path, (points, widths) in found.items():
            (shown,) = (one for end, one in objects.items() if path.endswith(end))
            its_points, its_radii, _lengths = before.strands[shown]
            np.testing.assert_allclose(points, meters * its_points, rtol=0.0, atol=tolerance, err_msg=f"{name} {path}")
            np.testing.assert_allclose(widths, meters * 2.0 * its_radii, rtol=1e-5, err_msg=f"widths of {name} {path}")


# ------------------------------------------------------------------------------------------ cards and tubes


def mesh_of(made):
    """Return vertices (V, 3) and unit normals of faces (F, 3) of a mesh object in the world."""
    bpy.context.view_layer.update()
    matrix = np.array(made.matrix_world)
    vertices = np.array([vertex.co for vertex in made.data.vertices])
    normals = np.array([face.normal for face in made.data.polygons]) @ np.linalg.inv(matrix[:3, :3])
    return vertices @ matrix[:3, :3].T + matrix[:3, 3], normals / np.linalg.norm(normals, axis=1, keepdims=True)


# A card for each strand of hair without curls: rounding decides which of the cards of others a point is nearest to.
MESHES = {
    "tubes": lambda: run_now(hair_meshes.making_tubes(data("Hair"), TubeSettings(tube_count=0, point_count=6))),
    "cards": lambda: run_now(hair_cards.making_cards(data("Kept"), CardSettings(card_count=12, texture_size=128)))[0],
}


@pytest.mark.parametrize(
    ("made", "place"), pairs(MESHES, ["large", "uneven", "mirrored", "mirrored and uneven", "on a sheared rig"], 4)
)
def test_meshes_of_hair_are_where_it_is(placed_files, place, made):
    """Meshes of hair are where the hair is, and their faces have the same orientation, also on mirrored surfaces."""
    found = []
    for is_applied in (False, True):
        opened(placed_files(place), is_applied)
        found.append(mesh_of(MESHES[made]().mesh_object))
    (points, normals), (wanted, its_normals) = found
    # A strand that is nearly straight says little of how its card is turned.
    tolerance = {"cards": 2e-3, "tubes": 1e-4}[made]
    np.testing.assert_allclose(points, wanted, rtol=0.0, atol=tolerance * seen().size)
    assert (np.sum(normals * its_normals, axis=1) > 0.9).all()


# ------------------------------------------------------------------------------------------ copies on other meshes


def transfer(target, _folder, **settings):
    work = system_transfer.transferring(
        data("Guides"), data("Hair"), target, TransferSettings(**settings), bpy.context.evaluated_depsgraph_get()
    )
    made = run_now(work)
    return made.guides, made.hair


def pass_through_library(target, folder):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    groom_library.write(folder / "a.asset.blend", [(library_groom.take(data("Hair"), "Groom", depsgraph), None)])
    groom = groom_library.read(folder / "a.asset.blend", "Groom")
    made = run_now(library_groom.adding_groom(target, groom, bpy.context.evaluated_depsgraph_get())).made
    return made.guides, made.hair


COPIES = {
    "by UV": partial(transfer, method="UV"),
    "as they are": partial(transfer, alignment="WORLD"),
    "by boxes": transfer,
    "library": pass_through_library,
}


@pytest.mark.parametrize(
    "place",
    share_of(["turned", "small", "large", "uneven", "mirrored", "on a sheared rig", "in a scene of centimeters"]),
)
def test_copies_on_a_mesh_elsewhere_are_the_same_in_the_world(placed_files, tmp_path, place):
    """Copies on the same mesh with another object transform are the same in the world."""
    for name, copy in COPIES.items():
        opened(placed_files(place))
        before, body = seen(), bpy.data.objects["Body"]
        target = placed_hair.move_elsewhere(body)
        if place == "mirrored":
            target.data.flip_normals()  # as Blender does where it applies a scale
        made, after = copy(target, tmp_path), seen()
        guides, hair = (next(o.name for o in bpy.data.objects if o.data == one) for one in made)
        (points, radii, lengths), (its_points, its_radii, its_lengths) = before.strands["Guides"], after.strands[guides]
        tolerance = 2e-6 * before.size + 1e-6 * abs(before.vertices).max()
        np.testing.assert_allclose(its_points, points, rtol=0.0, atol=tolerance, err_msg=name)
        np.testing.assert_allclose(its_lengths, lengths, rtol=1e-3, err_msg=name)
        if name != "library":  # guides of a library are shown with a thickness that follows from their length
            np.testing.assert_allclose(its_radii, radii, rtol=1e-3, err_msg=name)
        # Strands grow anew: as many, as thick and as long.
        _points, radii, lengths = before.strands["Hair"]
        _points, its_radii, its_lengths = after.strands[hair]
        np.testing.assert_allclose(its_radii, radii, rtol=1e-3, err_msg=name)
        assert len(its_lengths) == len(lengths) and abs(its_lengths.mean() / lengths.mean() - 1.0) < 0.05, name


# ------------------------------------------------------------------------------------------ particle hair


@pytest.mark.parametrize("place", share_of(["on a sheared rig", "small", "uneven", "mirrored", "turned"]))
def test_converted_particle_hair_is_where_it_was(blender, place):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    body = placed_hair.add_body()
    PLACES[place](body)
    bpy.context.view_layer.update()
    select(body)
    bpy.ops.object.particle_system_add()
    settings = body.particle_systems[0].settings
    settings.type, settings.count, settings.hair_step, settings.display_step = "HAIR", 12, 5, 3
    settings.hair_length = 0.3 * world_scale(body)
    bpy.context.view_layer.update()
    evaluated = body.evaluated_get(bpy.context.evaluated_depsgraph_get())
    system = evaluated.particle_systems[0]
    wanted = np.array([[system.co_hair(evaluated, particle_no=k, step=step) for step in range(9)] for k in range(12)])
    bpy.ops.vellus.convert_particles(use="HAIR")
    (hair,) = (o.name for o in bpy.data.objects if o.type == "CURVES" and o.data.vellus.kind == "HAIR")
    points, _radii, _lengths = seen().strands[hair]
    tolerance = 2e-6 * np.ptp(wanted.reshape(-1, 3), axis=0).max() + 1e-6 * abs(points).max()
    np.testing.assert_allclose(points.reshape(12, 9, 3), wanted, rtol=0.0, atol=tolerance)


# ------------------------------------------------------------------------------------------ guides that move


def baked(folder):
    """Return {frame: what is seen} of soft guides that fall and collide with their surface."""
    scene, guides = bpy.context.scene, data("Guides")
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "moving.blend"))
    guides.vellus.simulates, guides.vellus.dynamics.bend_stiffness = True, 1e-2
    guides.vellus.cache_identity = ""
    scene.frame_end = LAST
    run_now(guide_baking.baking([guides], LAST, scene))
    found = {}
    for frame in (1, LAST):
        scene.frame_set(frame)
        found[frame] = seen()
    return found


@pytest.mark.parametrize("place", share_of(["mirrored", "uneven", "turned", "on a sheared rig", "on a scaled rig"]))
def test_guides_move_as_where_the_transform_was_applied(placed_files, tmp_path, place):
    path, found = placed_files(place), []
    for is_applied in (False, True):
        opened(path, is_applied)
        (tmp_path / str(is_applied)).mkdir()
        found.append(baked(tmp_path / str(is_applied)))
    moved = found[0][LAST].strands["Hair"][0] - found[0][1].strands["Hair"][0]
    assert np.linalg.norm(moved, axis=1).max() > 0.01 * found[0][1].size
    require_carried(found[1][LAST], found[0][LAST], points=5e-4, names=["Hair", "Guides"])


def in_centimeters(body):
    bpy.context.scene.unit_settings.scale_length = 0.01
    body.scale = (100.0, 100.0, 100.0)
    data("Hair").vellus.hair.radius *= 100.0


# Transforms that keep gravity: translations, rotations about Z, mirrors across vertical planes; and another unit of the
# same lengths. Scale and tilt change the motion.
ALIKE = {
    "moved": placed_hair.placed((3.0, 1.0, -2.0)),
    "turned about Z": placed_hair.placed((0.0, 0.0, 0.0), (0.0, 0.0, 1.2)),
    "mirrored": placed_hair.placed((1.0, 0.0, 0.0), (0.0, 0.0, 0.7), (1.0, -1.0, 1.0)),
    "in centimeters": in_centimeters,
}


def test_guides_move_alike_wherever_gravity_is_alike(blender, tmp_path):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    select(placed_hair.add_body())
    bpy.ops.vellus.add_hair(guide_count=8, strand_count=24, length=0.3, radius=0.001)
    for made in [o for o in bpy.data.objects if o.type == "CURVES"]:
        made.name = {"HAIR": "Hair", "GUIDES": "Guides"}[made.data.vellus.kind]
    placed_hair.comb(data("Guides"))
    path, found = str(tmp_path / "origin.blend"), {}
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    for name, place in ({"origin": lambda _body: None} | ALIKE).items():
        opened(path)
        place(bpy.data.objects["Body"])
        bpy.context.view_layer.update()
        (tmp_path / name).mkdir()
        found[name] = baked(tmp_path / name)
    origin = found["origin"]
    moved = origin[LAST].strands["Hair"][0] - origin[1].strands["Hair"][0]
    assert np.linalg.norm(moved, axis=1).max() > 0.01
    for name in ALIKE:
        require_carried(origin[1], found[name][1], names=["Hair"])
        require_carried(origin[LAST], found[name][LAST], names=["Hair"], points=1e-3)
