"""The machine-readable form of each answer."""

import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import asdict

from pellet_study.criticism.calibration import CalibratedStudy, surface_error
from pellet_study.criticism.compare import HELD_OUT_FAILS, Comparison
from pellet_study.criticism.diagnose import Diagnosis
from pellet_study.criticism.facts import misfit
from pellet_study.criticism.fit_facts import drift_words, row_words, scatter_words, time_drift_words
from pellet_study.criticism.grades import RULE
from pellet_study.criticism.near_misses import Drifting
from pellet_study.criticism.next_measurement import NextMeasurement
from pellet_study.criticism.outcomes import Outcome
from pellet_study.criticism.refine import Refinement
from pellet_study.criticism.residuals import RowResidual
from pellet_study.criticism.time_drift import TimeDrift
from pellet_study.criticism.used_sd import UsedSd, used_sds
from pellet_study.output.words import number
from pellet_study.study.measurements import Measurement

SURFACE_FAILS = 0.005  # p of the direct simulations below which the surfaces are doubted; chance does so once in 200


def comparison(compared: Comparison) -> dict:
    """A model beside the measurements: keys of `compare`, `add`, `drop`, and of each step of `refine` and `history`."""
    return {
        "effects": list(compared.effects),
        "parameters": compared.parameters,
        "intervals": {name: list(limits) for name, limits in compared.intervals.items()},
        "chi2": compared.chi2,
        "dof": compared.dof,
        "lack_of_fit_p": compared.lack_of_fit_p,
        "rms_error": compared.rms_error,
        "holdout_rms_error": compared.holdout_rms_error,
        "rms_error_unit": compared.rms_error_unit,
        "noise_floor": noise_floor(compared),
        "noise_rms": noise_rms(compared),
        "level_out_rms_error": compared.level_out_rms_error,
        "not_identified": list(compared.not_identified),
        "at_bound": list(compared.at_bound),
        "ranges": {name: list(limits) for name, limits in compared.ranges.items()},
        "range_shares": compared.range_shares,
        "fits": compared.judged,
        "fit": grade(compared),
        "rig_lack_of_fit_p": compared.rig_lack_of_fit_p,
        "holdout_p": compared.holdout_p,
        "holdout_contradicts": compared.holdout_contradicts,
        "holdout_limit_p": HELD_OUT_FAILS,
        "where": [{**asdict(d), "words": drift_words(d)} for d in compared.drifts],
        "time_drift": [time_drift(one, compared) for one in compared.time_drifts],
        "noise_share": compared.noise_share,
        "far_off_limit": compared.far_off,
        "lone_row": lone_row(compared),
        "replicates_over_sd": replicates_over_sd(compared),
        "cautions": compared.cautions,
        "scatter": [
            {**asdict(one), "judgement": one.judgement or None, "words": scatter_words(one)}
            for one in compared.scatters
        ],
        "needed_setup_percent": compared.needed_setup_percent,
        "units": compared.units,
        "rows": [
            {**row_of(r), "sd_used": used.sd, "sd_from": used.why}
            for r, used in zip(compared.rows, _used_sds(compared), strict=True)
        ],
        "left_out": [
            {
                "rig": row.rig,
                "observable": row.observable,
                "conditions": dict(row.conditions),
                "value": row.value,
                "reason": row.reason,
            }
            for row in compared.left_out
        ],
        "warnings": list(compared.warnings),
    }


def time_drift(found: TimeDrift, compared: Comparison) -> dict:
    """How readings go with their order."""
    return {
        **asdict(found),
        "along": list(found.along),
        "words": time_drift_words(found, compared.units.get(found.observable, "")),
    }


def grade(compared: Comparison) -> dict:
    """How well a model fits in a graded word, the test that decides with its p, and the rule."""
    judgement = compared.judgement
    said = compared.judged is not None and judgement.by is not None
    return {
        "grade": judgement.grade if said else None,
        "by": judgement.by.of if judgement.by and said else None,
        "p": judgement.by.p if judgement.by and said else None,
        "rule": RULE,
    }


def lone_row(compared: Comparison) -> dict | None:
    """The row that alone keeps a model from fitting, and what is predicted for it without it."""
    found = compared.lone_row
    if found is None:
        return None
    own = next(r for r in compared.rows if r.row is found.row)
    told = {**row_of(own), "predicted": found.predicted, "residual": found.row.value - found.predicted, "z": None}
    return {
        **told,
        "grade": found.grade,
        "lack_of_fit_p": found.lack_of_fit_p,
        "unit": found.unit,
        "with_effects": list(found.with_effects),
    }


def replicates_over_sd(compared: Comparison) -> dict[str, dict[str, float]]:
    """{rig: {observable: how many times the stated sd its replicates scatter}}, where they contradict it."""
    found: dict[str, dict[str, float]] = {}
    for (rig, observable), times in compared.contradicted.items():
        found.setdefault(rig, {})[observable] = float(times)
    return found


def row_of(r: RowResidual) -> dict:
    """A row beside its prediction, with every column of the file that the fit uses."""
    row = r.row
    return {
        "line": row.line,
        "rig": row.rig,
        "observable": row.observable,
        "conditions": dict(row.conditions),
        "value": row.value,
        "predicted": r.predicted,
        "residual": r.residual,
        "z": r.z,
        "split": row.split,
        "sd": row.sd,
        "n": row.n,
        "setup": row.setup,
        "setup_sd": row.setup_sd,
        "order": row.order,
        "parameters": dict(row.parameters),
        "uncertainty": r.uncertainty,
        "uncertainty_readings": r.readings,
        "uncertainty_simulations": r.simulations,
        "units": dict(r.units),
    }


def measurement(row: Measurement) -> dict:
    """A row of the measurements, as the history keeps it."""
    return {
        "rig": row.rig,
        "observable": row.observable,
        "conditions": dict(row.conditions),
        "value": row.value,
        "n": row.n,
    }


def worst_of(rows: Sequence[RowResidual]) -> dict:
    """The row that is farthest off, and the same in words."""
    told = [row_of(r) for r in rows]
    worst = max(told, key=misfit)
    return {**worst, "words": row_words(worst, told)}


def check_surface(answer: dict, state: CalibratedStudy) -> list[str]:
    """Put `surface_check` {p, worst} into an answer (null where nothing is interpolated); returns warnings."""
    error = surface_error(state)
    answer["surface_check"] = None if error is None else {"p": error[0], "worst": error[1]}
    if error is None or error[0] >= SURFACE_FAILS:
        return []
    return [
        f"simulations at the calibrated point differ from the interpolated predictions (p = {error[0]:.2g}; worst: "
        f"{error[1]}); narrow min and max of the free parameters in study.toml, or raise effort"
    ]


def _used_sds(compared: Comparison) -> list[UsedSd]:
    """Standard deviations as the rows' uncertainties have them: of a row held out at its prediction."""
    at = {id(r.row): r.predicted for r in compared.rows if r.row.split == "holdout"}
    return used_sds([r.row for r in compared.rows], at)


def noise_floor(compared: Comparison) -> float | None:
    """What scatter alone leaves of a row, in the unit of `rms_error`: the median standard uncertainty; None where unknown.

    The median, as the mean square is ruled by a single imprecise row.
    """
    if any(r.uncertainty is None for r in compared.rows):
        return None
    if len({r.row.observable for r in compared.rows}) > 1:
        return 1.0
    known = [r.uncertainty for r in compared.rows if r.uncertainty]
    return statistics.median(known) if known else None


def noise_rms(compared: Comparison) -> float | None:
    """What `rms_error` would be if scatter alone were left: root mean square of the fitted rows' standard uncertainties."""
    fitted = [r for r in compared.rows if r.row.split == "fit"]
    known = [r.uncertainty for r in fitted if r.uncertainty]
    if not known or len(known) < len(fitted):
        return None
    if len({r.row.observable for r in compared.rows}) > 1:
        return 1.0
    return math.sqrt(statistics.fmean(u * u for u in known))


def tied(names: tuple[tuple[str, ...], ...]) -> list:
    """A single effect as its name, a pair as an inner list."""
    return [n[0] if len(n) == 1 else list(n) for n in names]


def proposal(proposed: NextMeasurement | None, compared: Comparison) -> dict | None:
    """The next measurement, with the units of its conditions and its observable."""
    if proposed is None:
        return None
    units = next((r.units for r in compared.rows if r.row.rig == proposed.rig), compared.units)
    names = (proposed.observable, *proposed.conditions)
    return {**asdict(proposed), "units": {name: units[name] for name in names if name in units}}


def outcome(found: Outcome) -> dict:
    """What an explanation would do to the error: an entry of `rivals`."""
    return {
        "effects": list(found.effects),
        "value": dict(found.values),
        "chi2": found.chi2,
        "dof": found.dof,
        "lack_of_fit_p": found.lack_of_fit_p,
        "rms_error": found.rms_error,
        "holdout_rms_error": found.holdout_rms_error,
        "holdout_p": found.holdout_p,
        "holdout_contradicts": found.holdout_contradicts,
    }


def present(compared: Comparison) -> dict:
    """The same of the model that is diagnosed."""
    names = ("chi2", "dof", "lack_of_fit_p", "rms_error", "holdout_rms_error", "holdout_p", "holdout_contradicts")
    return {name: getattr(compared, name) for name in names} | {"rms_error_unit": compared.rms_error_unit}


def nearest_miss(diagnosed: Diagnosis) -> dict | None:
    """What comes nearest to explaining the data where nothing does, why it is refused, and the row it leaves farthest off."""
    if diagnosed.miss is None:
        return None
    return {
        **outcome(diagnosed.miss),
        "refused": diagnosed.miss.refused,
        "worst_row": worst_of(diagnosed.miss.rows),
    }


def diagnosis(diagnosed: Diagnosis) -> dict:
    """Keys of `diagnose`."""
    compared, undone, too = diagnosed.comparison, diagnosed.undone, diagnosed.fitted_too
    return {
        "verdict": diagnosed.verdict,
        "effects": list(compared.effects),
        "chi2": compared.chi2,
        "fits": compared.judged,
        "fit": grade(compared),
        "lone_row": lone_row(compared),
        "replicates_over_sd": replicates_over_sd(compared),
        "missing": list(diagnosed.missing),
        "ranking": [
            {**asdict(s), "interval": list(s.interval) if s.interval else None, "units": units_of(compared, s.effect)}
            for s in diagnosed.ranking
        ],
        "tied": tied(diagnosed.tied),
        "present": present(compared),
        "rivals": [outcome(found) for found in diagnosed.outcomes],
        "nearest_miss": nearest_miss(diagnosed),
        "worst_row": worst_of(compared.rows),
        "holdout_p": compared.holdout_p,
        "holdout_contradicts": compared.holdout_contradicts,
        "holdout_limit_p": HELD_OUT_FAILS,
        "fitted_too": None if too is None else {**asdict(too), "effects": tied(too.effects)},
        "undone": None
        if undone is None
        else {**asdict(undone), "effects": tied(undone.effects), "units": units_in(compared, undone.by_rig)},
        "undone_tested": diagnosed.undone_tested,
        "by_time": [time_drift(one, compared) for one in diagnosed.by_time],
        "unordered": diagnosed.unordered,
        "faint": list(diagnosed.faint),
        "noise_share": compared.noise_share,
        "limited": None if diagnosed.limited is None else asdict(diagnosed.limited),
        "drifting": [
            {
                **asdict(one),
                "amounts": [list(item) for item in one.amounts.items()],
                "words": drifting_words(one, compared),
            }
            for one in diagnosed.drifting
        ],
        "next_measurement": proposal(diagnosed.next_measurement, compared),
        "alike_but_implausible": list(diagnosed.alike_but_implausible),
        "gate_p": diagnosed.gate_p,
        "gate_limit_p": diagnosed.gate,
        "warnings": list(dict.fromkeys(diagnosed.warnings)),
    }


def drifting_words(found: Drifting, compared: Comparison) -> str:
    """`air_drag only with a drag_factor that falls with drop_height_mm (rebound), from 1.2 at 20 to 0.7 at 450`."""
    (low, first), (high, last) = found.amounts.items()
    unit = compared.units.get(f"{found.effect}.{found.parameter}", "1")
    said = "" if unit in ("1", "") else f" {unit}"
    return (
        f"{found.effect} only with a {found.parameter} that would have to {found.way} with {found.condition} ({found.rig}), from "
        f"{number(first, 3)} at {number(low)} to {number(last, 3)}{said} at {number(high)}: the right kind of effect by another "
        "law, or a look-alike"
    )


def units_in(compared: Comparison, by_rig: Mapping[str, Mapping[str, float]]) -> dict[str, str]:
    """Units of observables, as declared."""
    names = {name for of_rig in by_rig.values() for name in of_rig}
    return {name: unit for name, unit in compared.units.items() if name in names}


def units_of(compared: Comparison, effect: str) -> dict[str, str]:
    """Units of an effect's parameters, as declared."""
    return {name.partition(".")[2]: unit for name, unit in compared.units.items() if name.startswith(f"{effect}.")}


def refinement(refined: Refinement) -> dict:
    """Keys of `refine`."""
    diagnoses = [diagnosis(d) for d in refined.diagnoses]
    last = (
        "rivals",
        "nearest_miss",
        "fit",
        "holdout_p",
        "holdout_contradicts",
        "holdout_limit_p",
        "fitted_too",
        "undone",
        "drifting",
        "by_time",
        "unordered",
        "faint",
        "noise_share",
        "limited",
        "undone_tested",
        "lone_row",
    )
    return {
        "verdict": refined.verdict,
        "added": list(refined.added),
        "tied": tied(refined.tied),
        **{name: diagnoses[-1][name] for name in last},
        "steps": [comparison(c) for c in refined.steps],
        "diagnoses": diagnoses,
        "next_measurement": proposal(
            refined.last.next_measurement or refined.diagnoses[0].next_measurement, refined.steps[-1]
        ),
        "warnings": list(dict.fromkeys(w for d in refined.diagnoses for w in d.warnings)),
    }
