"""The next measurement: where the predictions of rival explanations differ most over the uncertainty of that difference.

Of the conditions that could be measured, the one with the largest sum over pairs of rivals of
w_a w_b (y_a - y_b)^2 / (s^2 + v_a + v_b): y the rivals' predictions, v their variances, s the uncertainty of a reading,
w exp(-chi2/2) (Buzzi-Ferraris & Forzatti 1983, doi:10.1016/0009-2509(83)80012-8; Box & Hill 1967,
doi:10.2307/1266318).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from pellet_study.criticism.calibration import CalibratedStudy, reduced_chi2
from pellet_study.criticism.least_squares import Fit
from pellet_study.criticism.possible import FEW_LEVELS, needs_simulation, possible_cases
from pellet_study.criticism.predictions import predictions, reading_uncertainty
from pellet_study.criticism.verdicts import SEPARATES
from pellet_study.rigs.declared import Condition

UNLIKELY = 8.0  # chi2 behind the best beyond which a rival, one fiftieth as likely, loses no more weight


@dataclass(frozen=True)
class NextMeasurement:
    """What to measure, and what each rival predicts there (with its own uncertainty and that of the reading).

    `separation` of the two that lie `farthest` apart, `least_separation` of the two that lie `closest`, in standard
    uncertainties of their difference.
    """

    rig: str
    observable: str
    conditions: dict[str, Condition]
    predictions: dict[str, float]
    uncertainties: dict[str, float]
    separation: float
    farthest: tuple[str, str]
    least_separation: float
    closest: tuple[str, str]


def next_measurement(state: CalibratedStudy, rivals: Mapping[tuple[str, ...], Fit]) -> NextMeasurement | None:
    """The condition that separates rival explanations, {effects: fit}, best; None where none does."""
    if len(rivals) < 2:
        return None
    levels = FEW_LEVELS if needs_simulation(state.study) else state.model.levels
    cases = possible_cases(state.study, levels, {e for names in rivals for e in names})
    if not cases:
        return None
    fits = list(rivals.values())
    means, variances = predictions(state, cases, fits)
    chi2 = np.array([fit.chi2 for fit in fits])
    worse = (chi2 - chi2.min()) / reduced_chi2(state, fits[chi2.argmin()])
    weights = np.exp(-0.5 * np.minimum(worse, UNLIKELY))
    weights /= weights.sum()
    sigma = reading_uncertainty(state, cases, means[0])
    apart = {
        (a, b): np.nan_to_num((means[a] - means[b]) ** 2 / (sigma**2 + variances[a] + variances[b]))
        for a, b in combinations(range(len(fits)), 2)
    }
    gain = sum((weights[a] * weights[b] * d for (a, b), d in apart.items()), np.zeros(len(cases)))
    limits = [state.study.catalogue.rigs[c.rig].readable.get(c.observable, (-np.inf, np.inf)) for c in cases]
    readable = [all(low <= m <= high for m in means[:, k]) for k, (low, high) in enumerate(limits)]
    gain = np.where(readable, gain, -1.0)
    best = int(np.argmax(gain))
    there = {pair: float(d[best]) for pair, d in apart.items()}
    farthest, closest = max(there, key=there.__getitem__), min(there, key=there.__getitem__)
    if gain[best] < 0 or there[farthest] < SEPARATES:
        return None
    labels = [" + ".join(names) for names in rivals]
    return NextMeasurement(
        rig=cases[best].rig,
        observable=cases[best].observable,
        conditions=dict(cases[best].conditions),
        predictions=dict(zip(labels, map(float, means[:, best]), strict=True)),
        uncertainties=dict(zip(labels, map(float, np.sqrt(variances[:, best] + sigma[best] ** 2)), strict=True)),
        separation=there[farthest] ** 0.5,
        farthest=(labels[farthest[0]], labels[farthest[1]]),
        least_separation=there[closest] ** 0.5,
        closest=(labels[closest[0]], labels[closest[1]]),
    )
