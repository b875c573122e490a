# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps beside the hair that they vary: `python blend_samples/pictures/map_pictures.py` draws them in Vellus and Cycles.

Writes docs/manual/maps.jpg. From the top: a tiger's coat (an image of colors), a fade (weights of the length), a
beard that thins out (weights of length and thickness) and bleached ends (a random number for each clump). Writes
docs/manual/more_maps.jpg: curls on one side (weights of the radius and the pitch of curls), a calico coat (a color ramp
of a mask) and brows that thin out. Writes docs/manual/wet_map.jpg: hair that is wet on one side (weights of the
wetness). Each map is made by the buttons of the panel, and filled as brushes would.
"""

import argparse
import os
import sys
from pathlib import Path

import bpy
import gpu
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.heads import head, portrait
from blend_samples.library import face_grooms, fur_grooms, head_grooms, ten_grooms
from blend_samples.library.combing import part
from blend_samples.sheets import picture_files
from hair_addon.blender.settings import map_items

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "manual"
SIZE = 224, 264  # pixels of a picture
TEXELS = 1024  # of a side of an image, as Paint makes it

# Scene-linear.
ORANGE, CREAM, BLACK = (0.24, 0.052, 0.007), (0.55, 0.42, 0.28), (0.006, 0.005, 0.005)
WHITE = (0.75, 0.70, 0.62)


def main():
    """Draw the requested pictures, all by default; pictures of a part of a sheet are written as NAME.png."""
    names = [name for rows in SHEETS.values() for name in rows]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help=f"of {', '.join(names)}; all by default")
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--cycles-samples", type=int, default=64)
    parser.add_argument("--strands", type=float, default=1.0, help="factor of the numbers of strands")
    parser.add_argument("--folder", type=Path, default=FOLDER)
    given = parser.parse_args()
    hair_addon.register()
    gpu.init()
    for file, makers in SHEETS.items():
        rows = {name: row(make, given) for name, make in makers.items() if name in (given.names or names)}
        if len(rows) == len(makers):
            picture_files.write(np.concatenate([*rows.values()]), (given.folder / file).resolve())
        else:
            for name, drawn in rows.items():
                picture_files.write(drawn, (given.folder / f"{name}.png").resolve())


def row(make, given):
    """Return a map, and its hair by Vellus and by Cycles, side by side."""
    shown = make(given.strands)
    bpy.context.view_layer.update()
    by_vellus = picture_files.drawn(*SIZE, sample_count=given.samples)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.render.engine, scene.cycles.samples = "CYCLES", given.cycles_samples
    scene.cycles.use_denoising = False
    return np.concatenate([shown, by_vellus, picture_files.rendered()], axis=1)


def tiger(strands):
    """Return a coat of stripes on the monkey, with a cream muzzle."""
    hair = furred_monkey(strands, ORANGE)
    colors = stripes()
    paint(hair, "look.color", "IMAGE", lambda item: fill(item.image, colors))
    return framed(encoded(colors[::-1]))


def calico(strands):
    """Return a coat of white, orange and black patches on the monkey, by a color ramp of a painted mask."""
    hair = furred_monkey(strands, WHITE)
    item = begin_map(hair, "look.color", "IMAGE")
    bpy.ops.vellus.add_map_ramp(setting="look.color")
    stops = ((0.0, WHITE), (0.2, WHITE), (0.35, ORANGE), (0.6, ORANGE), (0.8, BLACK))
    words = (f"{position}:{'/'.join(map(str, color))}" for position, color in stops)
    map_items.set_ramp(item, " ".join(words))
    masks = np.repeat(patches()[..., None], 3, axis=2)
    paint(hair, "look.color", "IMAGE", lambda item: fill(item.image, masks))
    return framed(encoded(masks[::-1]))


def furred_monkey(strands, color):
    """Return short fur of a color on the monkey, so dense that it hides the skin, with UVs, light and camera from the
    front.
    """
    monkey = fur_grooms.build()
    hair = fur_grooms.short_fur(monkey, int(160_000 * strands))
    hair.vellus.hair.radius = 1.4e-4 / strands  # [m]
    project_from_the_front(monkey)
    look = hair.vellus.appearance
    look.parametrization, look.color, look.tip_absorption, look.random_color = "COLOR", color, 0.85, 0.05
    see("Short Fur", 176.0, (0.38, -1.40, 0.76))
    return hair


def thin_brows(strands):
    """Return brows that thin out outward: shorter and thinner strands."""
    head_object = ten_grooms.dressed_head()
    hair = face_grooms.eyebrows(head_object, int(1600 * strands))
    inner = 1.0 - part(np.abs(places_of(head_object)[:, 0]), 0.024, 0.050)
    for setting, low in (("strands.strand_length", 0.15), ("strands.thickness", 0.3)):
        item = paint(hair, setting, "GROUP", lambda item: paint_weights(head_object, item.source, inner))
        item.low = low
    see("Eyebrows")
    return seen_weights(head_object, item.source)


def fade(strands):
    """Hair that becomes shorter from the crown to the ears and the nape."""
    head_object = ten_grooms.dressed_head()
    hair = head_grooms.pixie(head_object, int(30_000 * strands))
    hair.vellus.appearance.melanin = 0.72
    places = places_of(head_object)
    lengths = part(head.above_hairline(places) + 0.35 * (places[:, 2] - 0.80), 0.0, 0.075)
    item = paint(
        hair,
        "strands.strand_length",
        "GROUP",
        lambda item: paint_weights(head_object, item.source, 0.06 + 0.94 * lengths**1.5),
    )
    see("Pixie")
    return seen_weights(head_object, item.source)


def bleached(strands):
    """Waves whose ends are bleached, each lock to another degree."""
    hair = head_grooms.long_wavy(ten_grooms.dressed_head(), int(30_000 * strands))
    look = hair.vellus.appearance
    look.parametrization, look.melanin, look.redness, look.tip_absorption = "MELANIN", 0.62, 0.35, 0.6
    look.gradient_start, look.gradient_end = 0.35, 0.85
    begin_map(hair, "look.tip_absorption", "CLUMP").low = 0.05
    see("Long Wavy")
    words = np.full((SIZE[1], SIZE[0], 3), picture_files.BACKGROUND, np.uint8)
    rng = np.random.default_rng(1)
    cells = np.repeat(np.repeat(rng.integers(13, 255, (11, 9)), 24, axis=0), 24, axis=1)[: SIZE[1], : SIZE[0] - 8]
    words[: cells.shape[0], 4 : 4 + cells.shape[1]] = cells[..., None]
    return words


def beard(strands):
    """Return a beard that thins out over the cheeks: shorter and thinner strands."""
    head_object = ten_grooms.dressed_head()
    hair = face_grooms.beard(head_object, int(12_000 * strands))
    places = places_of(head_object)
    beside_lips = np.maximum(part(np.abs(places[:, 0]), 0.020, 0.040), part(places[:, 2], 0.690, 0.700))
    upper = part(places[:, 2], 0.655, 0.715) * beside_lips
    for setting, low in (("strands.strand_length", 0.10), ("strands.thickness", 0.35)):
        item = paint(hair, setting, "GROUP", lambda item: paint_weights(head_object, item.source, 1.0 - upper))
        item.low = low
    see("Beard")
    return seen_weights(head_object, item.source)


def one_sided(strands):
    """Return curls that become straight towards one side of the head."""
    head_object = ten_grooms.dressed_head()
    hair = head_grooms.long_wavy(head_object, int(30_000 * strands))
    name = next(item.name for item in hair.vellus.styles if item.kind == "CURL")
    weights = part(places_of(head_object)[:, 0], -0.05, 0.05)
    for number, low, high in (("radius", 0.0, 2.0), ("pitch", 2.0, 0.8)):
        setting = f"styles.{name}.{number}"
        item = paint(hair, setting, "GROUP", lambda item: paint_weights(head_object, item.source, weights))
        item.low, item.high = low, high
    see("Long Wavy")
    return seen_weights(head_object, item.source)


def wet_side(strands):
    """Return hair that is wet on one side of the head."""
    head_object = ten_grooms.dressed_head()
    hair = head_grooms.long_wavy(head_object, int(30_000 * strands))
    look = hair.vellus.appearance
    look.parametrization, look.melanin, look.redness, look.wetness = "MELANIN", 0.22, 0.2, 1.0
    weights = part(places_of(head_object)[:, 0], 0.02, 0.04)
    paint(hair, "look.wetness", "GROUP", lambda item: paint_weights(head_object, item.source, weights))
    see("Long Wavy")
    return seen_weights(head_object, hair.vellus.maps[-1].source)


SHEETS = {
    "maps.jpg": {"tiger": tiger, "fade": fade, "beard": beard, "bleached": bleached},
    "more_maps.jpg": {"one_sided": one_sided, "calico": calico, "thin_brows": thin_brows},
    "wet_map.jpg": {"wet_side": wet_side},
}


def begin_map(hair, setting, kind):
    """Return the map that the button beside a setting adds."""
    bpy.context.view_layer.objects.active = next(o for o in bpy.data.objects if o.data == hair)
    bpy.ops.vellus.edit_map(setting=setting)
    item = next(item for item in hair.vellus.maps if item.setting == setting)
    item.kind = kind
    return item


def paint(hair, setting, kind, stroke):
    """Return the map of which *Paint* makes the source, painted by a function of the map in the paint mode that it
    enters.
    """
    item = begin_map(hair, setting, kind)
    bpy.ops.vellus.paint_map(setting=setting)
    stroke(item)
    bpy.context.view_layer.update()
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.update()
    return item


def fill(image, colors):
    """Paint an image with scene-linear colors (TEXELS, TEXELS, 3), the bottom row first."""
    values = np.ones((*colors.shape[:2], 4), np.float32)
    values[..., :3] = encoded(colors) / 255.0
    image.pixels.foreach_set(values.ravel())
    image.update()


def paint_weights(surface, name, weights):
    """Paint a vertex group with weights (V,)."""
    group = surface.vertex_groups[name]
    for vertex, weight in enumerate(weights):
        group.add([vertex], float(weight), "REPLACE")
    surface.data.update_tag()


def places_of(surface):
    """Return (V, 3) [m] of the vertices of a mesh object."""
    return np.array([vertex.co for vertex in surface.data.vertices])


def project_from_the_front(surface):
    """Give a mesh object UVs by its places from the front, as *Project from View* does."""
    places = places_of(surface)[:, [0, 2]]
    uvs = (places - places.min(axis=0)) / np.ptp(places, axis=0)
    corners = [loop.vertex_index for loop in surface.data.loops]
    layer = surface.data.uv_layers.active or surface.data.uv_layers.new()
    layer.uv.foreach_set("vector", uvs[corners].astype(np.float32).ravel())
    surface.data.update_tag()


def stripes():
    """Colors (TEXELS, TEXELS, 3) of a tiger seen from the front, scene-linear, the bottom row first."""
    v, u = np.mgrid[-1.0 : 1.0 : TEXELS * 1j, -1.0 : 1.0 : TEXELS * 1j]
    side = np.abs(u)
    wave = np.sin(17.0 * v - 8.0 * side + 1.2 * np.sin(7.0 * side + 4.0 * v))
    is_dark = wave > 1.0 - 0.85 * np.clip(1.8 * side + 0.9 * (v + 0.1), 0.0, 1.0)
    muzzle = (u / 0.24) ** 2 + ((v + 0.62) / 0.38) ** 2
    brows = ((side - 0.24) / 0.16) ** 2 + ((v - 0.42) / 0.13) ** 2
    is_light = (muzzle < 1.0) | (brows < 1.0) | (side > 0.86)
    found = np.where(is_light[..., None], CREAM, ORANGE)
    return np.where((is_dark & ~is_light)[..., None], BLACK, found)


def patches():
    """Return masks (TEXELS, TEXELS) of a calico cat from the front, bottom row first: 0 white, 0.5 orange, 1 black."""
    v, u = np.mgrid[-1.0 : 1.0 : TEXELS * 1j, -1.0 : 1.0 : TEXELS * 1j]
    ragged = 0.05 * np.sin(9.0 * u + 3.0 * np.sin(7.0 * v)) + 0.035 * np.sin(17.0 * v + 4.0 * u)

    def patch(x, z, width, height):
        away = np.hypot((u - x) / width, (v - z) / height) + ragged
        return 1.0 - part(away, 0.85, 1.05)

    orange = np.maximum.reduce(
        [patch(0.42, 0.55, 0.38, 0.55), patch(-0.85, 0.0, 0.3, 0.4), patch(0.32, -0.62, 0.2, 0.25)]
    )
    black = np.maximum.reduce([patch(-0.34, 0.5, 0.34, 0.6), patch(0.92, 0.15, 0.3, 0.4), patch(-0.3, -0.5, 0.18, 0.2)])
    return np.maximum(0.5 * orange, black)


def encoded(colors):
    """Return (…, 3) uint8 of scene-linear colors."""
    values = np.where(colors <= 0.0031308, 12.92 * colors, 1.055 * np.maximum(colors, 1e-9) ** (1.0 / 2.4) - 0.055)
    return np.round(255.0 * np.clip(values, 0.0, 1.0)).astype(np.uint8)


def framed(pixels):
    """Return a square picture in the size of the others, on their background."""
    side = SIZE[0] - 8
    places = np.linspace(0, len(pixels) - 1, side).astype(int)
    found = np.full((SIZE[1], SIZE[0], 3), picture_files.BACKGROUND, np.uint8)
    top = (SIZE[1] - side) // 2
    found[top : top + side, 4 : 4 + side] = pixels[places][:, places]
    return found


def seen_weights(surface, name):
    """Weights of a surface as Weight Paint shows them, from the camera, without hair."""
    weights = np.array([entry_weight(vertex, surface.vertex_groups[name].index) for vertex in surface.data.vertices])
    stops = np.array([(0.0, 0.0, 1.0), (0.0, 1.0, 1.0), (0.0, 1.0, 0.0), (1.0, 1.0, 0.0), (1.0, 0.0, 0.0)])
    colors = np.stack([np.interp(weights, np.linspace(0.0, 1.0, 5), stops[:, axis]) for axis in range(3)], axis=1)
    attribute = surface.data.color_attributes.new("Shown weights", "FLOAT_COLOR", "POINT")
    attribute.data.foreach_set("color", np.column_stack([colors, np.ones(len(colors))]).astype(np.float32).ravel())
    surface.data.color_attributes.active_color = attribute
    hidden = [o for o in bpy.data.objects if o.type == "CURVES" and not o.hide_render]
    scene = bpy.context.scene
    engine, scene.render.engine = scene.render.engine, "BLENDER_WORKBENCH"
    scene.display.shading.color_type = "VERTEX"
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    for one in hidden:
        one.hide_render = True
    found = picture_files.rendered()
    for one in hidden:
        one.hide_render = False
    scene.render.engine = engine
    surface.data.color_attributes.remove(surface.data.color_attributes["Shown weights"])
    return found


def entry_weight(vertex, group):
    """Return the weight of a vertex in the group with an index."""
    return next((entry.weight for entry in vertex.groups if entry.group == group), 0.0)


def see(name, lens=0.0, place=(0.70, -1.28, 0.73)):
    """The camera and lights of a groom of the library; lens: a focal length [mm], 0 for its own; place: [m]."""
    sample = ten_grooms.SAMPLES[name]
    portrait.light()
    camera = bpy.context.scene.camera
    camera.data.dof.use_dof = False
    camera.data.lens, camera.location = lens or sample.lens, place
    head.point_at(camera, sample.look_at)
    bpy.context.view_layer.update()


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing; all files are closed by now.
    os._exit(0)
