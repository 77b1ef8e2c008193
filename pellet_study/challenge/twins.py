"""Closed-form twins of the bench rigs and of the heap: fast stand-ins on which error rates can be counted.

Forty conditions as in a real campaign: 14 rebounds (7 heights, 2 seeds), 5 slip angles (loads), 9 roll-outs (3 slopes,
3 lengths), 12 heaps (4 sizes, 3 fall heights). A seed is a sphere here, its diameter the seed's length.
"""

from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np

from pellet_study.rigs.catalogue import Catalogue
from pellet_study.rigs.declared import Condition, Effect, Rig
from pellet_study.study.measurements import Measurement
from pellet_study.study.study import Setting, Study

GRAVITY, AIR, SEED = 9.81, 1.2, 1250.0  # m/s2, kg/m3, kg/m3
MODULUS = 1e7  # Pa, reduced modulus in the sticking speed
REFERENCE_MM = 2.0  # seed whose weight is the unit of adhesion
NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)
Values = Mapping[str, np.ndarray]  # numbers and arrays that broadcast: points down, rows across
NODES, WEIGHTS = 0.5 * (NODES + 1), 0.5 * WEIGHTS
SLOPE_STEPS = 4


def _mass(d: Any) -> Any:
    """Mass of a seed of diameter d (m), kg."""
    return SEED * np.pi * d**3 / 6


def _of(effects: Mapping, name: str, parameter: str, absent: float = 0.0) -> Any:
    """Value of an effect's parameter, its neutral value where it is absent."""
    return effects[name].values[parameter] if name in effects else absent


def _pull(effects: Mapping) -> Any:
    """Pull-off force of the reference seed, N; in proportion to the diameter for others (JKR)."""
    weights = _of(effects, "adhesion", "pull_off_weights")
    return weights * _mass(1e-3 * REFERENCE_MM) * GRAVITY


def _drag(effects: Mapping, d: Any) -> Any:
    """c in dv/dt = -c v^2, 1/m: 3 rho_air Cd / (4 rho d)."""
    return 0.75 * AIR * _of(effects, "air_drag", "drag_coefficient") / (SEED * d)


def rebound(parameters: Values, conditions: Values, effects: Mapping) -> dict[str, np.ndarray]:
    """Rebound height, mm: e(v)^2 v^2/(2 g), with drag on the way down and up."""
    height, d = 1e-3 * conditions["drop_height_mm"], 1e-3 * conditions["seed_length_mm"]
    c = np.maximum(_drag(effects, d), 1e-9)
    v2 = GRAVITY / c * -np.expm1(-2 * c * height)
    v = np.sqrt(v2)
    e = parameters["seed_powder_restitution"]
    e = e * np.maximum(1 - _of(effects, "viscoelastic_restitution", "loss") * v**0.2, 0.02)
    e = e * (1 + (v * _of(effects, "plastic_restitution", "inverse_yield_speed")) ** 2) ** -0.125
    film = _of(effects, "wet_film", "critical_stokes")
    e = e * np.maximum(1 - film * 1e-3 * REFERENCE_MM / (v * d), 0.02)
    e = e * (1 + _of(effects, "plate_resonance", "amplitude") * np.sin(2 * np.pi * np.log2(height / 0.02) / 2.3))
    e = e * (1 - _of(effects, "size_loss", "amplitude") * (d / (1e-3 * REFERENCE_MM) - 0.75))
    pull = _pull(effects) * d / (1e-3 * REFERENCE_MM)
    energy = pull / (1.5 * np.pi * 0.5 * d)  # J/m2
    work = 7.09 * (energy**5 * (0.5 * d) ** 4 / MODULUS**2) ** (1 / 3)
    after = np.maximum(e**2 * v2 - 2 * work / _mass(d), 1e-4 * v2)
    rise = np.log1p(c * after / GRAVITY) / (2 * c)
    return {"rebound_height_mm": 1e3 * rise + _of(effects, "reading_offset", "offset_mm")}


def slope_slip(parameters: Values, conditions: Values, effects: Mapping) -> dict[str, np.ndarray]:
    """Slip angle, deg: tan a = mu (1 + F/N), N = (m + load) g cos a."""
    d = 1e-3 * conditions["seed_length_mm"]
    load = _mass(d) + 1e-6 * conditions["added_mass_mg"]
    relative = load / _mass(1e-3 * REFERENCE_MM)
    mu = parameters["seed_powder_static_friction"]
    mu = mu * relative ** -_of(effects, "load_dependent_friction", "load_exponent")
    hump = np.exp(-0.5 * (np.log(relative / 2.2) / 0.35) ** 2)
    mu = mu * (1 + _of(effects, "friction_hump", "amplitude") * hump)
    angle = np.arctan(mu)
    pull = _pull(effects) * d / (1e-3 * REFERENCE_MM)
    share = np.minimum(mu * pull / (load * GRAVITY) * np.cos(angle), 0.999)
    return {"slip_angle_deg": np.degrees(angle + np.arcsin(share))}


def inclined_roll(parameters: Values, conditions: Values, effects: Mapping) -> dict[str, np.ndarray]:
    """Roll-out distance, mm: speed at the foot of the slope, then the energy spent along the plate."""
    slope, length = np.radians(conditions["slope_deg"]), 1e-3 * conditions["release_distance_mm"]
    d = 1e-3 * conditions["seed_length_mm"]
    mu = parameters["seed_powder_rolling_friction"]
    slower = _of(effects, "speed_dependent_rolling", "slope_s_m")
    pull = _pull(effects) * d / (1e-3 * REFERENCE_MM) / (_mass(d) * GRAVITY)
    c = _drag(effects, d)

    rolling = 10 / 7 * GRAVITY * mu * (np.cos(slope) + pull)
    push, faster, drag = 10 / 7 * GRAVITY * np.sin(slope) - rolling, rolling * slower, 10 / 7 * c

    def gain(u: np.ndarray) -> np.ndarray:
        return push - faster * np.sqrt(np.maximum(u, 0)) - drag * u

    u, h = 0.0 * (mu + length), length / SLOPE_STEPS
    for _ in range(SLOPE_STEPS):
        first = gain(u)
        second = gain(u + 0.5 * h * first)
        third = gain(u + 0.5 * h * second)
        u = np.maximum(u + h / 6 * (first + 2 * second + 2 * third + gain(u + h * third)), 1e-9)
    steep = (1 - np.cos(slope)) / (1 - np.cos(np.radians(35)))
    v = np.sqrt(u) * np.maximum(1 - _of(effects, "foot_loss", "loss") * steep, 0.05)
    rolling = mu * GRAVITY * (1 + pull)
    distance = 0.0
    for node, weight in zip(NODES, WEIGHTS, strict=True):
        s = v * node
        distance = distance + weight * s / (rolling + (rolling * slower + c * s) * s)
    distance = 1.4 * v * distance
    distance = distance * (1 + _of(effects, "texture", "amplitude") * np.sin(2 * np.pi * length / 0.25))
    return {"roll_distance_mm": 1e3 * distance}


def repose(parameters: Values, conditions: Values, effects: Mapping) -> dict[str, np.ndarray]:
    """Repose angle, deg: a constant, and what size and fall height make of it."""
    d, fall = conditions["particle_diameter_um"] / 200.0, conditions["outlet_height_mm"] / 50.0
    bond = _of(effects, "cohesion", "bond_number") + _of(effects, "liquid_bridges", "bridge_number")
    angle = parameters["heap_angle_deg"] * (1 + bond / d**2)
    angle = angle * (1 - _of(effects, "fall_height_flattening", "flattening") * np.sqrt(fall))
    angle = angle * (1 + _of(effects, "wall_friction", "wall_share") * d)
    odd = conditions["particle_diameter_um"] == SIZES_UM[1]
    return {"repose_angle_deg": angle * (1 + _of(effects, "odd_size_class", "amplitude") * odd)}


SIZES_UM = (100.0, 150.0, 230.0, 350.0)


def _quantity(default: float, low: float, high: float, unit: str = "1", meaning: str = "") -> dict[str, Any]:
    return {"default": default, "min": low, "max": high, "unit": unit, "meaning": meaning}


RIGS = {
    "rebound": Rig(
        "rebound",
        None,
        {"seed_powder_restitution": _quantity(0.4, 0.05, 0.95)},
        {"drop_height_mm": _quantity(120.0, 20.0, 1500.0, "mm"), "seed_length_mm": _quantity(2.0, 1.0, 3.0, "mm")},
        {"rebound_height_mm": "apex"},
        rebound,
    ),
    "slope_slip": Rig(
        "slope_slip",
        None,
        {"seed_powder_static_friction": _quantity(0.6, 0.05, 1.5)},
        {"seed_length_mm": _quantity(2.0, 1.0, 3.0, "mm"), "added_mass_mg": _quantity(0.0, 0.0, 100.0, "mg")},
        {"slip_angle_deg": "tilt"},
        slope_slip,
    ),
    "inclined_roll": Rig(
        "inclined_roll",
        None,
        {"seed_powder_rolling_friction": _quantity(0.25, 0.02, 0.6)},
        {
            "slope_deg": _quantity(35.0, 25.0, 50.0, "deg"),
            "release_distance_mm": _quantity(300.0, 50.0, 600.0, "mm"),
            "seed_length_mm": _quantity(2.0, 1.0, 3.0, "mm"),
        },
        {"roll_distance_mm": "distance"},
        inclined_roll,
    ),
    "repose": Rig(
        "repose",
        None,
        {"heap_angle_deg": _quantity(33.0, 10.0, 60.0, "deg")},
        {
            "particle_diameter_um": _quantity(200.0, 50.0, 500.0, "um"),
            "outlet_height_mm": _quantity(50.0, 10.0, 200.0, "mm"),
        },
        {"repose_angle_deg": "angle"},
        repose,
    ),
}
TRUTH = {
    "seed_powder_restitution": 0.4,
    "seed_powder_static_friction": 0.6,
    "seed_powder_rolling_friction": 0.25,
    "heap_angle_deg": 33.0,
}


def _effect(
    name: str, parameter: str, high: float, rigs: Sequence[str], sides: int = 1, low: float = 0.0, widest: float = 4.0
) -> Effect:
    return Effect(
        name=name,
        means="",
        formula="",
        parameters={
            parameter: {
                "absent": 0.0,
                "min": low * widest,
                "max": high * widest,
                "physical": (low, high),
                "unit": "",
                "meaning": "",
            }
        },
        sides=sides,
        rigs=dict.fromkeys(rigs, ""),
        signature="",
        source="",
        closed_form=dict.fromkeys(rigs),
    )


CANDIDATES = [
    _effect("viscoelastic_restitution", "loss", 0.6, ["rebound"], widest=1.0),
    _effect("plastic_restitution", "inverse_yield_speed", 10.0, ["rebound"]),
    _effect("adhesion", "pull_off_weights", 10.0, ["rebound", "slope_slip", "inclined_roll"]),
    _effect("air_drag", "drag_coefficient", 1.5, ["rebound", "inclined_roll"]),
    _effect("reading_offset", "offset_mm", 3.0, ["rebound"], sides=2, low=-3.0, widest=1.0),
    _effect("speed_dependent_rolling", "slope_s_m", 1.0, ["inclined_roll"]),
    _effect("foot_loss", "loss", 0.5, ["inclined_roll"], widest=1.2),
    _effect("load_dependent_friction", "load_exponent", 1 / 3, ["slope_slip"], widest=1.5),
    _effect("cohesion", "bond_number", 0.5, ["repose"]),
    _effect("liquid_bridges", "bridge_number", 0.5, ["repose"]),
    _effect("fall_height_flattening", "flattening", 0.3, ["repose"], widest=1.5),
    _effect("wall_friction", "wall_share", 0.3, ["repose"], sides=2, low=-0.3, widest=1.5),
]
OUTSIDE = [
    _effect("plate_resonance", "amplitude", 0.8, ["rebound"], widest=1.0),
    _effect("friction_hump", "amplitude", 2.0, ["slope_slip"], widest=1.0),
    _effect("texture", "amplitude", 0.8, ["inclined_roll"], widest=1.0),
    _effect("odd_size_class", "amplitude", 0.8, ["repose"], widest=1.0),
    _effect("wet_film", "critical_stokes", 0.5, ["rebound"], widest=1.0),
    _effect("size_loss", "amplitude", 0.6, ["rebound"], widest=1.0),
]
SAME = {"liquid_bridges": "cohesion"}  # proportional to one another under all conditions: one class
NOISE = {  # of one reading: share of the value, floor
    "rebound": (0.05, 0.1),
    "slope_slip": (0.03, 0.2),
    "inclined_roll": (0.05, 1.0),
    "repose": (0.02, 0.2),
}
REPEATS = 5


@cache
def catalogue(outside: bool = False) -> Catalogue:
    """The twins, with the candidates and, for making measurements, the effects outside them."""
    return Catalogue(RIGS, {e.name: e for e in CANDIDATES + (OUTSIDE if outside else [])})


@cache
def conditions() -> tuple[tuple[str, str, Mapping[str, float]], ...]:
    """The campaign: (rig, observable, conditions)."""
    found = []
    for d in (1.5, 2.5):
        found += [
            ("rebound", {"drop_height_mm": float(h), "seed_length_mm": d}) for h in np.geomspace(20, 450, 7).round(1)
        ]
    found += [("slope_slip", {"seed_length_mm": 2.0, "added_mass_mg": m}) for m in (0.0, 3.0, 10.0, 35.0, 100.0)]
    for slope in (25.0, 35.0, 45.0):
        for length in (100.0, 220.0, 480.0):
            found.append(("inclined_roll", {"slope_deg": slope, "release_distance_mm": length, "seed_length_mm": 2.0}))
    for d in SIZES_UM:
        for fall in (20.0, 60.0, 150.0):
            found.append(("repose", {"particle_diameter_um": d, "outlet_height_mm": fall}))
    return tuple((rig, next(iter(RIGS[rig].observables)), c) for rig, c in found)


def reading_sd(rig: str, value: Any) -> Any:
    """Standard deviation of one reading."""
    share, floor = NOISE[rig]
    return np.hypot(share * value, floor)


def measurement(
    rig: str,
    observable: str,
    given: Mapping[str, Condition],
    readings: Iterable[float],
    line: int = 0,
    split: str = "fit",
) -> Measurement:
    """A row from its readings."""
    read = np.asarray(readings, dtype=float)
    return Measurement(
        rig,
        observable,
        float(read.mean()),
        float(read.std(ddof=1)),
        len(read),
        given,
        {},
        "",
        0.0,
        split,
        "",
        line,
    )


def study(
    rows: Iterable[Measurement], effects: Mapping[str, Mapping[str, float]] | None = None, outside: bool = False
) -> Study:
    """The study a user would make of twin measurements: the four constants free, and no effect unless given."""
    free = {
        name: Setting(q["default"], q["min"], q["max"]) for rig in RIGS.values() for name, q in rig.parameters.items()
    }
    return Study(
        title="twins",
        rows=tuple(rows),
        parameters=free,
        effects={e: {p: Setting(v) for p, v in values.items()} for e, values in (effects or {}).items()},
        catalogue=catalogue(outside),
    )
