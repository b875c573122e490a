# SPDX-License-Identifier: GPL-3.0-or-later
"""Windows of a picture, (left, bottom, width, height) [samples]: bounds of the part that an object may cover."""

from contextlib import contextmanager

import gpu
import numpy as np

_IS_FAR = (
    np.indices((2, 2, 2)).reshape(3, -1).T[:, ::-1]
)  # (8, 3): 1 if a corner has the greatest coordinate of an axis


def corners_of(bounds):
    """Return (..., 8, 3) corners of boxes; bounds: (..., 2, 3) least and greatest coordinates."""
    return np.where(_IS_FAR, bounds[..., 1:, :], bounds[..., :1, :])


def of_box(bounds, to_clip, size, margin=1.0):
    """Return the window of a box with (2, 3) bounds in a picture; size: (width, height) [samples].

    to_clip: (4, 4) from the box's coordinates; margin: around the box [samples].
    """
    return tuple(of_boxes(bounds, np.asarray(to_clip, np.float64)[None], size, margin)[0].tolist())


def of_boxes(bounds, to_clip, size, margin=1.0):
    """Return (N, 4) windows of a box by (N, 4, 4) matrices; the rest as for `of_box`."""
    clip = _corners_in_clip(bounds, to_clip)
    return _around(clip, _are_in_front(clip), size, margin)


def of_strands(strands, records, size, bounds=None):
    """Return the windows (N, 4) of `StrandsOnGPU` at the places of (N,) `drawing.strand_records`.

    size: of the picture [samples]; bounds: (2, 3) of the strands, None for the loose box.
    """
    clip = _corners_in_clip(strands.box.loose if bounds is None else bounds, _to_clip(records))
    half_width = np.maximum(_half_widths(strands, records, clip), 0.0)
    half_width = np.maximum(half_width, records["least_half_width"] * records["pixels_per_unit"])
    # A strip is up to √2 wider along an axis of the picture than across its own axis; samples are jittered.
    return _around(clip, _are_in_front(clip), size, 1.5 * half_width + 1.0 + 0.5 * records["sample_offset"])


def may_be_wide(strands, records, size, half_width):
    """Return (N,) bool: whether any strand may reach a half width [samples] in a picture; arguments as for
    `of_strands`.
    """
    to_clip = _to_clip(records)
    clip = _corners_in_clip(strands.box.likely, to_clip)
    # `width_stretch` of shaders/visibility/segment.glsl at the picture's corner farthest from its axis.
    forward = np.where(records["is_perspective"][:, None] != 0, to_clip[:, 3, :3], [0.0, 0.0, 1.0])
    axis = (to_clip[:, :, :3] @ forward[..., None])[..., 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        beside = np.maximum(np.abs(axis[:, :2] / axis[:, 3:]) + 1.0, 2.0) * 0.5 * np.array(size)
        stretch = (1.0 + (beside**2).sum(axis=1) / records["pixels_per_unit"].astype(np.float64) ** 2) ** 0.5
    widths = np.where(records["is_perspective"] != 0, stretch, 1.0) * _half_widths(strands, records, clip)
    return ~_are_in_front(clip) | (widths >= half_width)


@contextmanager
def drawn_in(window):
    """Restrict drawing to a window of the bound framebuffer, in a context."""
    before = gpu.state.viewport_get()
    gpu.state.viewport_set(*window)
    yield
    gpu.state.viewport_set(*before)


def _around(clip, are_in_front, size, margin):
    """Return (N, 4) windows around (N, 4, 8) corners in clip space; the whole picture for boxes behind the viewer."""
    w = np.where(are_in_front[:, None, None], clip[:, 3:], 1.0)
    places = (0.5 * clip[:, :2] / w + 0.5) * np.array(size)[:, None]
    margin = np.broadcast_to(margin, len(clip))[:, None]
    low = np.clip(np.floor(places.min(axis=2) - margin), 0, size).astype(int)
    high = np.clip(np.ceil(places.max(axis=2) + margin), 0, size).astype(int)
    return np.where(are_in_front[:, None], np.append(low, high - low, axis=1), (0, 0, *size))


def _to_clip(records):
    """Return (N, 4, 4) matrices to clip space of records."""
    return records["object_to_clip"].transpose(0, 2, 1).astype(np.float64)


def _corners_in_clip(bounds, to_clip):
    """Return (N, 4, 8) corners of a (2, 3) box in clip space, by (N, 4, 4) matrices."""
    corners = corners_of(bounds)
    return to_clip @ np.append(corners, np.ones((8, 1)), axis=1).T


def _are_in_front(clip):
    """Return (N,) bool: whether a box is wholly in front of the viewer."""
    return ((clip[:, 2] + clip[:, 3]).min(axis=1) > 0.0) & (clip[:, 3].min(axis=1) > 0.0)


def _half_widths(strands, records, clip):
    """Return the greatest half width [samples] of each hair on the picture's axis; infinite behind the viewer."""
    scale = records["object_scale"].astype(np.float64) * records["thickness"] * records["pixels_per_unit"]
    w = clip[:, 3].min(axis=1)
    return np.divide(scale * strands.greatest_radius, w, out=np.full(len(w), np.inf), where=w > 0.0)
