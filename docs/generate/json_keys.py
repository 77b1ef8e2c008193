"""Keys of the JSON answers: their names from answers of today's code, their meaning from here; one without the other is an error."""

import contextlib
import io
import json
import shutil
import tempfile
from pathlib import Path

from pellet_study.__main__ import main

FIT = {
    "chi2": "of the rows fitted; null where neither sd nor replicates tell their scatter",
    "dof": "rows fitted less free constants",
    "lack_of_fit_p": "p that cell means are as far off as readings scatter",
    "rms_error": "sqrt(mean((measured - predicted)^2)) of the rows fitted, unweighted, in `rms_error_unit`",
    "holdout_rms_error": "the same of the rows held out",
    "rms_error_unit": "the observable's unit, or standard uncertainties where a study has several observables",
    "holdout_p": "p of all rows held out together, the uncertainty of the constants included",
    "holdout_contradicts": "true where the rows held out refute the model",
    "holdout_limit_p": "the p below which they do",
    "effects": "names of the effects in the model",
    "fits": "does the model fit? a doubtful fit does; null where the data cannot say",
    "fit": "the grade (fits, doubtful, does not fit), the test that decides, its p, and the rule",
    "rows": "the rows of the file beside their predictions; `z` is the residual in standard errors",
    "warnings": "what the reader must know beside the answer",
    "assumed": "{condition or parameter: default} of what no file of the study gives",
    "curves": "lines of the figure `readings`: of the model, and of each explanation",
    "basis": "hash of the rows and of the code of rigs of one's own: answers of another basis are not shown beside these",
    "noise_share": "{rig: variance of its simulations over that of its readings}",
    "lone_row": "the row without which a model that does not fit does",
    "replicates_over_sd": "{rig: {observable: how many times the stated sd its replicates scatter}}, where they contradict it",
    "surface_check": "p that simulations at the calibrated point agree with the interpolated predictions; null in closed form",
    "verdict": "adequate, missing, tied, undecided or unexplained: [how it is reached](../method.md)",
    "tied": "effects that explain alike, the best first; a pair is an inner list",
    "rivals": "what each explanation named would do to the error",
    "nearest_miss": "where nothing explains: what comes nearest, why it is refused, and the row it leaves farthest off",
    "fitted_too": "rows held out that, fitted too, would let an effect be named",
    "undone": "the least set-up scatter, declared nowhere, that would undo the verdict; null where none up to one standard error does",
    "undone_tested": "whether that was looked for",
    "drifting": "effects that explain only with an amount that drifts: near misses",
    "by_time": "drifts of readings with their order that explain as well",
    "unordered": "true where no row says when it was taken",
    "limited": "where simulations scatter too much for a verdict: the rig, by how much, and what more of them would take",
    "next_measurement": "the measurement that would tell the rivals apart, with what each predicts; null where none does",
    "parameters": "the calibrated constants, {name: value}, those of effects as `effect.parameter`",
    "units": "units as declared, {name: unit}",
}  # fmt: skip
COMPARE = {
    "intervals": "{constant: [low, high]}, 95 %, cut at the bounds",
    "noise_floor": "what scatter alone leaves of a row: the median standard uncertainty, in the unit of `rms_error`",
    "level_out_rms_error": "{rig.condition: rms error of each level predicted from the others}",
    "not_identified": "constants whose 95 % interval takes half of their range or more",
    "at_bound": "constants that ended at a bound of their range",
    "ranges": "{constant: [min, max]} in study.toml",
    "range_shares": "{constant: share of its range that the uncut 95 % interval takes}",
    "rig_lack_of_fit_p": "{rig: p of lack of fit of its own cells}",
    "where": "constants that would have to drift with a condition, the worst first",
    "time_drift": "drift of each observable with the order of its readings, the worst first",
    "far_off_limit": "standard errors from which on a row is named as far off",
    "cautions": "{constant: what not to do with its value}",
    "scatter": "scatter of readings beside that of simulations from seed to seed",
    "needed_setup_percent": "{rig: set-up scatter, percent of the reading, that would excuse its misfit}",
    "left_out": "rows of split `leave_out`, with their reason",
}
DIAGNOSE = {
    "missing": "the explanation that stands out; empty unless the verdict is missing",
    "ranking": "every candidate, the best first: score in standard errors, p, p adjusted for the number of candidates, drop of chi2, "
    "fitted value, the least amount that these data would show, and what speaks against it",
    "present": "the present model's error",
    "worst_row": "the row that is farthest off",
    "alike_but_implausible": "effects that would explain as well at a size beyond their physical range",
    "gate_p": "p of the largest score over all candidates",
    "gate_limit_p": "the p below which a candidate is needed",
    "by_level": "the constant that drifts most, fitted level by level, and what the rivals make of it",
}
REFINE = {
    "added": "effects that were added, and written into study.toml by the command",
    "steps": "the model after each addition, the keys of `compare`; the first as it came",
    "diagnoses": "the diagnosis of each step, the keys of `diagnose`",
}
CHECK = {
    "title": "of the study",
    "rigs": "what each rig's rows are",
    "parameters": "every parameter: free, fixed or assumed, and where it is known",
    "effects": "effects present",
    "candidates": "each effect that may be missing: where it shows, from which amount on these rows would notice it, and what it needs",
    "advice": "what would make the answers worth more",
}
DESIGN = {
    "effects": "{term: effect}, from the low level to the high one",
    "anova": "the analysis of variance",
    "coefficients": "{term: coefficient} in coded units; `1` is the mean or intercept",
    "standard_errors": "of the coefficients",
    "r2": "share of the variance that the model explains",
    "r2_adjusted": "the same, corrected for the number of terms",
    "r2_predicted": "1 - PRESS/SST",
    "cv_percent": "100 sqrt(MSE)/mean",
    "lack_of_fit_p": "p of lack of fit against replicates; null without them",
    "p": "{term: p}",
    "alpha": "level of the tests",
    "saturated": "true where no degree of freedom is left for error",
    "runs": "number of runs analysed",
    "design": "the kind of design that was recognised",
    "response": "name of the response",
    "factors": "names, levels and units",
    "lenth": "Lenth's margins, of a saturated design",
    "blocks": "{block: effect}, where there are any",
    "left_out": "columns that are no factors",
    "suspect_runs": "runs far from what the others predict",
    "orthogonal": "whether effects are estimated independently",
    "standard_error_inflation": "{term: standard error over that of the orthogonal design}",
    "vif": "{term: variance inflation factor}",
    "warnings": "what the reader must know beside the answer",
    "p_adjusted": "{term: p adjusted for the number of terms}",
    "sums_of_squares": "{term: sum of squares}",
    "contributions_percent": "{term: share of the sum of squares}",
    "curvature": "of the centre points against the corners",
    "detectable_effects": "{term: effect that `power` of such designs would find}",
    "power": "the power those are for",
    "interactions": "two-factor interactions that are fitted, because the runs tell them apart",
    "contrasts": "{what it holds: contrast} of what no term has, in a complete regular design",
    "noise_contrasts": "columns of no term, from which error is estimated",
    "block_confounded": "{effect: share of it that lies between the blocks}, 1 where it cannot be told from them",
    "aliases": "{term: interactions, not fitted, that are added to its effect}",
    "coefficients_physical": "{term: coefficient} in the factors' units",
    "press": "sum of squared leave-one-out residuals",
    "adequate_precision": "range of the predictions over their mean standard error",
    "leverage": "of each run",
    "cooks_distance": "of each run",
    "studentized_residuals": "of each run, externally",
    "residuals": "of each run",
    "fitted": "of each run",
    "normality": "Shapiro and Wilk's test of the residuals",
    "box_cox": "the power that would make the residuals normal, with its interval",
    "stationary_point": "where the surface is level, and whether that is a maximum, a minimum or a saddle",
    "optimum": "the settings that meet the target, and how much of the box does",
}  # fmt: skip
AUDIT = {
    "rows": "every number recomputed: printed, recomputed, verdict, reason",
    "counts": "{verdict: how many}",
}
MEANINGS = {
    "check": {**FIT, **CHECK},
    "compare, add, drop": {**FIT, **COMPARE},
    "diagnose": {**FIT, **DIAGNOSE},
    "refine": {**FIT, **REFINE},
    "history": REFINE,
    "pb": DESIGN,
    "bbd": DESIGN,
    "audit": AUDIT,
    "init": {"path": "of the study", "files": "that were written"},
    "report": {"path": "of the page, absolute"},
}


def answers(root: Path, folder: Path) -> dict[str, dict]:
    """The JSON of commands that need no YADE, on copies in a folder."""
    study, paper = folder / "wet_beads", root / "results" / "paper"
    study.mkdir()
    for name in ("study.toml", "measurements.csv"):
        shutil.copy(root / "results" / "wet_beads" / name, study)
    calls = {
        "check": ["check", study],
        "compare, add, drop": ["compare", study],
        "diagnose": ["diagnose", study],
        "refine": ["refine", study],
        "history": ["history", study],
        "pb": ["pb", paper / "table07_design.csv"],
        "bbd": ["bbd", paper / "table12_design.csv", "--target", "41.69", "--uncertainty", "0.79"],
        "audit": ["audit"],
        "init": ["init", folder / "new"],
        "report": ["report", study],
    }
    found = {}
    for command, words in calls.items():
        file = folder / "answer.json"
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()) as said:
            status = main([*map(str, words), "--json", str(file)])
        if status:
            raise RuntimeError(f"{command}: {said.getvalue()}")
        found[command] = json.loads(file.read_text())
        file.unlink()
    return found


def inner(value: object) -> str:
    """Names of what an entry is made of, where these are the same in every answer."""
    first = value[0] if isinstance(value, list) and value else None
    return ", ".join(f"`{name}`" for name in first) if isinstance(first, dict) else ""


def tables(root: Path) -> dict[str, list[tuple[str, str, str]]]:
    """{command: rows of key, meaning, inner keys}.

    Raises
    ------
    KeyError : a key that has no meaning here
    """
    with tempfile.TemporaryDirectory() as folder:
        found = answers(root, Path(folder))
    of_steps = ("steps", "diagnoses")  # whose keys have a table of their own
    return {
        command: [
            (f"`{key}`", MEANINGS[command][key], "" if key in of_steps else inner(value))
            for key, value in answer.items()
        ]
        for command, answer in found.items()
    }
