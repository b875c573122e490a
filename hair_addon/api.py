# SPDX-License-Identifier: GPL-3.0-or-later
"""Vellus for scripts: what the panel does, as functions of Blender's objects or of plain arrays.

Plain arrays need no Blender:

>>> import numpy as np
>>> from hair_addon import api
>>> vertices = np.array([[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0]], np.float32)  # metres
>>> triangles = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
>>> guides = api.distribute_guides((vertices, triangles), guide_count=20, length=0.03)
>>> hair = api.interpolate_hair(guides, mesh=(vertices, triangles), strand_count=500, seed=2)
>>> api.points(hair).shape
(500, 41, 3)

In Blender a surface is a mesh object, and guides and hair are Curves datablocks; wherever one of these is taken, its
object is too. Settings are given by name, as changes of a `Settings`, or of the defaults without one. What the user can
mend is a `HairError` of one sentence, raised before anything in the scene is changed.

In the installed extension this is bl_ext.user_default.vellus.hair_addon.api.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from .core import groom, hair_binding, settings_file
from .core.errors import HairError
from .core.groom import GuideSettings, HairSettings
from .core.long_work import run_now, unheard
from .core.mesh import TriMesh
from .core.params import declared
from .core.settings_file import GroomSettings
from .core.shading import appearance, lookup_tables, presets
from .core.shading.appearance import Appearance
from .core.strands import Strands

__all__ = [
    "Appearance",
    "GroomSettings",
    "GuideSettings",
    "HairError",
    "HairSettings",
    "add_hair",
    "apply_settings",
    "bake_tables",
    "distribute_guides",
    "draw",
    "interpolate_hair",
    "load_settings",
    "points",
    "render",
    "save_settings",
    "settings_of",
    "shade",
    "table_settings",
]

# Settings that name things in a .blend.
_OF_BLENDER = ("density_group", "density_image", "region_group", "region_attribute", "part_lines")


# Growing.


def distribute_guides(surface, settings=None, *, progress=unheard, **changes):
    """Guides on a surface, evenly placed.

    surface: a mesh object, whose new guide Curves are returned; or (vertices (V, 3) [m], triangles (F, 3)), whose
    `Strands` are. settings: `GuideSettings`; changes: its fields by name; progress(step, part): told how far it is.

    >>> surface = bpy.data.objects["Scalp"]
    >>> guides = api.distribute_guides(surface, guide_count=50, length=0.3)
    >>> guides.name, len(guides.curves)
    ('Guides', 50)
    """
    settings = _changed(GuideSettings, settings, changes)
    if _are_arrays(surface):
        _require_no_names(settings)
        return groom.distribute_guides(_mesh(surface), settings, progress=progress)
    from .blender import pipeline

    return run_now(pipeline.distributing_guides(_surface_object(surface), settings, _depsgraph()), progress)


def interpolate_hair(guides, settings=None, *, mesh=None, progress=unheard, **changes):
    """Strands between guides.

    guides: guide Curves, whose new hair Curves are returned; or the `Strands` of guides on a `mesh` of arrays, whose
    `Strands` are. settings: `HairSettings`; changes and progress as above.

    >>> hair = api.interpolate_hair(bpy.data.objects["Guides"], strand_count=2000, radius=0.001)
    >>> hair.vellus.hair.strand_count
    2000
    """
    settings = _changed(HairSettings, settings, changes)
    if isinstance(guides, Strands):
        if mesh is None:
            raise HairError("Guides of arrays need the mesh that they grow on: give its arrays as mesh=.")
        _require_no_names(settings)
        binding = groom.bind_hair(_mesh(mesh), guides, settings, progress=progress)
        return hair_binding.follow_guides(binding, guides)
    from .blender import pipeline

    return run_now(pipeline.interpolating_hair(_curves(guides, "GUIDES"), settings, _depsgraph()), progress)


def add_hair(surface, settings=None, *, progress=unheard):
    """Guides on a mesh object, hair between them, and its look; returns the Curves of both. settings: `GroomSettings`.

    >>> settings = api.GroomSettings(api.GuideSettings(guide_count=30), api.HairSettings(strand_count=900))
    >>> guides, hair = api.add_hair(bpy.data.objects["Scalp"], settings)
    >>> len(guides.curves), len(hair.curves)
    (30, 900)
    """
    from .blender import groom_settings

    work = groom_settings.adding_hair(_surface_object(surface), settings or GroomSettings(), _depsgraph())
    return run_now(work, progress)


def points(strands):
    """(S, P, 3) float32 [m] of guides or hair.

    Of Curves in the world, with Z up, where their surface carries them now; of `Strands` as they are.

    >>> api.points(bpy.data.objects["Hair"]).shape
    (2000, 41, 3)
    """
    if isinstance(strands, Strands):
        return strands.numpy()
    from .blender import strand_arrays

    return strand_arrays.world_points(_curves(strands))


# Shading.


def shade(hair, look=None, *, model=None, **changes):
    """Give hair a look, for the viewport and for Cycles.

    look: an `Appearance`, the name of a preset such as "BLOND", or None for the one it has; changes: fields of
    `Appearance`; model: "MARSCHNER" or "KAJIYA_KAY", None for the one it has.

    >>> api.shade(bpy.data.objects["Hair"], "AUBURN", roughness=0.25)
    >>> api.settings_of(bpy.data.objects["Hair"]).appearance.roughness
    0.25
    """
    from .blender import groom_settings, properties

    target = _curves(hair, "HAIR")
    if isinstance(look, str) and look not in presets.PRESETS:
        raise HairError(f'There is no preset "{look}": there are {", ".join(presets.PRESETS)}.')
    present = properties.look_of(target.vellus)
    if isinstance(look, str):
        look = replace(presets.PRESETS[look][1], mode=present.mode)  # how to draw is no part of a preset
    wanted = _changed(Appearance, look or present, changes)
    if model is not None:
        known = [identifier for identifier, _label, _description in properties.MODELS]
        if model not in known:
            raise HairError(f'There is no model "{model}": there are {", ".join(known)}.')
        target.vellus.model = model
    groom_settings.assign_look(target, wanted)


def table_settings(settings, **changes):
    """`lookup_tables.Settings` of the tables that hair of some `GroomSettings` is drawn with.

    >>> settings = api.GroomSettings(appearance=api.Appearance(roughness=0.2))
    >>> api.table_settings(settings, size=64).roughness
    0.2
    """
    found = appearance.table_settings(settings.appearance, settings.tables)
    return _changed(lookup_tables.Settings, found, changes)


def bake_tables(folder, settings=None, *, has_plots=False, progress=unheard, **changes):
    """Bake the Marschner model's tables and dual scattering's to OpenEXR in a folder; returns the paths of the files.

    settings: `lookup_tables.Settings`; has_plots: whether a picture of each is written beside it.

    >>> [path.name for path in api.bake_tables("tables", size=32)][:3]
    ['m.exr', 'n.exr', 'n_trt.exr']
    """
    from .blender import table_files

    settings = _changed(lookup_tables.Settings, settings, changes)
    return run_now(table_files.baking_tables(settings, Path(folder), has_plots), progress)


# Pictures.


def draw(*, progress=unheard, **settings):
    """(height, width, 4) float32: the scene's hair and meshes as Vellus draws them, seen by the scene's camera.

    Scene-linear and premultiplied, the first row at the bottom; settings: fields of `render.PictureSettings`.

    >>> api.draw(width=64, height=48).shape
    (48, 64, 4)
    """
    from .blender import render as offscreen

    return run_now(offscreen.drawing_picture(_changed(offscreen.PictureSettings, None, settings)), progress)


def render(path, *, frame=None, engine="vellus", progress=unheard, **settings):
    """Make a frame of the scene, the present one for None, and write it as .png or .exr, whole or not at all.

    engine: "vellus", "cycles" or "eevee"; settings: fields of `core.picture.FrameSettings`, width and height the
    scene's unless given. Returns the path. In that, ### becomes the number of the frame.

    >>> api.render("frame_####.png", frame=3, width=64, height=48).name
    'frame_0003.png'
    """
    from .blender import frames
    from .core.picture import FrameSettings

    if engine not in frames.ENGINES:
        raise HairError(f'There is no engine "{engine}": there are {", ".join(frames.ENGINES)}.')
    settings = _changed(FrameSettings, None, frames.scene_size() | settings)
    frame = frames.present_frame() if frame is None else frame
    frames.require_pattern(path, 1)
    target = frames.path_of(path, frame)
    frames.write_frame(target, frame, engine, settings, progress=progress)
    return target


# Settings.


def settings_of(hair):
    """The `GroomSettings` that hair Curves and their guides were made with."""
    from .blender import groom_settings

    return groom_settings.settings_of(_curves(hair, "HAIR"))


def save_settings(path, settings):
    """Write `GroomSettings` as JSON.

    >>> api.save_settings("groom.json", api.settings_of(bpy.data.objects["Hair"]))
    """
    settings_file.write(path, settings)


def load_settings(path):
    """The `GroomSettings` of a JSON file; what it leaves out is at its default.

    >>> api.load_settings("groom.json").hair.strand_count
    2000
    """
    return settings_file.read(path)


def apply_settings(hair, settings):
    """Give hair Curves and their guides other `GroomSettings`; what was combed stays as it is.

    >>> settings = api.load_settings("groom.json")
    >>> api.apply_settings(bpy.data.objects["Hair"], settings)
    >>> bpy.context.view_layer.update()  # the strands are made here
    """
    from .blender import groom_settings

    groom_settings.apply_settings(_curves(hair, "HAIR"), settings)


def _changed(settings_class, settings, changes):
    """`Settings` with some fields changed, of the defaults where there are none. Raises `HairError`."""
    known = [name for name, _default, _details in declared(settings_class)]
    unknown = next((name for name in changes if name not in known), None)
    if unknown is not None:
        raise HairError(f'There is no setting "{unknown}": there are {", ".join(known)}.')
    return replace(settings or settings_class(), **changes)


def _are_arrays(surface):
    return isinstance(surface, TriMesh | tuple | list)


def _mesh(arrays):
    if isinstance(arrays, TriMesh):
        return arrays
    vertices, triangles = (np.asarray(part) for part in arrays)
    if vertices.ndim != 2 or vertices.shape[1] != 3 or triangles.ndim != 2 or triangles.shape[1] != 3:
        raise HairError(f"A mesh is vertices (V, 3) and triangles (F, 3), not {vertices.shape} and {triangles.shape}.")
    return TriMesh(np.ascontiguousarray(vertices, np.float32), np.ascontiguousarray(triangles, np.int32))


def _require_no_names(settings):
    named = next((name for name in _OF_BLENDER if getattr(settings, name, "")), None)
    if named is not None:
        raise HairError(f'"{named}" names something in a .blend, which plain arrays have not: use core.groom.')


def _curves(given, kind=None):
    """The Curves datablock that is given, or whose object is. Raises `HairError` for another kind than asked for."""
    curves = getattr(given, "data", given)
    state = getattr(curves, "vellus", None)
    if state is None or (kind is not None and state.kind != kind):
        wanted = {"GUIDES": "guides", "HAIR": "hair", None: "guides or hair"}[kind]
        raise HairError(f"{getattr(given, 'name', given)!r} is no {wanted} of Vellus.")
    return curves


def _surface_object(given):
    if getattr(given, "type", None) != "MESH":
        raise HairError(f"{getattr(given, 'name', given)!r} is no mesh object, nor the arrays of a mesh.")
    return given


def _depsgraph():
    from .blender import scene

    return scene.present_depsgraph()
