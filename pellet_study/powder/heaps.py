"""Sizes of a powder calibration: how many heaps, of how many grains."""

from dataclasses import dataclass

SEEDS_A_STAGE = 10_000
SEEDS_OF_READ = 8_000  # first of the validation where the setting was read: the chain that found it used those before
KEEP_GRAINS = "PELLET_STUDY_GRAINS"  # where the rig leaves the grains of its heaps


@dataclass(frozen=True)
class Sizes:
    """How many heaps: at each point of a design and of the climb, at its centre, at least and at most in the validation."""

    repeats: int
    centre_points: int
    fewest: int
    most: int
    wanted_error: float = 0.25  # deg, standard error of the validation's mean
    attempts: int = 2  # settings that are validated: the optimum, and the one corrected by its validation


FULL, QUICK = Sizes(3, 5, 10, 60), Sizes(1, 3, 4, 4, attempts=1)
