# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw Parting, Draw Flow, Stop Drawing and Stop Combing work, and guides are named after their hair."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.groom.guides import line_drawing
from hair_addon.blender.groom.systems import hair_systems
from hair_addon.blender.ui import panels
from tests.support.interface.layout import draw
from tests.support.overridden import override, parts
from tests.support.reading import points, write_points

TAB = [panel for panel in panels.CLASSES if panel.bl_region_type == "UI"]


def buttons():
    return [label for panel in TAB if (layout := draw(panel)) is not None for label in layout.buttons]


def draw_line(lines, *corners):
    """Add a line as a stroke would, because Blender's Draw tool needs a window."""
    bpy.ops.object.mode_set(mode="OBJECT")
    spline = lines.data.splines.new("POLY")
    spline.points.add(len(corners) - 1)
    for point, corner in zip(spline.points, corners, strict=True):
        point.co = (*corner, 1.0)
    bpy.ops.object.mode_set(mode="EDIT")


def arc(normal, steps=24):
    """Return points on the upper half of the sphere's circle at right angles to the X or Y axis."""
    angles = np.linspace(0.1, np.pi - 0.1, steps)
    along = np.stack([np.cos(angles), np.zeros(steps), np.sin(angles)], axis=1)
    return along[:, [1, 0, 2]] if normal == "X" else along


def test_a_parting_is_drawn_on_the_surface(hair):
    """Two clicks draw a curve that is picked, lies in the surface's coordinates and can be extended."""
    sphere = hair.parent
    sphere.location = (1.0, 2.0, 3.0)
    assert "Draw Parting" in buttons()
    bpy.ops.vellus.draw_parting()
    lines = bpy.context.object
    assert lines.mode == "EDIT" and lines.parent == sphere and sphere.select_get()
    assert hair.data.vellus.hair.part_lines == lines.name == "Parting of Sphere"
    paint = bpy.context.tool_settings.curve_paint_settings
    assert (paint.curve_type, paint.depth_mode, paint.surface_offset) == ("POLY", "SURFACE", 0.0)
    assert paint.use_project_only_selected
    bpy.context.view_layer.update()
    assert hair.data.vellus.status == ""  # nothing is drawn yet, and nothing is wrong
    before = points(hair)
    draw_line(lines, *arc("X"))
    bpy.context.view_layer.update()
    assert "Stop Drawing" in buttons()
    bpy.ops.vellus.draw_parting()
    bpy.context.view_layer.update()
    assert bpy.context.object == hair and lines.mode == "OBJECT"
    parted = points(hair)
    assert hair.data.vellus.parting_key != "" and not np.array_equal(parted, before)
    bpy.ops.vellus.draw_parting()
    assert bpy.context.object == lines  # the same one again
    bpy.ops.vellus.draw_parting()


def test_lines_without_a_stroke_are_removed(hair):
    count = len(bpy.data.objects)
    bpy.ops.vellus.draw_parting()
    assert len(bpy.data.objects) == count + 1
    bpy.ops.vellus.draw_parting()
    bpy.context.view_layer.update()
    assert len(bpy.data.objects) == count and hair.data.vellus.hair.part_lines == ""
    assert hair.data.vellus.status == ""


def test_flow_is_drawn_for_guides_that_are_not_combed(hair):
    guides = bpy.data.objects["Guides"]
    guides.data.vellus.guides.gravity = 0.0
    bpy.context.view_layer.update()
    before = points(guides)
    bpy.ops.vellus.draw_flow()
    lines = bpy.context.object
    assert guides.data.vellus.guides.flow_lines == lines.name == "Flow of Sphere"
    draw_line(lines, *arc("Y"))
    bpy.ops.vellus.draw_flow()
    bpy.context.view_layer.update()
    assert bpy.context.object == guides
    first = points(guides)[:, 8] - points(guides)[:, 0]
    top = points(guides)[:, 0, 2] > 0.9
    assert not np.array_equal(points(guides), before)
    assert (first[top, 0] < 0.0).all()  # the arc runs from +X to -X
    write_points(guides, points(guides) * np.float32(1.1))
    bpy.context.view_layer.update()
    with pytest.raises(RuntimeError, match="Combed guides do not follow flow lines"):
        bpy.ops.vellus.draw_flow()
    assert bpy.context.mode == "OBJECT"


def test_a_tie_is_drawn_off_the_surface_and_gather_uses_it(hair):
    guides = bpy.data.objects["Guides"]
    assert "Draw Tie" in buttons()
    bpy.ops.vellus.draw_tie()
    tie = bpy.context.object
    assert guides.data.vellus.tie_lines == tie.name == "Tie of Sphere" and tie.mode == "EDIT"
    assert bpy.context.tool_settings.curve_paint_settings.use_stroke_endpoints
    draw_line(tie, (0.0, 0.6, 0.8), (0.0, 1.0, 1.2), (0.0, 1.4, -1.0))
    assert "Stop Drawing" in buttons()
    bpy.ops.vellus.draw_tie()
    bpy.context.view_layer.update()
    assert bpy.context.object == guides
    tie.name = "Ponytail"
    bpy.context.view_layer.update()
    assert guides.data.vellus.tie_lines == "Ponytail"
    before = points(guides)
    assert bpy.ops.vellus.gather_guides("INVOKE_DEFAULT") == {"FINISHED"}
    assert not np.array_equal(points(guides), before)
    bpy.data.objects.remove(tie)
    assert line_drawing.tie_of(guides.data) is None


def test_lines_are_drawn_on_the_override_of_a_linked_character(hair, tmp_path):
    """The overridden collection takes no new objects, and the surface has the same name as the linked surface."""
    override(hair, tmp_path)
    bpy.context.view_layer.objects.active = parts()[0]
    bpy.ops.vellus.add_hair(guide_count=10, strand_count=20)
    for draw_lines in (bpy.ops.vellus.draw_tie, bpy.ops.vellus.draw_flow, bpy.ops.vellus.draw_parting):
        draw_lines()
        lines = bpy.context.object
        assert lines.mode == "EDIT" and lines.parent == parts()[0]
        draw_lines()


def test_lines_that_cannot_be_seen(hair):
    """Hidden lines are shown. Lines outside of the view layer are refused; for a tie, which has no field, new lines
    begin.
    """
    guides, scene = bpy.data.objects["Guides"], bpy.context.scene
    for draw_lines in (bpy.ops.vellus.draw_tie, bpy.ops.vellus.draw_parting):
        bpy.context.view_layer.objects.active = hair
        draw_lines()
        lines = bpy.context.object
        draw_line(lines, *arc("X"))
        draw_lines()
        lines.hide_set(True)
        draw_lines()
        assert bpy.context.object == lines and lines.visible_get()
        draw_lines()
        lines.use_fake_user = True
        scene.collection.objects.unlink(lines)
    with pytest.raises(RuntimeError, match='"Parting of Sphere" is not in this view layer'):
        bpy.ops.vellus.draw_parting()
    assert bpy.context.mode == "OBJECT"
    bpy.ops.vellus.draw_tie()
    assert bpy.context.object.name == guides.data.vellus.tie_lines == "Tie of Sphere.001"


def test_what_is_no_curve_is_not_drawn_on(hair):
    hair.data.vellus.hair.part_lines = "Sphere"
    with pytest.raises(RuntimeError, match='"Sphere" is not a curve that can be drawn on'):
        bpy.ops.vellus.draw_parting()
    assert line_drawing.drawn_for(bpy.context.object) is None


def test_combing_stops_where_it_began(hair):
    assert "Stop Combing" not in buttons()
    bpy.ops.vellus.comb_guides()
    assert bpy.context.mode == "SCULPT_CURVES"
    assert buttons().count("Stop Combing") == 1  # at the top of the tab
    bpy.ops.vellus.comb_guides()
    assert bpy.context.mode == "OBJECT" and bpy.context.object == hair and hair.select_get()
    assert "Comb Guides" in buttons()


def test_guides_of_the_first_system_are_named_after_it_too(sphere):
    """Guides that a script has made keep their name until their hair is named."""
    bpy.ops.vellus.add_hair(guide_count=10, strand_count=20)
    hair = bpy.context.object
    guides = hair.data.vellus.guide_curves
    (shown,) = [o for o in bpy.data.objects if o.data == guides]
    assert (hair.name, shown.name, guides.name) == ("Hair", "Hair Guides", "Hair Guides")
    hair.vellus_system.title = "Fringe"
    assert (shown.name, guides.name) == ("Fringe Guides", "Fringe Guides")


def test_guides_are_named_after_their_hair(hair):
    guides = bpy.data.objects["Guides"]
    hair_systems.rename(hair, "Fringe")
    assert (hair.name, guides.name, guides.data.name) == ("Fringe", "Fringe Guides", "Fringe Guides")
    hair.vellus_system.title = "Bangs"
    assert guides.name == "Bangs Guides"
    guides.name = "Mine"
    hair_systems.rename(hair, "Fringe")
    assert (guides.name, guides.data.name) == ("Mine", "Fringe Guides")  # an artist's name stays
    bpy.context.view_layer.objects.active = hair.parent
    bpy.ops.vellus.add_hair(guide_count=10, strand_count=20)
    bpy.context.view_layer.objects.active = hair.parent
    bpy.ops.vellus.add_hair(guide_count=10, strand_count=20)
    second = bpy.context.object
    assert second.data.vellus.guide_curves.name == f"{second.name} Guides"
    bpy.context.view_layer.objects.active = bpy.data.objects["Mine"]
    bpy.ops.vellus.interpolate_hair(strand_count=20)
    hair_systems.rename(hair, "Short")  # others follow these guides too
    assert guides.data.name == "Fringe Guides"
