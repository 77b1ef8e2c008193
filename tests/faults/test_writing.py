"""What the program writes: whole or not at all, through no link, over nothing that it did not write itself."""

import json
import os
import re
import stat
from pathlib import Path

import numpy as np
import pytest

from pellet_study.__main__ import main
from pellet_study.errors import InputError
from pellet_study.files import writing
from pellet_study.study.load import load
from tests.faults.driver import ROOT, command
from tests.helpers.heap_photographs import draw
from tests.helpers.make_study import incline

OTHERS = b"words of somebody else, which stay\n"


@pytest.fixture
def study(tmp_path) -> Path:
    """A layer with cohesion."""
    return incline(tmp_path / "study", c=60.0)


@pytest.mark.parametrize(
    "words, name",
    [
        (["compare"], "compare.txt"),
        (["compare"], "compare.json"),
        (["compare", "--figures"], "figures/residuals.png"),
        (["diagnose"], "diagnose.txt"),
        (["refine"], "history.json"),
        (["report"], "report.html"),
        (["compare", "--json", "{study}/answer.json"], "answer.json"),
    ],
)
def test_nothing_is_written_through_a_link(study, tmp_path, capsys, words, name):
    outside = tmp_path / "outside"
    outside.write_bytes(b'{"steps": []}' if name == "history.json" else OTHERS)
    before = outside.read_bytes()
    (study / name).parent.mkdir(exist_ok=True)
    (study / name).symlink_to(outside)
    verb, *more = words
    for force in ([], ["--force"]):
        assert main([verb, str(study), *[word.format(study=study) for word in more], *force]) == 2
        said = capsys.readouterr().err
        assert name.rpartition("/")[2] in said and "is a link to" in said and str(outside) in said
        assert outside.read_bytes() == before and (study / name).is_symlink()


def test_a_link_where_the_new_file_is_made_is_not_followed(study, tmp_path, monkeypatch):
    outside = tmp_path / "outside"
    outside.write_bytes(OTHERS)
    monkeypatch.setattr(writing.secrets, "token_hex", lambda count: "same")
    (study / ".pellet-study-same.new").symlink_to(outside)
    with pytest.raises(FileExistsError):
        writing.text(study / "compare.txt", "a page")
    assert outside.read_bytes() == OTHERS and not (study / "compare.txt").exists()


@pytest.mark.parametrize("name", ["figures", ".store"])
def test_a_folder_of_the_study_that_is_a_link_is_refused(study, tmp_path, capsys, name):
    (tmp_path / "elsewhere").mkdir()
    (study / name).symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InputError, match=rf"{name} is a link to"):
        writing.text(study / name / "page.txt", "a page")
    with pytest.raises(InputError, match=rf"{name} is a link to"):
        writing.folder(study / name)
    (tmp_path / "elsewhere" / "page.txt").touch()
    with pytest.raises(InputError, match=rf"{name} is a link to"):
        writing.remove(study / name / "page.txt")
    (tmp_path / "elsewhere" / "page.txt").unlink()
    assert not list((tmp_path / "elsewhere").iterdir())


def test_a_study_that_is_reached_by_a_link_is_fine(study, tmp_path):
    (tmp_path / "link").symlink_to(study)
    assert main(["compare", str(tmp_path / "link"), "--figures"]) == 0
    assert (study / "compare.txt").is_file() and (study / "figures" / "residuals.png").is_file()


def test_a_linked_study_toml_is_edited_only_inside_the_study(study, tmp_path, capsys):
    (study / "study.toml").rename(tmp_path / "outside.toml")
    before = (tmp_path / "outside.toml").read_bytes()
    (study / "study.toml").symlink_to("../outside.toml")
    assert main(["add", str(study), "cohesion"]) == 2
    assert "outside the study" in capsys.readouterr().err
    assert (tmp_path / "outside.toml").read_bytes() == before
    (study / "study.toml").unlink()
    (study / "kept.toml").write_bytes(before)
    (study / "study.toml").symlink_to("kept.toml")
    assert main(["add", str(study), "cohesion"]) == 0
    assert (study / "study.toml").is_symlink() and "cohesion" in (study / "kept.toml").read_text()


@pytest.mark.parametrize("bom", [b"", b"\xef\xbb\xbf"], ids=["plain", "BOM"])
@pytest.mark.parametrize("end", [b"\n", b"\r\n"], ids=["LF", "CRLF"])
def test_line_ends_mode_and_mark_of_study_toml_are_kept(study, bom, end):
    file = study / "study.toml"
    before = bom + file.read_bytes().replace(b"\n", end)
    file.write_bytes(before)
    file.chmod(0o640)
    assert main(["add", str(study), "cohesion"]) == 0
    added = file.read_bytes()
    assert added.startswith(before) and b"cohesion = {" in added
    assert added.count(b"\n") == added.count(end) and added.count(b"\xef\xbb\xbf") == bool(bom)
    assert stat.S_IMODE(file.stat().st_mode) == 0o640
    assert "cohesion" in load(study).effects
    assert main(["drop", str(study), "cohesion"]) == 0
    assert file.read_bytes().startswith(before) and "cohesion" not in load(study).effects


PAGES = {
    "compare.txt": ["compare"],
    "diagnose.txt": ["diagnose"],
    "compare.json": ["compare"],
    "report.html": ["report"],
    "figures/ladder.png": ["history"],
    "figures/residuals.png": ["compare", "--figures"],
}


@pytest.mark.parametrize("name", PAGES)
def test_what_the_program_did_not_write_is_overwritten_only_by_force(study, capsys, name):
    assert main(["refine", str(study)]) == 0
    file = study / name
    file.parent.mkdir(exist_ok=True)
    file.write_bytes(OTHERS)
    words = [PAGES[name][0], str(study), *PAGES[name][1:]]
    capsys.readouterr()
    assert main(words) == 2 and file.read_bytes() == OTHERS
    assert "--force" in capsys.readouterr().err
    assert main([*words, "--force"]) == 0 and file.read_bytes() != OTHERS
    assert main(words) == 0  # its own, now


@pytest.mark.parametrize("name", ["study.toml", "measurements.csv", "history.json", "notes.txt", "config.json"])
def test_json_replaces_an_answer_only(study, capsys, name):
    assert main(["refine", str(study)]) == 0
    (study / "notes.txt").write_bytes(OTHERS)
    (study / "config.json").write_text('{"my": "settings"}')
    before = (study / name).read_bytes()
    assert main(["compare", str(study), "--json", str(study / name)]) == 2
    assert (study / name).read_bytes() == before


def test_json_goes_to_an_empty_file_an_earlier_answer_and_to_streams(study, tmp_path):
    file = tmp_path / "answer.json"
    file.touch()
    for verb in ("compare", "diagnose"):
        assert main([verb, str(study), "--json", str(file)]) == 0
    assert "verdict" in json.loads(file.read_text())
    found = command("compare", study, "--json", "/dev/stdout")
    assert found.returncode == 0 and json.loads(found.stdout[found.stdout.index("\n{\n") :])["chi2"] > 0
    with open(tmp_path / "page", "w") as page:  # a file that the shell opened: the page stays before the answer
        assert command("compare", study, "--json", "/dev/stdout", capture_output=False, stdout=page).returncode == 0
    assert (tmp_path / "page").read_text() == found.stdout
    assert command("compare", study, "--json", "/dev/null").returncode == 0
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)


def test_a_photograph_is_never_replaced_by_its_overlay(tmp_path, monkeypatch, capsys):
    pytest.importorskip("skimage")
    monkeypatch.chdir(tmp_path)
    Path("angle").mkdir()
    from PIL import Image

    Image.fromarray(np.uint8(np.round(255 * draw()))).save("angle/heap.png")
    photo = Path("angle/heap.png").read_bytes()
    assert main(["angle", "angle/heap.png"]) == 0
    assert Path("angle/heap.png").read_bytes() == photo
    other = Path("other")
    other.mkdir()
    (other / "heap.png").write_bytes(photo)  # a picture of somebody's, where an overlay would go
    assert main(["angle", "angle/heap.png", "--figures", "other"]) == 2
    assert (other / "heap.png").read_bytes() == photo and "--force" in capsys.readouterr().err
    assert main(["angle", "angle/heap.png"]) == 0  # an earlier overlay is the program's own


def test_a_design_with_responses_is_not_replaced(tmp_path):
    file = tmp_path / "design.csv"
    filled = "run,standard_order,B,C,response\n1,1,0.7,0.25,41\n2,2,0.9,0.45,43\n"
    file.write_text(filled)
    words = ["pb", "--design", "B=0.7,0.9", "C=0.25,0.45", "--runs", "8", "--output", str(file)]
    assert main(words) == 2 and file.read_text() == filled
    assert main([*words, "--force"]) == 0 and file.read_text() != filled


def test_a_file_is_there_whole_or_as_it_was_before(tmp_path, monkeypatch):
    file = tmp_path / "page.txt"
    writing.text(file, "a page that was written first\n")

    def full(*_):
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr(writing.os, "replace", full)
    with pytest.raises(OSError, match="No space left"):
        writing.text(file, "a page that was written first\nand more\n")
    assert file.read_text() == "a page that was written first\n" and list(tmp_path.iterdir()) == [file]


WRITES = re.compile(
    r"\.write_(text|bytes)\(|\.to_csv\((?!None)|\.savefig\(|imsave\(|\bopen\([^)]*[\"'][wax]b?[\"']|copy2?\(.*file\)"
)
READS = re.compile(
    r"\.read_(text|bytes)\(|\bread_csv\((?!opening|$)|Image\.open\((?!content)|\bopen\([^)]*[\"']rb?[\"']|tomllib\.load\("
)
BY_ITSELF = {  # what is written into a folder of the program's own that nobody else sees, on a stream, or read from the package
    "__main__.py": "streams that are open already",
    "api/figures.py": "an example",
    "api/studies.py": "a temporary folder",
    "commands/design_tables.py": "printed",
    "study/measured.py": "a temporary folder",
    "study/starting.py": "read from the package",
    "output/style.py": "into memory",
    "paper/printed.py": "read from the package",
    "powder/report.py": "into memory",
    "rigs/scripts.py": "code that was looked at before",
    "simulation/cluster.py": "a temporary folder",
    "simulation/local.py": "the folder of a campaign",
    "simulation/processes.py": "the folder of a campaign",
    "simulation/yade.py": "a temporary folder",
    "tables/rows.py": "looked at before, read line by line",
}


def test_every_file_is_opened_and_written_in_the_one_way():
    package = ROOT / "pellet_study"
    found = {
        str(file.relative_to(package)): line.strip()
        for file in package.rglob("*.py")
        if file.parent.name != "files"
        for line in file.read_text(encoding="utf-8").splitlines()
        if WRITES.search(line) or READS.search(line)
    }
    assert found.keys() <= BY_ITSELF.keys(), {name: line for name, line in found.items() if name not in BY_ITSELF}


@pytest.mark.parametrize("name", ["compare.txt", "compare.json", "figures/readings.png"])
def test_what_somebody_else_wrote_is_refused_before_the_work(study, name, monkeypatch, capsys):
    from pellet_study.api import criticism

    monkeypatch.setattr(criticism, "compare", lambda *_, **__: pytest.fail("it was computed first"))
    (study / "figures").mkdir(exist_ok=True)
    (study / name).write_text("my own notes\n")
    assert main(["compare", str(study), "--figures"]) == 2
    assert f"{study / name}: is there already" in capsys.readouterr().err
    assert (study / name).read_text() == "my own notes\n"


def test_what_the_program_wrote_is_replaced_by_its_next_call(study, capsys):
    for words in (["compare"], ["diagnose"], ["refine"], ["compare"], ["drop", "cohesion"], ["refine"]):
        assert main([words[0], str(study), *words[1:]]) == 0, capsys.readouterr().err


@pytest.mark.parametrize(
    "folder", sorted(file.parent for file in (ROOT / "results").glob("*/study.toml")), ids=lambda f: f.name
)
def test_committed_results_are_known_as_the_program_s(folder):
    from pellet_study.files import outputs

    for name in outputs.WRITTEN:
        outputs.check(name, folder, folder / "figures")
