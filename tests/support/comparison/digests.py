# SPDX-License-Identifier: GPL-3.0-or-later
"""Digests of the results of many grooms, to detect whether a code change alters a single bit.

    .venv/bin/python tests/support/comparison/digests.py --out before.json
    .venv/bin/python tests/support/comparison/digests.py --compare before.json     prints what differs, and exits with 1

Strands, attributes, settings, materials, tables, pictures and files have an SHA-256 each, under a name such as
`head/strands/attribute/radius`. The first part of the name is a groom of grooms.py or of outputs.py, or `commands`;
--case selects some of them.

Only public names are used: `register`, `hair_addon.api`, operators, properties, the command line. So files of the
add-on can move without changes here. Digests are computed on the processor; a reference is valid for one machine with
one version of Blender, Warp and the graphics driver, which the file states. It takes half a minute if kernels and
shaders are compiled; the kernels of a moved module are compiled again.
"""

import argparse
import hashlib
import json
import os
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

import bpy
import gpu
import numpy as np
import OpenEXR
import warp

import hair_addon
from hair_addon import api
from tests.support.comparison import grooms, outputs

# Member, NumPy type and width of an attribute's values.
_VALUES = {
    "FLOAT": ("value", np.float32, 1),
    "INT": ("value", np.int32, 1),
    "INT8": ("value", np.int32, 1),
    "BOOLEAN": ("value", bool, 1),
    "FLOAT2": ("vector", np.float32, 2),
    "FLOAT_VECTOR": ("vector", np.float32, 3),
    "FLOAT_COLOR": ("color", np.float32, 4),
    "QUATERNION": ("value", np.float32, 4),
}
_PLAIN = {"BOOLEAN", "INT", "FLOAT", "STRING", "ENUM"}


# Digests of each kind of data.


class Digests:
    """A dict {name: SHA-256} with a prefix for names."""

    def __init__(self, found, prefix):
        self._found, self._prefix = found, prefix

    def add(self, name, value):
        """Add bytes, arrays (with type and shape), or values that JSON supports."""
        if isinstance(value, np.ndarray):
            value = f"{value.dtype.str} {value.shape} ".encode() + np.ascontiguousarray(value).tobytes()
        elif not isinstance(value, bytes):
            value = json.dumps(value).encode()
        name = f"{self._prefix}/{name}"
        if name in self._found:
            raise ValueError(f"two digests of one name: {name}")
        self._found[name] = hashlib.sha256(value).hexdigest()

    def add_strands(self, name, curves_object):
        """Add stored and evaluated attributes, points for scripts, settings and shading."""
        curves = curves_object.data
        self._add_attributes(f"{name}/attribute", curves)
        evaluated = curves_object.evaluated_get(bpy.context.evaluated_depsgraph_get())
        self.add(f"{name}/evaluated points", attribute(evaluated.data.attributes["position"]))
        self.add(f"{name}/points", api.points(curves_object))
        self.add_properties(f"{name}/properties", curves.vellus)
        self.add(f"{name}/surface", [curves.surface.name, curves.surface_uv_map])
        self.add_mesh(f"{name}/surface", curves.surface.data)
        modifiers = [(m.name, m.type, m.show_viewport, m.show_render) for m in curves_object.modifiers]
        self.add(f"{name}/object", [curves_object.name, np.array(curves_object.matrix_world).tolist(), modifiers])
        for material in curves.materials:
            self.add_tree(f"{name}/material/{material.name}", material.node_tree)

    def add_mesh(self, name, mesh):
        """Add vertices and corners of a mesh: if these differ, the change is not in the add-on."""
        places, corners = np.empty((len(mesh.vertices), 3), np.float32), np.empty(len(mesh.loops), np.int32)
        mesh.vertices.foreach_get("co", places.ravel())
        mesh.loops.foreach_get("vertex_index", corners)
        self.add(f"{name}/vertices", places)
        self.add(f"{name}/corners", corners)

    def add_node_groups(self):
        """Add every node group of the file."""
        for tree in bpy.data.node_groups:
            self.add_tree(f"node group/{tree.name}", tree)

    def _add_attributes(self, name, curves):
        self.add(f"{name}s", [(a.name, a.data_type, a.domain) for a in curves.attributes])
        for found in curves.attributes:
            self.add(f"{name}/{found.name}", attribute(found))

    def add_properties(self, name, group):
        """Add the values of a group of properties."""
        self.add(name, values_of(group))

    def add_tree(self, name, tree):
        """Add the nodes of a material or of a node group."""
        self.add(name, tree_values(tree))

    def add_picture(self, name="picture", **settings):
        """Add a small picture drawn by the viewport's code."""
        self.add(name, api.draw(**grooms.SIZE, samples_per_side=2, **settings))

    def add_file(self, name, path):
        """Add the bytes of a file, and separately the pixels of an .exr, whose header may change alone."""
        self.add(f"{name}/bytes", Path(path).read_bytes())
        if Path(path).suffix == ".exr":
            self.add_pixels(name, path)

    def add_pixels(self, name, path):
        """Add each channel of an .exr."""
        with OpenEXR.File(str(path), separate_channels=True) as file:
            for part in file.parts:
                for channel, values in part.channels.items():
                    self.add(f"{name}/{channel}", np.array(values.pixels))


def attribute(found):
    """Return (N,) or (N, width) values of a geometry attribute."""
    member, kind, width = _VALUES[found.data_type]
    values = np.empty((len(found.data), width), kind)
    found.data.foreach_get(member, values.ravel())
    return values if width > 1 else values[:, 0]


def values_of(owner):
    """Return {property: value} of a group of properties with nested groups; datablocks by name."""
    found = {}
    for details in owner.bl_rna.properties:
        if details.identifier == "rna_type":
            continue
        value = getattr(owner, details.identifier)
        if isinstance(value, bpy.types.PropertyGroup):
            found[details.identifier] = values_of(value)
        else:
            found[details.identifier] = plain(value)
    return found


def plain(value):
    """Return a property's value as a JSON value."""
    if isinstance(value, set):
        return sorted(value)
    if isinstance(value, bpy.types.ID):
        return value.name
    return value if value is None or isinstance(value, str | bool | int | float) else list(value)


def tree_values(tree):
    """Return nodes with their settings and sockets, and links, in the order of the tree."""
    base = {p.identifier for p in bpy.types.Node.bl_rna.properties}
    nodes = []
    for node in tree.nodes:
        own = [p for p in node.bl_rna.properties if p.type in _PLAIN and p.identifier not in base]
        settings = {p.identifier: plain(getattr(node, p.identifier)) for p in own}
        sockets = [[(s.name, plain(getattr(s, "default_value", None))) for s in side] for side in sides(node)]
        nodes.append([node.name, node.bl_idname, node.label, list(node.location), node.mute, settings, sockets])
    return [
        nodes,
        [[*end(link.from_node, link.from_socket), *end(link.to_node, link.to_socket)] for link in tree.links],
    ]


def sides(node):
    """Return the inputs and outputs of a node."""
    return list(node.inputs), list(node.outputs)


def end(node, socket):
    """Return the name of a link's node and the place of its socket."""
    return node.name, next(i for side in sides(node) for i, s in enumerate(side) if s == socket)


# The command.


def take(wanted):
    """Return {name: digest} of the selected grooms, of all if none is selected."""
    found = {}
    cases = {case.__name__: case for case in (*grooms.GROOMS, *outputs.OUTPUTS)}
    unknown = set(wanted) - {*cases, "commands"}
    if unknown:
        sys.exit(f"There is no groom {', '.join(sorted(unknown))}: there are {', '.join([*cases, 'commands'])}.")
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(1) as beside:
        folder = Path(folder).resolve()
        (folder / "commands").mkdir()
        has_commands = not wanted or "commands" in wanted
        ran = beside.submit(outputs.run_commands, folder / "commands") if has_commands else None
        for name, case in cases.items():
            if not wanted or name in wanted:
                started = time.perf_counter()
                bpy.ops.wm.read_factory_settings(use_empty=True)
                (folder / name).mkdir()
                case(Digests(found, name), folder / name)
                print(f"{name}: {time.perf_counter() - started:.1f} s", file=sys.stderr, flush=True)
        if has_commands:
            outputs.add_commands(Digests(found, "commands"), ran.result())
    return found


def machine():
    """Return the versions that digests depend on, apart from our code."""
    versions = {"Blender": bpy.app.version_string, "Warp": warp.config.version, "NumPy": np.__version__}
    return versions | {"graphics": f"{gpu.platform.renderer_get()}, {gpu.platform.version_get()}"}


def differences(before, now, wanted):
    """Return lines that describe differences from the digests of a reference."""
    known = {n: d for n, d in before["digests"].items() if not wanted or n.split("/")[0] in wanted}
    digests = now["digests"]
    lines = [f"changed  {name}" for name in known if name in digests and digests[name] != known[name]]
    lines += [f"missing  {name}" for name in known if name not in digests]
    return lines + [f"new      {name}" for name in digests if name not in known]


def main():
    """Write digests, or compare them with a written reference; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, metavar="FILE.json", help="where to write digests")
    parser.add_argument("--compare", type=Path, metavar="FILE.json", help="what to compare digests with")
    parser.add_argument("--case", nargs="+", default=[], metavar="NAME", help="these grooms alone")
    options = parser.parse_args()
    if options.out is None and options.compare is None:
        parser.error("say --out or --compare")
    before = json.loads(options.compare.read_text()) if options.compare else None
    warp.config.log_level = warp.LOG_WARNING
    hair_addon.register()
    gpu.init()
    now = {"machine": machine(), "digests": take(options.case)}
    if options.out:
        options.out.write_text(json.dumps(now, indent=1, ensure_ascii=False) + "\n")
    if before is None:
        return 0
    for name, value in before["machine"].items():
        if now["machine"].get(name) != value:
            print(f"Another machine: {name} was {value}, and is {now['machine'].get(name)}.")
    lines = differences(before, now, options.case)
    print(*lines, f"{len(lines)} of {len(now['digests'])} digests differ.", sep="\n")
    return int(bool(lines))


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing.
    os._exit(status)
