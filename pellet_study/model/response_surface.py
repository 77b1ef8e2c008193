"""Response surfaces of a simulated observable: its mean as a smooth function of parameters and effects.

    ln mu = b0 + sum_k b_k x_k + sum_{j<=k} b_jk x_j x_k + sum_e E_e(u_e, x)
    E = c1 u + c2 u^2 + c3 u^3 + u sum_m d_m s_m + u sum_k g_k x_k

x are the free parameters scaled to -1...1 (on a logarithmic scale where their range spans a factor of two), u the amount
of an effect as a share of its physical limit (0: absent), s its shape parameters scaled likewise. The scatter of a mean
is taken as proportional to the mean: generalized linear models with gamma variance and logarithmic link (McCullagh &
Nelder 1989, doi:10.1007/978-1-4899-3242-6). Curvature and interactions of an effect have priors
about 0, as wide as all its simulations in a rig make likeliest. Where that is likelier still, exp E - 1 takes the place of
E, as for what adds to friction; where it is much likelier, ln(1 + a u)/ln(1 + a) that of u, as for yielding, which does
most of what it can at a tenth of its limit. Beyond the physical limit the terms go on along their tangent.

Where the observable is an angle, mu without effects is its tangent: friction is, so that a slip angle's surface is all
but a plane; an effect multiplies the angle itself by exp E.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import qmc

SPANS = 2.0  # ratio of the ends of a range from which on its logarithm is taken
FLOOR = 1e-3  # of the median mean; smaller means count as this
LINEAR = 10.0  # prior standard deviation of an effect's first coefficient: none to speak of
SCALES = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0)  # from which those of its curvature and interactions are chosen
LIKENESS = (0.0, 0.5, 0.8, 0.9, 0.95, 0.98, 0.99)  # from which the correlation of runs with and without it is
LEAST = (
    0.05  # of the base surface; an effect leaves at least so much, as a logarithm tells nothing of what is nearly none
)
BENDS = (0.0, 10.0, 100.0)  # from which a is
MUCH = 5.0  # gain in log likelihood from which a may differ from 0
QUIET = 0.0025  # relative variance of a point below which exp E - 1 may take the place of E
NO_INFORMATION = 1e6  # variance of a point whose simulations failed
ROUNDS = 12


@dataclass(frozen=True)
class Link:
    """How an observable goes with mu: mu itself, or, of an angle in degrees, its tangent."""

    angle: bool

    @classmethod
    def of(cls, observable: str) -> "Link":
        """By the unit in the observable's name."""
        return cls(observable.endswith("_deg"))

    def mu(self, value):
        """Observable to mu."""
        return np.tan(np.radians(np.minimum(value, 89.9))) if self.angle else value

    def observable(self, mu):
        """mu to the observable."""
        return np.degrees(np.arctan(mu)) if self.angle else mu

    def slope(self, mu):
        """Change of the observable with ln mu."""
        return np.degrees(mu / (1 + np.square(mu))) if self.angle else mu


@dataclass(frozen=True)
class Factor:
    """A number a surface depends on, with its range (low < high)."""

    low: float
    high: float

    @property
    def logarithmic(self) -> bool:
        """Whether the range spans a factor of two or more."""
        return self.low > 0 and self.high >= SPANS * self.low

    def scaled(self, value):
        """Value to -1...1 over the range."""
        if self.logarithmic:
            return 2 * np.log(np.maximum(value, 1e-300) / self.low) / np.log(self.high / self.low) - 1
        return 2 * (value - self.low) / (self.high - self.low) - 1

    def value(self, scaled):
        """-1...1 to the value."""
        if self.logarithmic:
            return self.low * (self.high / self.low) ** (0.5 * (scaled + 1))
        return self.low + 0.5 * (scaled + 1) * (self.high - self.low)


def quadratic(x: np.ndarray) -> np.ndarray:
    """(m, p) scaled parameters to (m, T) terms: 1, x_k, x_j x_k; T = (p + 1)(p + 2)/2."""
    p = x.shape[1]
    pairs = [x[:, j] * x[:, k] for j in range(p) for k in range(j, p)]
    return np.stack([np.ones(len(x)), *x.T, *pairs], axis=1)


def effect_terms(u: np.ndarray, shapes: np.ndarray, x: np.ndarray, bend: float = 0.0) -> np.ndarray:
    """(m,) amounts, (m, s) scaled shapes, (m, p) scaled parameters to (m, 3 + s + p) terms that vanish at u = 0.

    Beyond |u| = 1 they go on along their tangent.

    Parameters
    ----------
    bend : a; where it is not 0, sign(u) ln(1 + a |u|)/ln(1 + a) takes the place of u
    """
    if bend:
        inside = np.clip(u, -1, 1)
        grown = np.sign(inside) * np.log1p(bend * np.abs(inside)) / np.log1p(bend)
        u = grown + (u - inside) * bend / ((1 + bend) * np.log1p(bend))
    inside = np.clip(u, -1, 1)
    beyond = u - inside
    powers = [inside, inside**2, inside**3], [1.0, 2 * inside, 3 * inside**2]
    return np.stack(
        [value + slope * beyond for value, slope in zip(*powers, strict=True)]
        + [u * s for s in shapes.T]
        + [u * k for k in x.T],
        axis=1,
    )


@dataclass(frozen=True)
class Surface:
    """Coefficients of ln mu, their covariance, and the relative scatter (variance over mean squared) of one point.

    `of_ratio` says of an effect's that they are those of exp E - 1, `bend` is that of its terms; `free` are the points
    beyond the terms of a fit.
    """

    coefficients: np.ndarray
    covariance: np.ndarray
    scatter: float
    of_ratio: bool = False
    free: int = 0
    bend: float = 0.0

    @classmethod
    def fitted(cls, terms, means) -> "Surface":
        """Fit to the means of points, by reweighted least squares.

        Parameters
        ----------
        terms : (n, T)
        means : (n,) means over seeds; those below a thousandth of the median count as that
        """
        means = np.maximum(means, max(FLOOR * np.median(np.abs(means)), 1e-12))
        inverse = np.linalg.inv(terms.T @ terms + 1e-12 * np.eye(terms.shape[1]))
        eta = np.log(means)  # the usual start: the means themselves
        for _ in range(ROUNDS):
            coefficients = inverse @ (terms.T @ (eta + means * np.exp(-eta) - 1))
            eta = terms @ coefficients
        free = len(means) - terms.shape[1]
        scatter = max(float(np.square(means * np.exp(-eta) - 1).sum()) / max(free, 1), 1e-8)
        return cls(coefficients, scatter * inverse, scatter, free=max(free, 0))


def pooled(surfaces: Sequence[Surface]) -> list[Surface]:
    """Surfaces of one rig with the scatter they have in common, weighted by their degrees of freedom."""
    free = np.array([s.free for s in surfaces])
    if not free.any():
        return list(surfaces)
    scatter = float(free @ [s.scatter for s in surfaces]) / free.sum()
    return [replace(s, scatter=scatter, covariance=s.covariance * scatter / s.scatter) for s in surfaces]


@dataclass(frozen=True)
class EffectRuns:
    """What a site's simulations of an effect gave, beside those without it at the same places with the same seeds, if any.

    Parameters
    ----------
    u, shapes, x : (n,) amounts, (n, s) scaled shapes, (n, p) scaled parameters
    with_it, without : (n,) means; NaN where the simulations failed; None where there are none
    expected, known : (n,) logarithm of what the base surface gives there, and the (n, n) covariance of its error
    scatter : (n,) relative variance of one of the means
    """

    u: np.ndarray
    shapes: np.ndarray
    x: np.ndarray
    with_it: np.ndarray
    without: np.ndarray | None
    expected: np.ndarray
    known: np.ndarray
    scatter: np.ndarray


def fitted_effects(runs: Sequence[EffectRuns]) -> list[Surface]:
    """Surfaces of one effect at the sites of a rig, by Bayesian linear regression.

    What the effect shifts is measured from r ln(mean without it) + (1 - r) (base surface), r the correlation of the two
    means (a control variate: Hammersley & Handscomb 1964, doi:10.1007/978-94-009-5819-7, chapter 5), which leaves the
    variance scatter (1 - r^2) + (1 - r)^2 known. r and the prior standard deviations of curvature (c2, c3) and
    interactions (g) are those under which the runs of all sites together are likeliest (MacKay 1992,
    doi:10.1162/neco.1992.4.3.415).
    """
    bent = [np.stack([effect_terms(run.u, run.shapes, run.x, bend) for run in runs]) for bend in BENDS]
    shapes = runs[0].shapes.shape[1]
    paired = all(run.without is not None for run in runs)
    with_it = np.stack([np.log(np.maximum(run.with_it, LEAST * np.exp(run.expected))) for run in runs])
    without = np.stack([_log(run.without) for run in runs]) if paired else np.zeros_like(with_it)
    lost = ~np.isfinite(with_it + without)
    with_it, without = np.where(lost, 0.0, with_it), np.where(lost, 0.0, without)
    expected = np.where(lost, 0.0, [run.expected for run in runs])
    scatter = np.stack([run.scatter for run in runs])
    known, eye = np.stack([run.known for run in runs]), np.eye(len(runs[0].u))

    def measured(likeness: float) -> tuple[np.ndarray, np.ndarray]:
        """Shifts (k, n) and their covariance (k, n, n)."""
        # the logarithm of a mean that scatters lies half the variance below the logarithm of its expectation
        shift = with_it - likeness * without + (1 - likeness) * (scatter / 2 - expected)
        own = scatter * (1 - likeness**2) + NO_INFORMATION * lost
        return np.where(lost, 0.0, shift), (1 - likeness) ** 2 * known + own[:, :, None] * eye

    best, chosen = -np.inf, None
    forms = [(r, ratio) for r in (LIKENESS if paired else LIKENESS[:1]) for ratio in (False, True)]
    for terms, bend in zip(bent, BENDS, strict=True):
        likeliest, form = -np.inf, None
        for likeness, of_ratio in forms:
            value, noise = measured(likeness)
            change = 0.0  # logarithm of the Jacobian of what is fitted
            if of_ratio:
                if scatter.max() * (1 - likeness**2) > QUIET:  # the weights would follow the scatter
                    continue
                growth, change = np.exp(value), float(value.sum())
                value, noise = growth - 1, growth[:, :, None] * noise * growth[:, None, :]
            for curvature in SCALES:
                for interaction in SCALES:
                    prior = _prior(terms.shape[2], shapes, curvature, interaction)
                    spread_of = noise + (terms * prior**2) @ terms.transpose(0, 2, 1)
                    _, determinants = np.linalg.slogdet(spread_of)
                    solved = np.linalg.solve(spread_of, value[:, :, None])[:, :, 0]
                    likelihood = change - 0.5 * float((determinants + (value * solved).sum(axis=1)).sum())
                    if likelihood > likeliest:
                        likeliest, form = likelihood, (terms, prior, value, noise, of_ratio, bend)
        if likeliest > best + (MUCH if bend else 0.0):
            best, chosen = likeliest, form
    terms, prior, value, noise, of_ratio, bend = chosen
    weighted = np.linalg.solve(noise, terms)
    covariance = np.linalg.inv(terms.transpose(0, 2, 1) @ weighted + np.diag(prior**-2))
    coefficients = (covariance @ (weighted.transpose(0, 2, 1) @ value[:, :, None]))[:, :, 0]
    return [
        Surface(c, v, float(np.median(n.diagonal())), of_ratio, bend=bend)
        for c, v, n in zip(coefficients, covariance, noise, strict=True)
    ]


def _log(means: np.ndarray) -> np.ndarray:
    return np.log(np.maximum(means, max(FLOOR * np.nanmedian(np.abs(means)), 1e-12)))


def _prior(terms: int, shapes: int, curvature: float, interaction: float) -> np.ndarray:
    parameters = terms - 3 - shapes
    return np.array([LINEAR, curvature, curvature] + [LINEAR] * shapes + [interaction] * parameters)


def spread(count: int, dimensions: int, seed: int) -> np.ndarray:
    """(count, dimensions) points that fill -1...1 evenly (Sobol 1967, scrambled by the seed)."""
    if dimensions == 0:
        return np.empty((count, 0))
    sampler = qmc.Sobol(dimensions, seed=seed)
    return 2 * sampler.random_base2(int(np.ceil(np.log2(max(count, 2)))))[:count] - 1


def amounts(count: int, sides: int) -> np.ndarray:
    """(count,) amounts of an effect to simulate, as shares of its physical limit; denser near none."""
    if sides == 2:
        half = amounts((count + 1) // 2, 1)
        return np.concatenate([half, -half])[:count]
    return (np.arange(1, count + 1) / count) ** 1.5
