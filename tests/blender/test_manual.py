# SPDX-License-Identifier: GPL-3.0-or-later
"""F1 and *Online Manual* lead from every property and operator to an existing heading of the manual."""

import functools
import re
import urllib.parse
import webbrowser
from pathlib import Path

import bpy
import pytest
from bl_operators import wm

from blend_samples.pictures import all_pictures
from hair_addon.blender import manual
from tests.support.interface import interface_strings
from tools import manual_pages

LARGEST_PICTURE = 150_000  # bytes

PAGES = sorted(manual_pages.SOURCE.glob("*.md"))


def documented():
    """Return {doc_id: label} of everything of the add-on that Blender finds under the mouse pointer."""
    found = {}
    for cls in interface_strings.blender.CLASSES:
        entries = [e for e in interface_strings.properties_of(cls) if not e.is_hidden and e.name != e.identifier]
        if issubclass(cls, bpy.types.Operator):
            found[cls.bl_idname] = cls.bl_label
            category, name = cls.bl_idname.split(".")
            found |= {f"{category.upper()}_OT_{name}.{entry.identifier}": cls.bl_label for entry in entries}
        elif issubclass(cls, (bpy.types.PropertyGroup, bpy.types.AddonPreferences)):
            found |= {f"{cls.__name__}.{entry.identifier}": entry.name for entry in entries}
    # Blender looks up the name of any item in a list as that of a PropertyGroup.
    return {doc_id: label for doc_id, label in found.items() if doc_id not in {"VellusStyle.name", "VellusLayer.name"}}


def address(doc_id):
    """Return the address that Blender's own lookup opens."""
    rna_id = wm._wm_doc_get_id(doc_id, do_url=False)
    return wm.WM_OT_doc_view_manual._lookup_rna_url(rna_id, verbose=False)


@functools.cache
def headings(page):
    return re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.MULTILINE)


@functools.cache
def anchors(page):
    """Return {anchor: heading} of a page."""
    return {manual.anchor(title): title for title in headings(page)}


def heading_at(found):
    """Return the heading that an address leads to, or None."""
    file, _, fragment = (found or "").partition("#")
    page = Path(urllib.parse.unquote(urllib.parse.urlsplit(file).path))
    if page.suffix != ".md" or not page.is_file():
        return None
    return anchors(page).get(fragment)


def test_every_property_and_operator_leads_to_its_heading(monkeypatch):
    """Every property and operator leads to its heading by a line in blender/manual.py."""
    wanted, maps = documented(), [*bpy.utils.manual_map()]
    monkeypatch.setattr(bpy.utils, "manual_map", lambda: maps)  # made once for all addresses
    assert len(wanted) > 100
    assert {doc_id: heading_at(address(doc_id)) for doc_id in wanted} == wanted


def test_blender_opens_the_page(monkeypatch):
    opened = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    assert bpy.ops.wm.doc_view_manual(doc_id="VellusHairSettings.strand_count") == {"FINISHED"}
    assert opened == [(manual_pages.SOURCE / "strands.md").as_uri() + "#strand-count"]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_heading_of_a_setting_is_of_one_that_exists(page):
    _prefix, targets = manual.manual_map()
    wanted = {target.partition("#")[2] for _pattern, target in targets if target.startswith(f"{page.stem}.")}
    written = re.findall(r"^#### (.+)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    # The surface is a property of Blender's own; guides and strands share the switch that updates them.
    borrowed = {"surface": {"surface"}, "guides": {"auto-update"}}.get(page.stem, set())
    assert {manual.anchor(title) for title in written} == wanted | borrowed


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_headings_of_a_page_differ(page):
    anchors = [manual.anchor(title) for title in headings(page)]
    if page.stem == "surface":
        anchors.remove("surface")  # the page's own title, and the setting
    assert len(anchors) == len(set(anchors))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_has_a_picture_and_is_in_the_index(page):
    text = page.read_text(encoding="utf-8")
    pictures = [page.parent / name for name in re.findall(r"!\[[^\]]+\]\(([^)]+)\)", text)]
    assert pictures
    assert all(picture.parent == page.parent and picture.stat().st_size < LARGEST_PICTURE for picture in pictures)
    index = (page.parent / "index.md").read_text(encoding="utf-8")
    assert page.stem == "index" or f"]({page.name})" in index


def test_the_installed_pages_have_the_same_anchors_and_their_links_lead_somewhere(tmp_path):
    manual_pages.write(tmp_path / "manual")
    ids = {}
    for page in (tmp_path / "manual").glob("*.html"):
        text = page.read_text(encoding="utf-8")
        ids[page.name] = set(re.findall(r'id="([^"]+)"', text))
        assert {manual.anchor(title) for title in headings(manual_pages.SOURCE / f"{page.stem}.md")} <= ids[page.name]
    for page in (tmp_path / "manual").glob("*.html"):
        for link in re.findall(r'(?:href|src)="([^"]+)"', page.read_text(encoding="utf-8")):
            file, _, fragment = link.partition("#")
            assert (page.parent / (file or page.name)).is_file(), link
            assert not fragment or fragment in ids[file or page.name], link


def test_every_picture_has_one_script_that_draws_it():
    """Every picture has one script of `make pictures` that draws it, so that no picture shows an earlier version."""
    docs = manual_pages.SOURCE.parent
    drawn = {name: tuple(found.values()) for name, found in all_pictures.COPIED.items()} | all_pictures.OTHERS
    drawn["elsewhere"] = all_pictures.ELSEWHERE
    pictures = [path.relative_to(docs) for path in docs.rglob("*") if path.suffix in {".png", ".jpg"}]
    assert pictures
    scripts = {
        str(picture): [name for name, globs in drawn.items() if any(picture.full_match(glob) for glob in globs)]
        for picture in pictures
    }
    assert {picture: names for picture, names in scripts.items() if len(names) != 1} == {}
    assert set(drawn) - {"elsewhere"} <= set(all_pictures.SCRIPTS | all_pictures.SLOW)
