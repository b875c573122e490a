# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene on the GPU: hair, surfaces, lights and their shadow maps."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...core.long_work import no_progress, part_of
from ..data.pictures import drawn_meshes, viewport_shading
from ..data.pictures.mist import WITHOUT_WORLD, Mist, read_mist
from ..gpu import (
    ambient_visibility,
    drawing,
    scene_lights,
    strand_batches,
    studio_lights,
    surface_textures,
    windows,
)
from ..gpu import lights as blender_lights
from ..gpu.programs import surface_programs, uniforms
from ..gpu.shadows import ShadowMaps
from . import drawn_hair, drawn_surfaces, gpu_strands, hair_places, motion_vectors

# The number of strands that a shadow map can resolve, thickened in proportion; and the number during a stroke.
_SHADOW_STEPS = drawing.Steps(strand_count=50_000)
_WIDE = 10.0  # radius within which surfaces cast shadows, in radii of the hair
_DRAFT_STEPS = drawing.Steps(point_count=21, strand_count=10_000)
_DRAFT_COUNTED = 20_000  # strands that are counted in a map while the GPU makes or carries hair: see `ShadowMaps.draw`


@dataclass(frozen=True)
class DrawnScene:
    """A scene on the GPU: read once by `read`, and drawn from any number of views until something moves."""

    hair: list  # (StrandsOnGPU, Shading, object to world, `level_of_detail.Limits` in viewports)
    surfaces: list  # visible solid surfaces: (SurfaceOnGPU, parts of a `DrawnMesh`, None for a holdout)
    lights: np.ndarray  # uniforms.LIGHTS shared by all receivers
    world: blender_lights.World
    shadow_maps: ShadowMaps | None  # None in a viewport without hair
    hair_visibility: list  # {sampler: texture} of the world's visibility from each hair
    surface_visibility: list  # of `surfaces`, then of `clear`
    # session_uid of the object that a click on each hair selects; in a render `drawn_meshes.owner_of` the hair.
    owners: tuple = ()
    hair_owners: tuple = ()  # owner of each hair, as in `scene_lights.Receiver`, in viewports
    selected: tuple = ()  # whether the owner of each hair is selected
    instances: tuple = ()  # of hair, from `hair_places.read_instances`
    surface_owners: tuple = ()  # `drawn_meshes.owner_of` each surface
    clear: tuple = ()  # visible clear surfaces, like `surfaces`
    blockers: tuple = ()  # `drawn_surfaces.Blocker`s: surfaces that block light, visible or not
    lamps: scene_lights.SceneLights | None = None
    receivers: tuple = ()  # `scene_lights.Receiver` of `surfaces`, then of `clear`
    renewal: ambient_visibility.Renewal | None = None  # of the visibility textures, while hair moves
    is_draft: bool = False  # whether hair was about to change again
    has_exact_boxes: bool = True  # whether shadow maps were drawn for the exact boxes of strands
    light: viewport_shading.ViewportLight = viewport_shading.SCENE_LIGHT
    is_wire: bool = False  # whether strands are thin lines
    is_shadowed: tuple = ()  # whether hair darkens each of `surfaces` in viewports; (): all of them
    hair_lights: np.ndarray | None = None  # uniforms.LIGHTS of each hair; None: `lights` for all
    surface_lights: np.ndarray | None = None  # the same for `surfaces`, then for `clear`
    mist: Mist = WITHOUT_WORLD  # in renders
    root_uvs: tuple = ()  # texture of each hair, or None without UVs, if a pass needs them

    @cached_property
    def batches(self):
        """[`strand_batches.Batch`] of all hair, without the steps and shadow maps of a view; linked hair is in one
        batch.
        """
        layers = ambient_visibility.layers(_placed(self.hair))
        keys = [self._key(index) for index in range(len(self.hair))]
        found = []
        for indices in strand_batches.groups_of(keys):
            strands, shading, _to_world, _limits = self.hair[indices[0]]
            to_world = np.stack([self.hair[index][2] for index in indices])
            own = None if layers[indices[0]] is None else np.array([layers[index] for index in indices])
            samplers = self.hair_visibility[indices[0]]
            tints = np.array([self.hair[index][1].tint for index in indices])
            batch = strand_batches.Batch(strands, shading, to_world, np.array(indices), own, samplers, tints=tints)
            found.append(batch)
        return found

    def _key(self, index):
        """Return a key that is equal for hair in the same batch."""
        strands, shading, _to_world, limits = self.hair[index]
        textures = tuple(map(id, self.hair_visibility[index].values()))
        lights = None if self.hair_lights is None else self.hair_lights[index].tobytes()
        return id(strands), shading.key, limits, textures, lights

    @cached_property
    def occluders(self):
        """`surfaces` for drawing of depth alone, from `surface_textures.linked`."""
        return surface_textures.linked([surface for surface, _parts in self.surfaces])

    @cached_property
    def shadowed(self):
        """[(`SurfaceOnGPU` or `LinkedSurfaces`, their `uniforms.LIGHTS`, {sampler: texture} of the world's visibility,
        whether hair darkens them)] of `surfaces` in a viewport; linked surfaces are joined.
        """
        surfaces, count = [surface for surface, _parts in self.surfaces], len(self.surfaces)
        lights = [self.lights] * count if self.surface_lights is None else self.surface_lights[:count]
        are_shadowed = self.is_shadowed or (True,) * count
        keys = [(record.tobytes(), is_dark) for record, is_dark in zip(lights, are_shadowed, strict=True)]
        found = []
        for group in surface_textures.linked_groups(surfaces, keys):
            chosen, seen = [surfaces[index] for index in group], [self.surface_visibility[index] for index in group]
            is_single, first = len(group) == 1, group[0]
            surface = chosen[0] if is_single else surface_textures.LinkedSurfaces(chosen)
            own = {name: seen[0][name] for name in surface_programs.SEEN_SAMPLERS}
            own = own if is_single or not are_shadowed[first] else ambient_visibility.joined(seen)
            found.append((surface, lights[first], own, are_shadowed[first]))
        return found

    @cached_property
    def looks(self):
        """`Shading`s of all hair; of hair that is wet in places, both layers, as their mix may change."""
        return tuple(layer for _strands, shading, *_ in self.hair for layer, _mix in shading.layers)

    @cached_property
    def places(self):
        """`motion_vectors.places_of` hair and surfaces."""
        return motion_vectors.places_of(self)


_EMPTY = DrawnScene([], [], uniforms.LIGHTS.record(), blender_lights.World(np.zeros(3)), None, [], [])


def read(
    blender_scene,
    view_layer,
    depsgraph,
    viewport=None,
    refused=None,
    before=None,
    is_draft=False,
    is_hair_only=True,
    former=None,
    shown=viewport_shading.BY_SCENE,
):
    """Upload a scene to the GPU and draw its shadow maps; returns the `DrawnScene`.

    viewport: the 3D viewport whose visibility settings apply, None for a render; refused: called with the datablock and
    the `HairError` of hair that cannot be drawn, None: the error is raised; before: the previous `DrawnScene` if only
    hair has changed since; is_draft: hair is about to change again, and shadows may be coarse; is_hair_only: whether
    Blender draws the rest of a viewport; former: the `DrawnScene` of the previous frame during playback; shown: how the
    viewport shows hair.
    """
    # If only the geometry of hair has changed, instances are unchanged.
    instances = hair_places.read_instances(depsgraph, viewport) if before is None else before.instances
    seen = hair_places.hair_places(view_layer, viewport, instances)
    hair, places = drawn_hair.read_shown(seen, viewport, refused, shown, depsgraph)
    if viewport is not None and is_hair_only and not hair:
        # Scenes without hair cost nothing.
        return _EMPTY
    is_shaded, grown_on = viewport is None or not is_hair_only, _surface_uids(places)
    has_normals = is_shaded or drawn_surfaces.needing_normals(
        blender_scene, viewport, shown, grown_on, former is not None
    )
    if before is None or before.shadow_maps is None or (has_normals is True and drawn_surfaces.lack_normals(before)):
        surroundings = drawn_surfaces.read_shown(
            depsgraph, viewport, shown, is_shaded, grown_on, former is not None, has_normals
        )
        world, lamps, maps = _world_of(shown.light, blender_scene, view_layer, viewport is None), None, None
    else:
        surroundings = {name: getattr(before, name) for name in drawn_surfaces.FIELDS}
        world, lamps, maps = before.world, before.lamps, before.shadow_maps
        if before.light != shown.light:
            world, lamps = _world_of(shown.light, blender_scene, view_layer), None
    hair_owners = tuple((place.owner, place.hair_object.session_uid) for place in places)
    hair_receivers = _hair_receivers(hair, hair_owners)
    if lamps is None:
        lamps = _lamps_of(shown.light, depsgraph, viewport is None, world, hair_receivers)
        maps = maps if _fit(maps, lamps, is_shaded) else None
    # Without a GPU, frames of playback are drawn like still frames. Hair that is only moved by its object is handled
    # like hair made on the GPU, also once it is at rest.
    has_played = former is not None or (before is not None and before.renewal is not None)
    are_made = _are_made(hair) or (has_played and bool(hair) and gpu_strands.are_wanted())
    last = before or (former if are_made else None)
    is_draft = is_draft or (former is not None and are_made)
    # Only in a row of edits may the boxes of the hair before stand for those of hair that the GPU still makes.
    if not (is_draft and before is not None and before.is_draft):
        for strands, *_rest in hair:
            strands.box.require()
    if before is None and last is not None and _fit(last.shadow_maps, lamps, is_shaded):
        maps = last.shadow_maps
    is_shadowed = ()
    if shown.light.kind != viewport_shading.SCENE:
        is_shadowed = tuple(owner[0] in grown_on for owner in surroundings["surface_owners"])
    drawn = replace(
        _EMPTY,
        hair=hair,
        world=world,
        light=shown.light,
        is_wire=shown.is_wire,
        is_shadowed=is_shadowed,
        owners=tuple(place.owner for place in places),
        hair_owners=hair_owners,
        selected=tuple(place.is_selected for place in places),
        instances=instances,
        **surroundings,
    )
    maps = maps or scene_lights.new_maps(lamps.record, is_shaded)
    # Lights first: only their maps can be drawn without the bounds of strands, which the GPU may still be making.
    drawn = _lit(drawn, lamps, maps, hair_receivers, are_made, is_draft)
    are_exact = all(strands.box.is_exact for strands, *_rest in hair)
    (hair_seen, surfaces_seen), renewal = _visibility_since(last if is_draft else None, drawn, are_made)
    seen = {"hair_visibility": hair_seen, "surface_visibility": surfaces_seen, "renewal": renewal}
    return replace(drawn, **seen, is_draft=is_draft, has_exact_boxes=are_exact)


def has_room(drawn):
    """Whether the shadow maps of a `DrawnScene` contain its hair, by the exact boxes of hair."""
    if drawn.has_exact_boxes:
        return True
    for strands, *_rest in drawn.hair:
        strands.box.require()
    return drawn.shadow_maps.contain(_placed(drawn.hair))


def _surface_uids(places):
    """Return {session_uid} of the objects that hair grows on."""
    surfaces = {place.hair_object.data.surface for place in places} - {None}
    return {surface.session_uid for surface in surfaces}


def relit(drawn, blender_scene, view_layer, depsgraph, light, maps=None, is_wide=False):
    """Return a `DrawnScene` in a viewport with another light; light: a `viewport_shading.ViewportLight`.

    maps: `ShadowMaps` that may be drawn again; is_wide: whether Vellus draws all of the viewport.
    """
    world = _world_of(light, blender_scene, view_layer)
    hair_receivers = _hair_receivers(drawn.hair, drawn.hair_owners)
    lamps = _lamps_of(light, depsgraph, False, world, hair_receivers)
    if not _fit(maps, lamps, is_wide):
        maps = scene_lights.new_maps(lamps.record, is_wide)
    drawn = replace(drawn, world=world, light=light, hair_lights=None, surface_lights=None)
    return _lit(drawn, lamps, maps, hair_receivers, _are_made(drawn.hair))


def _world_of(light, blender_scene, view_layer, waits=False):
    """Return the `World` of a viewport's light; waits: as of `lights.read_world`."""
    if light.hdri is not None:
        return blender_lights.world_of_hdri(light.hdri)
    if light.has_world and light.kind == viewport_shading.SCENE:
        return blender_lights.read_world(blender_scene, view_layer, waits)
    return blender_lights.World(np.array(light.ambient))


def _lamps_of(light, depsgraph, for_render, world, hair_receivers):
    """Return the `SceneLights` of a viewport's light and `World`."""
    if light.kind != viewport_shading.SCENE:
        found, ambient = studio_lights.lamps_of(light.lights, light.has_highlights)
        return scene_lights.of_studio(found, world.color + ambient)
    if not light.has_lights:
        return scene_lights.gather(*blender_lights.NO_LIGHTS, world, hair_receivers)
    return _scene_lights(depsgraph, for_render, world, hair_receivers)


def _scene_lights(depsgraph, for_render, world, hair_receivers):
    """Return the `SceneLights` of the lights of a scene and a `World`."""
    places = np.concatenate([np.zeros((0, 3)), *(receiver.places for receiver in hair_receivers)])
    return scene_lights.gather(*blender_lights.read_lights(depsgraph, for_render, places), world, hair_receivers)


def _are_made(hair):
    """Whether the GPU made or carried all hair, which makes full shadows cheap while hair moves."""
    return bool(hair) and all(strands.is_made for strands, *_ in hair)


def _fit(maps, lamps, is_wide):
    preserves_widths = maps is not None and maps.is_wide == is_wide
    return preserves_widths and maps.layer_count == max(1, int(lamps.record["count"]))


def _lit(drawn, lamps, maps, hair_receivers, are_made=False, is_draft=False):
    """Return a `DrawnScene` lit by `SceneLights`, with their shadow maps; are_made: whether a GPU makes or carries
    hair.
    """
    placed, solid = _placed(drawn.hair), _blocking(drawn)
    hair_owners = [receiver.owner for receiver in hair_receivers]
    steps = _DRAFT_STEPS if is_draft and not are_made else _SHADOW_STEPS
    casters = lamps.casters(placed, hair_owners, solid, [blocker.owner for blocker in drawn.blockers])
    maps.patterns = lamps.patterns
    # If the GPU makes strands, shadows in motion have the same edges as at rest.
    counted = _DRAFT_COUNTED if is_draft and are_made else None
    maps.draw(lamps.record, placed, solid, steps, casters, is_steady=is_draft or are_made, counted=counted)
    if maps.is_wide and (sphere := _sphere_around_hair(drawn)) is not None:
        maps.draw_wide(lamps.record, solid, sphere, casters)
    return _with_lamps(replace(drawn, shadow_maps=maps), lamps, hair_receivers)


def with_lamps(drawn, lamps):
    """Return a `DrawnScene` of a render with other `SceneLights` that have its shadow maps."""
    return _with_lamps(drawn, lamps, _hair_receivers(drawn.hair, [owner[1::-1] for owner in drawn.owners]))


def _with_lamps(drawn, lamps, hair_receivers):
    own = {}
    if not lamps.are_alike:
        own = {"hair_lights": lamps.lit(hair_receivers), "surface_lights": lamps.lit(drawn.receivers)}
    return replace(drawn, lights=lamps.record, lamps=lamps, **own)


def _sphere_around_hair(drawn):
    """Return (center, radius) of a sphere around all surfaces, or those near hair; None if maps of hair contain them
    all.
    """
    surfaces = {*_blocking(drawn), *_receiving(drawn)}
    if not surfaces:
        return None
    corners = np.concatenate(
        [windows.corners_of(one.bounds) @ one.to_world[:3, :3].T + one.to_world[:3, 3] for one in surfaces]
    )
    centre = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    radius = float(np.linalg.norm(corners - centre, axis=1).max())
    if not drawn.hair:
        return centre, radius
    middle, around = drawing.bounding_sphere(_placed(drawn.hair))
    if np.linalg.norm(corners - middle, axis=1).max() <= around:
        return None
    return (centre, radius) if radius <= _WIDE * around else (middle, _WIDE * around)


def _hair_receivers(hair, owners):
    """Return [`Receiver`] of hair; owners: (session UID of the instancer, or of the object, session UID of the
    object).
    """
    return [
        scene_lights.Receiver(owner, scene_lights.places_of_hair(strands.points, to_world))
        for (strands, _shading, to_world, *_), owner in zip(hair, owners, strict=True)
    ]


def read_render(depsgraph, known, refused, noted, progress=no_progress):
    """`read` for a render, whose depsgraph may be at another time than the file: evaluated hair is read.

    refused: called with the datablock and the `HairError` of hair that is left out, and of surfaces that cannot be
    baked; noted: the same for hair with some strands left out; known: {session_uid: (arrays of the strands,
    StrandsOnGPU)} of the previous motion step, updated here: unchanged hair is not uploaded again.
    """
    unlit = read_unlit(depsgraph, known, refused, noted, part_of(progress, 0.0, 0.5))
    progress("Reading lights", 0.5)
    world = blender_lights.read_world(depsgraph.scene_eval, depsgraph.view_layer_eval)
    hair_receivers = _hair_receivers(unlit.hair, [owner[1::-1] for owner in unlit.owners])
    lamps = _scene_lights(depsgraph, True, world, hair_receivers)
    hair_seen, surfaces_seen = visibility(unlit)
    progress("Drawing shadows", 0.7)
    drawn = replace(unlit, world=world, hair_visibility=hair_seen, surface_visibility=surfaces_seen)
    drawn = replace(drawn, mist=read_mist(depsgraph.scene_eval, depsgraph.view_layer_eval))
    return _lit(drawn, lamps, scene_lights.new_maps(lamps.record, is_wide=True), hair_receivers)


def read_unlit(depsgraph, known, refused, noted, progress=no_progress):
    """`read_render` without lighting, for motion vectors."""
    count = sum(drawn_hair.is_hair(instance.object) for instance in depsgraph.object_instances)
    progress("Reading hair", 0.0)
    found = []
    for one in drawn_hair.read_rendered(depsgraph, known, refused, noted):
        found.append(one)
        progress("Reading hair", 0.6 * len(found) / count)
    progress("Reading surfaces", 0.6)
    has_uvs = depsgraph.view_layer.use_pass_uv
    meshes = drawn_meshes.split_clear(drawn_meshes.read_drawn_meshes(depsgraph, has_uvs=has_uvs, refused=refused))
    if depsgraph.scene.vellus.is_hair_only:
        meshes = drawn_meshes.as_holdouts(meshes)
    hair, owners, root_uvs = zip(*found, strict=True) if found else ((), (), ())
    lists = {"hair": list(hair), "owners": owners, "root_uvs": root_uvs}
    return replace(_EMPTY, **lists, **drawn_surfaces.upload(meshes, is_shaded=True, has_paths=True))


def _placed(hair):
    return [(strands, to_world) for strands, _, to_world, *_ in hair]


def _blocking(drawn):
    """Return [`SurfaceOnGPU`] that block light."""
    return [blocker.surface for blocker in drawn.blockers]


def _receiving(drawn):
    """Return [`SurfaceOnGPU`] that are lit, in the order of `DrawnScene.surface_visibility`."""
    return [surface for surface, _parts in (*drawn.surfaces, *drawn.clear)]


def visibility(drawn):
    """Visibility of the world in a `DrawnScene`: (textures of hair, textures of surfaces)."""
    opacities = [shading.opacity for _, shading, *_ in drawn.hair]
    forwards = [shading.forward for _, shading, *_ in drawn.hair]
    return ambient_visibility.measure(_placed(drawn.hair), _blocking(drawn), opacities, _receiving(drawn), forwards)


def _visibility_since(last, drawn, are_made):
    """Return (`visibility` of a `DrawnScene`, the `Renewal` that updates it or None); last: the former one, or None.

    are_made: whether a GPU makes or carries hair: then visibility is updated by one step, otherwise it is kept.
    """
    if last is None or not _have_same_places(last, drawn):
        return visibility(drawn), None
    seen = last.hair_visibility, last.surface_visibility
    if not are_made:
        return seen, None
    renewal = last.renewal or ambient_visibility.Renewal()
    return _renewed(renewal, seen, drawn), renewal


def _renewed(renewal, seen, drawn):
    """`visibility` by one step of a `Renewal`; seen: the visibility before."""
    through = [(shading.opacity, shading.forward) for _, shading, *_ in drawn.hair]
    return renewal.step(seen, _placed(drawn.hair), _blocking(drawn), through, _receiving(drawn))


def _have_same_places(drawn, other):
    """Whether the visibility textures of a `DrawnScene` fit the hair and surfaces of another."""
    sizes, others = ([(one[0].strand_count, one[0].point_count) for one in many.hair] for many in (drawn, other))
    layers, other_layers = (ambient_visibility.layers(_placed(many.hair)) for many in (drawn, other))
    corners, other_corners = ([surface.vertex_count for surface in _receiving(many)] for many in (drawn, other))
    return (sizes, layers, corners) == (others, other_layers, other_corners)
