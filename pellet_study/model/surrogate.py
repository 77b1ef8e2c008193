"""Predictions by YADE at a bearable price: each case of a study gets a response surface, fitted to simulations.

Such a stand-in for a simulator is called its surrogate, or emulator (Sacks, Welch, Mitchell & Wynn 1989,
doi:10.1214/ss/1177012413). All simulations a batch of requests needs go to the dispatcher at once: first the free
parameters spread over their ranges, for all cases of all rigs; then, when effects are asked for, each of them in all cases
it acts in, at some of the same places with some of the same seeds where the rig is `paired`, that is, where the same seed
ends nearly alike. Cases of such a rig have places and seeds of their own, so that the errors of their surfaces are
independent. What is simulated depends on the study's ranges only, not on the readings, and is stored: asked again, nothing
is simulated.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from pellet_study.model.effect_surface import EffectRuns, fitted_effects
from pellet_study.model.engine import Request
from pellet_study.model.means import Mean, Means
from pellet_study.model.response_surface import LogSurface, pooled
from pellet_study.model.sites import BLOCKS, Plan, Point, Site
from pellet_study.model.surfaces import Surfaces, unknown
from pellet_study.model.terms import Link, quadratic_terms
from pellet_study.output.words import number
from pellet_study.study.study import Study

MOST_LOST = 0.5  # share of a case's simulations that may fail
MOST_ALIKE = 0.95  # correlation of two readings that are not the same one
OfEffect = tuple[Site, str]
Answer = list[tuple[np.ndarray, np.ndarray]]


class Surrogate:
    """The engine of the rigs that run on YADE.

    `failed` has the cases most of whose simulations failed, or (case, effect) where those with an effect did, and why:
    predictions are NaN there.

    Parameters
    ----------
    study : whose free parameters and effects span the surfaces
    store : folder of finished simulations
    workers : YADE processes at once; default one a core
    quiet : no progress bar
    """

    step = 1e-5
    levels = 3
    simulates = True

    def __init__(self, study: Study, store: Path, workers: int | None = None, quiet: bool = False):
        self.catalogue, self.plan = study.catalogue, Plan(study)
        self.means, self.surfaces = Means(study, store, workers, quiet), Surfaces(self.plan)
        self.warnings: list[str] = []
        self.failed: dict[Site | OfEffect, str] = {}
        self._ready: set[tuple] = set()
        self._left: dict[Site, np.ndarray] = {}  # of each base surface's points: their mean over the surface's, less 1

    @property
    def simulated(self) -> int:
        """Simulations asked of the dispatcher so far."""
        return self.means.simulated

    def predict(self, requests: Sequence[Request]) -> Answer:
        """Means and the variances of the means, (points, cases) for each request; NaN where the case cannot be simulated."""
        sites = [self.plan.sites(request) for request in requests]
        self._prepare(requests, sites)
        return [self.surfaces.evaluate(request, of) for request, of in zip(requests, sites, strict=True)]

    def directly(self, requests: Sequence[Request]) -> Answer:
        """Means at one point from simulations there, with seeds of their own; variances from the surfaces' scatter.

        A case without a surface has the scatter of those of its rig.
        """
        blocks = [self.plan.check_points(request) for request in requests]
        found = iter(self.means.of([p for of in blocks for of_site in of for p in of_site], needed=False))
        answer = []
        for request, of in zip(requests, blocks, strict=True):
            means = [[next(found).mean for _ in of_site] for of_site in of]
            scatter = np.array(
                [self.surfaces.scatter(site) for site in self.plan.sites(request)]
            )  # predict comes first
            mean = np.array([np.nanmean(block) if np.isfinite(block).any() else np.nan for block in means])[None]
            link = Link.of(request.observable)
            answer.append((mean, scatter * link.slope(link.mu(mean)) ** 2 / BLOCKS))
        return answer

    def spread(self, requests: Sequence[Request]) -> Answer:
        """Relative standard deviations of one simulation at one point from seed to seed, and their degrees of freedom.

        They are those of the simulations of `directly`, (1, cases) for each request; NaN and 0 where one seed makes a mean.
        """
        blocks = [self.plan.check_points(request) for request in requests]
        found = iter(self.means.of([p for of in blocks for of_site in of for p in of_site], needed=False))
        return [_spreads([[next(found) for _ in of_site] for of_site in of]) for of in blocks]

    def alike(self, rig: str, one: str, other: str) -> float:
        """Correlation of two observables of the same simulations about their base surfaces, over all conditions; predict comes first.

        0 in a paired rig, whose observables are simulated with seeds of their own.
        """
        both = []
        for site, left in self._left.items():
            partner = self._left.get(replace(site, observable=other))
            if (site.rig, site.observable) == (rig, one) and partner is not None and not self.plan.paired(site):
                both.append(np.column_stack([left, partner]))
        if not both:
            return 0.0
        left = np.vstack(both)
        a, b = left[np.isfinite(left).all(axis=1)].T
        size = np.sqrt(np.square(a).sum() * np.square(b).sum())
        return float(np.clip(a @ b / size, -MOST_ALIKE, MOST_ALIKE)) if size else 0.0

    def more(self, rig: str) -> None:
        """Take as many points of a rig again from now on as its surfaces had at first; those known are not simulated again."""
        self.plan.blocks[rig] = self.plan.blocks.get(rig, 1) + 1
        self.surfaces.forget(rig)
        self.failed = {key: why for key, why in self.failed.items() if _site_of(key).rig != rig}
        self._ready.clear()

    def cost_of_more(self, rig: str) -> tuple[int, float]:
        """How many simulations one more block of a rig takes, and how many seconds of a processor."""
        blocks = self.plan.blocks.get(rig, 1)
        bases = [site for site in self.surfaces.base if site.rig == rig]
        effects = [key for key in self.surfaces.effects if key[0].rig == rig]
        points = sum(p.seeds for site in bases for p in self.plan.base_points(site)) + sum(
            p.seeds for key in effects for p in self.plan.effect_points(*key)
        )
        number = round(points / blocks)
        return number, number * self.means.seconds_each(rig)

    def _prepare(self, requests: Sequence[Request], sites: Sequence[list[Site]]) -> None:
        """Make the surfaces that are missing, all their simulations in one batch."""
        asked = {
            (id(of), name) for request, of in zip(requests, sites, strict=True) for name in (None, *request.effects)
        }
        if asked <= self._ready:
            return
        bases = list(dict.fromkeys(s for of in sites for s in of if s not in self.surfaces.base))
        wanted = list(dict.fromkeys(self._missing_effects(requests, sites)))
        of_base = {site: self.plan.base_points(site) for site in bases}
        of_effect = {key: self.plan.effect_points(*key) for key in wanted}
        points = [p for plan in (*of_base.values(), *of_effect.values()) for p in plan]
        points += [p.without() for site, name in wanted if self.plan.paired(site) for p in of_effect[site, name]]
        points = list(dict.fromkeys(points))
        results = dict(zip(points, self.means.of(points), strict=True))
        self._fit_bases(of_base, results)
        self._fit_effects(of_effect, results)
        self._ready |= asked

    def _missing_effects(self, requests: Sequence[Request], sites: Sequence[list[Site]]) -> Iterable[OfEffect]:
        """Effects asked for at sites where they have no surface; an effect on nothing but the reading needs none."""
        for request, of in zip(requests, sites, strict=True):
            for name in request.effects:
                if self.catalogue.effects[name].reading is None:
                    yield from ((s, name) for s in of if (s, name) not in self.surfaces.effects)

    def _fit_bases(self, plans: Mapping[Site, Sequence[Point]], results: Mapping[Point, Mean]) -> None:
        """Base surfaces; those of a rig share their scatter."""
        base = self.surfaces.base
        together: dict[tuple[str, str], list[Site]] = {}
        for site, plan in plans.items():
            base[site] = self._fit_base(site, plan, results)
            if site not in self.failed:
                together.setdefault((site.rig, site.observable), []).append(site)
        for (rig, _), sites in together.items():
            base |= dict(zip(sites, pooled([base[site] for site in sites]), strict=True))
            if not any(base[site].free for site in sites):
                self.warnings.append(
                    f"{rig}: so many simulations failed that the surfaces go through the others: how far off they "
                    "are is not known; raise effort in study.toml"
                )

    def _fit_base(self, site: Site, plan: Sequence[Point], results: Mapping[Point, Mean]) -> LogSurface:
        found, lost = self._means_of(site, plan, results)
        means = Link.of(site.observable).mu(found)
        kept = np.isfinite(means)
        terms = quadratic_terms(self.plan.scaled(site, plan))[kept]
        if lost:
            self.failed[site] = f"{lost}; change the ranges in study.toml, or leave this row out"
            return unknown(terms.shape[1])
        surface = LogSurface.fitted(terms, means[kept])
        self._left[site] = np.full(len(means), np.nan)
        self._left[site][kept] = means[kept] * np.exp(-terms @ surface.coefficients) - 1
        return surface

    def _fit_effects(self, plans: Mapping[OfEffect, Sequence[Point]], results: Mapping[Point, Mean]) -> None:
        """Surfaces of effects, of one effect together at all sites of a rig that have the same factors.

        A parameter that is free is none at the sites where it is known: their surfaces have fewer terms.
        """
        groups: dict[tuple, list[Site]] = {}
        for site, name in plans:
            factors = tuple(self.plan.factors(site))
            groups.setdefault((site.rig, site.observable, name, factors), []).append(site)
        for (_, _, name, _), sites in groups.items():
            runs = {site: self._effect_runs(site, name, plans[site, name], results) for site in sites}
            alive = [site for site in sites if site not in self.failed and np.isfinite(runs[site].with_it).any()]
            surfaces = fitted_effects([runs[site] for site in alive]) if alive else []
            self.surfaces.effects |= {(site, name): surface for site, surface in zip(alive, surfaces, strict=True)}
            nothing = unknown(3 + runs[sites[0]].shapes.shape[1] + runs[sites[0]].x.shape[1])
            self.surfaces.effects |= {(site, name): nothing for site in sites if site not in alive}

    def _effect_runs(self, site: Site, name: str, plan: Sequence[Point], results: Mapping[Point, Mean]) -> EffectRuns:
        with_it, lost = self._means_of(site, plan, results)
        if lost:
            self.failed[site, name] = f"{lost}: what {name} would do there is not known"
            self.warnings.append(self.failed[site, name])
        without = None
        if self.plan.paired(site):
            without, _ = self._means_of(site, [p.without() for p in plan], results)
        x = self.plan.scaled(site, plan)
        given = [dict(p.effects[0][1]) for p in plan]
        u, shapes = self.plan.shares(name, {k: np.array([values[k] for values in given]) for k in given[0]})
        base, there, link = self.surfaces.base[site], quadratic_terms(x), Link.of(site.observable)
        mu = np.exp(there @ base.coefficients)
        rate = link.slope(mu) / link.observable(mu)
        return EffectRuns(
            u,
            shapes,
            x,
            with_it,
            without,
            np.log(link.observable(mu)),
            rate[:, None] * (there @ base.covariance @ there.T) * rate,
            base.scatter * self.plan.seeds(site) / plan[0].seeds * rate**2,
        )

    def _means_of(self, site: Site, plan: Sequence[Point], results: Mapping[Point, Mean]) -> tuple[np.ndarray, str]:
        """Means of some points, NaN where all simulations of one failed; where most of all failed, no mean, and why."""
        lost = sum(results[p].lost for p in plan)
        total = sum(p.seeds for p in plan)
        if lost:
            reason = next(results[p].reason for p in plan if results[p].reason)
            what = ", ".join(f"{k} = {number(v, 6)}" for k, v in site.conditions)
            text = f"{lost} of {total} simulations of {site.rig} ({what}) failed, the first with: {reason}"
            if lost > MOST_LOST * total:
                return np.full(len(plan), np.nan), text
            self.warnings.append(f"{text}; the answer rests on the others")
        return np.array([results[p].mean for p in plan]), ""


def _site_of(key: Site | OfEffect) -> Site:
    """The site of what could not be simulated."""
    return key if isinstance(key, Site) else key[0]


def _spreads(blocks: Sequence[Sequence[Mean]]) -> tuple[np.ndarray, np.ndarray]:
    """(1, k) relative standard deviations of one simulation, and their degrees of freedom, from blocks of seeds of k sites."""
    spread, dof = np.full((1, len(blocks)), np.nan), np.zeros((1, len(blocks)))
    for k, of_site in enumerate(blocks):
        known = [mean for mean in of_site if mean.n > 1 and np.isfinite(mean.sd) and mean.mean]
        dof[0, k] = sum(mean.n - 1 for mean in known)
        if known:
            squares = sum((mean.n - 1) * (mean.sd / mean.mean) ** 2 for mean in known)
            spread[0, k] = np.sqrt(squares / dof[0, k])
    return spread, dof
