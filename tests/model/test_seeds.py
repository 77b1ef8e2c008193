"""No simulation of one stream has a seed of another; those that results were made with stay."""

import pytest

from pellet_study.model.sites import CHECK, EFFECT_SEEDS, _first_seed


def of_stream(stream: int, points: int, seeds: int) -> list[int]:
    return [_first_seed(stream, k, seeds) + s for k in range(points) for s in range(seeds)]


@pytest.mark.parametrize("seeds", [1, 2, 3, 5, 8, 9])
def test_streams_of_many_points_share_no_seed(seeds):
    half = max(1, round(EFFECT_SEEDS * seeds))
    streams = [(0, seeds), (1, half), (2, half), (400, half), (CHECK, seeds)]
    every = [seed for stream, each in streams for seed in of_stream(stream, 2500, each)]
    assert len(set(every)) == len(every)


def test_seeds_of_few_points_are_those_of_earlier_results():
    assert [_first_seed(3, k, 8) for k in (0, 1, 399)] == [24000, 24008, 27192]
