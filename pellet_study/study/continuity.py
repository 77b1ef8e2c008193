"""Does an effect of the user's own change anything, and continuously from `absent`? Tried on a study's rows, in closed forms.

What the rig does by itself is no fault of the effect: a jump counts where the rig's parameters and conditions, moved alone, make none
of that size nearby nor one from the same value to the same value anywhere, steps where they make none as large.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from pellet_study.errors import InputError
from pellet_study.rigs.declared import Acting, Effect, Rig
from pellet_study.study.jumps import NEAR, POINTS, Curve, Jump, grid_of, jumps_of, one_row, step_of, where_it_moves

MOST_ROWS = 8
SETTINGS, ROWS_TRIED = 8, 64  # of a rig's parameters and of its conditions, at which an effect must change something
IDLE = 1e-11  # relative change of a prediction, below which an effect changes nothing
SEEN = 1e-6  # of the prediction: an effect that changes less is not judged
SHARE = 1e-3  # of an effect's whole change: a smaller jump is not told from what solvers leave
SMALL = 0.02  # of an effect's whole change: a jump away from `absent` below this and `LARGE` may be a solver's
LARGE = 5e-3  # of the prediction: a jump that large is one, whatever the conditions do
OVER_NOISE = 10.0  # times the rig's own jumps
NEARBY = 0.02  # of their range or size: how far the rig's parameters and conditions are moved for these
PLACES = (0.07, 0.23, 0.43, 0.61, 0.83)  # of a parameter's range, where a solver's jumps are looked for
FARTHER = (0.1, 0.5, 1.0)  # of their range: how far they are moved for a threshold of the rig
ALIKE = 0.5  # of a jump: within which one of the rig's own begins and ends where it does
IN_WINDOW = 10.0  # steps of the effect's size that the rig is given room for
SOLVER = 1e-5  # of the prediction: steps that small, which the rig has with the effect only, are its solver's


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


def refuse_idle(rig: Rig, effect: Effect) -> None:
    """Refuse an effect that changes no reading, whatever the rig's parameters and conditions: no measurement could show it.

    Raises
    ------
    InputError : names the effect and the rig
    """
    random = np.random.default_rng(0)
    amount, high = effect.amount, effect.parameters[effect.amount]["max"]
    low, neutral = effect.parameters[amount]["min"], effect.neutral()[amount]
    values = {n: np.full((SETTINGS, 1), q.get("default", high)) for n, q in effect.parameters.items()}
    values[amount] = np.full((SETTINGS, 1), high if high != neutral else low)
    parameters = {n: random.uniform(q["min"], q["max"], (SETTINGS, 1)) for n, q in rig.parameters.items()}
    conditions = {
        n: random.choice(q["options"], ROWS_TRIED) if "options" in q else random.uniform(q["min"], q["max"], ROWS_TRIED)
        for n, q in rig.conditions.items()
    } | {"median_normal_stress_pa": 1.0}
    assert rig.predict is not None
    acting = {effect.name: Acting(effect.closed_form[rig.name], values)}
    try:
        found, without = (rig.predict(parameters, conditions, present) for present in (acting, {}))
    except InputError:  # somewhere in its ranges the rig has no answer: nothing is said
        return
    if all(np.allclose(found[o], without[o], rtol=IDLE, atol=0.0, equal_nan=True) for o in rig.observables):
        raise InputError(
            f"{effect.file}: {effect.name} changes no reading of {rig.name}: with {amount} = {values[amount][0, 0]:g} it predicts what "
            f"it does without, under all of {SETTINGS * ROWS_TRIED} conditions; look at what its act does and where predict of "
            f"{rig.name} asks for it, or leave {rig.name} out of CLOSED_FORM"
        )


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
        grid = grid_of(low, high, absent)
        values = curve(grid, np.arange(len(self.rows)))
        whole = np.ptp(values, axis=0)
        size = np.abs(values).max(axis=0)
        seen = np.isfinite(values).all(axis=0) & (whole > SEEN * size)
        if not seen.any():
            return
        for jump in jumps_of(curve, grid, np.where(seen, values, 0.0), absent, SHARE):
            if self._is_one(jump, name, observable, size[jump.row], whole[jump.row]):
                self._refuse(jump, name, observable, absent)
        row = int(np.argmax(np.where(seen, whole, 0.0)))
        step = step_of(one_row(curve, row), *where_it_moves(grid, values[:, row]))
        if step and not self._rig_in_steps(observable, row, step, step < SOLVER * size[row]):
            raise InputError(
                f"{self.effect.file}: {self.effect.name} moves in steps: as {name} grows, {observable} of {self.rig.name} stands "
                f"still and then changes by {step:.3g} at once, again and again; an effect must change continuously: take out "
                "what rounds or counts"
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
        noise = [self._own_jump(observable, varied, jump.row, at, not bare) for varied in self._movable]
        noise += [] if bare else [self._usual_jump(observable, name, jump.row)]
        if jump.size <= OVER_NOISE * max(noise, default=0.0):
            return False
        return not (bare and self._is_the_rigs(jump, observable))

    @property
    def _movable(self) -> list[str]:
        """The rig's parameters, and its conditions that are numbers."""
        return [*self.rig.parameters, *(c for c, q in self.rig.conditions.items() if "options" not in q)]

    def _around(self, varied: str, row: int, share: float) -> tuple[float, float]:
        """A parameter's or a condition's values about the one it has: within a share of its range, or of itself."""
        if varied in self.rig.parameters:
            quantity = self.rig.parameters[varied]
            value = self.settings.get(varied, quantity["default"])
            around = share * (quantity["max"] - quantity["min"])
            return max(quantity["min"], value - around), min(quantity["max"], value + around)
        value = float(self.conditions[varied][row])
        around = share * (abs(value) or 1.0)
        return max(value - around, 0.0) if value >= 0 else value - around, value + around

    def _own_jumps(
        self, observable: str, varied: str, row: int, at: Mapping[str, float], present: bool, share: float
    ) -> list[Jump]:
        """The jumps as one of the rig's parameters or conditions moves about its value."""
        low, high = self._around(varied, row, share)
        if low >= high:
            return []
        curve = one_row(self._curve(observable, varied, at, present), row)
        grid = np.linspace(low, high, POINTS)
        return jumps_of(curve, grid, curve(grid, np.arange(1)), None)

    def _own_jump(self, observable: str, varied: str, row: int, at: Mapping[str, float], present: bool = True) -> float:
        """The largest jump as one of the rig's parameters or conditions moves a little."""
        found = self._own_jumps(observable, varied, row, at, present, NEARBY)
        return max((jump.size for jump in found), default=0.0)

    def _is_the_rigs(self, jump: Jump, observable: str) -> bool:
        """Whether the rig without the effect jumps from the same value to the same value: a threshold that the effect reaches."""
        ends = sorted((jump.before, jump.after))
        return any(
            np.abs(np.subtract(sorted((own.before, own.after)), ends)).max() < ALIKE * jump.size
            for share in FARTHER
            for varied in self._movable
            for own in self._own_jumps(observable, varied, jump.row, {}, False, share)
        )

    def _usual_jump(self, observable: str, name: str, row: int) -> float:
        """The median over some places of a parameter's range of the largest jump about each: of a solver there are many."""
        low, high = _range(self.effect.parameters[name])
        curve = self._curve(observable, name)
        found = []
        for share in PLACES:
            grid = low + (high - low) * (share + np.linspace(0.0, NEARBY, POINTS))
            row_of = one_row(curve, row)
            jumps = jumps_of(row_of, grid, row_of(grid, np.arange(1)), None)
            found.append(max((jump.size for jump in jumps), default=0.0))
        return float(np.median(found))

    def _rig_in_steps(self, observable: str, row: int, step: float, present: bool) -> bool:
        """Whether the rig moves in steps as large over its own parameters or conditions too; with the effect where `present`."""
        for varied in self._movable:
            low, high = self._around(varied, row, NEARBY)
            curve = one_row(self._curve(observable, varied, {}, present), row)
            slope = abs(float(np.diff(curve(np.array([low, high]), np.arange(1)), axis=0)[0, 0]))
            if low < high and slope > 0 and np.isfinite(slope):
                middle, room = 0.5 * (low + high), 0.5 * (high - low) * min(1.0, IN_WINDOW * step / slope)
                own = step_of(curve, middle - room, middle + room, (1.0,))
                if own and own > ALIKE * step:
                    return True
        return False


def _range(quantity: Mapping) -> tuple[float, float]:
    low, high = quantity.get("physical", (quantity["min"], quantity["max"]))
    return float(low), float(high)
