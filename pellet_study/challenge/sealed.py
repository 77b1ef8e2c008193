"""Sealed trials on YADE: an effect is drawn, the truth is sealed, its simulations are read, refine answers from the
measurements alone, then the envelope is opened.

A trial is a folder: `sealed.json` (the truth), `study.toml` and `measurements.csv` (all that refine is given), and
`answer.json`. Every second trial takes its readings from other numerics than the model's: softer contacts and a
smaller time step; all take other seeds. Some hide an effect that no candidate describes.
"""

import time
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from pellet_study.challenge.demonstration import Demonstration
from pellet_study.challenge.predictions import Stored, described
from pellet_study.challenge.resume import Show, write
from pellet_study.challenge.seeds import outside
from pellet_study.criticism.calibration import fit_study
from pellet_study.criticism.compare import Comparison, compare
from pellet_study.criticism.refine import Refinement, refine
from pellet_study.errors import SimulationError
from pellet_study.files import opening, writing
from pellet_study.model.model import Model
from pellet_study.rigs.declared import Effect, Rig
from pellet_study.rigs.on_yade import case
from pellet_study.simulation import dispatch
from pellet_study.study.load import load

STRENGTHS = (6.0, 8.0, 10.0, 13.0)
OUTSIDE_AMOUNTS = {"plate_resonance": 0.5, "friction_hump": 0.3}
FIRST_SEED = 100_000_000  # the model's seeds lie below, or far above
SEEDS_A_TRIAL = 1_000
FIRST_OF_STRENGTHS = 1_000_000_000


def seal(number: int, folder: Path, stored: Stored, effects: Sequence[str]) -> None:
    """Draw what trial `number` hides and put it into its envelope.

    Parameters
    ----------
    effects : names of those hidden in turn; one that does not reach the strength drawn is hidden at its physical limit;
        of a trial at a strength those take turns that reach it
    """
    kinds = stored.of.kinds()
    kind = kinds[number]
    turn = kinds[:number].count(kind)
    rng = np.random.default_rng((zlib.crc32(b"sealed"), number))
    parameters = {name: float(rng.uniform(*limits)) for name, limits in stored.of.truth.items()}
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
    elif kind.startswith("lambda "):
        reached = {}
        for name in dict.fromkeys(effects):
            sign = 1 if stored.study.catalogue.effects[name].sides == 1 or rng.random() < 0.5 else -1
            reached[name] = stored.size(parameters, name, float(kind.split()[1]), sign)
        within = [(name, amount) for name, amount in reached.items() if amount is not None]
        hidden = dict([within[turn % len(within)]]) if within else {}
    elif kind == "outside":
        name = list(OUTSIDE_AMOUNTS)[turn % len(OUTSIDE_AMOUNTS)]
        hidden = {name: OUTSIDE_AMOUNTS[name]}
    truth = {
        "kind": kind if not kind.startswith("lambda ") else "one" if hidden else "nothing",
        "effects": hidden,
        "parameters": parameters,
        "numerics": "other" if (turn + (turn // len(effects) if kind == "one" else 0)) % 2 else "the model's",
        "lambda": None if kind == "outside" else stored.strength(parameters, hidden) if hidden else 0.0,
    }
    place = folder / f"{number:02d}"
    writing.json(place / "sealed.json", truth)


def measure(of: Demonstration, numbers: Sequence[int], folder: Path, store: Path, workers: int | None = None) -> None:
    """Simulate the readings of some trials, write what refine is given."""
    plain = [n for n in numbers if _truth(folder, n)["kind"] != "outside"]
    for group, extra in ((plain, ()), ([n for n in numbers if n not in plain], outside().values())):
        if not group:
            continue
        rigs = {
            rig: of.catalogue.rigs[rig].with_effects([effect for effect in extra if rig in effect.rigs])
            for rig in of.observables
        }
        cases = [one for n in group for one in cases_of(of, n, _truth(folder, n), rigs)]
        table = dispatch.run(cases, store, rigs=rigs, workers=workers)
        place = 0
        for n in group:
            rng = np.random.default_rng((zlib.crc32(b"read"), n))
            readings = []
            for rig, given in of.conditions:
                count = of.simulated(rig)
                some = table.iloc[place : place + count]
                place += count
                values = some[of.observables[rig]].to_numpy(float)[(some["status"] == "ok").to_numpy()]
                if len(values) < min(2, count):
                    lost = some.loc[some["status"] != "ok", "status"].iloc[0]
                    raise SimulationError(f"trial {n}: {len(values)} of {count} readings of {rig} {given}: {lost}")
                if rig in of.instrument_sd:
                    noise = of.instrument_sd[rig] * rng.standard_normal(of.repeats[rig])
                    values = np.resize(values, of.repeats[rig]) + noise
                readings.append(values)
            of.write(folder / f"{n:02d}", of.rows(readings))


def _truth(folder: Path, number: int) -> dict:
    return opening.json_in(folder / f"{number:02d}" / "sealed.json")


def _acting(of: Demonstration, rig: Rig, truth: Mapping) -> dict[str, dict[str, float]]:
    """What is hidden in a rig, as a case holds it."""
    known = {**of.catalogue.effects, **outside()}
    return {name: {known[name].amount: v} for name, v in truth["effects"].items() if name in rig.effects}


def cases_of(of: Demonstration, number: int, truth: Mapping, rigs: Mapping[str, Rig] | None = None) -> list[dict]:
    """What the readings of a trial are simulated from: parameters, effects and numerics (`other` or the model's) of its truth."""
    cases: list[dict] = []
    rigs = rigs or of.catalogue.rigs
    for k, (rig, given) in enumerate(of.conditions):
        acting = _acting(of, rigs[rig], truth)
        first = FIRST_SEED + (number * len(of.conditions) + k) * SEEDS_A_TRIAL
        for seed in range(first, first + of.simulated(rig)):
            cases.append(
                case(
                    rigs[rig],
                    contact_law=of.contact_law,
                    seed=seed,
                    parameters={**truth["parameters"], **of.known},
                    conditions=given,
                    effects=acting,
                    numerics=of.other_numerics[rig] if truth["numerics"] == "other" else None,
                )
            )
    return cases


def factors_by_pairs(
    of: Demonstration,
    numbers: Sequence[int],
    folder: Path,
    store: Path,
    workers: int | None = None,
    extra: Sequence[Effect] = (),
) -> dict[int, tuple[np.ndarray, np.ndarray]]:
    """What that which some trials hide makes of each row, by simulations with and without it, with the same seeds.

    Parameters
    ----------
    extra : effects that no candidate describes

    Returns
    -------
    for each trial (rows,) factors of the means and the variances of these; 1 and 0 where nothing hidden acts in the rig
    """
    rigs = {rig: of.catalogue.rigs[rig] for rig in of.observables}
    if extra:
        rigs = {
            name: rig.with_effects([effect for effect in extra if name in effect.rigs]) for name, rig in rigs.items()
        }
    asked: list[tuple[int, int, int, int]] = []
    cases: list[dict] = []
    for n in numbers:
        truth = _truth(folder, n)
        for k, (rig, given) in enumerate(of.conditions):
            acting = _acting(of, rigs[rig], truth)
            if not acting:
                continue
            first = FIRST_OF_STRENGTHS + (n * len(of.conditions) + k) * SEEDS_A_TRIAL
            seeds = range(first, first + of.strength_seeds[rig])
            parameters = {**truth["parameters"], **of.known}
            for effects in (acting, {}):
                asked.append((n, k, len(cases), len(cases) + len(seeds)))
                cases += [
                    case(
                        rigs[rig],
                        contact_law=of.contact_law,
                        seed=s,
                        parameters=parameters,
                        conditions=given,
                        effects=effects,
                    )
                    for s in seeds
                ]
    table = dispatch.run(cases, store, rigs=rigs, workers=workers) if cases else None
    factors = {n: (np.ones(len(of.conditions)), np.zeros(len(of.conditions))) for n in numbers}
    for (n, k, *with_it), (_, _, *without) in zip(asked[::2], asked[1::2], strict=True):
        shown, plain = (
            table[of.observables[of.conditions[k][0]]].iloc[slice(*part)].to_numpy(float) for part in (with_it, without)
        )
        both = np.isfinite(shown) & np.isfinite(plain)
        if both.sum() < 2 or not plain[both].mean() > 0:
            raise SimulationError(
                f"trial {n}: {both.sum()} of {len(both)} pairs of {of.conditions[k]} to measure its strength by"
            )
        factor = shown[both].mean() / plain[both].mean()
        scatter = np.var(shown[both] - factor * plain[both], ddof=1) / both.sum() / plain[both].mean() ** 2
        factors[n][0][k], factors[n][1][k] = factor, scatter
    return factors


def weigh(stored: Stored, numbers: Sequence[int], folder: Path, store: Path, workers: int | None = None) -> None:
    """Measure what some trials hide by the model's own simulations with and without it, with the same seeds: strength.json.

    At the physical limit an effect's surface may be far off; here its factor on each row comes from simulations there.
    """
    factors = factors_by_pairs(stored.of, numbers, folder, store, workers)
    for n in numbers:
        truth = _truth(folder, n)
        found = stored.strength(truth["parameters"], truth["effects"], factors[n])
        writing.json(folder / f"{n:02d}" / "strength.json", {"lambda": round(found, 3)})


def _to_weigh(stored: Stored, number: int, folder: Path) -> bool:
    """Whether a trial's strength is still to be measured: one candidate is hidden, which acts in the simulations."""
    hidden, known = _truth(folder, number)["effects"], stored.study.catalogue.effects
    simulated = bool(hidden) and all(name in known and known[name].reading is None for name in hidden)
    return bool(stored.of.strength_seeds) and simulated and not (folder / f"{number:02d}" / "strength.json").exists()


def answer(place: Path, stored: Stored) -> tuple[Refinement, Comparison]:
    """Refine a trial's study; the envelope stays shut. The comparison after it is that of the best of a tie."""
    study = load(place)
    found = refine(study, fit_study(study, Model(study, engines=stored.engines)), propose=False)
    after = found.steps[-1]
    if found.tied:
        best = found.best_of_tie()
        after = compare(best, fit_study(best, Model(best, engines=stored.engines)))
    text = {
        "verdict": found.verdict,
        "added": found.added,
        "tied": found.tied,
        "parameters": found.steps[-1].parameters,
        "rms_error": [step.rms_error for step in (*found.steps, *([after] if found.tied else []))],
        "holdout_rms_error": [step.holdout_rms_error for step in (found.steps[0], after)],
    }
    writing.json(place / "answer.json", text)
    return found, after


def opened(stored: Stored, number: int, folder: Path, found: Refinement, after: Comparison) -> dict:
    """The truth beside the answer, as a row of the trials' table; effects that are one class have one name there.

    Strengths are those measured, else those on the present surfaces; the envelope has that of the day it was sealed.
    """
    of, truth = stored.of, _truth(folder, number)
    measured = folder / f"{number:02d}" / "strength.json"
    if measured.exists():
        lam = opening.json_in(measured)["lambda"]
    elif set(truth["effects"]) <= set(stored.study.catalogue.effects):
        lam = stored.strength(truth["parameters"], truth["effects"])
    else:
        lam = None
    row = described(found, truth["parameters"], truth["effects"])
    classes = ("+".join(sorted({of.same.get(n, n) for n in names})) for names in found.tied)
    return {
        **row,
        "kind": truth["kind"],
        "hidden": "+".join(of.same.get(name, name) for name in truth["effects"]),
        "lambda": "" if lam is None else f"{lam:.2f}",
        "number": number,
        "numerics": truth["numerics"],
        "amount": " ".join(f"{v:.4g}" for v in truth["effects"].values()),
        "added": "+".join(dict.fromkeys(of.same.get(name, name) for name in found.added)),
        "tied": "|".join(dict.fromkeys(classes)),
        "rms_after": f"{after.rms_error:.4f}",
        "held_out_before": _cell(found.steps[0].holdout_rms_error),
        "held_out_after": _cell(after.holdout_rms_error),
    }


def _cell(value: float | None) -> str:
    return "" if value is None else f"{value:.4f}"


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
    "held_out_before",
    "held_out_after",
    "covered",
    "constants",
    "size_ratio",
)
TOGETHER = 12  # trials whose seeds are simulated in one batch


def run(
    of: Demonstration,
    folder: Path,
    store: Path,
    count: int,
    seconds: float = np.inf,
    workers: int | None = None,
    show: Show | None = None,
) -> Path:
    """Do the first `count` trials as far as they are not done; the table `sealed.csv` of all that are done."""
    stored = Stored(store, workers, of=of)
    effects = of.hides or stored.model.effects
    for number in range(count):
        if not (folder / f"{number:02d}" / "sealed.json").exists():
            seal(number, folder, stored, effects)
    until = time.monotonic() + seconds
    waiting = [n for n in range(count) if not (folder / f"{n:02d}" / "measurements.csv").exists()]
    for start in range(0, len(waiting), TOGETHER):
        if time.monotonic() > until:
            break
        measure(of, waiting[start : start + TOGETHER], folder, store, workers)
        if show is not None:
            show(count - len(waiting) + start + TOGETHER, count)
    measured = [n for n in range(count) if (folder / f"{n:02d}" / "measurements.csv").exists()]
    waiting = [n for n in measured if _to_weigh(stored, n, folder)]
    for start in range(0, len(waiting), TOGETHER):
        if time.monotonic() > until:
            break
        weigh(stored, waiting[start : start + TOGETHER], folder, store, workers)
    rows = []
    for number in measured:
        rows.append(opened(stored, number, folder, *answer(folder / f"{number:02d}", stored)))
    file = folder / "sealed.csv"
    write(file, COLUMNS, rows)
    return file
