# SPDX-License-Identifier: GPL-3.0-or-later
"""Grooms as assets in .blend files: guide Curves on their own copy of the surface, with the settings.

The Curves object is marked as an asset with a preview picture. Masks are vertex groups of the surface. Settings are
stored as the text of a settings file, so the same code reads older versions.
"""

import json
from collections.abc import Iterable
from pathlib import Path

import bpy
import numpy as np

from ...core import geometry, grooming
from ...core.errors import HairError, cause_of
from ...core.files import file_names, settings_file
from ...core.files.atomic_file import atomic_files, require_writable_path
from ...core.geometry.mesh import SurfacePoints, check_mesh
from ...core.long_work import Stage, Work
from ..data import scene, whole_changes
from ..data.made import groom_assets
from ..data.strands import attributes, curves
from ..groom import selection
from ..groom.transfer import library_groom
from ..groom.transfer.library_groom import LibraryGroom
from ..host.notices import name_of, say
from ..render import library_picture
from . import asset_catalogs, strand_arrays

ENDING = ".asset.blend"
_MOST_NAME = 200  # bytes: Blender truncates longer names
_SETTINGS, _LEFT = "vellus_groom", "vellus_left"  # custom properties of the object
_BLEND = (b"BLENDER", b"\x28\xb5\x2f\xfd", b"\x1f\x8b")  # first bytes of .blend files: plain, Zstandard, gzip


def path_of(folder: Path, name: str) -> Path:
    """Return the file of a groom in an asset library: its present file, or an unused name. Raises `HairError`."""
    name = name.strip()
    if not file_names.stem_of(name).strip("_. "):
        raise HairError("The name is empty: type one.")

    def place(stem):
        return folder / f"{stem}{ENDING}"

    return place(file_names.free_stem(name, lambda stem: _is_of_others(place(stem), name)))


def _is_of_others(path, name):
    """Whether the file exists and has other contents than this groom."""
    if not path.exists():
        return False
    try:
        return names_in(path) != [name]
    except HairError:
        return True


def _require_replaceable(path):
    """Raise `HairError` if the file is open or contains other data than grooms."""
    if not path.is_file():
        return
    if bpy.data.filepath and path.resolve() == Path(bpy.data.filepath).resolve():
        raise HairError("{path} is the open file: choose another one.", path=path)
    names, before = names_in(path), _datablocks()
    try:
        with bpy.data.libraries.load(str(path), assets_only=True) as (_there, wanted):
            wanted.objects = names
        is_groom = [asset is not None and isinstance(asset.get(_SETTINGS), str) for asset in wanted.objects]
    finally:
        bpy.data.batch_remove(_datablocks() - before)
    with bpy.data.libraries.load(str(path)) as (there, _wanted):
        has_scenes = bool(there.scenes)
    if has_scenes or not names or not all(is_groom):
        raise HairError("{path} contains other data than grooms: choose another file.", path=path)


@whole_changes.whole
def saving(
    hair: bpy.types.Curves, path: Path, name: str = "", catalog: str = "", picture: np.ndarray | None = None
) -> Work[Path]:
    """Save a hair Curves datablock as an asset, as work in steps; returns the file.

    path: the folder of a library, or a .blend file; name: of the groom, by default the hair's; picture: as in `write`,
    None draws it if the machine can. Raises `HairError`.
    """
    name = name.strip() or name_of(hair)
    if len(name.encode()) > _MOST_NAME:
        raise HairError("The name is too long: use at most {most} bytes.", most=_MOST_NAME)
    target = path if path.suffix.lower() == ".blend" else path_of(path, name)
    require_writable_path(target)
    _require_replaceable(target)
    depsgraph = scene.present_depsgraph()
    groom = library_groom.take(hair, name, depsgraph)
    if picture is None:
        yield Stage("Drawing the picture", 0.1)
        picture = _drawn(hair, depsgraph.view_layer)
    yield Stage("Writing the groom", 0.8)
    write(target, [(groom, picture)], catalog)
    return target


def _drawn(hair, view_layer):
    """Draw the picture of hair; None if the machine cannot draw or the view layer does not show the hair."""
    shown = selection.object_of(hair, view_layer)
    if shown is None or not len(hair.points):
        return None
    try:
        return library_picture.draw(shown, strand_arrays.world_points(hair).reshape(-1, 3))
    except HairError as error:
        say(f"The groom is saved without a picture: {error}")
        return None


def write(path: Path, grooms: Iterable[tuple[LibraryGroom, np.ndarray | None]], catalog: str = "") -> None:
    """Write grooms with their pictures: (height, width, 4) float32, sRGB, bottom row first, or None.

    catalog: added to the library's list of catalogs, for example "Hair/Short"; empty for none. The file is written
    atomically. Raises `HairError`.
    """
    listed = asset_catalogs.read(path.parent, catalog) if catalog else None
    made: list[bpy.types.Object] = []
    renamed: list[tuple[bpy.types.Object, str]] = []
    try:
        with whole_changes.whole_change():
            for groom, picture in grooms:
                renamed += _make_way(groom.name)
                made.append(_asset(groom, picture, "" if listed is None else listed.identifier))
            new_list = [] if listed is None or listed.text is None else [listed.path]
            with atomic_files([path, *new_list]) as partials:
                bpy.data.libraries.write(str(partials[0]), set(made), compress=True)
                for partial in partials[1:]:
                    partial.write_text(listed.text, encoding="utf-8")
            for asset in made:
                _remove(asset)
    finally:
        for other, name in renamed:
            other.name = name


def _make_way(name):
    """Rename the object of the open file that has the name of a new asset; returns [(object, previous name)]."""
    other = bpy.data.objects.get((name, None))
    if other is None:
        return []
    other.name = f".{name[:50]} "
    return [(other, name)]


def _asset(groom, picture, catalog):
    """Create the object of a `LibraryGroom`, outside all scenes; catalog: UUID, empty for none."""
    datablock = bpy.data.hair_curves.new(groom.name)
    datablock.add_curves([int(count) for count in groom.counts])
    datablock.set_types(type="POLY")
    attributes.write(datablock, "position", "FLOAT_VECTOR", "POINT", groom.points)
    attributes.write(datablock, "root_triangle", "INT", "CURVE", groom.roots.triangle)
    attributes.write(datablock, "root_barycentric", "FLOAT_VECTOR", "CURVE", groom.roots.barycentric)
    for name, values in groom.regions.items():
        attributes.write(datablock, name, "FLOAT" if values.dtype.kind == "f" else "INT", "CURVE", values)
    source = groom.source
    datablock.surface = groom_assets.surface_object(
        f"{groom.name} Surface", source.mesh, source.corner_uvs, groom.masks
    )
    asset = bpy.data.objects.new(groom.name, datablock)
    asset.parent = datablock.surface
    asset[_SETTINGS] = settings_file.text_of(settings_file.to_object(groom.settings))
    asset[_LEFT] = json.dumps(list(groom.left))
    asset.asset_mark()
    asset.asset_data.tags.new("Vellus groom")
    asset.asset_data.description = f"Groom of {len(groom.counts)} guides"
    if catalog:
        asset.asset_data.catalog_id = catalog
    if picture is not None:
        groom_assets.set_picture(asset, picture)
    return asset


def _remove(asset):
    """Remove an asset's object, its Curves and its surface."""
    datablock = asset.data
    surface_object = datablock.surface
    bpy.data.objects.remove(asset)
    bpy.data.hair_curves.remove(datablock)
    if surface_object is not None:
        mesh = surface_object.data
        bpy.data.objects.remove(surface_object)
        if mesh is not None and not mesh.users:
            bpy.data.meshes.remove(mesh)


def path_and_name(text: str) -> tuple[Path, str]:
    """FILE or FILE:NAME → (file, name of a groom in it or "")."""
    file, separator, name = text.rpartition(":")
    if not separator or not file.lower().endswith(".blend"):
        return Path(text), ""
    return Path(file), name


def names_in(path: Path) -> list[str]:
    """Names of possible groom assets in a .blend file, in alphabetical order. Raises `HairError`."""
    _require_blend(path)
    try:
        with bpy.data.libraries.load(str(path), assets_only=True) as (there, _wanted):
            return sorted(there.objects, key=str.casefold)
    except (OSError, RuntimeError, UnicodeDecodeError) as error:
        raise HairError("{path} cannot be read: {cause}.", path=path, cause=cause_of(error)) from error


def _require_blend(path):
    try:
        with path.open("rb") as file:
            first = file.read(8)
    except OSError as error:
        raise HairError("{path} cannot be read: {cause}.", path=path, cause=cause_of(error)) from error
    if not first.startswith(_BLEND):
        raise HairError("{path} is not a .blend file: pick a file of an asset library.", path=path)


def read(path: Path, name: str = "") -> LibraryGroom:
    """Read a groom by name, or the only one for an empty name; the open file stays unchanged. Raises `HairError`."""
    names = names_in(path)
    if name and name not in names:
        raise HairError('{path} has no groom "{name}".', path=path, name=name)
    if not names:
        raise HairError("{path} has no grooms: pick a file of an asset library.", path=path)
    if not name and len(names) > 1:
        sentence = "{path} has {count} assets ({names}): choose one by name."
        raise HairError(sentence, path=path, count=len(names), names=", ".join(names[:10]))
    before = _datablocks()
    try:
        with bpy.data.libraries.load(str(path), assets_only=True) as (_there, wanted):
            wanted.objects = [name or names[0]]
        return _groom(wanted.objects[0], name or names[0], path)
    except (OSError, RuntimeError, UnicodeDecodeError) as error:
        raise HairError("{path} cannot be read: {cause}.", path=path, cause=cause_of(error)) from error
    finally:
        bpy.data.batch_remove(_datablocks() - before)


def _datablocks():
    """All datablocks of the open file."""
    collections = (p.identifier for p in bpy.data.bl_rna.properties if p.type == "COLLECTION")
    return {datablock for collection in collections for datablock in getattr(bpy.data, collection)}


def _groom(asset, name, path):
    """Convert a loaded asset to a `LibraryGroom`. Raises `HairError`."""
    text = None if asset is None else asset.get(_SETTINGS)
    if not isinstance(text, str) or asset.type != "CURVES" or asset.data.surface is None:
        raise HairError('"{name}" in {path} is not a groom saved by Vellus.', name=name, path=path)
    surface_object = asset.data.surface
    try:
        source = grooming.groom_transfer.TransferSurface(*groom_assets.read_surface(surface_object))
        check_mesh(source.mesh)
        points, counts = curves.read_points(asset.data), np.diff(curves.curve_offsets(asset.data))
        settings = settings_file.from_object(settings_file.object_of_text(text, path), path)
        left = json.loads(asset.get(_LEFT, "[]"))
    except (ValueError, TypeError, AttributeError, KeyError) as error:
        raise HairError('"{name}" in {path} is damaged: save the groom again.', name=name, path=path) from error
    if not (len(counts) and counts.min() >= 2 and np.isfinite(points).all()):
        raise HairError('"{name}" in {path} is damaged: save the groom again.', name=name, path=path)
    first = points[np.concatenate([[0], np.cumsum(counts)[:-1]])]
    regions = {
        attribute.name: attributes.read(asset.data, attribute.name, attribute.data_type, "CURVE")
        for attribute in asset.data.attributes
        if attribute.domain == "CURVE" and attribute.data_type in ("INT", "FLOAT") and attribute.name != "root_triangle"
    }
    masks = {
        group.name: scene.weights_in_group(surface_object.data, group.index) for group in surface_object.vertex_groups
    }
    roots = _roots(asset.data, source.mesh, first)
    return LibraryGroom(name, source, roots, points, counts, settings, masks, regions, tuple(map(str, left)))


def _roots(datablock, mesh, first_points):
    """Return the stored `SurfacePoints`; those nearest to the first points if they do not fit the mesh."""
    triangle = attributes.read(datablock, "root_triangle", "INT", "CURVE")
    barycentric = attributes.read(datablock, "root_barycentric", "FLOAT_VECTOR", "CURVE")
    if triangle is not None and barycentric is not None:
        is_known = (triangle >= 0).all() and (triangle < len(mesh.triangles)).all()
        if is_known and np.isfinite(barycentric).all() and (np.abs(barycentric.sum(axis=1) - 1.0) < 1e-3).all():
            return SurfacePoints(triangle, barycentric)
    return geometry.closest_point.SurfaceQuery(mesh).nearest(first_points)
