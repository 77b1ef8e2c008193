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

FLOOR = 1e-3  # of the median mean; smaller means count as this
ROUNDS = 12


@dataclass(frozen=True)
class LogSurface:
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
    def fitted(cls, terms: np.ndarray, means: np.ndarray) -> "LogSurface":
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


def pooled(surfaces: Sequence[LogSurface]) -> list[LogSurface]:
    """Surfaces of one rig with the scatter they have in common, weighted by their degrees of freedom."""
    free = np.array([s.free for s in surfaces])
    if not free.any():
        return list(surfaces)
    scatter = float(free @ [s.scatter for s in surfaces]) / free.sum()
    return [replace(s, scatter=scatter, covariance=s.covariance * scatter / s.scatter) for s in surfaces]
