# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands in the documentation are valid, and those of docs/command_line.md run."""

import re
import shlex

import bpy
import pytest

from hair_addon import command_line
from tests.support.commands import HEAD, ROOT, run_here

PAGE = ROOT / "docs" / "command_line.md"


@pytest.mark.farm
def test_the_page_shows_commands_that_work(lit, tmp_path, monkeypatch):
    """The commands of the page run one after another, with smaller numbers, in a folder with the files that they
    name.
    """
    monkeypatch.chdir(tmp_path)
    (tmp_path / "head.obj").write_bytes(HEAD.read_bytes())
    bpy.context.scene.render.resolution_percentage, bpy.context.scene.vellus.sample_count = 3, 1
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    text = PAGE.read_text(encoding="utf-8")
    commands = re.findall(r"^python -m hair_addon (.*)$", text, re.MULTILINE)
    assert len(commands) >= 7
    for command in commands:
        words = re.sub(r"--strands (\d+)000\b", r"--strands \g<1>0", command).replace("--frames 1-24", "--frames 1-2")
        is_large = words.startswith("groom") and not {"--strands", "--settings"} & {*words.split()}
        ended = run_here(*shlex.split(words), *(("--strands", 300) if is_large else ()))
        assert ended.status == 0, f"{command}: {ended.errors}"
    assert len(list((tmp_path / "frames").glob("[!.]*"))) == 2


def commands_of(page):
    """Return the words of the command lines that a page shows, in blocks of code and within sentences."""
    text = page.read_text(encoding="utf-8")
    blocks = re.findall(r"^```\w*\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    spans = re.findall(r"(?<!`)`([^`]+)`(?!`)", text)
    for line in [line for block in blocks for line in block.splitlines()] + [" ".join(span.split()) for span in spans]:
        found = re.match(r"(?:python -m hair_addon|blender --command vellus|vellus) (.+)", line)
        if found:
            yield shlex.split(found[1])


def test_pages_show_commands_that_are_understood(capfd):
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    shown = [words for page in pages for words in commands_of(page)]
    assert len({words[0] for words in shown}) >= 8
    for words in shown:
        try:
            command_line.parser("vellus").parse_args(words)
        except SystemExit:
            pytest.fail(capfd.readouterr().err)


def test_the_page_has_every_option_that_is_no_setting():
    """The page has every option that is no setting; options of settings are listed by --help alone, and commands for
    internal use are not listed.
    """
    text = PAGE.read_text(encoding="utf-8")
    commands = next(action for action in command_line.parser("vellus")._actions if action.choices)
    verbs = {listed.dest: commands.choices[listed.dest] for listed in commands._choices_actions}
    missing = []
    for verb, parser in verbs.items():
        for action in parser._actions:
            is_setting = re.match(r"[A-Z][^:]*: ", action.help or "")
            if verb != "import" and action.option_strings and not is_setting:
                missing += [(verb, action.option_strings[-1])] * (not any(o in text for o in action.option_strings))
    assert len(verbs) > 8 and missing == []
