"""What the program is started with and writes on: closed streams, full ones, interrupts, settings and words of others."""

import os
import signal
import subprocess
import sys
import time

import pytest

from tests.faults.driver import ROOT, command
from tests.helpers.make_study import incline

RIGHT_TO_LEFT, ESCAPE = "\u202e", "\x1b[2J"


@pytest.fixture
def study(tmp_path):
    """A layer with cohesion."""
    return incline(tmp_path / "study", c=60.0)


def in_shell(line: str, **more) -> subprocess.CompletedProcess:
    return subprocess.run(["sh", "-c", line], cwd=ROOT, capture_output=True, text=True, timeout=300, **more)


@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&-", ">&- 2>&- <&-"])
def test_a_closed_stream_changes_nothing(study, closed):
    found = in_shell(f"'{sys.executable}' -m pellet_study compare '{study}' --figures {closed}")
    assert found.returncode == 0 and "Traceback" not in found.stdout + found.stderr
    whole = command("compare", study)
    assert (study / "compare.txt").read_text() == whole.stdout.split("\n\nresults:")[0] + "\n"
    if closed in ("2>&-", "<&-"):
        assert found.stdout.split("\n\nresults:")[0] == whole.stdout.split("\n\nresults:")[0]


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs a device that is always full")
def test_a_full_stream_is_one_sentence(study):
    found = in_shell(f"'{sys.executable}' -m pellet_study compare '{study}' > /dev/full")
    assert found.returncode == 2 and "No space left on device" in found.stderr
    assert "Traceback" not in found.stderr and "Exception ignored" not in found.stderr


CLOSED = """
import os, sys
os.close(0); os.close(1)
from pathlib import Path
from pellet_study.simulation.store import Store
with Store(Path(sys.argv[1])) as store:
    print("words of another library", flush=True) if sys.stdout else None
    os.write(1, b"words to descriptor 1")
    sys.stderr.write(f"{os.readlink('/proc/self/fd/0')} {os.readlink('/proc/self/fd/1')} {store.lock}")
"""


def test_no_file_of_the_store_takes_the_place_of_a_closed_stream(tmp_path):
    found = subprocess.run(
        [sys.executable, "-c", CLOSED, tmp_path / "store"], cwd=ROOT, stderr=subprocess.PIPE, text=True
    )
    assert found.returncode == 0, found.stderr
    first, second, lock = found.stderr.split()
    assert first == second == "/dev/null" and int(lock) > 2
    assert (tmp_path / "store" / "lock").read_bytes() == b""


def test_settings_of_matplotlib_change_nothing(study, tmp_path):
    assert command("compare", study, "--figures").returncode == 0
    plain = {file.name: file.read_bytes() for file in (study / "figures").glob("*.png")}
    assert set(plain) == {"readings.png", "residuals.png", "predictions.png"}
    home = tmp_path / "home"
    (home / ".config" / "matplotlib").mkdir(parents=True)
    rc = "text.usetex: True\naxes.facecolor: red\nsavefig.dpi: 33\nno.such.key: 1\nfigure.facecolor: black\n"
    for folder in (home / ".config" / "matplotlib", tmp_path):
        (folder / "matplotlibrc").write_text(rc)
    for backend in ("", "no_such_backend", "TkAgg"):
        environment = {**os.environ, "HOME": str(home), "MPLBACKEND": backend, "PYTHONPATH": str(ROOT)}
        environment.pop("XDG_CONFIG_HOME", None)
        found = command("compare", study, "--figures", cwd=tmp_path, env=environment)
        assert found.returncode == 0 and found.stderr == "", found.stderr
        assert {file.name: file.read_bytes() for file in (study / "figures").glob("*.png")} == plain


def test_figures_from_python_do_not_take_the_settings_of_others(study):
    import matplotlib

    import pellet_study as ps
    from pellet_study.output import style

    answer = ps.compare(ps.load_study(study))
    plain = style.svg(ps.draw(answer, "residuals"))
    with matplotlib.rc_context({"axes.facecolor": "red", "lines.linewidth": 9.0, "text.usetex": False}):
        assert style.svg(ps.draw(answer, "residuals")) == plain


@pytest.mark.parametrize("word", [ESCAPE, RIGHT_TO_LEFT], ids=["escape", "right to left"])
def test_signs_that_act_on_a_terminal_are_only_shown(tmp_path, word):
    odd = incline(tmp_path / f"odd{word}name", c=60.0)
    for words in (
        ["compare", odd],
        ["compare", odd / "nowhere"],
        ["refine", odd],
        ["report", odd],
        ["pb", odd / "no.csv"],
    ):
        found = command(*words)
        assert found.returncode in (0, 2) and "Traceback" not in found.stderr
        assert word not in found.stdout + found.stderr
    for page in ("compare.txt", "refine.txt", "report.html"):
        assert word not in (odd / page).read_text(encoding="utf-8")


def test_a_note_that_turns_the_writing_round_is_only_shown(study):
    lines = (study / "measurements.csv").read_text().splitlines()
    noted = [lines[0] + ",note", *(f"{line},12{RIGHT_TO_LEFT}43" for line in lines[1:])]
    (study / "measurements.csv").write_text("\n".join(noted) + "\n", encoding="utf-8")
    found = command("compare", study)
    assert found.returncode == 0 and RIGHT_TO_LEFT not in found.stdout
    assert command("report", study).returncode == 0
    assert RIGHT_TO_LEFT not in (study / "report.html").read_text(encoding="utf-8")


OTHERS = """
import logging, sys, warnings
import pellet_study.__main__ as program

def answer(argv):
    logging.getLogger("distributed.scheduler").warning("lines of another program")
    warnings.warn("a warning to programmers", RuntimeWarning)
    logging.getLogger("pellet_study.somewhere").info("a line of its own")
    return 0

program._answer = answer
sys.exit(program.main([]))
"""


def test_lines_and_warnings_of_other_programs_are_not_passed_on():
    found = subprocess.run([sys.executable, "-c", OTHERS], cwd=ROOT, capture_output=True, text=True)
    assert found.returncode == 0 and found.stderr == "pellet-study: a line of its own\n"


def test_ctrl_c_while_it_is_importing(study):
    """From the first line of the package on; before that it is Python that starts."""
    ended = []
    for wait in (0.0, 0.02, 0.05, 0.1, 0.2, 0.4):
        process = subprocess.Popen(
            [sys.executable, "-X", "importtime", "-m", "pellet_study", "compare", study],
            cwd=ROOT,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        )
        while "pellet_study.starting" not in (line := process.stderr.readline()) and line:
            pass
        time.sleep(wait)
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=60)[1]
        assert "Traceback" not in said
        ended.append(process.returncode)
        assert process.returncode == 0 or "interrupted; what was finished is kept" in said
    assert set(ended) <= {0, 130} and ended[0] == 130


@pytest.mark.parametrize(
    "struck",
    [
        "exec('signal.raise_signal(signal.SIGINT)')",  # of which Python remembers that it was to end by the signal
        "watched = weakref.finalize(type('T', (), {})(), signal.raise_signal, signal.SIGINT); time.sleep(9)",
        "try:\n    signal.raise_signal(signal.SIGINT)\nexcept KeyboardInterrupt:\n    raise ImportError('half of a library')",
    ],
    ids=["code made of text", "a callback", "made another exception"],
)
def test_ctrl_c_ends_with_130_where_python_or_a_library_handles_it_otherwise(tmp_path, struck):
    program = tmp_path / "pellet-study-of-this-test"
    program.write_text(
        "import signal, sys, time, weakref\n"
        "import pellet_study.__main__ as command\n"
        f"def answer(argv):\n    {struck.replace(chr(10), chr(10) + '    ')}\n    return 0\n"
        "command._answer = answer\nsys.exit(command.main([]))\n"
    )
    found = subprocess.run(
        [sys.executable, program],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=60,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    assert found.returncode == 130 and "Traceback" not in found.stderr
    assert found.stderr.count("interrupted; what was finished is kept") == 1
