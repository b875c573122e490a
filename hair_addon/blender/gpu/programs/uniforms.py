# SPDX-License-Identifier: GPL-3.0-or-later
"""Uniform blocks: GLSL source and NumPy layout of a struct, both from one list of members.

The layout is std140 [OpenGL46, 7.6.2.2]: int and float are aligned to 4 bytes, vec3, vec4 and mat4 to 16, a struct's
size is a multiple of 16.
"""

from functools import cache

import gpu
import numpy as np

from ....core.params import declared
from ...host.caches import Cache

# GLSL type → (NumPy scalar, shape, alignment in bytes). A mat4 is column-major: it is filled with a transpose.
_TYPES = {
    "int": ("<i4", (), 4),
    "float": ("<f4", (), 4),
    "vec3": ("<f4", (3,), 16),
    "ivec3": ("<i4", (3,), 16),
    "vec4": ("<f4", (4,), 16),
    "mat4": ("<f4", (4, 4), 16),
}


class Block:
    """A GLSL struct: `source` declares it, `dtype` is the NumPy record of its std140 layout.

    Padding between members is a member of the record too, so that copies of a record have the same bytes.
    """

    def __init__(self, type_name, members):
        """members: {name: GLSL type}, or {name: (Block, count)} and {name: ("vec4", count)} for arrays."""
        fields, lines, end = [], [], 0
        # A float after a vec3 is in the vec3's fourth word in std140, but after it in the Metal Shading Language.
        for name, kind in sorted(members.items(), key=lambda member: member[1] in ("vec3", "ivec3")):
            if isinstance(kind, tuple):
                element, count = kind
                is_block = isinstance(element, Block)
                form, alignment = np.dtype((element.dtype, (count,)) if is_block else ("<f4", (count, 4))), 16
                lines.append(f"  {element.type_name if is_block else element} {name}[{count}];")
            else:
                scalar, shape, alignment = _TYPES[kind]
                form = np.dtype((scalar, shape))
                lines.append(f"  {kind} {name};")
            fields += [*_gap(end, alignment), (name, form)]
            end += -end % alignment + form.itemsize
        self.type_name = type_name
        self.source = f"struct {type_name} {{\n" + "\n".join(lines) + "\n};\n"
        self.dtype = np.dtype([*fields, *_gap(end, 16)])

    def record(self):
        """Return a zeroed record."""
        return np.zeros((), self.dtype)


def stacked(records):
    """Return (N,) records of a `Block`; `np.stack` compares their members first, which takes sixty times as long."""
    found = np.empty(len(records), records[0].dtype)
    for index, record in enumerate(records):
        found[index] = record
    return found


def joined(arrays):
    """Return arrays (N,) of records of a `Block` as one array, sixty times as fast as `np.concatenate`."""
    found, end = np.empty(sum(map(len, arrays)), arrays[0].dtype), 0
    for array in arrays:
        found[end : end + len(array)] = array
        end += len(array)
    return found


def _gap(end, alignment):
    """Return [(name, type)] of the padding from an end to the next multiple of an alignment; empty without padding."""
    return [(f"unused_{end}", np.dtype((np.uint8, (-end % alignment,))))] if end % alignment else []


LIGHT_CAPACITY = 16

VIEW = Block(
    "View",
    {
        "world_to_clip": "mat4",
        "object_to_world": "mat4",
        "object_to_clip": "mat4",
        "eye": "vec4",  # the viewer's place, or in a parallel projection the unit direction towards the viewer
        "hair_forward": "vec4",  # fraction of incident light that one strand passes on
        "hair_reflectance": "vec4",  # of infinitely many strands
        "is_perspective": "int",
        "is_mirrored": "int",  # whether a picture is mirrored: triangles show their other side
        "point_count": "int",
        "drawn_points": "int",  # evenly chosen points per strand: at least two
        "strand_count": "int",
        "drawn_strands": "int",  # a subset, thickened in proportion
        "first_strand": "int",  # in drawing order
        "part_size": "int",  # strands per part: drawing order visits one part after the other
        "part_stride": "int",  # step within a part at each of its visits
        "first_segment": "int",  # of this hair, among the segments of all hair in a picture
        "thickness": "float",
        "seen_points": "int",  # points per strand in the visibility textures
        "seen_opacity": "float",  # opacity of a strand for which visibility was computed
        "row_strands": "int",
        "has_vertex_normals": "int",  # whether a surface's normals are of vertices, not of corners
        "radius_strands": "int",  # number of strands with stored radii: one for all, or each
        "radius_unit": "float",  # of stored radii
        "object_scale": "float",
        "pixels_per_unit": "float",  # at distance one, in a perspective
        "least_half_width": "float",  # at distance one
        "depth_rise": "float",  # change of depth over a sample's width towards the viewer, at distance one
        "surface_color": "float",  # of a surface in shadow maps, packed
        "light_index": "int",  # the light that a shadow pass looks from
        "sample_offset": "float",  # jitter of thin strands' samples, as a fraction of a sample
        "coverage_turn": "float",  # selects other samples of thin strands in each pass
        "first_column": "int",  # of the picture's samples, if a tile of it is drawn
        "first_row": "int",
    },
)
LIGHT = Block(
    "Light",
    {
        "world_to_shadow": "mat4",
        "position": "vec4",
        "axis": "vec4",
        "power": "vec4",
        "kind": "int",
        "cos_cone": "float",
        "blend": "float",
        "shadow_layer": "int",  # of the shadow maps, -1 without
        "casts_shadow": "int",
        "radius": "float",  # [m]; for a sun, the tangent of its angular radius
        "extent": "float",  # diameter of the hair [m], the unit of the layers of a shadow
        "near": "float",  # depth [m] of the hair's near side, the origin of depths
        "world_to_wide": "mat4",  # of the map of surfaces around the hair
        "wide_layer": "int",  # of the shadow maps, -1 without
        "wide_extent": "float",  # `extent` and `near` of that map
        "wide_near": "float",
        "highlight_excess": "float",  # of R relative to its other light, less one
        "group": "int",  # light group, by `lights.group_of`
        "pattern": "mat4",  # the world's axes in the axes of the lamp, and RGB factors of the pattern
        "pattern_layer": "int",  # layer in the texture of patterns, counted from one; 0 without a pattern
        "dimmed_behind": "float",  # fraction of its light that is left out where it shines towards the viewer
    },
)
LIGHTS = Block(
    "Lights",
    {
        "light": (LIGHT, LIGHT_CAPACITY),
        "world": ("vec4", 6),  # mean radiance of the world's sides, in the order of `sphere.SIDES`
        "count": "int",
        "grid_corner": "vec4",  # of the light grid [m], and how much of its light replaces dual scattering, from 0 to 1
        "grid_scale": "vec4",  # reciprocals of its sides [1/m], 0 without a grid; layers of voxels in its texture
    },
)

SURFACE = Block(
    "Surface",
    {
        "color": "vec4",  # linear RGB, without an image
        "image_rows": ("vec4", 6),  # from (u, v, 1) to coordinates of the images: two each of color, roughness, normal
        "roughness_channels": "vec4",  # weights of the image's RGBA
        "roughness": "float",
        "metallic": "float",
        "reflectance": "float",  # of non-metals at normal incidence
        "normal_strength": "float",
        "has_color_image": "int",
        "is_color_opaque": "int",  # whether the image's alpha does not darken its color
        "has_roughness_image": "int",
        "has_normal_image": "int",
    },
)

MOTION = Block(
    "Motion",
    {
        "before_to_clip": "mat4",  # from the coordinates of strands or surfaces, one frame before
        "now_to_clip": "mat4",
        "after_to_clip": "mat4",
        "size": "vec4",  # width and height of the whole picture [pixels]
        "moved_row_strands": "int",  # strands per row of the texture of former points, 0 without
    },
)

DATA = Block(
    "DataPass",
    {
        "camera": "vec4",  # its center
        "view_rows": ("vec4", 3),  # axes of the camera in the world
        "mist": "vec4",  # start [m], 1 / depth [1/m], exponent
        "kind": "int",  # index of `data_passes.KINDS`
        "has_uvs": "int",  # whether the surface, or the roots of the hair, have UVs
    },
)

MAKING = Block(
    "Making",
    {
        "axes": "mat4",  # from the coordinates of roots and guides to those of the strands
        "axes_scale": "float",  # greatest stretch by `axes`
        "limits": "vec4",  # of `limited_part` in shaders/strands/guide_interpolation.glsl
        "keep_length": "float",
        "strand_count": "int",
        "guide_count": "int",
        "point_count": "int",
        "row_guides": "int",  # guides or strands per row of each texture
        "row_normals": "int",
        "row_segments": "int",
        "row_bindings": "int",
        "row_strands": "int",
    },
)

MOST_STEPS = 64  # maximum number of steps that the GPU applies to one hair
MOST_COURSES = 16  # maximum number of courses of all steps

STEP = Block(
    "Step",
    {
        "kind": "int",
        "seed": "int",
        "mask": "int",
        "level": "int",
        "first_centre": "int",
        "varied": "int",  # a bit for each number that differs between strands
        "first_varied": "int",  # the mask that contains the first of these numbers
        "courses": "int",  # rows of its courses, packed: core/styling/courses.py
        "numbers": ("vec4", 6),  # NUMBERS of core/styling/program.py, four by four
    },
)

STYLING = Block(
    "Styling",
    {
        "axes": "mat4",  # from the coordinates of strands to the surface's local coordinates
        "to_drawn": "mat4",  # from the coordinates of strands to those of drawn strands
        "strand_count": "int",
        "point_count": "int",  # also a constant of the program, but loops to a constant compile more slowly
        "first_strand": "int",  # index of the first strand in the image
        "row_strands": "int",  # strands per row of each texture
        "row_packed": "int",
        "row_known": "int",
        "row_centres": "int",
        "row_locks": "int",
        "known_texels": "int",  # per strand
        "level_count": "int",  # of clump centers, including the level of guides
        "centre_count": "int",  # in all levels except that of guides
        "are_centres": "int",  # whether center strands are styled
        "step_count": "int",
        "hand": "float",  # -1 if `axes` are mirrored, else 1
        "steps": (STEP, MOST_STEPS),
        "courses": ("vec4", MOST_COURSES * 16),  # 64 samples of each, four by four
    },
)

HISTORY = Block(
    "History",
    {
        "now_to_before": "mat4",  # clip space of a view → clip space of the previous view
        "size": "vec4",  # width and height of the picture [pixels]
        "samples_per_side": "int",
        "first_column": "int",  # of the picture's samples, if a tile of it was drawn
        "first_row": "int",
        "has_hair_motion": "int",  # whether hair has moved by the texture of motion vectors, and not only the view
        "has_surface_motion": "int",
        "is_still": "int",  # whether only lights have moved: pixels show the same geometry as before
        "has_lit_surfaces": "int",  # whether the picture includes surfaces, or shadows on them
        "most_passes": "float",  # maximum weight of the previous picture, in passes
    },
)

SOLID = Block(
    "Solid",
    {
        "tint": "vec4",  # color of all strands, relative to that of their look
        "highlights": "float",  # factor of the matcap's layer of highlights
        "has_matcap": "int",
        "has_strand_tints": "int",  # whether strands have tints of their own
    },
)

MAP_CAPACITY = 8  # maximum number of shadow maps that are drawn together
SHADOW_VIEWS = Block("ShadowViews", {"view": (VIEW, MAP_CAPACITY)})  # light_index -1: not drawn

CLIPPING = Block("Clipping", {"planes": ("vec4", 6)})  # world points p with dot(plane, (p, 1)) < 0 are clipped

ENVIRONMENT = Block(
    "Environment",
    {
        "to_image": "mat4",  # from world directions to directions of the image
        "clip_to_world": "mat4",
        "color": "vec4",  # factor of the image
        "size": "vec4",  # width and height of the target [pixels]
        "is_mirror_ball": "int",
        "taps": "int",  # samples along each side of a texel
    },
)


def _glsl_type(default, details):
    if isinstance(default, str):
        return "int" if details.choices else None
    if isinstance(default, bool | int):
        return "int"
    return "float" if isinstance(default, float) else "vec3"


@cache
def settings_block(settings_class, instance="settings"):
    """Return the `Block` of a class of settings, named after its instance: `settings` is a `Settings`.

    An enumeration becomes the index of its choice; free text is left out.
    """
    kinds = {name: _glsl_type(default, details) for name, default, details in declared(settings_class)}
    return Block(instance.capitalize(), {name: kind for name, kind in kinds.items() if kind})


def fill(settings):
    """Return the record of `settings_block` with these settings."""
    record = settings_block(type(settings)).record()
    for name, _default, details in declared(type(settings)):
        if name in record.dtype.names:
            value = getattr(settings, name)
            choices = [choice[0] for choice in details.choices]
            record[name] = choices.index(value) if choices else value
    return record


# Bytes of a record → its buffer. Most records of a frame equal those of the last one, and graphics drivers take longer
# to allocate and fill a buffer than to draw with it.
buffer_cache = Cache(capacity=512)


def uniform_buffer(record):
    """Return the shared GPUUniformBuf with the bytes of a record. It must not be updated."""
    return buffer_cache.get(record.tobytes(), lambda: own_uniform_buffer(record))


def own_uniform_buffer(record):
    """Return a new GPUUniformBuf with the bytes of a record. It may be updated."""
    return gpu.types.GPUUniformBuf(bytes_of(record))


def clipping_blocks(planes):
    """Return {instance: GPUUniformBuf} for programs that are clipped by (6, 4) planes; empty for None."""
    if planes is None:
        return {}
    record = CLIPPING.record()
    record["planes"] = planes
    return {"clipping": uniform_buffer(record)}


def bytes_of(record):
    """Return a Buffer with the bytes of a record: unsigned bytes are copied unchanged, and there is no raw type."""
    data = record.tobytes()
    return gpu.types.Buffer("UBYTE", len(data), data)
