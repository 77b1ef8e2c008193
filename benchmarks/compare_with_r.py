"""`pellet-study pb` and `bbd` beside base R (lm, drop1, anova, predict, eigen), number by number.

Run from the root of the project, with Debian's r-base-core installed:

    python benchmarks/compare_with_r.py

It makes results/checks/compared_with_r.csv and the table of docs/compared_with_r.md. The tables are listed in
benchmarks/compared_with_r/tables.csv; R's part is benchmarks/compare_with_r.R. The tests hold our answers against R's of the
committed file and need no R.
"""

import csv
import json
import math
import re
import subprocess
import sys
import tempfile
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

from pellet_study.__main__ import main as command_line
from pellet_study.paper.described.audit import audit_folder
from pellet_study.paper.verdicts import REPRODUCED, TO_ROUNDING

ROOT = Path(__file__).resolve().parents[1]
TABLES = ROOT / "benchmarks" / "compared_with_r" / "tables.csv"
RESULT = ROOT / "results" / "checks" / "compared_with_r.csv"
PAGE = ROOT / "docs" / "compared_with_r.md"
TOLERANCE = 1e-6
"""Relative; of numbers that are nearly zero by cancellation, relative to the largest of their kind in the table."""

NOISE = 1e-8
"""Relative differences below this are rounding, another on every machine, and are written as this."""

Key = tuple[str, str, str]
HALF_WAY = 0.5
"""Coded level of every factor at which the intervals are compared."""
PRESS, RUNS = (
    ("R2", "predicted"),
    {"leverage": "leverage", "R-student": "studentized_residuals", "Cook's D": "cooks_distance"},
)


def specifications() -> list[dict[str, str]]:
    """The lines of the list of tables."""
    with TABLES.open(encoding="utf-8") as lines:
        return list(csv.DictReader(lines))


def ours(spec: dict[str, str]) -> dict[Key, float]:
    """{(table, quantity, item): value} of one table, from the JSON that its command writes."""
    factors = {word.split("=")[0]: word.split("=")[1].split(":") for word in filter(None, spec["factors"].split(";"))}
    with tempfile.TemporaryDirectory() as folder:
        answer_file = Path(folder) / "answer.json"
        words = [spec["command"], str(ROOT / spec["file"]), "--json", str(answer_file)]
        words += ["--main-effects"] if spec["command"] == "pb" else []
        words += [word for name, ends in factors.items() for word in ("--factor", f"{name}={','.join(ends)}")]
        words += [word for name in filter(None, [spec["block"]]) for word in ("--block", name)]
        words += [word for name in filter(None, spec["ignore"].split(";")) for word in ("--ignore", name)]
        names = [factor["name"] for factor in _answer(words, answer_file)["factors"]]
        if spec["command"] == "pb" and spec["climb"]:
            words += ["--climb", "gradient", "--climb-factors", ",".join(names)]
            words += ["--climb-step", spec["climb"], "--climb-points", "3"]
        elif spec["command"] == "bbd" and not spec["block"]:
            levels = {name: [float(end) for end in factors.get(name, ("-1", "1"))] for name in names}
            at = {name: (low + high) / 2 + HALF_WAY * (high - low) / 2 for name, (low, high) in levels.items()}
            words += ["--predict", ",".join(f"{name}={level!r}" for name, level in at.items())]
        answer = _answer(words, answer_file)
    found = _common(answer) | (_screening(answer) if spec["command"] == "pb" else _surface(answer))
    return {(spec["table"], *key): float(value) for key, value in found.items() if value is not None}


def _answer(words: list[str], file: Path) -> dict:
    """The JSON of a command that succeeds."""
    with redirect_stdout(StringIO()), redirect_stderr(StringIO()) as errors:
        status = command_line(words)
    assert status == 0, errors.getvalue()
    return json.loads(file.read_text(encoding="utf-8"))


def _common(answer: dict) -> dict:
    """Coefficients and the analysis of variance."""
    rows = {row["source"]: row for row in answer["anova"]}
    found = {("coefficient", term): value for term, value in answer["coefficients"].items()}
    found |= {("standard error", term): value for term, value in answer["standard_errors"].items()}
    found |= {("p", term): value for term, value in answer["p"].items()}
    found |= {("sum of squares", source): row["sum_of_squares"] for source, row in rows.items()}
    return found | {("lack of fit p", ""): answer["lack_of_fit_p"]}


def _screening(answer: dict) -> dict:
    found = {("effect", name): value for name, value in answer["effects"].items()}
    if answer["curvature"]:
        found["p", "curvature"] = answer["curvature"]["p"]
    if answer["saturated"] and answer["lenth"]:
        found |= {("Lenth", key): value for key, value in answer["lenth"].items()}
    for k, (point, predicted) in enumerate(
        zip(answer.get("climb", {}).get("points", []), answer.get("climb", {}).get("predicted", []), strict=True),
        start=1,
    ):
        found["path prediction", f"point {k}"] = predicted
        found |= {("path level", f"{name} point {k}"): level for name, level in point.items()}
    return found


def _surface(answer: dict) -> dict:
    found = {("R2", ""): answer["r2"], ("R2", "adjusted"): answer["r2_adjusted"], PRESS: answer["r2_predicted"]}
    for quantity, key in RUNS.items():
        found |= {(quantity, f"run {k}"): value for k, value in enumerate(answer[key] or [], start=1)}
    point = answer["stationary_point"]
    found |= {("stationary point", name): value for name, value in point["coded"].items()}
    values = sorted(point["eigenvalues"], reverse=True)
    found |= {("eigenvalue", f"{k}"): value for k, value in enumerate(values, start=1)}
    for kind in ("confidence", "prediction"):
        if answer.get("prediction", {}).get(kind):
            found |= {
                (kind, end): value for end, value in zip(("low", "high"), answer["prediction"][kind], strict=True)
            }
    return found


def plain(key: Key) -> Key:
    """A key whose term has one spelling: `A:B`, `A*B` and `AB` are the same."""
    return (*key[:2], re.sub(r"[*:^]", "", key[2]))


def answers_of_r() -> dict[Key, float]:
    """The same from R; numbers that R leaves undefined are left out."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "answers.csv"
        script = ROOT / "benchmarks" / "compare_with_r.R"
        subprocess.run(["Rscript", "--vanilla", script, TABLES, file], check=True, cwd=ROOT, capture_output=True)
        with file.open(encoding="utf-8") as lines:
            rows = list(csv.DictReader(lines))
    found = {(row["table"], row["quantity"], row["item"]): row["value"] for row in rows}
    return {key: float(value) for key, value in found.items() if value not in ("NA", "NaN", "Inf")}


def compared(own: dict[Key, float], theirs: dict[Key, float]) -> list[dict]:
    """One row a number of R's: ours, the relative difference, whether they agree."""
    own = {plain(key): value for key, value in own.items()}
    largest: dict[tuple[str, str], float] = {}
    for key, value in theirs.items():
        largest[key[:2]] = max(largest.get(key[:2], 0.0), abs(value))
    rows = []
    for key, value in theirs.items():
        mine = own.get(plain(key), math.nan)
        scale = max(abs(value), 1e-6 * largest[key[:2]]) or 1.0
        difference = abs(mine - value) / scale
        rows.append(
            dict(zip(("table", "quantity", "item"), key, strict=True))
            | {"ours": mine, "r": value, "relative_difference": difference, "agrees": difference < TOLERANCE}
        )
    return rows


def write(rows: list[dict]) -> None:
    """The comparison as CSV."""
    with RESULT.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        for row in rows:
            digits = {key: shown(row[key]) for key in ("ours", "r")}
            digits["relative_difference"] = f"{max(row['relative_difference'], NOISE):.0e}"
            writer.writerow({**row, **digits})


def shown(value: float) -> str:
    """A number to nine digits; what cancels to less than 1e-12 is 0."""
    return f"{value:.9g}" if abs(value) > 1e-12 else "0"


def published(spec: dict[str, str]) -> str:
    """How many printed numbers of the study come out, from its audit; `-` where none was read."""
    folder = (ROOT / spec["file"]).parent
    if not (folder / "paper.toml").exists():
        return "-"
    found = audit_folder(folder)
    analysis = next(a for a in found.paper.analyses if a.table.name == Path(spec["file"]).name)
    judged = [item for item in found.items if item.section == analysis.name and item.difference is not None]
    fine = sum(item.verdict in (REPRODUCED, TO_ROUNDING) for item in judged)
    return f"{fine} of {len(judged)}" if judged else "sentences only"


def page(rows: list[dict]) -> None:
    """The table of docs/compared_with_r.md between its marks."""
    lines = [
        "| table | command | numbers beside R | agree | largest relative difference (1e-08: or less) | printed numbers that come out |"
    ]
    lines.append("|---|---|---|---|---|---|")
    for spec in specifications():
        own = [row for row in rows if row["table"] == spec["table"]]
        worst = max(NOISE, *(row["relative_difference"] for row in own))
        agree = sum(row["agrees"] for row in own)
        lines.append(
            f"| {spec['table']} | {spec['command']} | {len(own)} | {agree} | {worst:.0e} | {published(spec)} |"
        )
    text = PAGE.read_text(encoding="utf-8")
    made = "<!-- table -->\n" + "\n".join(lines) + "\n<!-- end of table -->"
    PAGE.write_text(re.sub(r"<!-- table -->.*<!-- end of table -->", lambda _: made, text, flags=re.DOTALL), "utf-8")


def main() -> int:
    """Compare, write, and say which numbers differ; 1 if any does."""
    own = {key: value for spec in specifications() for key, value in ours(spec).items()}
    rows = compared(own, answers_of_r())
    write(rows)
    page(rows)
    different = [row for row in rows if not row["agrees"]]
    for row in different:
        print(row)
    print(
        f"{len(rows) - len(different)} of {len(rows)} numbers on {len(specifications())} tables agree to {TOLERANCE:g}"
    )
    return bool(different)


if __name__ == "__main__":
    sys.exit(main())
