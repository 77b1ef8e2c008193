"""Compare, diagnose, add, drop, refine: the steps of model criticism, each from a study to an answer.

Nothing is written unless `write=True`, which leaves in the study's folder what the command of that name leaves there.
Rigs on YADE simulate; finished simulations are kept in the folder's `.store`, so such a study needs a folder.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from pellet_study.api.answers import Comparison, Diagnosis, Refinement
from pellet_study.criticism import answers, outlying, text
from pellet_study.criticism.by_level import by_level
from pellet_study.criticism.calibration import CalibratedStudy, fit_study
from pellet_study.criticism.compare import Comparison as Fitted
from pellet_study.criticism.compare import compare as compare_rows
from pellet_study.criticism.curves import curves_named, curves_of
from pellet_study.criticism.diagnose import GATE
from pellet_study.criticism.diagnose import Diagnosis as Diagnosed
from pellet_study.criticism.diagnose import diagnose as rank
from pellet_study.criticism.noise import undecided
from pellet_study.criticism.refine import refine as refine_study
from pellet_study.criticism.robustness import examined
from pellet_study.criticism.spread import scatters
from pellet_study.errors import InputError
from pellet_study.output.words import nearest, number
from pellet_study.study import history
from pellet_study.study.edit import erase_effect, write_effect
from pellet_study.study.measured import measured as put_in
from pellet_study.study.measurements import Measurement
from pellet_study.study.study import Setting, Study, check


def compare(study: Study, *, write: bool = False) -> Comparison:
    """Calibrate the present model and hold it against every row.

    Parameters
    ----------
    write : leave compare.txt and compare.json in the study's folder

    Raises
    ------
    InputError : everything is held out, or there are more free parameters than rows; `write` without a folder
    SimulationError : simulations failed that the answer needs

    Examples
    --------
    >>> import pellet_study as ps
    >>> answer = ps.compare(ps.load_study("results/wet_beads"))
    >>> answer.fits
    False
    """
    state = fit_study(study)
    found = replace(compare_rows(study, state, level_out=True), scatters=scatters(state))
    found = replace(found, warnings=(*found.warnings, *outlying.told(study, _compared)))
    answer = {
        **answers.comparison(found),
        "assumed": study.assumed,
        "basis": study.basis,
        "curves": [*_curves_without_effects(study, state), curves_of(state, found)],
    }
    interpolation = answers.check_surface(answer, state)
    page = text.comparison_page(study, found)
    if write:
        history.leave(folder_of(study), "compare", page, answer)
    return Comparison(answer, page, study, interpolation)


def diagnose(study: Study, *, write: bool = False) -> Diagnosis:
    """Rank the effects that the model lacks; the study stays as it is.

    Parameters
    ----------
    write : leave diagnose.txt and diagnose.json in the study's folder

    Raises
    ------
    InputError, SimulationError : as `compare`

    Examples
    --------
    >>> import pellet_study as ps
    >>> answer = ps.diagnose(ps.load_study("results/caco3"))
    >>> print(answer.verdict, answer.missing)
    adequate []
    """
    state = fit_study(study)
    found = examined(study, state, undecided(study, state, _ranked(study, state), GATE), GATE)
    found = replace(found, warnings=(*found.warnings, *outlying.told(study, _diagnosed)))
    answer = {
        **answers.diagnosis(found),
        "by_level": by_level(state, found),
        "assumed": study.assumed,
        "basis": study.basis,
        "curves": curves_named(state, found),
    }
    page = text.diagnosis_page(study, found)
    if write:
        history.leave(folder_of(study), "diagnose", page, answer)
    return Diagnosis(answer, page, study)


def next_measurement(study: Study) -> dict[str, Any] | None:
    """The measurement that would best tell the tied explanations apart, or show what is missing; None where none is needed.

    Returns
    -------
    {rig, observable, conditions, predictions, uncertainties}; units stand in the names

    Raises
    ------
    InputError, SimulationError : as `compare`
    """
    return diagnose(study).next_measurement


def add(study: Study, effect: str, *, write: bool = False) -> Comparison:
    """The study with one effect more, recalibrated; `answer.study` is that study, `answer.before` the model without it.

    Parameters
    ----------
    effect : name of an effect that acts in the rigs used
    write : put the effect into study.toml with its fitted value; leave compare.txt, compare.json and a step of the history

    Raises
    ------
    InputError : it is there already, unknown, or acts in none of the rigs used; else as `compare`
    SimulationError : as `compare`
    """
    if effect in study.effects:
        if not write or history.recorded(folder_of(study), list(study.effects)):
            raise InputError(f"{effect} is in [effects] already")
        study = study.without_effect(effect)  # an `add` that was stopped after study.toml is finished
    if effect not in study.acting():
        study.catalogue.effect(effect, rigs=study.rigs)
        raise InputError(
            f"{effect} acts in none of the rigs used ({', '.join(study.rigs)}){nearest(effect, study.acting())}"
        )
    larger = study.with_effect(effect)
    check(larger)
    before, after = _calibrated(study), _calibrated(larger)
    fitted = {
        name: Setting(after[1].parameters[f"{effect}.{name}"], setting.low, setting.high)
        for name, setting in larger.effects[effect].items()
    }
    if write:
        write_effect(folder_of(study) / "study.toml", effect, fitted)
    return _both(larger, before, after, write)


def drop(study: Study, effect: str, *, write: bool = False) -> Comparison:
    """The study with one effect less, recalibrated; `answer.study` is that study, `answer.before` the model with it.

    Parameters
    ----------
    effect : name of an effect in [effects]
    write : take it out of study.toml; leave compare.txt, compare.json and a step of the history

    Raises
    ------
    InputError : it is not there; else as `compare`
    SimulationError : as `compare`
    """
    if effect not in study.effects:
        raise InputError(f"{effect} is not in [effects]{nearest(effect, study.effects)}")
    before, smaller = _calibrated(study), study.without_effect(effect)
    check(smaller)
    after = _calibrated(smaller)
    if write:
        erase_effect(folder_of(study) / "study.toml", effect)
    return _both(smaller, before, after, write)


BUDGET = 5.0  # minutes of a processor, for more simulations where a verdict hangs on their scatter


def refine(
    study: Study, *, write: bool = False, budget: float = BUDGET, measured: Sequence[Measurement] = ()
) -> Refinement:
    """Compare, diagnose, add, again, until the verdict is adequate, tied or unexplained.

    Parameters
    ----------
    budget : minutes of a processor that may go into more simulations where a verdict hangs on the scatter of those there are;
        asked again, it goes on from what is stored
    measured : rows of the study that are new since the last answer (`measure`), for the history
    write : put what was added into study.toml; leave refine.txt, refine.json, compare.txt, compare.json and the history

    Raises
    ------
    InputError, SimulationError : as `compare`

    Examples
    --------
    >>> import pellet_study as ps
    >>> answer = ps.refine(ps.load_study("results/wet_beads"))
    >>> print(answer.verdict, answer.added)
    adequate ['cohesion']
    """
    found = refine_study(study, budget_s=60 * budget)
    ended = found.diagnoses[-1]
    ended = replace(ended, warnings=(*ended.warnings, *outlying.told(study, _refined)))
    found = replace(found, diagnoses=(*found.diagnoses[:-1], ended))
    found = replace(found, steps=(*found.steps[:-1], replace(found.steps[-1], scatters=scatters(found.state))))
    answer = {**answers.refinement(found), "assumed": found.study.assumed, "basis": study.basis}
    interpolation = answers.check_surface(answer, found.state)
    answer["diagnoses"][0]["by_level"] = by_level(found.first, found.diagnoses[0])
    for told, compared in zip(answer["steps"], found.steps, strict=True):
        told |= {"curves": [curves_of(found.first, compared)], "basis": study.basis}
    for told, diagnosed in zip(answer["diagnoses"], found.diagnoses, strict=True):
        told["curves"] = curves_named(found.first, diagnosed)
    if measured:
        answer["steps"][0]["measured"] = [answers.measurement(row) for row in measured]
    page = text.refinement_page(study, found, answer["steps"])
    if write:
        folder = folder_of(study)
        for name in found.added:
            write_effect(folder / "study.toml", name, found.study.effects[name])
        begun = history.record(folder, answer["steps"])
        interpolation = [*interpolation, *filter(None, [begun])]
        history.leave(folder, "refine", page, answer)
        last = text.comparison_page(found.study, found.steps[-1])
        history.leave(folder, "compare", last, {**answer["steps"][-1], "assumed": found.study.assumed})
    return Refinement(answer, page, found.study, interpolation)


def measure(folder: Path, file: Path, library: Path | None = None) -> tuple[Measurement, ...]:
    """Put readings taken since, a file written as measurements.csv is, into a study's measurements; returns them.

    Raises
    ------
    InputError : they cannot be used, alone or together with those there are; nothing is written then
    """
    return put_in(Path(folder), Path(file), library)


def _compared(study: Study) -> str:
    """What `compare` says of a study, in a few words."""
    found = compare_rows(study)
    chi2 = f"rms {number(found.rms_error, 3)}" if found.chi2 is None else f"chi2 = {found.chi2:.4g} on {found.dof}"
    fit = {True: "the model fits", False: "the model fails", None: "how well it fits cannot be judged"}[found.judged]
    return f"{chi2}, {fit}"


def _diagnosed(study: Study) -> str:
    """What `diagnose` says of a study, in a few words."""
    return _verdict(answers.diagnosis(rank(study, fit_study(study))))


def _refined(study: Study) -> str:
    """What `refine` says of a study, in a few words."""
    found = refine_study(study)
    return _verdict(answers.diagnosis(found.diagnoses[-1])) + (
        f", added {', '.join(found.added)}" if found.added else ""
    )


def _verdict(answer: dict[str, Any]) -> str:
    names = answer["tied"] or answer.get("missing") or []
    words = " or ".join(" + ".join(name) if isinstance(name, list | tuple) else str(name) for name in names)
    return f"{answer['verdict']}{': ' + words if words else ''}"


def folder_of(study: Study) -> Path:
    """The folder in which a study's answers are kept.

    Raises
    ------
    InputError : the study has none
    """
    if study.folder is None:
        raise InputError("write=True: the study has no folder; give study(..., folder=FOLDER), or load_study(FOLDER)")
    return study.folder


def _calibrated(study: Study) -> tuple[CalibratedStudy, Fitted]:
    """A study's fit, and its rows beside it."""
    state = fit_study(study)
    return state, compare_rows(study, state, level_out=True)


def _ranked(study: Study, state: CalibratedStudy) -> Diagnosed:
    """The ranking of what is missing, with the unit of a column that would explain the misfit."""
    return rank(study, state, comparison=compare_rows(study, state, other_units=True))


def _curves_without_effects(study: Study, state: CalibratedStudy) -> list[dict]:
    """The curves of the model without any effect.

    Of rigs that simulate they are those that the history keeps of the same readings, as simulating anew would cost too much.
    """
    if not study.effects:
        return []
    if state.model.scatters:
        told = history.read_history(study.folder) if study.folder else []
        values = [row.value for row in study.rows]
        same = [s for s in told if not s["effects"] and [r["value"] for r in s.get("rows", [])] == values]
        return same[-1].get("curves", []) if same else []
    owned = {name for effect in study.effects for name in study.catalogue.effect(effect).owns}
    kept = {name: setting for name, setting in study.parameters.items() if name not in owned}
    base = replace(study, effects={}, parameters=kept)
    state = fit_study(base)
    return [curves_of(state, compare_rows(base, state))]


def _both(
    study: Study, before: tuple[CalibratedStudy, Fitted], after: tuple[CalibratedStudy, Fitted], write: bool
) -> Comparison:
    """The answer of `add` and `drop`: the new model, with the old one as `before`."""
    steps = [
        {**answers.comparison(compared), "curves": [curves_of(state, compared)], "basis": study.basis}
        for state, compared in (before, after)
    ]
    page = text.fold([text.comparison_page(study, after[1]), "", *text.ladder(steps)])
    answer = {**steps[1], "assumed": study.assumed}
    unsaid: list[str] = []
    if write:
        unsaid += filter(None, [history.record(folder_of(study), steps)])
        history.leave(folder_of(study), "compare", page, answer)
    return Comparison({**answer, "before": steps[0]}, page, study, unsaid)
