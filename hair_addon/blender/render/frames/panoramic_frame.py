# SPDX-License-Identifier: GPL-3.0-or-later
"""A rendered frame of a panoramic camera: the faces of a cube around it, drawn as frames and resampled."""

import numpy as np

from ....core import imaging
from ....core.long_work import no_progress, part_of
from .. import film
from .tiled_frame import Frame


class PanoramicFrame:
    """A `Frame` of a `Panorama`.

    clip: (nearest, farthest) visible distance along each face's axis [m]; outside: opacity of the black around the
    circle of a fisheye lens: 1 as in Cycles, or 0 for a picture that is laid over another.
    """

    def __init__(self, panorama, clip, outside, size, window, sample_count, passes, *settings):
        self._lookup = imaging.panorama.FaceLookup(panorama, size, window)
        self._clip, self._outside = clip, outside
        side = (self._lookup.side, self._lookup.side)
        self._faces = {
            face: Frame(side, part, sample_count, passes, *settings) for face, part in self._lookup.windows.items()
        }
        self._passes = passes

    def expose(self, drawn, world_to_view, _view_to_clip, _motion=None, _lens=None, progress=no_progress):
        """`Frame.expose` without motion vectors and depth of field."""
        to_clip = _face_projection(self._lookup.half_width, *self._clip)
        for done, (face, frame) in enumerate(self._faces.items()):
            turn = np.eye(4)
            turn[:3, :3] = imaging.panorama.FACES[face]
            drawing_face = part_of(progress, done / len(self._faces), (done + 1) / len(self._faces))
            frame.expose(drawn, turn @ world_to_view, to_clip, progress=drawing_face)
            frame.free_film()

    def arrays(self):
        """`Frame.arrays`; depths are distances from the camera."""
        found = {face: frame.arrays() for face, frame in self._faces.items()}
        return {
            name: self._array(name, {face: arrays[name] for face, arrays in found.items()}) for name in self._passes
        }

    def _array(self, name, pictures):
        if name == "Depth":
            return self._lookup.distances(pictures, film.FAR)
        if name == "Position":
            return self._lookup.nearest(pictures, 3)
        unseen = {"Hair Mask": (0.0,), "Mist": (1.0,), "Hair Shadow": (1.0, 1.0, 1.0)}
        unseen |= dict.fromkeys(("Combined", "Noisy Image"), (0.0, 0.0, 0.0, self._outside))
        return self._lookup.means(pictures, unseen.get(name, (0.0, 0.0, 0.0)))


def _face_projection(half_width, near, far):
    """Return (4, 4) view to clip of a square face; half_width: the tangent of half its angle."""
    matrix = np.zeros((4, 4))
    matrix[0, 0] = matrix[1, 1] = 1.0 / half_width
    matrix[2, 2:] = (far + near) / (near - far), 2.0 * far * near / (near - far)
    matrix[3, 2] = -1.0
    return matrix
