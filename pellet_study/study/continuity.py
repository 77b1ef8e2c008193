"""Does an effect of the user's own grow continuously from `absent`? Tried on a study's rows, in closed forms.

A jump is looked for by halving: of a grid's intervals those where the prediction changes most, or more than beside them, are
halved, always keeping the half with the larger change, down to neighbouring numbers. A change that goes on shrinking (as |a|^h
does by 2^-h each time) is continuous, however steep; one that stays is a jump. Steps too fine for the grid show as a prediction
that stands still over a small step of the parameter and moves over a larger one, nearly everywhere. What the rig's own solver
leaves is no fault of the effect: a jump counts where the rig's parameters and conditions make none of that size.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from pellet_study.errors import InputError
from pellet_study.rigs.declared import Acting, Effect, Rig

POINTS = 33  # of the grid over a parameter's range
NEAR = (1e-8, 1e-6, 1e-4, 1e-3, 1e-2)  # further points of it beside `absent`, as shares of the range
MOST_ROWS = 8
HALVINGS, LAST = 64, 20  # of an interval; a change that the last ones leave as it is does not shrink
STAYS = 0.9
SEEN = 1e-6  # of the prediction: an effect that changes less is not judged
SHARE = 1e-3  # of an effect's whole change: a smaller jump is not told from what solvers leave
SMALL = 0.02  # of an effect's whole change: a jump away from `absent` below this and `LARGE` may be a solver's
LARGE = 5e-3  # of the prediction: a jump that large is one, whatever the conditions do
OVER_NOISE = 10.0  # times the rig's own jumps
NEARBY = 0.02  # of their range or size: how far the rig's parameters and conditions are moved for these
PLACES = (0.07, 0.23, 0.43, 0.61, 0.83)  # of a parameter's range, where a solver's jumps are looked for
STEP, FAR = 1e-5, 300  # of the range, as finite differences take it; so many such steps make a large one
STILL, FEW = 1e-15, 5  # of the prediction; so few points that move tell nothing


@dataclass(frozen=True)
class Jump:
    """A change at once between two neighbouring values of what was varied, in one row."""

    low: float
    high: float
    before: float
    after: float
    row: int

    @property
    def size(self) -> float:
        """How much the prediction changes."""
        return abs(self.after - self.before)


Curve = Callable[[np.ndarray, np.ndarray], np.ndarray]  # (p,) values of what is varied, (r,) rows: (p, r) predictions


def refuse_jumps(rig: Rig, effect: Effect, conditions: Mapping[str, Any], settings: Mapping[str, float]) -> None:
    """Refuse an effect whose predictions jump or move in steps as one of its parameters moves over its physical range.

    Parameters
    ----------
    rig : a closed form in which the effect acts
    conditions : {name: (n,) values of the study's rows, or a number}
    settings : values of the rig's parameters

    Raises
    ------
    InputError : names the parameter, where it jumps, and by how much
    """
    trial = _Trial(rig, effect, conditions, settings)
    for name in effect.parameters:
        for observable in rig.observables:
            trial.look(name, observable)


class _Trial:
    """An effect in a closed form, tried on some rows."""

    def __init__(self, rig: Rig, effect: Effect, conditions: Mapping[str, Any], settings: Mapping[str, float]):
        self.rig, self.effect = rig, effect
        columns = [values for values in conditions.values() if np.ndim(values)] or [np.zeros(1)]
        distinct = np.sort(np.unique(np.column_stack(columns), axis=0, return_index=True)[1])
        self.rows = distinct[np.unique(np.linspace(0, len(distinct) - 1, MOST_ROWS).astype(int))]
        self.conditions = {n: v[self.rows] if np.ndim(v) else v for n, v in conditions.items()}
        self.settings = settings
        self.typical = {
            name: 0.5 * (low + high) if name == effect.amount else quantity["default"]
            for name, quantity in effect.parameters.items()
            for low, high in [_range(quantity)]
        }
        if self.typical[effect.amount] == effect.neutral()[effect.amount]:
            self.typical[effect.amount] = _range(effect.parameters[effect.amount])[1]

    def look(self, name: str, observable: str) -> None:
        """Refuse what one parameter makes of one observable where it jumps or moves in steps."""
        low, high = _range(self.effect.parameters[name])
        absent = self.effect.neutral()[name] if name == self.effect.amount else None
        curve = self._curve(observable, name)
        grid = _grid(low, high, absent)
        values = curve(grid, np.arange(len(self.rows)))
        whole = np.ptp(values, axis=0)
        size = np.abs(values).max(axis=0)
        seen = np.isfinite(values).all(axis=0) & (whole > SEEN * size)
        if not seen.any():
            return
        for jump in _jumps(curve, grid, np.where(seen, values, 0.0), absent, SHARE):
            if self._is_one(jump, name, observable, size[jump.row], whole[jump.row]):
                self._refuse(jump, name, observable, absent)
        row = int(np.argmax(np.where(seen, whole, 0.0)))
        if _in_steps(curve, row, grid, values[:, row]) and not self._rig_in_steps(observable, row):
            raise InputError(
                f"{self.effect.file}: {self.effect.name} moves in steps: {observable} of {self.rig.name} stands still over most "
                f"small steps of {name} (such as {STEP * (high - low):.2g}), over larger ones it does not; an effect must "
                "change continuously: take out what rounds or counts"
            )

    def _refuse(self, jump: Jump, name: str, observable: str, absent: float | None) -> None:
        at_absent = self._at_absent(jump, name)
        where = (
            f"where it is absent, {name} = {absent:g}"
            if at_absent
            else f"at {name} = {0.5 * (jump.low + jump.high):.6g}"
        )
        advice = (
            f"what it does must go to nothing with {name}"
            if at_absent
            else "an effect must change continuously: take out the threshold or the rounding there"
        )
        raise InputError(
            f"{self.effect.file}: {self.effect.name} jumps {where}: {observable} of {self.rig.name} goes from "
            f"{jump.before:.6g} to {jump.after:.6g} at once; {advice}"
        )

    def _at_absent(self, jump: Jump, name: str) -> bool:
        low, high = _range(self.effect.parameters[name])
        near = abs(jump.high - self.effect.neutral()[name]) < NEAR[0] * (high - low)
        return near and name == self.effect.amount

    def _curve(
        self, observable: str, varied: str, at: Mapping[str, float] | None = None, present: bool = True
    ) -> Curve:
        """A prediction over a parameter of the effect or of the rig, or over a condition."""
        own, neutral = {**self.typical, **(at or {})}, self.effect.neutral()[self.effect.amount]

        def curve(points: np.ndarray, rows: np.ndarray) -> np.ndarray:
            column = np.asarray(points, dtype=float)[:, None]
            values = {n: column if n == varied else np.full_like(column, v) for n, v in own.items()}
            parameters = {
                n: column if n == varied not in own else np.full_like(column, self.settings.get(n, q["default"]))
                for n, q in self.rig.parameters.items()
            }
            conditions = {n: v[rows] if np.ndim(v) else v for n, v in self.conditions.items()}
            if varied in conditions:  # a row a point, of one row
                conditions = {n: np.full(len(points), v[0]) if np.ndim(v) else v for n, v in conditions.items()}
                conditions[varied] = column[:, 0]
                values = {n: v[:1] for n, v in values.items()}
                parameters = {n: v[:1] for n, v in parameters.items()}
            acting = {self.effect.name: Acting(self.effect.closed_form[self.rig.name], values)} if present else {}
            assert self.rig.predict is not None
            found = np.asarray(self.rig.predict(parameters, conditions, acting)[observable], dtype=float)
            if varied in conditions:
                return np.broadcast_to(found, (1, len(points))).T
            found = np.array(np.broadcast_to(found, (len(points), len(rows))))
            absent = column[:, 0] == neutral if varied == self.effect.amount else np.zeros(len(points), dtype=bool)
            if absent.any():  # there an effect is left out
                without = self.rig.predict(parameters, conditions, {})[observable]
                found[absent] = np.broadcast_to(without, found.shape)[absent]
            return found

        return curve

    def _is_one(self, jump: Jump, name: str, observable: str, size: float, whole: float) -> bool:
        """Whether a jump is the effect's: far above what the rig's own parameters and conditions make."""
        if jump.size < LARGE * size and jump.size < SMALL * whole and not self._at_absent(jump, name):
            return False
        at = {name: jump.high if jump.high != self.effect.neutral()[name] else jump.low}
        bare = jump.size > LARGE * size  # too large for a solver: the rig alone must make such jumps
        noise = [self._own_jump(observable, p, jump.row, at, not bare) for p in self.rig.parameters]
        noise += [
            self._own_jump(observable, c, jump.row, at, not bare)
            for c, q in self.rig.conditions.items()
            if "options" not in q
        ]
        noise += [] if bare else [self._usual_jump(observable, name, jump.row)]
        return jump.size > OVER_NOISE * max(noise, default=0.0)

    def _own_jump(self, observable: str, varied: str, row: int, at: Mapping[str, float], present: bool = True) -> float:
        """The largest jump as one of the rig's parameters or conditions moves a little."""
        if varied in self.rig.parameters:
            quantity = self.rig.parameters[varied]
            value = self.settings.get(varied, quantity["default"])
            around = NEARBY * (quantity["max"] - quantity["min"])
            low, high = max(quantity["min"], value - around), min(quantity["max"], value + around)
        else:
            value = float(self.conditions[varied][row])
            around = NEARBY * (abs(value) or 1.0)
            low, high = value - around, value + around
            low = max(low, 0.0) if value >= 0 else low
        if low >= high:
            return 0.0
        curve = _one_row(self._curve(observable, varied, at, present), row)
        grid = np.linspace(low, high, POINTS)
        return max((jump.size for jump in _jumps(curve, grid, curve(grid, np.arange(1)), None)), default=0.0)

    def _usual_jump(self, observable: str, name: str, row: int) -> float:
        """The median over some places of a parameter's range of the largest jump about each: of a solver there are many."""
        low, high = _range(self.effect.parameters[name])
        curve = self._curve(observable, name)
        found = []
        for share in PLACES:
            grid = low + (high - low) * (share + np.linspace(0.0, NEARBY, POINTS))
            row_of = _one_row(curve, row)
            jumps = _jumps(row_of, grid, row_of(grid, np.arange(1)), None)
            found.append(max((jump.size for jump in jumps), default=0.0))
        return float(np.median(found))

    def _rig_in_steps(self, observable: str, row: int) -> bool:
        """Whether the rig moves in steps over its own parameters too."""
        for name, quantity in self.rig.parameters.items():
            grid = np.linspace(quantity["min"], quantity["max"], POINTS)
            curve = self._curve(observable, name)
            if grid[0] < grid[-1] and _in_steps(curve, row, grid, curve(grid, np.array([row]))[:, 0]):
                return True
        return False


def _one_row(curve: Curve, row: int) -> Curve:
    """The curve of one row, whatever rows are asked for."""
    return lambda points, rows: np.repeat(curve(points, np.array([row])), len(rows), axis=1)


def _range(quantity: Mapping) -> tuple[float, float]:
    low, high = quantity.get("physical", (quantity["min"], quantity["max"]))
    return float(low), float(high)


def _grid(low: float, high: float, absent: float | None) -> np.ndarray:
    """Points over a range, closer about `absent`."""
    points = [np.linspace(low, high, POINTS)]
    if absent is not None:
        near = np.array(NEAR) * (high - low)
        points += [np.array([absent]), absent + near, absent - near]
    found = np.unique(np.concatenate(points))
    return found[((found >= low) & (found <= high)) | (found == absent)]


def _jumps(curve: Curve, grid: np.ndarray, values: np.ndarray, absent: float | None, share: float = 0.0) -> list[Jump]:
    """Jumps in the intervals where one may be: with the largest change, or a larger one than beside them, or at `absent`.

    Those below a share of the whole change are not looked for.
    """
    whole = np.maximum(np.ptp(values, axis=0), 1e-300)
    change = np.abs(np.diff(values, axis=0)) / whole
    beside = np.pad(change, ((1, 1), (0, 0)), constant_values=np.inf)
    excess = change - np.minimum(beside[:-2], beside[2:])
    places = {divmod(int(k), change.shape[1]) for by in (change, excess) for k in np.argsort(-by, axis=None)[:2]}
    if absent is not None:
        k = int(np.searchsorted(grid, absent))
        places |= {(m, int(np.argmax(change[m]))) for m in (k - 1, k) if 0 <= m < len(change)}
    intervals = sorted(places)
    rows = np.array([row for _, row in intervals])
    low, high = (np.array([grid[k + m] for k, _ in intervals]) for m in (0, 1))
    before, after = (np.array([values[k + m, row] for k, row in intervals]) for m in (0, 1))
    sizes = [np.abs(after - before)]
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        open_ = (middle > low) & (middle < high) & (sizes[-1] > share * whole[rows])
        if not open_.any():
            break
        there = np.diag(curve(middle[open_], rows[open_]))
        left = np.abs(there - before[open_]) >= np.abs(after[open_] - there)
        for ends, values_there, moved in ((high, after, left), (low, before, ~left)):
            k = np.flatnonzero(open_)[moved]
            ends[k], values_there[k] = middle[k], there[moved]
        sizes.append(np.abs(after - before))
    stays = sizes[-1] >= STAYS * sizes[max(0, len(sizes) - 1 - LAST)]
    return [
        Jump(float(low[k]), float(high[k]), float(before[k]), float(after[k]), int(rows[k]))
        for k in np.flatnonzero(stays & (sizes[-1] > share * whole[rows]))
    ]


def _in_steps(curve: Curve, row: int, grid: np.ndarray, values: np.ndarray) -> bool:
    """Whether a curve of one row stands still over small steps and moves over larger ones, nearly everywhere where it moves.

    Looked at where nearly all of its change over a grid lies.
    """
    walked = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(values)))])
    first, last = np.searchsorted(walked, np.array([0.05, 0.95]) * walked[-1])
    low, high = grid[max(first - 1, 0)], grid[last]
    span = high - low
    at = low + span * (np.arange(POINTS - 1) + 0.37) / POINTS
    here, small, large = curve(np.concatenate([at, at + STEP * span, at + FAR * STEP * span]), np.array([row])).reshape(
        3, -1
    )
    still = np.abs(small - here) <= STILL * np.abs(here)
    moves = np.abs(large - here) > 0.1 * FAR * STEP * walked[-1]
    return bool(moves.sum() > FEW and (still & moves).sum() > 0.5 * moves.sum())
