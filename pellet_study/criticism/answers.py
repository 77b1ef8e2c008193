"""The machine-readable form of each answer, and the history a study keeps of what was done."""

import math
from dataclasses import asdict

from pellet_study.criticism.calibration import CalibratedStudy, surface_error
from pellet_study.criticism.compare import Comparison
from pellet_study.criticism.diagnose import Diagnosis
from pellet_study.criticism.facts import drift_words
from pellet_study.criticism.next_measurement import NextMeasurement
from pellet_study.criticism.refine import Refinement

SURFACE_FAILS = 0.005


def comparison(found: Comparison) -> dict:
    """A model beside the measurements: keys of `compare`, `add`, `drop`, and of each step of `refine` and `history`."""
    return {
        "effects": list(found.effects),
        "parameters": found.parameters,
        "intervals": {name: list(limits) for name, limits in found.intervals.items()},
        "chi2": found.chi2,
        "dof": found.dof,
        "lack_of_fit_p": found.lack_of_fit_p,
        "rms_error": found.rms_error,
        "holdout_rms_error": found.holdout_rms_error,
        "rms_error_unit": found.rms_error_unit,
        "noise_floor": noise_floor(found),
        "level_out_rms_error": found.level_out_rms_error,
        "not_identified": list(found.not_identified),
        "at_bound": list(found.at_bound),
        "fits": found.judged,
        "holdout_p": found.holdout_p,
        "where": [{**asdict(d), "words": drift_words(d)} for d in found.drifts],
        "needed_setup_percent": found.needed_setup_percent,
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
            for r in found.rows
        ],
        "warnings": list(found.warnings),
    }


def check_surface(answer: dict, state: CalibratedStudy) -> list[str]:
    """Put `surface_check` {p, worst} into an answer (null where nothing is interpolated); returns warnings."""
    found = surface_error(state)
    answer["surface_check"] = None if found is None else {"p": found[0], "worst": found[1]}
    if found is None or found[0] >= SURFACE_FAILS:
        return []
    return [
        f"simulations at the calibrated point differ from the interpolated predictions (p = {found[0]:.2g}; worst: "
        f"{found[1]}); narrow min and max of the free parameters in study.toml, or raise effort"
    ]


def noise_floor(found: Comparison) -> float | None:
    """The rms error that the scatter of the readings alone gives, in the unit of `rms_error`; None where unknown."""
    if any(r.z is None for r in found.rows):
        return None
    if len({r.row.observable for r in found.rows}) > 1:
        return 1.0
    squares = [(r.residual / r.z) ** 2 for r in found.rows if r.z != 0]
    return math.sqrt(sum(squares) / len(squares)) if squares else None


def tied(names: tuple[tuple[str, ...], ...]) -> list:
    """A single effect as its name, a pair as an inner list."""
    return [n[0] if len(n) == 1 else list(n) for n in names]


def proposal(found: NextMeasurement | None) -> dict | None:
    """The next measurement."""
    return None if found is None else asdict(found)


def diagnosis(found: Diagnosis) -> dict:
    """Keys of `diagnose`."""
    return {
        "verdict": found.verdict,
        "effects": list(found.comparison.effects),
        "chi2": found.comparison.chi2,
        "missing": list(found.missing),
        "ranking": [{**asdict(s), "interval": list(s.interval) if s.interval else None} for s in found.ranking],
        "tied": tied(found.tied),
        "next_measurement": proposal(found.next_measurement),
        "alike_but_implausible": list(found.alike_but_implausible),
        "gate_p": found.gate_p,
        "warnings": list(dict.fromkeys(found.warnings)),
    }


def refinement(found: Refinement) -> dict:
    """Keys of `refine`."""
    return {
        "verdict": found.verdict,
        "added": list(found.added),
        "tied": tied(found.tied),
        "steps": [comparison(c) for c in found.steps],
        "diagnoses": [diagnosis(d) for d in found.diagnoses],
        "next_measurement": proposal(found.last.next_measurement or found.diagnoses[0].next_measurement),
        "warnings": list(dict.fromkeys(w for d in found.diagnoses for w in d.warnings)),
    }
