# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawing of a `DrawnScene` into pictures: hair, surfaces, and the shadows of hair on them."""

from dataclasses import replace

from ..gpu import ambient_visibility, drawing, level_of_detail, surface_shading, surface_textures, world_texture
from ..gpu.programs import picture_programs, surface_programs, uniforms

_OCCLUDING = "surfaces/occluding_surface.frag"


def draw_hiding(drawn, view, clip_planes=None):
    """Draw only the depth of all surfaces into the bound framebuffer.

    clip_planes: (6, 4) of `uniforms.CLIPPING` that clip surfaces, None for none.
    """
    light_block = uniforms.uniform_buffer(drawn.lights)
    with drawing.gpu_state("LESS_EQUAL", depth_writes=True):
        for surface in drawn.occluders:
            _draw_depth(surface, view, light_block, clip_planes)


def _draw_depth(surface, view, light_block, clip_planes=None):
    """Draw the depth of a `SurfaceOnGPU` or `LinkedSurfaces`."""
    if isinstance(surface, surface_textures.LinkedSurfaces):
        surface.draw_depth(view, light_block, _OCCLUDING, clip_planes)
    else:
        surface_textures.draw_depth(surface, view, light_block, _OCCLUDING, clip_planes)


def draw(drawn, view, buffer, is_transparent):
    """Fill a `VisibilityBuffer` with a render of a scene; is_transparent: without the background.

    The nearest strand or surface is found before shading, so that each sample is shaded once.
    """
    with buffer.numbered():
        _number_surfaces(drawn, view)
    buffer.find_hair(_hair_in_view(drawn, view, is_viewport=False), _hair_lights(drawn), view)
    _shade_behind_hair(drawn, view, buffer, buffer.color, is_transparent)
    buffer.shade_hair()


def _number_surfaces(drawn, view):
    """Draw the numbers of all surfaces' triangles, counted consecutively, into the bound framebuffer."""
    first_triangle = 0
    with drawing.gpu_state("LESS_EQUAL", depth_writes=True):
        for surface, _parts in drawn.surfaces:
            surface_textures.draw_numbers(surface, view, drawn.lights, first_triangle)
            first_triangle += surface.triangle_count


def draw_hair(drawn, view, buffer, is_viewport=False, clip_planes=None, is_counted=False):
    """Draw all hair in front of the surfaces of a `VisibilityBuffer`.

    view: a `uniforms.VIEW` record; is_viewport: use the viewport's level of detail and fraction of strands;
    clip_planes: as for `draw_hiding`; is_counted: as for `VisibilityBuffer.find_hair`.
    """
    hair = _hair_in_view(drawn, view, is_viewport)
    buffer.add_hair(hair, _hair_lights(drawn), view, clip_planes=clip_planes, is_counted=is_counted)


def relight_viewport(drawn, view, buffer, is_shadowed=False):
    """Return a texture of a `VisibilityBuffer`'s samples, shaded again with a `DrawnScene`'s lights, for viewports.

    view: the record that the buffer was drawn with; is_shadowed: include the shadow of hair.
    """
    with buffer.surfaces_of_part():
        if is_shadowed:
            draw_viewport_shadow(drawn, view)
    return _relight_hair(drawn, view, buffer, buffer.part(), is_viewport=True)


def relight(drawn, view, buffer, is_transparent):
    """`relight_viewport` for a render: with surfaces; is_transparent: without the background."""
    picture = buffer.part()
    _shade_behind_hair(drawn, view, buffer, picture, is_transparent)
    return _relight_hair(drawn, view, buffer, picture)


def _relight_hair(drawn, view, buffer, picture, is_viewport=False):
    buffer.relight(_hair_in_view(drawn, view, is_viewport), _hair_lights(drawn), view, picture)
    return picture


def find_hair(drawn, view, buffer, chosen=None, clip_planes=None):
    """Find the nearest strands in a viewport for a `VisibilityBuffer`, without shading.

    chosen: indices of the hair, None for all; clip_planes: as for `draw_hiding`.
    """
    hair = _hair_in_view(drawn, view, is_viewport=True)
    if chosen is not None:
        hair = [part for batch in hair if len((part := batch.part(list(chosen))).indices)]
    buffer.find_hair(hair, drawn.lights, view, clip_planes=clip_planes)


_WIRE_THICKNESS = 0.4  # of strands in Wireframe shading


def _hair_lights(drawn):
    """`uniforms.LIGHTS` for all hair, or for each hair."""
    return drawn.lights if drawn.hair_lights is None else drawn.hair_lights


def _hair_in_view(drawn, view, is_viewport):
    """Return [`strand_batches.Batch`] of all hair with the steps of a view."""
    all_steps = [drawing.Steps()] * len(drawn.batches)
    if is_viewport:
        limits = [drawn.hair[batch.indices[0]][3] for batch in drawn.batches]
        placed = zip(drawn.batches, limits, strict=True)
        all_steps = level_of_detail.steps_of([(one.strands, one.to_world, limit) for one, limit in placed], view)
    if drawn.is_wire:
        all_steps = [replace(steps, thickness=_WIRE_THICKNESS) for steps in all_steps]
    return [
        replace(batch, samplers=drawn.shadow_maps.samplers | batch.samplers, steps=steps)
        for batch, steps in zip(drawn.batches, all_steps, strict=True)
    ]


def _shade_behind_hair(drawn, view, buffer, picture, is_transparent):
    """Fill a picture of a `VisibilityBuffer` with everything but hair."""
    background = (0.0, 0.0, 0.0, 0.0) if is_transparent else (*drawn.world.color, 1.0)
    has_image = drawn.world.image is not None and not is_transparent
    has_over = bool(drawn.clear) or any(parts is None for _surface, parts in drawn.surfaces)
    _see_through_hair(drawn, view)
    if has_image or has_over:
        with buffer.behind_hair(picture, background):
            if has_image:
                world_texture.draw_background(drawn.world, view, *buffer.size)
            if has_over:
                buffer.exclude_behind_hair()
                _draw_over_surfaces(drawn, _nearer(view))
    else:
        buffer.fill(picture, background)
    _shade_surfaces(drawn, view, buffer, picture)


def draw_arrival(drawn, view, buffer):
    """Return a texture of light visibility for the content of a `VisibilityBuffer`, after its hair was added."""
    with buffer.surfaces_of_part(), drawing.gpu_state("LESS_EQUAL", depth_writes=True):
        is_holdout = [parts is None for _surface, parts in drawn.surfaces]
        _draw_by_lights(drawn, view, "light/surface_irradiance.frag", is_holdout)
    return buffer.part_by(picture_programs.strand_arrival_program())


def draw_hair_shadow(drawn, view, buffer):
    """Return a texture of the fraction of light on surfaces that hair lets through; 1 without a surface."""
    white = (1.0, 1.0, 1.0, 1.0)
    with buffer.surfaces_of_part(background=white), drawing.gpu_state("LESS_EQUAL", depth_writes=True):
        _draw_by_lights(drawn, view, "shadows/hair_shadow.frag")
    return buffer.part(background=white)


def draw_viewport_shadow(drawn, view):
    """Like `draw_hiding`, with black over Blender's drawing, whose alpha is the fraction of light that hair blocks."""
    _see_through_hair(drawn, view)
    with drawing.gpu_state("LESS_EQUAL", depth_writes=True):
        for surface, lights, seen, is_shadowed in drawn.shadowed:
            samplers, is_linked = (
                drawn.shadow_maps.samplers | seen,
                isinstance(surface, surface_textures.LinkedSurfaces),
            )
            program = surface_programs.arrival_program("shadows/hair_shadow_view.frag", is_linked)
            if not is_shadowed:
                _draw_depth(surface, view, uniforms.uniform_buffer(lights))
            elif is_linked:
                surface.draw_lit(program, view, lights, samplers)
            else:
                surface_textures.draw_lit(surface, program, view, lights, samplers)


def _draw_by_lights(drawn, view, fragment, is_left_out=None):
    """Draw the fraction of light that reaches surfaces.

    is_left_out: whether the picture is left empty at each surface; None: at no surface.
    """
    _see_through_hair(drawn, view)
    program = surface_programs.arrival_program(fragment)
    is_left_out = is_left_out or [False] * len(drawn.surfaces)
    lit = zip(drawn.surfaces, *light_of(drawn, solid=True), is_left_out, strict=True)
    for (surface, _parts), lights, samplers, is_empty in lit:
        if is_empty:
            surface_textures.draw_depth(surface, view, uniforms.uniform_buffer(lights), _OCCLUDING)
            continue
        surface_textures.draw_lit(surface, program, view, lights, samplers)


def light_of(drawn, solid):
    """Return (`uniforms.LIGHTS` records, {sampler: texture} dictionaries) of all solid, or all clear surfaces."""
    count = len(drawn.surfaces)
    of_all = [drawn.lights] * len(drawn.surface_visibility) if drawn.surface_lights is None else drawn.surface_lights
    chosen = slice(count) if solid else slice(count, None)
    seen_samplers = [
        drawn.shadow_maps.samplers | {name: seen[name] for name in surface_programs.SEEN_SAMPLERS}
        for seen in drawn.surface_visibility[chosen]
    ]
    return of_all[chosen], seen_samplers


def _see_through_hair(drawn, view):
    """Write the hair with most strands into a view record, as a draw call has a single color of hair's shadow."""
    if drawn.hair:
        shading = drawn.batches[ambient_visibility.densest([batch.strands for batch in drawn.batches])].shading
        view["hair_forward"][:3], view["seen_opacity"] = shading.forward, shading.opacity
        view["hair_reflectance"][:3] = shading.reflectance


def _shade_surfaces(drawn, view, buffer, picture):
    """Shade all surfaces except holdouts where they are nearest, below clear surfaces."""
    first_triangle = 0
    for (surface, parts), lights, samplers in zip(drawn.surfaces, *light_of(drawn, solid=True), strict=True):
        if parts is not None:
            arguments = view, lights, samplers, buffer, picture, bool(drawn.clear)
            surface_shading.shade(surface, parts, first_triangle, *arguments)
        first_triangle += surface.triangle_count


# Fraction of the depth range by which surfaces are drawn nearer when they are drawn again: more than rounding, so that
# a surface does not occlude itself.
_NEARER = 1e-5


def _nearer(view):
    """Return a view record in which everything is slightly nearer."""
    record = view.copy()
    record["world_to_clip"][:, 2] -= _NEARER * record["world_to_clip"][:, 3]  # transposed
    return record


def _draw_over_surfaces(drawn, view):
    """Draw holdouts into the bound framebuffer, and then clear surfaces over all surfaces."""
    with drawing.gpu_state("LESS_EQUAL", depth_writes=True):
        for (surface, parts), lights in zip(drawn.surfaces, light_of(drawn, solid=True)[0], strict=True):
            if parts is None:
                surface_textures.draw_depth(surface, view, uniforms.uniform_buffer(lights), _OCCLUDING)
    with drawing.gpu_state("LESS_EQUAL", depth_writes=False, blend="ALPHA_PREMULT"):
        for (surface, parts), lights, samplers in zip(drawn.clear, *light_of(drawn, solid=False), strict=True):
            surface_shading.draw_clear(surface, parts, view, lights, samplers)
