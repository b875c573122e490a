# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on draws its preferences, as Blender leaves that to it."""

from types import SimpleNamespace

from hair_addon.blender.settings.preferences import VellusPreferences


def test_every_preference_has_a_row(blender):
    rows = []
    layout = SimpleNamespace(prop=lambda _of, name: rows.append(name))
    VellusPreferences.draw(SimpleNamespace(layout=layout), None)
    properties = VellusPreferences.bl_rna.properties.keys()
    assert set(rows) == set(properties) - {"rna_type", "bl_idname"}
