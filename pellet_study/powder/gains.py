"""What a further reading would tell: the share of the box that would be left, by readings that the surfaces make up."""

import numpy as np

from pellet_study.powder.posterior import LEVEL, Block, Posterior, region_share

TRUTHS = 200  # settings drawn from the posterior, each with a made-up reading


def expected_share(found: Posterior, further: Block, level: float = LEVEL, seed: int = 0) -> float:
    """Share of the box that the region of `level` would take on average, were the last reading of `further` taken.

    `further` has the readings of the posterior, and one more: its surfaces and scatter, a measured value that does not count.
    A truth is drawn from the posterior, a reading from what the surfaces say of it there, given the readings of the same
    heaps; and the posterior weighed anew.
    """
    mean, variance = _told(found, further)
    random = np.random.default_rng(seed)
    truths = random.choice(len(found.weights), TRUTHS, p=found.weights)
    readings = mean[truths] + np.sqrt(variance[truths]) * random.normal(size=TRUTHS)
    carrying = found.weights > found.weights.max() * 1e-6
    mean, variance, before = mean[carrying], variance[carrying], np.log(found.weights[carrying])
    shares = [_share_after(before, mean, variance, reading, len(found.weights), level) for reading in readings]
    return float(np.mean(shares)) * found.part


def _share_after(
    before: np.ndarray, mean: np.ndarray, variance: np.ndarray, reading: float, points: int, level: float
) -> float:
    """Share of the points in the region after one more reading, whose mean and variance each point tells."""
    logs = before - ((reading - mean) ** 2 / variance + np.log(variance)) / 2
    weights = np.exp(logs - logs.max())
    return region_share(np.sort(weights)[::-1] / weights.sum(), level) * len(weights) / points


def _told(found: Posterior, further: Block) -> tuple[np.ndarray, np.ndarray]:
    """Mean and variance (points,) of the further reading at each point, given those of the same heaps."""
    predicted = further.responses.predict(found.coded)
    whole = further.covariance + further.responses.covariance(found.coded)
    known = found.block.measured - predicted[:, :-1]
    shared = np.linalg.solve(whole[:, :-1, :-1], whole[:, :-1, -1:])[..., 0]
    mean = predicted[:, -1] + (shared * known).sum(axis=1)
    return mean, whole[:, -1, -1] - (shared * whole[:, :-1, -1]).sum(axis=1)
