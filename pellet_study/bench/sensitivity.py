"""What the bench rigs' answers depend on besides the physics: numerics, the paper's omissions, the unprinted apparatus."""

from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd

from pellet_study.bench.parabola import fit_parabola
from pellet_study.bench.printed import measured
from pellet_study.bench.seeds import Mean, mean_over_seeds
from pellet_study.bench.stages import STAGES
from pellet_study.paper import printed as paper
from pellet_study.rigs import on_yade
from pellet_study.simulation import dispatch
from yade_scripts import contacts
from yade_scripts.particles import alfalfa_seed

CALIBRATED = {  # close to what `bench` finds
    "seed_powder_restitution": 0.25,
    "seed_powder_static_friction": 0.62,
    "seed_powder_rolling_friction": 0.25,
}
SEEDS = {"rebound": 512, "slope_slip": 32, "inclined_roll": 96}
OBSERVABLE = {stage.rig: stage.observable for stage in STAGES}
PAPER_RAYLEIGH_STEP_S = 6.87e-6
NO_FRICTION = {"seed_powder_static_friction": 0.0, "seed_powder_rolling_friction": 0.0}

Setting = tuple[str, dict[str, float], dict[str, float], dict[str, float], int]
"""A rig, its parameters, conditions and numerics, and how many seeds."""


def numerics_variants() -> Iterator[tuple[str, str, dict[str, float]]]:
    """(rig, what is changed, numerics): the defaults of each rig, then one change at a time."""
    for rig in OBSERVABLE:
        default = {name: quantity["default"] for name, quantity in on_yade.rig(rig).numerics.items()}
        yield rig, "default", {}
        yield rig, "time step halved", {"time_step_fraction": default["time_step_fraction"] / 2}
        yield rig, "3 times as stiff", {"stiffness_scale": default["stiffness_scale"] * 3}
        yield rig, "a third as stiff", {"stiffness_scale": default["stiffness_scale"] / 3}
        if rig == "inclined_roll":
            yield rig, "rolling spring a third as stiff", {"rolling_spring": default["rolling_spring"] / 3}
            yield rig, "rest speed halved", {"rest_speed_mm_s": default["rest_speed_mm_s"] / 2}
        if rig == "slope_slip":
            yield rig, "hold doubled (half the rate)", {"hold_ms": default["hold_ms"] * 2}
            yield rig, "bracket halved", {"bracket_deg": default["bracket_deg"] / 2}


def means(settings: Sequence[Setting], store: Path, quiet: bool) -> list[Mean]:
    """Mean over seeds of each setting, all in one campaign."""
    cases = [
        on_yade.case(rig, seed=seed, parameters=parameters, conditions=conditions, numerics=numerics)
        for rig, parameters, conditions, numerics, seeds in settings
        for seed in range(seeds)
    ]
    rows = dispatch.run(cases, store, quiet=quiet)
    found, first = [], 0
    for rig, *_, seeds in settings:
        part = rows.iloc[first : first + seeds]
        good = part.loc[part["status"] == "ok", OBSERVABLE[rig]].astype(float)
        found.append(mean_over_seeds(good, seeds - len(good)))
        first += seeds
    return found


def numerics_table(store: Path, quiet: bool = False) -> pd.DataFrame:
    """Each rig's mean under changed numerics, against its default.

    Columns: rig, change, mean, standard_error, n, failed, difference, allowed, allowed_percent, within. `allowed` is 1 % of the default's
    mean or twice the standard error of the difference, whichever is larger.
    """
    variants = list(numerics_variants())
    settings: list[Setting] = []
    for rig, _, numerics in variants:
        parameters = CALIBRATED | (NO_FRICTION if rig == "rebound" else {})
        if rig == "slope_slip":
            parameters = parameters | {"seed_powder_rolling_friction": 0.0}
        settings.append((rig, parameters, {}, numerics, SEEDS[rig]))
    rows: list[dict[str, object]] = []
    default: dict[str, Mean] = {}
    for (rig, change, _), mean in zip(variants, means(settings, store, quiet), strict=True):
        default.setdefault(rig, mean)
        difference = mean.value - default[rig].value
        error = np.hypot(mean.standard_error, default[rig].standard_error) if change != "default" else 0.0
        allowed = max(0.01 * abs(default[rig].value), 2 * error)
        rows.append(
            {
                "rig": rig,
                "observable": OBSERVABLE[rig],
                "change": change,
                **_columns(mean),
                "difference": difference,
                "allowed": allowed,
                "allowed_percent": 100 * allowed / abs(default[rig].value),
                "within": bool(abs(difference) <= allowed),
            }
        )
    return pd.DataFrame(rows)


def _columns(mean: Mean) -> dict[str, float]:
    return {"mean": mean.value, "standard_error": mean.standard_error, "n": mean.n, "failed": mean.failed}


def omissions_table(store: Path, quiet: bool = False) -> pd.DataFrame:
    """The paper's statement that a2 and a3 do not matter for the rebound (it sets them to 0), tried.

    a4, a5, a6 belong to powder-powder contacts, of which this rig has none: nothing to try.
    """
    variants = {
        "a2 = a3 = 0 (the paper)": NO_FRICTION,
        "a2 on": {"seed_powder_rolling_friction": 0.0},
        "a2 and a3 on": {},
    }
    settings: list[Setting] = [
        ("rebound", CALIBRATED | change, {}, {}, SEEDS["rebound"]) for change in variants.values()
    ]
    found = means(settings, store, quiet)
    return pd.DataFrame(
        [
            {
                "rig": "rebound",
                "setting": name,
                **_columns(mean),
                "change_percent": 100 * (mean.value / found[0].value - 1),
            }
            for name, mean in zip(variants, found, strict=True)
        ]
    )


def restitution_table(store: Path, quiet: bool = False, seeds: int = 256) -> pd.DataFrame:
    """What the mass that the damper takes does to the rebound, and to the a1 that meets the paper's reading.

    Columns: the paper's levels of a1, mean rebound and its standard error where the damper takes the seed's whole mass (e for
    central impacts) and the mass effective at the contact (e at every contact), the second over the first, percent. Below, a1
    by either, and its change.
    """
    stage = STAGES[0]
    levels, conventions = stage.levels, (0.0, 1.0)
    settings: list[Setting] = [
        (stage.rig, NO_FRICTION | {stage.parameter: level}, {}, {"damping_at_contact": convention}, seeds)
        for convention in conventions
        for level in levels
    ]
    found = means(settings, store, quiet)
    whole, effective = found[: len(levels)], found[len(levels) :]
    rows: list[dict[str, object]] = [
        {
            "a1": level,
            "whole_mass_mm": one.value,
            "whole_mass_standard_error": one.standard_error,
            "at_contact_mm": other.value,
            "at_contact_standard_error": other.standard_error,
            "n": one.n,
            "change_percent": 100 * (other.value / one.value - 1),
        }
        for level, one, other in zip(levels, whole, effective, strict=True)
    ]
    reading = measured(stage)
    first, second = (fit_parabola(levels, [m.value for m in of]).root(reading) for of in (whole, effective))
    change = None if first is None or second is None else 100 * (second / first - 1)
    label = f"a1 that meets {reading:g} mm"
    rows.append({"a1": label, "whole_mass_mm": first, "at_contact_mm": second, "change_percent": change})
    return pd.DataFrame(rows)


def apparatus_table(store: Path, quiet: bool = False, seeds: int = 16) -> pd.DataFrame:
    """Drop height, slope and release distance inferred: rms difference of our sweep from the paper's printed one.

    The paper prints no dimension of its apparatus. Rebound: drop heights against Table 3. Rolling: slopes and release
    distances against Table 5's rows at a3 = 0.2, 0.26 and 0.3 (seed_powder_static_friction 0.62, from the slope test).
    """
    trials: list[tuple[str, dict, list[tuple[dict, float]]]] = []
    for height in (90.0, 105.0, 115.0, 125.0, 140.0):
        rows = [({"seed_powder_restitution": float(x)}, float(y)) for _, x, y in paper.table(3).to_numpy(float)]
        trials.append(("rebound", {"drop_height_mm": height}, rows))
    printed = [row for row in paper.table(5).to_numpy(float) if round(row[1], 2) in (0.2, 0.26, 0.3)]
    for slope, release in product((31.0, 33.0, 35.0), (300.0, 400.0, 500.0)):
        rows = [({"seed_powder_rolling_friction": float(x)}, float(y)) for _, x, y in printed]
        trials.append(("inclined_roll", {"slope_deg": slope, "release_distance_mm": release}, rows))
    settings: list[Setting] = [
        (rig, CALIBRATED | (NO_FRICTION if rig == "rebound" else {}) | change, conditions, {}, seeds)
        for rig, conditions, rows in trials
        for change, _ in rows
    ]
    found = iter(means(settings, store, quiet))
    table = []
    for rig, conditions, rows in trials:
        gaps = np.array([next(found).value - wanted for _, wanted in rows])
        setting = ", ".join(f"{name} = {value:g}" for name, value in conditions.items())
        table.append(
            {"rig": rig, "setting": setting, "rms_difference_mm": float(np.sqrt(np.mean(gaps**2))), "seeds": seeds}
        )
    return pd.DataFrame(table)


def time_steps_table() -> pd.DataFrame:
    """Our time step and contact search beside the paper's printed 6.87e-6 s and grid of 3 Rmin."""
    _, radii = alfalfa_seed()
    rows = []
    for rig in OBSERVABLE:
        declared = on_yade.rig(rig)
        value = {name: q["default"] for name, q in {**declared.parameters, **declared.numerics}.items()}
        seed = contacts.Material(
            value["seed_density_kg_m3"],
            value["stiffness_scale"] * value["seed_shear_modulus_pa"],
            value["seed_poisson_ratio"],
        )
        rayleigh = contacts.rayleigh_step(radii.min(), seed)
        rows.append(
            {
                "rig": rig,
                "rayleigh_step_s": rayleigh,
                "time_step_s": value["time_step_fraction"] * rayleigh,
                "paper_rayleigh_step_s": PAPER_RAYLEIGH_STEP_S,
                "search_distance_mm": 0.2 * radii.min() * 1e3,
                "paper_grid_mm": 3 * radii.min() * 1e3,
                "remark": "shorter where e < 0.25, up to 10 times longer in flight; search by sorted bounding boxes enlarged "
                "by 0.2 Rmin, the paper's by a grid of cells of 3 Rmin",
            }
        )
    return pd.DataFrame(rows)


TABLES = {
    "numerics": numerics_table,
    "omissions": omissions_table,
    "apparatus": apparatus_table,
    "restitution_convention": restitution_table,
}
