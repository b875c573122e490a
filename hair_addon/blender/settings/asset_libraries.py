# SPDX-License-Identifier: GPL-3.0-or-later
"""Asset libraries of the user's preferences, by name."""

from pathlib import Path

import bpy

from ...core.errors import HairError
from .translations import CONTEXT

SHIPPED = Path(__file__).resolve().parents[2] / "grooms"  # folder of the grooms that come with the add-on
_SHIPPED_NAME, _CHECKSUMS = "Vellus", "SHA256SUMS"

# Blender's own numbers, used when it calls an operator for an asset.
_KINDS = (("LOCAL", 1), ("ALL", 2), ("ESSENTIALS", 3), ("ONLINE_ESSENTIALS", 4), ("CUSTOM", 100))


def library_name(name, description):
    """Return a property for the name of an asset library that grooms can be saved to, with search."""
    return bpy.props.StringProperty(
        name=name, description=description, translation_context=CONTEXT, search=_names, search_options=set()
    )


def _names(_owner, _context, typed):
    return [name for name in _names_to_save() if typed.casefold() in name.casefold()]


def _names_to_save():
    """Return the names of the asset libraries that grooms can be saved to."""
    libraries = bpy.context.preferences.filepaths.asset_libraries
    return [library.name for library in libraries if not _is_shipped(library)]


def first_name():
    """Return the name of the first asset library that grooms can be saved to, empty if there is none."""
    return next(iter(_names_to_save()), "")


def _is_shipped(library):
    return bool(library.path) and Path(bpy.path.abspath(library.path)) == SHIPPED


def shipped_name():
    """Return the name of the asset library of the grooms that come with the add-on, empty if it is not added."""
    libraries = bpy.context.preferences.filepaths.asset_libraries
    return next((library.name for library in libraries if _is_shipped(library)), "")


def add_shipped():
    """Add the folder of the grooms that come with the add-on to the asset libraries; returns the library's name.

    The folder is not copied, so updates of the add-on also update its grooms.
    """
    if not shipped_name():
        libraries = bpy.context.preferences.filepaths.asset_libraries
        former = next(filter(_is_former, libraries), None)
        if former is None:
            libraries.new(name=_SHIPPED_NAME, directory=str(SHIPPED))
        else:
            former.path = str(SHIPPED)
        bpy.context.preferences.is_dirty = True
    return shipped_name()


def _is_former(library):
    """Whether a library was added while the add-on was in another folder, as each version of Blender has its own."""
    folder = Path(bpy.path.abspath(library.path))
    if not library.name.startswith(_SHIPPED_NAME) or folder.parts[-2:] != SHIPPED.parts[-2:]:
        return False
    return not folder.exists() or (folder / _CHECKSUMS).exists()


def folder_to_save(name):
    """Return the folder of an asset library to save to, the first one for an empty name. Raises `HairError`."""
    folder = folder_of(name or first_name())
    if folder == SHIPPED:
        raise HairError("Updates of Vellus replace the grooms that come with it: choose another asset library.")
    return folder


def folder_of(name):
    """Return the folder of an asset library. Raises `HairError`."""
    library = bpy.context.preferences.filepaths.asset_libraries.get(name)
    if not name:
        raise HairError("There is no asset library: add one in Preferences ▸ File Paths.")
    if library is None or not library.path:
        raise HairError('There is no asset library "{name}": add one in Preferences ▸ File Paths.', name=name)
    return Path(bpy.path.abspath(library.path))


def show_changes(name):
    """Reload a library's assets in all windows after its files have changed."""
    library = bpy.context.preferences.filepaths.asset_libraries.get(name)
    if library is not None:
        # A hidden asset shelf may have cached the libraries, and there is no context to refresh it in.
        were_changed = bpy.context.preferences.is_dirty
        library.path = library.path
        bpy.context.preferences.is_dirty = were_changed
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions:
                if region.type == "ASSET_SHELF" or (area.ui_type == "ASSETS" and region.type == "WINDOW"):
                    with bpy.context.temp_override(window=window, area=area, region=region):
                        bpy.ops.asset.library_refresh.poll() and bpy.ops.asset.library_refresh()


def reference():
    """Return {name: property} that Blender sets when it calls an operator for an asset."""
    hidden = {"options": {"HIDDEN", "SKIP_SAVE"}}
    kinds = [(kind, kind.title(), "", number) for kind, number in _KINDS]
    return {
        "asset_library_type": bpy.props.EnumProperty(items=kinds, default="LOCAL", **hidden),
        "asset_library_identifier": bpy.props.StringProperty(**hidden),
        "relative_asset_identifier": bpy.props.StringProperty(**hidden),
    }


def referenced(operator):
    """Return (file, name) of the asset an operator with `reference` was called for, or None. Raises `HairError`."""
    relative = operator.relative_asset_identifier.replace("\\", "/")
    if not relative:
        return None
    file, separator, rest = relative.partition(".blend/")
    if operator.asset_library_type != "CUSTOM" or not separator:
        raise HairError("This asset is in no asset library of the preferences: pick its file.")
    return folder_of(operator.asset_library_identifier) / f"{file}.blend", rest.partition("/")[2]
