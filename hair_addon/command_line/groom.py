# SPDX-License-Identifier: GPL-3.0-or-later
"""groom: a mesh → guides and hair."""

import contextlib
import time
from dataclasses import replace

from ..core import lazy
from ..core.errors import HairError
from ..core.grooming.derived_guides import DerivationSettings
from ..core.grooming.groom import GuideSettings, HairSettings
from ..core.long_work import run_now
from ..core.mesh_hair.mesh_strand_settings import MeshStrandSettings
from ..core.params import declared
from ..core.shading.presets import PRESETS
from . import curve_options, import_mesh, map_options, opening, options, style_options

blender = lazy.Package("..blender", __package__)

_SHARED = {name for name, *_ in declared(GuideSettings)} & {name for name, *_ in declared(HairSettings)}

# Settings of guides only.
_OF_GUIDES = [setting for setting in declared(GuideSettings) if setting[0] not in _SHARED]

# Settings of growing hair. Imported hair has only a look and a number of derived guides.
_OF_GROWTH = [s for s in (*declared(GuideSettings), *declared(HairSettings)) if s[0] != "guide_count"]


def add(verbs):
    """Add the command's options."""
    parser = verbs.add_parser("groom", help="grow guides and hair on a mesh")
    parser.add_argument("input", help="file with the mesh: .blend .obj .ply .stl .glb .gltf .vrm .fbx .usd* .abc")
    parser.add_argument("--out", required=True, help=".blend, .usd*, .abc, or .npz with the arrays")
    parser.add_argument("--surface", default="", metavar="NAME", help="mesh object; needed if the file has several")
    curve_options.add_axis(parser)
    parser.add_argument("--preset", choices=PRESETS, metavar="NAME", help=f"a look: {', '.join(PRESETS)}")
    curve_options.add_curves(parser)
    parser.add_argument(
        "--from-library", metavar="FILE[:NAME]", help="apply a groom from a .blend file of an asset library"
    )
    style_options.add_styles(parser, has_surface=True)
    map_options.add_maps(parser)
    options.add_scripts(parser)
    options.add_groom_settings(parser)
    options.add_common(parser)
    parser.set_defaults(run=run)


def run(given, console):
    """Read the mesh, grow the hair and write it."""
    settings = options.groom_settings(given)
    if given.preset:
        look = replace(PRESETS[given.preset][1], mode=settings.appearance.mode)
        settings = options.changed_groom(replace(settings, appearance=look), given)
    _require_usable(given)
    file_axes = opening.open_file(given, console)
    surface = blender.io.mesh_files.find_surface(given.surface)
    settings = map_options.mapped(given, _styled(given, settings, surface))
    started = time.perf_counter()
    systems = _systems(given, surface, settings, file_axes, console)
    guides, hair = systems[0]
    _warn_of_styles(given, hair, console)
    seconds = time.perf_counter() - started
    console.progress("Writing", 1.0)
    blender.io.groom_files.write(given.out, guides, hair, file_axes)
    _report(given, surface, systems, seconds, console)


def _require_usable(given):
    """Raise `HairError` for contradictory options, and for files that cannot be read or written."""
    came_from = curve_options.checked(given)
    if given.from_library and (came_from or given.from_mesh or given.from_particles or given.settings):
        raise HairError(
            "--from-library includes guides and settings: leave out --guides-from, --hair-from, --from-mesh, "
            "--from-particles and --settings."
        )
    if came_from:
        blender.io.curve_files.require_readable(came_from)
    blender.io.mesh_files.require_readable(given.input)
    blender.io.groom_files.require_writable(given.out)


def _systems(given, surface, settings, file_axes, console):
    """Return [(guides, hair)] of all hair systems that the options ask for."""
    if given.from_library:
        return [_from_library(given, surface, console)]
    if given.from_mesh:
        return [_of_mesh(given, surface, settings, console)]
    if given.from_particles:
        with blender.groom.foreign.particle_hair.as_curves(surface) as made:
            use = _follow_curves if given.from_particles == "GUIDES" else _keep_curves
            return [use(given, surface, settings, blender.io.curve_files.Found(made), console)]
    if given.guides_from or given.hair_from:
        use = _follow_curves if given.guides_from else _keep_curves
        with _curves_of("GUIDES" if given.guides_from else "HAIR", given, surface, file_axes, console) as groups:
            return [use(given, surface, settings, found, console) for found in groups]
    return [_grow(surface, settings, console)]


def _report(given, surface, systems, seconds, console):
    """Print the numbers of guides, strands and points that were written."""
    counts = {
        "guides": sum(len(one.curves) for one, _ in systems),
        "strands": sum(len(one.curves) for _, one in systems),
    }
    if given.by_group:
        counts["systems"] = len(systems)
    values = {"verb": "groom", "input": str(given.input), "surface": surface.name, "out": str(given.out), **counts}
    values |= {
        "points": sum(len(one.points) for _, one in systems),
        "seconds": round(seconds, 3),
        "bytes": given.out.stat().st_size,
    }
    made = f"{counts['guides']} guides, {counts['strands']} strands on {surface.name}"
    console.result(values, f"{made} in {seconds:.2f} s: {given.out}")


def _styled(given, settings, surface):
    """Return `GroomSettings` with the styles of the options, fitted to a mesh object."""

    def fit():
        return blender.groom.styles.hair_styles.fit_of(surface, settings.guides, settings.hair)

    if given.no_style_fit and not (given.style_preset or given.styles):
        raise HairError("--no-style-fit needs --style or --style-preset.")
    styled = style_options.styled(given, settings, None if given.no_style_fit else fit)
    return options.changed_groom(styled, given)


def _grow(surface, settings, console):
    """Return (guides, hair) that grow on a mesh object."""
    warning = blender.data.usable_surfaces.inside_out_warning(surface)
    if warning is not None:
        console.warn(warning[0].format(**warning[1]))
    depsgraph = blender.data.scene.present_depsgraph()
    work = blender.groom.transfer.groom_settings.adding_hair(surface, settings, depsgraph)
    return run_now(work, console.progress)


def _from_library(given, surface, console):
    """Return (guides, hair) of a saved groom with the settings that options give."""
    path, name = blender.io.groom_library.path_and_name(str(given.from_library))
    groom = blender.io.groom_library.read(path, name)

    def changed(settings):
        if given.preset:
            settings = replace(settings, appearance=replace(PRESETS[given.preset][1], mode=settings.appearance.mode))
        return map_options.mapped(given, _styled(given, settings, surface))

    depsgraph = blender.data.scene.present_depsgraph()
    work = blender.groom.transfer.library_groom.adding_groom(surface, groom, depsgraph, changed=changed)
    applied = run_now(work, console.progress)
    for sentence, values in applied.notes():
        console.warn(sentence.format(**values))
    return applied.made.guides, applied.made.hair


def _follow_curves(given, surface, settings, found, console):
    """Return (guides, hair) from the curves of a `Found`."""
    _warn_of_useless(
        options.options_given(given, _OF_GUIDES), f"Guides come from {curve_options.source(given)}", console
    )
    work = blender.groom.transfer.groom_settings.using_as_guides(
        found.curves, surface, settings, blender.data.scene.present_depsgraph()
    )
    made = run_now(work, console.progress)
    for sentence, values in made.notes():
        console.warn(sentence.format(**values))
    return made.guides, made.hair


def _keep_curves(given, surface, settings, found, console):
    """Return (guides, hair) with the curves of a `Found` as hair.

    Guides are those of the hair in that file, or are derived from the hair.
    """
    useless = options.options_given(given, _OF_GROWTH) + (["--style"] if given.styles else [])
    useless += ["--style-preset"] if given.style_preset else []
    _warn_of_useless(useless, f"Hair is kept as it came from {curve_options.source(given)}", console)
    if found.guides is not None:
        counts = options.options_given(given, [("guide_count",)])
        _warn_of_useless(counts, f"Guides come from {given.hair_from} too", console)
    work = blender.groom.foreign.kept_hair.using_as_hair(
        found.curves,
        surface,
        blender.data.scene.present_depsgraph(),
        DerivationSettings(guide_count=settings.guides.guide_count),
        guides_object=found.guides,
    )
    made = run_now(work, console.progress)
    for sentence, values in made.notes():
        console.warn(sentence.format(**values))
    if found.guides is None:
        error, high = 100.0 * made.mean_error, 100.0 * made.high_error
        console.warn(f"The guides reproduce the strands to {error:.1f}% (95%: {high:.1f}%) of their length.")
    if found.motion is not None:
        _play(given, made, found, console)
    _assign(made, settings)
    blender.groom.transfer.groom_settings.assign_look(made.hair, settings.appearance)
    return made.guides, made.hair


def _of_mesh(given, surface, settings, console):
    """Return (guides, hair) of a mesh of cards, tubes or locks in the open file."""
    useless = options.options_given(given, [s for s in _OF_GROWTH if s[0] not in ("strand_count", "seed")])
    useless += (["--style"] if given.styles else []) + (["--style-preset"] if given.style_preset else [])
    _warn_of_useless(useless, f"Strands follow the mesh {given.from_mesh}", console)
    mesh_object = blender.io.mesh_files.find_surface(given.from_mesh)
    wanted = MeshStrandSettings(
        strand_count=settings.hair.strand_count,
        seed=settings.hair.seed,
        root_end=given.mesh_roots or "SURFACE",
        fills=given.fill_thickness,
    )
    work = blender.io.mesh_hair.using_mesh(
        mesh_object,
        surface,
        blender.data.scene.present_depsgraph(),
        wanted,
        DerivationSettings(guide_count=settings.guides.guide_count),
    )
    made = run_now(work, console.progress)
    for sentence, values in made.notes():
        console.warn(sentence.format(**values))
    own, look = blender.groom.transfer.groom_settings.maps_of(made.hair), settings.appearance
    if own:  # the colors of the mesh
        present = blender.settings.properties.own_look_of(made.hair.vellus)
        look = replace(look, parametrization="COLOR", color=present.color)
    maps = {one.setting: one for one in (*own, *settings.maps)}
    _assign(made, replace(settings, maps=tuple(maps.values())))
    blender.groom.transfer.groom_settings.assign_look(made.hair, look)
    return made.guides, made.hair


def _assign(made, settings):
    """Assign maps, thickness and dynamics of `GroomSettings` to hair and guides."""
    blender.groom.transfer.groom_settings.assign_maps(made.hair, settings.maps)
    blender.groom.transfer.groom_settings.assign_thickness_curve(made.hair, settings.thickness_curve)
    blender.groom.transfer.groom_settings.assign_dynamics(made.guides, settings.dynamics)


def _play(given, made, found, console):
    """Write the frames of moving curves to a file beside the output .blend, which the hair plays."""
    path = blender.io.played_hair.path_beside(given.out, made.hair)
    order = made.rooted.point_order(found.starts)
    count = blender.io.played_hair.playing(made.hair, found.motion, order, path)(console.progress)
    console.warn(f"{given.hair_from} moves: the hair plays its {count} frames from {path}, and does not follow guides.")


def _warn_of_useless(names, reason, console):
    if names:
        has = "has" if len(names) == 1 else "have"
        console.warn(f"{reason}: {', '.join(names)} {has} no effect.")


def _warn_of_styles(given, hair, console):
    """Warn of maps and curves of styles that hair Curves do not have."""
    names = ", ".join(blender.settings.style_items.names_of(hair.vellus))
    reason = f"The hair has only the styles {names}" if names else "The hair has no styles"
    _warn_of_useless(map_options.without_effect(given, hair), reason, console)


@contextlib.contextmanager
def _curves_of(kind, given, surface, file_axes, console):
    """Context with [`Found`], one for each hair system, of a curve file, or of the open file; prints its notes."""
    path = given.guides_from or given.hair_from
    wanted = curve_options.wanted(kind, given, file_axes)
    is_open = path.resolve() == given.input.resolve()
    if not is_open:
        import_mesh.try_curves(path, console)
    with contextlib.ExitStack() as stack:
        if given.by_group:
            groups = blender.io.curve_files.groups_of(path, wanted, surface)
        else:
            groups = [stack.enter_context(blender.io.curve_files.curves_of(path, wanted, surface, is_open))]
        for note in (note for found in groups for note in found.notes):
            console.warn(str(note))
        yield groups
