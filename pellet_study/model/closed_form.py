"""The engine of the rigs that are formulas."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pellet_study.model.engine import Request
from pellet_study.rigs.catalogue import Catalogue
from pellet_study.rigs.declared import Acting


@dataclass(frozen=True)
class ClosedForm:
    """Rigs that are formulas."""

    catalogue: Catalogue
    step: float = 1e-5
    levels: int = 9
    simulates: bool = False
    failed: Mapping[Any, str] = field(default_factory=dict)
    warnings: Sequence[str] = ()

    def predict(self, requests: Sequence[Request]) -> list[tuple[np.ndarray, np.ndarray]]:
        """Means, and variances of zero."""
        return [(self._means(request), np.zeros(1)) for request in requests]

    directly = predict

    def spread(self, requests: Sequence[Request]) -> list[tuple[np.ndarray, np.ndarray]]:
        """No scatter, known with no degrees of freedom."""
        return [(np.zeros(1), np.zeros(1)) for _ in requests]

    def alike(self, rig: str, one: str, other: str) -> float:
        """A formula does not scatter."""
        return 0.0

    def _means(self, request: Request) -> np.ndarray:
        """Means of a request; points with the same effects present are answered together, without the others."""
        predict, effects = (
            self.catalogue.rigs[request.rig].predict,
            {e: self.catalogue.effects[e] for e in request.effects},
        )
        assert predict is not None  # of a rig that is a formula
        if not effects:
            return predict(request.parameters, request.conditions, {})[request.observable]
        amounts = [
            (request.effects[e][effect.amount], effect.neutral()[effect.amount]) for e, effect in effects.items()
        ]
        present = np.column_stack([(amount != absent)[:, 0] for amount, absent in amounts])
        mean = np.empty((len(present), max(np.size(values) for values in request.conditions.values())))
        for pattern in np.unique(present, axis=0):
            mine = (present == pattern).all(axis=1)
            acting = {
                e: Acting(effect.closed_form[request.rig], {n: v[mine] for n, v in request.effects[e].items()})
                for (e, effect), there in zip(effects.items(), pattern, strict=True)
                if there
            }
            own = {n: v[mine] if np.ndim(v) == 2 else v for n, v in request.parameters.items()}
            mean[mine] = predict(own, request.conditions, acting)[request.observable]
        return mean
