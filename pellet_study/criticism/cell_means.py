"""What the readings say before any model: cell means, their variances, how well these are known, set-up scatter.

Rows of one case and one set-up are a cell. The standard deviation of a reading is taken as stated; where it is blank
it comes from the replicates of the rig and observable, pooled; where there are none it is unknown, and the scatter
about the fit has to serve.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy import stats

from pellet_study.model.model import Model, key
from pellet_study.study.measurements import Measurement

WELL_KNOWN = 1000  # degrees of freedom given to a standard deviation that is stated without its readings
SPAN_FOR_PROPORTION = 2.0  # readings must span this factor before noise is allowed to grow with them
ENOUGH_FOR_A_RULE = 4  # stated sds of fewer rows can follow one by chance
AGREE = (
    1e-4  # p of equal scatter below which rows keep their own; at 1 % one honest data set in 25 would lose its pooling
)


@dataclass(frozen=True)
class CellMeans:
    """Cell means to fit, ready whitened.

    Parameters
    ----------
    case : (n,) index of each cell's case in the model
    mean : (n,) cell means
    sd : (n,) standard uncertainty of each cell mean, set-up included
    whiten : (n, n) matrix W with W' W the inverse covariance, or (n,) its diagonal
    dof : degrees of freedom of the stated or pooled standard deviations; 0 where the scale is unknown
    replicate_chi2, replicate_dof : scatter of rows about their cell mean over its expectation
    warnings : what the reader must know
    group : (n,) number of each cell's rig and observable, whose standard deviations were found together
    group_dof : degrees of freedom of each group's standard deviation
    contradicted : {(rig, observable): how many times the stated sd its replicates scatter, where they contradict it}
    """

    case: np.ndarray
    mean: np.ndarray
    sd: np.ndarray
    whiten: np.ndarray
    dof: float
    replicate_chi2: float
    replicate_dof: int
    warnings: tuple[str, ...] = ()
    group: tuple[int, ...] = ()
    group_dof: tuple[int, ...] = ()
    contradicted: Mapping[tuple[str, str], float] = field(default_factory=dict)

    @property
    def scale_known(self) -> bool:
        """Whether the readings themselves say how far they scatter."""
        return self.dof > 0

    def whitened(self, differences: np.ndarray) -> np.ndarray:
        """W applied to differences whose last axis runs over the cells."""
        return differences * self.whiten if self.whiten.ndim == 1 else differences @ self.whiten.T


def pooled_sd(means: np.ndarray, sd: np.ndarray, dof: np.ndarray) -> np.ndarray:
    """Standard deviations of one reading, smoothed over cells.

    sigma^2 = s^2 ((1 - w) m^2 + w mean^2), m the median |mean|

    Parameters
    ----------
    means, sd, dof : (n,) cell means, standard deviations within cells, their degrees of freedom (0: no replicate)

    Notes
    -----
    w (0: constant, 1: proportional to the reading) only where the readings span a factor of two, averaged over by the
    likelihood of the cells' variances; s by pooling.
    """
    shape = _shapes(means)
    scale = (dof * sd**2 / shape).sum(axis=1) / dof.sum()
    likelihood = -0.5 * (dof * np.log(np.maximum(scale[:, None], 1e-300) * shape)).sum(axis=1)
    belief = np.exp(likelihood - likelihood.max())
    return np.exp(belief @ (0.5 * np.log(np.maximum(scale[:, None] * shape, 1e-300))) / belief.sum())


def _shapes(means: np.ndarray) -> np.ndarray:
    """Variances of a reading by cell, up to a factor, for each share w of noise that grows with the reading."""
    size = np.abs(means)
    middle = np.median(size)
    weights = np.array([0.0])
    if len(means) > 2 and middle > 0 and size.max() > SPAN_FOR_PROPORTION * size.min():
        weights = np.array([0.0, 0.3, 0.6, 0.8, 0.9, 0.95, 0.98, 0.99, 0.995, 0.998, 0.999, 1.0])
    shape = (1 - weights[:, None]) * max(middle, 1e-300) ** 2 + weights[:, None] * size**2
    return np.maximum(shape, 1e-12 * max(middle, 1e-150) ** 2)


def cell_means(model: Model, rows: Sequence[Measurement]) -> CellMeans:
    """CellMeans from the rows to fit."""
    place = {key(case): k for k, case in enumerate(model.cases)}
    cells: dict[tuple, list[Measurement]] = {}
    for row in rows:
        cells.setdefault((key(row), row.setup, row.setup_sd), []).append(row)
    members = list(cells.values())
    case = np.array([place[key(cell[0])] for cell in members])
    warnings: list[str] = []
    sd = np.array([_stated(cell) for cell in members])  # of one reading; nan where blank
    count = np.array([sum(row.n for row in cell) for cell in members], dtype=float)
    mean = np.array([sum(row.n * row.value for row in cell) for cell in members]) / count
    within = np.array(
        [sum(row.n * (row.value - m) ** 2 for row in cell) for cell, m in zip(members, mean, strict=True)]
    )
    repeats = np.array([len(cell) - 1 for cell in members], dtype=float)
    dof, chi2, chi2_dof, unknown = 0.0, 0.0, 0, np.zeros(len(members), dtype=bool)
    groups: dict[tuple[str, str], list[int]] = {}
    group_dof: list[int] = []
    found: dict[tuple[str, str], float] = {}
    ruled: list[int] = []  # groups whose sds follow a rule: it is known as well as the readings of all of them tell
    for k, cell in enumerate(members):
        groups.setdefault((cell[0].rig, cell[0].observable), []).append(k)
    for (rig, observable), indices in groups.items():
        g, before = np.array(indices), dof
        blank = np.isnan(sd[g])
        if blank.any():
            replicated = g[blank & (repeats[g] > 0)]
            if len(replicated):
                own = np.zeros(len(g))
                dofs = np.where(blank, repeats[g], 0.0)
                own[dofs > 0] = np.sqrt(within[g][dofs > 0] / dofs[dofs > 0])
                pooled = pooled_sd(mean[g], own, dofs)
                if not (pooled > 0).all():
                    warnings.append(f"{rig}: all replicates are equal, so they cannot tell the scatter of a reading")
                    unknown[g[blank]] = True
                else:
                    sd[g[blank]] = pooled[blank]
                    dof += dofs.sum()
            elif not blank.all():
                sd[g[blank]] = np.sqrt(np.nanmean(sd[g] ** 2))
                warnings.append(f"{rig} {observable}: rows without sd are given that of the others")
            else:
                unknown[g] = True
        stated = g[~blank]
        if len(stated):
            readings = count[stated] - np.array([len(members[k]) for k in stated])
            if (readings > 0).all():
                if not _by_rule(mean[stated], sd[stated]):
                    sd[stated] = _steadied(mean[stated], sd[stated], readings)
                elif len(stated) >= ENOUGH_FOR_A_RULE:
                    ruled.append(len(group_dof))
            dof += (readings.sum() + repeats[stated].sum()) if (readings > 0).any() else WELL_KNOWN
            expected = repeats[stated].sum()
            if expected:
                scatter = float((within[stated] / sd[stated] ** 2).sum())
                chi2, chi2_dof = chi2 + scatter, chi2_dof + int(expected)
                if stats.chi2.sf(scatter, expected) < 1e-3:
                    warnings.append(
                        f"{rig} {observable}: replicates contradict the stated sd (they scatter "
                        f"{np.sqrt(scatter / expected):.2g} times as much); their own scatter is used"
                    )
                    found[rig, observable] = np.sqrt(scatter / expected)
                    sd[stated] *= found[rig, observable]
                    chi2 += expected - scatter
        elif blank.any() and not unknown[g].all():
            chi2, chi2_dof = chi2 + float((within[g] / sd[g] ** 2).sum()), chi2_dof + int(repeats[g].sum())
        group_dof.append(int(dof - before))
    together = sum(group_dof[k] for k in ruled)
    group_dof = [together if k in ruled else known for k, known in enumerate(group_dof)]
    number = np.empty(len(members), dtype=int)
    for k, indices in enumerate(groups.values()):
        number[indices] = k
    setup_sd = np.array([cell[0].setup_sd for cell in members])
    if unknown.any():
        for (rig, observable), indices in groups.items():
            g = np.array(indices)
            if unknown[g].any():
                sd[g] = 0.05 * max(np.median(np.abs(mean[g])), 1e-9)
                warnings.append(
                    f"{rig} {observable}: neither sd nor replicates: how well a model fits cannot be judged"
                )
        dof = 0.0
    variance = sd**2 / count + setup_sd**2
    whiten = 1 / np.sqrt(variance)
    shared = [c[0].setup for c in members]
    if any(s and shared.count(s) > 1 and u > 0 for s, u in zip(shared, setup_sd, strict=True)):
        covariance = np.diag(variance)
        for a, first in enumerate(members):
            for b in range(a):
                second = members[b]
                if shared[a] and shared[a] == shared[b] and first[0].observable == second[0].observable:
                    covariance[a, b] = covariance[b, a] = setup_sd[a] * setup_sd[b]
        whiten = np.linalg.inv(np.linalg.cholesky(covariance + 1e-12 * np.diag(variance)))
    return CellMeans(
        case,
        mean,
        np.sqrt(variance),
        whiten,
        dof,
        chi2,
        chi2_dof,
        tuple(warnings),
        tuple(map(int, number)),
        tuple(group_dof),
        found,
    )


def _stated(cell: list[Measurement]) -> float:
    """Stated sd of a reading of a cell, nan where any row leaves it blank."""
    if any(row.sd is None for row in cell):
        return np.nan
    return float(np.sqrt(sum(row.n * row.sd**2 for row in cell) / sum(row.n for row in cell)))


def _by_rule(mean: np.ndarray, sd: np.ndarray) -> bool:
    """Whether stated sds follow a rule of the reading (a constant, a share, or between), and are no row's own."""
    return bool(np.ptp(np.log(sd) - 0.5 * np.log(_shapes(mean)), axis=1).min() < 0.05)


def _steadied(mean: np.ndarray, sd: np.ndarray, dof: np.ndarray) -> np.ndarray:
    """Stated sds of few readings each are estimates: pooled where they agree with one another, else as stated."""
    smooth = pooled_sd(mean, sd, dof)
    ratio = sd / smooth
    bartlett = float((-dof * np.log(ratio**2)).sum())
    spread = len(sd) - 1
    correction = 1 + ((1 / dof).sum() - 1 / dof.sum()) / (3 * spread)
    return smooth if stats.chi2.sf(bartlett / correction, spread) > AGREE else sd
