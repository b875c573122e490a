# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: python -m hair_addon groom | bake-tables | render.

Exit status 0: done; 1: it failed, with one sentence on standard error; 2: the command was not understood.
"""

import argparse
import sys
from pathlib import Path

from .core.errors import HairError
from .core.groom import GuideSettings, HairSettings
from .core.params import declared, label_of
from .core.shading import lookup_tables

# Settings that the two stages share, or that a shorter word names better on a command line.
_OPTIONS = {"guide_count": "--guides", "strand_count": "--strands", "eta": "--ior"}


def main(arguments=None):
    """Run a verb; returns the exit status."""
    options = _parser().parse_args(arguments)
    try:
        options.run(options)
    except HairError as error:
        print(f"hair_addon: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("hair_addon: interrupted.", file=sys.stderr)
        return 1
    return 0


def _parser():
    parser = argparse.ArgumentParser(prog="python -m hair_addon", description="Hair on meshes, without a window.")
    verbs = parser.add_subparsers(required=True, metavar="VERB")

    groom = verbs.add_parser("groom", help="grow guides and hair on a mesh")
    groom.add_argument("input", type=Path, help=".obj, .ply, .stl, .glb or .blend with the mesh")
    groom.add_argument("--surface", default="", help="name of the mesh object; not needed where there is one")
    groom.add_argument("--out", type=Path, required=True, help=".blend, or .npz with the arrays")
    _add_settings(groom, GuideSettings)
    _add_settings(groom, HairSettings, skip={name for name, *_ in declared(GuideSettings)})
    groom.set_defaults(run=_groom)

    bake = verbs.add_parser("bake-tables", help="bake the Marschner model's tables to OpenEXR")
    bake.add_argument("--out", type=Path, required=True, help="folder for the tables: m.exr, n.exr, n_trt.exr, …")
    bake.add_argument("--plot", action="store_true", help="write a picture of each table too, with labelled axes")
    _add_settings(bake, lookup_tables.Settings)
    bake.set_defaults(run=_bake)

    render = verbs.add_parser("render", help="draw the hair of a .blend file from its camera")
    render.add_argument("input", type=Path, help=".blend file")
    render.add_argument("--out", type=Path, required=True, help=".png or .exr")
    render.add_argument("--width", type=int, default=1280, help="pixels")
    render.add_argument("--height", type=int, default=720, help="pixels")
    render.add_argument("--samples-per-side", type=int, default=4, help="4 gives 16 samples a pixel")
    render.add_argument("--transparent", action="store_true", help="leave the background empty")
    render.set_defaults(run=_render)
    return parser


def _add_settings(parser, settings_class, skip=()):
    """An option for each setting of a class, with its default and its tooltip."""
    for name, default, details in declared(settings_class):
        if name in skip:
            continue
        option = _OPTIONS.get(name, "--" + name.replace("_", "-"))
        described = {"dest": name, "default": default, "help": f"{label_of(name, details)}: {details.description}"}
        if isinstance(default, bool):
            parser.add_argument(option, action=argparse.BooleanOptionalAction, **described)
        elif isinstance(default, tuple):
            parser.add_argument(option, type=float, nargs=len(default), **described)
        elif details.choices:
            parser.add_argument(option, choices=[choice[0] for choice in details.choices], **described)
        else:
            parser.add_argument(option, type=type(default), **described)


def _settings(options, settings_class):
    values = {name: getattr(options, name) for name, _default, _details in declared(settings_class)}
    return settings_class(**{name: tuple(v) if isinstance(v, list) else v for name, v in values.items()})


def _groom(options):
    # Refuse what is wrong with the settings before Blender starts.
    guide_settings, hair_settings = _settings(options, GuideSettings), _settings(options, HairSettings)
    import warp as wp

    from .blender import batch

    wp.config.log_level = wp.LOG_WARNING  # which kernels it loads is nothing that a command's output should hold
    batch.groom(options.input, options.surface, guide_settings, hair_settings, options.out)


def _bake(options):
    settings = _settings(options, lookup_tables.Settings)
    from .blender import batch

    batch.bake_tables(settings, options.out, options.plot)


def _render(options):
    from .blender import batch, render

    settings = render.PictureSettings(
        options.width, options.height, options.samples_per_side, is_transparent=options.transparent
    )
    batch.render(options.input, settings, options.out)


if __name__ == "__main__":
    sys.exit(main())
