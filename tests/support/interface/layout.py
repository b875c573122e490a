# SPDX-License-Identifier: GPL-3.0-or-later
"""A mock of Blender's UILayout that records what was drawn and refuses names that do not exist."""

from collections import Counter
from types import SimpleNamespace

import bpy

from hair_addon.blender.ui import panels

SIDEBAR_WIDTH = 260  # pixels of the N-panel as Blender opens it


class Layout:
    """Records drawing calls; properties must exist on their owner, operators, menus and panels be registered.

    `drawn` counts everything, as if all panels were open; `folded` counts properties in panels closed at first.
    """

    def __init__(self, whole=None, is_folded=False):
        self.drawn = Counter() if whole is None else whole.drawn
        self.folded = Counter() if whole is None else whole.folded
        self.panels = [] if whole is None else whole.panels  # their identifiers
        self._is_folded = is_folded
        self.texts = [] if whole is None else whole.texts
        self.buttons = [] if whole is None else whole.buttons  # labels of operators
        self.picked = {} if whole is None else whole.picked  # property → the collection that it is picked from
        self.lines = [] if whole is None else whole.lines  # [labels of the operators of a row, "" for an icon alone]
        self._line = []

    def _part(self, align=False):
        return Layout(self, self._is_folded)

    column = box = menu_pie = _part

    def row(self, align=False):
        part = self._part()
        self.lines.append(part._line)
        return part

    def panel(self, idname, default_closed=False):
        assert idname not in self.panels
        self.panels.append(idname)
        return self._part(), Layout(self, self._is_folded or default_closed)

    def split(self, factor):
        assert 0.0 < factor < 1.0
        return self._part()

    def separator(self):
        pass

    def label(self, *, text, icon="NONE", translate=True):
        self.drawn["label"] += 1
        self.texts.append(text)

    def progress(self, *, text, factor, type):
        assert 0.0 <= factor <= 1.0
        self.drawn["progress"] += 1
        self.texts.append(text)

    def template_list(self, list_type, list_id, owner, name, active_owner, active_name, rows):
        """Draw every row that the filter shows."""
        assert active_name in active_owner.bl_rna.properties
        self.drawn["template_list"] += 1
        drawing = SimpleNamespace(bitflag_filter_item=1)
        list_class = next(cls for cls in panels.LISTS if cls.bl_idname == list_type)
        items = getattr(owner, name)
        shown = [1] * len(items)  # Blender's own filter is empty at first
        if "filter_items" in vars(list_class):
            shown, _order = list_class.filter_items(drawing, Context(), owner, name)
        for item, is_shown in zip(items, shown, strict=True):
            if is_shown:
                list_class.draw_item(drawing, Context(), self, owner, item, 0, active_owner, active_name)

    def prop(self, owner, name, text="", icon="NONE", emboss=True):
        assert name in owner.bl_rna.properties
        self.drawn[name] += 1
        self.folded[name] += self._is_folded

    def prop_decorator(self, owner, name):
        assert name in owner.bl_rna.properties
        self.drawn[f"key of {name}"] += 1

    def prop_search(self, owner, name, source, collection, text="", results_are_suggestions=False):
        self.picked[name] = getattr(source, collection)
        self.prop(owner, name)

    def grid_flow(self, columns, row_major, even_columns, even_rows, align):
        return self._part()

    def template_icon_view(self, owner, name, show_labels, scale, scale_popup):
        assert owner.bl_rna.properties[name].type == "ENUM" and show_labels
        self.drawn[f"pictures of {name}"] += 1

    def operator(self, name, text=None, icon="NONE", icon_value=0, translate=True, depress=False):
        category, operator = name.split(".")
        kind = getattr(getattr(bpy.ops, category), operator).get_rna_type()  # a KeyError where there is none
        self.drawn[name] += 1
        label = kind.name if text is None else text
        self.texts.append(text or "")
        self.buttons.append(label)
        self._line.append(label)
        return SimpleNamespace()

    def operator_menu_enum(self, name, choice, text=None, icon="NONE"):
        category, operator = name.split(".")
        choices = getattr(getattr(bpy.ops, category), operator).get_rna_type().properties[choice].enum_items
        assert len(choices) > 1
        return self.operator(name, text=text)

    def menu(self, name, icon="NONE"):
        assert hasattr(bpy.types, name)
        self.drawn[name] += 1

    def popover(self, *, panel, icon, text):
        assert hasattr(bpy.types, panel)
        self.drawn[panel] += 1


class Context:
    """The present context, with a sidebar of Blender's default width."""

    region = SimpleNamespace(width=SIDEBAR_WIDTH)
    preferences = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0))

    def __getattr__(self, name):
        return getattr(bpy.context, name)


def draw(panel):
    """Return the `Layout` drawn by a panel or menu in the present context; None if it is not shown."""
    context = Context()
    if hasattr(panel, "poll") and not panel.poll(context):
        return None
    ours = (base for base in panel.__mro__ if base.__module__.startswith("hair_addon"))
    own = {name: getattr(panel, name) for base in ours for name in vars(base) if not name.startswith("_")}
    drawing = SimpleNamespace(**own | {"layout": Layout()})
    if hasattr(panel, "draw_header"):
        panel.draw_header(drawing, context)
    if hasattr(panel, "draw_header_preset"):
        panel.draw_header_preset(drawing, context)
    panel.draw(drawing, context)
    return drawing.layout


def draw_all(panels):
    """Return the Counter of everything that panels draw."""
    layouts = [draw(panel) for panel in panels]
    return sum((layout.drawn for layout in layouts if layout is not None), Counter())


def redo_panel(name, **values):
    """Return the `Layout` of an operator's redo panel for given property values; others have their defaults."""
    operator = getattr(bpy.types, f"VELLUS_OT_{name}")
    rna = getattr(bpy.ops.vellus, name).get_rna_type()
    values = {key: entry.default for key, entry in rna.properties.items() if hasattr(entry, "default")} | values
    # An operator's own RNA lacks its settings, which are in `properties`.
    own = {"bl_rna": operator.bl_rna, "properties": SimpleNamespace(bl_rna=rna, **values), "layout": Layout()}
    bases = tuple(base for base in operator.__bases__ if base is not bpy.types.Operator)
    shown = type("Shown", bases, {**vars(operator), **own, **values})()
    shown.draw(Context())
    return shown.layout
