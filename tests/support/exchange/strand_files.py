# SPDX-License-Identifier: GPL-3.0-or-later
"""Bytes of strand files of other programs, written from the descriptions of their formats, without the add-on's code.

Each function takes polylines [(P, 3) float32], root first; widths are diameters (N,) float32 where a format has them.
"""

import io
import struct

import numpy as np


def lines(count=6, rng=None, points=None):
    """Return polylines of 2 to 7 points, or of `points` points each."""
    rng = rng or np.random.default_rng(3)
    sizes = [points or int(rng.integers(2, 8)) for _ in range(count)]
    return [np.cumsum(rng.normal(size=(size, 3)), axis=0).astype(np.float32) for size in sizes]


def hair(strands, widths=None, colors=None, text=b"", default=1.0):
    """Return a HAIR file: arrays of segments and points; of thickness and colors if given."""
    arrays = 3 + (0 if widths is None else 4) + (0 if colors is None else 16)
    total = sum(len(one) for one in strands)
    data = b"HAIR" + struct.pack("<4I", len(strands), total, arrays, 0)
    data += struct.pack("<5f", default, 0.0, 1.0, 1.0, 1.0) + text.ljust(88, b"\0")
    data += struct.pack(f"<{len(strands)}H", *(len(one) - 1 for one in strands))
    data += b"".join(one.astype("<f4").tobytes() for one in strands)
    data += b"" if widths is None else widths.astype("<f4").tobytes()
    return data + (b"" if colors is None else colors.astype("<f4").tobytes())


def data(strands):
    """Return a HairSalon file: a count, then the points."""
    parts = [struct.pack("<i", len(one)) + one.astype("<f4").tobytes() for one in strands]
    return struct.pack("<i", len(strands)) + b"".join(parts)


def bin_file(strands):
    """Return a CT2Hair file: as HairSalon, with a direction and a label at each point."""
    parts = []
    for one in strands:
        rows = np.column_stack([one, np.ones((len(one), 3)), np.zeros(len(one))]).astype("<f4")
        parts.append(struct.pack("<i", len(one)) + rows.tobytes())
    return struct.pack("<i", len(strands)) + b"".join(parts)


def tfx(strands, root_uvs=None):
    """Return a TressFX 4 file of the strands with as many points as the first."""
    strands = [one for one in strands if len(one) == len(strands[0])]
    uv_place = 160 + 16 * len(strands) * len(strands[0])
    head = struct.pack(
        "<f7I", 4.0, len(strands), len(strands[0]), 160, uv_place if root_uvs is not None else 0, 0, 0, 0
    )
    rows = [np.column_stack([one, [0.0, 0.0] + [1.0] * (len(one) - 2)]).astype("<f4").tobytes() for one in strands]
    return head + bytes(128) + b"".join(rows) + (b"" if root_uvs is None else root_uvs.astype("<f4").tobytes())


def ply(strands, widths=None, order="little"):
    """Return a PLY file as hairutil writes it: vertices with a color, and strands with their numbers of segments."""
    sign = "<" if order == "little" else ">"
    total = sum(len(one) for one in strands)
    kind = [(name, f"{sign}f4") for name in "xyz"] + [(name, "u1") for name in ("red", "green", "blue")]
    kind += [] if widths is None else [("thickness", f"{sign}f4")]
    vertices = np.zeros(total, kind)
    for column, axis in enumerate("xyz"):
        vertices[axis] = np.concatenate(strands)[:, column]
    if widths is not None:
        vertices["thickness"] = widths
    head = f"ply\nformat binary_{order}_endian 1.0\ncomment strands\nelement vertex {total}\n"
    names = {"f4": "float", "u1": "uchar"}
    head += "".join(f"property {names[one[1][-2:]]} {one[0]}\n" for one in kind)
    head += f"element strand {len(strands)}\nproperty ushort nsegs\nend_header\n"
    return head.encode() + vertices.tobytes() + np.array([len(one) - 1 for one in strands], f"{sign}u2").tobytes()


def ply_text(strands):
    """Return a PLY file as text, with the radius of each vertex."""
    head = f"ply\nformat ascii 1.0\nelement vertex {sum(len(one) for one in strands)}\n"
    head += "".join(f"property float {axis}\n" for axis in ("x", "y", "z", "radius"))
    head += f"element strand {len(strands)}\nproperty ushort nsegs\nend_header\n"
    rows = [" ".join(str(number) for number in row) + " 0.25\n" for row in np.concatenate(strands)]
    return (head + "".join(rows) + "".join(f"{len(one) - 1}\n" for one in strands)).encode()


def ply_lists(strands):
    """Return a PLY file whose polylines list their vertices."""
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {sum(len(one) for one in strands)}\n"
    head += "".join(f"property double {axis}\n" for axis in "xyz")
    head += f"element polyline {len(strands)}\nproperty list uchar int vertex_indices\nend_header\n"
    parts, place = [], 0
    for one in strands:
        parts.append(struct.pack(f"<B{len(one)}i", len(one), *range(place, place + len(one))))
        place += len(one)
    return head.encode() + np.concatenate(strands).astype("<f8").tobytes() + b"".join(parts)


def ply_edges(strands, rng=None):
    """Return a PLY file of vertices and edges; rng: to shuffle the edges."""
    edges = edges_of(strands)
    if rng is not None:
        edges = rng.permutation(edges)
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {sum(len(one) for one in strands)}\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz")
    head += f"element edge {len(edges)}\nproperty int vertex1\nproperty int vertex2\nend_header\n"
    return head.encode() + np.concatenate(strands).astype("<f4").tobytes() + edges.astype("<i4").tobytes()


def edges_of(strands):
    """Return (E, 2) edges between consecutive points."""
    starts = np.cumsum([0, *(len(one) for one in strands)])
    return np.array([(s + i, s + i + 1) for s, one in zip(starts, strands, strict=False) for i in range(len(one) - 1)])


def obj(strands, is_edges=False):
    """Return an OBJ file with a line for each strand, or for each edge."""
    rows = [f"v {x} {y} {z}\n" for x, y, z in np.concatenate(strands)]
    starts = 1 + np.cumsum([0, *(len(one) for one in strands)])
    found = edges_of(strands) + 1 if is_edges else [range(s, s + len(o)) for s, o in zip(starts, strands, strict=False)]
    return ("o Hair\n" + "".join(rows) + "".join(f"l {' '.join(map(str, line))}\n" for line in found)).encode()


def npz(strands, name="positions", **others):
    """Return ragged arrays: points of all strands and their counts."""
    stream = io.BytesIO()
    counts = np.array([len(one) for one in strands])
    np.savez(stream, **{name: np.concatenate(strands)}, counts=counts, **others)
    return stream.getvalue()
