"""A response analysed on another scale (log, square root, inverse, any power), and the way back.

References
----------
Box, Cox, An analysis of transformations, J. Roy. Statist. Soc. B 26 (1964) 211,
doi:10.1111/j.2517-6161.1964.tb00553.x.
"""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from pellet_study.doe.box_cox import BoxCox
from pellet_study.doe.design_table import DesignTable
from pellet_study.errors import InputError
from pellet_study.tables.numbers import number_given

NAMED = {"log": 0.0, "sqrt": 0.5, "inverse": -1.0}
USUAL = (-1.0, -0.5, 0.0, 0.5, 1.0, 2.0)
"""Powers that have a meaning; the logarithm, under which factors multiply, comes first."""


@dataclass(frozen=True)
class Transformation:
    r"""The power :math:`z = y^\lambda` of a response, :math:`z = \ln y` for 0; monotone, for positive y.

    A negative power turns the order round: z falls where y rises.
    """

    power: float

    def forward(self, response):
        """z of a response y; NaN where y is not positive (0 is, for a positive power)."""
        response = np.asarray(response, dtype=float)
        usable = response > 0 if self.power <= 0 else response >= 0
        safe = np.where(usable, response, 1.0)
        return np.where(usable, np.log(safe) if self.power == 0 else safe**self.power, np.nan)

    def back(self, transformed):
        """y of a transformed response z; where z has left the range of the power, 0 or infinity."""
        transformed = np.asarray(transformed, dtype=float)
        if self.power == 0:
            return np.exp(transformed)
        beyond = 0.0 if self.power > 0 else np.inf
        safe = np.where(transformed > 0, transformed, 1.0)
        return np.where(transformed > 0, safe ** (1 / self.power), beyond)

    def holds(self, transformed):
        """Whether a transformed response z lies in the range of the power, that is, whether there is a y of it."""
        return np.asarray(transformed, dtype=float) > (-np.inf if self.power == 0 else 0.0)

    def slope_back(self, transformed):
        """dy/dz; 0 where z has left the range of the power."""
        transformed = np.asarray(transformed, dtype=float)
        if self.power == 0:
            return np.exp(transformed)
        safe = np.where(transformed > 0, transformed, 1.0)
        return np.where(transformed > 0, safe ** (1 / self.power - 1) / self.power, 0.0)

    def name_of(self, response: str) -> str:
        """The transformed response's name: ln(y), sqrt(y), 1/y, y^2."""
        bracketed = f"({response})" if set(response.partition("(")[0]) & set("/*^+-") else response
        named = {0.0: f"ln({response})", 0.5: f"sqrt({response})", -1.0: f"1/{bracketed}"}
        return named.get(self.power, f"{bracketed}^{self.power:g}")

    def applied(self, table: DesignTable) -> DesignTable:
        """The table with its response transformed.

        Raises
        ------
        InputError
            Naming the first row whose response the power does not take.
        """
        values = self.forward(table.response)
        if np.isnan(values).any():
            row = int(np.argmax(np.isnan(values)))
            raise InputError(
                f"row {table.lines[row]}: the response {table.response.name!r} is {table.response.iloc[row]:g}, which "
                f"{self.name_of('y')} does not take: expected positive values; leave --transform out, or analyse the "
                "response with a constant added to every run"
            )
        name = self.name_of(str(table.response.name))
        slopes = self.slope_back(values)
        steps = 1 / np.where(slopes, slopes, np.inf)  # of the transformed response to one of the response
        rounding = float(table.rounding_variance * np.mean(steps**2))
        response = pd.Series(values, index=table.response.index, name=name)
        return replace(table, response=response, rounding=rounding)


def parse_transformation(word: str) -> Transformation:
    """`log`, `sqrt`, `inverse` or a power.

    Raises
    ------
    InputError
        If it is neither, or the power 1, which changes nothing.
    """
    try:
        power = NAMED[word] if word in NAMED else number_given(word)
    except ValueError:
        power = np.nan
    if not np.isfinite(power) or power == 1 or abs(power) > 5:
        raise InputError(
            f"--transform {word}: expected {', '.join(NAMED)} or a power between -5 and 5 other than 1, such as 0.25"
        )
    return Transformation(power)


def advised(box_cox: BoxCox | None) -> str | None:
    """The word to give to --transform where the Box-Cox interval shuts 1 out; None where no transformation is needed.

    The logarithm where the interval holds 0, else the usual power in it that is nearest to the most likely one, else that
    one itself, with two decimals or as few as keep it in the interval and off 1.
    """
    if box_cox is None or box_cox.power is None or not box_cox.transformation_needed:
        return None
    low = -np.inf if box_cox.low is None else box_cox.low
    high = np.inf if box_cox.high is None else box_cox.high
    usual = [power for power in USUAL if low <= power <= high]
    if 0.0 in usual:
        power = 0.0
    elif usual:
        power = min(usual, key=lambda value: abs(value - box_cox.power))
    else:
        rounded = (round(box_cox.power, decimals) for decimals in range(2, 17))
        power = next(power for power in rounded if low <= power <= high and power != 1)
    return next((word for word, value in NAMED.items() if value == power), f"{power:g}")
