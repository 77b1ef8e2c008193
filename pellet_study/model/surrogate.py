"""Predictions by YADE at a bearable price: each case of a study gets a response surface, fitted to simulations.

All simulations a batch of requests needs go to the dispatcher at once: first the free parameters spread over their
ranges, for all cases of all rigs; then, when effects are asked for, each of them in all cases it acts in, at some of the
same places with some of the same seeds where the rig is `paired`, that is, where the same seed ends nearly alike. Cases
of such a rig have places and seeds of their own, so that the errors of their surfaces are independent. What is simulated
depends on the study's ranges only, not on the readings, and is stored: asked again, nothing is simulated.
"""

import csv
import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from pellet_study.errors import SimulationError
from pellet_study.model.engine import Request
from pellet_study.model.means import COLUMNS
from pellet_study.model.response_surface import (
    FLOOR,
    EffectRuns,
    Factor,
    Link,
    Surface,
    amounts,
    effect_terms,
    fitted_effects,
    pooled,
    quadratic,
    spread,
)
from pellet_study.model.sites import (
    BASE,
    CHECK,
    EFFECT,
    EFFECT_SEEDS,
    PAIRED_EFFECT,
    SPARE,
    Point,
    Site,
    _stream,
    _stream_of,
)
from pellet_study.rigs import on_yade
from pellet_study.simulate import dispatch, yade
from pellet_study.simulate.local import TOOK_LONGER
from pellet_study.study.study import SCALINGS, Study

BLOCKS = 2  # of seeds, of a direct simulation
MOST_LOST = 0.5  # share of a case's simulations that may fail


class Simulated:
    """The engine of the rigs that run on YADE.

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
        self.catalogue, self.law, self.effort = study.catalogue, study.contact_law, study.effort
        self.store, self.workers, self.quiet = Path(store), workers, quiet
        own = [effect for effect in study.catalogue.effects.values() if effect.own]
        self._files = {
            name: (rig.file, [effect.own for effect in own if name in effect.rigs])
            for name, rig in study.catalogue.rigs.items()
            if rig.predict is None
        }
        self.numerics = {"surface_energy_exponent": SCALINGS[study.surface_energy_scaling]}
        self.ranges = {name: Factor(s.low, s.high) for name, s in study.parameters.items() if s.free}
        self.warnings: list[str] = []
        # cases most of whose simulations failed, or (case, effect) where those with an effect did, and why; NaN there
        self.failed: dict[Site | tuple[Site, str], str] = {}
        self.simulated = 0
        self._means: dict[tuple[str, str], tuple] | None = None
        self._base: dict[Site, Surface] = {}
        self._effects: dict[tuple[Site, str], Surface] = {}
        self._known: dict[tuple, list[Site]] = {}
        self._stacks: dict[tuple, tuple] = {}
        self._ready: set[tuple] = set()

    def predict(self, requests: Sequence[Request]) -> list[tuple[np.ndarray, np.ndarray]]:
        """Means and the variances of the means, (points, cases) for each request; NaN where the case cannot be simulated."""
        self._use_files()
        sites = [self._sites(request) for request in requests]
        self._prepare(requests, sites)
        return [self._evaluate(request, mine) for request, mine in zip(requests, sites, strict=True)]

    def directly(self, requests: Sequence[Request]) -> list[tuple[np.ndarray, np.ndarray]]:
        """Means at one point from simulations there, with seeds of their own; variances from the surfaces' scatter.

        A case without a surface has the scatter of those of its rig.
        """
        self._use_files()
        plans, readings = [], []
        for request in requests:
            effects = {e: {p: float(v[0, 0]) for p, v in values.items()} for e, values in request.effects.items()}
            for site in self._sites(request):
                values = {k: float(request.parameters[k][0, 0]) for k in self._factors(site)}
                seeds = self._seeds(site.rig)
                first = 1000 * _stream(site, CHECK) * seeds
                plans += [(site, values, effects, first + b * seeds, seeds) for b in range(BLOCKS)]
        found = iter(self._run(plans, needed=False))
        for request in requests:
            means = [[next(found)[0] for _ in range(BLOCKS)] for _ in self._sites(request)]
            scatter = np.array([self._scatter(site) for site in self._sites(request)])  # predict comes first
            mean = np.array([np.nanmean(block) if np.isfinite(block).any() else np.nan for block in means])[None]
            link = Link.of(request.observable)
            readings.append((mean, scatter * link.slope(link.mu(mean)) ** 2 / BLOCKS))
        return readings

    def _scatter(self, site: Site) -> float:
        """Relative variance of a mean of a case, from its surface or those of its rig."""
        mine = self._base.get(site)
        if mine is not None:
            return mine.scatter
        alike = [b.scatter for s, b in self._base.items() if (s.rig, s.observable) == (site.rig, site.observable)]
        return float(np.nanmedian(alike))

    def _use_files(self) -> None:
        """The study's own rigs and effects, until another study's engine asks for its own."""
        for name, (file, effects) in self._files.items():
            on_yade.use(name, file, effects)

    # sites and their designs

    def _seeds(self, rig: str) -> int:
        return on_yade.rig(rig).seeds

    def _sites(self, request: Request) -> list[Site]:
        """The cases of a request, known and fixed parameters with their values."""
        fixed_values = {n: v[0, 0] for n, v in request.parameters.items() if np.ndim(v) == 2 and n not in self.ranges}
        arrays = [*request.conditions.values(), *(v for v in request.parameters.values() if np.ndim(v) == 1)]
        key = (request.rig, request.observable, *fixed_values.items(), *(np.asarray(a).tobytes() for a in arrays))
        if key in self._known:
            return self._known[key]
        count = len(next(iter(request.conditions.values())))
        conditions = on_yade.rig(request.rig).conditions
        found = []
        for k in range(count):
            fixed = {}
            for name, values in request.parameters.items():
                values = np.asarray(values)
                if values.ndim == 1:
                    fixed[name] = float(values[k])
                elif name not in self.ranges:
                    fixed[name] = float(values[0, 0])
            given = {c: float(v[k]) for c, v in request.conditions.items() if c in conditions}
            found.append(Site(request.rig, request.observable, tuple(given.items()), tuple(fixed.items())))
        self._known[key] = found
        return found

    def _factors(self, site: Site) -> dict[str, Factor]:
        fixed = dict(site.fixed)
        return {n: f for n, f in self.ranges.items() if n in on_yade.rig(site.rig).parameters and n not in fixed}

    def _base_points(self, site: Site) -> list[Point]:
        factors = self._factors(site)
        p = len(factors)
        least = PAIRED_EFFECT * self.effort if on_yade.rig(site.rig).paired else 4
        terms = (p + 1) * (p + 2) // 2
        count = int(np.ceil(max(least, terms + SPARE, BASE * terms * self.effort)))
        stream, seeds = _stream(site), self._seeds(site.rig)
        return [
            Point(site, self._values(factors, x), None, (1000 * stream + k) * seeds, seeds)
            for k, x in enumerate(spread(count, p, seed=1 + stream))
        ]

    def _effect_points(self, site: Site, name: str) -> list[Point]:
        """Points with an effect: in a paired rig some of the base surface's, one after the other; else others."""
        effect, factors = self.catalogue.effects[name], self._factors(site)
        shapes = list(effect.parameters)[1:]
        paired, stream = on_yade.rig(site.rig).paired, _stream_of(site, name)
        seeds = max(1, round(EFFECT_SEEDS * self._seeds(site.rig)))
        count = int(np.ceil((PAIRED_EFFECT if paired else EFFECT[effect.sides]) * self.effort))
        u = amounts(count, effect.sides)
        places = spread(count, len(factors) + len(shapes), seed=1 + stream)
        if paired:
            u = np.random.default_rng(stream).permutation(u)
            base = self._base_points(site)
            there = [base[(stream + k) % len(base)] for k in range(count)]
        else:
            x = places[:, : len(factors)]
            there = [
                Point(site, self._values(factors, x[k]), None, (1000 * stream + k) * seeds, seeds) for k in range(count)
            ]
        absent, reach = self._reach(name)
        found = []
        for point, amount, place in zip(there, u, places[:, len(factors) :], strict=True):
            values = {effect.amount: absent + reach * amount}
            for shape, s in zip(shapes, place, strict=True):
                values[shape] = float(self._shape(name, shape).value(s))
            found.append(replace(point, effect=(name, tuple(values.items())), seeds=seeds))
        return found

    @staticmethod
    def _values(factors: Mapping[str, Factor], x: np.ndarray) -> tuple[tuple[str, float], ...]:
        return tuple((name, float(factor.value(s))) for (name, factor), s in zip(factors.items(), x, strict=True))

    def _reach(self, name: str) -> tuple[float, float]:
        """An effect's amount when absent, and how far it is from there to the physical limit."""
        effect = self.catalogue.effects[name]
        quantity = effect.parameters[effect.amount]
        low, high = quantity.get("physical", (quantity["min"], quantity["max"]))
        absent = quantity["absent"]
        return absent, max(high - absent, absent - low) if effect.sides == 2 else high - absent

    def _shape(self, name: str, shape: str) -> Factor:
        quantity = self.catalogue.effects[name].parameters[shape]
        return Factor(*quantity.get("physical", (quantity["min"], quantity["max"])))

    # simulations

    def _prepare(self, requests: Sequence[Request], sites: Sequence[Sequence[Site]]) -> None:
        """Make the surfaces that are missing, all their simulations in one batch."""
        asked = {
            (id(mine), name) for request, mine in zip(requests, sites, strict=True) for name in (None, *request.effects)
        }
        if asked <= self._ready:
            return
        bases = list(dict.fromkeys(s for mine in sites for s in mine if s not in self._base))
        wanted = []
        for request, mine in zip(requests, sites, strict=True):
            for name in request.effects:
                if self.catalogue.effects[name].reading is None:
                    wanted += [(s, name) for s in mine if (s, name) not in self._effects]
        wanted = list(dict.fromkeys(wanted))
        plans = {s: self._base_points(s) for s in bases}
        plans |= {key: self._effect_points(*key) for key in wanted}
        points = [p for plan in plans.values() for p in plan]
        pairs = [key for key in wanted if on_yade.rig(key[0].rig).paired]
        points += [replace(p, effect=None) for key in pairs for p in plans[key]]  # the same without the effect
        points = list(dict.fromkeys(points))
        found = self._run(
            [
                (p.site, dict(p.factors), {} if p.effect is None else {p.effect[0]: dict(p.effect[1])}, p.first_seed,
                 p.seeds)
                for p in points
            ]
        )  # fmt: skip
        results = dict(zip(points, found, strict=True))
        together: dict[tuple[str, str], list[Site]] = {}
        for site in bases:
            self._base[site] = self._fit_base(site, plans[site], results)
            if site not in self.failed:
                together.setdefault((site.rig, site.observable), []).append(site)
        for mine in together.values():
            self._base |= dict(zip(mine, pooled([self._base[site] for site in mine]), strict=True))
            if not any(self._base[site].free for site in mine):
                self.warnings.append(
                    f"{mine[0].rig}: so many simulations failed that the surfaces go through the others: how far off they "
                    "are is not known; raise effort in study.toml"
                )
        groups: dict[tuple[str, str, str], list[Site]] = {}
        for site, name in wanted:
            groups.setdefault((site.rig, site.observable, name), []).append(site)
        for (_, _, name), mine in groups.items():
            runs = {site: self._effect_runs(site, name, plans[site, name], results) for site in mine}
            alive = [site for site in mine if site not in self.failed and np.isfinite(runs[site].with_it).any()]
            shapes = len(self.catalogue.effects[name].parameters) - 1
            surfaces = fitted_effects([runs[site] for site in alive]) if alive else []
            self._effects |= {(site, name): surface for site, surface in zip(alive, surfaces, strict=True)}
            unknown = np.full(3 + shapes + len(self._factors(mine[0])), np.nan)
            self._effects |= {
                (site, name): Surface(unknown, np.diag(unknown), np.nan) for site in mine if site not in alive
            }
        self._ready |= asked

    def _fit_base(self, site: Site, plan: Sequence[Point], results: Mapping) -> Surface:
        found, lost = self._means_of(site, plan, results)
        means = Link.of(site.observable).mu(found)
        kept = np.isfinite(means)
        terms = quadratic(self._scaled(site, [p.factors for p in plan]))[kept]
        if lost:
            self.failed[site] = f"{lost}; change the ranges in study.toml, or leave this row out"
            unknown = np.full(terms.shape[1], np.nan)
            return Surface(unknown, np.diag(unknown), np.nan)
        return Surface.fitted(terms, means[kept])

    def _effect_runs(self, site: Site, name: str, plan: Sequence[Point], results: Mapping) -> EffectRuns:
        with_it, lost = self._means_of(site, plan, results)
        if lost:
            self.failed[site, name] = f"{lost}: what {name} would do there is not known"
            self.warnings.append(self.failed[site, name])
        without = None
        if on_yade.rig(site.rig).paired:
            without, _ = self._means_of(site, [replace(p, effect=None) for p in plan], results)
        x = self._scaled(site, [p.factors for p in plan])
        given = [dict(p.effect[1]) for p in plan]
        u, shapes = self._amounts(name, {k: np.array([values[k] for values in given]) for k in given[0]})
        base, there, link = self._base[site], quadratic(x), Link.of(site.observable)
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
            base.scatter * self._seeds(site.rig) / plan[0].seeds * rate**2,
        )

    def _means_of(self, site: Site, plan: Sequence[Point], results: Mapping) -> tuple[np.ndarray, str]:
        """Means of some points, NaN where all simulations of one failed; where most of all failed, no mean, and why."""
        lost = sum(results[p][1] for p in plan)
        total = sum(p.seeds for p in plan)
        if lost:
            reason = next(results[p][2] for p in plan if results[p][2])
            what = ", ".join(f"{k} = {v:g}" for k, v in site.conditions)
            text = f"{lost} of {total} simulations of {site.rig} ({what}) failed, the first with: {reason}"
            if lost > MOST_LOST * total:
                return np.full(len(plan), np.nan), text
            self.warnings.append(f"{text}; the answer rests on the others")
        return np.array([results[p][0] for p in plan]), ""

    def _run(self, plans: Sequence[tuple], needed: bool = True) -> list[tuple[float, int, str]]:
        """Mean, number of failed seeds and first reason of each (site, factors, effects, first seed, seeds).

        An observable that does not apply under some conditions is NaN there, or refused where it is `needed`.
        """
        memory = self._memory()
        keys, cases = [], []
        for site, factors, effects, first, seeds in plans:
            case = on_yade.case(
                site.rig,
                contact_law=self.law if self.law in on_yade.rig(site.rig).contact_laws else None,
                seed=first,
                parameters={**dict(site.fixed), **factors},
                conditions=dict(site.conditions),
                effects=effects,
                numerics={k: v for k, v in self.numerics.items() if k in on_yade.rig(site.rig).numerics},
            )
            text = json.dumps([case, seeds, on_yade.rig(site.rig).fingerprint, yade.version()], sort_keys=True)
            key = (hashlib.sha256(text.encode()).hexdigest()[:20], site.observable)
            keys.append(key)
            if key not in memory:
                cases.append((key, [{**case, "seed": first + k} for k in range(seeds)]))
        fresh = dict(cases)
        if fresh:
            flat = [case for group in fresh.values() for case in group]
            self.simulated += len(flat)
            table = dispatch.run(flat, self.store, workers=self.workers, quiet=self.quiet)
            place = 0
            for key, group in fresh.items():
                rows = table.iloc[place : place + len(group)]
                place += len(group)
                fine = rows["status"] == "ok"
                values = rows[key[1]].to_numpy(float)[fine.to_numpy()]
                if needed and fine.any() and not np.isfinite(values).all():
                    raise SimulationError(f"{group[0]['rig']} gives no {key[1]} under these conditions")
                reason = "" if fine.all() else str(rows["status"][~fine].iloc[0])
                mean = float(values.mean()) if len(values) else np.nan
                sd = float(values.std(ddof=1)) if len(values) > 1 else np.nan
                memory[key] = (mean, sd, len(values), int((~fine).sum()), reason)
            self._remember([key for key in fresh if TOOK_LONGER not in memory[key][4]])
        return [(memory[key][0], memory[key][3], memory[key][4]) for key in keys]

    def _memory(self) -> dict:
        """Means known from the store, by key and observable."""
        if self._means is None:
            self._means = {}
            file = self.store / "means.csv"
            if file.exists():
                with open(file, newline="", encoding="utf-8", errors="replace") as stream:
                    for row in csv.reader(stream):
                        try:
                            key, observable, mean, sd, n, lost, reason = row
                            self._means[key, observable] = (float(mean), float(sd), int(n), int(lost), reason)
                        except ValueError:  # the header, or a torn line: simulated again from stored cases
                            continue
        return self._means

    def _remember(self, keys) -> None:
        file = self.store / "means.csv"
        new = not file.exists()
        with open(file, "a", newline="", encoding="utf-8") as stream:
            writer = csv.writer(stream)
            if new:
                writer.writerow(COLUMNS)
            writer.writerows([*key, *self._means[key]] for key in keys)

    # evaluation

    def _scaled(self, site: Site, factors: Sequence[tuple]) -> np.ndarray:
        mine = self._factors(site)
        return np.array([[f.scaled(dict(values)[n]) for n, f in mine.items()] for values in factors]).reshape(
            len(factors), len(mine)
        )

    def _amounts(self, name: str, values: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Amount as a share of its physical limit, and scaled shape parameters, of (m,) values."""
        absent, reach = self._reach(name)
        amount, *shapes = self.catalogue.effects[name].parameters
        scaled = [self._shape(name, s).scaled(values[s]) for s in shapes]
        u = (values[amount] - absent) / reach
        return u, np.array(scaled).reshape(len(shapes), len(u)).T

    def _stacked(self, sites: Sequence[Site], effect: str | None, terms: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(m, T) terms to (m, k) parts of ln mu and their variances, by the surfaces of k sites."""
        key = (tuple(map(id, sites)), effect)
        if key not in self._stacks:
            surfaces = [self._base[s] if effect is None else self._effects[s, effect] for s in sites]
            both = np.stack([s.coefficients for s in surfaces], axis=1), np.stack([s.covariance for s in surfaces])
            self._stacks[key] = sites, *both
        _, coefficients, covariance = self._stacks[key]
        return terms @ coefficients, ((terms @ covariance) * terms).sum(axis=2).T

    def _evaluate(self, request: Request, sites: Sequence[Site]) -> tuple[np.ndarray, np.ndarray]:
        factors = self._factors(sites[0])
        columns = [factor.scaled(request.parameters[name][:, 0]) for name, factor in factors.items()]
        given = [*request.parameters.values(), *(v for values in request.effects.values() for v in values.values())]
        m = max([len(v) for v in given if np.ndim(v) == 2], default=1)
        x = np.stack([np.broadcast_to(c, (m,)) for c in columns], axis=1) if columns else np.empty((m, 0))
        terms = quadratic(x)
        log_mean, relative = self._stacked(sites, None, terms)
        link, mu = Link.of(request.observable), np.exp(np.clip(log_mean, -50, 50))
        mean = link.observable(mu)
        relative = relative * (link.slope(mu) / mean) ** 2
        readings = []
        for name, values in request.effects.items():
            values = {k: np.broadcast_to(np.asarray(v)[:, 0], (m,)) for k, v in values.items()}
            reading = self.catalogue.effects[name].reading
            if reading is not None:
                readings.append((reading, {k: v[:, None] for k, v in values.items()}))
                continue
            here = np.flatnonzero(self._amounts(name, values)[0])  # a candidate is absent in most points
            if len(here):
                own = {k: v[here] for k, v in values.items()}
                bend = max(self._effects[site, name].bend for site in sites)  # of a rig's sites, one
                shift, more = self._stacked(sites, name, effect_terms(*self._amounts(name, own), x[here], bend))
                ratio = np.array([self._effects[site, name].of_ratio for site in sites])
                growth = np.where(ratio, np.maximum(1 + shift, FLOOR), np.exp(np.clip(shift, -50, 50)))
                mean[here] *= growth
                relative[here] += np.where(ratio, more / growth**2, more)
        variance = relative * mean**2
        for reading, values in readings:
            mean = reading(mean, values)
        return mean, variance
