"""The three bench tests of the source paper: what each sweeps, what it reads, how many seeds it takes."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Stage:
    """One bench test: what is swept, what is read, how many seeds a level and for the verification."""

    rig: str
    parameter: str
    symbol: str
    observable: str
    levels: tuple[float, ...]
    seeds: int
    verification_seeds: int
    table: int | None  # of the paper, where it is printed
    resolution: float = 0.0  # half-width of the interval in which a single reading lies


STAGES = (
    Stage(
        "rebound",
        "seed_powder_restitution",
        "a1",
        "rebound_height_mm",
        (0.10, 0.15, 0.20, 0.25, 0.30, 0.35),
        256,
        2048,
        3,
    ),
    Stage(
        "slope_slip",
        "seed_powder_static_friction",
        "a2",
        "slip_angle_deg",
        (0.60, 0.65, 0.70, 0.75, 0.80, 0.85),
        8,
        16,
        None,
        resolution=0.025,  # half the bracket of 0.02 deg, and the tilt at which sliding is told from creaking
    ),
    Stage(
        "inclined_roll",
        "seed_powder_rolling_friction",
        "a3",
        "roll_distance_mm",
        (0.20, 0.22, 0.24, 0.26, 0.28, 0.30),
        64,
        256,
        5,
    ),
)
