# SPDX-License-Identifier: GPL-3.0-or-later
"""The grooms of docs/manual/maps.md in a window: maps are added by their buttons and painted with the mouse.

Run by a desktop Blender as steps.py says; PART is the name of a groom.
"""

import itertools
import sys
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))
from tests.desktop.haircuts import hands  # noqa: E402
from tests.desktop.haircuts.haircuts import BEARD_AREA, LEFT, SIDE_LEVELS, faded  # noqa: E402
from tests.desktop.haircuts.hands import fields, mirrored, press, select, vary, view, weights  # noqa: E402
from tests.desktop.steps import OUT, PART, ZIP, facts, take  # noqa: E402
from tests.desktop.window import (  # noqa: E402
    MODULE,
    addon,
    drag,
    import_head,
    in_viewport,
    install,
    mask_scalp,
    offscreen_light,
    places,
    refine_to,
    remove_objects,
    take_picture,
    viewport,
    wait,
    wait_for,
)

# Scene-linear.
ORANGE, CREAM, BLACK, WHITE = (0.24, 0.052, 0.007), (0.55, 0.42, 0.28), (0.006, 0.005, 0.005), (0.75, 0.70, 0.62)
STRANDS = 6000
BRUSH = 40  # pixels of the diameter of the brush for coats
FACE = {"middle": (0.0, 0.0, 0.0), "distance": 3.3}  # of the monkey
STRIPES = (-0.4, 0.82), (0.0, 0.87), (0.4, 0.82)  # upper ends (x, z), on the forehead
STRIPE = 0.25  # length
SHARE = 10.0  # pixels around a root, more than those whose texels its strand has
TIPS = 0.4, 0.1  # tip absorption of the ombre, and From of its map
LENGTHS, THICKNESSES = 0.15, 0.3  # From of hair that thins out

BROWS = tuple(
    ((side * 0.016, -0.15, 0.750), (side * 0.028, -0.145, 0.756), (side * 0.042, -0.135, 0.753)) for side in (1, -1)
)


def begin():
    """Remove everything, and add the monkey or the sample's head."""
    install(ZIP)
    refine_to(1)
    bpy.context.preferences.system.use_region_overlap = False
    remove_objects()
    area, _region = viewport()
    area.spaces.active.overlay.show_extras = area.spaces.active.overlay.show_floor = False
    if PART in ("tiger", "calico"):
        with in_viewport():
            bpy.ops.mesh.primitive_monkey_add()
        bpy.context.object.name = "Head"
    else:
        mask_scalp(import_head())
    yield from wait(0.3)
    hands.begin()


def data():
    return hands.hair().data


def looks():
    return addon().data.maps.strand_maps.read_looks(data())


def colors(sigma_a):
    """Return the colors (S, 3) of absorption (S, 3)."""
    pigment = sys.modules[f"{MODULE}.hair_addon.core.shading.fibre.pigment"]
    return pigment.color_from_sigma_a(sigma_a, data().vellus.appearance.radial_roughness)


def strands():
    """Return (S, P, 3) points as they are now."""
    bound = addon().groom.bindings.of(data())
    bound.update_points()
    return bound.points.copy()


def lengths():
    return np.linalg.norm(np.diff(strands(), axis=1), axis=2).sum(axis=1)


def radii():
    """Return the radius (S,) at each root."""
    found = np.empty(len(data().points), np.float32)
    data().attributes["radius"].data.foreach_get("value", found)
    return found.reshape(len(data().curves), -1)[:, 0]


def weights_at_roots(name):
    """Return the weights (S, 3) of a vertex group at the corners of the roots' triangles, and those at the roots."""
    bound, surface = addon().groom.bindings.of(data()), data().surface
    of_vertices = addon().data.scene.weights_in_group(surface.data, surface.vertex_groups[name].index)
    roots = bound.binding.roots
    corners = of_vertices[bound.surface.mesh.triangles[roots.triangle]]
    return corners, (corners * roots.barycentric).sum(axis=1)


def grown(length, mask="scalp", **values):
    """Grow hair on the head in a vertex group."""
    return (
        select("Head"),
        press("vellus.add_hair", strand_count=STRANDS, length=length, density_group=mask),
        fields("guides", drape=False, **values),
    )


def furred(color):
    """Grow short fur of a color on the monkey, seen from the front."""
    return (
        select("Head"),
        press("vellus.add_hair", strand_count=STRANDS, guide_count=200, length=0.06, radius=0.012),
        fields("guides", gravity=0.0),
        fields("look", parametrization="COLOR", color=color, random_color=0.0, tip_absorption=1.0),
        view(0, -1, 0, **FACE),
    )


def stroke(start, end):
    """Draw with the mouse from a place (x, z) of the monkey's front to another."""
    first, last = places(np.array([(start[0], -0.6, start[1]), (end[0], -0.6, end[1])]))
    return drag(first, last, steps=10)


def tiger():
    """Paint black stripes on the image of a map of the color."""
    for step in (*furred(ORANGE), vary("look.color", kind="IMAGE"), press("vellus.paint_map", setting="look.color")):
        yield from step()
    yield from wait(0.5)
    facts["mode"] = bpy.context.mode
    before, light = colors(looks().root), offscreen_light(addon())
    paint = bpy.context.tool_settings.image_paint
    unified = paint.unified_paint_settings
    unified.size, unified.use_unified_color, unified.use_unified_strength = BRUSH, False, False
    paint.brush.color, paint.brush.strength, paint.brush.curve_distance_falloff_preset = BLACK, 1.0, "CONSTANT"
    for x, z in STRIPES:
        yield from stroke((x, z), (x, z - STRIPE))
    yield from wait(0.8)
    now, painted = colors(looks().root), offscreen_light(addon())
    take_picture(OUT / "tiger.png")
    roots = places(strands()[:, 0])
    is_far = _distances(roots) > 0.5 * BRUSH + SHARE
    is_painted = _are_seen() & (_distances(roots) < 0.5 * BRUSH - SHARE)
    facts["painted"] = np.median(now[is_painted], axis=0).tolist()
    facts["share"] = float((np.abs(now - BLACK).max(axis=1) < 0.02)[is_painted].mean())
    facts["is painted"] = int(is_painted.sum())
    facts["orange"] = float(np.abs(before - ORANGE).max())
    facts["far away"] = float((np.abs(now - before).max(axis=1) < 1e-6)[is_far].mean())
    _area, region = viewport()
    rows, columns = np.mgrid[: region.height, : region.width]
    pixels = np.stack([columns + region.x + 0.5, rows + region.y + 0.5], axis=-1).reshape(-1, 2)
    # The difference of red and blue has no part of the white highlights.
    before, now = ((each[..., 0] - each[..., 2]).ravel() for each in (light, painted))
    is_hair, away = (light[..., 3].ravel() > 0.95) & (before > 1e-3), _distances(pixels)
    ratio = now / np.where(is_hair, before, 1.0)
    facts["darker"] = float(np.median(ratio[is_hair & (away < 0.25 * BRUSH)]))
    facts["as before"] = float(np.median(ratio[is_hair & (away > BRUSH)]))


def _are_seen():
    """Return whether roots (S,) face the viewer, and the surface does not hide them."""
    points = strands()
    area, _region = viewport()
    eye = area.spaces.active.region_3d.view_matrix.inverted().translation
    away = points[:, 0] - np.array(eye)
    far = np.linalg.norm(away, axis=1)
    is_seen = np.einsum("sc,sc->s", points[:, 3] - points[:, 0], away) < -0.5 * far * np.linalg.norm(
        points[:, 3] - points[:, 0], axis=1
    )
    for strand in np.flatnonzero(is_seen):
        is_hit, place, _normal, _face = data().surface.ray_cast(eye, away[strand])
        is_seen[strand] = is_hit and (place - eye).length > far[strand] - 0.01
    return is_seen


def _distances(pixels):
    """Return the distance (N,) of pixels (N, 2) to the nearest stripe."""
    found = []
    for x, z in STRIPES:
        first, last = places(np.array([(x, -0.6, z), (x, -0.6, z - STRIPE)]))
        along = np.clip((pixels - first) @ (last - first) / ((last - first) @ (last - first)), 0.0, 1.0)
        found.append(np.linalg.norm(pixels - first - along[:, None] * (last - first), axis=1))
    return np.min(found, axis=0)


def calico():
    """Paint a mask, which a color ramp turns into patches of three colors."""
    setting = "look.color"
    for step in (*furred(WHITE), vary(setting, kind="GROUP"), press("vellus.add_map_ramp", setting=setting)):
        yield from step()
    item = next(item for item in data().vellus.maps if item.setting == setting)
    ramp = addon().settings.ramp_nodes.node_of(item.ramp_tree).color_ramp
    stops = ((0.0, BLACK), (0.3, BLACK), (0.35, ORANGE), (0.65, ORANGE), (0.7, WHITE), (1.0, WHITE))
    for place, _color in stops[1:-1]:
        ramp.elements.new(place)
    for element, (_place, color) in zip(ramp.elements, stops, strict=True):
        element.color = (*color, 1.0)
    item.ramp_tree.update_tag()
    yield from press("vellus.paint_map", setting=setting)()
    paint = bpy.context.tool_settings.weight_paint
    paint.unified_paint_settings.use_unified_weight = False
    paint.brush.curve_distance_falloff_preset, paint.unified_paint_settings.size = "CONSTANT", 60
    for weight, x in ((0.5, -0.45), (0.0, 0.45)):
        paint.brush.weight = weight
        yield from stroke((x, 0.5), (x, -0.1))
    yield from wait(0.5)
    take_picture(OUT / "calico.png")
    corners, _at_roots = weights_at_roots(item.source)
    found = colors(looks().root)
    for weight, color in ((0.0, BLACK), (0.5, ORANGE), (1.0, WHITE)):
        is_of = (np.abs(corners - weight) < 1e-3).all(axis=1)
        facts[f"{weight}"] = [int(is_of.sum()), float(np.abs(found[is_of] - color).max(initial=0.0))]


def fade():
    """Paint the map of the length, from the full length at the top to the skin."""
    yield from _taken(*grown(0.035, gravity=0.2, lift=0.75), fields("hair", radius=2e-4))
    full = lengths()
    setting = "strands.strand_length"
    yield from _taken(
        vary(setting, kind="GROUP"),
        press("vellus.paint_map", setting=setting),
        mirrored(),
        *faded(LEFT, SIDE_LEVELS),
        press("object.vertex_group_smooth", group_select_mode="ACTIVE", factor=0.5, repeat=6),
        press("object.mode_set", mode="OBJECT"),
    )
    yield from wait(0.5)
    take_picture(OUT / "fade.png")
    item = next(item for item in data().vellus.maps if item.setting == setting)
    _corners, wanted = weights_at_roots(item.source)
    factors, roots = lengths() / full, strands()[:, 0]
    facts["error"] = float(np.abs(factors - wanted).max())
    is_side = (np.abs(roots[:, 0]) > 0.062) & (roots[:, 1] < 0.02)
    edges = (0.70, 0.735, 0.765, 0.785, 0.81)
    facts["heights"] = [
        float(np.median(factors[is_side & (low <= roots[:, 2]) & (roots[:, 2] < high)]))
        for low, high in itertools.pairwise(edges)
    ]
    facts["top"] = float(np.median(factors[roots[:, 2] > 0.83]))


def ombre():
    """Bleach the ends of locks, each to another degree."""
    yield from _taken(
        *grown(0.2),
        select("Hair"),
        fields("hair", radius=3e-4),
        press("vellus.add_style", style="CLUMP"),
        fields("Clump", size=0.02, levels=1),
        fields("look", parametrization="COLOR", color=ORANGE, random_color=0.0, tip_absorption=TIPS[0]),
        fields("look", gradient_start=0.35, gradient_end=0.85),
        vary("look.tip_absorption", kind="CLUMP", low=TIPS[1]),
        view(0, -1, 0.1),
    )
    yield from wait(0.8)
    take_picture(OUT / "ombre.png")
    found = looks()
    ratio = (found.tip / found.root).mean(axis=1) / TIPS[0]
    facts["of channels"] = float(np.ptp(found.tip / found.root, axis=1).max())
    facts["factors"] = [float(ratio.min()), float(ratio.max())]
    clumps = np.empty(STRANDS, np.int32)
    data().attributes["clump_index"].data.foreach_get("value", clumps)
    of_locks = [np.ptp(ratio[clumps == lock]) for lock in np.unique(clumps)]
    facts["locks"], facts["within a lock"] = len(of_locks), float(max(of_locks))
    facts["root"] = float(np.abs(colors(found.root) - ORANGE).max())
    lightest = ratio.argmin()
    facts["tip"] = colors(found.tip[lightest : lightest + 1])[0].tolist()


def brows():
    """Grow brows along strokes of the mouse, and let them thin out."""
    area = {"middle": (0.0, -0.06, 0.73), "distance": 0.3}
    yield from _taken(*_new_group(), view(0, -1, 0.1, **area), weights(1.0, 0.013, *BROWS))
    yield from thinned(0.01)


def beard():
    """Grow a beard where it is painted, and let it thin out."""
    yield from _taken(*BEARD_AREA)
    yield from thinned(0.02)


def _new_group():
    """Enter Weight Paint mode with a new vertex group; smooth brushes have gradual edges."""
    return select("Head"), press("object.vertex_group_add"), press("paint.weight_paint_toggle")


def thinned(length):
    """Grow hair by the painted group, which also is the map of the length and the thickness."""
    yield from _taken(
        press("object.vertex_group_smooth", group_select_mode="ACTIVE", factor=0.5, repeat=2),
        press("object.mode_set", mode="OBJECT"),
        *grown(length, mask="Group"),
    )
    yield from wait(0.3)
    full, thick = lengths(), radii()
    for setting, low in (("strands.strand_length", LENGTHS), ("strands.thickness", THICKNESSES)):
        yield from vary(setting, kind="GROUP", source="Group", low=low)()
    yield from wait_for(lambda: not np.array_equal(radii(), thick))
    yield from wait(0.3)
    take_picture(OUT / f"{PART}.png")
    _corners, found = weights_at_roots("Group")
    facts["length"] = float(np.abs(lengths() / full - (LENGTHS + (1.0 - LENGTHS) * found)).max())
    facts["thickness"] = float(np.abs(radii() / thick - (THICKNESSES + (1.0 - THICKNESSES) * found)).max())
    bound, surface = addon().groom.bindings.of(data()), data().surface
    group = addon().data.scene.weights_in_group(surface.data, surface.vertex_groups["Group"].index)
    mesh = bound.surface.mesh
    of_faces = group[mesh.triangles].mean(axis=1)
    counts = np.bincount(bound.binding.roots.triangle, minlength=len(of_faces))
    wanted = mesh.areas * of_faces
    wanted *= STRANDS / wanted.sum()
    edges = np.linspace(0.0, 1.0, 6)
    bins = np.clip(np.digitize(of_faces, edges) - 1, 0, 4)
    facts["counts"] = np.bincount(bins, counts, 5).tolist()
    facts["wanted"] = np.bincount(bins, wanted, 5).tolist()
    facts["bare"] = int(counts[of_faces == 0.0].sum())


def _taken(*steps):
    for step in steps:
        yield from step()


if __name__ == "__main__":
    take((begin, globals()[PART]), pause=0.02)
