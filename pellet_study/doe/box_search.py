"""Minima over the box of coded settings, -1 to 1 in every factor, with or without a prediction kept between two values.

What is searched is anything fitted that has `predict` and `gradient` of coded points: a model or a response in its own unit.
"""

from collections.abc import Callable, Sequence

import numpy as np

STARTS = 3
"""The best points of a sample from which an end of the predictions is sought."""


def minimise(objective: Callable, gradient, start, constraints: Sequence[dict] = (), bounds=None) -> np.ndarray:
    """A minimum under constraints, in the box unless other bounds are given, by SLSQP; a gradient of None: by differences."""
    from scipy.optimize import minimize

    bounds = [(-1, 1)] * len(start) if bounds is None else bounds
    options = {"maxiter": 500, "ftol": 1e-13}
    return minimize(
        objective, start, jac=gradient, bounds=bounds, constraints=constraints, method="SLSQP", options=options
    ).x


def between(fitted, low: float, high: float, n_factors: int, n_more: int = 0) -> list[dict]:
    """The prediction between two values, each finite one a constraint on (x, further variables); equal where they are one."""
    rest = np.zeros(n_more)
    ends = [(1, low)] if low == high else [(1, low), (-1, high)]
    return [
        {
            "type": "eq" if low == high else "ineq",
            "fun": lambda z, sign=sign, end=end: sign * (fitted.predict(z[:n_factors])[0] - end),
            "jac": lambda z, sign=sign: np.concatenate([sign * fitted.gradient(z[:n_factors])[0], rest]),
        }
        for sign, end in ends
        if np.isfinite(end)
    ]


def lowest_and_highest(fitted, points) -> tuple[float, float]:
    """The ends of the predictions in the box, sought from the best of points (n_points, n_factors) that fill it."""
    predicted, ends = fitted.predict(points), []
    for sign in (1, -1):
        starts = points[np.argsort(sign * predicted)[:STARTS]]
        found = [
            minimise(
                lambda x, sign=sign: sign * fitted.predict(x)[0],
                lambda x, sign=sign: sign * fitted.gradient(x)[0],
                start,
            )
            for start in starts
        ]
        inside = np.clip(np.vstack([found, starts]), -1, 1)
        ends.append(sign * float(np.min(sign * fitted.predict(inside))))
    return ends[0], ends[1]
