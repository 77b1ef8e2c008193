"""Where a surrogate simulates: cases with everything fixed that is not a factor, and points spread over the factors."""

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import qmc

from pellet_study.model.engine import Request
from pellet_study.model.terms import Range
from pellet_study.rigs.declared import Condition
from pellet_study.study.study import Study

BASE = 2.4  # points a term of the base surface
SPARE = 2  # points beyond its terms, at least: they tell the scatter
UNPAIRED = 4  # points of a base surface, at least, in a rig that is not paired
EFFECT = {1: 5, 2: 8}  # points of an effect's surface, by the sides it may take
PAIRED_EFFECT = 8  # in a paired rig
EFFECT_SEEDS = 0.5  # share of a mean's seeds that they take
STREAMS, CHECK = 400, 500  # numbers of the streams of seeds and places: of effects by their names; of checks
BLOCKS = 2  # of seeds, of a direct simulation
# Points of a stream whose seeds stand in its own thousand: an effect takes at least 2/5 of a mean's seeds (2 of 5), so its
# thousand may begin after 400 points of the base surface. The rest stand beyond the thousands of all streams.
IN_ITS_THOUSAND, BEYOND = 400, 1000 * 1000 * 2**20
Values = tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class Site:
    """A case of a rig with everything that is not a factor fixed; its text tells the seeds, so no field may be renamed.

    Each word that a condition may be makes another site, with a surface of its own.
    """

    rig: str
    observable: str
    conditions: tuple[tuple[str, Condition], ...]
    fixed: Values


@dataclass(frozen=True)
class Point:
    """Simulations of a site at one place: values of the factors and of effects, and their seeds."""

    site: Site
    factors: Values
    effects: tuple[tuple[str, Values], ...]
    first_seed: int
    seeds: int

    def without(self) -> "Point":
        """The same without effects."""
        return replace(self, effects=())


class Plan:
    """The sites of a study and the points of their surfaces; they depend on its ranges only, not on its readings."""

    def __init__(self, study: Study):
        self.catalogue, self.effort, self.rigs = study.catalogue, study.effort, study.catalogue.rigs
        self.ranges = {
            name: Range(s.low, s.high)
            for name, s in study.parameters.items()
            if s.low is not None and s.high is not None
        }
        self._known: dict[tuple, list[Site]] = {}
        self.blocks: dict[str, int] = {}  # how many times the points of a rig, once where it is not named

    def sites(self, request: Request) -> list[Site]:
        """The cases of a request, known and fixed parameters with their values; the same list for the same cases."""
        fixed_values = {n: v[0, 0] for n, v in request.parameters.items() if np.ndim(v) == 2 and n not in self.ranges}
        arrays = [*request.conditions.values(), *(v for v in request.parameters.values() if np.ndim(v) == 1)]
        count = len(next(iter(request.conditions.values())))
        key = (
            request.rig,
            request.observable,
            count,
            *fixed_values.items(),
            *(np.asarray(a).tobytes() for a in arrays),
        )
        if key not in self._known:
            self._known[key] = [self._site(request, k) for k in range(count)]
        return self._known[key]

    def _site(self, request: Request, k: int) -> Site:
        known = self.rigs[request.rig].conditions
        conditions = {
            c: str(v[k]) if "options" in known[c] else float(v[k]) for c, v in request.conditions.items() if c in known
        }
        fixed = {}
        for name, values in request.parameters.items():
            values = np.asarray(values)
            if values.ndim == 1:
                fixed[name] = float(values[k])
            elif name not in self.ranges:
                fixed[name] = float(values[0, 0])
        return Site(request.rig, request.observable, tuple(conditions.items()), tuple(fixed.items()))

    def paired(self, site: Site) -> bool:
        """Whether the same seed ends nearly alike in nearly the same case."""
        return self.rigs[site.rig].paired

    def seeds(self, site: Site) -> int:
        """How many seeds make a mean."""
        return self.rigs[site.rig].seeds

    def factors(self, site: Site) -> dict[str, Range]:
        """The free parameters that a site depends on."""
        fixed = dict(site.fixed)
        return {n: f for n, f in self.ranges.items() if n in self.rigs[site.rig].parameters and n not in fixed}

    def base_points(self, site: Site) -> list[Point]:
        """Points without effects, spread over the factors; those of fewer blocks come first."""
        factors = self.factors(site)
        p, count = len(factors), self._in_block(site) * self.blocks.get(site.rig, 1)
        stream, seeds = self._stream(site), self.seeds(site)
        return [
            Point(site, _values(factors, x), (), _first_seed(stream, k, seeds), seeds)
            for k, x in enumerate(spread(count, p, seed=1 + stream))
        ]

    def _in_block(self, site: Site) -> int:
        """Points of one block of a base surface."""
        p = len(self.factors(site))
        least = PAIRED_EFFECT * self.effort if self.paired(site) else UNPAIRED
        terms = (p + 1) * (p + 2) // 2
        return int(np.ceil(max(least, terms + SPARE, BASE * terms * self.effort)))

    def effect_points(self, site: Site, name: str) -> list[Point]:
        """Points with an effect: in a paired rig some of the base surface's, one after the other; else others."""
        effect, factors = self.catalogue.effects[name], self.factors(site)
        shapes = list(effect.parameters)[1:]
        stream = self._stream(site, 1 + zlib.crc32(name.encode()) % STREAMS)
        seeds = max(1, round(EFFECT_SEEDS * self.seeds(site)))
        count = int(np.ceil((PAIRED_EFFECT if self.paired(site) else EFFECT[effect.sides]) * self.effort))
        blocks = self.blocks.get(site.rig, 1)
        of_block, all_of_them = amounts(count, effect.sides), range(blocks * count)
        places = spread(blocks * count, len(factors) + len(shapes), seed=1 + stream)
        if self.paired(site):
            draw, base, block = np.random.default_rng(stream), self.base_points(site), self._in_block(site)
            u = np.concatenate([draw.permutation(of_block) for _ in range(blocks)])
            there = [base[k // count * block + (stream + k % count) % block] for k in all_of_them]
        else:
            x, u = places[:, : len(factors)], np.tile(of_block, blocks)
            there = [Point(site, _values(factors, x[k]), (), _first_seed(stream, k, seeds), seeds) for k in all_of_them]
        absent, reach = self._reach(name)
        found = []
        for point, amount, place in zip(there, u, places[:, len(factors) :], strict=True):
            values = {effect.amount: absent + reach * amount}
            for shape, s in zip(shapes, place, strict=True):
                values[shape] = float(self._shape(name, shape).value(s))
            found.append(replace(point, effects=((name, tuple(values.items())),), seeds=seeds))
        return found

    def check_points(self, request: Request) -> list[list[Point]]:
        """For each site of a request at one point, blocks of simulations there with seeds of their own."""
        effects = tuple(
            (e, tuple((p, float(v[0, 0])) for p, v in values.items())) for e, values in request.effects.items()
        )
        found = []
        for site in self.sites(request):
            values = tuple((k, float(request.parameters[k][0, 0])) for k in self.factors(site))
            seeds = self.seeds(site)
            first = _first_seed(self._stream(site, CHECK), 0, seeds)
            found.append([Point(site, values, effects, first + b * seeds, seeds) for b in range(BLOCKS)])
        return found

    def scaled(self, site: Site, points: Sequence[Point]) -> np.ndarray:
        """(n, p) factors of some points, each -1...1 over its range."""
        factors = self.factors(site)
        return np.array([[f.scaled(dict(p.factors)[n]) for n, f in factors.items()] for p in points]).reshape(
            len(points), len(factors)
        )

    def shares(self, name: str, values: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Amount of an effect as a share of its physical limit, and scaled shape parameters, of (m,) values."""
        absent, reach = self._reach(name)
        amount, *shapes = self.catalogue.effects[name].parameters
        scaled = [self._shape(name, s).scaled(values[s]) for s in shapes]
        u = (values[amount] - absent) / reach
        return u, np.array(scaled).reshape(len(shapes), len(u)).T

    def _stream(self, site: Site, number: int = 0) -> int:
        """A stream of seeds and places: by its number, in a paired rig also by the case."""
        return number + 1000 * (zlib.crc32(repr(site).encode()) % 2**20 if self.paired(site) else 0)

    def _reach(self, name: str) -> tuple[float, float]:
        """An effect's amount when absent, and how far it is from there to the physical limit."""
        effect = self.catalogue.effects[name]
        quantity = effect.parameters[effect.amount]
        low, high = quantity.get("physical", (quantity["min"], quantity["max"]))
        absent = quantity["absent"]
        return absent, max(high - absent, absent - low) if effect.sides == 2 else high - absent

    def _shape(self, name: str, shape: str) -> Range:
        quantity = self.catalogue.effects[name].parameters[shape]
        return Range(*quantity.get("physical", (quantity["min"], quantity["max"])))


def _first_seed(stream: int, k: int, seeds: int) -> int:
    """The first of the seeds of a stream's k-th point; no stream of another number has any of them."""
    more, k = divmod(k, IN_ITS_THOUSAND)
    return (BEYOND * more + 1000 * stream + k) * seeds


def spread(count: int, dimensions: int, seed: int) -> np.ndarray:
    """(count, dimensions) points that fill -1...1 evenly (Sobol 1967, scrambled by the seed)."""
    if dimensions == 0:
        return np.empty((count, 0))
    sampler = qmc.Sobol(dimensions, seed=seed)
    return 2 * sampler.random_base2(int(np.ceil(np.log2(max(count, 2)))))[:count] - 1


def amounts(count: int, sides: int) -> np.ndarray:
    """(count,) amounts of an effect to simulate, as shares of its physical limit; denser near none."""
    if sides == 2:
        half = amounts((count + 1) // 2, 1)
        return np.concatenate([half, -half])[:count]
    return (np.arange(1, count + 1) / count) ** 1.5


def _values(factors: Mapping[str, Range], x: np.ndarray) -> Values:
    return tuple((name, float(factor.value(s))) for (name, factor), s in zip(factors.items(), x, strict=True))
