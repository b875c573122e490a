# SPDX-License-Identifier: GPL-3.0-or-later
"""Mesh objects of hair cards for tests."""

import bpy
import numpy as np
from mathutils import Matrix


def card_object(lines, width, name="Cards", matrix=None):
    """Return a mesh object of cards in the middle of which polylines (P, 3) in the world run.

    width: of the cards in the world; matrix: of the object, None for the identity. V is 0 at the first points, U is the
    card's index.
    """
    matrix = np.eye(4) if matrix is None else np.array(matrix)
    back = np.linalg.inv(matrix)
    vertices, faces, uvs, start = [], [], [], 0
    for index, line in enumerate(lines):
        side = np.cross(line[-1] - line[0], (0.3, -0.2, 0.9))
        side *= 0.5 * width / np.linalg.norm(side)
        edges = np.stack([line - side, line + side], axis=1).reshape(-1, 3)
        vertices.append(edges @ back[:3, :3].T + back[:3, 3])
        along = np.linspace(0.0, 1.0, len(line))
        for row in range(len(line) - 1):
            first = start + 2 * row
            faces.append((first, first + 1, first + 3, first + 2))
            here = (index + 0.5) / len(lines)
            uvs += [(here, along[row])] * 2 + [(here, along[row + 1])] * 2
        start += 2 * len(line)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(np.concatenate(vertices).tolist(), [], faces)
    mesh.uv_layers.new().uv.foreach_set("vector", np.array(uvs, np.float32).ravel())
    made = bpy.data.objects.new(name, mesh)
    made.matrix_world = Matrix(matrix.tolist())
    bpy.context.scene.collection.objects.link(made)
    bpy.context.view_layer.update()
    return made
