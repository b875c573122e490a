# SPDX-License-Identifier: GPL-3.0-or-later
"""Windows of a picture, (left, bottom, width, height) [samples]: bounds of the part that an object may cover."""

from contextlib import contextmanager

import gpu
import numpy as np

_IS_FAR = (
    np.indices((2, 2, 2)).reshape(3, -1).T[:, ::-1]
)  # (8, 3): 1 if a corner has the greatest coordinate of an axis


def corners_of(bounds):
    """Return (8, 3) corners of a box; bounds: (2, 3) least and greatest coordinates."""
    return np.where(_IS_FAR, bounds[1], bounds[0])


def of_box(bounds, to_clip, size, margin=1.0):
    """Return the window of a box with (2, 3) bounds in a picture; size: (width, height) [samples].

    to_clip: (4, 4) from the box's coordinates; margin: around the box [samples].
    """
    clip = _corners_in_clip(bounds, to_clip)
    return (0, 0, *size) if clip is None else _around(clip, size, margin)


def of_strands(strands, record, size):
    """Return the window of `StrandsOnGPU`; record: of `drawing.strand_record`; size: of the picture [samples]."""
    clip = _corners_in_clip(strands.bounds, record["object_to_clip"].T)
    if clip is None:
        return 0, 0, *size
    half_width = max(_half_width_at(strands, record, clip[3].min()), 0.0)
    half_width = max(half_width, float(record["least_half_width"] * record["pixels_per_unit"]))
    # A strip is up to √2 wider along an axis of the picture than across its own axis; samples are jittered.
    return _around(clip, size, 1.5 * half_width + 1.0 + 0.5 * float(record["sample_offset"]))


def may_be_wide(strands, record, size, half_width):
    """Whether any strand may reach a half width [samples] in a picture; arguments as for `of_strands`."""
    to_clip = record["object_to_clip"].T.astype(np.float64)
    clip = _corners_in_clip(strands.bounds, to_clip)
    if clip is None:
        return True
    # `width_stretch` of shaders/visibility/segment.glsl at the picture's corner farthest from its axis.
    stretch = 1.0
    if record["is_perspective"]:
        axis = to_clip @ np.append(to_clip[3, :3], 0.0)
        beside = np.maximum(np.abs(axis[:2] / axis[3]) + 1.0, 2.0) * 0.5 * np.array(size)
        stretch = (1.0 + (beside @ beside) / float(record["pixels_per_unit"]) ** 2) ** 0.5
    return stretch * _half_width_at(strands, record, clip[3].min()) >= half_width


@contextmanager
def drawn_in(window):
    """Restrict drawing to a window of the bound framebuffer, in a context."""
    before = gpu.state.viewport_get()
    gpu.state.viewport_set(*window)
    yield
    gpu.state.viewport_set(*before)


def _around(clip, size, margin):
    """Return the window around (4, 8) corners in clip space."""
    places = (0.5 * clip[:2] / clip[3] + 0.5) * np.array(size)[:, None]
    low = np.clip(np.floor(places.min(axis=1) - margin), 0, size).astype(int)
    high = np.clip(np.ceil(places.max(axis=1) + margin), 0, size).astype(int)
    return (*low.tolist(), *(high - low).tolist())


def _corners_in_clip(bounds, to_clip):
    """Return (4, 8) corners of a box in clip space; None if any part is behind the viewer."""
    clip = np.asarray(to_clip, np.float64) @ np.append(corners_of(bounds), np.ones((8, 1)), axis=1).T
    return clip if (clip[2] + clip[3]).min() > 0.0 and clip[3].min() > 0.0 else None


def _half_width_at(strands, record, w):
    """Greatest half width [samples] of strands on the picture's axis, at a clip-space w."""
    scale = float(record["object_scale"] * record["thickness"] * record["pixels_per_unit"])
    return scale * strands.greatest_radius / w
