# SPDX-License-Identifier: GPL-3.0-or-later
"""The manual's screenshots: `python tools/manual_pictures.py [NAME …]` writes docs/manual/NAME.png, or all of them.

Grows hair on the sample's head, opens it in a window of a desktop Blender with the built extension, and takes a picture
of each panel in a sidebar of `SIDEBAR_WIDTH`. With the name `windows`, also build/manual/window_*.png of the whole
window for each kind of active object, to look for labels that are cut. The name `five_minutes` writes only
README's pictures, docs/five_minutes/*.png, cut from the windows of `tests/desktop/manual/first_minutes.py`;
`curly_hair` writes those of the page Curly Hair, from `tests/desktop/manual/curly_hair.py`; `shading_modes` writes a
sheet of Blender's shading modes, from `tests/desktop/manual/shading_modes.py`; `film_strip` writes the steps from the
default cube to a render, from `tests/desktop/manual/film_strip.py`.
"""

import shutil
import subprocess
import sys
import time
import traceback
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
MANUAL = ROOT / "docs" / "manual"
MODULE = "bl_ext.user_default.vellus"

# Step of tests/desktop/manual/first_minutes.py → its picture in README.
FIVE_MINUTES = {"cube_near": "new_hair_system", "head": "guide_mask", "combed": "comb_guides", "shaded": "look"}
SAMPLES = 32  # per pixel: as an artist sees them
FIVE_MINUTES_STRANDS, CURLY_STRANDS = 40_000, 30_000

# Steps of tests/desktop/manual/curly_hair.py that the page Curly Hair shows.
CURLY_HAIR = (
    *("bare_head", "hair_system", "combed", "shoulder_length", "fringe"),
    *("locks", "curls", "smooth_curls", "painted", "look"),
)
CURLY_PARTS = ("cut", "curl")
CURLY_SIZE = (560, 373)

# Rows and columns of the sheet of shading modes; (left, top, right, bottom) pixels of its window; samples and strands.
SHADING_MODELS = ("cube", "monkey", "head")
SHADING_COLUMNS = (
    *("studio_default", "studio_paint", "studio_rim", "matcap", "flat"),
    *("forest", "sunset", "studio", "rendered"),
)
SHADING_PART, SHADING_WINDOW, SHADING_TILE = (60, 80, 690, 500), (900, 600), (224, 149)
SHADING_SAMPLES, SHADING_STRANDS = 8, 30_000

# Steps of the film strip; (left, top, right, bottom) pixels of its window; samples and strands.
STRIP, STRIP_PART, STRIP_TILE = ("cube", "hair", "combed", "orbit", "at_rest", "f12"), (60, 125, 690, 447), (320, 164)
STRIP_SAMPLES, STRIP_STRANDS = 16, 30_000

# (left, top, right, bottom) pixels of its window: the 3D view with the top of its sidebar; and the size it is shown in.
SEEN_PART = (190, 60, 1310, 807)
SHOWN_SIZE = (640, 427)

WINDOW_SIZE = (1600, 1000)
SIDEBAR_WIDTH = 280  # pixels

# Picture → the panels in it, which is all that the sidebar shows meanwhile.
PANELS = {
    "systems": ("systems",),
    "surface": ("surface", "surface_uvs"),
    "guides": ("guides", "guides_growth", "guides_placement"),
    "strands": ("interpolation", "interpolation_parting"),  # the sidebar has no room for interpolation_advanced
    "dynamics": ("dynamics", "dynamics_material", "dynamics_forces", "dynamics_shape"),
    "styles": ("styles", "styles_profile", "styles_mask"),
    "shading": ("shading", "shading_color", "shading_fibre", "shading_variation"),
    "lookup_tables": ("tables",),
    "output": ("output",),
}


def start():
    """Make the sample, build the extension, and run this file in a window with it; returns the exit status."""
    sys.path.insert(0, str(ROOT))
    from tools import build_extension, compile_kernels, desktop_blender

    folder = ROOT / "build" / "manual"
    folder.mkdir(parents=True, exist_ok=True)
    extension = build_extension.build(compile_kernels.this_platform())
    blender = desktop_blender.find_or_install()
    if sys.argv[1:] == ["five_minutes"]:
        return take_five_minutes(blender, extension, folder / "five_minutes")
    if sys.argv[1:] == ["curly_hair"]:
        return take_curly_hair(blender, extension, folder / "curly_hair")
    if sys.argv[1:] == ["shading_modes"]:
        return take_shading_modes(blender, extension, folder / "shading_modes")
    if sys.argv[1:] == ["film_strip"]:
        return take_film_strip(blender, extension, folder / "film_strip")
    if len(sys.argv) == 1 or not (folder / "head.blend").exists():
        save_sample(folder / "head.blend")
    arguments = [extension, folder / "head.blend", *sys.argv[1:]]
    log = folder / "log.txt"
    status = blender.run(__file__, arguments, profile=folder, limit=1500, size=WINDOW_SIZE, log=log)
    errors = [line for line in log.read_text(errors="replace").splitlines() if line.startswith("Traceback")]
    return status or (f"{len(errors)} errors, see {log}" if errors else 0)


def take_five_minutes(blender, extension, folder):
    """Write README's pictures of the five minutes; returns the exit status."""
    import bpy

    if error := take_walk(blender, "manual/first_minutes", ["all"], extension, folder, SAMPLES, FIVE_MINUTES_STRANDS):
        return error
    left, top, right, bottom = SEEN_PART
    for step, name in FIVE_MINUTES.items():
        seen = read(folder / f"first_{step}.png")[top:bottom, left:right]
        write(ROOT / "docs" / "five_minutes" / f"{name}.png", seen, SHOWN_SIZE)
    picture = bpy.data.images.load(str(folder / "first_picture.png"))
    picture.save(filepath=str(ROOT / "docs" / "five_minutes" / "picture.png"))
    return 0


def take_curly_hair(blender, extension, folder):
    """Write the pictures of the page Curly Hair; returns the exit status."""
    if error := take_walk(blender, "manual/curly_hair", CURLY_PARTS, extension, folder, SAMPLES, CURLY_STRANDS):
        return error
    left, top, right, bottom = SEEN_PART
    for step in CURLY_HAIR:
        write(MANUAL / f"curly_{step}.png", read(folder / f"{step}.png")[top:bottom, left:right], CURLY_SIZE)
    return 0


def take_shading_modes(blender, extension, folder):
    """Write the sheet of shading modes; returns the exit status."""
    more = SHADING_SAMPLES, SHADING_STRANDS
    name, size = "manual/shading_modes", SHADING_WINDOW
    if error := take_walk(blender, name, SHADING_MODELS, extension, folder, *more, size=size):
        return error
    write_sheet(folder, MANUAL / "shading_modes.jpg")
    return 0


def take_film_strip(blender, extension, folder):
    """Write the film strip; returns the exit status."""
    more, size = (STRIP_SAMPLES, STRIP_STRANDS), SHADING_WINDOW
    if error := take_walk(blender, "manual/film_strip", ["all"], extension, folder, *more, size=size):
        return error
    write_strip(folder, MANUAL / "film_strip.jpg")
    return 0


def write_strip(folder, path):
    """Write the film strip from the pictures in a folder, in two rows."""
    import numpy as np

    left, top, right, bottom = STRIP_PART
    seen = []
    for name in STRIP:
        picture = read(folder / f"strip_{name}.png")
        # The render has the size of the 3D view, which is at the window's left, above the timeline.
        above = 27 if name == "f12" else 0
        seen.append(scaled(picture[top - above : bottom - above, left:right], STRIP_TILE))
    rows = [np.concatenate(seen[first : first + 3], axis=1) for first in (0, 3)]
    write(path, np.concatenate(rows))


def write_sheet(folder, path):
    """Write the sheet of shading modes from the pictures in a folder: a model in each row."""
    import numpy as np

    left, top, right, bottom = SHADING_PART
    rows = [
        np.concatenate([read(folder / f"{model}_{name}.png")[top:bottom, left:right] for name in SHADING_COLUMNS], 1)
        for model in SHADING_MODELS
    ]
    width, height = SHADING_TILE
    write(path, np.concatenate(rows), (width * len(SHADING_COLUMNS), height * len(SHADING_MODELS)))


def take_walk(blender, name, parts, extension, folder, *more, size=WINDOW_SIZE):
    """Run parts of a script of tests/desktop in a window of the pictures' size; returns an error message, or ""."""
    profile = folder / "profile"
    shutil.rmtree(folder, ignore_errors=True)
    profile.mkdir(parents=True)
    script, log = ROOT / "tests" / "desktop" / f"{name}.py", folder / "log.txt"
    for part in parts:
        words = [part, extension, folder, *more]
        status = blender.run(script, words, profile=profile, limit=1200, size=size, log=log)
        if status:
            return f"{name}.py ended with status {status}, see {log}"
    return ""


def read(path):
    """Return (height, width, 4) float32 display colors of a picture, top row first."""
    import bpy
    import numpy as np

    image = bpy.data.images.load(str(path))
    pixels = np.empty((image.size[1], image.size[0], 4), np.float32)
    image.pixels.foreach_get(pixels.ravel())
    bpy.data.images.remove(image)
    return pixels[::-1]


def scaled(pixels, size):
    """Return a picture in another size (width, height)."""
    import bpy
    import numpy as np

    image = bpy.data.images.new("Scaled", pixels.shape[1], pixels.shape[0], float_buffer=True)
    image.pixels.foreach_set(np.ascontiguousarray(pixels[::-1]).ravel())
    image.scale(*size)
    found = np.empty((*size[::-1], 4), np.float32)
    image.pixels.foreach_get(found.ravel())
    bpy.data.images.remove(image)
    return found[::-1]


def write(path, pixels, size=None):
    """Colors as a PNG or JPEG, scaled to a size (width, height) where one is given."""
    import bpy

    image = bpy.data.images.new(path.stem, pixels.shape[1], pixels.shape[0])
    image.pixels.foreach_set(pixels[::-1].ravel())
    if size is not None:
        image.scale(*size)
    image.filepath_raw, image.file_format = str(path), "JPEG" if path.suffix == ".jpg" else "PNG"
    image.save(quality=90)
    bpy.data.images.remove(image)


def save_sample(path):
    """Draw hair.png, and save the head with little hair, which a window draws quickly."""
    sys.path.insert(0, str(ROOT))
    import bpy

    import hair_addon
    from blend_samples.heads import head

    hair_addon.register()
    draw_portrait(MANUAL / "hair.png")
    bpy.context.view_layer.objects.active = head.build()
    head.light()
    bpy.ops.vellus.add_hair(density_group="scalp", length=0.1, gravity=0.8, strand_count=5000)
    bpy.data.hair_curves["Hair"].vellus.marschner.size = 64
    bpy.data.hair_curves["Hair Guides"].vellus.simulates = True  # otherwise its panel is grayed out
    for style in ("CLUMP", "CURL"):
        bpy.ops.vellus.add_style(style=style)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def draw_portrait(path):
    """Write a picture of the demo's portrait."""
    import bpy

    from blend_samples.heads import portrait

    _head, _guides, hair = portrait.build()
    portrait.light()
    portrait.make_auburn(hair.data)
    lens = bpy.context.scene.camera.data
    lens.sensor_fit, lens.sensor_height = "VERTICAL", lens.sensor_width  # all of the square that the portrait is
    bpy.ops.vellus.render_picture(filepath=str(path), width=360, height=300)


class Window:
    """A window of Blender whose sidebar shows our panels."""

    def __init__(self):
        import bpy

        self.bpy = bpy
        self.window = bpy.context.window_manager.windows[0]
        self.area = next(area for area in self.window.screen.areas if area.type == "VIEW_3D")
        self.region = next(region for region in self.area.regions if region.type == "WINDOW")
        self.sidebar = next(region for region in self.area.regions if region.type == "UI")
        self.blender = sys.modules[f"{MODULE}.hair_addon.blender"]

    def run(self, operator, *arguments, **properties):
        """Call an operator with the mouse in the 3D view."""
        with self.bpy.context.temp_override(window=self.window, area=self.area, region=self.region):
            return operator(*arguments, **properties)

    def screen(self):
        """Return (height, width, 4) display colors of the screen, top row first."""
        self.run(self.bpy.ops.wm.redraw_timer, type="DRAW_WIN_SWAP", iterations=2)
        time.sleep(0.5)
        path = Path(self.bpy.app.tempdir) / "screen.png"
        subprocess.run(["import", "-window", "root", path], check=True)
        return read(path)

    def write(self, name, pixels):
        """Write colors as docs/manual/NAME.png."""
        write(MANUAL / f"{name}.png", pixels)

    def narrow(self):
        """Drag the sidebar's edge until the sidebar has its width."""
        for _try in range(30):  # a busy machine drops events
            offset = self.sidebar.width - SIDEBAR_WIDTH
            if offset == 0:
                return
            x, y = self.sidebar.x + 1, self.sidebar.y + self.sidebar.height // 4
            yield from self.drag(x, y, x + offset)
        raise RuntimeError(f"The sidebar has {self.sidebar.width} pixels.")

    def drag(self, x, y, end):
        """Drag with the left mouse button, horizontally."""
        self.window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=x, y=y)
        yield
        self.window.event_simulate(type="LEFTMOUSE", value="PRESS", x=x, y=y)
        yield
        for step in range(1, 9):
            self.window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=x + (end - x) * step // 8, y=y)
            yield
        self.window.event_simulate(type="LEFTMOUSE", value="RELEASE", x=end, y=y)
        yield from pause(0.5)

    def show_panels(self, names):
        """Show only these panels of the tab, opened; None: all panels."""
        pictured = {f"VELLUS_PT_{name}" for shown in (("layers",), *PANELS.values()) for name in shown}
        # A panel whose parent is missing would be at the top of the tab.
        panels = [p for p in self.blender.panels.CLASSES if {p.bl_idname, getattr(p, "bl_parent_id", "")} & pictured]
        for panel in reversed(panels):
            if panel.is_registered:
                self.bpy.utils.unregister_class(panel)
        for panel in panels:
            if names is None or panel.bl_idname.removeprefix("VELLUS_PT_") in names:
                panel.bl_options = set()
                self.bpy.utils.register_class(panel)


def pause(seconds):
    """Let Blender run for some seconds."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        yield


def panel_picture(screen, sidebar):
    """Return the part of a screen's picture with the panels of a sidebar, without the empty part below them."""
    top = len(screen) - sidebar.y - sidebar.height
    column = screen[top : top + sidebar.height, sidebar.x : sidebar.x + sidebar.width]
    is_panel = abs(column[:, 14, :3] - column[-40, 14, :3]).max(axis=1) > 0.02  # 14: left of all rows
    return column[: is_panel[:-40].nonzero()[0][-1] + 8]


def take(pictures):
    """Every picture; between steps Blender handles its events and redraws."""
    import bpy

    window = Window()
    bpy.context.preferences.view.show_splash = False
    space = window.area.spaces.active
    bpy.context.preferences.system.use_region_overlap = False  # no transparent regions
    every = [name for names in PANELS.values() for name in names]
    window.show_panels(every)  # before any is drawn: whether a panel is open is decided then
    space.show_region_ui = True
    space.show_object_viewport_curves = False  # software drivers draw hair slowly
    window.run(bpy.ops.wm.redraw_timer, type="DRAW_WIN_SWAP", iterations=1)
    window.sidebar.active_panel_category = "Hair"
    yield from pause(0.5)
    yield from window.narrow()
    for active in ("Head", "Hair Guides", "Hair") if "windows" in pictures else ():
        bpy.context.view_layer.objects.active = bpy.data.objects[active]
        for part, shown in enumerate((list(PANELS)[:4], list(PANELS)[4:])):
            window.show_panels([name for picture in shown for name in PANELS[picture]])
            yield from pause(0.3)
            window.write(f"../../build/manual/window_{active}_{part}", window.screen())
    bpy.context.view_layer.objects.active = bpy.data.objects["Hair"]
    for name, panels in PANELS.items():
        if name in pictures or not pictures:
            window.show_panels(panels)
            yield from pause(0.3)
            window.write(name, panel_picture(window.screen(), window.sidebar))
    others = {"looks": take_looks, "rendering": take_rendering, "redo": take_redo, "use_as_guides": take_foreign}
    for name, taking in others.items():
        if name in pictures or not pictures:
            yield from taking(window)
    window.show_panels(None)  # the add-on unregisters them when Blender ends


def take_looks(window):
    """All looks, by a click on the small picture in the header of the panel."""
    window.show_panels(PANELS["shading"])
    yield from pause(0.3)
    before = window.screen()
    x, y = window.sidebar.x + window.sidebar.width - 101, window.sidebar.y + window.sidebar.height - 16
    yield from window.drag(x, y, x)
    yield from pause(2.0)  # previews are loaded beside
    after = window.screen()
    changed = abs(after - before).max(axis=2) > 0.02
    changed[: len(changed) - y + 11] = False  # the picture in the header, which is marked
    # A line of text elsewhere changes few pixels of a row.
    rows, columns = ((changed.mean(axis=axis) > 0.15).nonzero()[0] for axis in (1, 0))
    window.write("looks", after[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1])
    window.window.event_simulate(type="ESC", value="PRESS", x=x, y=y)
    yield from pause(0.3)


def take_redo(window):
    """Show the redo panel of strands, opened by a click on its header."""
    import bpy

    settings = {"strand_count": 5000, "density_group": "scalp"}
    window.run(bpy.ops.vellus.interpolate_hair, "EXEC_DEFAULT", True, **settings)
    window.screen()
    panel = next(region for region in window.area.regions if region.type == "HUD")
    x, y = panel.x + panel.width // 2, panel.y + panel.height // 2
    yield from window.drag(x, y, x)
    window.screen()
    yield from pause(1.0)  # the panel grows while it is redrawn
    screen = window.screen()
    top = len(screen) - panel.y - panel.height
    window.write("../../build/manual/window_redo", screen)
    window.write("redo", screen[top : top + panel.height, panel.x : panel.x + panel.width])


def take_foreign(window):
    """Show the Surface panel while curves not made by Vellus are active."""
    import bpy

    window.run(bpy.ops.object.curves_random_add)
    window.show_panels(PANELS["surface"])
    yield from pause(0.3)
    window.write("use_as_guides", panel_picture(window.screen(), window.sidebar))


def take_rendering(window):
    """Show the Render properties with Vellus as the engine."""
    import bpy

    bpy.context.scene.render.engine = "VELLUS"
    properties = next(area for area in window.window.screen.areas if area.type == "PROPERTIES")
    properties.spaces.active.context = "RENDER"
    yield from pause(0.5)
    screen = window.screen()
    top = len(screen) - properties.y - properties.height
    window.write("rendering", screen[top : top + 330, properties.x : properties.x + properties.width])


def main(zip_path, sample, *pictures):
    """Inside Blender: install the extension, open the sample, and take the pictures."""
    import bpy

    bpy.ops.extensions.package_install_files(filepath=zip_path, repo="user_default", enable_on_install=True)
    bpy.ops.wm.open_mainfile(filepath=sample, load_ui=False)
    taking = take(pictures)

    def advance():
        try:
            next(taking)
            return 0.05
        except StopIteration:
            pass
        except Exception:
            traceback.print_exc()
        bpy.ops.wm.quit_blender()
        return None

    bpy.app.timers.register(advance, first_interval=1.0, persistent=True)


if __name__ == "__main__":
    if "--" in sys.argv:
        main(*sys.argv[sys.argv.index("--") + 1 :])
    else:
        sys.exit(start())
