# SPDX-License-Identifier: GPL-3.0-or-later
"""Force fields of a scene → `ForceField`s, as Blender's Python API cannot evaluate force fields."""

import numpy as np

from ....core import dynamics
from ....core.errors import HairError
from ...host.notices import name_of

# Types that do not act on hair, which are ignored without an error.
_OF_OTHERS = {"NONE", "BOID", "GUIDE", "FLUID_FLOW"}


def read(depsgraph, meters):
    """Return (`ForceField`s of the objects in a depsgraph, errors of unsupported force fields).

    meters: per unit of the world.
    """
    fields, errors = [], []
    for evaluated in depsgraph.objects:
        settings = evaluated.field
        if settings is None or settings.type in _OF_OTHERS:
            continue
        if settings.type not in dynamics.air.KINDS or settings.shape not in dynamics.air.SHAPES:
            sentence = 'The force field "{name}" does not act on hair: its type or shape is not supported.'
            errors.append(HairError(sentence, name=name_of(evaluated)))
            continue
        field = _field_of(evaluated, settings, meters)
        problem = field.problem()
        if problem is None:
            fields.append(field)
        else:
            sentence = 'The force field "{name}" does not act on hair: {cause}.'
            errors.append(HairError(sentence, name=name_of(evaluated), cause=problem))
    return tuple(fields), errors


def _field_of(evaluated, settings, meters):
    matrix = np.array(evaluated.matrix_world, np.float64)
    x, y, z = meters * matrix[:3, 3]
    axis = matrix[:3, 2]
    is_drag, is_cone = settings.type == "DRAG", settings.falloff_type == "CONE"
    beside = 1.0 if is_cone else meters  # an angle, or a distance

    def limit(is_used, value, unit):
        return unit * value if is_used else None

    return dynamics.air.ForceField(
        settings.type,
        (x, y, z),
        (float(axis[0]), float(axis[1]), float(axis[2])),
        settings.linear_drag if is_drag else settings.strength,
        settings.flow,
        settings.shape,
        settings.falloff_type,
        settings.z_direction,
        settings.falloff_power,
        limit(settings.use_min_distance, settings.distance_min, meters),
        limit(settings.use_max_distance, settings.distance_max, meters),
        settings.radial_falloff,
        limit(settings.use_radial_min, settings.radial_min, beside),
        limit(settings.use_radial_max, settings.radial_max, beside),
        settings.use_gravity_falloff,
        meters * settings.size,
        settings.use_global_coords,
        settings.seed,
    )
