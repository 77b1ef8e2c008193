"""How far one reading scatters: as stated, steadied where few readings are behind it, else pooled from replicates.

The cells of one rig and observable are a group, whose standard deviations are found together.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from decimal import Decimal

import numpy as np
from scipy import stats

from pellet_study.study.measurements import Measurement

WELL_KNOWN = 1000  # degrees of freedom given to a standard deviation that is stated without its readings
SPAN_FOR_PROPORTION = 2.0  # readings must span this factor before noise is allowed to grow with them
ENOUGH_FOR_A_RULE = 4  # stated sds of fewer rows can follow one by chance
# p of equal scatter below which rows keep their own; at 1 % one honest data set in 25 would lose its pooling
AGREE = 1e-4
CONTRADICTED = 1e-3  # p of the replicates' scatter below which the stated sd is not believed; chance gives 1 in 1000
EQUAL = 1e-9  # of a reading; replicates that differ by less are equal but for rounding
RULE_WIDTH = 0.05  # of ln sd about a rule: printed with two or three digits, sds are rounded by as much


@dataclass(frozen=True)
class Readings:
    """What the rows of some cells say, (n,) each.

    Parameters
    ----------
    stated : sd of one reading, nan where any row of the cell leaves it blank
    mean, within : cell means, and the sums of squares of the rows about them
    count, rows : how many readings and how many rows there are in each cell
    resolution : the instrument's smallest step, 0 where it is not given
    step : the last digit that is written of the readings
    """

    stated: np.ndarray
    mean: np.ndarray
    within: np.ndarray
    count: np.ndarray
    rows: np.ndarray
    resolution: np.ndarray
    step: np.ndarray

    @property
    def repeats(self) -> np.ndarray:
        """Degrees of freedom of the rows about their cell mean."""
        return self.rows - 1

    def part(self, kept: np.ndarray) -> "Readings":
        """Those of some cells."""
        return Readings(*(getattr(self, f.name)[kept] for f in fields(self)))


@dataclass(frozen=True)
class GroupSd:
    """Standard deviations of one reading of a group, the cells of one rig and observable.

    Parameters
    ----------
    sd : (n,), nan where `known` is False
    dof : degrees of freedom they are known with
    by_rule : the stated ones follow a rule, which is known as well as all groups' readings tell
    replicate_chi2 : scatter of rows about their cell mean over its expectation, as terms to be added
    contradicted : how many times the stated sd the replicates scatter, where they contradict it
    """

    sd: np.ndarray
    known: np.ndarray
    dof: float = 0.0
    by_rule: bool = False
    replicate_chi2: tuple[float, ...] = ()
    contradicted: float | None = None
    warnings: tuple[str, ...] = ()


def readings_of(cells: Sequence[Sequence[Measurement]]) -> Readings:
    """What the rows of each cell say."""
    stated = np.array([_stated(cell) for cell in cells])
    count = np.array([sum(row.n for row in cell) for cell in cells], dtype=float)
    mean = np.array([sum(row.n * row.value for row in cell) for cell in cells]) / count
    within = np.array([sum(row.n * (row.value - m) ** 2 for row in cell) for cell, m in zip(cells, mean, strict=True)])
    resolution = np.array([max(row.resolution for row in cell) for cell in cells])
    step = np.array([last_digit([row.value for row in cell]) for cell in cells])
    return Readings(stated, mean, within, count, np.array([len(c) for c in cells], dtype=float), resolution, step)


def last_digit(values: Sequence[float]) -> float:
    """The place of the last digit of some readings as they are written, at most 1: 0.1 of 31.2 and 30."""
    exponents = [Decimal(repr(float(value))).normalize().as_tuple().exponent for value in values]
    return 10.0 ** min(0, *(int(exponent) for exponent in exponents))


def no_less_than_resolution(
    what: str, pooled: np.ndarray, size: np.ndarray, resolution: np.ndarray, step: np.ndarray
) -> tuple[np.ndarray, tuple[str, ...]]:
    """Standard deviations from replicates, at least the instrument's resolution; where all replicates are equal and it is
    not given, at least the last digit written, which is said.

    Parameters
    ----------
    pooled, size, resolution, step : (n,) standard deviations, |means|, as `Readings` has them
    """
    least = resolution
    warnings: tuple[str, ...] = ()
    if (pooled <= EQUAL * size).all() and not resolution.all():
        assumed = float(step.min())
        least = np.where(resolution > 0, resolution, assumed)
        warnings = (
            f"{what}: all replicates are equal, so they cannot tell the scatter of a reading; its sd is assumed to be the last "
            f"digit written, {assumed:g}; give the instrument's smallest step in a column resolution, or sd",
        )
    return np.maximum(pooled, least), warnings


def sd_of_group(rig: str, observable: str, readings: Readings) -> GroupSd:
    """Standard deviations of one reading in the cells of a rig and observable: as stated, else pooled from replicates."""
    blank = np.isnan(readings.stated)
    filled, stated = sd_where_blank(rig, observable, readings, blank), readings.part(~blank)
    if not len(stated.stated):
        known = filled.known.any()
        chi2 = (float((readings.within / filled.sd**2).sum()),) if known else ()
        return replace(filled, replicate_chi2=chi2)
    as_stated = sd_where_stated(rig, observable, stated)
    sd = filled.sd.copy()
    sd[~blank] = as_stated.sd
    return replace(
        as_stated,
        sd=sd,
        known=filled.known,
        dof=filled.dof + as_stated.dof,
        warnings=(*filled.warnings, *as_stated.warnings),
    )


def sd_where_blank(rig: str, observable: str, readings: Readings, blank: np.ndarray) -> GroupSd:
    """Standard deviations of a group with the blank ones filled in: by replicates, else by the stated ones."""
    sd, known = readings.stated.copy(), np.ones(len(blank), dtype=bool)
    if not blank.any():
        return GroupSd(sd, known)
    if (blank & (readings.repeats > 0)).any():
        dofs = np.where(blank, readings.repeats, 0.0)
        own = np.zeros(len(blank))
        own[dofs > 0] = np.sqrt(readings.within[dofs > 0] / dofs[dofs > 0])
        pooled, warnings = no_less_than_resolution(
            f"{rig} {observable}",
            pooled_sd(readings.mean, own, dofs),
            np.abs(readings.mean),
            readings.resolution,
            readings.step,
        )
        sd[blank] = pooled[blank]
        return GroupSd(sd, known, dof=dofs.sum(), warnings=warnings)
    if blank.all():
        return GroupSd(sd, ~blank)
    sd[blank] = np.sqrt(np.nanmean(sd**2))
    return GroupSd(sd, known, warnings=(f"{rig} {observable}: rows without sd are given that of the others",))


def sd_where_stated(rig: str, observable: str, readings: Readings) -> GroupSd:
    """Stated standard deviations of a group, steadied where few readings are behind each, widened where replicates
    contradict them."""
    sd, known, by_rule = (
        np.maximum(readings.stated, readings.resolution),
        np.ones(len(readings.stated), dtype=bool),
        False,
    )
    dofs = readings.count - readings.rows  # of what is behind a stated sd: its own readings
    if (dofs > 0).all():
        if not _by_rule(readings.mean, sd):
            sd = _steadied(readings.mean, sd, dofs)
        else:
            by_rule = len(sd) >= ENOUGH_FOR_A_RULE
    dof = (dofs.sum() + readings.repeats.sum()) if (dofs > 0).any() else WELL_KNOWN
    expected = readings.repeats.sum()
    if not expected:
        return GroupSd(sd, known, dof, by_rule)
    scatter = float((readings.within / sd**2).sum())
    if stats.chi2.sf(scatter, expected) >= CONTRADICTED:
        return GroupSd(sd, known, dof, by_rule, (scatter,))
    times = np.sqrt(scatter / expected)
    warning = (
        f"{rig} {observable}: replicates contradict the stated sd (they scatter {times:.2g} times as much); their own "
        "scatter is used"
    )
    return GroupSd(sd * times, known, dof, by_rule, (scatter, expected - scatter), times, (warning,))


def dof_of_groups(groups: Iterable[GroupSd]) -> tuple[int, ...]:
    """Degrees of freedom of each group's standard deviations; those by a rule have what all such groups have together."""
    groups = list(groups)
    together = sum(int(group.dof) for group in groups if group.by_rule)
    return tuple(together if group.by_rule else int(group.dof) for group in groups)


def pooled_sd(means: np.ndarray, sd: np.ndarray, dof: np.ndarray, at: np.ndarray | None = None) -> np.ndarray:
    """Standard deviations of one reading, smoothed over cells.

    sigma^2 = s^2 ((1 - w) m^2 + w mean^2), m the median |mean|

    Parameters
    ----------
    means, sd, dof : (n,) cell means, standard deviations within cells, their degrees of freedom (0: no replicate)
    at : (k,) readings whose standard deviations are asked for by the same rule; default the means

    Notes
    -----
    w (0: constant, 1: proportional to the reading) only where the readings span a factor of two, averaged over by the
    likelihood of the cells' variances; s by pooling.
    """
    shape = _shapes(means)
    scale = (dof * sd**2 / shape).sum(axis=1) / dof.sum()
    likelihood = -0.5 * (dof * np.log(np.maximum(scale[:, None], 1e-300) * shape)).sum(axis=1)
    belief = np.exp(likelihood - likelihood.max())
    wanted = shape if at is None else _shapes(means, at)
    return np.exp(belief @ (0.5 * np.log(np.maximum(scale[:, None] * wanted, 1e-300))) / belief.sum())


def _shapes(means: np.ndarray, at: np.ndarray | None = None) -> np.ndarray:
    """Variances of a reading by cell, or of readings `at`, up to a factor, for each share w of noise that grows with the reading."""
    size = np.abs(means)
    middle = np.median(size)
    weights = np.array([0.0])
    if len(means) > 2 and middle > 0 and size.max() > SPAN_FOR_PROPORTION * size.min():
        weights = np.array([0.0, 0.3, 0.6, 0.8, 0.9, 0.95, 0.98, 0.99, 0.995, 0.998, 0.999, 1.0])
    size = size if at is None else np.abs(at)
    shape = (1 - weights[:, None]) * max(middle, 1e-300) ** 2 + weights[:, None] * size**2
    return np.maximum(shape, 1e-12 * max(middle, 1e-150) ** 2)


def _stated(cell: Sequence[Measurement]) -> float:
    """Stated sd of a reading of a cell, nan where any row leaves it blank."""
    sds = [row.sd for row in cell if row.sd is not None]
    if len(sds) < len(cell):
        return np.nan
    squares = sum(row.n * sd**2 for row, sd in zip(cell, sds, strict=True))
    return float(np.sqrt(squares / sum(row.n for row in cell)))


def _by_rule(mean: np.ndarray, sd: np.ndarray) -> bool:
    """Whether stated sds follow a rule of the reading (a constant, a share, or between), and are no row's own."""
    return bool(np.ptp(np.log(sd) - 0.5 * np.log(_shapes(mean)), axis=1).min() < RULE_WIDTH)


def _steadied(mean: np.ndarray, sd: np.ndarray, dof: np.ndarray) -> np.ndarray:
    """Stated sds of few readings each are estimates: pooled where they agree with one another, else as stated."""
    smooth = pooled_sd(mean, sd, dof)
    ratio = sd / smooth
    bartlett = float((-dof * np.log(ratio**2)).sum())
    spread = len(sd) - 1
    correction = 1 + ((1 / dof).sum() - 1 / dof.sum()) / (3 * spread)
    return smooth if stats.chi2.sf(bartlett / correction, spread) > AGREE else sd
