"""The wheel, installed in an empty environment, runs one rebound on real YADE."""

import subprocess
import sys

from tests import ROOT

ONE_REBOUND = """
from pathlib import Path
from pellet_study import rigs
from pellet_study.simulation import dispatch
assert "site-packages" in rigs.__file__, rigs.__file__
row = dispatch.run([rigs.case("rebound", seed=1)], Path("store")).iloc[0]
print(row["status"], float(row["rebound_height_mm"]))
"""


def test_the_wheel_runs_a_rebound_in_an_empty_environment(tmp_path):
    def call(*command: str) -> str:
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr + done.stdout
        return done.stdout

    call(sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", "dist", str(ROOT))
    wheel = next((tmp_path / "dist").glob("*.whl"))
    call(sys.executable, "-m", "venv", "env")
    python = str(tmp_path / "env" / "bin" / "python")
    call(python, "-m", "pip", "install", "--quiet", str(wheel))
    status, height = call(python, "-c", ONE_REBOUND).split()
    assert status == "ok" and 0.0 < float(height) < 115.0
    assert call(str(tmp_path / "env" / "bin" / "pellet-study"), "--version").startswith("pellet-study ")
    call(str(tmp_path / "env" / "bin" / "pellet-study"), "init", "a study")
    assert (tmp_path / "a study" / "measurements.csv").exists()
    audit = call(str(tmp_path / "env" / "bin" / "pellet-study"), "audit")
    assert "reproduced" in audit
