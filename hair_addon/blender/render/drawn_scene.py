# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene on the GPU: hair, surfaces, lights and their shadow maps."""

from dataclasses import dataclass, replace

import numpy as np

from ...core.errors import HairError
from ..data import drawn_meshes
from ..gpu import (
    ambient_visibility,
    drawing,
    level_of_detail,
    render_programs,
    scene_lights,
    strand_textures,
    surface_shading,
    uniforms,
    world_texture,
)
from ..gpu import lights as light_door
from ..gpu.shadows import ShadowMaps
from ..host.notices import can_be_drawn
from . import hair_cache, hair_places

# The number of strands that a shadow map can resolve, thickened in proportion; and the number during a stroke of the
# comb.
_SHADOW_STEPS = drawing.Steps(strand_count=50_000)
_DRAFT_STEPS = drawing.Steps(point_count=21, strand_count=10_000)


@dataclass(frozen=True)
class DrawnScene:
    """Read once by `read`, drawn from any number of views until something moves."""

    hair: list  # (StrandsOnGPU, Shading, object to world, linear RGB of the surface it grows on, part in viewports)
    surfaces: list  # (SurfaceOnGPU, parts of a `DrawnMesh`, None of a holdout)
    lights: np.ndarray  # uniforms.LIGHTS: of all, as far as they are drawn one by one
    world: light_door.World
    shadow_maps: ShadowMaps | None  # None in a viewport without hair
    hair_visibility: list  # {sampler: texture} of the world's light on each of the hair
    surface_visibility: list  # of `surfaces`, then of `clear`
    # session_uid of the object that a click on each hair selects; in a render `drawn_meshes.owner_of` it.
    owners: tuple = ()
    selected: tuple = ()  # whether that object is selected
    instances: tuple = ()  # of hair, as `hair_places.read_instances` found them
    surface_owners: tuple = ()  # `drawn_meshes.owner_of` each surface
    meshes: tuple = ()  # (corner positions, linear RGB) of each of `surfaces`, of a render
    clear: tuple = ()  # as `surfaces`, of those that hide nothing
    lamps: scene_lights.SceneLights | None = None
    receivers: tuple = ()  # `scene_lights.Receiver` of `surfaces`, then of `clear`
    hair_lights: np.ndarray | None = None  # uniforms.LIGHTS of each of the hair; None: of all
    surface_lights: np.ndarray | None = None  # the same of `surfaces`, then of `clear`


_EMPTY = DrawnScene([], [], uniforms.LIGHTS.record(), light_door.World(np.zeros(3)), None, [], [])


def read(
    blender_scene,
    view_layer,
    depsgraph,
    viewport=None,
    refused=None,
    before=None,
    is_draft=False,
    is_hair_only=True,
):
    """Bring a scene to the GPU and draw its shadow maps.

    viewport: the 3-D viewport whose visibility counts, None for a render; refused: called with the datablock and the
    `HairError` of hair that cannot be drawn, which otherwise is raised; before: the `DrawnScene` from before hair
    changed, and nothing else; is_draft: hair is about to change again, and shadows may be coarse; is_hair_only: whether
    Blender draws the rest of a viewport.
    """
    corners = () if before is None else before.meshes
    # Where only the geometry of hair has changed, instances are where they were.
    instances = hair_places.read_instances(depsgraph, viewport) if before is None else before.instances
    hair, places = _read_hair(hair_places.hair_places(view_layer, viewport, instances), viewport, refused)
    if viewport is not None and is_hair_only and not hair:
        # Scenes without hair have no cost.
        return _EMPTY
    if before is None or before.shadow_maps is None:
        meshes, is_shaded = drawn_meshes.read_drawn_meshes(depsgraph, viewport), viewport is None or not is_hair_only
        surfaces, clear, receivers = _upload(meshes, is_shaded)
        if viewport is None:
            corners = _corners_of(meshes)
        surface_owners = tuple(mesh.owner for mesh in meshes if not (is_shaded and mesh.is_clear))
        world = light_door.read_world(blender_scene)
        lamps = maps = None
    else:
        surfaces, clear, surface_owners = before.surfaces, before.clear, before.surface_owners
        receivers, world, lamps, maps = before.receivers, before.world, before.lamps, before.shadow_maps
    hair_receivers = _hair_receivers(hair, [(place.owner, place.hair_object.session_uid) for place in places])
    if lamps is None:
        found = light_door.read_lights(depsgraph, for_render=viewport is None)
        lamps = scene_lights.gather(*found, world, hair_receivers)
    if is_draft and before is not None and _have_same_places(before.hair, hair):
        seen = before.hair_visibility, before.surface_visibility
    else:
        seen = _visibility(hair, surfaces, clear)
    owners, selected = tuple(place.owner for place in places), tuple(place.is_selected for place in places)
    drawn = replace(
        _EMPTY,
        hair=hair,
        surfaces=surfaces,
        world=world,
        hair_visibility=seen[0],
        surface_visibility=seen[1],
        owners=owners,
        selected=selected,
        instances=instances,
        surface_owners=surface_owners,
        meshes=corners,
        clear=clear,
        receivers=receivers,
    )
    return _lit(drawn, lamps, maps, hair_receivers, _DRAFT_STEPS if is_draft else _SHADOW_STEPS)


def _lit(drawn, lamps, maps, hair_receivers, steps):
    """A `DrawnScene` with `SceneLights`: as all that is in it is lit by them, with their shadow maps."""
    maps = maps or scene_lights.new_maps(lamps.record)
    placed, batches = _placed(drawn.hair), [surface.batch for surface, _ in drawn.surfaces]
    hair_owners = [receiver.owner for receiver in hair_receivers]
    surface_owners = [receiver.owner for receiver in drawn.receivers[: len(batches)]]
    maps.draw(lamps.record, placed, batches, steps, lamps.casters(placed, hair_owners, batches, surface_owners))
    own = {}
    if not lamps.are_alike:
        own = {"hair_lights": lamps.lit(hair_receivers), "surface_lights": lamps.lit(drawn.receivers)}
    return replace(drawn, lights=lamps.record, lamps=lamps, shadow_maps=maps, **own)


def _hair_receivers(hair, owners):
    """[`Receiver`] of hair; owners: session_uids of the instancer, or another time its own, and its own."""
    return [
        scene_lights.Receiver(owner, scene_lights.places_of_hair(strands.points, to_world))
        for (strands, _shading, to_world, *_), owner in zip(hair, owners, strict=True)
    ]


def read_render(depsgraph, known, refused):
    """The same for a render, whose depsgraph may be at another time than the file: evaluated hair is read.

    refused: called with the datablock and the `HairError` of hair that cannot be drawn, and is left out; known:
    {session_uid: (points, radii, random numbers, StrandsOnGPU)} of what was drawn a moment before, changed: what stands
    still is not uploaded again.
    """
    unlit = read_unlit(depsgraph, known, refused)
    world = light_door.read_world(depsgraph.scene_eval)
    hair_receivers = _hair_receivers(unlit.hair, [owner[1::-1] for owner in unlit.owners])
    lamps = scene_lights.gather(*light_door.read_lights(depsgraph, for_render=True), world, hair_receivers)
    hair_seen, surfaces_seen = _visibility(unlit.hair, unlit.surfaces, unlit.clear)
    drawn = replace(unlit, world=world, hair_visibility=hair_seen, surface_visibility=surfaces_seen)
    return _lit(drawn, lamps, None, hair_receivers, _SHADOW_STEPS)


def read_unlit(depsgraph, known, refused):
    """The same without lighting, for motion vectors."""
    found = list(_read_rendered_hair(depsgraph, known, refused))
    meshes = drawn_meshes.read_drawn_meshes(depsgraph)
    if depsgraph.scene.vellus.is_hair_only:
        meshes = drawn_meshes.held_out(meshes)
    hair, owners = [hair for hair, _owner in found], tuple(owner for _hair, owner in found)
    surface_owners = tuple(mesh.owner for mesh in meshes if not mesh.is_clear)
    surfaces, clear, receivers = _upload(meshes, is_shaded=True)
    return replace(
        _EMPTY,
        hair=hair,
        surfaces=surfaces,
        clear=clear,
        receivers=receivers,
        owners=owners,
        surface_owners=surface_owners,
        meshes=_corners_of(meshes),
    )


def _corners_of(meshes):
    """`DrawnScene.meshes`."""
    return tuple((mesh.positions, mesh.color) for mesh in meshes if not mesh.is_clear)


def _upload(meshes, is_shaded):
    """(surfaces, those that are clear, receivers) of a `DrawnScene`; is_shaded: whether they are seen as we shade."""
    uploaded = {False: [], True: []}
    for mesh in meshes:
        surface = drawing.upload_surface(mesh.positions, mesh.normals, mesh.uvs), mesh.parts
        receiver = scene_lights.Receiver(mesh.owner[1::-1], scene_lights.places_on_surface(mesh.positions))
        uploaded[is_shaded and mesh.is_clear].append((surface, receiver))
    solid, clear = ([surface for surface, _receiver in uploaded[is_clear]] for is_clear in (False, True))
    receivers = tuple(receiver for is_clear in (False, True) for _surface, receiver in uploaded[is_clear])
    return solid, tuple(clear), receivers


def _placed(hair):
    return [(strands, to_world) for strands, _, to_world, *_ in hair]


def _visibility(hair, surfaces, clear):
    opacities = [shading.opacity for _, shading, *_ in hair]
    forwards = [shading.forward for _, shading, *_ in hair]
    solid, seen_through = ([surface for surface, _parts in some] for some in (surfaces, clear))
    return ambient_visibility.measure(_placed(hair), solid, opacities, seen_through, forwards)


def _read_rendered_hair(depsgraph, known, refused):
    for instance in depsgraph.object_instances:
        hair_object = instance.object
        original = hair_object.original.data
        if hair_object.type != "CURVES" or original.vellus.kind != "HAIR" or not len(hair_object.data.curves):
            continue
        to_world = np.array(instance.matrix_world, np.float64)
        if not can_be_drawn(hair_object, to_world):
            continue
        try:
            arrays = hair_cache.read_strands(hair_object.data)
            uid = hair_object.original.session_uid
            if uid not in known or not all(map(np.array_equal, arrays, known[uid])):
                known[uid] = (*arrays, strand_textures.upload_strands(*arrays))
            strands = known[uid][-1]
            shading = hair_cache.shading_of(original.evaluated_get(depsgraph), strands)  # its settings may be keyed
        except HairError as error:
            refused(original, error)
            continue
        color = drawn_meshes.surface_color(original.surface)
        yield (strands, shading, to_world, color, 1.0), drawn_meshes.owner_of(instance)


def _read_hair(places, viewport, refused):
    """(hair of a `DrawnScene`, the `HairPlace` of each): of those places whose hair can be drawn."""
    hair, drawn_places = [], []
    for place in places:
        datablock = place.hair_object.data
        if viewport is not None and not datablock.vellus.is_drawn:
            continue
        if not can_be_drawn(place.hair_object, place.to_world):
            continue
        try:
            strands, shading = hair_cache.hair_on_gpu(datablock, is_viewport=viewport is not None)
        except HairError as error:
            if refused is None:
                raise
            refused(datablock, error)
            continue
        if strands is not None:
            part = 0.01 * datablock.vellus.viewport_percentage
            hair.append((strands, shading, place.to_world, drawn_meshes.surface_color(datablock.surface), part))
            drawn_places.append(place)
    return hair, drawn_places


def _have_same_places(hair, others):
    """Whether the visibility textures of some hair have a texel for each place of other hair."""
    sizes, other_sizes = ([(one[0].strand_count, one[0].point_count) for one in many] for many in (hair, others))
    return sizes == other_sizes


def draw_hiding(drawn, view):
    """Draw the depth of all surfaces, and nothing of their light, into the bound framebuffer."""
    with drawing.gpu_state("LESS_EQUAL", depth_writes=True):
        for surface, _parts in drawn.surfaces:
            drawing.draw_surface_depth(surface.batch, view, drawn.lights, "surface_hides.frag")


def draw_hair(drawn, view, buffer, is_viewport=False):
    """Draw all hair in front of the surfaces of a `VisibilityBuffer`.

    view: a `uniforms.VIEW` record; is_viewport: only as much of it as is seen from there, and as the artist wants.
    """
    lights = drawn.lights if drawn.hair_lights is None else drawn.hair_lights
    buffer.add_hair(_hair_in_view(drawn, view, is_viewport), lights, view)


def find_hair(drawn, view, buffer, chosen=None):
    """Find the nearest strands of hair for a `VisibilityBuffer` as a viewport shows them, and shade none.

    chosen: indices of the hair, None for all.
    """
    hair = _hair_in_view(drawn, view, is_viewport=True)
    buffer.find_hair(hair if chosen is None else [hair[index] for index in chosen], drawn.lights, view)


def _hair_in_view(drawn, view, is_viewport):
    hair = []
    for (strands, shading, to_world, color, part), seen in zip(drawn.hair, drawn.hair_visibility, strict=True):
        steps = level_of_detail.steps_of(strands, view, to_world, part) if is_viewport else drawing.Steps()
        hair.append((strands, shading, to_world, color, drawn.shadow_maps.samplers | seen, steps))
    return hair


def draw_behind_hair(drawn, view, buffer, is_transparent):
    """Fill a `VisibilityBuffer` with the background, unless it is to be left empty, and with all surfaces."""
    background = (0.0, 0.0, 0.0, 0.0) if is_transparent else (*drawn.world.color, 1.0)
    with buffer.surfaces(background):
        if drawn.world.image is not None and not is_transparent:
            world_texture.draw_background(drawn.world, view, *buffer.size)
        draw_surfaces(drawn, view)


def draw_arrival(drawn, view, buffer):
    """Return a texture of light visibility for the content of a `VisibilityBuffer`, to which hair was added last."""
    with buffer.surfaces_of_part(), drawing.gpu_state("LESS_EQUAL", depth_writes=True):
        _draw_by_lights(drawn, view, "surface_arrival.frag", are_holdouts_left_out=True)
    return buffer.part_by(render_programs.strand_arrival_program())


def draw_hair_shadow(drawn, view, buffer):
    """Return a texture of the part of the light on surfaces that hair lets through; 1 where there is no surface."""
    white = (1.0, 1.0, 1.0, 1.0)
    with buffer.surfaces_of_part(background=white), drawing.gpu_state("LESS_EQUAL", depth_writes=True):
        _draw_by_lights(drawn, view, "hair_shadow.frag")
    return buffer.part(background=white)


def draw_viewport_shadow(drawn, view):
    """As `draw_hiding`, and as black over what Blender draws, whose alpha is the part of the light that hair stops."""
    with drawing.gpu_state("LESS_EQUAL", depth_writes=True):
        _draw_by_lights(drawn, view, "hair_shadow_view.frag")


def _draw_by_lights(drawn, view, fragment, are_holdouts_left_out=False):
    """Draw how much of the light reaches surfaces; are_holdouts_left_out: leave the picture empty where they are."""
    _see_through_hair(drawn, view)
    program = render_programs.lit_surface_program(fragment)
    for (surface, parts), lights, samplers in zip(drawn.surfaces, *_light_of(drawn, solid=True), strict=True):
        if parts is None and are_holdouts_left_out:
            drawing.draw_surface_depth(surface.batch, view, lights, "surface_hides.frag")
            continue
        placed = view.copy()
        placed["row_strands"] = surface.row_corners
        drawing.draw_triangles(surface.batch, program, placed, lights, samplers)


def _light_of(drawn, solid):
    """(`uniforms.LIGHTS` records, {sampler: texture} dictionaries) of each surface that is solid, or of each clear."""
    count = len(drawn.surfaces)
    of_all = [drawn.lights] * len(drawn.surface_visibility) if drawn.surface_lights is None else drawn.surface_lights
    chosen = slice(count) if solid else slice(count, None)
    return of_all[chosen], [drawn.shadow_maps.samplers | seen for seen in drawn.surface_visibility[chosen]]


def _see_through_hair(drawn, view):
    """The hair's shadow on a surface takes the colour of the hair with most strands: one colour a draw call."""
    if drawn.hair:
        shading = drawn.hair[ambient_visibility.densest([strands for strands, *_ in drawn.hair])][1]
        view["hair_forward"][:3], view["seen_opacity"] = shading.forward, shading.opacity


def draw_surfaces(drawn, view):
    """Draw all surfaces with depth test into the bound framebuffer, and over them those that are clear."""
    _see_through_hair(drawn, view)
    with drawing.gpu_state("LESS_EQUAL", depth_writes=True):
        for (surface, parts), lights, samplers in zip(drawn.surfaces, *_light_of(drawn, solid=True), strict=True):
            if parts is None:
                drawing.draw_surface_depth(surface.batch, view, lights, "surface_hides.frag")
                continue
            surface_shading.draw(surface, parts, view, lights, samplers)
    with drawing.gpu_state("LESS_EQUAL", depth_writes=False, blend="ALPHA_PREMULT"):
        for (surface, parts), lights, samplers in zip(drawn.clear, *_light_of(drawn, solid=False), strict=True):
            surface_shading.draw(surface, parts, view, lights, samplers)
