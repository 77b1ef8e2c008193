"""Readings far from their replicates: mistyped, or mixed up. They are named, and the answer without them is given beside.

A reading y_i of a cell with m readings is held against the mean of the others, in units of the scatter s of all
replicates but it: t = (y_i - mean)/(s sqrt(1 + 1/(m - 1))), Student's t of nu - 1 degrees of freedom (the deleted
residual of Cook & Weisberg 1982, Residuals and Influence in Regression, section 2.2.1), p times the number of readings.
As scatter may grow with the reading, t is taken in the observable's unit and in shares of the cell's mean, and the
smaller of the two counts. Several are looked for one after the other, and the last that lies too far is taken with those
before it (Rosner 1983, doi:10.1080/00401706.1983.10487848), as one can hide another.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import special

from pellet_study.criticism.cell_means import cells_of
from pellet_study.criticism.scatter import last_digit
from pellet_study.study.measurements import Measurement
from pellet_study.study.study import Study

OUTLYING = 1e-3  # p over all readings of a group; honest data name one in a thousand times
MOST = 3  # readings looked for in a group
LEAST_DOF = 3


@dataclass(frozen=True)
class Outlier:
    """A reading, how many standard deviations it lies from the mean of its replicates, and that mean."""

    row: Measurement
    times: float
    others: float
    varied: tuple[str, ...] = ()

    def _level(self, name: str) -> str:
        level = self.row.conditions[name]
        return level if isinstance(level, str) else f"{level:g}"

    def __str__(self) -> str:
        at = ", ".join(f"{name} {self._level(name)}" for name in self.varied) or "one condition"
        return (
            f"line {self.row.line}: {self.row.observable} {self.row.value:g} ({self.row.rig}, {at}) lies {abs(self.times):.0f} "
            f"standard deviations from its replicates ({self.others:.4g})"
        )


def outlying(rows: Sequence[Measurement]) -> list[Outlier]:
    """Readings to be fitted, without an sd of their own, that lie too far from their replicates; the farthest first."""
    found: list[Outlier] = []
    groups: dict[tuple[str, str], list[Measurement]] = {}
    for row in rows:
        if row.split == "fit" and row.sd is None:
            groups.setdefault((row.rig, row.observable), []).append(row)
    for group in groups.values():
        first = group[0].conditions
        varied = tuple(name for name in first if any(row.conditions[name] != first[name] for row in group))
        candidates = []  # the last that lies too far, and all before it: one can hide another
        for _ in range(MOST):
            worst, p = _farthest(cells_of(group))
            if worst is None:
                break
            candidates.append((replace(worst, varied=varied), p))
            group = [row for row in group if row is not worst.row]
        number = max((k for k, (_, p) in enumerate(candidates, 1) if p < OUTLYING), default=0)
        found += [one for one, _ in candidates[:number]]
    return found


def _farthest(cells: Sequence[Sequence[Measurement]]) -> tuple[Outlier | None, float]:
    """The reading farthest from its replicates, None where there are too few, and its p over all readings."""
    several = [cell for cell in cells if len(cell) > 1]
    number = sum(len(cell) for cell in several)
    dof = number - len(several) - 1
    if dof < LEAST_DOF:
        return None, 1.0
    step = min(last_digit([row.value for row in cell]) for cell in several)
    middle = float(np.median([row.value for cell in cells for row in cell]))
    values = [np.array([row.value for row in cell]) for cell in several]
    units = [
        np.array([1.0, max(abs(float(v.mean())), 1e-300)]) for v in values
    ]  # the observable's, and a share of the cell's mean
    squares = sum(float(((v - v.mean()) ** 2).sum()) / unit**2 for v, unit in zip(values, units, strict=True))
    best: Outlier | None = None
    for cell, v, unit in zip(several, values, units, strict=True):
        m = len(v)
        off = (v - v.mean()) * m / (m - 1)  # from the mean of the others
        left = np.maximum(squares - off[:, None] ** 2 * (m - 1) / m / unit**2, 0.0)
        scatter = np.sqrt(np.maximum(left / dof, (step / unit) ** 2 / 12) * m / (m - 1))
        t = np.abs(off[:, None] / unit / scatter).min(axis=1)
        k = int(
            np.argmax(t + 1e-9 * np.abs(v - middle) / max(np.abs(v - middle).max(), 1e-300))
        )  # of two, the one off the rest
        if best is None or t[k] > abs(best.times):
            best = Outlier(cell[k], float(np.copysign(t[k], off[k])), float(v[k] - off[k]))
    return best, 1.0 if best is None else float(2 * special.stdtr(dof, -abs(best.times)) * number)


def told(study: Study, answer: Callable[[Study], str]) -> tuple[str, ...]:
    """A warning for the outlying readings of a study, with the answer without them; none where there are none.

    Parameters
    ----------
    answer : what to say of the study without these rows
    """
    found = outlying(study.rows)
    if not found:
        return ()
    gone = {id(one.row) for one in found}
    rest = replace(study, rows=tuple(row for row in study.rows if id(row) not in gone))
    words = "; ".join(map(str, found))
    it = "it" if len(found) == 1 else "them"
    return (f"{words}. Mistyped? The answer is with {it}; without {it}: {answer(rest)}",)
