# SPDX-License-Identifier: GPL-3.0-or-later
"""The manual's Markdown as HTML pages that a browser shows from the installed extension's folder."""

import re
import shutil
from pathlib import Path

import markdown

SOURCE = Path(__file__).resolve().parent.parent / "docs" / "manual"

_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>{title} – Vellus Manual</title>
<style>
body {{ font: 16px/1.5 system-ui, sans-serif; max-width: 46rem; margin: 2rem auto; padding: 0 1rem; color: #222; }}
h4 {{ margin: 1.2rem 0 0; }}
h4 + p {{ margin-top: 0.2rem; }}
h4:target {{ background: #fff3c4; }}
img {{ max-width: 100%; }}
code {{ background: #eee; }}
@media (prefers-color-scheme: dark) {{
  body {{ background: #1d1d1d; color: #ddd; }}
  a {{ color: #7ab7ff; }}
  code {{ background: #333; }}
  h4:target {{ background: #57480f; }}
}}
</style>
</head>
<body>
{body}
</body>
</html>
"""


def to_html(text):
    """Return a page of Markdown as HTML: headings carry anchors, links lead to the HTML pages."""
    body = markdown.markdown(text, extensions=["toc", "tables"], output_format="html")
    body = re.sub(r'(href="[\w./-]+)\.md(["#])', r"\1.html\2", body)
    title = re.search(r"^# (.*)$", text, re.MULTILINE)[1]
    return _PAGE.format(title=title, body=body)


def write(folder):
    """Write all pages and their pictures into a folder."""
    folder.mkdir(parents=True)
    for page in SOURCE.glob("*.md"):
        (folder / page.with_suffix(".html").name).write_text(
            to_html(page.read_text(encoding="utf-8")), encoding="utf-8"
        )
    for picture in (*SOURCE.glob("*.png"), *SOURCE.glob("*.jpg")):
        shutil.copy2(picture, folder)
