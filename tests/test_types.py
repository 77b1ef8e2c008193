"""Types: what pyproject.toml asks of mypy holds in every room."""

import subprocess
import sys

from tests import ROOT


def test_mypy_finds_nothing():
    found = subprocess.run([sys.executable, "-m", "mypy"], cwd=ROOT, capture_output=True, text=True)
    assert found.returncode == 0, found.stdout + found.stderr
