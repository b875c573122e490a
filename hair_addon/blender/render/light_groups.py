# SPDX-License-Identifier: GPL-3.0-or-later
"""Light groups of a view layer: a scene lit by some of its lights, and passes that sum to the picture."""

from dataclasses import replace

import numpy as np

from ..gpu import lights as blender_lights
from . import drawn_scene

_PREFIX = "Combined_"
REST = _PREFIX  # the pass of all light that is in no group, which is not written


def pass_names(view_layer):
    """Names of the passes of a view layer's light groups, as in Cycles."""
    return [f"{_PREFIX}{group.name}" for group in view_layer.lightgroups]


def is_of_group(name):
    """Whether a pass is the light of a group, or `REST`."""
    return name.startswith(_PREFIX)


def lit(drawn, passes):
    """Return {pass: `DrawnScene`} of each pass of a light group and of `REST`, without passes that have no light.

    passes: names, with groups in the order of the view layer.
    """
    names = [REST, *filter(is_of_group, passes)]
    if len(names) == 1:
        return {}
    found = {name: _of_group(drawn, group) for group, name in enumerate(names)}
    return {name: scene for name, scene in found.items() if _has_light(scene)}


def _has_light(drawn):
    return len(drawn.lamps.lamps) > 0 or bool(np.any(drawn.world.color))


def _of_group(drawn, group):
    """Return a `DrawnScene` with the light of one group, numbered as by `lights.group_of`."""
    lamps, has_world = drawn.lamps, drawn.world.group == group
    record, rest = lamps.record.copy(), lamps.rest.copy()
    for lights in (record["light"], rest):
        lights["power"][lights["group"] != group] = 0.0
    if not has_world:
        record["world"] = 0.0
    own = lamps.lamps[lamps.lamps["group"] == group]
    lamps = replace(lamps, record=record, rest=rest, lamps=own)
    world = drawn.world if has_world else blender_lights.World(np.zeros(3))
    return drawn_scene.with_lamps(replace(drawn, world=world), lamps)


def fitted(groups, picture):
    """Return {pass: (H, W, 3)} of groups, changed so that they sum to a picture (H, W, 3), if any of them has light.

    Groups differ from the picture by the noise of paths and by rounding.
    """
    total = sum(groups.values())
    factor = np.divide(picture, total, out=np.ones_like(total), where=total > 0.0)
    return {name: light * factor for name, light in groups.items()}
