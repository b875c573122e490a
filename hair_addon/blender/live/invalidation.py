# SPDX-License-Identifier: GPL-3.0-or-later
"""Every cache of the add-on by name, and the events that clear many of them: undo, another file, the end of Python.

`events` invalidates single caches. Pure functions under `functools.cache` never become stale.
"""

from ..data import guide_map_readers, scene, subdivided_surfaces, usable_surfaces
from ..data.maps import image_pixels, sources, strand_maps
from ..data.pictures import (
    drawn_meshes,
    light_panoramas,
    picture_jobs,
    rendered_files,
    root_colors,
    surface_bakes,
    surface_means,
    unread_nodes,
)
from ..data.simulation import simulated_world
from ..data.strands import simulated_guides
from ..gpu import (
    light_grid,
    light_patterns,
    lights,
    solid_shading,
    strand_batches,
    studio_lights,
    surface_shading,
    surface_textures,
    world_texture,
)
from ..gpu.programs import shaders, uniforms
from ..groom import bindings, followed_names, frame_faces, hidden_hair
from ..groom.dynamics import frame_folders, guide_simulation
from ..groom.guides import guide_states, outside_guides
from ..groom.surfaces import edited_faces
from ..groom.systems import copied_hair
from ..host import background_process, notices
from ..layers import recording
from ..render import hair_cache, late_layers, modified_hair, solid_hair
from ..render.frames import composite
from ..render.viewport import guide_lines, live_light, region_pictures, viewport
from ..settings import animated
from . import (
    density_updates,
    dynamics_state,
    flattened_surfaces,
    hidden_previews,
    last_update,
    moving_surfaces,
    refused_hair,
    simulated_hair,
    strokes,
    unlocked_renders,
)

# Copies of Blender's data, and values computed from them. Undo and redo replace the data.
COPIES = (
    hair_cache.strand_cache,
    hair_cache.pose_cache,
    modified_hair.modified_cache,
    late_layers.request_cache,
    viewport.view_cache,
    bindings.binding_cache,
    bindings.kept_cache,
    guide_states.state_cache,
    outside_guides.barrier_cache,
    root_colors.sample_cache,
    world_texture.light_cache,
    lights.frame_cache,
    animated.value_cache,
    usable_surfaces.inside_out_cache,
    simulated_guides.point_cache,
    simulated_hair.waiting_cache,
    last_update.guide_cache,
    last_update.former_cache,
    last_update.mesh_cache,
    last_update.painting_cache,
    last_update.place_cache,
    hidden_hair.paused_cache,
    hidden_hair.hidden_cache,
    hidden_previews.changed_cache,
    copied_hair.known_cache,
    flattened_surfaces.edited_cache,
    density_updates.unit_cache,
    moving_surfaces.moved_cache,
    moving_surfaces.unchecked_cache,
    guide_map_readers.reading_cache,
    unread_nodes.sentence_cache,
    image_pixels.pixel_cache,
    strand_maps.pending_cache,
    dynamics_state.map_status_cache,
)

# Values that are keyed by all of their inputs, or check by themselves whether they are up to date.
OTHERS = (
    hair_cache.shading_cache,
    recording.shape_cache,
    scene.faces_cache,
    scene.surface_cache,
    sources.root_cache,
    sources.texel_cache,
    sources.level_cache,
    sources.mean_cache,
    strand_maps.look_cache,
    image_pixels.converted_cache,
    drawn_meshes.layout_cache,
    surface_means.picture_cache,
    surface_means.mean_cache,
    edited_faces.left_cache,
    frame_faces.count_cache,
    subdivided_surfaces.smooth_cache,
    region_pictures.picture_cache,
    live_light.light_cache,
    viewport.display_table_cache,
    solid_hair.tint_cache,
    root_colors.corner_cache,
    solid_shading.shading_cache,
    studio_lights.image_cache,
    studio_lights.texture_cache,
    world_texture.studio_cache,
    world_texture.turned_cache,
    simulated_world.parts_cache,
    simulated_hair.played_cache,
    dynamics_state.state_cache,
    dynamics_state.change_cache,
    simulated_hair.before_cache,
    unlocked_renders.noted_cache,
    strokes.result_cache,
    composite.refused_cache,
    refused_hair.noted_cache,
    frame_folders.folder_cache,
    followed_names.object_cache,
    guide_simulation.stiffness_cache,
    shaders.error_cache,
    uniforms.buffer_cache,
    strand_batches.objects_cache,
    surface_shading.texture_cache,
    surface_shading.baked_cache,
    surface_textures.surface_cache,
    surface_textures.posed_cache,
    notices.printed_cache,
    surface_bakes.bake_cache,
    light_panoramas.picture_cache,
    light_patterns.texture_cache,
    rendered_files.readable_cache,
    picture_jobs.job_cache,
    picture_jobs.last_cache,
    guide_lines.hue_cache,
    late_layers.layer_cache,
)

# If a bound program is freed and a new one gets its address, the GPU module takes the new one for bound, so programs
# stay until Python ends. They must be freed before Blender's graphics end. So must textures that belong to no file.
PROGRAMS = (shaders.program_cache, light_grid.none_cache)

CACHES = COPIES + OTHERS + PROGRAMS


def data_replaced():
    """Clear all copies of data, after undo or redo."""
    for cache in COPIES:
        cache.clear()


def clear():
    """Clear all caches except programs, when another file is opened or the add-on is disabled."""
    live_light.end()
    late_layers.end()
    for cache in COPIES + OTHERS:
        cache.clear()


def end():
    """Clear all caches and programs when Python ends, while the GPU context still exists."""
    background_process.end()
    live_light.end()
    late_layers.end()
    for cache in CACHES:
        cache.clear()
