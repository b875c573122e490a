# SPDX-License-Identifier: GPL-3.0-or-later
"""Python interface of Vellus: the panel's operations as functions of Blender objects or plain arrays.

Plain arrays need no Blender:

>>> import numpy as np
>>> from hair_addon import api
>>> vertices = np.array([[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0]], np.float32)  # meters
>>> triangles = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
>>> guides = api.distribute_guides((vertices, triangles), guide_count=20, length=0.03)
>>> hair = api.interpolate_hair(guides, mesh=(vertices, triangles), strand_count=500, seed=2)
>>> api.points(hair).shape
(500, 41, 3)

A path that begins with // is relative to the open .blend file, as in Blender.

In Blender a surface is a mesh object, and guides and hair are Curves datablocks; functions also accept their objects.
Settings are keyword arguments, which override those of a `Settings` object, or the defaults. Errors that the user can
fix raise `HairError`, with a message of one sentence, before the scene is changed.

In the installed extension the module is bl_ext.user_default.vellus.hair_addon.api. In a checkout the add-on is
registered when a function first needs Blender; scripts that read `vellus` properties before must call
`hair_addon.register()`.
"""

from ..core.errors import HairError
from ..core.files.settings_file import GroomSettings
from ..core.grooming.groom import GuideSettings, HairSettings
from ..core.shading.appearance import Appearance
from ..core.styling import kinds
from ..core.styling.kinds import *  # the classes of settings of styles
from .cards import CardSettings, TubeSettings, make_hair_cards, make_hair_tubes
from .dynamics import (
    DynamicsSettings,
    bake_dynamics,
    deliver_dynamics,
    dynamics_of,
    remove_delivery,
    set_dynamics,
    simulate,
)
from .export import ExportSettings, export_groom
from .grooms import (
    add_hair,
    apply_settings,
    distribute_guides,
    interpolate_hair,
    load_settings,
    points,
    save_settings,
    settings_of,
    shade,
)
from .guide_layers import add_layer, apply_layers, layers, set_layer
from .guide_tools import change_guides, paint_flow
from .imports import (
    DerivationSettings,
    MeshStrandSettings,
    TransferSettings,
    convert_particles,
    import_curves,
    import_groups,
    mesh_to_hair,
    transfer_groom,
    use_as_guides,
    use_as_hair,
)
from .library import apply_groom, groom_names, save_groom
from .maps import MapSettings, clear_map, maps_of, set_course, set_map, set_thickness_curve, thickness_curve_of
from .pictures import draw, render
from .styles import add_style, apply_style_preset, set_styles, styles_of
from .systems import delete_hair, hair_systems, look_names, style_preset_names
from .tables import bake_tables, table_settings

__all__ = [
    "Appearance",
    "CardSettings",
    "DerivationSettings",
    "DynamicsSettings",
    "ExportSettings",
    "GroomSettings",
    "GuideSettings",
    "HairError",
    "HairSettings",
    "MapSettings",
    "MeshStrandSettings",
    "TransferSettings",
    "TubeSettings",
    "add_hair",
    "add_layer",
    "add_style",
    "apply_groom",
    "apply_layers",
    "apply_settings",
    "apply_style_preset",
    "bake_dynamics",
    "bake_tables",
    "change_guides",
    "clear_map",
    "convert_particles",
    "delete_hair",
    "deliver_dynamics",
    "distribute_guides",
    "draw",
    "dynamics_of",
    "export_groom",
    "groom_names",
    "hair_systems",
    "import_curves",
    "import_groups",
    "interpolate_hair",
    "layers",
    "load_settings",
    "look_names",
    "make_hair_cards",
    "make_hair_tubes",
    "maps_of",
    "mesh_to_hair",
    "paint_flow",
    "points",
    "remove_delivery",
    "render",
    "save_groom",
    "save_settings",
    "set_course",
    "set_dynamics",
    "set_layer",
    "set_map",
    "set_styles",
    "set_thickness_curve",
    "settings_of",
    "shade",
    "simulate",
    "style_preset_names",
    "styles_of",
    "table_settings",
    "thickness_curve_of",
    "transfer_groom",
    "use_as_guides",
    "use_as_hair",
]
__all__ += kinds.__all__
