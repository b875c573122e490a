# SPDX-License-Identifier: GPL-3.0-or-later
"""Processes that tests start have shadow maps as small as tests, by this file, which Python runs when it starts.

The folder of this file is in `commands.PYTHONPATH`. A picture of a few pixels takes a sixth of its time then. Blender's
downloader of assets, a fifth of Blender's start, is loaded when it is first used.
"""

import sys
from importlib.machinery import PathFinder
from importlib.util import LazyLoader

WORLD_SIZE, WORLD_STRANDS, WORLD_MAPS, LAMP_SIZE = 32, 300, 6, 128


def _shrink_world(module):
    module._SIZE, module._LEAST_STRANDS = WORLD_SIZE, WORLD_STRANDS


def _shrink_lamps(module):
    module._MAP_SIZE = LAMP_SIZE


def _leave_out_directions(module):
    module.DIRECTIONS, module.WEIGHTS = module.DIRECTIONS[:WORLD_MAPS], module.WEIGHTS[:WORLD_MAPS]
    module.WEIGHTS = module.WEIGHTS / module.WEIGHTS.sum()


CHANGES = {
    "hair_addon.blender.gpu.ambient_visibility": _shrink_world,
    "hair_addon.blender.gpu.scene_lights": _shrink_lamps,
    "hair_addon.core.imaging.ambient_cube": _leave_out_directions,
}


LATE = {"_bpy_internal.http.downloader", "_bpy_internal.assets.remote_library.listing_downloader"}


class _Changing:
    """A module finder that changes certain modules after they are loaded, and loads others late."""

    @staticmethod
    def find_spec(name, path, target=None):
        """Return the spec of a module to change or to load late, otherwise None."""
        if name not in CHANGES and name not in LATE:
            return None
        spec = PathFinder.find_spec(name, path, target)
        if name in LATE:
            spec.loader = LazyLoader(spec.loader)
            return spec
        load = spec.loader.exec_module

        def load_and_change(module):
            load(module)
            CHANGES[name](module)

        spec.loader.exec_module = load_and_change
        return spec


if __name__ == "sitecustomize":
    sys.meta_path.insert(0, _Changing)
