# SPDX-License-Identifier: GPL-3.0-or-later
"""The redo panel of Use as Guides."""

import bpy
import pytest

from tests.support.interface.layout import redo_panel
from tests.support.reading import snapshot


@pytest.mark.parametrize("name", ["use_as_guides", "use_as_hair"])
def test_the_redo_panel_is_there_after_a_run(imported, name):
    """The redo panel of Use as Guides is shown after a run, as `poll` accepts the result that Blender undoes to run
    again.
    """
    bpy.context.view_layer.objects.active = imported
    operator = getattr(bpy.ops.vellus, name)
    assert operator("EXEC_DEFAULT", True) == {"FINISHED"}
    assert operator.poll()
    before = snapshot()
    with pytest.raises(RuntimeError, match="is already guides or hair"):  # a click on the button that it shows by then
        operator("EXEC_DEFAULT", True)
    assert snapshot() == before
    bpy.ops.object.select_all("EXEC_DEFAULT", True, action="SELECT")
    assert not operator.poll()


@pytest.mark.parametrize("grows_hair", [True, False])
def test_the_redo_panel_draws_what_has_an_effect(imported, grows_hair):
    bpy.context.view_layer.objects.active = imported
    drawn = redo_panel("use_as_guides", grows_hair=grows_hair).drawn
    assert {drawn[name] for name in ("surface", "every", "applies_modifiers", "grows_hair")} == {1}
    assert drawn["strand_count"] == drawn["neighbour_limit"] == grows_hair
