"""Windows and macOS: what needs no YADE works without the modules that only Linux, or only Unix, has."""

import json
import os
import subprocess
import sys

import pytest

from tests import ROOT
from tests.faults.driver import paragraph
from tests.helpers.make_study import incline

BLOCKED = """
import os, shutil, signal, sys
shutil._use_fd_functions = False  # as the library has it where there is no os.fwalk
for name in ("fcntl", "resource", "termios", "pwd", "grp"):
    sys.modules[name] = None
for name in ("sched_getaffinity", "statvfs", "killpg", "O_NOFOLLOW", "O_NONBLOCK"):
    if hasattr(os, name):
        delattr(os, name)
from pellet_study.__main__ import main
sys.exit(main(sys.argv[1:]))
"""


def blocked(*words) -> subprocess.CompletedProcess:
    """`pellet-study ...` in a Python without these modules."""
    return subprocess.run(
        [sys.executable, "-c", BLOCKED, *map(str, words)], cwd=ROOT, capture_output=True, text=True, timeout=200
    )


@pytest.mark.parametrize("verb", ["compare", "diagnose", "refine", "add", "report"])
def test_closed_form_studies_need_no_locks(tmp_path, verb):
    studies = [incline(tmp_path / name, c=60.0) for name in ("here", "there")]
    more = ["cohesion"] if verb == "add" else []
    found = blocked(verb, studies[0], *more)
    assert found.returncode == 0, found.stderr
    here = subprocess.run(
        [sys.executable, "-m", "pellet_study", verb, studies[1], *more], cwd=ROOT, capture_output=True
    )
    assert here.returncode == 0
    for file in studies[1].glob("*.json"):
        assert (studies[0] / file.name).read_bytes() == file.read_bytes()


def test_tables_audit_and_angles_need_no_locks(tmp_path):
    file = tmp_path / "answer.json"
    assert blocked("bbd", ROOT / "results" / "paper" / "table12_design.csv", "--json", file).returncode == 0
    assert json.loads(file.read_text())["r2"] > 0.5
    assert blocked("pb", "--design", "A=1,2", "B=1,2", "--output", tmp_path / "d.csv").returncode == 0
    assert blocked("audit", "--json", file).returncode == 0 and len(json.loads(file.read_text())["rows"]) > 100
    assert blocked("init", tmp_path / "seeds").returncode == 0
    pytest.importorskip("skimage")
    import numpy as np
    from PIL import Image

    from tests.helpers.heap_photographs import draw

    Image.fromarray(np.uint8(np.round(255 * draw(40.0, 40.0)))).save(tmp_path / "heap.png")
    found = blocked("angle", tmp_path / "heap.png", "--figures", tmp_path / "overlays", "--json", file)
    assert found.returncode == 0, found.stderr
    assert json.loads(file.read_text())["angle_deg"] == pytest.approx(40, abs=0.5)


def test_simulations_say_that_they_need_linux(tmp_path):
    assert blocked("init", tmp_path / "seeds").returncode == 0
    found = blocked("bench", tmp_path / "seeds", "--effort", "0.02")
    assert found.returncode == 2 and paragraph(found.stderr) and "need Linux" in found.stderr


def test_the_block_blocks():
    found = subprocess.run(
        [sys.executable, "-c", BLOCKED.replace("from pellet", "import fcntl\nfrom pellet")],
        cwd=ROOT,
        capture_output=True,
    )
    assert found.returncode and b"fcntl" in found.stderr and os.path.exists(ROOT)
