# SPDX-License-Identifier: GPL-3.0-or-later
"""CONTRIBUTING's picture of the data flow: `python blend_samples/pictures/data_flow.py` writes docs/data_flow.svg.

Boxes name the files that do the work, and arrows what passes from box to box. A file that does not exist is an error.
"""

import sys
from html import escape
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ADDON = ROOT / "hair_addon"

# Box → (column, row, title, files of hair_addon, or of shaders/).
BOXES = {
    "surface": (0, 0, "Surface: rest and pose", ["blender/data/surfaces.py", "core/geometry/mesh.py"]),
    "placement": (
        1,
        0,
        "Guide placement  (§2.3)",
        ["core/placement/domain.py", "core/placement/exact_cells.py", "core/placement/voronoi.py"],
    ),
    "growth": (2, 0, "Guide growth  (Eq. 1-5)", ["core/grooming/guide_growth.py", "core/geometry/curves/bspline.py"]),
    "guides": (3, 0, "Guides: Curves to comb", ["blender/data/strands/curves.py"]),
    "dynamics": (
        4,
        0,
        "Dynamics: rods, contact, air",
        ["core/dynamics/rod/rod_solver.cpp", "core/dynamics/collision/colliders.py"],
    ),
    "roots": (1, 1, "Strand roots  (Eq. 6)", ["core/geometry/sampling.py"]),
    "search": (
        2,
        1,
        "Nearest guides  (§2.4)",
        ["core/geometry/search/hash_grid.py", "core/interpolation/part_lines.py"],
    ),
    "weights": (3, 1, "Weights  (Eq. 8-9)", ["core/interpolation/guide_weights.py"]),
    "sum": (4, 1, "Weighted offsets  (Eq. 7, 10)", ["core/interpolation/interpolation.py"]),
    "styles": (4, 2, "Styles", ["core/styling/steps.py", "core/styling/program.py"]),
    "hair": (3, 2, "Hair: Curves for every engine", ["blender/groom/pipeline.py", "blender/live/handlers.py"]),
    "textures": (2, 2, "Strands on the GPU", ["blender/gpu/strand_textures.py", "blender/gpu/strands/strand_maker.py"]),
    "buffer": (
        1,
        2,
        "Visibility, shadows, shading",
        ["blender/gpu/visibility_buffer.py", "blender/gpu/shadows.py", "core/shading/fibre/marschner.py"],
    ),
    "picture": (0, 2, "Viewport, render, file", ["blender/render/frames/engine.py", "blender/render/offscreen.py"]),
    "tables": (1, 3, "Lookup tables  (Eq. 14-17)", ["core/shading/tables/lookup_tables.py", "core/files/table_exr.py"]),
    "paths": (2, 3, "Light Grid: light paths", ["core/shading/light_paths/grid_walk.py"]),
}
ARROWS = [
    ("surface", "placement"),
    ("placement", "growth"),
    ("growth", "guides"),
    ("guides", "dynamics"),
    ("surface", "roots"),
    ("roots", "search"),
    ("search", "weights"),
    ("weights", "sum"),
    ("guides", "sum"),
    ("dynamics", "sum"),
    ("sum", "styles"),
    ("styles", "hair"),
    ("hair", "textures"),
    ("textures", "buffer"),
    ("buffer", "picture"),
    ("tables", "buffer"),
    ("textures", "paths"),
    ("paths", "buffer"),
]

WIDTH, GAP, ROW, MARGIN = 250, 40, 120, 20
LINE, TOP = 17, 26  # heights [px]


def main():
    """Write the picture; returns the exit status."""
    missing = [file for *_place, files in BOXES.values() for file in files if not (ADDON / file).is_file()]
    if missing:
        print(f"These files do not exist: {', '.join(missing)}", file=sys.stderr)
        return 1
    width = 2 * MARGIN + 5 * WIDTH + 4 * GAP
    height = 2 * MARGIN + 4 * ROW - 20
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif">',
        '<defs><marker id="head" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="8" markerHeight="8" orient="auto">',
        '<path d="M0 0 L8 4 L0 8 z" fill="#555"/></marker></defs>',
        f'<rect width="{width}" height="{height}" fill="#fff"/>',
        *(_arrow(*ends) for ends in ARROWS),
        *(_box(*box) for box in BOXES.values()),
        "</svg>",
    ]
    (ROOT / "docs" / "data_flow.svg").write_text("\n".join(parts) + "\n", encoding="utf-8")
    return 0


def _corner(column, row):
    return MARGIN + column * (WIDTH + GAP), MARGIN + row * ROW


def _height(files):
    return TOP + LINE * len(files) + 6


def _box(column, row, title, files):
    x, y = _corner(column, row)
    lines = [
        f'<rect x="{x}" y="{y}" width="{WIDTH}" height="{_height(files)}" rx="6" fill="#f2ede6" stroke="#8a7a66"/>',
        f'<text x="{x + 10}" y="{y + 19}" font-size="14" font-weight="bold">{escape(title)}</text>',
    ]
    lines += [
        f'<text x="{x + 10}" y="{y + TOP + LINE * (n + 1) - 5}" font-size="12" fill="#333">{escape(file)}</text>'
        for n, file in enumerate(files)
    ]
    return "\n".join(lines)


def _arrow(start, end):
    (column, row, _title, files), (to_column, to_row, _, to_files) = BOXES[start], BOXES[end]
    x, y = _corner(column, row)
    to_x, to_y = _corner(to_column, to_row)
    if column == to_column:
        is_down = to_row > row
        from_point = x + WIDTH / 2, y + (_height(files) if is_down else 0)
        to_point = to_x + WIDTH / 2, to_y + (0 if is_down else _height(to_files))
    else:
        is_right = to_column > column
        from_point = x + (WIDTH if is_right else 0), y + _height(files) / 2
        to_point = to_x + (0 if is_right else WIDTH), to_y + _height(to_files) / 2
    line = " ".join(
        f'{name}="{value:g}"' for name, value in zip(("x1", "y1", "x2", "y2"), (*from_point, *to_point), strict=True)
    )
    return f'<line {line} stroke="#555" stroke-width="1.5" marker-end="url(#head)"/>'


if __name__ == "__main__":
    sys.exit(main())
