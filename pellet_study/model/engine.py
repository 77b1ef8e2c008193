"""What a model asks of whatever predicts: requests, and the engine that answers them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np


@dataclass(frozen=True)
class Request:
    """Cases of one rig and observable, at many points.

    Parameters
    ----------
    rig, observable : names
    conditions : {name: (k,) array}, of words where the condition is one
    parameters : {name: (m, 1) or (m, k) array}
    effects : {effect: {parameter: (m, 1) array}}, only those that are there at some point
    """

    rig: str
    observable: str
    conditions: Mapping[str, np.ndarray]
    parameters: Mapping[str, np.ndarray]
    effects: Mapping[str, Mapping[str, np.ndarray]]


class Engine(Protocol):
    """What answers requests: a closed form, or simulations.

    `step` is the finite-difference step it can resolve, as a share of a parameter's range; `levels` the number of
    values of a condition at which it can bear to be asked what the next measurement would show. `predict` gets all
    requests of a batch together and returns for each the means and the variances of these means, (m, k) arrays;
    `directly` does so for one point without interpolating between simulations; `spread` tells how far one simulation there
    scatters in relation to the mean, and with how many degrees of freedom that is known; `alike` the correlation of two
    observables of one simulation from seed to seed, 0 where nothing tells it.
    `simulates` says that its answers come from simulations, whose means scatter; `failed` is what could not be simulated,
    a case or (case, effect), and why; `warnings` is what its user must know.
    """

    @property
    def step(self) -> float: ...

    @property
    def levels(self) -> int: ...

    @property
    def simulates(self) -> bool: ...

    @property
    def failed(self) -> Mapping[Any, str]: ...

    @property
    def warnings(self) -> Sequence[str]: ...

    def predict(self, requests: Sequence[Request]) -> list[tuple[np.ndarray, np.ndarray]]: ...

    def directly(self, requests: Sequence[Request]) -> list[tuple[np.ndarray, np.ndarray]]: ...

    def spread(self, requests: Sequence[Request]) -> list[tuple[np.ndarray, np.ndarray]]: ...

    def alike(self, rig: str, one: str, other: str) -> float: ...
