"""Backward selection of terms by AICc, main effects kept while products with them stay, and what the choice costs.

References
----------
Hurvich, Tsai, Regression and time series model selection in small samples, Biometrika 76 (1989) 297,
doi:10.1093/biomet/76.2.297. Nelder, A reformulation of linear models, J. Roy. Statist. Soc. A 140 (1977) 48,
doi:10.2307/2344517 (marginality). That p values and intervals after a choice are too good: Freedman, A note on
screening regression equations, Am. Stat. 37 (1983) 152, doi:10.1080/00031305.1983.10482729.
"""

from dataclasses import dataclass

import numpy as np

from pellet_study.doe.box_behnken import Surface
from pellet_study.doe.reduction import without
from pellet_study.doe.terms import INTERCEPT
from pellet_study.errors import InputError

Terms = dict[str, tuple[int, ...]]


@dataclass(frozen=True)
class Selection:
    """A reduced model and its price.

    Attributes
    ----------
    surface : Surface
        The model selected.
    dropped : list of str
        In the order in which they were left out.
    aicc : list of float
        Of the full model, and after each step; infinite while n - k - 1 is not positive.
    r2_predicted_honest : float or None
        Predicted R2 with the selection made anew without each run in turn: the run predicted has had no say in
        which terms stand in the model. None where a run alone carries a term.
    """

    surface: Surface
    dropped: list[str]
    aicc: list[float]
    r2_predicted_honest: float | None


def aicc(ss_residual: float, runs: int, coefficients: int) -> float:
    r"""Corrected Akaike criterion of a least squares fit, up to a constant of the data.

    :math:`n \ln(SSE/n) + 2k + 2k(k+1)/(n-k-1)`, k the coefficients and the variance; infinite where n - k - 1 is not
    positive.
    """
    size = coefficients + 1
    room = runs - size - 1
    if room <= 0:
        return float("inf")
    return float(runs * np.log(max(ss_residual, 1e-300) / runs) + 2 * size + 2 * size * (size + 1) / room)


def select_by_aicc(surface: Surface) -> Selection:
    """Leave out the term whose loss lowers AICc most, again, until none does; hierarchy kept.

    A step leaves out one term or, where no single one helps, a main effect with its products and its square. Blocks
    always stay, and count among the coefficients. While the model is too large for AICc to be defined, the term that
    costs least in residual goes. Backward steps mostly end at the lowest AICc of all models, but need not.

    Raises
    ------
    InputError
        If the response is fitted exactly, so that there is nothing to choose by.
    """
    model = surface.model
    scale = float(np.sum((model.response - model.response.mean()) ** 2))
    if model.df_residual and model.ss_residual < 1e-12 * scale:
        raise InputError(
            "--select: the model fits every run exactly, so that AICc is undefined; name the terms to leave out with "
            "--drop"
        )
    extra = model.matrix[:, len(model.terms) :]
    dropped, values = _backward(model.terms, model.matrix[:, : len(model.terms)], extra, model.response)
    chosen = without(surface, dropped) if dropped else surface
    return Selection(chosen, dropped, values, _honest_r2(surface, extra))


def _backward(terms: Terms, matrix: np.ndarray, extra: np.ndarray, response) -> tuple[list[str], list[float]]:
    """Names left out, and AICc before and after each step."""
    names = list(terms)

    def criterion(kept: list[str]) -> tuple[float, float]:
        columns = np.column_stack([matrix[:, [names.index(name) for name in kept]], extra])
        residual = response - columns @ np.linalg.lstsq(columns, response, rcond=None)[0]
        squares = float(residual @ residual) if len(response) > columns.shape[1] else 0.0
        return aicc(squares, len(response), columns.shape[1]), squares

    kept: list[str] = list(names)
    dropped: list[str] = []
    now = criterion(kept)
    values = [now[0]]
    while True:
        steps = [[*_needing(name, kept, terms), name] for name in kept if name != INTERCEPT]
        for size in (1, 2):  # single terms while one helps, then a main effect with what needs it
            tried = [step for step in steps if min(len(step), 2) == size]
            best, gone = min(
                ((criterion([k for k in kept if k not in step]), step) for step in tried), default=(now, [])
            )
            if gone and (best[0] < now[0] or not np.isfinite(now[0])):
                break
        else:
            return dropped, values
        kept = [name for name in kept if name not in gone]
        dropped += gone
        values.append(best[0])
        now = best


def _needing(name: str, kept: list[str], terms: Terms) -> list[str]:
    """The products and the square of a main effect."""
    indices = terms[name]
    return [other for other in kept if len(indices) == 1 and len(terms[other]) == 2 and indices[0] in terms[other]]


def _honest_r2(surface: Surface, extra: np.ndarray) -> float | None:
    model, names = surface.model, list(surface.model.terms)
    size, errors = len(names), []
    for run in range(len(model.response)):
        rest = np.arange(len(model.response)) != run
        if np.linalg.matrix_rank(model.matrix[rest]) < model.matrix.shape[1]:
            return None
        dropped, _ = _backward(model.terms, model.matrix[rest, :size], extra[rest], model.response[rest])
        kept = [i for i, name in enumerate(names) if name not in dropped] + list(range(size, model.matrix.shape[1]))
        fitted = np.linalg.lstsq(model.matrix[np.ix_(rest, kept)], model.response[rest], rcond=None)[0]
        errors.append(model.response[run] - model.matrix[run, kept] @ fitted)
    total = float(np.sum((model.response - model.response.mean()) ** 2))
    return 1 - float(np.sum(np.square(errors))) / total
