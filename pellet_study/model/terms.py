"""What the response surfaces are made of: the link, the scaled numbers they depend on, and their terms."""

from dataclasses import dataclass
from typing import Any

import numpy as np

SPANS = 2.0  # ratio of the ends of a range from which on its logarithm is taken


@dataclass(frozen=True)
class Link:
    """How an observable goes with mu: mu itself, or, of an angle in degrees, its tangent."""

    angle: bool

    @classmethod
    def of(cls, observable: str) -> "Link":
        """By the unit in the observable's name."""
        return cls(observable.endswith("_deg"))

    def mu(self, value: Any) -> Any:
        """Observable to mu."""
        return np.tan(np.radians(np.minimum(value, 89.9))) if self.angle else value

    def observable(self, mu: Any) -> Any:
        """mu to the observable."""
        return np.degrees(np.arctan(mu)) if self.angle else mu

    def slope(self, mu: Any) -> Any:
        """Change of the observable with ln mu."""
        return np.degrees(mu / (1 + np.square(mu))) if self.angle else mu


@dataclass(frozen=True)
class Range:
    """What a number that a surface depends on lies between (low < high)."""

    low: float
    high: float

    @property
    def logarithmic(self) -> bool:
        """Whether the range spans a factor of two or more."""
        return self.low > 0 and self.high >= SPANS * self.low

    def scaled(self, value: Any) -> Any:
        """Value to -1...1 over the range."""
        if self.logarithmic:
            return 2 * np.log(np.maximum(value, 1e-300) / self.low) / np.log(self.high / self.low) - 1
        return 2 * (value - self.low) / (self.high - self.low) - 1

    def value(self, scaled: Any) -> Any:
        """-1...1 to the value."""
        if self.logarithmic:
            return self.low * (self.high / self.low) ** (0.5 * (scaled + 1))
        return self.low + 0.5 * (scaled + 1) * (self.high - self.low)


def quadratic_terms(x: np.ndarray) -> np.ndarray:
    """(m, p) scaled parameters to (m, T) terms: 1, x_k, x_j x_k; T = (p + 1)(p + 2)/2."""
    p = x.shape[1]
    pairs = [x[:, j] * x[:, k] for j in range(p) for k in range(j, p)]
    return np.stack([np.ones(len(x)), *x.T, *pairs], axis=1)


def effect_terms(u: np.ndarray, shapes: np.ndarray, x: np.ndarray, bend: float = 0.0) -> np.ndarray:
    """(m,) amounts, (m, s) scaled shapes, (m, p) scaled parameters to (m, 3 + s + p) terms that vanish at u = 0.

    Beyond |u| = 1 they go on along their tangent.

    Parameters
    ----------
    bend : a; where it is not 0, sign(u) ln(1 + a |u|)/ln(1 + a) takes the place of u
    """
    if bend:
        inside = np.clip(u, -1, 1)
        grown = np.sign(inside) * np.log1p(bend * np.abs(inside)) / np.log1p(bend)
        u = grown + (u - inside) * bend / ((1 + bend) * np.log1p(bend))
    inside = np.clip(u, -1, 1)
    beyond = u - inside
    powers = [inside, inside**2, inside**3], [1.0, 2 * inside, 3 * inside**2]
    return np.stack(
        [value + slope * beyond for value, slope in zip(*powers, strict=True)]
        + [u * s for s in shapes.T]
        + [u * k for k in x.T],
        axis=1,
    )
