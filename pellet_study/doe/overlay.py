"""The regions of several responses laid over one another in the plane of two factors, as plain arrays to draw from."""

from dataclasses import dataclass

import numpy as np

from pellet_study.doe.desirability import overall_desirability
from pellet_study.doe.joint_set import JointSet
from pellet_study.errors import InputError


@dataclass(frozen=True)
class Overlay:
    """A plane through the box: the first factor along the columns of the arrays, the second along the rows.

    Attributes
    ----------
    names : (str, str)
        The two factors.
    x, y : ndarray (n,)
        Their physical levels, coded -1 first.
    coded : ndarray (n, n, n_factors)
        The points.
    rest : dict
        {factor: physical level} of the factors that are held.
    predicted : dict
        {response: ndarray (n, n)}, each in its own unit.
    accepted : dict
        {response: (low, high)}, -inf or inf where there is no limit.
    met : dict
        {response: ndarray (n, n) of bool}: where its prediction is acceptable.
    all_met : ndarray (n, n) of bool
        Where all are: the region that meets all goals.
    desirability : ndarray (n, n)
        Overall, 0 to 1.
    """

    names: tuple[str, str]
    x: np.ndarray
    y: np.ndarray
    coded: np.ndarray
    rest: dict[str, float]
    predicted: dict[str, np.ndarray]
    accepted: dict[str, tuple[float, float]]
    met: dict[str, np.ndarray]
    all_met: np.ndarray
    desirability: np.ndarray


def overlay(joint: JointSet, first: str, second: str, points: int = 101, held=None) -> Overlay:
    """The plane of two factors through the recommended setting, or where the other factors are held.

    Parameters
    ----------
    joint : JointSet
    first, second : str
        Names of two factors.
    points : int
        Along each.
    held : array (n_factors,), optional
        Coded levels of the factors that are held; those of the two are not used.

    Raises
    ------
    InputError
        If the two are not two of the factors.
    """
    names = [factor.name for factor in joint.factors]
    if first not in names or second not in names or first == second:
        raise InputError(f"the plane of {first!r} and {second!r}: expected two of the factors {', '.join(names)}")
    i, j = names.index(first), names.index(second)
    axis = np.linspace(-1, 1, points)
    coded = np.tile(np.asarray(joint.coded if held is None else held, dtype=float), (points, points, 1))
    coded[..., i], coded[..., j] = axis[None, :], axis[:, None]
    flat, shape = coded.reshape(-1, len(names)), (points, points)
    predicted = {response.name: response.predict(flat).reshape(shape) for response, _ in joint.wanted}
    met = {response.name: goal.met(predicted[response.name]) for response, goal in joint.wanted}
    return Overlay(
        names=(first, second),
        x=joint.factors[i].physical(axis),
        y=joint.factors[j].physical(axis),
        coded=coded,
        rest={f.name: float(f.physical(coded[0, 0, k])) for k, f in enumerate(joint.factors) if k not in (i, j)},
        predicted=predicted,
        accepted={response.name: goal.accepted for response, goal in joint.wanted},
        met=met,
        all_met=np.all(list(met.values()), axis=0),
        desirability=overall_desirability(joint.wanted, flat).reshape(shape),
    )
