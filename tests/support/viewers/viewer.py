# SPDX-License-Identifier: GPL-3.0-or-later
"""Khronos' validator, and three.js with three-vrm in a browser without a window."""

import base64
import functools
import http.server
import json
import os
import queue
import shutil
import signal
import subprocess
import threading
from pathlib import Path

HERE = Path(__file__).resolve().parent
NODE = shutil.which("node")
BROWSER = next(filter(None, map(shutil.which, ("chromium-headless-shell", "chromium", "google-chrome"))), None)
FOLDER = os.environ.get("VELLUS_VIEWERS")  # contains node_modules, made by `make viewers`
MISSING = "needs Node.js, Chromium, and VELLUS_VIEWERS, the folder that make viewers installs"
IS_THERE = bool(NODE and BROWSER and FOLDER)

_SECONDS = 200
_SOFTWARE = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")


def issues_of(path):
    """Return the issues that Khronos' validator finds in a file: {"numErrors": ..., "messages": [...], ...}."""
    command = [NODE, str(HERE / "validate.js"), FOLDER, str(path)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, timeout=_SECONDS).stdout)


def seen_by_three(path, folder):
    """Return what view.js finds in a file, with the path of its picture; folder: for temporary files."""
    site = folder / "site"
    site.mkdir()
    for name in ("view.html", "view.js"):
        shutil.copy(HERE / name, site)
    shutil.copy(path, site / "model.glb")
    (site / "node_modules").symlink_to(Path(FOLDER).resolve() / "node_modules")
    answers = queue.Queue()
    handler = functools.partial(_Site, answers, directory=str(site))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        found = _answer_to(f"http://127.0.0.1:{server.server_port}/view.html", folder, answers)
        server.shutdown()
    assert "error" not in found, found
    picture = folder / "seen.png"
    picture.write_bytes(base64.b64decode(found.pop("picture").split(",")[1]))
    return {**found, "picture": picture}


def _answer_to(address, folder, answers):
    """Return what a page sends when it is done. Raises `queue.Empty` after `_SECONDS`."""
    options = ["--headless", "--no-sandbox", f"--user-data-dir={folder / 'profile'}", "--remote-debugging-port=0"]
    details = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "start_new_session": True}
    with subprocess.Popen([BROWSER, *options, *_SOFTWARE, address], **details) as browser:
        try:
            return answers.get(timeout=_SECONDS)
        finally:
            os.killpg(browser.pid, signal.SIGTERM)  # the command may be a script that starts the browser


class _Site(http.server.SimpleHTTPRequestHandler):
    """A folder of files; what a page posts is put into a queue."""

    extensions_map = http.server.SimpleHTTPRequestHandler.extensions_map | {".js": "text/javascript"}

    def __init__(self, answers, *given, **named):
        self._answers = answers
        super().__init__(*given, **named)

    def do_POST(self):
        """Put the JSON that the page sends into the queue."""
        self._answers.put(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
        self.send_response(204)
        self.end_headers()

    def log_message(self, *_given):
        """Write nothing."""
