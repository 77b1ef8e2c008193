"""Nobody is let in: no listening socket while any rig runs, nothing readable by others, text stays text."""

import ast
import os
import stat
import subprocess
import sys
import time
from pathlib import Path

import pytest

from pellet_study.rigs import on_yade
from tests.faults.driver import ROOT, command, simulating
from tests.helpers.listening import listening
from tests.helpers.make_study import folder

EVERY_RIG = """
import sys
from pathlib import Path
from pellet_study import rigs
from pellet_study.simulation import dispatch
cases = [rigs.case(name) for name in sys.argv[2:]]
dispatch.run(cases, Path(sys.argv[1]), time_limit_s=10)
"""


def test_the_look_sees_a_socket():
    import socket

    with socket.create_server(("127.0.0.1", 0)):
        assert listening([os.getpid()])
    assert not listening([os.getpid()])


def test_nothing_listens_and_nothing_lies_open_while_any_rig_runs(tmp_path):
    names = sorted(on_yade.files())
    assert {"rebound", "slope_slip", "inclined_roll"} <= set(names)
    before = set(Path("/tmp").iterdir())
    old = os.umask(0o022)
    driver = subprocess.Popen([sys.executable, "-c", EVERY_RIG, tmp_path / "store", *names], stderr=subprocess.PIPE)
    os.umask(old)
    seen, looks, open_to_others = [], 0, []
    while driver.poll() is None:
        children = simulating(tmp_path)
        looks += bool(children)
        seen += listening([driver.pid, *children])
        for entry in [*set(Path("/tmp").iterdir()) - before, *(tmp_path / "store").glob("campaign-*")]:
            if entry.name.startswith(("yade-", "pellet-study-", "campaign-")):
                try:
                    mode = entry.stat().st_mode
                except OSError:
                    continue
                open_to_others += [entry.name] if mode & (stat.S_IRWXG | stat.S_IRWXO) else []
        time.sleep(0.01)
    assert driver.returncode == 0, driver.stderr.read()
    assert looks > 20 and seen == [] and open_to_others == []
    assert len(list((tmp_path / "store").glob("*-????????.csv"))) == len(names)


@pytest.mark.parametrize(
    "file", sorted([*ROOT.glob("pellet_study/**/*.py"), *ROOT.glob("yade_scripts/**/*.py")]), ids=str
)
def test_no_shell_and_no_code_from_data(file):
    """Arguments go as lists; nothing evaluates or unpickles what it reads."""
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Call):
            called = ast.unparse(node.func)
            assert called not in {
                "eval",
                "exec",
                "os.system",
                "os.popen",
                "pickle.load",
                "pickle.loads",
                "marshal.loads",
            }
            assert not any(word.arg == "shell" for word in node.keywords)
            if called.startswith("subprocess."):
                assert isinstance(node.args[0], (ast.List, ast.Call, ast.Name)), f"{file}: {ast.unparse(node)}"


def test_a_note_with_html_in_it_stays_text(tmp_path):
    evil = "<script>alert(1)</script>"
    study = folder(
        tmp_path / "study",
        [
            "rig,observable,value,layer_height_mm,note,setup",
            *(f"layer_on_incline,slip_angle_deg,{30 + 60 / h},{h},{evil},{evil}" for h in (8, 12, 18, 27, 40, 60)),
        ],
    )
    toml = (study / "study.toml").read_text().replace('title = "test"', f'title = "{evil}<img src=x onerror=alert(2)>"')
    (study / "study.toml").write_text(toml)
    for words in (["compare"], ["refine"], ["history"], ["report"]):
        found = command(*words, study)
        assert found.returncode == 0, found.stderr
    pages = list(study.rglob("*.html"))
    assert pages
    for page in pages:
        text = page.read_text()
        assert evil not in text and "<img src=x" not in text
    assert any("&lt;script&gt;alert(1)" in page.read_text() for page in pages)
