"""Score a method's answers to the benchmark of missing effects; needs Python 3.11 and pandas, nothing else.

    python score.py answers/mine.csv                      one table: measure, value, 95 % interval, trials
    python score.py answers/mine.csv answers/best_aicc.csv --out scores.csv          methods side by side, and as a file

The truth is read from truth.csv, candidates.csv and readings.csv in the folder above the answers, else in the present
folder, beside this script, or in results/hidden_effect/benchmark; `--benchmark FOLDER` names another. A file of answers has
a row a set, with columns

    set            its number in readings.csv; every set once
    verdict        adequate, missing, tied, unexplained or undecided
    effects        missing: what is missing, all of it; tied: the alternatives, two or more; else empty. Joined by |
    failing_rows   optional: rows, 1 the first of the set in readings.csv, where the calibrated base model fails, joined by |
    before_NAME    optional: each constant of truth.csv (true_NAME) as the base model is fitted
    after_NAME     optional: each constant with what the answer adds; as before where it adds nothing

Shares have Clopper-Pearson intervals. F1 = 2 J/(1 + J), J the share of rows both call failing in those that either does;
its interval is that of J, transformed. The bias of a set is the mean over the constants of |fitted - true|/true; the
table has the median of the sets, its interval is that between order statistics. A blank cell of a constant leaves its set out.
"""

import argparse
import csv
import io
import math
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import pandas as pd

VERDICTS = ("adequate", "missing", "tied", "unexplained", "undecided")
NEEDED = ("set", "verdict", "effects")
ROWS, TRUE, BEFORE, AFTER = "failing_rows", "true_", "before_", "after_"
STRENGTHS = {4: (3.3, 4.7), 6: (5.3, 6.7), 8: (7.3, math.inf)}  # measured lambda that counts as
TAIL = 0.025  # of a two-sided 95 % interval
HALVINGS = 60
COLUMNS = ["measure", "value", "low", "high", "trials", "why_blank"]
KEPT = Path(__file__).resolve().parents[2] / "results" / "hidden_effect" / "benchmark"


class WrongInput(ValueError):
    """A file cannot be scored; the message says what was given, what is expected, what to do."""


class Benchmark(NamedTuple):
    """The truth, indexed by set, the names of the candidates, and how many rows a set has."""

    truth: pd.DataFrame
    candidates: tuple[str, ...]
    rows: int

    @property
    def constants(self) -> list[str]:
        return [name.removeprefix(TRUE) for name in self.truth.columns if name.startswith(TRUE)]


def binomial_tail(hits: int, n: int, p: float) -> float:
    """Probability of `hits` or more in n trials of probability p."""
    if hits <= 0 or p >= 1:
        return 1.0
    if p <= 0:
        return 0.0
    logs = (
        math.lgamma(n + 1) - math.lgamma(k + 1) - math.lgamma(n - k + 1) + k * math.log(p) + (n - k) * math.log1p(-p)
        for k in range(hits, n + 1)
    )
    return min(1.0, math.fsum(map(math.exp, logs)))


def share_interval(hits: int, n: int) -> tuple[float, float]:
    """Clopper-Pearson 95 % interval of a share (Clopper & Pearson 1934, doi:10.1093/biomet/26.4.404), by bisection."""

    def where(hits: int, wanted: float) -> float:
        """The probability with which `hits` or more come up as often as wanted."""
        low, high = 0.0, 1.0
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            low, high = (middle, high) if binomial_tail(hits, n, middle) < wanted else (low, middle)
        return (low + high) / 2

    return (where(hits, TAIL) if hits else 0.0), (where(hits + 1, 1 - TAIL) if hits < n else 1.0)


def median_interval(values: Sequence[float]) -> tuple[float, float]:
    """The order statistics between which the median lies with at least 95 %; NaN of fewer than six values."""
    n, ordered = len(values), sorted(values)
    k = 0
    while k < n and 1 - binomial_tail(k + 1, n, 0.5) <= TAIL:  # at most k values lie below the median
        k += 1
    return (ordered[k - 1], ordered[n - k]) if k else (math.nan, math.nan)


def table(file: Path, what: str) -> pd.DataFrame:
    """A CSV file, all cells as text, indexed by line."""
    try:
        text = file.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise WrongInput(f"{file}: there is no such file; expected {what} as CSV") from None
    except (OSError, UnicodeDecodeError) as error:
        raise WrongInput(f"{file}: cannot be read ({error}); expected {what} as CSV in UTF-8") from None
    reader = csv.reader(io.StringIO(text, newline=""))
    rows = [(reader.line_num, [cell.strip() for cell in row]) for row in reader if any(map(str.strip, row))]
    if not rows:
        raise WrongInput(f"{file}: is empty; expected {what} as CSV, a line of names first")
    (_, names), *others = rows
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise WrongInput(f"{file}: column {', '.join(twice)} stands there twice; expected one of each name")
    for line, row in others:
        if len(row) != len(names):
            raise WrongInput(
                f"{file}, line {line}: has {len(row)} cells, expected {len(names)} as in the first line ({', '.join(names)}); "
                "commas stand between columns only, effects and rows are joined by |"
            )
    return pd.DataFrame([row for _, row in others], columns=names, index=[line for line, _ in others], dtype=object)


def benchmark_of(folder: Path) -> Benchmark:
    """The truth of a folder of the benchmark."""
    truth = table(folder / "truth.csv", "the truth of the benchmark")
    for name in ("amount", "lambda", *(c for c in truth.columns if c.startswith(TRUE))):
        truth[name] = [float(text or "nan") for text in truth[name]]
    readings = table(folder / "readings.csv", "the readings of the benchmark")
    candidates = table(folder / "candidates.csv", "the candidates of the benchmark")
    rows = int(readings["set"].value_counts().max())
    return Benchmark(truth.set_index(truth["set"].astype(int)), tuple(candidates["effect"]), rows)


def folder_for(file: Path) -> Path:
    """Where the truth of a file of answers lies."""
    places = [file.resolve().parent.parent, Path.cwd(), Path(__file__).resolve().parent, KEPT]
    for place in places:
        if (place / "truth.csv").is_file():
            return place
    looked = ", ".join(dict.fromkeys(map(str, places)))
    raise WrongInput(f"there is no truth.csv in {looked}; name the folder of the benchmark: --benchmark FOLDER")


def answers_in(file: Path, known: Benchmark) -> pd.DataFrame:
    """A method's answers, checked, indexed by set; `effects` and `failing_rows` as sets.

    Raises
    ------
    WrongInput : says the line, what was given and what is expected
    """
    given = table(file, "a method's answers")
    optional = [ROWS, *(prefix + name for prefix in (BEFORE, AFTER) for name in known.constants)]
    if missing := [name for name in NEEDED if name not in given.columns]:
        raise WrongInput(
            f"{file}: column {', '.join(missing)} is missing; given are {', '.join(given.columns)}, expected "
            f"{', '.join(NEEDED)} and, if you have them, {', '.join(optional)}"
        )
    if unknown := [name for name in given.columns if name not in (*NEEDED, *optional)]:
        raise WrongInput(
            f"{file}: column {', '.join(unknown)} is unknown; expected {', '.join(NEEDED)} and, if you have them, "
            f"{', '.join(optional)}; rename it or take it out"
        )
    numbers, first = [], {}
    for line, text in given["set"].items():
        where = f"{file}, line {line}: set"
        if not text.isdecimal() or int(text) not in known.truth.index:
            raise WrongInput(f"{where} {text!r} is none of the benchmark's; expected {words(known.truth.index)}")
        if (number := int(text)) in first:
            raise WrongInput(f"{where} {number} stands in line {first[number]} too; expected one row a set")
        first[number] = line
        numbers.append(number)
    if left := sorted(set(known.truth.index) - set(numbers)):
        raise WrongInput(
            f"{file}: {len(left)} of {len(known.truth)} sets have no row ({words(left)}); expected one a set; say "
            "`undecided` where the method gives no answer"
        )
    checked = [checked_row(row.to_dict(), f"{file}, line {line}", known) for line, row in given.iterrows()]
    return pd.DataFrame(checked, index=numbers).sort_index()


def checked_row(row: dict[str, str], where: str, known: Benchmark) -> dict:
    """One answer: its verdict, its effects, its failing rows and its constants."""
    verdict, effects = row["verdict"], [name.strip() for name in row["effects"].split("|") if name.strip()]
    if verdict not in VERDICTS:
        raise WrongInput(f"{where}: verdict {verdict!r} is unknown; expected one of {', '.join(VERDICTS)}")
    if unknown := [name for name in effects if name not in known.candidates]:
        raise WrongInput(
            f"{where}: effect {', '.join(unknown)} is no candidate; expected {', '.join(known.candidates)}, joined by |"
        )
    least, most = {"missing": (1, math.inf), "tied": (2, math.inf)}.get(verdict, (0, 0))
    if not least <= len(set(effects)) <= most:
        expected = {"missing": "one or more effects", "tied": "two or more effects"}.get(verdict, "no effect")
        raise WrongInput(
            f"{where}: verdict {verdict} with {len(set(effects))} effects ({row['effects']!r}); expected {expected}"
        )
    found: dict = {"verdict": verdict, "effects": frozenset(effects)}
    if ROWS in row:
        cells = [cell.strip() for cell in row[ROWS].split("|") if cell.strip()]
        if wrong := [cell for cell in cells if not cell.isdecimal() or not 1 <= int(cell) <= known.rows]:
            raise WrongInput(
                f"{where}: {ROWS} {', '.join(wrong)}: expected numbers of rows from 1 to {known.rows}, joined by |"
            )
        found[ROWS] = frozenset(map(int, cells))
    for name in row:
        if name.startswith((BEFORE, AFTER)):
            found[name] = number_in(row[name], f"{where}: {name}")
    return found


def number_in(text: str, where: str) -> float:
    """A finite number, NaN where the cell is blank."""
    try:
        value = float(text) if text else math.nan
    except ValueError:
        value = math.inf
    if math.isinf(value) or (text and math.isnan(value)):
        raise WrongInput(f"{where} {text!r}: expected a number, or a blank cell where the method gives none")
    return value


def words(numbers: Sequence[int]) -> str:
    """Some numbers as words, not too many of them."""
    shown = list(map(str, numbers))
    return ", ".join(shown) if len(shown) <= 6 else f"{', '.join(shown[:3])} ... {shown[-1]}"


def score(file: Path | str, folder: Path | str | None = None) -> pd.DataFrame:
    """The measures of a file of answers: measure, value, low and high of its 95 % interval, trials, why it is blank.

    Parameters
    ----------
    folder : of the benchmark; None: it is looked for
    """
    file = Path(file)
    known = benchmark_of(Path(folder) if folder is not None else folder_for(file))
    answers = answers_in(file, known)
    truth, both = known.truth, known.truth.drop(columns=ROWS).join(answers)
    one = both[both["kind"] == "one"]

    def noticed(row: pd.Series) -> bool:
        return row["verdict"] != "adequate"

    def unique(row: pd.Series) -> bool:
        return row["verdict"] == "missing"

    rows = [share("nothing hidden: alarm", both[both["kind"] == "nothing"], noticed)]
    strong = one
    for lam, (low, high) in STRENGTHS.items():
        strong = one[(one["lambda"] > low) & (one["lambda"] < high)]
        rows.append(share(f"lambda {lam}: noticed", strong, noticed))
    rows += [
        share("lambda 8: the truth in the answer", strong, lambda row: row["effect"] in row["effects"]),
        share("lambda 8: unique and right", strong, lambda row: unique(row) and row["effects"] == {row["effect"]}),
        share("lambda 8: unique and wrong", strong, lambda row: unique(row) and row["effects"] != {row["effect"]}),
        share(
            "outside the candidates: unexplained",
            both[both["kind"] == "outside"],
            lambda row: row["verdict"] == "unexplained",
        ),
        failing_rows(truth, answers),
        bias("lambda 8: bias of the constants before", strong, BEFORE, known.constants),
        bias("lambda 8: bias of the constants after", strong, AFTER, known.constants),
    ]
    return pd.DataFrame(rows, columns=COLUMNS)


def share(label: str, trials: pd.DataFrame, hit: Callable[[pd.Series], bool]) -> dict:
    """The share of some trials that a rule hits."""
    n = len(trials)
    if not n:
        return blank(label, "the benchmark has no such set")
    hits = sum(bool(hit(row)) for _, row in trials.iterrows())
    low, high = share_interval(hits, n)
    return dict(zip(COLUMNS, (label, hits / n, low, high, n, ""), strict=True))


def failing_rows(truth: pd.DataFrame, answers: pd.DataFrame) -> dict:
    """F1 of the rows called failing, over all sets; its trials are the rows that truth or answer calls so."""
    label = "failing rows: F1"
    if ROWS not in answers.columns:
        return blank(label, f"the answers have no column {ROWS}")
    both = either = 0
    for number, text in truth[ROWS].items():
        true = {int(cell) for cell in text.split("|") if cell}
        said = answers.loc[number, ROWS]
        both, either = both + len(true & said), either + len(true | said)
    if not either:
        return blank(label, "no row fails, in the truth or in the answers")
    low, high = share_interval(both, either)
    f1 = [2 * j / (1 + j) for j in (both / either, low, high)]
    return dict(zip(COLUMNS, (label, *f1, either, ""), strict=True))


def bias(label: str, trials: pd.DataFrame, prefix: str, constants: Sequence[str]) -> dict:
    """The median over some trials of the mean over the constants of |fitted - true|/true."""
    if lacking := [prefix + name for name in constants if prefix + name not in trials.columns]:
        return blank(label, f"the answers have no column {', '.join(lacking)}")
    errors = sum((trials[prefix + name] - trials[TRUE + name]).abs() / trials[TRUE + name] for name in constants)
    values = (errors / len(constants)).dropna().tolist()
    if not values:
        return blank(label, f"no set of these has all of {prefix}{f', {prefix}'.join(constants)}")
    low, high = median_interval(values)
    return dict(zip(COLUMNS, (label, float(pd.Series(values).median()), low, high, len(values), ""), strict=True))


def blank(label: str, why: str) -> dict:
    """A measure that cannot be taken."""
    return dict(zip(COLUMNS, (label, math.nan, math.nan, math.nan, 0, why), strict=True))


def cells(row: pd.Series) -> tuple[str, str]:
    """A measure's value and its interval with the number of trials, as words."""
    if math.isnan(row["value"]):
        return "", row["why_blank"]
    scale, digits, unit = (1, 2, "") if "F1" in row["measure"] else (100, 1, " %")
    low, high = (f"{scale * row[end]:.{digits}f}" for end in ("low", "high"))
    between = "no interval" if math.isnan(row["low"]) else f"{low} to {high}"
    return f"{scale * row['value']:.{digits}f}{unit}", f"{between}, n = {row['trials']}"


def side_by_side(scores: dict[str, pd.DataFrame], markdown: bool = False) -> str:
    """The measures of some methods in one table."""
    lines = [["measure", *scores]]
    for k, label in enumerate(next(iter(scores.values()))["measure"]):
        shown = (cells(found.iloc[k]) for found in scores.values())
        lines.append([label, *(f"{value} ({rest})".strip() if value else f"- ({rest})" for value, rest in shown)])
    if markdown:
        text = [f"| {' | '.join(line)} |" for line in lines]
        return "\n".join([text[0], "|" + "---|" * len(lines[0]), *text[1:]])
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return "\n".join("  ".join(c.ljust(w) for c, w in zip(line, widths, strict=True)).rstrip() for line in lines)


def main(arguments: Sequence[str] | None = None) -> pd.DataFrame:
    """Print the table of some files of answers; returns it, the method first."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("answers", nargs="+", type=Path, metavar="ANSWERS.csv", help="a row a set, see the file's head")
    parser.add_argument("--benchmark", type=Path, metavar="FOLDER", help="of truth.csv, candidates.csv, readings.csv")
    parser.add_argument("--markdown", action="store_true", help="print the table for a page")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the table as CSV")
    given = parser.parse_args(arguments)
    scores = {file.stem: score(file, given.benchmark) for file in given.answers}
    print(side_by_side(scores, given.markdown))
    found = pd.concat([part.assign(method=name) for name, part in scores.items()], ignore_index=True)
    found = found[["method", *COLUMNS]]
    if given.out is not None:
        found.to_csv(given.out, index=False, float_format="%.6g", lineterminator="\n")
    return found


if __name__ == "__main__":
    try:
        main()
    except WrongInput as error:
        print(error, file=sys.stderr)
        sys.exit(2)
