"""The command line: version, help, exit statuses, where the answer goes."""

import json
import subprocess
import sys

import pytest

from pellet_study.__main__ import main
from pellet_study.commands import COMMANDS
from tests.helpers.json_keys import not_there, without_meaning


def call(*arguments: str) -> subprocess.CompletedProcess:
    return subprocess.run([sys.executable, "-m", "pellet_study", *arguments], capture_output=True, text=True)


def test_version_and_help():
    assert call("--version").stdout.startswith("pellet-study ")
    listed = call("--help").stdout
    assert all(name in listed for name in COMMANDS)


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_every_command_explains_itself_with_an_example(name, capsys):
    with pytest.raises(SystemExit) as ended:
        main([name, "--help"])
    assert ended.value.code == 0
    assert f"pellet-study {name}" in capsys.readouterr().out


def test_an_answer_that_cannot_be_written_is_refused_before_the_work(tmp_path, capsys):
    assert main(["audit", "--json", str(tmp_path / "missing" / "a.json")]) == 2
    assert "make" in capsys.readouterr().err


def test_a_study_that_is_not_there_is_named(tmp_path, capsys):
    assert main(["bench", str(tmp_path / "nowhere")]) == 2
    assert "nowhere" in capsys.readouterr().err


@pytest.mark.yade
def test_doctor_names_yade_and_passes_its_law_checks(tmp_path):
    file = tmp_path / "doctor.json"
    assert main(["doctor", "--json", str(file)]) == 0
    answer = json.loads(file.read_text())
    assert answer["ok"] is True and answer["version"] and answer["yade"].startswith("/")
    assert without_meaning("doctor", answer) == set() and not_there("doctor", [answer]) == set()
    known = {"2023.02a": 0, "2025.2.0": 2}
    assert len(answer["lacks"]) == known.get(answer["version"], len(answer["lacks"]))
    assert all("times the time of a step" in cost for cost in answer["lacks"].values())


def test_a_reader_that_stops_early_meets_no_traceback():
    writer = subprocess.Popen(
        [sys.executable, "-m", "pellet_study", "audit"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    writer.stdout.readline()
    writer.stdout.close()
    assert "Traceback" not in writer.stderr.read()
    assert writer.wait(timeout=30) == 0
