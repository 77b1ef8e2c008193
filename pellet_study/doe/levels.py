"""The levels of a design: how physical ones are coded, and which cell is a slip of the pen.

A column of -1, 0, 1, with or without axial points beyond (-1.414, 1.414), is coded already. In a composite design the
cube is -1 to 1 and the axial points lie beyond; in any other the least level is -1 and the greatest 1.
"""

import numpy as np
import pandas as pd

from pellet_study.doe.factors import Factor
from pellet_study.errors import InputError

LEVEL_TOLERANCE = 0.1
"""How far, in coded units, a level may lie from its nominal place without a word; it is analysed where it was run."""

OFF_CENTRE = 0.5
"""How far a middle level may lie from the middle before it must be said what the ends are."""

FARTHEST_AXIAL = 4.0
"""The farthest axial point of a table that is taken for coded: 16^(1/2), rotatable in eight factors."""


def is_coded(values: pd.Series) -> bool:
    """Whether a column holds coded levels: -1 and 1, besides them 0 and one pair of axial levels beyond."""
    levels = set(values.round(6))
    if not {-1.0, 1.0} <= levels:
        return False
    if levels <= {-1.0, 0.0, 1.0}:
        return True
    beyond = sorted(abs(level) for level in levels - {-1.0, 0.0, 1.0})
    return 0.0 in levels and 1.0 < beyond[0] and beyond[-1] - beyond[0] < 0.02 and beyond[-1] <= FARTHEST_AXIAL


def cubes(frame: pd.DataFrame) -> dict[str, tuple[float, float]]:
    """{factor: levels of the cube} where the runs are a composite design, else nothing.

    In a composite design every factor has axial runs, in which it alone is off its middle, farther out than in the
    runs where others are off theirs too; and those are at two levels only.
    """
    values = frame.to_numpy(dtype=float)
    middle = np.median(values, axis=0)  # where most runs are, also when an axial run failed
    half = np.abs(values - middle).max(axis=0)
    if values.shape[1] < 2 or not np.all(half > 0):
        return {}
    places = (values - middle) / half
    off = np.abs(places) > LEVEL_TOLERANCE
    cube, axial = off.sum(axis=1) > 1, off.sum(axis=1) == 1
    found = {}
    for i, name in enumerate(frame.columns):
        inner, outer = places[cube & off[:, i], i], places[axial & off[:, i], i]
        if not len(inner) or not len(outer) or not (inner.min() < 0 < inner.max()):
            return {}
        sizes = np.abs(inner)
        if np.ptp(sizes) > LEVEL_TOLERANCE * sizes.max() or np.abs(outer).min() < sizes.max() * 1.02:
            return {}
        low, high = (float(np.median(values[cube & off[:, i] & (sign * places[:, i] > 0), i])) for sign in (-1, 1))
        found[name] = (low, high)
    return found


def resolve(frame: pd.DataFrame, given: dict[str, Factor], lines, max_levels: int, source: str):
    """Factors, coded levels and notes of a table of factors.

    Parameters
    ----------
    frame : DataFrame (n_runs, n_factors)
    given : {name: Factor}
        Levels that the user named.
    lines : list of int
    max_levels : int
        3 for a two-level design with centre points or a three-level one, 5 for a composite.

    Returns
    -------
    factors, coded, notes : list of Factor, DataFrame (n_runs, n_factors), list of str

    Raises
    ------
    InputError
        Naming column and row of a constant column, of a level of one run alone, of a column that is no design's.
    """
    for name in frame:
        _refuse_constant(frame[name], lines, source)
    free = [name for name in frame if name not in given]
    for name in free:
        _refuse_slip(frame, name, lines, max_levels, source)
    composite = cubes(frame) if max_levels > 3 else {}
    factors, coded, notes = [], {}, []
    for name in frame:
        factor = given.get(name) or _factor_of(frame[name], composite.get(name))
        factors.append(factor)
        coded[name] = _coded_column(frame[name], factor)
    coded = pd.DataFrame(coded)
    for name in frame:
        notes += _check(coded[name], frame[name], lines, max_levels, name in given, name in composite, source)
    if any(not is_coded(frame[name]) and name in free for name in composite):
        words = "; ".join(f"{f.name} {f.low:g} to {f.high:g}" for f in factors if f.name in composite)
        notes.append(f"a composite design: the levels of its cube are -1 and +1 ({words}), the axial points lie beyond")
    return factors, coded, notes


def _refuse_constant(values: pd.Series, lines, source: str) -> None:
    if np.ptp(values) <= 1e-12 * np.abs(values).max():
        raise InputError(
            f"column {values.name!r} of {source} is {values.iloc[0]:g} in every row (rows {lines[0]} to "
            f"{lines[-1]}): expected a factor at two levels at least; remove the column"
        )


def _factor_of(values: pd.Series, cube: tuple[float, float] | None) -> Factor:
    if is_coded(values):
        return Factor(values.name)
    return Factor(values.name, *(cube or (values.min(), values.max())))


def _coded_column(values: pd.Series, factor: Factor) -> np.ndarray:
    """Coded levels; a coded column stays as it is even where physical levels are given."""
    coded = values.to_numpy() if is_coded(values) else factor.coded(values)
    nearest = np.round(coded)
    return np.where(np.abs(coded - nearest) < 1e-9, nearest, coded)


# ------------------------------------------------------------------------------------------- slips of the pen
def distinct(values, tolerance: float) -> list[float]:
    """Levels that lie further apart than the tolerance."""
    levels: list[float] = []
    for value in np.unique(values):
        if not levels or value - levels[-1] > tolerance:
            levels.append(float(value))
    return levels


def _regular(levels: list[float]) -> bool:
    """Whether levels are those of a design: two, three or five, alike on both sides of their middle."""
    if len(levels) not in (2, 3, 5):
        return False
    places = np.array(levels) - (levels[0] + levels[-1]) / 2
    return bool(np.all(np.abs(places + places[::-1]) <= 2 * LEVEL_TOLERANCE * places[-1]))


def _refuse_slip(frame: pd.DataFrame, name: str, lines, max_levels: int, source: str) -> None:
    """Name the cell where a column would be a design's but for one run.

    An axial or a centre run may lie where it was run, unless no design has so many levels whatever their places.
    """
    values = frame[name].to_numpy(dtype=float)
    levels = distinct(values, 1e-6 * np.ptp(values))
    if len(levels) > 6 or _regular(levels):
        return
    most = max(
        (len(distinct(frame[other], LEVEL_TOLERANCE * np.ptp(frame[other]) / 2)) for other in frame if other != name),
        default=0,
    )
    too_many = len(levels) == 6 or (len(levels) == 4 and most <= 3)  # no axial points in other columns either
    suspects = []
    for level in levels:
        at = np.flatnonzero(np.abs(values - level) <= 1e-6 * np.ptp(values))
        rest = [other for other in levels if other != level]
        if len(at) == 1 and _regular(rest) and (too_many or not _others_in_the_middle(frame, name, int(at[0]))):
            suspects.append((level, int(at[0]), rest))
    if suspects:
        level, row, rest = max(suspects, key=lambda found: min(abs(found[0] - other) for other in found[2]))
        raise InputError(
            f"column {name!r}, row {lines[row]} of {source}: {level:g} is a level of that run alone; expected one of "
            f"{', '.join(f'{other:g}' for other in rest)}. Correct the cell, or leave the response of that run empty"
            + (_as_run(frame[name], rest) if max_levels > 3 else "")
        )


def _others_in_the_middle(frame: pd.DataFrame, name: str, row: int) -> bool:
    """Whether all other factors of a run are near the middle of their range, as in an axial or centre run."""
    others = frame.drop(columns=name)
    middle, half = (others.max() + others.min()) / 2, (others.max() - others.min()) / 2
    return bool((np.abs(others.iloc[row] - middle) < OFF_CENTRE * half).all())


def _check(coded: pd.Series, values: pd.Series, lines, max_levels: int, given: bool, composite: bool, source: str):
    """Notes on the levels of a column; an error where they are no design's and nobody said what the ends are."""
    levels = distinct(coded, LEVEL_TOLERANCE)
    if len(levels) > max_levels and not (given and max_levels > 3):
        raise InputError(
            f"column {coded.name!r} of {source} has {len(levels)} different values (row {lines[0]}: "
            f"{values.iloc[0]:g}, row {lines[1]}: {values.iloc[1]:g}, ...): not a design; expected at most "
            f"{max_levels} levels (low, middle, high). Leave out a column that is no factor, such as a run "
            "number, with --ignore, and name the responses where there are several with --response"
            + (_as_run(values) if max_levels > 3 else "")
        )
    if composite or (is_coded(values) and np.abs(values).max() > 1):
        return []
    if len(levels) > 3:
        if _regular(levels):
            return []
        return [f"{coded.name} has {len(levels)} levels, unevenly spread: analysed where they were run"]
    off = np.abs(coded - np.clip(np.round(coded), -1, 1)).to_numpy()
    row = int(np.argmax(off))
    place = f"{values.iloc[row]:g} in row {lines[row]} is {coded.iloc[row]:.3g} in coded units"
    surface, beyond = max_levels > 3, np.abs(coded).max() > 1 + LEVEL_TOLERANCE
    between = np.abs(coded.to_numpy()[np.abs(coded) < 1 - LEVEL_TOLERANCE]).max(initial=0.0) > OFF_CENTRE
    if (beyond or between) and not (surface and given):
        raise InputError(
            f"column {coded.name!r}, row {lines[row]} of {source}: {place}; expected -1, 0 or 1 (low, half way, high). "
            "Give a logarithmic factor as its logarithm"
            + (_as_run(values) if surface else ", or leave the response of runs at that level empty")
        )
    if off[row] > 0.02:
        return [f"{coded.name}: the level {place}: analysed where it was run"]
    return []


def _as_run(values: pd.Series, levels=None) -> str:
    """How to have levels analysed where they were run; the ends are those of the levels given, or of all."""
    levels = values if levels is None else levels
    return f", or analyse the levels where they were run, with --factor '{values.name}={min(levels):g},{max(levels):g}'"
