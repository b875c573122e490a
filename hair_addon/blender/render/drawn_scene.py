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
    strand_textures,
    surface_shading,
    uniforms,
    world_texture,
)
from ..gpu import lights as light_door
from ..gpu.shadows import SUN, ShadowMaps
from ..host.notices import can_be_drawn
from . import hair_cache, hair_places

_SHADOWED_LIGHTS = 8
_MAP_SIZE = 512  # texels along a side of each light's map: on a head, 0.8 mm

# The number of strands that such a map can resolve, thickened in proportion; and the number during a stroke of the
# comb.
_SHADOW_STEPS = drawing.Steps(strand_count=50_000)
_DRAFT_STEPS = drawing.Steps(point_count=21, strand_count=10_000)


@dataclass(frozen=True)
class DrawnScene:
    """Read once by `read`, drawn from any number of views until something moves."""

    hair: list  # (StrandsOnGPU, Shading, object to world, linear RGB of the surface it grows on, part in viewports)
    surfaces: list  # (SurfaceOnGPU, parts of a `DrawnMesh`, None of a holdout)
    lights: np.ndarray  # uniforms.LIGHTS
    world: light_door.World
    shadow_maps: ShadowMaps | None  # None in a viewport without hair
    hair_visibility: list  # {sampler: texture} of the world's light on each of the hair
    surface_visibility: list  # of `surfaces`, then of `clear`
    # session_uid of the object that a click on each hair selects; in a render `drawn_meshes.owner_of` it.
    owners: tuple = ()
    selected: tuple = ()  # whether that object is selected
    instances: tuple = ()  # of hair, as `hair_places.read_instances` found them
    surface_owners: tuple = ()  # `drawn_meshes.owner_of` each surface
    clear: tuple = ()  # as `surfaces`, of those that hide nothing


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
    # Where only the geometry of hair has changed, instances are where they were.
    instances = hair_places.read_instances(depsgraph, viewport) if before is None else before.instances
    hair, places = _read_hair(hair_places.hair_places(view_layer, viewport, instances), viewport, refused)
    if viewport is not None and is_hair_only and not hair:
        # Scenes without hair have no cost.
        return _EMPTY
    if before is None or before.shadow_maps is None:
        meshes, is_shaded = drawn_meshes.read_drawn_meshes(depsgraph, viewport), viewport is None or not is_hair_only
        surfaces, clear = _upload(meshes, is_shaded)
        surface_owners = tuple(mesh.owner for mesh in meshes if not (is_shaded and mesh.is_clear))
        world = light_door.read_world(blender_scene)
        lights = _lights(light_door.read_lights(depsgraph, for_render=viewport is None), world, _placed(hair))
        shadow_maps = _new_shadow_maps(lights)
    else:
        surfaces, clear, surface_owners = before.surfaces, before.clear, before.surface_owners
        lights, world, shadow_maps = before.lights, before.world, before.shadow_maps
    placed, batches = _placed(hair), [surface.batch for surface, _ in surfaces]
    shadow_maps.draw(lights, placed, batches, _DRAFT_STEPS if is_draft else _SHADOW_STEPS)
    if is_draft and before is not None and _have_same_places(before.hair, hair):
        seen = before.hair_visibility, before.surface_visibility
    else:
        seen = _visibility(hair, surfaces, clear)
    owners, selected = tuple(place.owner for place in places), tuple(place.is_selected for place in places)
    return DrawnScene(
        hair,
        surfaces,
        lights,
        world,
        shadow_maps,
        *seen,
        owners=owners,
        selected=selected,
        instances=instances,
        surface_owners=surface_owners,
        clear=clear,
    )


def read_render(depsgraph, known, refused):
    """The same for a render, whose depsgraph may be at another time than the file: evaluated hair is read.

    refused: called with the datablock and the `HairError` of hair that cannot be drawn, and is left out; known:
    {session_uid: (points, radii, random numbers, StrandsOnGPU)} of what was drawn a moment before, changed: what stands
    still is not uploaded again.
    """
    unlit = read_unlit(depsgraph, known, refused)
    world = light_door.read_world(depsgraph.scene_eval)
    lights = _lights(light_door.read_lights(depsgraph, for_render=True), world, _placed(unlit.hair))
    shadow_maps = _new_shadow_maps(lights)
    shadow_maps.draw(lights, _placed(unlit.hair), [surface.batch for surface, _ in unlit.surfaces], _SHADOW_STEPS)
    hair_seen, surfaces_seen = _visibility(unlit.hair, unlit.surfaces, unlit.clear)
    return replace(
        unlit,
        lights=lights,
        world=world,
        shadow_maps=shadow_maps,
        hair_visibility=hair_seen,
        surface_visibility=surfaces_seen,
    )


def read_unlit(depsgraph, known, refused):
    """The same without lighting, for motion vectors."""
    found = list(_read_rendered_hair(depsgraph, known, refused))
    meshes = drawn_meshes.read_drawn_meshes(depsgraph)
    if depsgraph.scene.vellus.is_hair_only:
        meshes = drawn_meshes.held_out(meshes)
    hair, owners = [hair for hair, _owner in found], tuple(owner for _hair, owner in found)
    surface_owners = tuple(mesh.owner for mesh in meshes if not mesh.is_clear)
    surfaces, clear = _upload(meshes, is_shaded=True)
    return replace(_EMPTY, hair=hair, surfaces=surfaces, clear=clear, owners=owners, surface_owners=surface_owners)


def _upload(meshes, is_shaded):
    """(surfaces, those that are clear) of a `DrawnScene`; is_shaded: whether they are seen as we shade them."""
    surfaces, clear = [], []
    for mesh in meshes:
        uploaded = drawing.upload_surface(mesh.positions, mesh.normals, mesh.uvs), mesh.parts
        (clear if is_shaded and mesh.is_clear else surfaces).append(uploaded)
    return surfaces, tuple(clear)


def _new_shadow_maps(lights):
    return ShadowMaps(_MAP_SIZE, max(1, min(int(lights["count"]), _SHADOWED_LIGHTS)))


def _placed(hair):
    return [(strands, to_world) for strands, _, to_world, *_ in hair]


def _visibility(hair, surfaces, clear):
    opacities = [shading.opacity for _, shading, *_ in hair]
    solid, seen_through = ([surface for surface, _parts in some] for some in (surfaces, clear))
    return ambient_visibility.measure(_placed(hair), solid, opacities, seen_through)


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


def _lights(lamps, world, placed):
    """A `uniforms.LIGHTS` record of a scene's lights (N,) and of its world's: those that matter most where hair is."""
    lobes, sides = world_texture.light_of(world)
    suns = np.zeros(len(lobes), uniforms.LIGHT.dtype)
    for sun, lobe in zip(suns, lobes, strict=True):
        sun["kind"], sun["casts_shadow"] = SUN, True
        sun["axis"][:3], sun["power"][:3] = -lobe.direction, lobe.irradiance
        sun["radius"] = 2.0 * np.sqrt(lobe.variance)  # a disk's variance along an axis is a quarter of its radius²
    found = np.concatenate([lamps, suns])
    if len(found) > 1 and placed:
        centre, _radius = drawing.bounding_sphere(placed)
        found = found[np.argsort(-_brightness(found, centre), kind="stable")]
    found = found[: uniforms.LIGHT_CAPACITY]
    record = uniforms.LIGHTS.record()
    record["light"][: len(found)], record["count"] = found, len(found)
    record["world"][:, :3] = sides
    return record


def _brightness(lights, place):
    """(N,) about how much light arrives at a place (3,): by the distance alone."""
    distances = np.linalg.norm(lights["position"][:, :3] - place, axis=1)
    spread = np.where(lights["kind"] == SUN, 1.0, 4.0 * np.pi * np.square(np.maximum(distances, 1e-6)))
    return lights["power"][:, :3].mean(axis=1) / spread


def draw_hiding(drawn, view):
    """Draw the depth of all surfaces, and nothing of their light, into the bound framebuffer."""
    with drawing.gpu_state("LESS_EQUAL", depth_writes=True):
        for surface, _parts in drawn.surfaces:
            drawing.draw_surface_depth(surface.batch, view, drawn.lights, "surface_hides.frag")


def draw_hair(drawn, view, buffer, is_viewport=False):
    """Draw all hair in front of the surfaces of a `VisibilityBuffer`.

    view: a `uniforms.VIEW` record; is_viewport: only as much of it as is seen from there, and as the artist wants.
    """
    buffer.add_hair(_hair_in_view(drawn, view, is_viewport), drawn.lights, view)


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
    _see_through_hair(drawn, view)
    with buffer.surfaces_of_part(), drawing.gpu_state("LESS_EQUAL", depth_writes=True):
        for surface, parts in drawn.surfaces:
            if parts is None:
                drawing.draw_surface_depth(surface.batch, view, drawn.lights, "surface_hides.frag")
                continue
            program = render_programs.surface_arrival_program()
            drawing.draw_triangles(surface.batch, program, view, drawn.lights, drawn.shadow_maps.samplers)
    return buffer.part_by(render_programs.strand_arrival_program())


def draw_hair_shadow(drawn, view, buffer):
    """Return a texture of the part of the light on surfaces that hair lets through; 1 where there is no surface."""
    with buffer.surfaces_of_part(background=(1.0, 1.0, 1.0, 1.0)), drawing.gpu_state("LESS_EQUAL", depth_writes=True):
        _draw_shaded_by_hair(drawn, view, "hair_shadow.frag")
    return buffer.part()


def draw_viewport_shadow(drawn, view):
    """As `draw_hiding`, and as black over what Blender draws, whose alpha is the part of the light that hair stops."""
    with drawing.gpu_state("LESS_EQUAL", depth_writes=True):
        _draw_shaded_by_hair(drawn, view, "hair_shadow_view.frag")


def _draw_shaded_by_hair(drawn, view, fragment):
    _see_through_hair(drawn, view)
    program = render_programs.hair_shadow_program(fragment)
    for (surface, _parts), seen in zip(drawn.surfaces, drawn.surface_visibility, strict=False):
        placed = view.copy()
        placed["row_strands"] = surface.row_corners
        samplers = drawn.shadow_maps.samplers | seen
        drawing.draw_triangles(surface.batch, program, placed, drawn.lights, samplers)


def _see_through_hair(drawn, view):
    """The hair's shadow on a surface takes the colour of the hair with most strands: one colour a draw call."""
    if drawn.hair:
        shading = drawn.hair[ambient_visibility.densest([strands for strands, *_ in drawn.hair])][1]
        view["hair_forward"][:3], view["seen_opacity"] = shading.forward, shading.opacity


def draw_surfaces(drawn, view):
    """Draw all surfaces with depth test into the bound framebuffer, and over them those that are clear."""
    _see_through_hair(drawn, view)
    count = len(drawn.surfaces)
    with drawing.gpu_state("LESS_EQUAL", depth_writes=True):
        for (surface, parts), seen in zip(drawn.surfaces, drawn.surface_visibility[:count], strict=True):
            if parts is None:
                drawing.draw_surface_depth(surface.batch, view, drawn.lights, "surface_hides.frag")
                continue
            surface_shading.draw(surface, parts, view, drawn.lights, drawn.shadow_maps.samplers | seen)
    with drawing.gpu_state("LESS_EQUAL", depth_writes=False, blend="ALPHA_PREMULT"):
        for (surface, parts), seen in zip(drawn.clear, drawn.surface_visibility[count:], strict=True):
            surface_shading.draw(surface, parts, view, drawn.lights, drawn.shadow_maps.samplers | seen)
