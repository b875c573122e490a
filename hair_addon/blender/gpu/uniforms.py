# SPDX-License-Identifier: GPL-3.0-or-later
"""Uniform blocks: GLSL source and NumPy layout of a struct, both from one list of members.

The layout is std140 [OpenGL46, 7.6.2.2]: int and float are aligned to 4 bytes, vec3, vec4 and mat4 to 16, a struct's
size is a multiple of 16.
"""

from functools import cache

import gpu
import numpy as np

from ...core.params import declared

# GLSL type → (NumPy scalar, shape, alignment in bytes). A mat4 is column-major: it is filled with a transpose.
_TYPES = {
    "int": ("<i4", (), 4),
    "float": ("<f4", (), 4),
    "vec3": ("<f4", (3,), 16),
    "vec4": ("<f4", (4,), 16),
    "mat4": ("<f4", (4, 4), 16),
}


class Block:
    """A GLSL struct: `source` declares it, `dtype` is the NumPy record of its std140 layout.

    What lies between members is a member of the record too, so that copies of it have the same bytes.
    """

    def __init__(self, type_name, members):
        """members: {name: GLSL type}, or {name: (Block, count)} and {name: ("vec4", count)} for arrays."""
        fields, lines, end = [], [], 0
        # A float behind a vec3 is in its fourth word in std140, and behind that in the Metal Shading Language.
        for name, kind in sorted(members.items(), key=lambda member: member[1] == "vec3"):
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
        """A zeroed record to be filled by member name."""
        return np.zeros((), self.dtype)


def _gap(end, alignment):
    """[(name, type)] of the bytes from an end to the next multiple of an alignment; none where there are none."""
    return [(f"unused_{end}", np.dtype((np.uint8, (-end % alignment,))))] if end % alignment else []


LIGHT_CAPACITY = 16

VIEW = Block(
    "View",
    {
        "world_to_clip": "mat4",
        "object_to_world": "mat4",
        "object_to_clip": "mat4",
        "eye": "vec4",  # the viewer's place, or in a parallel projection the unit direction towards the viewer
        "hair_forward": "vec4",  # what one strand passes on of the light that meets it
        "hair_reflectance": "vec4",  # of infinitely many strands
        "is_perspective": "int",
        "is_mirrored": "int",  # whether a picture shows left as right: triangles turn their other side to the front
        "point_count": "int",
        "drawn_points": "int",  # of each strand's points, evenly chosen: at least two
        "strand_count": "int",
        "drawn_strands": "int",  # of all, thickened in proportion
        "first_strand": "int",  # of the turns in which strands are drawn
        "part_size": "int",  # strands: turns go from one such part of the strands to the next
        "part_stride": "int",  # and so much further in each when they come back to it
        "first_segment": "int",  # of this hair, among those of all hair in a picture
        "thickness": "float",
        "seen_points": "int",  # of each strand's points, those of the visibility textures
        "seen_opacity": "float",  # of a strand, for which they hold
        "row_strands": "int",
        "has_vertex_normals": "int",  # of a surface, whether its normals are of vertices, not of corners
        "radius_strands": "int",  # whose radii are stored: one for all, or each
        "radius_unit": "float",  # that they are stored in
        "object_scale": "float",
        "pixels_per_unit": "float",  # at distance one, in a perspective
        "least_half_width": "float",  # there as well
        "depth_rise": "float",  # of a sample's side towards the viewer, at distance one
        "surface_color": "float",  # of a surface in shadow maps, packed
        "light_index": "int",  # the light that a shadow pass looks from
        "sample_offset": "float",  # how far samples of thin strands lie off their centers, as a part of it
        "coverage_turn": "float",  # by which a pass takes other samples of thin strands
        "first_column": "int",  # of the picture's samples, where what is drawn is a tile of it
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
        "radius": "float",  # [m]; of a sun, the tangent of its angular radius
        "extent": "float",  # diameter of the hair [m], which the layers of a shadow are parts of
        "near": "float",  # depth [m] of the hair's near side, which depths are counted from
        "world_to_wide": "mat4",  # of the map of surfaces around the hair
        "wide_layer": "int",  # of the shadow maps, -1 without
        "wide_extent": "float",  # as `extent` and `near`, of what that map holds
        "wide_near": "float",
    },
)
LIGHTS = Block(
    "Lights",
    {
        "light": (LIGHT, LIGHT_CAPACITY),
        "world": ("vec4", 6),  # mean radiance of the world's sides, in the order of `sphere.SIDES`
        "count": "int",
        "grid_corner": "vec4",  # of the grid of light [m]
        "grid_scale": "vec4",  # one over its sides [1/m]: 0 without
    },
)

SURFACE = Block(
    "Surface",
    {
        "color": "vec4",  # linear RGB where it has no image
        "image_rows": ("vec4", 6),  # from (u, v, 1) to coordinates of the images: two each of color, roughness, normal
        "roughness_channels": "vec4",  # weights of the image's RGBA
        "roughness": "float",
        "metallic": "float",
        "reflectance": "float",  # at normal incidence, of all but metal
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
        "before_to_clip": "mat4",  # of what strands or surfaces have their places in, a frame before
        "now_to_clip": "mat4",
        "after_to_clip": "mat4",
        "size": "vec4",  # width and height of the whole picture [pixels]
        "moved_row_strands": "int",  # of the texture of combed strands' points before, 0 without
    },
)

MAKING = Block(
    "Making",
    {
        "axes": "mat4",  # from the coordinates of roots and guides to those of the strands
        "axes_scale": "float",  # the greatest by which they lengthen anything
        "limits": "vec4",  # as `limited_part` of shaders/strands/guide_interpolation.glsl
        "keep_length": "float",
        "strand_count": "int",
        "guide_count": "int",
        "point_count": "int",
        "row_guides": "int",  # whole guides or strands in a row of each texture
        "row_normals": "int",
        "row_segments": "int",
        "row_bindings": "int",
        "row_strands": "int",
    },
)

MOST_STEPS = 64  # of the styles of one hair that the GPU applies

STEP = Block(
    "Step",
    {
        "kind": "int",
        "seed": "int",
        "mask": "int",
        "level": "int",
        "first_centre": "int",
        "numbers": ("vec4", 6),  # NUMBERS of core/styling/program_rows.py, four by four
    },
)

STYLING = Block(
    "Styling",
    {
        "axes": "mat4",  # from the coordinates of strands to the surface's own
        "to_drawn": "mat4",  # from the coordinates of strands to those that are drawn
        "strand_count": "int",
        "point_count": "int",  # a constant of the program too: but loops to a constant take drivers longer to compile
        "first_strand": "int",  # where the first of these is in the image
        "row_strands": "int",  # whole strands in a row of each texture
        "row_packed": "int",
        "row_known": "int",
        "row_centres": "int",
        "row_locks": "int",
        "known_texels": "int",  # of a strand
        "level_count": "int",  # of clump centres, those of guides among them
        "centre_count": "int",  # of all levels, those of guides left out
        "are_centres": "int",  # whether centres are styled
        "step_count": "int",
        "hand": "float",  # -1 where those own axes are mirrored, 1 elsewhere
        "steps": (STEP, MOST_STEPS),
    },
)

HISTORY = Block(
    "History",
    {
        "now_to_before": "mat4",  # clip space of a view → that of the view before
        "size": "vec4",  # width and height of the picture [pixels]
        "samples_per_side": "int",
        "first_column": "int",  # of the picture's samples, where those that were drawn are a tile of it
        "first_row": "int",
        "has_hair_motion": "int",  # whether it has moved, and not only the view: by the texture of motion vectors
        "has_surface_motion": "int",
        "is_still": "int",  # whether nothing has moved but lights: what is in a pixel was there before
        "has_lit_surfaces": "int",  # whether surfaces, or shadows on them, are in the picture beside hair
        "most_passes": "float",  # that the picture before may be worth
    },
)

CLIPPING = Block("Clipping", {"planes": ("vec4", 6)})  # a place p of the world is left where each (p, 1) is not below

ENVIRONMENT = Block(
    "Environment",
    {
        "to_image": "mat4",  # from world directions to the picture's
        "clip_to_world": "mat4",
        "color": "vec4",  # by which the picture is multiplied
        "size": "vec4",  # width and height of what is drawn [pixels]
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
    """The struct of a class of settings, called after its instance: `settings` is a `Settings`.

    An enumeration is the index of its choice; free text has no place.
    """
    kinds = {name: _glsl_type(default, details) for name, default, details in declared(settings_class)}
    return Block(instance.capitalize(), {name: kind for name, kind in kinds.items() if kind})


def fill(settings):
    """The record of `settings_block` that holds these settings."""
    record = settings_block(type(settings)).record()
    for name, _default, details in declared(type(settings)):
        if name in record.dtype.names:
            value = getattr(settings, name)
            choices = [choice[0] for choice in details.choices]
            record[name] = choices.index(value) if choices else value
    return record


def uniform_buffer(record):
    """A GPUUniformBuf with the bytes of a record."""
    return gpu.types.GPUUniformBuf(bytes_of(record))


def clipping_blocks(planes):
    """{instance: GPUUniformBuf} of programs that are clipped by planes, (6, 4); none where these are None."""
    if planes is None:
        return {}
    record = CLIPPING.record()
    record["planes"] = planes
    return {"clipping": uniform_buffer(record)}


def bytes_of(record):
    """A Buffer with the bytes of a record: it has no raw kind, and unsigned bytes are copied as they are."""
    data = record.tobytes()
    return gpu.types.Buffer("UBYTE", len(data), data)
