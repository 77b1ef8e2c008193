"""Answers as objects: the keys of a command's JSON as attributes, a table as a data frame, the page as text."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from pellet_study.study.study import Study

if TYPE_CHECKING:
    import pandas as pd


class Answer:
    """What a command answers.

    Every key of the command's JSON is an attribute with the same value (`answer.chi2`); `dict(answer.json)` has them all.

    Attributes
    ----------
    json : the answer as the command's `--json` writes it
    assumed : {condition or parameter: default} of what the answer rests on and no file of the study gives
    page : the page that the command prints; `print(answer)` shows it
    study : the study that was asked, in `Refinement` with the effects that were added
    unsaid : warnings that do not stand on the page
    """

    table = ""  # the key whose entries are the rows of `frame`
    assumed: dict[str, float]

    def __init__(self, json: dict[str, Any], page: str, study: Study, unsaid: Sequence[str] = ()):
        self.json, self.page, self.study, self.unsaid = json, page, study, tuple(unsaid)

    def __getattr__(self, name: str) -> Any:
        try:
            return self.__dict__["json"][name]
        except KeyError:
            raise AttributeError(f"{type(self).__name__} has no {name!r}; it has {', '.join(dir(self))}") from None

    def __dir__(self) -> list[str]:
        own = [name for name in super().__dir__() if not name.startswith("_") and name != "table"]
        return sorted({*own, *self.json})

    def frame(self) -> pd.DataFrame:
        """The answer's table as a data frame: rows of a comparison, the ranking of a diagnosis, the steps of a refinement.

        Entries that are tables themselves become columns: `conditions.drop_height_mm`.
        """
        import pandas as pd

        return pd.json_normalize(self._records())

    def _records(self) -> Sequence[Mapping[str, Any]]:
        return self.json[self.table]

    def __str__(self) -> str:
        return self.page

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.study.title!r}: {self._gist()}>"

    def _gist(self) -> str:
        return f"{len(self._records())} {self.table}"

    def _repr_html_(self) -> str:
        """What a notebook shows."""
        return f"<pre>{html.escape(self.page)}</pre>"


class Comparison(Answer):
    """The calibrated model beside the measurements: `compare`, `add`, `drop`.

    Attributes
    ----------
    parameters, intervals : {name: value}, {name: [low, high]} (95 %), in the parameters' units
    chi2, dof, lack_of_fit_p : of the rows fitted; None where neither sd nor replicates tell the scatter
    rms_error, holdout_rms_error, rms_error_unit : unweighted, in the observable's unit, or in standard uncertainties
    fits : does the model fit? None where the data cannot say; a doubtful fit is one
    fit : {grade, by, p, rule}: fits, doubtful or does not fit, the test that decides, its p, and the rule
    holdout_p, holdout_contradicts : of the rows held out together; True where they refute the model
    where : constants that would have to drift, the worst first
    time_drift : how readings go with their order, where it is known
    noise_share, scatter : variance of the simulations over that of the readings, {rig: ratio}; scatter of single readings beside
        that of the simulations from seed to seed
    rows : [{rig, observable, conditions, value, predicted, residual, z, split}]
    curves : [{effects, panels}] of the model, and of the one without effects: what `draw(answer, "readings")` draws
    """

    table = "rows"
    parameters: dict[str, float]
    intervals: dict[str, list[float]]
    chi2: float | None
    dof: int
    lack_of_fit_p: float | None
    rms_error: float | None
    holdout_rms_error: float | None
    rms_error_unit: str
    fits: bool | None
    fit: dict[str, Any]
    holdout_p: float | None
    holdout_contradicts: bool
    where: list[dict[str, Any]]
    time_drift: list[dict[str, Any]]
    noise_share: dict[str, float]
    scatter: list[dict[str, Any]]
    rows: list[dict[str, Any]]
    warnings: list[str]

    def _gist(self) -> str:
        return f"chi2 {self.chi2:.4g} on {self.dof}" if self.chi2 is not None else super()._gist()


class Diagnosis(Answer):
    """The absent effects, ranked.

    Attributes
    ----------
    verdict : adequate, missing, tied, undecided or unexplained
    missing, tied : names of effects; a pair of effects in `tied` is a list
    ranking : [{effect, score, p, p_adjusted, chi2_drop, value, ...}], the best first
    rivals : what each explanation named would do to the error, [{effects, chi2, rms_error, holdout_rms_error, ...}]
    nearest_miss : where nothing explains: what comes nearest, and why it is refused
    holdout_contradicts, fitted_too : whether the rows held out refute the model, and which of them, fitted too, would let an
        effect be named
    drifting : how the amount of each effect named drifts, where it explains only so
    by_time : drifts of readings with their order that explain the data as well
    noise_share, limited : variance of the simulations over that of the readings, {rig: ratio}; what more simulations it would
        take where that leaves the verdict undecided, or None
    undone : the set-up scatter, up to one standard error of a mean, that would undo the verdict, or None
    next_measurement : {rig, observable, conditions, predictions, uncertainties} that would tell rivals apart, or None
    """

    table = "ranking"
    verdict: str
    missing: list[str]
    tied: list[Any]
    ranking: list[dict[str, Any]]
    rivals: list[dict[str, Any]]
    nearest_miss: dict[str, Any] | None
    holdout_contradicts: bool
    fitted_too: dict[str, Any] | None
    drifting: list[dict[str, Any]]
    by_time: list[dict[str, Any]]
    noise_share: dict[str, float]
    limited: dict[str, Any] | None
    undone: dict[str, Any] | None
    next_measurement: dict[str, Any] | None
    warnings: list[str]

    def _gist(self) -> str:
        return self.verdict


class Refinement(Answer):
    """Compare, diagnose, add, again.

    Attributes
    ----------
    verdict : of the last step
    added, tied : names of effects
    steps : comparisons, `steps[0]` of the model as it came
    rivals, nearest_miss, holdout_contradicts, fitted_too, drifting, by_time, noise_share, limited, undone, next_measurement :
        of the last step, as in `Diagnosis`
    """

    table = "steps"
    verdict: str
    added: list[str]
    tied: list[Any]
    steps: list[dict[str, Any]]
    rivals: list[dict[str, Any]]
    nearest_miss: dict[str, Any] | None
    holdout_contradicts: bool
    fitted_too: dict[str, Any] | None
    drifting: list[dict[str, Any]]
    by_time: list[dict[str, Any]]
    noise_share: dict[str, float]
    limited: dict[str, Any] | None
    undone: dict[str, Any] | None
    next_measurement: dict[str, Any] | None
    warnings: list[str]

    def _records(self) -> Sequence[Mapping[str, Any]]:
        shown = ("chi2", "dof", "lack_of_fit_p", "rms_error", "holdout_rms_error")
        return [{"effects": ", ".join(s["effects"]) or "base", **{k: s[k] for k in shown}} for s in self.steps]

    def _gist(self) -> str:
        return f"{self.verdict}, added {', '.join(self.added) or 'nothing'}"


class Check(Answer):
    """What was understood of a study, without a simulation.

    Attributes
    ----------
    rigs : [{rig, engine, rows, observables, conditions}]
    parameters : [{parameter, value, state, range}]; `state` is free, fixed or assumed
    candidates : [{effect, shows, noticed_from, needs}] that the model lacks
    advice : what would make the answers worth more
    """

    table = "candidates"
    rigs: list[dict[str, Any]]
    parameters: list[dict[str, Any]]
    candidates: list[dict[str, Any]]
    advice: list[str]
    warnings: list[str]
