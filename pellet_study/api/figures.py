"""Figures of an answer, drawn on given axes or on new ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from pellet_study.api.answers import Answer, Comparison, Diagnosis, Refinement
from pellet_study.criticism import figures
from pellet_study.errors import InputError
from pellet_study.output import style
from pellet_study.output.words import nearest

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Draw = Callable[..., "Figure"]


def draw(answer: Answer, figure: str | None = None, ax: Any = None, width_mm: float | None = None) -> Figure:
    """Draw a figure of an answer, in the project's style.

    Parameters
    ----------
    figure : of a comparison `readings`, `predictions` or `residuals`, of a diagnosis `ranking`, `constants` or
        `next_measurement`, of a refinement `readings`, `ladder`, `predictions`, `residuals` and those of its first diagnosis;
        default: the first of these
    ax : matplotlib Axes to draw on; for `readings`, `residuals` and `predictions` as many as there are panels; default: a new
        figure
    width_mm : width of a new figure for a journal's column, mm, 40 to 400, such as 85 or 175; default: as for a screen

    Returns
    -------
    The figure, not shown and not written: `figure.savefig("readings.svg")`, or .pdf, or .png.

    Raises
    ------
    InputError : the answer has no such figure, the number of axes is not that of the panels, or no page has such a width

    Examples
    --------
    >>> import pellet_study as ps
    >>> figure = ps.draw(ps.refine(ps.load_study("results/wet_beads")), "ladder", width_mm=85)
    >>> print(f"{25.4 * figure.get_figwidth():g}")
    85
    """
    known = _figures(answer)
    name = figure or next(iter(known))
    if name not in known:
        raise InputError(f"{type(answer).__name__} has no figure {name!r}{nearest(name, known)}")
    content, make = known[name]
    if not content:
        raise InputError(f"this {type(answer).__name__} has nothing to show as {name!r}")
    with style.column(width_mm):
        return make(ax=ax)


def draw_all(answer: Answer, width_mm: float | None = None) -> dict[str, Figure]:
    """Every figure that an answer has something to show in, {name: figure}; see `draw`.

    Raises
    ------
    InputError : no page has such a width
    """
    with style.column(width_mm):
        return {name: make(ax=None) for name, (content, make) in _figures(answer).items() if content}


def _figures(answer: Answer) -> Mapping[str, tuple[Any, Draw]]:
    """Of each figure what it shows, empty where there is nothing, and what draws it."""
    known, told = answer.study.acting(), answer.json
    if isinstance(answer, Comparison):
        models = [c for step in (told.get("before"), told) if step for c in step["curves"]]
        return _of_steps([told], models, known)
    if isinstance(answer, Diagnosis):
        return _of_diagnosis(told, known)
    if isinstance(answer, Refinement):
        last = told["diagnoses"][-1]
        models = [c for part in (*told["steps"], last) for c in part["curves"]]
        found = _of_steps(told["steps"], models, known)
        tied = figures.tied_errors(last)
        ladder = {"ladder": (told["steps"], lambda ax: figures.ladder(told["steps"], tied, known, ax=ax))}
        return {"readings": found["readings"], **ladder, **found, **_of_diagnosis(told["diagnoses"][0], known)}
    raise InputError(f"expected the answer of compare, diagnose, add, drop or refine, got {type(answer).__name__}")


def _of_steps(steps: list[dict], models: list[dict], known: list[str]) -> dict[str, tuple[Any, Draw]]:
    last = steps[-1]
    return {
        "readings": (models, lambda ax: figures.readings(last["rows"], models, known, ax=ax)),
        "predictions": (last["rows"], lambda ax: figures.predictions(last["rows"], last["effects"], known, ax=ax)),
        "residuals": (steps, lambda ax: figures.residuals(steps, known, ax=ax)),
    }


def _of_diagnosis(told: dict, known: list[str]) -> dict[str, tuple[Any, Draw]]:
    level, proposal = told.get("by_level"), told["next_measurement"]
    return {
        "ranking": (told["ranking"], lambda ax: figures.ranking(told, known, ax=ax)),
        "constants": (level, lambda ax: figures.constants(level, known, ax=ax)),
        "next_measurement": (proposal, lambda ax: figures.next_measurement(proposal, known, ax=ax)),
    }
