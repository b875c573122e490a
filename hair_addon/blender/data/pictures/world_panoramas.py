# SPDX-License-Identifier: GPL-3.0-or-later
"""Panoramas of worlds and lights whose nodes Vellus does not read: Cycles renders them once, in another process.

Panoramas are kept by the digest of the nodes: in the user's folder of the extension, or as long as Blender runs.
"""

from . import kept_files, picture_jobs, world_digest


def file_of(world, frame, waits):
    """Return the OpenEXR file with the panorama of a world at a frame; None while it is rendered.

    waits: return only once it is there. Raises `HairError` if it cannot be rendered.
    """
    digest = world_digest.digest_of(world)
    path = kept_files.folder("worlds") / f"{digest}.exr"
    return kept_or_rendered("world", world, path, waits, digest=digest, frame=float(frame))


def kept_or_rendered(kind, owner, path, waits, **values):
    """Return the path of the panorama of a world or light, whose name is a digest; None while it is rendered.

    kind, values: of the job that renders it; waits: as for `file_of`. Raises `HairError` if it cannot be rendered.
    """
    files, errors = picture_jobs.files_of(kind, {path: owner.original}, waits, **values)
    if errors and not files:
        raise errors[0]
    return picture_jobs.last_cache.keep(owner.original.session_uid, files[path]) if files else None
