"""The surfaces of a surrogate, of the base and of effects at each site, and what they predict."""

from collections.abc import Mapping, Sequence

import numpy as np

from pellet_study.model.engine import Request
from pellet_study.model.response_surface import FLOOR, LogSurface
from pellet_study.model.sites import Plan, Site
from pellet_study.model.terms import Link, effect_terms, quadratic_terms

LARGEST = 50  # logarithm beyond which a surface is not followed


class Surfaces:
    """Fitted surfaces by site, and by (site, effect)."""

    def __init__(self, plan: Plan):
        self.plan = plan
        self.base: dict[Site, LogSurface] = {}
        self.effects: dict[tuple[Site, str], LogSurface] = {}
        self._stacks: dict[tuple, tuple] = {}

    def forget(self, rig: str) -> None:
        """Drop the surfaces of a rig."""
        self.base = {site: surface for site, surface in self.base.items() if site.rig != rig}
        self.effects = {key: surface for key, surface in self.effects.items() if key[0].rig != rig}
        self._stacks.clear()

    def scatter(self, site: Site) -> float:
        """Relative variance of a mean of a case, from its surface or those of its rig."""
        if site in self.base:
            return self.base[site].scatter
        alike = [b.scatter for s, b in self.base.items() if (s.rig, s.observable) == (site.rig, site.observable)]
        return float(np.nanmedian(alike))

    def evaluate(self, request: Request, sites: Sequence[Site]) -> tuple[np.ndarray, np.ndarray]:
        """(m, k) means of a request and their variances, by the surfaces of its k sites."""
        factors = self.plan.factors(sites[0])
        columns = [factor.scaled(request.parameters[name][:, 0]) for name, factor in factors.items()]
        given = [*request.parameters.values(), *(v for values in request.effects.values() for v in values.values())]
        m = max([len(v) for v in given if np.ndim(v) == 2], default=1)
        x = np.stack([np.broadcast_to(c, (m,)) for c in columns], axis=1) if columns else np.empty((m, 0))
        log_mean, relative = self._stacked(sites, None, quadratic_terms(x))
        link, mu = Link.of(request.observable), np.exp(np.clip(log_mean, -LARGEST, LARGEST))
        mean = link.observable(mu)
        relative = relative * (link.slope(mu) / mean) ** 2
        readings = []
        for name, of_effect in request.effects.items():
            values = {k: np.broadcast_to(np.asarray(v)[:, 0], (m,)) for k, v in of_effect.items()}
            effect, observables = self.plan.catalogue.effects[name], self.plan.rigs[request.rig].observables
            if effect.reading is not None:  # it acts on what is read, after all others
                if effect.reads_it(request.observable, observables):
                    readings.append((effect.reading, {k: v[:, None] for k, v in values.items()}))
            else:
                self._apply(name, values, sites, x, mean, relative)
        variance = relative * mean**2
        for reading, values in readings:
            mean = reading(mean, values)
        return mean, variance

    def _apply(
        self,
        name: str,
        values: Mapping[str, np.ndarray],
        sites: Sequence[Site],
        x: np.ndarray,
        mean: np.ndarray,
        relative: np.ndarray,
    ) -> None:
        """Let an effect act on (m, k) means and their relative variances, in place."""
        present = np.flatnonzero(self.plan.shares(name, values)[0])  # a candidate is absent in most points
        if not len(present):
            return
        of_present = {k: v[present] for k, v in values.items()}
        bend = max(self.effects[site, name].bend for site in sites)  # of a rig's sites, one
        terms = effect_terms(*self.plan.shares(name, of_present), x[present], bend)
        shift, more = self._stacked(sites, name, terms)
        ratio = np.array([self.effects[site, name].of_ratio for site in sites])
        growth = np.where(ratio, np.maximum(1 + shift, FLOOR), np.exp(np.clip(shift, -LARGEST, LARGEST)))
        mean[present] *= growth
        relative[present] += np.where(ratio, more / growth**2, more)

    def _stacked(self, sites: Sequence[Site], effect: str | None, terms: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(m, T) terms to (m, k) parts of ln mu and their variances, by the surfaces of k sites."""
        key = (tuple(map(id, sites)), effect)
        if key not in self._stacks:
            surfaces = [self.base[s] if effect is None else self.effects[s, effect] for s in sites]
            both = np.stack([s.coefficients for s in surfaces], axis=1), np.stack([s.covariance for s in surfaces])
            self._stacks[key] = sites, *both  # the sites are kept, so that no other has their id
        _, coefficients, covariance = self._stacks[key]
        return terms @ coefficients, ((terms @ covariance) * terms).sum(axis=2).T


def unknown(terms: int) -> LogSurface:
    """The surface of what cannot be simulated: nothing is known of it."""
    nothing = np.full(terms, np.nan)
    return LogSurface(nothing, np.diag(nothing), np.nan)
