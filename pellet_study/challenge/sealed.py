"""Sealed trials on YADE: an effect is drawn, simulated seeds are read, the truth is sealed, refine answers from the
measurements alone, then the envelope is opened.

A trial is a folder: `sealed.json` (the truth), `study.toml` and `measurements.csv` (all that refine is given), and
`answer.json`. Every second trial takes its readings from other numerics than the model's: softer contacts and a
smaller time step; all take other seeds. Some hide an effect that no candidate describes.
"""

import csv
import json
import time
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from pellet_study import catalogue, dispatch, rigs
from pellet_study.challenge import bench
from pellet_study.challenge.predictions import Stored, described
from pellet_study.compare import calibrate
from pellet_study.model import Model
from pellet_study.refine import refine
from pellet_study.study import load

STRENGTHS = (6.0, 8.0, 10.0, 13.0)
HIDDEN, NOTHING, OUTSIDE = 40, 15, 5
OUTSIDE_AMOUNTS = {"plate_resonance": 0.5, "friction_hump": 0.3}
OTHER_NUMERICS = {
    "rebound": {"time_step_fraction": 0.035, "stiffness_scale": 0.4},
    "slope_slip": {"time_step_fraction": 0.07, "stiffness_scale": 0.4},
    "inclined_roll": {"time_step_fraction": 0.035, "stiffness_scale": 0.05},
}
FIRST_SEED = 100_000_000  # the model's seeds lie below
SEEDS_A_TRIAL = 1_000


def kinds() -> list[str]:
    """What each trial hides, in the order of the trials: any prefix of the campaign has its share of each."""
    counts = {"one": HIDDEN, "nothing": NOTHING, "outside": OUTSIDE}
    places = [((k + 0.5) / n, kind) for kind, n in counts.items() for k in range(n)]
    return [kind for _, kind in sorted(places)]


def seal(number: int, folder: Path, stored: Stored, effects: Sequence[str]) -> None:
    """Draw what trial `number` hides and put it into its envelope.

    Parameters
    ----------
    effects : names of those hidden in turn; one that does not reach the strength drawn is hidden at its physical limit
    """
    kind = kinds()[number]
    turn = kinds()[:number].count(kind)
    rng = np.random.default_rng((zlib.crc32(b"sealed"), number))
    parameters = {name: float(rng.uniform(*limits)) for name, limits in bench.TRUTH.items()}
    hidden: dict[str, float] = {}
    if kind == "one":
        name = effects[turn % len(effects)]
        effect = stored.study.catalogue.effects[name]
        sign = 1 if effect.sides == 1 or rng.random() < 0.5 else -1
        quantity = effect.parameters[effect.amount]
        limit = quantity["physical"][1 if sign > 0 else 0]
        wanted = STRENGTHS[(turn // len(effects) + turn) % len(STRENGTHS)]
        amount = stored.size(parameters, name, wanted, sign)
        hidden = {name: limit if amount is None else amount}
    elif kind == "outside":
        name = list(OUTSIDE_AMOUNTS)[turn % len(OUTSIDE_AMOUNTS)]
        hidden = {name: OUTSIDE_AMOUNTS[name]}
    truth = {
        "kind": kind,
        "effects": hidden,
        "parameters": parameters,
        "numerics": "other" if (turn + (turn // len(effects) if kind == "one" else 0)) % 2 else "the model's",
        "lambda": None if kind == "outside" else stored.strength(parameters, hidden) if hidden else 0.0,
    }
    place = folder / f"{number:02d}"
    place.mkdir(parents=True, exist_ok=True)
    (place / "sealed.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")


def measure(numbers: Sequence[int], folder: Path, store: Path, workers: int | None = None) -> None:
    """Simulate the seeds of some trials, read them, write what refine is given."""
    plain = [n for n in numbers if _truth(folder, n)["kind"] != "outside"]
    for group, extra in ((plain, ()), ([n for n in numbers if n not in plain], bench.outside().values())):
        if not group:
            continue
        for rig in bench.OBSERVABLES:
            mine = [effect.own for effect in extra if rig in effect.rigs]
            rigs.use(rig, catalogue.standard().rigs[rig].file, mine)
        cases = [case for n in group for case in _cases(n, _truth(folder, n))]
        table = dispatch.run(cases, store, workers=workers)
        place = 0
        for n in group:
            rng = np.random.default_rng((zlib.crc32(b"read"), n))
            readings = []
            for rig, _ in bench.conditions():
                count = _seeds(rig)
                some = table.iloc[place : place + count]
                place += count
                values = some[bench.OBSERVABLES[rig]].to_numpy(float)[(some["status"] == "ok").to_numpy()]
                if rig == "slope_slip":
                    noise = bench.READING_SD_DEG * rng.standard_normal(bench.REPEATS[rig])
                    values = np.resize(values, bench.REPEATS[rig]) + noise
                readings.append(values)
            bench.write(folder / f"{n:02d}", bench.rows(readings))


def _truth(folder: Path, number: int) -> dict:
    return json.loads((folder / f"{number:02d}" / "sealed.json").read_text(encoding="utf-8"))


def _seeds(rig: str) -> int:
    """Simulated seeds a row; a slip angle hardly depends on the seed, its readings scatter by the instrument."""
    return 1 if rig == "slope_slip" else bench.REPEATS[rig]


def _cases(number: int, truth: Mapping) -> list[dict]:
    known = {**catalogue.standard().effects, **bench.outside()}
    cases = []
    for k, (rig, given) in enumerate(bench.conditions()):
        acting = {
            name: {known[name].amount: amount}
            for name, amount in truth["effects"].items()
            if name in rigs.rig(rig).effects
        }
        first = FIRST_SEED + (number * len(bench.conditions()) + k) * SEEDS_A_TRIAL
        for seed in range(first, first + _seeds(rig)):
            cases.append(
                rigs.case(
                    rig,
                    seed=seed,
                    parameters=truth["parameters"],
                    conditions=given,
                    effects=acting,
                    numerics=OTHER_NUMERICS[rig] if truth["numerics"] == "other" else None,
                )
            )
    return cases


def answer(place: Path, stored: Stored):
    """Refine a trial's study; the envelope stays shut."""
    study = load(place)
    found = refine(study, calibrate(study, Model(study, engines=stored.engines)), propose=False)
    text = {
        "verdict": found.verdict,
        "added": found.added,
        "tied": found.tied,
        "parameters": found.steps[-1].parameters,
        "rms_error": [step.rms_error for step in found.steps],
    }
    (place / "answer.json").write_text(json.dumps(text, indent=1) + "\n", encoding="utf-8")
    return found


def opened(number: int, folder: Path, found) -> dict:
    """The truth beside the answer, as a row of the trials' table."""
    truth = _truth(folder, number)
    lam = truth["lambda"]
    return {
        "kind": truth["kind"],
        "hidden": "+".join(truth["effects"]),
        "lambda": "" if lam is None else f"{lam:.2f}",
        "number": number,
        "numerics": truth["numerics"],
        "amount": " ".join(f"{v:.4g}" for v in truth["effects"].values()),
        **described(found, truth["parameters"], truth["effects"]),
    }


COLUMNS = (
    "kind",
    "hidden",
    "lambda",
    "number",
    "numerics",
    "amount",
    "verdict",
    "first",
    "added",
    "tied",
    "gate_p",
    "rms_before",
    "rms_after",
    "covered",
    "constants",
    "size_ratio",
)
TOGETHER = 12  # trials whose seeds are simulated in one batch


def run(folder: Path, store: Path, count: int, seconds: float = np.inf, workers: int | None = None, show=None) -> Path:
    """Do the first `count` trials as far as they are not done; the table `sealed.csv` of all that are done."""
    stored = Stored(store, workers)
    effects = list(stored.model.effects)
    for number in range(count):
        if not (folder / f"{number:02d}" / "sealed.json").exists():
            seal(number, folder, stored, effects)
    until = time.monotonic() + seconds
    waiting = [n for n in range(count) if not (folder / f"{n:02d}" / "measurements.csv").exists()]
    for start in range(0, len(waiting), TOGETHER):
        if time.monotonic() > until:
            break
        measure(waiting[start : start + TOGETHER], folder, store, workers)
        if show is not None:
            show(count - len(waiting) + start + TOGETHER, count)
    rows = []
    for number in range(count):
        place = folder / f"{number:02d}"
        if (place / "measurements.csv").exists():
            rows.append(opened(number, folder, answer(place, stored)))
    file = folder / "sealed.csv"
    with file.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    return file
