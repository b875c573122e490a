# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands that do not fit the graphics driver's memory cause one message, also in the panel, and no retry."""

import bpy
import gpu
import pytest

from hair_addon.blender.gpu import driver_textures
from hair_addon.blender.host import running
from hair_addon.blender.render import drawn_scene, hair_cache, refused_strands
from hair_addon.core.errors import HairError
from tests.support.interface.layout import draw
from tests.support.pairs import share_of


@pytest.mark.parametrize("raised", share_of([RuntimeError, ValueError, MemoryError], 2))
def test_a_driver_that_refuses_a_texture_is_one_sentence(hair, raised, monkeypatch, capsys):
    tries, real = [], gpu.types.GPUTexture

    def refuse(size, format, **data):
        if format == "RG32F" and "data" in data:  # of strands
            tries.append(size)
            raise raised("gpu.texture.new(...) failed with 'GPUTexture: texture alloc failed.'")
        return real(size, format=format, **data)

    hair_cache.strand_cache.clear()
    monkeypatch.setattr(running, "has_window", lambda: True)
    monkeypatch.setattr(driver_textures.gpu.types, "GPUTexture", refuse)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for _redraw in range(3):
        drawn = drawn_scene.read(bpy.context.scene, bpy.context.view_layer, depsgraph, None, hair_cache.refuse)
        assert not drawn.hair
    assert len(tries) == 1
    assert bpy.app.timers.is_registered(refused_strands.show_in_panels), "they were drawn before"
    assert refused_strands.show_in_panels() is None
    bpy.app.timers.unregister(refused_strands.show_in_panels)
    reported = capsys.readouterr().err
    assert reported.count("Vellus: The graphics driver cannot allocate") == 1 and "decrease Strand Count" in reported
    assert "Traceback" not in reported
    shown = " ".join(draw(bpy.types.VELLUS_PT_interpolation).texts)
    assert "The graphics driver cannot allocate" in shown and "decrease Strand Count" in shown
    with pytest.raises(HairError, match="driver cannot allocate"):  # a picture that is asked for says it too
        hair_cache.strand_cache.clear()
        drawn_scene.read(bpy.context.scene, bpy.context.view_layer, depsgraph)
    monkeypatch.undo()
    hair_cache.strand_cache.clear()
    assert drawn_scene.read(bpy.context.scene, bpy.context.view_layer, depsgraph).hair
    assert refused_strands.error_of(hair_cache.strand_cache.get(hair.data.session_uid)) is None


def test_textures_beyond_what_any_driver_takes_are_refused(hair):
    """Textures beyond any driver's limits are refused with our message, as Blender raises errors of several classes."""
    with pytest.raises(HairError, match="cannot allocate 4000000 MB"):
        driver_textures.new_texture((1_000_000, 1_000_000), "R32F")
