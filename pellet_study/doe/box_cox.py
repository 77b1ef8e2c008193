"""The power of a response that the likelihood of a fitted model favours.

Reference
---------
Box, Cox, An analysis of transformations, J. Roy. Statist. Soc. B 26 (1964) 211,
doi:10.1111/j.2517-6161.1964.tb00553.x.
"""

from dataclasses import dataclass

import numpy as np

from pellet_study.doe.linear_model import LinearFit

BOX_COX_RANGE = (-5.0, 5.0)


@dataclass(frozen=True)
class BoxCox:
    """Maximum likelihood power of the response and its confidence interval at `level` (None: beyond -5 or 5).

    `beyond` is 5 or -5 where the likelihood still rises there: there is no power then, and no transformation helps.
    """

    power: float | None
    low: float | None
    high: float | None
    beyond: float | None = None
    level: float = 0.95

    @property
    def transformation_needed(self) -> bool:
        """Whether 1 (no transformation) lies outside the interval."""
        return (self.low is not None and self.low > 1) or (self.high is not None and self.high < 1)


def box_cox(model: LinearFit, alpha: float = 0.05) -> BoxCox | None:
    r"""Box-Cox power of the response, by profile likelihood.

    Maximises :math:`-\frac{n}{2}\ln(SSE_\lambda/n)`, :math:`SSE_\lambda` that of the model fitted to
    :math:`y^{(\lambda)} = (y^\lambda - 1)/(\lambda \dot y^{\lambda-1})`, :math:`\dot y` the geometric mean.

    Returns
    -------
    BoxCox or None
        None where a response is not positive or there is no residual.
    """
    if np.any(model.response <= 0) or not model.df_residual:
        return None
    from scipy.optimize import brentq, minimize_scalar
    from scipy.special import chdtri

    logs = np.log(model.response)
    projector = np.eye(len(logs)) - model.matrix @ model.inverse @ model.matrix.T

    def log_likelihood(power: float) -> float:
        relative = logs - logs.mean()  # constants drop out: the model has an intercept
        scaled = relative if abs(power) < 1e-8 else np.expm1(power * relative) / power
        return -len(logs) / 2 * np.log(np.sum((projector @ scaled) ** 2) / len(logs))

    low, high = BOX_COX_RANGE
    best = minimize_scalar(lambda power: -log_likelihood(power), bounds=(low, high), method="bounded").x
    beyond = next((end for end in (low, high) if log_likelihood(end) >= log_likelihood(best)), None)
    if beyond is not None:
        return BoxCox(None, None, None, beyond, 1 - alpha)
    limit = log_likelihood(best) - chdtri(1, alpha) / 2
    below, above = (
        float(brentq(lambda power: log_likelihood(power) - limit, best, end)) if log_likelihood(end) < limit else None
        for end in (low, high)
    )
    return BoxCox(float(best), below, above, level=1 - alpha)
