"""Every key of the JSON that a command writes has its meaning in the reference, and every key told there is still written.

Answers that need YADE are held against their meanings where tests make them: tests/bench, tests/powder, tests/commands.
"""

import json
import shutil
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pellet_study.__main__ import main
from tests import ROOT
from tests.helpers import make_study
from tests.helpers.heap_photographs import draw
from tests.helpers.json_keys import MEANINGS, not_there, without_meaning
from tests.helpers.published_designs import TREAD_RESPONSES, tyre_tread
from tests.helpers.walking import follow

PAPER = ROOT / "results" / "paper"
ON_YADE = {"bench", "calibrate", "doctor"}


def kind(words: list[str], answer: dict) -> str:
    """Which answer of MEANINGS a command gives."""
    if words[0] == "design":
        return f"design {words[1]}"
    if words[0] in ("compare", "add", "drop"):
        return "compare, add, drop"
    if words[0] == "angle":
        return "angle of grains" if "heaps" in answer else "angle of photographs"
    if words[0] == "audit":
        return "audit FOLDER" if len(words) > 1 and not words[1].startswith("-") else "audit"
    if "--design" in words:
        return "pb --design, bbd --design"
    return "pb with a factor of three words" if "means" in answer else words[0]


@pytest.fixture(scope="module")
def answers(tmp_path_factory) -> dict[str, list[dict]]:
    """{kind: answers} of the pages' commands and of some more."""
    found: dict[str, list[dict]] = defaultdict(list)
    folder = tmp_path_factory.mktemp("json")
    file = folder / "answer.json"

    def call(words: list[str], expected: list[str] = ()) -> None:
        file.unlink(missing_ok=True)
        assert main([*map(str, words), "--json", str(file)]) == 0, words
        answer = json.loads(file.read_text())
        found[kind([str(word) for word in words], answer)].append(answer)

    with pytest.MonkeyPatch.context() as patch:
        for name in ("find_the_missing_effect", "designs", "design_tables", "audit_a_paper"):
            (folder / name).mkdir()
            patch.chdir(folder / name)
            follow(ROOT / "docs" / f"{name}.md", call)
        patch.chdir(folder)
        for words in more(folder):
            call(words)
    return found


def more(folder: Path):
    """What the pages do not ask."""
    study = folder / "wet_beads"
    study.mkdir()
    for name in ("study.toml", "measurements.csv"):
        shutil.copy(ROOT / "results" / "wet_beads" / name, study)
    yield from (["check", study], ["compare", study], ["diagnose", study], ["refine", study], ["report", study])
    ordered = make_study.incline(folder / "ordered", mu=0.5, sd=0.2)
    lines = (ordered / "measurements.csv").read_text().splitlines()
    rows = [f"{line},{k}" for k, line in enumerate(lines[1:], start=1)]
    drifting = [
        ",".join([*row.split(",")[:2], f"{float(row.split(',')[2]) + 0.3 * k:.2f}", *row.split(",")[3:]])
        for k, row in enumerate(rows)
    ]
    (ordered / "measurements.csv").write_text("\n".join([lines[0] + ",order", *drifting]) + "\n")
    yield from (["compare", ordered], ["diagnose", ordered], ["refine", ordered])
    yield [
        "pb",
        PAPER / "table07_design.csv",
        "--climb",
        "gradient",
        "--climb-factors",
        "B,C,G",
        "--figures",
        "figures",
    ]
    yield ["bbd", PAPER / "table12_design.csv", "--target", 41.69, "--uncertainty", 0.79, "--predict", "B=0,C=0,G=0"]
    yield ["bbd", "design_tables/surface.csv", "--response", "emission", "--ignore", "strength", "--transform", "log"]
    for command in ("pb", "bbd"):  # a second response that is the same in every run
        table = "table07_design.csv" if command == "pb" else "table12_design.csv"
        header, *runs = (PAPER / table).read_text().splitlines()
        (folder / table).write_text("\n".join([header + ",cost", *(run + ",1" for run in runs)]) + "\n")
        yield [command, table, "--response", header.split(",")[-1], "cost"]
    tyre_tread().to_csv(folder / "tread.csv", index=False)
    yield ["bbd", "tread.csv", "--response", *TREAD_RESPONSES, "--maximise", "abrasion=120,170", "--figures", "figures"]
    three = "solvent,t,y\n" + "\n".join(f"{s},{t},{10 + k + t}" for k, s in enumerate("abcabc") for t in (-1, 1))
    (folder / "three.csv").write_text(three + "\n")
    yield ["pb", "three.csv", "--factor", "solvent=a,b,c"]
    yield ["audit"]
    yield ["challenge", "trials", "--scale", 0.001, "--minutes", 0.05]
    Image.fromarray(np.uint8(255 * draw(41.0, 41.0, seed=1))).save(folder / "heap.png")
    yield ["angle", "heap.png"]
    yield ["angle", ROOT / "results" / "full" / "heap_grains.csv"]
    yield ["init", "new"]


@pytest.mark.parametrize("command", sorted(set(MEANINGS) - ON_YADE))
def test_each_key_has_its_meaning_and_each_meaning_its_key(command, answers):
    assert answers[command]
    assert without_meaning(command, *answers[command]) == set()
    assert not_there(command, answers[command]) == set()
