"""What a page tells its reader to do: files to write, files to copy, commands to call with what they print."""

import re
import shlex
import shutil
from collections.abc import Callable, Iterable
from pathlib import Path

from tests import ROOT

STEP = re.compile(
    r"<!-- file: (?P<file>\S+) -->\n```\w*\n(?P<content>.*?)```"
    r"|<!-- copy: (?P<source>\S+) (?P<target>\S+) -->"
    r"|```console\n(?P<console>.*?)```",
    re.DOTALL,
)


def follow(page: Path, call: Callable[[list[str], list[str]], None]) -> list[str]:
    """Do what a page says in the present folder, except what it calls long; returns the commands.

    `call` gets a command's arguments and the lines that the page says it prints.
    """
    done = []
    for step in STEP.finditer(page.read_text(encoding="utf-8")):
        if step["file"]:
            Path(step["file"]).parent.mkdir(parents=True, exist_ok=True)
            Path(step["file"]).write_text(step["content"], encoding="utf-8")
        elif step["source"]:
            shutil.copy(ROOT / step["source"], step["target"])
        else:
            for arguments, expected in _calls(step["console"]):
                call(arguments, expected)
                done.append(arguments[0])
    return done


def _calls(console: str) -> Iterable[tuple[list[str], list[str]]]:
    """The commands of a block, without those that are long; folders that it copies are copied."""
    for block in re.split(r"^\$ ", console, flags=re.MULTILINE)[1:]:
        line, *expected = block.splitlines()
        program, *arguments = shlex.split(line, comments=True)
        if (program, *arguments[:1]) == ("cp", "-r"):
            shutil.copytree(*arguments[1:])
            continue
        assert program == "pellet-study", line
        if "# long" not in line:
            yield arguments, expected
