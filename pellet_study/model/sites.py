"""Where a surrogate simulates: cases with everything fixed that is not a factor, and the streams of their seeds."""

import zlib
from dataclasses import dataclass

BASE = 2.4  # points a term of the base surface
SPARE = 2  # points beyond its terms, at least: they tell the scatter
EFFECT = {1: 5, 2: 8}  # points of an effect's surface, by the sides it may take
PAIRED_EFFECT = 8  # in a paired rig
EFFECT_SEEDS = 0.5  # share of a mean's seeds that they take
STREAMS, CHECK = 400, 500  # numbers of the streams of seeds and places: of effects by their names; of checks


@dataclass(frozen=True)
class Site:
    """A case of a rig with everything that is not a factor fixed."""

    rig: str
    observable: str
    conditions: tuple[tuple[str, float], ...]
    fixed: tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class Point:
    """Simulations of a site at one place: values of the factors and of an effect, and their seeds."""

    site: Site
    factors: tuple[tuple[str, float], ...]
    effect: tuple[str, tuple[tuple[str, float], ...]] | None
    first_seed: int
    seeds: int


def _stream(site: Site, paired: bool, number: int = 0) -> int:
    """A stream of seeds and places: by its number, in a paired rig also by the case."""
    return number + 1000 * (zlib.crc32(repr(site).encode()) % 2**20 if paired else 0)


def _stream_of(site: Site, effect: str, paired: bool) -> int:
    return _stream(site, paired, 1 + zlib.crc32(effect.encode()) % STREAMS)
