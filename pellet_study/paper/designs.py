"""The source paper's designs as tables that can be analysed (Tables 6, 7, 11, 12), and its fits."""

from functools import cache

import numpy as np

from pellet_study.doe import box_behnken, plackett_burman
from pellet_study.doe.design_table import DesignTable, code_design
from pellet_study.doe.factors import Factor
from pellet_study.doe.linear_model import LinearFit, fit
from pellet_study.paper.printed import table, tables

UNITS = {"G": "J/m2"}
"""Units of the factors; the others are pure numbers."""


def screening_factors() -> list[Factor]:
    """The seven factors of Table 6 (levels -1 and +1)."""
    rows = tables()["tables"]["6"]
    names = [printed[0].rsplit(" ", 1)[1] for printed in rows["printed"]]
    return [
        Factor(name, low, high, UNITS.get(name, "")) for name, (_, low, high) in zip(names, rows["values"], strict=True)
    ]


def surface_factors(b_reversed: bool = True) -> list[Factor]:
    """The three factors of Table 11; `b_reversed=False` turns B's coding the other way (-1 = 0.82)."""
    levels = table(11).set_index("Levels")
    factors = []
    for name in levels.columns:
        low, high = levels.loc[-1, name], levels.loc[1, name]
        if name == "B" and not b_reversed:
            low, high = high, low
        factors.append(Factor(name, float(low), float(high), UNITS.get(name, "")))
    return factors


@cache
def screening_table() -> DesignTable:
    """Table 7 (12 runs and a centre point)."""
    return code_design(table(7).drop(columns="No."), screening_factors(), source="Table 7")


@cache
def surface_table(b_reversed: bool = True) -> DesignTable:
    """Table 12 (17 runs)."""
    return code_design(table(12).drop(columns="No."), surface_factors(b_reversed), source="Table 12")


@cache
def screening() -> plackett_burman.Screening:
    """The analysis of Table 7."""
    return plackett_burman.analyse(screening_table(), interactions=False)


@cache
def surface(b_reversed: bool = True) -> box_behnken.Surface:
    """The quadratic fit of Table 12."""
    return box_behnken.analyse(surface_table(b_reversed))


@cache
def bench_fit(number: int, degree: int = 2) -> LinearFit:
    """The polynomial of Table 3 (Eq. 1) or Table 5 (Eq. 3) in its parameter, uncoded."""
    data = table(number).to_numpy(dtype=float)
    terms = {name: (0,) * power for power, name in enumerate(["1", "a", "a2"][: degree + 1])}
    return fit(["a"], terms, data[:, 1:2], data[:, 2])


def r_squared(model: LinearFit, response=None) -> float:
    """Coefficient of determination; of another response on the same runs where one is given."""
    response = model.response if response is None else np.asarray(response, float)
    residuals = response - model.matrix @ np.linalg.lstsq(model.matrix, response, rcond=None)[0]
    return float(1 - residuals @ residuals / np.sum((response - response.mean()) ** 2))


def implied_angles(row: int) -> tuple[float, float]:
    """The two repose angles (deg) that a relative error of Table 10 leaves open, row counted from 1."""
    target = tables()["text"]["repose_angle_physical_deg"]
    error = float(table(10)["Relative error"].iloc[row - 1]) / 100
    return target * (1 - error), target * (1 + error)
