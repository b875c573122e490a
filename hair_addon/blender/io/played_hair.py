# SPDX-License-Identifier: GPL-3.0-or-later
"""Imported hair that plays the motion of its curves: frames in a USD file beside the .blend."""

from pathlib import Path

import bpy
import numpy as np

from ...core.files.atomic_file import atomic_file
from ..data.strands import curves, delivered_hair
from ..groom import selection
from ..host import scene_time
from ..host.notices import name_of
from . import strand_arrays
from .usd import hair_file


def path_beside(blend_path, hair):
    """Return the path of the file that the hair of a .blend plays."""
    return blend_path.with_name(f"{blend_path.stem}_{name_of(hair)}.usdc")


def playing(hair, motion, order, path: Path):
    """Return a function of (progress) that writes a `Motion`, lets hair play it and returns the number of samples.

    motion: in meters with Z up; order: (N,) indices of its points in the order of the strands. Raises `HairError`.
    """
    hair_file.require_ours(path)
    blender_scene, shown = bpy.context.scene, selection.object_of(hair, bpy.context.view_layer)
    rate, scale = scene_time.frame_rate(blender_scene), strand_arrays.meters_per_unit(blender_scene)
    matrix, radii, counts = np.array(shown.matrix_world, np.float64), curves.read_radii(hair), curves.point_counts(hair)
    back = np.linalg.inv(matrix)

    def write(progress):
        with atomic_file(path) as partial:
            with hair_file.HairFile(partial, path, rate, scale) as file:
                place = file.add(name_of(hair), counts)
                for index, time in enumerate(motion.times):
                    progress(f"Frame {time * rate:g}", index / len(motion.times))
                    points = motion.points_at(index)[order].astype(np.float64) / scale
                    local = points @ back[:3, :3].T + back[:3, 3]
                    # Rounded, so that frame numbers are whole.
                    in_file = round(float(time) * rate, 6)
                    file.write(in_file, place, local.astype(np.float32), radii, matrix)
                    file.save(in_file)
            delivered_hair.close_files(path)
        cache_file = delivered_hair.open_file(path)
        if not bpy.data.filepath:  # a new .blend will be saved beside the file
            cache_file.filepath = f"//{path.name}"
        delivered_hair.deliver(hair, cache_file, place)
        return len(motion.times)

    return write
