"""The machine-readable form of each answer."""

import statistics
from dataclasses import asdict

from pellet_study.criticism.calibration import CalibratedStudy, surface_error
from pellet_study.criticism.compare import Comparison
from pellet_study.criticism.diagnose import Diagnosis
from pellet_study.criticism.facts import drift_words
from pellet_study.criticism.next_measurement import NextMeasurement
from pellet_study.criticism.refine import Refinement

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
        "level_out_rms_error": compared.level_out_rms_error,
        "not_identified": list(compared.not_identified),
        "at_bound": list(compared.at_bound),
        "fits": compared.judged,
        "holdout_p": compared.holdout_p,
        "where": [{**asdict(d), "words": drift_words(d)} for d in compared.drifts],
        "needed_setup_percent": compared.needed_setup_percent,
        "rows": [
            {
                "rig": r.row.rig,
                "observable": r.row.observable,
                "conditions": dict(r.row.conditions),
                "value": r.row.value,
                "predicted": r.predicted,
                "residual": r.residual,
                "z": r.z,
                "split": r.row.split,
            }
            for r in compared.rows
        ],
        "warnings": list(compared.warnings),
    }


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


def noise_floor(compared: Comparison) -> float | None:
    """What scatter alone leaves of a row, in the unit of `rms_error`: the median standard uncertainty; None where unknown.

    The median, as the mean square is ruled by a single imprecise row.
    """
    if any(r.z is None for r in compared.rows):
        return None
    if len({r.row.observable for r in compared.rows}) > 1:
        return 1.0
    known = [abs(r.residual / r.z) for r in compared.rows if r.z]
    return statistics.median(known) if known else None


def tied(names: tuple[tuple[str, ...], ...]) -> list:
    """A single effect as its name, a pair as an inner list."""
    return [n[0] if len(n) == 1 else list(n) for n in names]


def proposal(proposed: NextMeasurement | None) -> dict | None:
    """The next measurement."""
    return None if proposed is None else asdict(proposed)


def diagnosis(diagnosed: Diagnosis) -> dict:
    """Keys of `diagnose`."""
    return {
        "verdict": diagnosed.verdict,
        "effects": list(diagnosed.comparison.effects),
        "chi2": diagnosed.comparison.chi2,
        "missing": list(diagnosed.missing),
        "ranking": [{**asdict(s), "interval": list(s.interval) if s.interval else None} for s in diagnosed.ranking],
        "tied": tied(diagnosed.tied),
        "next_measurement": proposal(diagnosed.next_measurement),
        "alike_but_implausible": list(diagnosed.alike_but_implausible),
        "gate_p": diagnosed.gate_p,
        "warnings": list(dict.fromkeys(diagnosed.warnings)),
    }


def refinement(refined: Refinement) -> dict:
    """Keys of `refine`."""
    return {
        "verdict": refined.verdict,
        "added": list(refined.added),
        "tied": tied(refined.tied),
        "steps": [comparison(c) for c in refined.steps],
        "diagnoses": [diagnosis(d) for d in refined.diagnoses],
        "next_measurement": proposal(refined.last.next_measurement or refined.diagnoses[0].next_measurement),
        "warnings": list(dict.fromkeys(w for d in refined.diagnoses for w in d.warnings)),
    }
