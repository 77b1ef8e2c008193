"""What a model predicts over the condition that a rig's readings were taken at: the curves drawn through them.

A panel shows the readings of one observable of a rig against the condition (or the parameter known row by row) that was set
to the most levels, of several that with which the readings change most, at one setting of all others; against one that is a
word only where no number was changed. Where the others were changed with it, so that no curve would pass through enough
readings, the next condition takes its place; where no condition has curves, all stand in one panel against the first, each with
the model's own value for its row.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pellet_study.criticism.calibration import CalibratedStudy
from pellet_study.criticism.compare import Comparison
from pellet_study.criticism.diagnose import Diagnosis
from pellet_study.criticism.used_sd import reading_sd
from pellet_study.model.model import Case, Model, key
from pellet_study.study.measurements import Measurement

POINTS = 41  # of a curve in closed form
MOST_SETTINGS = 9  # of the other conditions, each of which has a panel of its own
CURVE, LEVELS, ROWS = "curve", "levels", "rows"
"""How a model is drawn: at any value, at the measured levels only, at each row's own setting."""


@dataclass(frozen=True)
class Panel:
    """Readings that stand together.

    `condition` is None where nothing was changed; `levels` are its values row by row (else 1, 2, ...), `others` what was the
    same in all rows, `alike` says whether that is everything else, `rows` are places in the study.
    """

    rig: str
    observable: str
    condition: str | None
    others: Mapping[str, Any]
    alike: bool
    rows: tuple[int, ...]
    levels: tuple[Any, ...]


def panels_of(rows: Sequence[Measurement]) -> list[Panel]:
    """The panels of a study's rows, the same whatever the model."""
    members: dict[tuple[str, str], list[int]] = {}
    for k, row in enumerate(rows):
        members.setdefault((row.rig, row.observable), []).append(k)
    found = []
    for (rig, observable), places in members.items():
        settings = {k: {**rows[k].conditions, **rows[k].parameters} for k in places}
        names = dict.fromkeys(name for setting in settings.values() for name in setting)
        distinct = {name: len({setting.get(name) for setting in settings.values()}) for name in names}
        known = [n for n in names if distinct[n] > 1 and all(n in setting for setting in settings.values())]
        if not known:
            alike = all(count == 1 for count in distinct.values())
            found.append(_panel(rig, observable, None, alike, places, settings))
            continue
        numbers = [n for n in known if not isinstance(settings[places[0]][n], str)]
        known = numbers or known
        values = [rows[k].value for k in places]
        change = {n: _together([setting[n] for setting in settings.values()], values) for n in known}
        known.sort(key=lambda n: (distinct[n], change[n]), reverse=True)
        condition, groups = next(((n, g) for n in known if (g := _groups(settings, n, names))), (known[0], []))
        if groups:
            found += [_panel(rig, observable, condition, True, group, settings) for group in groups]
        else:
            found.append(_panel(rig, observable, condition, False, places, settings))
    return found


def _groups(settings: Mapping[int, Mapping], condition: str, names: Iterable[str]) -> list[list[int]]:
    """Rows that differ in a condition only, a list a curve; none where a curve would have one level, or there were too many."""
    groups: dict[tuple, list[int]] = {}
    for k, setting in settings.items():
        groups.setdefault(tuple(setting.get(n) for n in names if n != condition), []).append(k)
    drawn = all(len({settings[k][condition] for k in group}) > 1 for group in groups.values())
    return list(groups.values()) if drawn and len(groups) <= MOST_SETTINGS else []


def _together(levels: Sequence[Any], values: Sequence[float]) -> float:
    """Size of the rank correlation of readings with a condition, 0 to 1; rounded, so that a tie is a tie."""
    ranks = np.array([np.unique(x, return_inverse=True)[1] for x in (levels, values)], dtype=float)
    if not ranks.std(axis=1).all():
        return 0.0
    return round(abs(float(np.corrcoef(ranks)[0, 1])), 9)


def _panel(
    rig: str, observable: str, condition: str | None, alike: bool, rows: Sequence[int], settings: Mapping
) -> Panel:
    first = settings[rows[0]]
    others = {n: v for n, v in first.items() if n != condition and all(settings[k].get(n) == v for k in rows)}
    levels = range(1, len(rows) + 1) if condition is None else [settings[k][condition] for k in rows]
    return Panel(rig, observable, condition, others, alike, tuple(rows), tuple(_plain(x) for x in levels))


def _plain(level: Any) -> Any:
    """A level as JSON has it."""
    return level if isinstance(level, str) else float(level)


def curves_of(state: CalibratedStudy, comparison: Comparison) -> dict:
    """A calibrated model's curves.

    Parameters
    ----------
    state : of the same rows as the comparison, whatever the effects it was fitted with

    Returns
    -------
    {"effects": names, "panels": [{"rig", "observable", "condition", "others", "rows", "levels", "uncertainties", "drawn",
    "at", "predicted", "units"}]}: `rows` are places in the comparison's rows, `levels` the condition's values there, `uncertainties`
    the standard ones of these readings, their scatter and set-up, null where unknown; the model takes the values `predicted`
    where the condition is `at`; `drawn` is "curve" where that is any value, "levels" where a rig is simulated at the measured
    levels only (or a condition is a word), "rows" where each row has its own.
    """
    model = state.model
    point = model.base.copy()
    for effect in model.effects:
        for name, value in model.study.catalogue.effects[effect].neutral().items():
            point[model.column[f"{effect}.{name}"]] = value
    for name, value in comparison.parameters.items():
        if name in model.column:
            point[model.column[name]] = value
    return curves_at(state, point, comparison.effects, comparison)


def curves_named(state: CalibratedStudy, diagnosis: Diagnosis) -> list[dict]:
    """The curves of every explanation that a diagnosis names, as `curves_of`."""
    named = diagnosis.rivals[: len(diagnosis.tied) or bool(diagnosis.missing)]
    present = diagnosis.comparison.effects
    return [curves_at(state, r.fit.point, [*present, *r.effects], diagnosis.comparison) for r in named]


def curves_at(state: CalibratedStudy, point: np.ndarray, effects: Sequence[str], comparison: Comparison) -> dict:
    """The curves at a point of a model; see `curves_of`."""
    model, rows = state.model, [r.row for r in comparison.rows]
    uncertainties = reading_uncertainties(state)
    panels = panels_of(rows)
    place = {key(case): k for k, case in enumerate(model.cases)}
    at_rows = model.predict(point).mean[0, [place[key(row)] for row in rows]]
    drawn = [_drawn(panel, model) for panel in panels]
    grids = [_grid(panel) if how == CURVE else [] for panel, how in zip(panels, drawn, strict=True)]
    cases = [_case(rows[p.rows[0]], p.condition, x) for p, grid in zip(panels, grids, strict=True) for x in grid]
    on_grid = list(Model(model.study, cases, model.engines).predict(point).mean[0]) if cases else []
    told = []
    for panel, how, grid in zip(panels, drawn, grids, strict=True):
        at = grid or list(panel.levels)
        predicted = [on_grid.pop(0) for _ in grid] or [at_rows[k] for k in panel.rows]
        if how == LEVELS:
            at, predicted = map(list, zip(*sorted(set(zip(at, predicted, strict=True))), strict=True))
        told.append(
            {
                "rig": panel.rig,
                "observable": panel.observable,
                "condition": panel.condition,
                "others": dict(panel.others),
                "rows": list(panel.rows),
                "levels": list(panel.levels),
                "uncertainties": [uncertainties[k] for k in panel.rows],
                "units": {
                    n: u
                    for n, u in state.study.units_of(panel.rig).items()
                    if n in (panel.observable, panel.condition, *panel.others)
                },
                "drawn": how,
                "at": [x if isinstance(x, str) else _short(x) for x in at],
                "predicted": [_short(y) for y in predicted],
            }
        )
    return {"effects": list(effects), "panels": told}


def reading_uncertainties(state: CalibratedStudy) -> list[float | None]:
    """Standard uncertainty of each row's reading: its scatter, over the root of its number of readings, and its set-up."""
    found: list[float | None] = []
    for row, sd in zip(state.study.rows, reading_sd(state.study.rows), strict=True):
        more = state.cells.contradicted.get((row.rig, row.observable), 1.0) if row.sd is not None else 1.0
        found.append(None if sd is None else _short(float(np.hypot(more * sd / np.sqrt(row.n), row.setup_sd))))
    return found


def _drawn(panel: Panel, model: Model) -> str:
    if panel.condition is None or not panel.alike:
        return ROWS
    words = isinstance(panel.levels[0], str)
    return LEVELS if words or model.engines[panel.rig].simulates else CURVE


def _grid(panel: Panel) -> list[float]:
    return list(map(float, np.linspace(min(panel.levels), max(panel.levels), POINTS)))


def _case(row: Measurement, name: str | None, value: float) -> Case:
    """A row's case with one condition, or known parameter, set to another value."""
    conditions = {n: value if n == name else v for n, v in row.conditions.items()}
    parameters = {n: value if n == name else v for n, v in row.parameters.items()}
    return Case(row.rig, row.observable, conditions, parameters)


def _short(x: float) -> float:
    """Seven digits, which no figure shows."""
    return float(f"{x:.7g}")
