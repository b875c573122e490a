# SPDX-License-Identifier: GPL-3.0-or-later
"""Styles on 100,000 strands of 41 points: beside copying their memory, and beside Blender's own nodes, in one run."""

import bpy
import pytest
import warp as wp

import hair_addon
from hair_addon.blender.live import invalidation, live_hair
from hair_addon.core.grooming import following
from hair_addon.core.styling import clump, curl, frizz, kinds, steps
from tests.benchmarks import hair_peers
from tests.benchmarks.test_hair_speed import best_times, report
from tests.support.strands.styled import head

STRAND_COUNT = 100_000
THREE = (clump.Settings(levels=1), curl.Settings(), frizz.Settings())
ON_STRANDS = [kind for kind in kinds.KINDS if kind not in {"LEAN", "WET"}]
BLENDERS = {
    "Clump": [("Clump Hair Curves", {})],
    "Curl": [("Curl Hair Curves", {"Subdivision": 0, "Radius": 0.005, "Frequency": 5.0})],
    "Noise": [("Hair Curves Noise", {"Distance": 0.005})],
}
BLENDERS["Clump + Curl + Noise"] = [asset for assets in list(BLENDERS.values()) for asset in assets]


@pytest.fixture(scope="module")
def hair():
    return head(STRAND_COUNT, hair_peers.GUIDE_COUNT, device="cpu")


def styling_calls(hair, stacks):
    """Return {name: function} that styles existing points; "copy" copies the points."""
    plain = following.follow_guides(hair.binding, hair.guides).points
    points = wp.clone(plain)
    calls = {"copy": lambda: wp.copy(points, plain)}
    weights = following.weights_now(hair.binding, hair.guides)
    for name, styles in stacks.items():
        bound = hair.bound(*styles)
        following.strands_now(hair.binding, bound.guides(hair.guides), weights, bound)  # centers, and what compiles
        calls[name] = lambda bound=bound: steps.apply_steps(points, bound.program, bound.data, bound.axes)
    return calls


@pytest.mark.long
def test_each_style_beside_copying(hair):
    """Each style is compared with a style that trims nothing, which reads and writes all points."""
    stacks = {kind: (kinds.KINDS[kind](),) for kind in ON_STRANDS} | {"CLUMP": THREE[:1], "Clump, Curl, Frizz": THREE}
    stacks |= {"two levels of Clump": (clump.Settings(levels=2),)}
    times = best_times(styling_calls(hair, stacks), 7)
    asked = dict.fromkeys(ON_STRANDS, "15 and reading")
    ratios = report("Styles", STRAND_COUNT, times, asked, "copy")
    assert max(ratios[kind].work for kind in ON_STRANDS) < 30.0


@pytest.mark.long
def test_styles_beside_blender(hair):
    """Styles are compared with Blender's assets on poly lines; the time of an update without the assets is
    subtracted.
    """
    hair_addon.register()
    _surface, guides = hair_peers.head_with_guides()
    strands = hair_peers.Ours.grown(guides, STRAND_COUNT).hair
    strands.data.vellus.is_live = False
    live_hair.write_all()
    live_hair.cancel_writing()
    invalidation.data_replaced()
    hair_addon.unregister()

    def update():
        strands.update_tag()
        strands.data.update_tag()
        bpy.context.view_layer.update()

    times = best_times({"without": update}, 3)
    for name, assets in BLENDERS.items():
        for asset, inputs in assets:
            add_modifier(strands, asset, inputs)
        times |= best_times({f"Blender's {name}": update}, 2)
        strands.modifiers.clear()
    times["ours: Clump, Curl, Frizz"] = best_times(styling_calls(hair, {"three": THREE}), 7)["three"]
    whole = "Blender's Clump + Curl + Noise"
    ratios = report("Styles beside Blender's", STRAND_COUNT, times, {whole: 60}, "ours: Clump, Curl, Frizz")
    assert ratios[whole].work - ratios["without"].work > 30.0


def add_modifier(strands, asset, inputs):
    """Add one of Blender's hair assets as a modifier of a Curves object."""
    if asset not in bpy.data.node_groups:
        folder = bpy.utils.system_resource("DATAFILES", path="assets/nodes")
        with bpy.data.libraries.load(folder + hair_peers.NODE_ASSETS, link=False) as (_there, here):
            here.node_groups = [asset]
    modifier = strands.modifiers.new(asset, "NODES")
    modifier.node_group = bpy.data.node_groups[asset]
    sockets = modifier.node_group.interface.items_tree
    identifiers = {socket.name: socket.identifier for socket in sockets if getattr(socket, "in_out", "") == "INPUT"}
    for name, value in inputs.items():
        getattr(modifier.properties.inputs, identifiers[name]).value = value
