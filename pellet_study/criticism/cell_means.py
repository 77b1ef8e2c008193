"""What the readings say before any model: cell means, their variances, how well these are known, set-up scatter.

Rows of one case and one set-up are a cell. The standard deviation of a reading is taken as stated; where it is blank
it comes from the replicates of the rig and observable, pooled; where there are none it is unknown, and the scatter
about the fit has to serve. Readings of one simulated experiment (the angle of a heap and its height) scatter together as the
simulation's do from seed to seed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from pellet_study.criticism.scatter import dof_of_groups, readings_of, sd_of_group
from pellet_study.model.model import Model, key
from pellet_study.study.measurements import Measurement

LEAST_EIGENVALUE = 0.02  # of a matrix of correlations
UNKNOWN_SHARE = 0.05  # of the median reading, an sd that nothing tells: it only weighs rigs against one another


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
    replicate_chi2 : scatter of rows about their cell mean over its expectation
    replicate_chi2_of : {(rig, observable): its part of that}
    setups : (n,) set-up and `setup_sd` of each cell
    alike : (n, n) correlation of what scatters in the readings; None where no two are of one experiment
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
    warnings: tuple[str, ...] = ()
    group: tuple[int, ...] = ()
    group_dof: tuple[int, ...] = ()
    contradicted: Mapping[tuple[str, str], float] = field(default_factory=dict)
    replicate_chi2_of: Mapping[tuple[str, str], float] = field(default_factory=dict)
    setups: tuple[tuple[str, float], ...] = ()
    alike: np.ndarray | None = None

    @property
    def scale_known(self) -> bool:
        """Whether the readings themselves say how far they scatter."""
        return bool(self.dof > 0)

    def whitened(self, differences: np.ndarray) -> np.ndarray:
        """W applied to differences whose last axis runs over the cells."""
        return differences * self.whiten if self.whiten.ndim == 1 else differences @ self.whiten.T


def cell_means(model: Model, rows: Sequence[Measurement]) -> CellMeans:
    """Cell means of the rows to fit, with what is known of their scatter."""
    place = {key(case): k for k, case in enumerate(model.cases)}
    cells = cells_of(rows)
    readings = readings_of(cells)
    members: dict[tuple[str, str], list[int]] = {}
    for k, cell in enumerate(cells):
        members.setdefault((cell[0].rig, cell[0].observable), []).append(k)
    groups = {name: sd_of_group(*name, readings.part(np.array(indices))) for name, indices in members.items()}
    sd, number = np.empty(len(cells)), np.empty(len(cells), dtype=int)
    chi2, warnings = 0.0, [text for group in groups.values() for text in group.warnings]
    for k, (name, group) in enumerate(groups.items()):
        sd[members[name]], number[members[name]] = group.sd, k
        for term in group.replicate_chi2:
            chi2 += term
    dof = sum(group.dof for group in groups.values())
    if not all(group.known.all() for group in groups.values()):  # the scatter about the fit has to serve for all
        dof = 0.0
        for name, group in groups.items():
            if not group.known.all():
                sd[members[name]] = UNKNOWN_SHARE * max(np.median(np.abs(readings.mean[members[name]])), 1e-9)
                warnings.append(f"{' '.join(name)}: neither sd nor replicates: how well a model fits cannot be judged")
    setup_sd = np.array([cell[0].setup_sd for cell in cells])
    own = sd**2 / readings.count
    variance = own + setup_sd**2
    case = np.array([place[key(cell[0])] for cell in cells])
    alike = alike_of(model, cells, case)
    return CellMeans(
        case=case,
        mean=readings.mean,
        sd=np.sqrt(variance),
        whiten=whitener(cells, variance, together_of(alike, own, readings.count)),
        dof=dof,
        replicate_chi2=chi2,
        warnings=tuple(warnings),
        group=tuple(map(int, number)),
        group_dof=dof_of_groups(groups.values()),
        contradicted={name: g.contradicted for name, g in groups.items() if g.contradicted is not None},
        replicate_chi2_of={name: float(sum(g.replicate_chi2)) for name, g in groups.items()},
        setups=tuple((cell[0].setup, cell[0].setup_sd) for cell in cells),
        alike=alike,
    )


def cells_of(rows: Sequence[Measurement]) -> list[list[Measurement]]:
    """The rows of each case and set-up."""
    cells: dict[tuple, list[Measurement]] = {}
    for row in rows:
        cells.setdefault((key(row), row.setup, row.setup_sd), []).append(row)
    return list(cells.values())


def alike_of(model: Model, cells: Sequence[Sequence[Measurement]], case: np.ndarray) -> np.ndarray | None:
    """Correlation (n, n) of cells that are readings of one experiment in one set-up; None where no two are."""
    several: dict[tuple, list[int]] = {}
    for k, cell in enumerate(cells):
        first = cell[0]
        several.setdefault((first.rig, first.setup, *key(first)[2:]), []).append(k)
    alike = np.eye(len(cells))
    for members in several.values():
        for i, j in combinations(members, 2):
            alike[i, j] = alike[j, i] = model.alike(model.cases[case[i]], model.cases[case[j]])
    return None if np.array_equal(alike, np.eye(len(cells))) else positive(alike)


def positive(alike: np.ndarray) -> np.ndarray:
    """The correlations with none of their eigenvalues below `LEAST_EIGENVALUE`: pairs estimated one by one may not fit together."""
    value, axes = np.linalg.eigh(alike)
    if value.min() >= LEAST_EIGENVALUE:
        return alike
    mended = axes @ (np.maximum(value, LEAST_EIGENVALUE)[:, None] * axes.T)
    size = np.sqrt(np.diag(mended))
    return mended / np.outer(size, size)


def together_of(alike: np.ndarray | None, own: np.ndarray, count: np.ndarray) -> np.ndarray | None:
    """Covariance (n, n) of cell means by readings of the same experiments, the fewer of each two; its diagonal is `own`."""
    if alike is None:
        return None
    shared = np.minimum.outer(count, count) / np.sqrt(np.outer(count, count))
    return alike * shared * np.sqrt(np.outer(own, own))


def whitener(
    cells: Sequence[Sequence[Measurement]], variance: np.ndarray, together: np.ndarray | None = None
) -> np.ndarray:
    """W with W' W the inverse covariance of the cell means; its diagonal where nothing is shared.

    `together` is their covariance by what scatters in readings of the same experiments.
    """
    covariance = covariance_of(cells, variance)
    if covariance is None and together is None:
        return 1 / np.sqrt(variance)
    if covariance is None:
        covariance = np.diag(variance)
    if together is not None:
        covariance = covariance + together - np.diag(np.diag(together))
    return np.linalg.inv(np.linalg.cholesky(covariance + 1e-12 * np.diag(variance)))


def shared_setups(rows: Sequence[Measurement]) -> list[list[int]]:
    """Places of rows that share a set-up of one rig and observable, and with it the error of setting up, two or more each."""
    of_setup: dict[tuple[str, str, str], list[int]] = {}
    for k, row in enumerate(rows):
        if row.setup and row.setup_sd > 0:
            of_setup.setdefault((row.rig, row.observable, row.setup), []).append(k)
    return [places for places in of_setup.values() if len(places) > 1]


def covariance_of(cells: Sequence[Sequence[Measurement]], variance: np.ndarray) -> np.ndarray | None:
    """Covariance of cell means whose cells share set-ups, and with them the error of setting up; None where none do."""
    first = [cell[0] for cell in cells]
    together = shared_setups(first)
    if not together:
        return None
    covariance = np.diag(variance)
    for members in together:
        setup_sd = np.array([first[k].setup_sd for k in members])
        covariance[np.ix_(members, members)] = np.outer(setup_sd, setup_sd)
    covariance[np.diag_indices(len(first))] = variance
    return covariance
