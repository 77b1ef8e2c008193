"""Make the benchmark of missing effects, results/hidden_effect/benchmark, and the answers of three methods to it.

    .venv/bin/python benchmarks/missing_effect/make.py                       from the stored simulations, no YADE
    .venv/bin/python benchmarks/missing_effect/make.py --simulate STORE      the simulations anew first, on YADE

The first takes some 20 seconds of a processor. The second also simulates 25,000 seeds for the response surfaces on YADE, some 10
cpu-minutes, and pairs of simulations for the failing rows of the truth; what STORE has is not simulated again.

| file | from |
|---|---|
| readings.csv | measurements.csv of all sets in results/hidden_effect/sealed |
| candidates.csv | what the effects declare |
| simulations.csv | means over seeds of all points that the response surfaces go through, by YADE |
| predictions.csv | these surfaces, at Sobol points |
| pairs.csv | means with what is hidden over means without it, at the true parameters, by YADE, where the surfaces cannot tell |
| truth.csv | sealed.json, strength.json, pairs.csv |
| answers/*.csv, scores.csv, the table in docs/benchmark.md | baselines.py, score.py |
"""

import argparse
import csv
from collections.abc import Iterable, Sequence
from pathlib import Path

import baselines
import numpy as np
import pandas as pd
import score
import simulator
from baselines import Answer, Set
from simulator import SEALED

from pellet_study.challenge import sealed
from pellet_study.challenge.predictions import Stored
from pellet_study.challenge.seeds import outside
from pellet_study.errors import InputError
from pellet_study.files import opening, writing
from pellet_study.model.sites import spread
from pellet_study.rigs.declared import Effect
from pellet_study.study.load import load

TRIALS = Path(__file__).resolve().parents[2] / "results" / "hidden_effect" / "sealed"
FOLDER = TRIALS.parent / "benchmark"
PAGE = TRIALS.parents[2] / "docs" / "benchmark.md"
POINTS = 128  # of predictions.csv, each with every candidate
METHODS = {"pellet_study": None, "best_aicc": baselines.best_aicc, "discrepancy": baselines.discrepancy}
BELOW = 2.0  # lambda: the root of the sum of squares of all misses, so that no single one is larger
NEAR = 0.5  # of the surfaces' lambda to the measured one, so that they may tell which rows fail


def sets() -> list[Path]:
    """The folders of the sealed sets, in the order of their numbers."""
    return sorted((place for place in TRIALS.iterdir() if place.name.isdecimal()), key=lambda place: int(place.name))


def write(file: Path, names: Sequence[str], lines: Iterable[Sequence]) -> None:
    """A CSV file."""
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(names)
        writer.writerows(lines)


def readings() -> None:
    """readings.csv: the cells as they stand in the sets' files."""
    lines: list[list] = []
    names: list[str] = []
    for place in sets():
        names, *of_set = csv.reader(opening.text(place / "measurements.csv").splitlines())
        lines += [[int(place.name), *line] for line in of_set]
    write(FOLDER / "readings.csv", ["set", *names], lines)


def candidates() -> None:
    """candidates.csv: the amount of each effect, its unit, what means absent, its physical range, where it acts."""
    lines = []
    for name, effect in SEALED.catalogue.effects.items():
        rigs = [rig for rig in SEALED.observables if name in SEALED.catalogue.acting(rig)]
        if rigs:
            quantity = effect.parameters[effect.amount]
            low, high = quantity["physical"]
            text = f"{effect.means[:1].upper()}{effect.means[1:]}: {effect.formula}."
            lines.append([name, effect.amount, quantity["unit"], quantity["absent"], low, high, "|".join(rigs), text])
    names = ["effect", "amount", "unit", "absent", "low", "high", "rigs", "sentence"]
    write(FOLDER / "candidates.csv", names, sorted(lines))


def predictions(stored: Stored) -> None:
    """predictions.csv: the surfaces at Sobol points of the free parameters, without effects and with an amount of each."""
    places = 0.5 + 0.5 * spread(POINTS, len(SEALED.ranges) + 1, seed=1)
    parameters = [
        {name: low + x * (high - low) for (name, (_, low, high)), x in zip(SEALED.ranges.items(), place, strict=False)}
        for place in places
    ]
    lines = []
    for name in ("", *stored.model.effects):
        for point, (given, place) in enumerate(zip(parameters, places, strict=True), start=1):
            amount = amount_at(stored.study.catalogue.effects[name], place[-1]) if name else ""
            given = {n: float(f"{value:.6g}") for n, value in given.items()}
            mean, variance = stored.readings(given, {name: amount} if name else {})
            for row, case in enumerate(stored.model.cases):
                if not name or name in stored.model.acting[case.rig]:
                    known = [f"{mean[row]:.6g}", f"{np.sqrt(variance[row]):.3g}"]
                    lines.append([point, name, amount, *given.values(), row + 1, *known])
    names = ["point", "effect", "amount", *SEALED.ranges, "row", "mean", "standard_error"]
    write(FOLDER / "predictions.csv", names, lines)


def amount_at(effect: Effect, place: float) -> float:
    """An amount within its physical range, place 0 to 1, denser near none: the share of the way there is that cubed."""
    quantity = effect.parameters[effect.amount]
    share = (2 * place - 1 if effect.sides == 2 else place) ** 3
    limit = quantity["physical"][1 if share > 0 else 0]
    return float(f"{quantity['absent'] + abs(share) * (limit - quantity['absent']):.6g}")


def hidden(place: Path) -> dict:
    """What a set hides."""
    return opening.json_in(place / "sealed.json")


def strength(place: Path) -> float | None:
    """Lambda of a set, measured or, of a reading offset, exact on the surfaces of its day; None where what is hidden is no candidate."""
    truth, measured = hidden(place), place / "strength.json"
    if measured.exists():
        return opening.json_in(measured)["lambda"]
    if truth["kind"] == "outside":
        return None
    return truth["lambda"] if truth["effects"] else 0.0


def surfaces_tell(place: Path, stored: Stored) -> bool:
    """Whether the surfaces, with what a set hides, have the misfit that was measured; near a physical limit they may not."""
    truth, measured = hidden(place), strength(place)
    if measured is None:
        return False
    return measured < BELOW or abs(stored.strength(truth["parameters"], truth["effects"]) - measured) < NEAR


def pairs(stored: Stored, store: Path, workers: int | None) -> None:
    """pairs.csv: sets whose failing rows the surfaces cannot tell."""
    lines = []
    for place in sets():
        if not surfaces_tell(place, stored):
            extra = list(outside().values()) if hidden(place)["kind"] == "outside" else []
            number = int(place.name)
            factor, variance = sealed.factors_by_pairs(SEALED, [number], TRIALS, store, workers, extra)[number]
            lines += [
                [number, row, f"{f:.6g}", f"{np.sqrt(v):.3g}"]
                for row, (f, v) in enumerate(zip(factor, variance, strict=True), start=1)
            ]
    write(FOLDER / "pairs.csv", ["set", "row", "factor", "standard_error"], lines)


def shown_by_pairs() -> dict[int, tuple[np.ndarray, np.ndarray]]:
    """Factors of each row and their variances, as pairs.csv has them."""
    found: dict[int, tuple[list[float], list[float]]] = {}
    for line in csv.DictReader(opening.text(FOLDER / "pairs.csv").splitlines()):
        factors, variances = found.setdefault(int(line["set"]), ([], []))
        factors.append(float(line["factor"]))
        variances.append(float(line["standard_error"]) ** 2)
    return {number: (np.array(f), np.array(v)) for number, (f, v) in found.items()}


def truth(stored: Stored) -> None:
    """truth.csv; a row fails where the base model, fitted to noise-free readings with the effect, misses by two standard errors."""
    by_pairs, lines = shown_by_pairs(), []
    for place in sets():
        known, number = hidden(place), int(place.name)
        lam = strength(place)
        failing: tuple[int, ...] = ()
        if number in by_pairs:
            failing = baselines.rows(stored.misses(known["parameters"], known["effects"], by_pairs[number])[0])
        elif known["effects"] and lam > BELOW:
            failing = baselines.rows(stored.misses(known["parameters"], known["effects"])[0])
        ((name, amount),) = known["effects"].items() or [("", "")]
        cells = [number, known["kind"], name, amount and f"{amount:.6g}", "" if lam is None else f"{lam:.2f}"]
        parameters = [f"{known['parameters'][n]:.6g}" for n in SEALED.ranges]
        lines.append([*cells, known["numerics"], *parameters, "|".join(map(str, failing))])
    names = [
        "set",
        "kind",
        "effect",
        "amount",
        "lambda",
        "numerics",
        *(score.TRUE + n for n in SEALED.ranges),
        score.ROWS,
    ]
    write(FOLDER / "truth.csv", names, lines)


def answers(stored: Stored) -> None:
    """answers/METHOD.csv of the three methods, and scores.csv."""
    found: dict[str, list[list]] = {name: [] for name in METHODS}
    for place in sets():
        of = Set.of(load(place), stored)
        for name, method in METHODS.items():
            answered = (
                baselines.pellet_study(of, opening.json_in(place / "answer.json")) if method is None else method(of)
            )
            found[name].append([int(place.name), *cells(answered)])
    constants = [prefix + name for prefix in (score.BEFORE, score.AFTER) for name in SEALED.ranges]
    files = []
    for name, lines in found.items():
        files.append(FOLDER / "answers" / f"{name}.csv")
        write(files[-1], [*score.NEEDED, score.ROWS, *constants], lines)
    score.main([*map(str, files), "--benchmark", str(FOLDER), "--out", str(FOLDER / "scores.csv")])
    page({file.stem: score.score(file, FOLDER) for file in files})


def page(scores: dict[str, pd.DataFrame]) -> None:
    """Put the table of the methods in the place of the one in docs/benchmark.md."""
    blocks = opening.text(PAGE).split("\n\n")
    there = [k for k, block in enumerate(blocks) if block.startswith("| measure |")]
    if len(there) != 1:
        raise InputError(
            f"{PAGE}: has {len(there)} tables that begin with `| measure |`, expected one: put its head there"
        )
    blocks[there[0]] = score.side_by_side(scores, markdown=True)
    writing.text(PAGE, "\n\n".join(blocks))


def cells(answered: Answer) -> list[str]:
    """An answer as the cells behind its set."""
    constants = [f"{value:.6g}" for value in (*answered.before, *answered.after)]
    return [answered.verdict, "|".join(answered.effects), "|".join(map(str, answered.failing)), *constants]


def main() -> None:
    """Make all files, the simulations where a store is named."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--simulate", type=Path, metavar="STORE", help="simulate anew, on YADE, what this folder lacks")
    parser.add_argument("--workers", type=int, help="YADE processes at once; default one a core")
    given = parser.parse_args()
    if given.simulate is not None:
        simulator.simulate(FOLDER / "simulations.csv", given.simulate, given.workers)
    stored = simulator.as_stored(FOLDER / "simulations.csv")
    if given.simulate is not None:
        pairs(stored, given.simulate, given.workers)
    readings()
    candidates()
    predictions(stored)
    truth(stored)
    answers(stored)


if __name__ == "__main__":
    main()
