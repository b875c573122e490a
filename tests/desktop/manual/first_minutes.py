# SPDX-License-Identifier: GPL-3.0-or-later
"""The first ten minutes of a new artist, in a window: three clicks to hair, then README's five minutes.

Run by a desktop Blender as steps.py says, with a clean profile; MORE is how many samples a pixel and strands the head
has. Writes a picture of the screen for each step, of which `tools/manual_pictures.py five_minutes` makes README's, with
as many as an artist sees.
"""

import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT))
from tests.desktop.manual import face  # noqa: E402
from tests.desktop.steps import MORE, OUT, ZIP, facts, take  # noqa: E402
from tests.desktop.window import (  # noqa: E402
    click,
    curve_points,
    drag,
    import_head,
    in_viewport,
    install,
    mask_scalp,
    of_kind,
    places,
    refine_to,
    sidebar,
    take_picture,
    viewport,
    wait,
    wait_for,
)

# The defaults are low for drivers without a GPU, which take one sample per redraw.
SAMPLES, STRAND_COUNT = map(int, MORE) if MORE else (2, 5_000)

# Pixels from the upper right corner of the 3D view: the arrow that opens its sidebar.
_ARROW = (8, 86)

# Pixels from the upper left corner of a sidebar of the default width, with an interface scale of one.
_HAIR_TAB = (277, 237)
_NEW_HAIR_SYSTEM = (120, 46)


def step(name):
    """Take a picture of the screen after a step."""
    take_picture(OUT / f"first_{name}.png", SAMPLES)


def covered(hair):
    """Return the part of the mesh's pixels in the 3D view that hair changes."""
    _area, region = viewport()
    mesh = hair.data.surface
    pictures = {}
    for name, shown in (("both", (mesh, hair)), ("mesh", (mesh,)), ("none", ())):
        for thing in (mesh, hair):
            thing.hide_set(thing not in shown)
        take_picture(OUT / "covered.png")
        image = bpy.data.images.load(str(OUT / "covered.png"))
        pixels = np.empty((image.size[1], image.size[0], 4), np.float32)
        image.pixels.foreach_get(pixels.ravel())
        bpy.data.images.remove(image)
        bottom, left = region.y, region.x
        pictures[name] = pixels[bottom : bottom + region.height, left : left + region.width - sidebar().width, :3]
    for thing in (mesh, hair):
        thing.hide_set(False)
    differ = lambda a, b: np.abs(pictures[a] - pictures[b]).max(axis=2) > 0.02  # noqa: E731
    is_mesh = differ("mesh", "none")
    return float((differ("both", "mesh") & is_mesh).sum() / is_mesh.sum())


def look_at(thing, direction, distance):
    """Turn the 3D view to the middle of an object, from a direction and a distance [m]."""
    view = viewport()[0].spaces.active.region_3d
    corners = np.array([thing.matrix_world @ Vector(corner) for corner in thing.bound_box])
    view.view_location = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    view.view_rotation = Vector(direction).to_track_quat("Z", "Y")
    view.view_distance = distance


def three_clicks():
    """Grow hair on the default cube from the installed extension: the sidebar, the tab, the button."""
    install(ZIP)
    bpy.context.preferences.system.use_region_overlap = False
    if not MORE:
        refine_to(SAMPLES)
    area, _region = viewport()
    yield
    step("installed")
    yield from click(area.x + area.width - _ARROW[0], area.y + area.height - _ARROW[1])
    yield from wait(1.0)
    panel = sidebar()
    top = panel.y + panel.height
    yield from click(panel.x + _HAIR_TAB[0], top - _HAIR_TAB[1])
    step("hair_tab")
    facts["category"] = panel.active_panel_category
    yield from click(panel.x + _NEW_HAIR_SYSTEM[0], top - _NEW_HAIR_SYSTEM[1])
    yield from wait_for(lambda: of_kind("HAIR") is not None)
    yield from wait(1.0)
    hair = of_kind("HAIR")
    facts["surface"] = hair.data.surface.name if hair else None
    if hair is not None:
        step("cube")
        facts["covered"] = covered(hair)
        look_at(hair.data.surface, (1.0, -0.8, 0.65), 7.0)
        step("cube_near")


def open_head():
    """Open the sample's head with a scalp, in place of the cube."""
    for thing in list(bpy.data.objects):
        if thing.type in {"MESH", "CURVES"}:
            bpy.data.objects.remove(thing)
    head = import_head()
    with in_viewport():
        bpy.ops.object.shade_smooth()
    mask_scalp(head)
    if MORE:
        face.dress(head, (0.4, -1.0, 0.78))
        face.light()
        viewport()[0].spaces.active.overlay.show_extras = False  # lamps and the camera
    look_at(head, (0.75, -1.0, 0.25), 0.55)
    yield


def grow_on_the_head():
    """1. New Hair System, a vertex group as Guide Mask, which the strands follow, and how the hair is to grow."""
    with in_viewport():
        bpy.ops.vellus.add_hair("INVOKE_DEFAULT")
    yield from wait_for(lambda: of_kind("HAIR") is not None)
    guides, hair = of_kind("GUIDES").data.vellus, of_kind("HAIR").data
    hair.vellus.hair.strand_count = STRAND_COUNT
    guides.guides.density_group = "scalp"
    guides.guides.length = 0.1
    guides.guides.gravity = 0.75
    guides.guides.drape = True
    hair.vellus.hair.thickness = 0.25
    yield from wait_for(lambda: len(hair.curves) == STRAND_COUNT)
    step("head")
    group = hair.surface.vertex_groups["scalp"].index
    weights = np.array([any(g.group == group for g in v.groups) for v in hair.surface.data.vertices])
    roots = np.empty((3, len(hair.curves)), np.int32)
    for corner in range(3):
        hair.attributes[f"root_vertex_{corner}"].data.foreach_get("value", roots[corner])
    facts["roots off the mask"] = int((~weights[roots].any(axis=0)).sum())


def comb():
    """2. Comb Guides, and two strokes across the hair, from the face over the ear."""
    with in_viewport():
        bpy.ops.vellus.comb_guides()
    yield from wait(1.0)
    guides, hair = of_kind("GUIDES"), of_kind("HAIR")
    before = curve_points(guides), curve_points(hair)
    facts["mode"] = bpy.context.mode
    bpy.context.tool_settings.curves_sculpt.unified_paint_settings.size = 150
    middle = places(before[0][40::41]).mean(axis=0)
    for below in (0, 60):
        yield from drag(middle + np.array([-120, 60 - below]), middle + np.array([60, -50 - below]))
    yield from wait(2.0)
    step("combed")
    facts["combed"] = [float(np.abs(curve_points(o) - b).max()) for o, b in zip((guides, hair), before, strict=True)]
    with in_viewport():
        bpy.ops.object.mode_set(mode="OBJECT")
    yield


def shade():
    """3. A look, Marschner, melanin, roughness and cuticle angle."""
    hair = of_kind("HAIR")
    with in_viewport():
        bpy.ops.vellus.select_hair()
        bpy.ops.vellus.apply_preset(preset="GINGER")
    hair.data.vellus.model = "MARSCHNER"
    hair.data.vellus.appearance.roughness = 0.25
    yield from wait(2.0)
    step("shaded")


def write_and_export():
    """4., 5. Render Picture, settings, lookup tables; Export Groom, USD and Alembic."""
    view = viewport()[0].spaces.active.region_3d
    with in_viewport():
        bpy.context.scene.camera.matrix_world = view.view_matrix.inverted()
        bpy.context.scene.camera.data.lens = 33.0  # [mm]: the head fills the picture
        bpy.context.view_layer.objects.active = of_kind("HAIR")
        bpy.ops.vellus.render_picture("INVOKE_DEFAULT", filepath=str(OUT / "first_picture.png"), width=480, height=300)
    yield from wait_for((OUT / "first_picture.png").exists)
    yield from wait(1.0)
    with in_viewport():
        bpy.ops.vellus.save_groom_settings(filepath=str(OUT / "first_groom.json"))
        bpy.ops.vellus.bake_tables(directory=str(OUT / "first_tables"), size=32)
        bpy.ops.vellus.export_groom(filepath=str(OUT / "first_groom.abc"))
        # Not every build of Blender has these.
        if "usd_export" in dir(bpy.ops.wm):
            bpy.ops.vellus.export_groom(filepath=str(OUT / "first_groom.usdc"))
            bpy.ops.wm.usd_export(filepath=str(OUT / "first.usdc"))
        if "alembic_export" in dir(bpy.ops.wm):
            bpy.ops.wm.alembic_export(filepath=str(OUT / "first.abc"), as_background_job=False)
    yield
    names = ("first_picture.png", "first_groom.json", "first_tables/n_g.exr", "first_groom.abc")
    facts["files"] = {name: (OUT / name).stat().st_size if (OUT / name).exists() else 0 for name in names}


if __name__ == "__main__":
    take((three_clicks, open_head, grow_on_the_head, comb, shade, write_and_export))
