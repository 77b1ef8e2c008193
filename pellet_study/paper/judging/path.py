"""A printed path: whether its steps follow the fitted gradient."""

import numpy as np

from pellet_study.doe.factors import Factor
from pellet_study.doe.linear_model import LinearFit
from pellet_study.paper.verdicts import Item, judged

ALONG_DEG = 1.0
"""A path nearer to the gradient than this follows it."""


def steps_as_gradient(
    section: str,
    model: LinearFit,
    factors: list[Factor],
    points: np.ndarray,
    kept: int,
    before: str = "",
    after: str = "",
) -> Item:
    """The first step of a path beside the gradient of the first-order fit, in coded units, up or down.

    Parameters
    ----------
    points : ndarray (n_points, n_factors)
        Coded.
    kept : int
        The factor whose step the gradient is scaled to.
    before, after : str
        Of the reason.
    """
    steps = points[1] - points[0]
    slopes = np.array([model.coefficients[factor.name] for factor in factors])
    angle = np.degrees(np.arccos(np.abs(steps @ slopes) / np.linalg.norm(steps) / np.linalg.norm(slopes)))
    ranges = np.array([factor.half_range for factor in factors])
    physical, gradient = steps * ranges, steps[kept] * slopes / slopes[kept] * ranges
    moves = ", ".join(f"{factor.name} {move:+.2f}" for factor, move in zip(factors, physical, strict=True))
    wanted = ", ".join(f"{factor.name} {move:+.5f}" for factor, move in zip(factors, gradient, strict=True))
    return judged(
        section,
        f"steps {moves} as the steepest climb",
        "gradient",
        f"{angle:.2f} deg off",
        angle < ALONG_DEG,
        f"{before}the fitted gradient asks for {wanted}{after}",
    )
