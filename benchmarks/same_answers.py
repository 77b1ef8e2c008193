"""Do two versions of the package give the same answers? Every study of results/, byte for byte.

    .venv/bin/python benchmarks/same_answers.py BEFORE AFTER --work FOLDER [--only NAME ...]

BEFORE and AFTER are checkouts; each command runs on a fresh copy of the study, and what it writes with --json (and every
JSON and text file it leaves in the study) is compared. Simulations are kept in FOLDER/stores and shared by both versions,
so the scripts of YADE must be the same in both. Answers of BEFORE are kept in FOLDER too. Exit status 1 where any differs.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

CRITICISM = (["compare"], ["diagnose"], ["refine"], ["history"])
RUNS = {
    "results/wet_beads": (*CRITICISM, ["drop", "STUDY", "cohesion"], ["add", "STUDY", "cohesion"], ["report"]),
    "results/caco3": (*CRITICISM, ["report"]),
    "results/loaded_seeds": (*CRITICISM, ["report"]),
    "results/heap_story": (*CRITICISM, ["report"]),
    "results/paper_readings": (["compare"], ["diagnose"], ["report"]),
    "results/paper_sweeps": (["compare"], ["diagnose"]),
    "results/paper_heaps": (["compare"],),
    "results/hidden_effect/sealed/03": (["diagnose"],),
    "results/quick": (["bench"], ["report"]),
    "results/full": (["calibrate", "STUDY", "--quick", "STUDY", "--results", "STUDY/powder"], ["report"]),
    "results/paper": (
        ["audit"],
        ["pb", "STUDY/table07_design.csv"],
        ["pb", "STUDY/table07_design.csv", "--climb", "gradient", "--climb-factors", "B,C,G", "--target", "41.69"],
        ["bbd", "STUDY/table12_design.csv"],
        ["bbd", "STUDY/table12_design.csv", "--target", "41.69", "--uncertainty", "0.79"],
    ),
}  # fmt: skip


def answer(checkout: Path, name: str, words: list[str], folder: Path, store: Path) -> dict[str, bytes]:
    """What a command writes on the study as it stands in `folder`: its JSON, its output, and the files it leaves."""
    kept = folder / ("powder/.store" if name == "results/full" else ".store")  # calibrate keeps it beside its results
    if store.exists() and not kept.exists():
        kept.parent.mkdir(exist_ok=True)
        shutil.move(store, kept)
    words = [*words[:1], "STUDY"] if len(words) == 1 and words != ["audit"] else words
    command = [word.replace("STUDY", str(folder)) for word in words]
    json_file = folder.parent / "answer.json"
    json_file.unlink(missing_ok=True)
    done = subprocess.run(
        [sys.executable, "-m", "pellet_study", *command, "--json", str(json_file)],
        cwd=checkout,
        env={**os.environ, "PYTHONPATH": str(checkout), "COLUMNS": "120"},
        stdin=subprocess.DEVNULL,
        capture_output=True,
    )
    if kept.exists():
        store.parent.mkdir(parents=True, exist_ok=True)
        shutil.move(kept, store)
    found = {"exit": str(done.returncode).encode(), "stdout": done.stdout, "stderr": done.stderr}
    found["json"] = json_file.read_bytes() if json_file.exists() else b""
    for file in sorted(folder.rglob("*")):
        if ".store" not in file.parts and file.suffix in (".json", ".txt", ".csv", ".html", ".toml", ".md"):
            found[str(file.relative_to(folder))] = file.read_bytes()
    place = str(folder.parents[1]).encode()  # stands in what is printed; of the same length at every call
    return {name: content.replace(place, b"." * len(place)) for name, content in found.items()}


def answers(checkout: Path, name: str, work: Path, store: Path) -> Path:
    """All answers of one study, in files below `work`."""
    out, study = work / name.replace("/", "_"), work / "study" / Path(name).name
    if (out / "complete").exists():
        return out
    shutil.rmtree(out, ignore_errors=True)
    shutil.rmtree(study, ignore_errors=True)
    study.mkdir(parents=True)
    if name == "results/paper":
        shutil.copytree(checkout / name, study, dirs_exist_ok=True)
    for kept in (
        "study.toml",
        "measurements.csv",
        "effects",
        "rigs",
        *(("optimum", "screening", "surface", "climb", "validation", "runs.csv") if name == "results/full" else ()),
    ):
        source = checkout / name / kept
        if source.is_dir():
            shutil.copytree(source, study / kept)
        elif source.exists():
            shutil.copy(source, study / kept)
    for number, words in enumerate(RUNS[name]):
        for part, content in answer(checkout, name, list(words), study, store).items():
            file = out / f"{number}_{'_'.join(words[:1])}" / part
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(content)
    (out / "complete").touch()
    return out


def differing(before: Path, after: Path) -> list[str]:
    """Files of two folders of answers that are not the same bytes; the folders' own names and the stderr clock aside."""
    names = {str(f.relative_to(folder)) for folder in (before, after) for f in folder.rglob("*") if f.is_file()}
    return [
        name
        for name in sorted(names)
        if not name.endswith("stderr")
        and ((before / name).read_bytes() if (before / name).exists() else None)
        != ((after / name).read_bytes() if (after / name).exists() else None)
    ]


def main() -> int:
    """Compare, print a line a study."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before", type=Path)
    parser.add_argument("after", type=Path)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--only", nargs="+", metavar="NAME", choices=list(RUNS), default=list(RUNS))
    arguments = parser.parse_args()
    work, wrong = arguments.work.resolve(), 0
    for name in arguments.only:
        store = work / "stores" / name.replace("/", "_")
        place = Path(tempfile.mkdtemp(prefix="same_answers_"))
        found = []
        for which, checkout in (("before", arguments.before), ("after", arguments.after)):
            kept = work / which / name.replace("/", "_")
            if which == "after" or not kept.exists():
                shutil.rmtree(kept, ignore_errors=True)
                shutil.rmtree(place / "study", ignore_errors=True)
                made = answers(checkout.resolve(), name, place, store)
                kept.parent.mkdir(parents=True, exist_ok=True)
                shutil.move(made, kept)
            found.append(kept)
        shutil.rmtree(place)
        unlike = differing(*found)
        wrong += bool(unlike)
        bad = [str(f.parent.relative_to(found[1])) for f in found[1].rglob("exit") if f.read_bytes() != b"0"]
        print(
            f"{name}: {'the same' if not unlike else 'DIFFERS in ' + ', '.join(unlike)}{'; not 0: ' + ', '.join(bad) if bad else ''}",
            flush=True,
        )
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
