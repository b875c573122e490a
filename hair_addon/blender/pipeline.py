# SPDX-License-Identifier: GPL-3.0-or-later
"""The report's node graph in Blender: read geometry and settings, compute, write geometry.

mesh object ─ distribute_guides ─▶ Guides Curves ─ interpolate_hair ─▶ Hair Curves. What was made keeps its settings
and its inputs, so `evaluate` can make it again.
"""

import hashlib
from concurrent.futures import Future

import numpy as np

from ..core import groom, hair_binding, strands
from ..core.errors import HairError
from ..core.long_work import part_of, run_now
from . import bindings, curves, looks, partings, preferences, properties, scene
from .bindings import BoundHair
from .datablocks import Remembered


def distribute_guides(surface_object, settings, depsgraph, target=None, keeps_roots=False):
    """Grow guides on a mesh object; returns their Curves object's data, a new object's unless `target` is given.

    keeps_roots: guides of `target` stay where they are if what placed them is the same. Raises `HairError` before
    anything in the scene changes.
    """
    return run_now(distributing_guides(surface_object, settings, depsgraph, target, keeps_roots))


def distributing_guides(surface_object, settings, depsgraph, target=None, keeps_roots=False):
    """`distribute_guides` as work in steps (core/long_work.py)."""
    surface, density = _read_surface(surface_object, settings, depsgraph)
    texture = scene.read_texture(surface, settings.density_image)
    key = root_key(settings, density, texture and texture.values)
    roots = _kept_roots(target, surface, key) if keeps_roots else None
    device, place, target = preferences.device(), Remembered(surface_object), Remembered(target)
    guides = yield lambda progress: groom.distribute_guides(
        surface.mesh,
        settings,
        density=density,
        texture=texture,
        mirror_normal=surface.mirror_normal,
        shape=surface.shape,
        roots=roots,
        device=device,
        progress=progress,
    )
    return _write_guides(target.find(), place.find(), surface, guides, settings, key)


def interpolate_hair(guide_curves, settings, depsgraph, target=None):
    """Grow strands between guides; returns their Curves data, a new object's unless `target` is given.

    Raises `HairError` before anything in the scene changes.
    """
    return run_now(interpolating_hair(guide_curves, settings, depsgraph, target))


def interpolating_hair(guide_curves, settings, depsgraph, target=None):
    """`interpolate_hair` as work in steps."""
    place, its_guides, its_target = map(Remembered, (guide_curves.surface, guide_curves, target))
    bound = yield from _binding_hair(guide_curves, settings, depsgraph, target)
    return _write_bound(its_target.find(), place.find(), its_guides.find(), bound)


def bind_hair(guide_curves, settings, depsgraph, target=None):
    """The `BoundHair` that grows between guides, written nowhere. Strands of `target` keep their roots if they may."""
    return run_now(_binding_hair(guide_curves, settings, depsgraph, target))


def _binding_hair(guide_curves, settings, depsgraph, target):
    surface, density = _read_surface(guide_curves.surface, settings, depsgraph, target)
    guides = read_guides(guide_curves, surface)
    key = root_key(settings, density)
    parting = partings.read(guide_curves.surface, surface, guide_curves, settings, depsgraph)
    found = _found_guides(target, settings, key, parting.key, guides, surface)
    roots = _kept_roots(target, surface, key) if found is None else None
    device, guide_uid = preferences.device(), guide_curves.session_uid

    def compute(progress):
        if found is None:
            binding = _bind(surface, guides, settings, density, parting, roots, device, progress)
        else:
            binding = hair_binding.weigh_again(found, settings)
        return _growing(BoundHair(binding, settings, key, parting.key, guides, guide_uid, surface), progress)

    return (yield compute)


def _found_guides(target, settings, key, parting_key, guides, surface):
    """The `HairBinding` of hair whose strands would find the guides that they follow already; else None.

    So sliders of weights, limits and widths search nothing.
    """
    bound = None if target is None else bindings.of(target)
    if bound is None or (bound.root_key, bound.parting_key) != (key, parting_key):
        return None
    most = bound.binding.candidates.indices.shape[1] - 1
    is_same = bound.surface.is_at_rest_as(surface) and bound.guides.roots.is_same(guides.roots)
    return bound.binding if is_same and settings.neighbour_limit <= most else None


def adding_hair(surface_object, guide_settings, hair_settings, depsgraph):
    """Guides on a mesh object and hair between them, as work in steps; returns the Curves of both.

    No object is made before all of it is computed.
    """
    surface, density = _read_surface(surface_object, guide_settings, depsgraph)
    texture = scene.read_texture(surface, guide_settings.density_image)
    parting = partings.read(surface_object, surface, None, hair_settings, depsgraph)
    device, place, hair_key = preferences.device(), Remembered(surface_object), root_key(hair_settings, density)

    def compute(progress):
        grown = groom.distribute_guides(
            surface.mesh,
            guide_settings,
            density=density,
            texture=texture,
            mirror_normal=surface.mirror_normal,
            shape=surface.shape,
            device=device,
            progress=part_of(progress, 0.0, 0.5),
        )
        guides = _as_written(grown, surface, device)
        progress = part_of(progress, 0.5, 1.0)
        binding = _bind(surface, guides, hair_settings, density, parting, None, device, progress)
        bound = BoundHair(binding, hair_settings, hair_key, parting.key, guides, None, surface)
        return grown, _growing(bound, progress)

    grown, bound = yield compute
    key = root_key(guide_settings, density, texture and texture.values)
    guide_curves = _write_guides(None, place.find(), surface, grown, guide_settings, key)
    bound.guide_uid = guide_curves.session_uid
    return guide_curves, _write_bound(None, place.find(), guide_curves, bound)


def _as_written(guides, surface, device):
    """Guides as Curves will give them back, rounded in local coordinates: hair is the same as if they were there."""
    points = surface.to_local(guides.numpy())
    return strands.from_numpy(surface.from_local(points), guides.roots, device)


def _bind(surface, guides, settings, density, parting, roots, device, progress):
    return groom.bind_hair(
        surface.mesh,
        guides,
        settings,
        density=density,
        regions=parting.regions,
        lines=parting.lines,
        drawn_on=surface.from_local(surface.posed) if surface.is_deformed else None,
        shape=surface.shape,
        roots=roots,
        device=device,
        progress=part_of(progress, 0.0, 0.8),
    )


def _growing(bound, progress):
    """The `BoundHair` when all about its strands is known but where their points are: these grow on other threads."""
    progress("Growing strands", 0.8)
    weights = hair_binding.weights_now(bound.binding, bound.guides)
    bound.shares = weights.weights.numpy()
    _ = bound.leaders, bound.identities  # now, and not while other threads need the processor
    bound.growing = hair_binding.growing_points(bound.binding, bound.guides, weights, bound.surface.put_local)
    return bound


def _write_guides(target, surface_object, surface, guides, settings, key):
    target = target or curves.new_object("Guides", surface_object, is_rendered=False).data
    _keep_settings(target, "GUIDES", target.vellus.guides, settings)
    target.vellus.root_key = key
    radii = np.full(guides.points.shape[1], 0.5e-3 / surface.scale, np.float32)
    points = Future()
    points.set_result(surface.to_local(guides.numpy()))
    curves.make_strands(target, surface, guides.roots, radii, surface.identities(guides.roots))
    curves.write_points(target, points)
    curves.keep_surface(target, surface)
    return target


def _write_bound(target, surface_object, guide_curves, bound):
    target = target or curves.new_object("Hair", surface_object).data
    curves.require_editable(target)
    target.vellus.guide_curves = guide_curves
    bindings.keep(target, bound)
    write_hair(target)
    looks.evaluate_shading(target)
    return target


def write_hair(target):
    """Bring a hair Curves datablock up to what it is bound to: the one place where hair is written."""
    bound, state = bindings.of(target), target.vellus
    if not bound.has_moved_only:
        _keep_settings(target, "HAIR", state.hair, bound.settings)
        state.root_key, state.parting_key = bound.root_key, bound.parting_key
        binding, radii = bound.binding, bound.radii
        normals = binding.normals.numpy()
        curves.make_strands(
            target,
            bound.surface,
            binding.roots,
            radii,
            bound.identities,
            leaders=bound.leaders,
            normals=normals,
            written_radii=bound.written_radii,
        )
        bound.written_radii = radii
    if not bound.is_map_written:
        curves.write_guide_map(target, bound.guide_map if bound.settings.guide_map else None)
    curves.write_points(target, bound.growing)
    state.is_stale = False  # as which another choice of guides marks it
    state.followed = guides_digest(state.guide_curves)
    bound.is_written = bound.has_moved_only = bound.is_map_written = bound.is_report_due = True
    _store_roots(state.guide_curves, bound)


def _store_roots(guide_curves, bound):
    """Tell guides that were drawn or slid by a brush where they are rooted now: so that their surface carries them."""
    if guide_curves is None or guide_curves.library is not None or guide_curves.session_uid != bound.guide_uid:
        return
    stored, roots, surface = curves.read_root_places(guide_curves), bound.guides.roots, bound.surface
    wanted = surface.root_vertices(roots), surface.swap_winding(roots).barycentric
    if stored is None or not all(map(np.array_equal, stored, wanted)):
        curves.write_roots(guide_curves, surface, roots)


def root_key(settings, density, image=None):
    """What roots are placed by, beside the surface: while it stays, so do they. image: its values, if there is one."""
    names = (
        *("seed", "guide_count", "relax_iterations", "density_image", "curvature", "symmetric"),
        "strand_count",
    )
    placing = repr([getattr(settings, name, None) for name in names])
    painted = b"".join(values.tobytes() for values in (density, image) if values is not None)
    return hashlib.blake2b(placing.encode() + painted, digest_size=16).hexdigest()


def _kept_roots(target, surface, key):
    """The `SurfacePoints` that Curves store, if they were placed by this `root_key` on these triangles; else None."""
    if target is None or (target.vellus.root_key, target.vellus.topology) != (key, surface.topology):
        return None
    return curves.stored_roots(target, surface)


def guides_digest(guide_curves):
    """What says whether hair was written for guides as they are: undo may bring back one and not the other."""
    if guide_curves is None:
        return ""
    from ..core.fingerprint import fingerprint  # Warp takes longer to import than the add-on may take to start

    return fingerprint(curves.read_points(guide_curves))


def read_guides(guide_curves, surface):
    """Guides as they are combed now: `Strands` of one point count, however many each curve has."""
    counts = curves.point_counts(guide_curves)
    if not len(counts):
        raise HairError(f'"{guide_curves.name}" has no guides: distribute some first.')
    local = curves.read_points(guide_curves)
    if not np.isfinite(local).all():
        sentence = '"{name}" has points that are no numbers: undo, or delete those guides.'
        raise HairError(sentence, name=guide_curves.name)
    points = surface.from_local(local)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    roots = curves.read_roots(guide_curves, surface, points[offsets[:-1]])
    if (counts == groom.POINT_COUNT).all():
        points = points.reshape(len(counts), groom.POINT_COUNT, 3)
    else:
        points = strands.resample(points, offsets, groom.POINT_COUNT)
    return strands.from_numpy(points, roots, preferences.device())


def has_other_parting(target, depsgraph):
    """Whether what hair was parted by has changed: regions, or lines. Raises `HairError`."""
    group = target.vellus.hair
    if not partings.is_wanted(group) or target.surface is None:
        return False
    surface = scene.read_surface(target.surface, depsgraph)
    parting = partings.read(target.surface, surface, target.vellus.guide_curves, group, depsgraph)
    return parting.key != target.vellus.parting_key


def has_other_density(target, depsgraph):
    """Whether the weights that roots were placed by have been painted over."""
    state = target.vellus
    group, settings_class = (
        (state.guides, groom.GuideSettings) if state.kind == "GUIDES" else (state.hair, groom.HairSettings)
    )
    if not group.density_group:
        return False  # the surface has no say but by its shape
    settings = properties.to_settings(group, settings_class)
    density = scene.read_vertex_group(target.surface, depsgraph, settings.density_group)
    image = scene.read_image(getattr(settings, "density_image", ""))
    return state.root_key != root_key(settings, density, image)


def evaluate(target, depsgraph):
    """Make Curves again from the settings and inputs they keep. What is wrong becomes their status.

    Curves that somebody combed are left as they are: to replace them takes an operator, which is a decision.
    """
    state = target.vellus
    state.is_stale = False
    try:
        require_uncombed(target)
        if state.kind == "GUIDES":
            settings = properties.to_settings(state.guides, groom.GuideSettings)
            distribute_guides(target.surface, settings, depsgraph, target, keeps_roots=True)
        elif state.kind == "HAIR":
            interpolate_hair(*inputs_of(target), depsgraph, target)
    except HairError as error:
        state.status = str(error)


def require_uncombed(target):
    """Raise `HairError` for Curves that somebody's hand was in."""
    if curves.is_combed(target):
        raise HairError(f'"{target.name}" was combed and is kept: run its operator again to replace it.')


def inputs_of(target):
    """(guide Curves, `HairSettings`) of a hair Curves datablock. Raises `HairError`."""
    state = target.vellus
    if state.guide_curves is None:
        raise HairError(f'"{target.name}" has lost its guides: pick them in the Hair tab.')
    return state.guide_curves, properties.to_settings(state.hair, groom.HairSettings)


def _read_surface(surface_object, settings, depsgraph, target=None):
    """`Surface` and the density (V,) or None that settings name, of a mesh object that may be changed.

    The surface that `target` is bound to, if that is the same: of which normals and areas are known.
    """
    _check_surface(surface_object)
    curves.keep_rest(surface_object)
    surface, bound = scene.read_surface(surface_object, depsgraph), target and bindings.of(target)
    if bound is not None and bound.surface.is_same(surface):
        surface = bound.surface
    return surface, scene.read_vertex_group(surface_object, depsgraph, settings.density_group)


def _check_surface(surface_object):
    if surface_object is None or surface_object.type != "MESH":
        raise HairError("Hair needs a mesh object to grow on: select one.")
    curves.require_editable(surface_object)


def _keep_settings(target, kind, group, settings):
    curves.require_editable(target)
    properties.assign(group, settings)
    target.vellus.kind = kind
    target.vellus.is_stale = False
    target.vellus.status = ""
