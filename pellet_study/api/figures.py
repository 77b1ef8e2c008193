"""Figures of an answer, drawn on given axes or on new ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from pellet_study.api.answers import Answer, Comparison, Diagnosis, Refinement
from pellet_study.criticism import figures
from pellet_study.errors import InputError
from pellet_study.output.words import nearest

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Draw = Callable[..., "Figure"]


def draw(answer: Answer, figure: str | None = None, ax: Any = None) -> Figure:
    """Draw a figure of an answer, in the project's style.

    Parameters
    ----------
    figure : of a comparison `residuals` or `predictions`, of a diagnosis `ranking`, `constants` or `next_measurement`, of a
        refinement `ladder` or `residuals`; default: the first of these
    ax : matplotlib Axes to draw on; for `residuals` and `predictions` as many as there are panels; default: a new figure

    Returns
    -------
    The figure, not shown and not written: `figure.savefig("ladder.svg")`.

    Raises
    ------
    InputError : the answer has no such figure, or the number of axes is not that of the panels

    Examples
    --------
    >>> import pellet_study as ps
    >>> figure = ps.draw(ps.refine(ps.load_study("results/wet_beads")), "ladder")
    >>> len(figure.axes)
    1
    """
    known = _figures(answer)
    name = figure or next(iter(known))
    if name not in known:
        raise InputError(f"{type(answer).__name__} has no figure {name!r}{nearest(name, known)}")
    make, content = known[name]
    if not content:
        raise InputError(f"this {type(answer).__name__} has nothing to show as {name!r}")
    return make(content, ax=ax)


def _figures(answer: Answer) -> Mapping[str, tuple[Draw, Any]]:
    """Each figure's function and what it draws."""
    if isinstance(answer, Comparison):
        return {"residuals": (figures.residuals, [answer.json]), "predictions": (figures.predictions, answer.rows)}
    if isinstance(answer, Diagnosis):
        return {
            "ranking": (figures.ranking, answer.ranking and answer.json),
            "constants": (figures.constants, answer.json["by_level"]),
            "next_measurement": (figures.next_measurement, answer.next_measurement),
        }
    if isinstance(answer, Refinement):
        return {"ladder": (figures.ladder, answer.steps), "residuals": (figures.residuals, answer.steps)}
    raise InputError(f"expected the answer of compare, diagnose, add, drop or refine, got {type(answer).__name__}")
