"""The trials on the twins: what is hidden in each kind, at which strength, how often."""

from pellet_study.challenge import twins

SINGLE = [e.name for e in twins.CANDIDATES if e.name not in twins.SAME]
OUTSIDE = [e.name for e in twins.OUTSIDE]
CONFUSED = (("viscoelastic_restitution", "plastic_restitution"), ("adhesion", "load_dependent_friction"))
PAIRS = [  # in different rigs
    "plastic_restitution+cohesion",
    "speed_dependent_rolling+load_dependent_friction",
    "plastic_restitution+load_dependent_friction",
    "reading_offset+foot_loss",
    "air_drag+cohesion",
    "load_dependent_friction+fall_height_flattening",
]
MASKED = ["viscoelastic_restitution+speed_dependent_rolling"]  # one candidate, air drag, explains both
HELD_OUT = frozenset(
    k
    for k, (rig, _, c) in enumerate(twins.conditions())
    if (rig == "rebound" and c["drop_height_mm"] in (20.0, 450.0))
    or (rig == "slope_slip" and c["added_mass_mg"] == 100.0)
    or (rig == "inclined_roll" and c["release_distance_mm"] == 480.0)
    or (rig == "repose" and c["particle_diameter_um"] == 100.0 and c["outlet_height_mm"] != 60.0)
)


def plan(scale: float = 1.0) -> list[tuple[str, str, float, int]]:
    """(kind, hidden, lambda, how many), times `scale`."""
    found = [("nothing", "", 0.0, 2000), ("nothing, set-up scatter", "", 1.0, 500)]
    found += [("one", name, 8.0, 500) for name in SINGLE]
    found += [("one", name, lam, n) for lam, n in ((4.0, 500), (6.0, 200)) for name in SINGLE]
    found += [("nothing, sd stated", "", 0.0, 1000)]
    found += [("one, sd stated", name, 4.0, 200) for name in SINGLE]
    found += [("outside, sd stated", "wet_film", 8.0, 500)]
    found += [("outside", name, 8.0, 500) for name in OUTSIDE]
    found += [("outside", "wet_film", 12.0, 500)]
    found += [("next", name, 6.0, 500) for pair in CONFUSED for name in pair]
    found += [("next at random", name, 6.0, 100) for pair in CONFUSED for name in pair]
    found += [("pair", name, 6.0, 150) for name in PAIRS]
    found += [("masked pair", name, 6.0, 150) for name in MASKED]
    found += [("held out", name, 8.0, 100) for name in SINGLE] + [("held out", "", 8.0, 500)]
    return [(kind, hidden, lam, max(1, round(scale * n))) for kind, hidden, lam, n in found]
