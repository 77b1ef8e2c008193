"""The variance that rounding alone gives to readings, by the decimals they were written with.

Reference
---------
Sheppard, On the calculation of the most probable values of frequency-constants, Proc. London Math. Soc. 29 (1897) 353,
doi:10.1112/plms/s1-29.1.353: a reading rounded to multiples of h has an error of variance h^2/12.
"""

import numpy as np

DECIMALS = 15
"""Decimals of a double: a step below 10^-15 of the greatest reading is no rounding of the table's."""


def rounding_variance(readings) -> float:
    """h^2/12, h the greatest power of ten of which all readings are multiples; 0 where all are 0 or none is rounded."""
    readings = np.asarray(readings, dtype=float)
    greatest = np.abs(readings).max(initial=0.0)
    if not greatest or not np.isfinite(greatest):
        return 0.0
    top = int(np.floor(np.log10(greatest)))
    for power in range(top, top - DECIMALS, -1):
        multiples = readings / 10.0**power
        if np.all(np.abs(multiples - np.round(multiples)) < 1e-9 * np.maximum(1.0, np.abs(multiples))):
            return float(10.0 ** (2 * power) / 12)
    return 0.0
