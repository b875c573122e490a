# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface uses US spelling, and its labels fit a sidebar of default width."""

import re

import blf
import bpy
import pytest

from hair_addon.blender.settings import translations
from hair_addon.blender.ui import panels, setting_rows
from tests.support.interface import interface_strings
from tests.support.interface.layout import draw
from tests.support.pairs import pairs
from tools import manual_pages

BRITISH = re.compile(
    r"\b(\w*colour\w*|grey\w*|\w*neighbour\w*|\w*fibre\w*|\w*centre[sd]?|licence\w*|behaviour\w*|favour\w*|honour\w*|"
    r"(?:kilo|milli|centi|nano)?metres?|modell(?:ed|ing)|travell\w+|cancell(?:ed|ing)|labell\w+|catalogue\w*|"
    r"(?:normal|organ|visual|random|initial|optim|minim|maxim)is(?:e|es|ed|ing|ation)|analys(?:e|ed|es)|"
    r"towards|whilst|analogue|grown-up|artefacts?)\b",
    re.IGNORECASE,
)


def test_the_interface_has_us_spelling():
    texts = {
        *interface_strings.strings_of_classes(),
        *interface_strings.strings_of_sources(),
        *interface_strings.parts_of_errors(),
    }
    assert sorted(text for text in texts if BRITISH.search(text)) == []


ROOT = interface_strings.ADDON.parent
PAGES = [
    *sorted(manual_pages.SOURCE.glob("*.md")),
    *sorted((ROOT / "docs").glob("*.md")),
    *(ROOT / name for name in ("README.md", "CHANGELOG.md", "docs/farm/README.md", "blend_samples/README.md")),
]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: f"{page.parent.name}_{page.stem}")
def test_pages_have_us_spelling(page):
    prose = re.sub(r"`[^`]*`|\]\([^)]*\)", "", page.read_text(encoding="utf-8"))  # no identifiers, no addresses
    assert [match[0] for match in BRITISH.finditer(prose)] == []


# In a sidebar of 280 pixels, as a window shows it: the rows of a panel, and what a label keeps free at its sides.
ROW_WIDTH, MARGIN = 224, 10
FONT_SIZE = 11  # of Blender's interface, at a scale of one
ICON_WIDTH, BUTTON_MARGIN, SHARED_MARGIN = 20, 16, 4  # the last: of buttons side by side


def width(text):
    blf.size(0, FONT_SIZE)
    return blf.dimensions(0, text)[0]


def shown_in(locale, text):
    return text if locale == "en_US" else translations.dictionaries()[locale][text]


def names_in_the_sidebar():
    """Return {label of a property with a row in the sidebar: location}."""
    groups = [cls for cls in interface_strings.blender.CLASSES if issubclass(cls, bpy.types.PropertyGroup)]
    of_renders = {"VellusRenderSettings", "VellusPassSettings"}  # in the Properties editor, which is wider
    return {
        entry.name: f"{cls.__name__}.{entry.identifier}"
        for cls in groups
        for entry in interface_strings.properties_of(cls)
        if cls.__name__ not in of_renders
        and not entry.is_hidden
        and entry.name != entry.identifier
        and entry.identifier not in setting_rows.WIDE
    }


@pytest.mark.parametrize("locale", ["en_US", *translations.dictionaries()])
def test_names_fit_the_sidebar(locale):
    room = ROW_WIDTH * setting_rows.NAME_SHARE - MARGIN
    names = {shown_in(locale, name): where for name, where in names_in_the_sidebar().items()}
    assert {name: (width(name), where) for name, where in names.items() if width(name) > room} == {}


@pytest.mark.parametrize(
    ("active", "locale"), pairs(["Sphere", "Guides", "Hair"], ["en_US", *translations.dictionaries()], 2)
)
def test_buttons_fit_the_sidebar(hair, active, locale):
    bpy.context.view_layer.objects.active = bpy.data.objects[active]
    layouts = [draw(panel) for panel in panels.CLASSES if panel.bl_region_type == "UI"]
    drawn = [layout for layout in layouts if layout is not None]
    buttons = {shown_in(locale, text) for layout in drawn for text in layout.buttons if text}
    room = ROW_WIDTH - ICON_WIDTH - BUTTON_MARGIN
    assert buttons and {text: width(text) for text in buttons if width(text) > room} == {}
    cut = {}
    for line in (line for layout in drawn for line in layout.lines if line):
        labels = [shown_in(locale, text) for text in line if text]
        room = (ROW_WIDTH - ICON_WIDTH * line.count("")) / max(len(labels), 1) - ICON_WIDTH - SHARED_MARGIN
        cut |= {text: width(text) for text in labels if len(labels) > 1 and width(text) > room}
    assert cut == {}


@pytest.mark.parametrize("locale", ["en_US", *translations.dictionaries()])
def test_choices_fit_their_menus(locale):
    """Choices fit their menus: the text of a menu button has the width of the value minus the arrow."""
    room = ROW_WIDTH * (1.0 - setting_rows.NAME_SHARE) - ICON_WIDTH - MARGIN
    groups = [cls for cls in interface_strings.blender.CLASSES if issubclass(cls, bpy.types.PropertyGroup)]
    choices = {
        shown_in(locale, choice.name): f"{cls.__name__}.{entry.identifier}"
        for cls in groups
        for entry in interface_strings.properties_of(cls)
        if entry.type == "ENUM" and entry.name != entry.identifier and entry.identifier not in setting_rows.WIDE
        for choice in entry.enum_items
    }
    assert {name: (width(name), where) for name, where in choices.items() if width(name) > room} == {}
