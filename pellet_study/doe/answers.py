"""The analyses as plain data (numbers, strings, lists, dicts; None where undefined), ready for JSON."""

from dataclasses import asdict, fields, is_dataclass

import numpy as np
import pandas as pd

from pellet_study.doe.blocks import offsets
from pellet_study.doe.box_behnken import Surface
from pellet_study.doe.intervals import Interval
from pellet_study.doe.optimum import TargetSet
from pellet_study.doe.path_turning import Turning
from pellet_study.doe.plackett_burman import Screening
from pellet_study.doe.plackett_burman import vif as screening_vif
from pellet_study.doe.published_designs import design_of
from pellet_study.doe.steepest_climb import Climb
from pellet_study.doe.validation import Equivalence


def plain(value):
    """Numpy, pandas and dataclass values as built-in types; NaN and infinities become None."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, pd.DataFrame):
        return plain(value.to_dict(orient="records"))
    if isinstance(value, list | tuple | np.ndarray | pd.Series):
        return [plain(item) for item in value]
    if is_dataclass(value):
        return plain({field.name: getattr(value, field.name) for field in fields(value)})
    if isinstance(value, np.bool_):
        return bool(value)
    if isinstance(value, int | np.integer) and not isinstance(value, bool):
        return int(value)
    if isinstance(value, float | np.floating):
        return float(value) if np.isfinite(value) else None
    return value


def _common(analysis: Screening | Surface) -> dict:
    return {
        "effects": analysis.effects,
        "anova": analysis.anova,
        "coefficients": analysis.model.coefficients,
        "standard_errors": analysis.model.standard_errors,
        "r2": analysis.r2,
        "r2_adjusted": analysis.r2_adjusted,
        "r2_predicted": analysis.r2_predicted,
        "cv_percent": analysis.cv_percent,
        "lack_of_fit_p": analysis.lack_of_fit_p,
        "p": analysis.p,
        "alpha": analysis.alpha,
        "saturated": analysis.saturated,
        "runs": len(analysis.table.response),
        "design": design_of(analysis.table),
        "response": str(analysis.table.response.name),
        "factors": [asdict(factor) for factor in analysis.table.factors],
        "lenth": analysis.lenth,
        "blocks": _blocks(analysis),
        "left_out": analysis.table.left_out,
        "suspect_runs": [
            {"row": analysis.table.lines[place], "r_student": value}
            for place, value in analysis.model.suspects(analysis.alpha)
        ],
    }


def _blocks(analysis: Screening | Surface) -> dict[str, dict[str, float]]:
    """{column: {block: its level above the mean of the blocks}}."""
    columns = dict(zip(analysis.model.columns, analysis.model.results.params, strict=True))
    return offsets(analysis.table.blocks, columns)


def screening_answer(screening: Screening) -> dict:
    """The answer of `pb`; all in coded units (-1, +1), effects and coefficients in the response's unit."""
    return plain(
        {
            **_common(screening),
            "p_adjusted": screening.p_adjusted,
            "sums_of_squares": screening.sums_of_squares,
            "contributions_percent": screening.contributions,
            "curvature": screening.curvature,
            "detectable_effects": screening.detectable_effects,
            "power": screening.power,
            "interactions": screening.interactions,
            "contrasts": screening.contrasts,
            "noise_contrasts": screening.noise_contrasts,
            "block_confounded": screening.block_confounded,
            "aliases": screening.aliases,
            "orthogonal": screening.orthogonal,
            "standard_error_inflation": screening.standard_error_inflation,
            "vif": screening_vif(screening),
        }
    )


def surface_answer(surface: Surface) -> dict:
    """The answer of `bbd`; all in coded units but `coefficients_physical`."""
    stationary = surface.stationary
    return plain(
        {
            **_common(surface),
            "coefficients_physical": surface.physical_coefficients,
            "press": surface.press,
            "orthogonal": surface.orthogonal,
            "standard_error_inflation": surface.standard_error_inflation,
            "adequate_precision": surface.adequate_precision,
            "vif": surface.vif,
            "leverage": surface.runs.leverage,
            "cooks_distance": surface.runs.cooks_distance,
            "studentized_residuals": surface.runs.studentized,
            "residuals": surface.runs.residuals,
            "fitted": surface.runs.fitted,
            "normality": surface.normality and dict(zip(("w", "p"), surface.normality, strict=True)),
            "box_cox": surface.box_cox,
            "stationary_point": stationary
            and {
                "coded": dict(zip(surface.table.names, stationary.coded, strict=True)),
                "predicted": stationary.predicted,
                "eigenvalues": stationary.eigenvalues,
                "kind": stationary.kind,
            },
        }
    )


def interval_answer(found: Interval) -> dict:
    """A prediction with its intervals."""
    return plain(found)


def target_answer(found: TargetSet) -> dict:
    """The settings that hit a target."""
    names = found.surface.table.names
    return plain(
        {
            "target": found.target,
            "uncertainty": found.uncertainty,
            "reachable": found.reachable,
            "reachable_within_uncertainty": found.reachable_within_uncertainty,
            "lowest": found.lowest,
            "highest": found.highest,
            "fraction_of_box": found.fraction,
            "fraction_within_one_percent": found.fraction_one_percent,
            "fraction_not_excluded": found.fraction_not_excluded,
            "extents": found.extents,
            "sheet_extents": found.sheet_extents,
            "unidentified": found.unidentified,
            "rule": found.rule_in_words,
            "coded": dict(zip(names, found.coded, strict=True)),
            "physical": found.physical,
            "prediction": found.prediction,
            "measurements": [
                {
                    "what": option.what,
                    "coded": None if option.coded is None else dict(zip(names, option.coded, strict=True)),
                    "fraction_not_excluded": option.fraction,
                }
                for option in found.measurements
            ],
        }
    )


def climb_answer(climb: Climb) -> dict:
    """The points of a path and the response predicted there."""
    return plain(
        {
            "points": climb.points,
            "predicted": climb.predicted,
            "prediction_intervals": climb.prediction_intervals,
            "points_asked": climb.points_asked,
            "equal_steps": climb.equal_steps,
            "angle_to_gradient_deg": climb.angle_to_gradient_deg,
        }
    )


def turning_answer(turning: Turning) -> dict:
    """Where a path turned."""
    return plain(turning)


def equivalence_answer(found: Equivalence) -> dict:
    """The equivalence test beside the t test."""
    return plain({**asdict(found), "p": found.p, "equivalent": found.equivalent, "different": found.different})
