# SPDX-License-Identifier: GPL-3.0-or-later
"""Overridden hair keeps its own dynamics, which Blender stores; all other changes are refused, and it is drawn and
played.
"""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.render import hair_cache
from tests.support.dynamics.following import update
from tests.support.overridden import override, override_keyed, parts, reopen
from tests.support.reading import evaluated_points, points, snapshot

REFUSED = "is a library override: make it local first"


@pytest.fixture
def styled(hair):
    """Return hair with styles of the character's file."""
    api.set_styles(hair.data, [api.Clump(size=0.2), api.Curl(radius=0.02)])
    update()
    return hair


def state_of(part):
    """Return everything that a groom stores in Curves."""
    state = part.data.vellus
    kinds = [style.kind for style in state.styles]
    groups = [[getattr(group, name) for name in group.keys()] for group in (state.guides, state.hair, state.appearance)]
    attributes = sorted(part.data.attributes.keys())
    return kinds, str(groups), state.model, state.is_drawn, state.active_style, attributes, points(part).tobytes()


CHANGES = {
    "length": lambda guides, hair: api.change_guides(guides, "LENGTH", method="MAXIMUM", length=0.05),
    "count": lambda guides, hair: api.change_guides(guides, "COUNT", guide_count=12),
    "mirror": lambda guides, hair: api.change_guides(guides, "MIRROR"),
    "copy": lambda guides, hair: api.change_guides(guides, "COPY"),
    "drape": lambda guides, hair: api.change_guides(guides, "DRAPE"),
    "a style": lambda guides, hair: api.add_style(hair, "FRIZZ"),
    "styles": lambda guides, hair: api.set_styles(hair, [api.Clump(size=0.3), api.Curl(radius=0.01)]),
    "a style preset": lambda guides, hair: api.apply_style_preset(hair, "WAVY"),
    "a look": lambda guides, hair: api.shade(hair, "BLOND"),
    "a model": lambda guides, hair: api.shade(hair, model="KAJIYA_KAY"),
    "settings": lambda guides, hair: api.apply_settings(hair, api.GroomSettings()),
}

OPERATORS = {
    "HAIR": {
        "interpolate_hair": {"strand_count": 500},
        "apply_preset": {"preset": "BLOND"},
        "toggle_drawing": {},
        "add_style": {},
        "remove_style": {},
        "duplicate_style": {},
        "move_style": {},
        "use_points": {},
        "paint_style_mask": {},
        "mask_from_selection": {},
        "delete_hair": {},
        "use_uv_map": {},
    },
    "GUIDES": {
        "distribute_guides": {"guide_count": 60},
        "comb_guides": {},
        "guide_length": {},
        "smooth_guides": {},
    },
}


def test_what_a_library_override_would_lose_is_refused_before_anything_changes(styled, tmp_path):
    override(styled, tmp_path)
    _sphere, guides, hair = parts()
    before = snapshot(), state_of(guides), state_of(hair)

    def require_refused(name, change, error):
        with pytest.raises(error, match=REFUSED):
            change()
        assert (snapshot(), state_of(guides), state_of(hair)) == before, name

    for name, change in CHANGES.items():
        require_refused(name, lambda change=change: change(guides.data, hair.data), api.HairError)
    for part, operators in ((hair, OPERATORS["HAIR"]), (guides, OPERATORS["GUIDES"])):
        bpy.context.view_layer.objects.active = part
        for name, given in operators.items():
            operator = getattr(bpy.ops.vellus, name)
            require_refused(name, lambda operator=operator, given=given: operator(**given), RuntimeError)
    update()
    assert hair.data.vellus.status == guides.data.vellus.status == ""


def test_what_scripts_set_resizes_no_hair_of_a_library_override(styled, tmp_path):
    override(styled, tmp_path)
    _sphere, guides, hair = parts()
    hair.data.vellus.hair.strand_count = 30
    guides.data.vellus.guides.guide_count = 20
    update()
    assert (len(hair.data.curves), len(guides.data.curves)) == (500, 60)
    assert hair.data.vellus.status == '"Hair" keeps the 500 strands of its file: change them there.'
    assert guides.data.vellus.status == '"Guides" keeps the 60 guides of its file: change them there.'


def test_what_scripts_set_in_a_library_override_is_reported_when_a_file_is_saved(styled, tmp_path, capsys):
    """Blender does not save settings of a library override, so the next file has the hair of before."""
    override(styled, tmp_path)
    _sphere, guides, hair = parts()
    guides.data.vellus.dynamics.damping = 0.7  # is saved
    bpy.ops.wm.save_mainfile()
    assert "does not store" not in capsys.readouterr().err and hair.data.vellus.status == ""
    before, hair.data.vellus.styles[1].curl.radius = points(hair), 0.06
    update()
    changed = points(hair)
    reopen(tmp_path)
    assert '"Hair" is a library override: the file does not store its other settings.' in capsys.readouterr().err
    reopened = points(parts()[2])
    assert np.abs(changed - before).max() > 0.01 and np.abs(reopened - before).max() < 1e-5


def test_settings_of_local_guides_are_saved_with_a_library_override(styled, tmp_path, capsys):
    """Hair may be an override while its guides were made local: their settings are in the file."""
    override(styled, tmp_path)
    _sphere, guides, hair = parts()
    guides.data.make_local()
    guides = hair.data.vellus.guide_curves
    assert guides.override_library is None and hair.data.override_library is not None
    guides.vellus.guides.gravity = 0.9
    update()
    bpy.ops.wm.save_mainfile()
    assert "does not store" not in capsys.readouterr().err and hair.data.vellus.status == ""


def test_a_library_override_is_read_drawn_and_given_to_other_meshes(styled, tmp_path):
    override(styled, tmp_path)
    sphere, guides, hair = parts()
    before = points(hair)
    assert hair_cache.strands_on_gpu(hair.data).strand_count == len(api.points(hair.data)) == 500
    assert len(api.styles_of(hair.data)) == 2 and api.settings_of(hair.data).hair.strand_count == 500
    sphere.location.x = 2.0
    update()
    np.testing.assert_allclose(evaluated_points(hair), before, atol=1e-6)
    assert hair.data.vellus.status == guides.data.vellus.status == ""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, radius=1.2, location=(5.0, 0.0, 0.0))
    made = api.transfer_groom(hair.data, bpy.context.object)
    name, there = made.hair.name, api.points(made.hair)
    reopen(tmp_path)
    np.testing.assert_allclose(api.points(bpy.data.hair_curves[name]), there, atol=1e-5)


def test_keys_of_a_library_override_play(styled, tmp_path):
    override_keyed(styled, tmp_path, 1, (0.02, 0.05))


def test_made_local_it_is_changed_and_kept(styled, tmp_path):
    override(styled, tmp_path)
    _sphere, guides, hair = parts()
    for part in (guides, hair):
        bpy.ops.object.select_all(action="DESELECT")
        part.select_set(True)
        bpy.ops.object.make_local(type="SELECT_OBDATA")
    guides, hair = (
        next(c for c in bpy.data.hair_curves if c.library is None and c.vellus.kind == kind)
        for kind in ("GUIDES", "HAIR")
    )
    assert api.change_guides(guides, "LENGTH", method="MAXIMUM", length=0.05) == 60
    api.set_styles(hair, [api.Frizz()])
    hair.vellus.hair.strand_count = 30
    update()
    there = api.points(hair)
    assert len(there) == 30 and hair.vellus.status == ""
    reopen(tmp_path)
    hair = next(c for c in bpy.data.hair_curves if c.library is None and c.vellus.kind == "HAIR")
    np.testing.assert_allclose(api.points(hair), there, atol=1e-6)
    assert api.styles_of(hair) == (api.Frizz(),)
