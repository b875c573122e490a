# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the simulation of guides: material, forces, shape, collision, solver.

Settings are in SI units, so motion does not depend on the number of vertices, the frame rate or the number of substeps.
"""

from dataclasses import dataclass

from ...params import Settings, declared, param


@dataclass(frozen=True)
class DynamicsSettings(Settings):
    """Settings of simulated guides: material, forces, collision and solver."""

    bend_stiffness: float = param(
        8.0,
        "Stiffness of bending, as a multiple of one fiber's; a guide stands for a wisp of hair, which is stiffer the"
        " more its fibers stick together",
        low=1e-3,
        high=1e4,
        soft_high=1e3,
        may_vary=True,
    )
    twist_stiffness: float = param(
        1.0, "Stiffness of twisting, as a multiple of the value for the stiffness of bending", low=1e-3, high=1e3
    )
    stretch_stiffness: float = param(
        1.0,
        "Stiffness of stretching, relative to real hair; at 1 hair does not stretch, lower values are for cartoons",
        low=1e-5,
        high=1.0,
        precision=5,
    )
    tip_stiffness: float = param(
        1.0, "Stiffness of bending and twisting at the tip, as a multiple of that at the root", low=0.0, high=4.0
    )
    damping: float = param(
        0.005,
        "Time in seconds over which bending and twisting are damped; higher values stop vibration sooner",
        low=0.0,
        high=0.5,
        precision=4,
        may_vary=True,
    )
    weight: float = param(
        1.0, "Weight of the hair, as a multiple of the weight of its fibers", low=0.1, high=10.0, soft_high=4.0
    )
    wetness: float = param(
        0.0,
        "Water in the hair; higher values make hair heavier and softer, let it clump, and reduce air drag",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
    )
    youngs_modulus: float = param(
        4.0,
        "Young's modulus of a fiber in GPa; higher values make hair harder to bend and stretch",
        label="Young's modulus",
        above=0.0,
        high=1e3,
        soft_high=20.0,
    )
    shear_modulus: float = param(
        0.9,
        "Shear modulus of a fiber in GPa; higher values make hair harder to twist",
        above=0.0,
        high=1e3,
        soft_high=20.0,
    )
    fibre_radius: float = param(
        4e-5,
        "Radius of a fiber in meters, independent of scene units; thicker fibers are stiffer for their weight",
        label="Fiber radius",
        low=1e-6,
        high=1e-2,
        soft_high=1e-3,
        precision=6,
    )
    density: float = param(1300.0, "Density of a fiber in kg/m³", low=1.0, high=1e5, soft_high=4e3, precision=1)
    gravity: float = param(1.0, "Multiple of the scene's gravity", low=-100.0, high=100.0, soft_high=2.0)
    air_drag: float = param(1.0, "Multiple of the drag of the air", low=0.0, high=1e3, soft_high=10.0)
    force_fields: float = param(1.0, "Multiple of the scene's force fields", low=-1e3, high=1e3, soft_high=10.0)
    inertia: float = param(
        1.0,
        "Fraction of the surface's rigid motion that affects the hair; lower values calm hair on fast characters",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
    )
    hold: float = param(
        0.0,
        "Strength of the pull back to the combed shape in 1/s²",
        low=0.0,
        high=1e4,
        soft_high=1e3,
        precision=1,
        may_vary=True,
    )
    hold_tip: float = param(
        1.0,
        "Strength of the pull to the combed shape at the tip, as a fraction of that at the root",
        label="Tip hold",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
    )
    sag_free: bool = param(
        True, "Let the combed shape be at rest under gravity, so that it does not sag", label="Sag-Free"
    )
    pinned: float = param(
        0.0,
        "Fraction of each guide, from the root, that only follows the surface",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
        may_vary=True,
    )
    holds_ties: bool = param(
        True, "Let gathered hair only follow the surface up to its tie; behind the tie it swings", label="Hold ties"
    )
    collides_with_surface: bool = param(
        True, "Keep the hair outside the surface it grows on", label="Collide with surface"
    )
    colliders: str = param("", "Collection of the meshes that the hair collides with")
    keeps_hair_outside: bool = param(
        False,
        "Keep the hair between guides outside too, in renders and exports; while playing, hair may pass through",
        label="Keep hair outside",
    )
    collision_distance: float = param(
        1e-3,
        "Distance that the hair keeps from colliders",
        low=0.0,
        high=1e3,
        soft_high=0.02,
        unit="LENGTH",
        subtype="DISTANCE",
        precision=4,
    )
    friction: float = param(0.3, "Coefficient of friction on colliders", low=0.0, high=2.0)
    hair_friction: float = param(
        2.0, "Friction between strands in 1/s; higher values make hair move together", low=0.0, high=1e3, soft_high=20.0
    )
    hair_pressure: float = param(
        0.5, "Pressure between strands in m²/s² that keeps the volume of the hair", low=0.0, high=1e3, soft_high=10.0
    )
    cell_size: float = param(
        0.0,
        "Size of the cells in which friction and pressure between strands are computed; 0 is automatic",
        low=0.0,
        high=1e3,
        soft_high=0.1,
        unit="LENGTH",
        subtype="DISTANCE",
        precision=4,
    )
    vertex_count: int = param(
        25,
        "Number of points of a simulated guide; curls need about 12 for each turn",
        label="Points per guide",
        low=4,
        high=65,
    )
    automatic_substeps: bool = param(True, "Use more substeps in frames of fast motion")
    substeps: int = param(4, "Minimum number of simulation steps for each frame", low=1, high=64)
    teleport_distance: float = param(
        1.0,
        "Distance in meters that a root may move in a frame; with larger jumps the hair moves along unchanged",
        above=0.0,
        high=1e6,
        soft_high=10.0,
    )
    time_scale: float = param(1.0, "Multiple of the speed of time", low=0.0, high=100.0, soft_high=4.0)
    preroll: int = param(
        0,
        "Number of frames to simulate before the first one, with the surface at rest",
        low=0,
        high=10_000,
        soft_high=250,
    )
    start_frame: int = param(1, "First frame, which shows the hair as combed", low=-(2**20), high=2**20)
    size: float = param(
        1.0,
        "Real size as a multiple of the modeled size; decrease it for characters modeled larger than life",
        above=0.0,
        high=1e6,
    )


# Settings that may differ between guides: {name: its `Param`}.
VARIED = {name: details for name, _default, details in declared(DynamicsSettings) if details.may_vary}
