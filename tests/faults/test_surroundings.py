"""Faults of the surroundings: odd paths, no HOME, other Pythons, other locales."""

import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

from tests.faults.driver import ROOT, command, start
from tests.helpers.make_study import incline

CASES = 6
ODD = 'it\'s a "study" $HOME `x` & Schüttgut; 種子 * '
ODD += "n" * (200 - len(ODD.encode()))


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory) -> bytes:
    """The table of a campaign in ordinary surroundings."""
    return table_of(tmp_path_factory.mktemp("undisturbed"))


def table_of(folder: Path, **more) -> bytes:
    """The table of the same campaign in others."""
    driver = start(folder / "store", folder / "runs.csv", CASES, **more)
    said = driver.communicate()[1]
    assert driver.returncode == 0, said
    return (folder / "runs.csv").read_bytes()


def test_a_study_and_a_package_below_an_odd_path(tmp_path, undisturbed):
    home = tmp_path / ODD
    for part in ("pellet_study", "yade_scripts", "tests/faults", "tests/__init__.py"):
        source = ROOT / part
        if source.is_dir():
            shutil.copytree(source, home / part, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(source, home / part)
    driver = subprocess.run(
        [sys.executable, "-m", "tests.faults.driver", home / "store", home / "runs.csv", str(CASES)],
        cwd=home,
        capture_output=True,
        text=True,
    )
    assert driver.returncode == 0, driver.stderr
    assert (home / "runs.csv").read_bytes() == undisturbed


def test_commands_on_a_study_with_an_odd_path(tmp_path):
    study = incline(tmp_path / ODD, c=60.0)
    for words in (["compare", study, "--figures"], ["refine", study], ["history", study], ["report", study]):
        found = command(*words, "--json", study / "answer.json")
        assert found.returncode == 0, found.stderr
    assert "cohesion" in (study / "study.toml").read_text()


def test_no_home(tmp_path, undisturbed):
    assert table_of(tmp_path, env={"PATH": os.environ["PATH"]}) == undisturbed
    study = incline(tmp_path / "study")
    found = command("compare", study, "--figures", env={"PATH": os.environ["PATH"]})
    assert found.returncode == 0, found.stderr


def test_another_python_does_not_reach_yade(tmp_path, undisturbed):
    """A virtual environment, conda, PYTHONPATH with another numpy, and start-up files of IPython and of the user."""
    marker = tmp_path / "it was run"
    mark = f"open({str(marker)!r}, 'w')\n"
    for folder, name in (
        ("home/.ipython/profile_default/startup", "00.py"),
        ("ipython/profile_default/startup", "00.py"),
        ("home/.local/lib/python3.11/site-packages", "usercustomize.py"),
    ):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / name).write_text(mark)
    (tmp_path / "startup.py").write_text(mark)
    (tmp_path / "bin").mkdir()
    for name in ("python", "python3", "python3.11"):
        (tmp_path / "bin" / name).write_text("#!/bin/sh\nexit 99\n")
        (tmp_path / "bin" / name).chmod(0o755)
    environment = {
        **os.environ,
        "PATH": f"{tmp_path / 'bin'}:{os.environ['PATH']}",
        "HOME": str(tmp_path / "home"),
        "IPYTHONDIR": str(tmp_path / "ipython"),
        "PYTHONPATH": sysconfig.get_path("purelib"),
        "PYTHONSTARTUP": str(tmp_path / "startup.py"),
        "VIRTUAL_ENV": sys.prefix,
        "CONDA_PREFIX": sys.prefix,
        "OMP_PROC_BIND": "true",
        "OMP_NUM_THREADS": "64",
    }
    plain = tmp_path / "plain.py"
    plain.write_text("import numpy; print(numpy.__file__)\n")
    started = ["yade", "-x", "-n", "-j1", plain]
    reached = subprocess.run(started, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    assert reached.returncode or sysconfig.get_path("purelib") in reached.stdout, "a plain YADE is reached by it"
    marker.unlink(missing_ok=True)
    (
        tmp_path / "home" / ".local" / "lib" / "python3.11" / "site-packages" / "usercustomize.py"
    ).unlink()  # driver's own
    assert table_of(tmp_path, env=environment) == undisturbed
    assert not marker.exists()


@pytest.mark.skipif(not shutil.which("localedef"), reason="needs localedef to make a locale with decimal commas")
def test_a_locale_with_decimal_commas(tmp_path, undisturbed):
    made = subprocess.run(["localedef", "-i", "de_DE", "-f", "UTF-8", tmp_path / "de_DE.UTF-8"], capture_output=True)
    if not (tmp_path / "de_DE.UTF-8" / "LC_NUMERIC").exists():
        pytest.skip(f"no source of the locale: {made.stderr}")
    environment = {**os.environ, "LOCPATH": str(tmp_path), "LC_ALL": "de_DE.UTF-8", "LANG": "de_DE.UTF-8"}
    comma = subprocess.run(
        [sys.executable, "-c", "import locale; locale.setlocale(locale.LC_ALL, ''); print(locale.str(0.5))"],
        env=environment,
        capture_output=True,
        text=True,
    )
    assert comma.stdout.strip() == "0,5"
    assert table_of(tmp_path, env=environment) == undisturbed
    study = incline(tmp_path / "study", c=60.0)
    answers = []
    for number, given in enumerate((os.environ, environment)):
        found = command("compare", study, "--json", tmp_path / f"{number}.json", env=given)
        assert found.returncode == 0, found.stderr
        answers.append((found.stdout, (tmp_path / f"{number}.json").read_bytes()))
    assert answers[0] == answers[1]


def test_a_terminal_without_the_letters_of_a_name(tmp_path):
    study = incline(tmp_path / "Schüttgut 種子")
    (study / "study.toml").write_text(
        'title = "Schüttgut 種子"\n' + (study / "study.toml").read_text().split("\n", 1)[1]
    )
    for words in (["compare", study], ["compare", study / "nowhere"]):
        found = command(*words, env={**os.environ, "LC_ALL": "C", "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"})
        assert "Traceback" not in found.stderr
        assert found.returncode == (0 if words[1] == study else 2)
