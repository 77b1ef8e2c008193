"""Standard deviations in measurements.csv that look like another unit, before anything is computed from them."""

from collections.abc import Sequence

import numpy as np

from pellet_study.study.measurements import Measurement

ONE_OFF = (
    20.0  # times the others' sd, and the others' share of the reading, from which one row's sd is said to stand out
)
LARGE, SMALL = 0.5, 1e-4  # of the readings: sds beyond are rarely those of a measurement
NO_NEARER = 0.1  # of the largest reading: readings nearer to zero count as so large


def unusual_sd(rows: Sequence[Measurement]) -> list[str]:
    """A sentence on the stated sds of every rig and observable that stand out, alone or all together."""
    groups: dict[tuple[str, str], list[Measurement]] = {}
    for row in rows:
        if row.sd is not None and row.split != "leave_out":
            groups.setdefault((row.rig, row.observable), []).append(row)
    return [f"{rig}: {words}" for (rig, _), some in groups.items() for words in _of_group(some)]


def median_of_others(values: np.ndarray) -> np.ndarray:
    """For each of at least two values the median of all others, from one sorting of them."""
    order = np.argsort(values, kind="stable")
    ranked, rank = values[order], np.argsort(order, kind="stable")
    low, high = (len(values) - 2) // 2, (len(values) - 1) // 2
    return 0.5 * (ranked[low + (rank <= low)] + ranked[high + (rank <= high)])


def _of_group(rows: Sequence[Measurement]) -> list[str]:
    sd = np.array([row.sd for row in rows], dtype=float)
    size = np.abs([row.value for row in rows])
    share_of = sd / np.maximum(size, NO_NEARER * max(size.max(), 1e-300))
    found = []
    others_sd, others_size = (median_of_others(values) for values in (sd, size)) if len(rows) > 3 else ((), ())
    for k, row in enumerate(rows if len(rows) > 3 else ()):
        times = sd[k] / others_sd[k]
        share = times * others_size[k] / max(size[k], 1e-300)
        if min(times, share) > ONE_OFF or max(times, share) < 1 / ONE_OFF:
            than = f"{times:.3g} times" if times > 1 else f"a {1 / times:.3g}th of"
            found.append(f"line {row.line}: sd {sd[k]:g} is {than} that of the other rows: is it in another unit?")
    if found:
        return found
    usual = float(np.median(share_of))
    if not SMALL < usual < LARGE and size.max() > 0:
        return [f"sd is {usual:.2g} of the reading (median of {len(rows)} rows): is sd in another unit?"]
    return []
