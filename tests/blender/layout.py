# SPDX-License-Identifier: GPL-3.0-or-later
"""A stand-in for Blender's UILayout that notes what was drawn and refuses what does not exist."""

from collections import Counter
from types import SimpleNamespace

import bpy

SIDEBAR_WIDTH = 260  # pixels of the N-panel as Blender opens it


class Layout:
    """Every property must exist on its owner, every operator, menu and panel be registered."""

    def __init__(self, drawn=None, texts=None):
        self.drawn = Counter() if drawn is None else drawn
        self.texts = [] if texts is None else texts

    def _part(self, align=False):
        return Layout(self.drawn, self.texts)

    row = column = box = _part

    def separator(self):
        pass

    def label(self, *, text, icon="NONE", translate=True):
        self.drawn["label"] += 1
        self.texts.append(text)

    def progress(self, *, text, factor, type):
        assert 0.0 <= factor <= 1.0
        self.drawn["progress"] += 1
        self.texts.append(text)

    def prop(self, owner, name, text=""):
        assert name in owner.bl_rna.properties
        self.drawn[name] += 1

    def prop_search(self, owner, name, source, collection, results_are_suggestions=False):
        assert hasattr(source, collection)
        self.prop(owner, name)

    def operator(self, name, text="", icon="NONE", translate=True):
        category, operator = name.split(".")
        assert operator in dir(getattr(bpy.ops, category))
        self.drawn[name] += 1
        self.texts.append(text)
        return SimpleNamespace()

    def operator_menu_enum(self, name, choice):
        category, operator = name.split(".")
        choices = getattr(getattr(bpy.ops, category), operator).get_rna_type().properties[choice].enum_items
        assert len(choices) > 1
        return self.operator(name)

    def menu(self, name, icon="NONE"):
        assert hasattr(bpy.types, name)
        self.drawn[name] += 1

    def popover(self, *, panel, icon, text):
        assert hasattr(bpy.types, panel)
        self.drawn[panel] += 1


class Context:
    """The present context, with a sidebar of Blender's own width."""

    region = SimpleNamespace(width=SIDEBAR_WIDTH)
    preferences = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0))

    def __getattr__(self, name):
        return getattr(bpy.context, name)


def draw(panel):
    """The `Layout` that a panel or menu fills in the present context; None where it is not shown."""
    context = Context()
    if hasattr(panel, "poll") and not panel.poll(context):
        return None
    drawing = SimpleNamespace(layout=Layout(), settings=getattr(panel, "settings", ()))
    if hasattr(panel, "draw_header_preset"):
        panel.draw_header_preset(drawing, context)
    panel.draw(drawing, context)
    return drawing.layout


def draw_all(panels):
    """Counter of all that some panels draw together."""
    layouts = [draw(panel) for panel in panels]
    return sum((layout.drawn for layout in layouts if layout is not None), Counter())
