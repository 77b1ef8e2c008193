"""The contact laws against closed forms: which cases to run, and the table of what was asked and what was measured."""

import importlib
from itertools import product
from types import ModuleType

import pandas as pd

from pellet_study import rigs

CHECKS = (
    "restitution",
    "hertz",
    "sliding",
    "rolling",
    "pull_off",
    "adhesion_jump",
    "two_pairs",
    "clump_inertia",
    "free_spin",
    "clump_restitution",
    "clump_sliding",
    "grain_impact",
    "grain_sticking",
    "grain_pull_off",
    "grain_limits",
    "grain_energy",
    "grain_and_wall",
)
RELATIVE_TOLERANCE = 0.02
ABSOLUTE_TOLERANCE = 0.005  # of restitution, and of whatever is asked to be zero
COLUMNS = ["check", "contact_law", "setting", "requested", "measured", "difference", "tolerance", "within", "remark"]

MINDLIN, COHESIVE = "hertz_mindlin", "cohesive_frictional"
RESTITUTION = "cohesive_frictional_restitution"


NO_REASON = "no limit of the law is known that explains this"


def cases(quick: bool = False) -> list[dict]:
    """The cases of all checks; `quick` keeps a part that meets every check, law and known limit once."""
    wanted = list(_wanted(quick))
    return [case for place, case in enumerate(wanted) if case not in wanted[:place]]


def _wanted(quick: bool):
    """Cases, check after check; a case may come twice."""
    case = _case

    speeds = (0.1, 4.0) if quick else (0.1, 0.3, 1.0, 2.0, 4.0)
    restitutions = (0.05, 0.5, 0.9) if quick else (0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.5, 0.7, 0.9)
    for e, v in product(restitutions, speeds):
        yield case("restitution", MINDLIN, restitution=e, speed_m_s=v)
    for e, v, d in product((0.25, 0.9), (0.1, 4.0), (0.0, 0.3) if quick else (0.0, 0.1, 0.3, 0.6, 0.9)):
        yield case("restitution", COHESIVE, restitution=e, speed_m_s=v, cohesive_frictional_damping=d)
    for e, step in product((0.05,) if quick else (0.05, 0.1, 0.25, 0.5), (0.05,) if quick else (0.025, 0.05)):
        yield case("restitution", MINDLIN, restitution=e, time_step_fraction=step)
    for e, v, gamma in product((0.5,), (0.1,) if quick else (0.1, 1.0, 4.0), (0.05,) if quick else (0.005, 0.05, 0.5)):
        yield case("restitution", MINDLIN, restitution=e, speed_m_s=v, surface_energy_j_m2=gamma)

    for law in (MINDLIN, COHESIVE):
        for radius, v in ((0.5, 1.0),) if quick else product((0.26, 0.5), (0.1, 1.0, 4.0)):
            yield case("hertz", law, radius_mm=radius, speed_m_s=v)

    for e, mu in ((0.05, 0.3),) if quick else product((0.05, 0.25, 0.9), (0.1, 0.3, 0.6, 0.85)):
        yield case("sliding", MINDLIN, restitution=e, static_friction=mu)
    for mu, d in ((0.6, 0.0), (0.6, 0.3)) if quick else product((0.1, 0.3, 0.6, 0.85), (0.0, 0.3)):
        yield case("sliding", COHESIVE, static_friction=mu, cohesive_frictional_damping=d)

    springs = (0.2, 0.002) if quick else (0.2, 0.02, 0.002)
    for e, spring, mu_r in product((0.25,) if quick else (0.05, 0.25, 0.9), springs, (0.0, 0.005, 0.05, 0.25)):
        yield case("rolling", MINDLIN, restitution=e, rolling_friction=mu_r, rolling_spring=spring)
    for e, spring, mu_r in product((0.25,) if quick else (0.05, 0.25, 0.9), springs, (0.005, 0.05, 0.25)):
        yield case("rolling", MINDLIN, restitution=e, rolling_friction=mu_r, rolling_spring=spring, impact_m_s=0.05)
    for mu_r, d, v in product((0.05,) if quick else (0.0, 0.05, 0.25), (0.0, 0.3), (0.0,) if quick else (0.0, 0.05)):
        yield case("rolling", COHESIVE, rolling_friction=mu_r, cohesive_frictional_damping=d, impact_m_s=v)

    for law in (MINDLIN, COHESIVE):
        for gamma, other in product((0.05,) if quick else (0.001, 0.05, 0.5), (0.0, 0.26, 0.13)):
            yield case("pull_off", law, surface_energy_j_m2=gamma, other_radius_mm=other)
    if not quick:
        for e in (0.05, 0.25):
            yield case("pull_off", MINDLIN, restitution=e)

    for law in (MINDLIN, COHESIVE):
        for e in (0.25,) if quick else (0.05, 0.25, 0.5, 0.9):
            yield case("adhesion_jump", law, restitution=e, cohesive_frictional_damping=0.0)

    sticky = {"powder_powder_surface_energy_j_m2": 0.05, "powder_steel_surface_energy_j_m2": 0.01}
    for law, energies in product((MINDLIN, COHESIVE), ({}, sticky)):
        yield case("two_pairs", law, cohesive_frictional_damping=0.0, **energies)
    yield case("two_pairs", COHESIVE)
    if not quick:
        for law in (MINDLIN, COHESIVE):
            swapped = {"powder_powder_restitution": 0.6, "powder_steel_restitution": 0.3}
            yield case("two_pairs", law, cohesive_frictional_damping=0.0, **swapped)

    for e, n, v in product(
        (0.25,) if quick else (0.05, 0.1, 0.25, 0.35, 0.5, 0.9), (1.0, 2.0, 6.0), (1.0,) if quick else (0.3, 1.0, 2.0)
    ):
        yield case("clump_restitution", MINDLIN, seed_powder_restitution=e, members_touching=n, speed_m_s=v)
    for length in (2.2,) if quick else (1.5, 2.2, 3.0):
        yield case("clump_inertia", MINDLIN, seed_length_mm=length)
    for spin in (1000.0,) if quick else (300.0, 1000.0, 2000.0):
        yield case("free_spin", MINDLIN, spin_rad_s=spin)

    for e, mu in ((0.05, 0.3),) if quick else product((0.05, 0.25), (0.3, 0.6, 0.85)):
        yield case("clump_sliding", MINDLIN, seed_powder_restitution=e, seed_powder_static_friction=mu)
    for mu in (0.6,) if quick else (0.3, 0.6, 0.85):
        yield case("clump_sliding", COHESIVE, seed_powder_static_friction=mu)

    for n in (1.0, 6.0):
        yield case("clump_restitution", COHESIVE, members_touching=n)
    if not quick:
        for e, n in product((0.05, 0.1, 0.25, 0.5), (1.0, 2.0, 6.0)):
            yield case(
                "clump_restitution",
                MINDLIN,
                seed_powder_restitution=e,
                members_touching=n,
                time_step_fraction=0.05,
            )
    yield from _grains(quick)


def _grains(quick: bool):
    """Cases of the law that dissipates between grains; pull-off, limits and sticking speed also at other stiffnesses."""
    case = _case
    for e, v, gamma in product(
        (0.15, 0.5) if quick else (0.05, 0.15, 0.3, 0.5, 0.7, 0.9),
        (0.2,) if quick else (0.05, 0.2, 1.0),
        (0.0, 0.2),
    ):
        yield case("grain_impact", RESTITUTION, restitution=e, speed_m_s=v, surface_energy_j_m2=gamma)
    for softness in () if quick else (0.01, 0.1, 1.0):
        yield case("grain_sticking", RESTITUTION, restitution=0.3, stiffness_scale=softness)
        yield case("grain_pull_off", RESTITUTION, restitution=0.3, apart_mm_s=1.0, stiffness_scale=softness)
        yield case("grain_limits", RESTITUTION, restitution=0.3, surface_energy_j_m2=0.2, stiffness_scale=softness)
    for e in (0.15,) if quick else (0.05, 0.15, 0.3, 0.5, 0.9):
        yield case("grain_sticking", RESTITUTION, restitution=e)
    for e, v in product((0.15,) if quick else (0.05, 0.15, 0.5, 0.9), (1.0, 50.0)):
        yield case("grain_pull_off", RESTITUTION, restitution=e, apart_mm_s=v)
    for gamma, load in ((0.0, 1e-3), (0.1, 1e-3)) if quick else product((0.0, 0.1, 0.3), (-1e-4, 0.0, 1e-3, 5e-3)):
        if gamma or load > 0:
            yield case("grain_limits", RESTITUTION, surface_energy_j_m2=gamma, load_n=load, restitution=0.15)
    for load in () if quick else (1.25, 4.0):
        yield case("grain_limits", RESTITUTION, surface_energy_j_m2=0.2, restitution=0.3, adhesion_load=load)
        yield case("grain_pull_off", RESTITUTION, restitution=0.3, adhesion_load=load)
    for e, aslant, gamma in product((0.15,) if quick else (0.05, 0.15, 0.9), (0.0, 35.0, 70.0), (0.0, 0.2)):
        yield case("grain_energy", RESTITUTION, restitution=e, aslant_deg=aslant, surface_energy_j_m2=gamma)
    for e, own, gamma in product((0.15,) if quick else (0.15, 0.6), (0.15,) if quick else (0.15, 0.6), (0.0, 0.2)):
        yield case("grain_and_wall", RESTITUTION, steel_restitution=e, restitution=own, surface_energy_j_m2=gamma)


def _case(check: str, contact_law: str, **values: float) -> dict:
    """A case of a check; each value goes to the group that declares it."""
    rig = rigs.rig(check)
    groups = {
        group: {name: value for name, value in values.items() if name in getattr(rig, group)}
        for group in ("parameters", "conditions", "numerics")
    }
    unknown = set(values) - {name for group in groups.values() for name in group}
    if unknown:
        raise ValueError(f"check {check} has no {', '.join(sorted(unknown))}")
    return rigs.case(check, contact_law=contact_law, **groups)


def _module(check: str) -> ModuleType:
    """The check's file, with its closed forms."""
    return importlib.import_module(f"yade_scripts.checks.{check}")


def table(rows: pd.DataFrame) -> pd.DataFrame:
    """What was requested and what was measured, a row an observable of a case.

    Where a law gives something else than what it is asked for and there is a closed form for that, a second row
    compares the measurement with it; its remark starts with "instead".

    Parameters
    ----------
    rows : of `dispatch.run(cases(), ...)`

    Returns
    -------
    Columns `check`, `contact_law`, `setting`, `requested`, `measured`, `difference` (measured less requested),
    `tolerance` (2 % of the request; 0.005 if that is more, for restitution and for requests of zero; or the check's own),
    `within`, and `remark`: why not, and by how much.
    """
    lines = []
    for row in rows.to_dict("records"):
        check = row["rig"]
        rig, module = rigs.rig(check), _module(check)
        case = {
            "contact_law": row["contact_law"],
            **{g: {name: row[name] for name in getattr(rig, g)} for g in ("parameters", "conditions", "numerics")},
        }
        setting = _setting(row, rig, module.SETTING)
        cannot = module.instead(case)
        for observable, requested in module.expected(case).items():
            measured = float(row[observable]) if row["status"] == "ok" else float("nan")
            own, reason = cannot.get(observable, (None, NO_REASON))
            compared = [(requested, "")] if own is None else [(requested, ""), (own, f"instead: {reason}")]
            for wanted, remark in compared:
                line = _line(wanted, measured, observable, getattr(module, "TOLERANCE", {}).get(observable))
                if row["status"] != "ok":
                    remark = row["status"]
                elif not line["within"]:
                    share = f" ({line['difference'] / wanted:+.1%})" if wanted else ""
                    remark = remark or f"cannot: {reason}"
                    remark += f"; off by {line['difference']:+.3g}{share}"
                what = f"{observable.removeprefix('measured_')} | {setting}"
                lines.append(
                    {"check": check, "contact_law": row["contact_law"], "setting": what, **line, "remark": remark}
                )
    return pd.DataFrame(lines, columns=COLUMNS)


def unexplained(checked: pd.DataFrame) -> pd.DataFrame:
    """Rows of `table` that are off for no reason the laws are known to have: failed, or not what the limit predicts."""
    known = checked["remark"].str.startswith("cannot: ") & ~checked["remark"].str.contains(NO_REASON)
    return checked[~checked["within"] & ~known]


def _setting(row: dict, rig: rigs.YadeRig, names: tuple[str, ...]) -> str:
    """What tells a case from others: the check's two leading names, the damping, and whatever is no default."""
    declared = rig.parameters | rig.conditions | rig.numerics
    damping = "cohesive_frictional_damping"
    shown = [name for name in names if name in names[:2] or row[name] != declared[name]["default"]]
    shown = [name for name in shown if name != damping]
    if damping in names and row["contact_law"] == COHESIVE:
        shown.append(damping)
    return ", ".join(f"{name} {row[name]:g}" for name in shown)


def _line(requested: float, measured: float, observable: str, own: tuple[float, float] | None = None) -> dict:
    """One comparison; `own` is the check's own tolerance, relative and absolute."""
    floor = ABSOLUTE_TOLERANCE if "restitution" in observable or requested == 0 else 0.0
    relative, floor = own or (RELATIVE_TOLERANCE, floor)
    tolerance = max(relative * abs(requested), floor)
    difference = measured - requested
    return {
        "requested": requested,
        "measured": measured,
        "difference": difference,
        "tolerance": tolerance,
        "within": bool(abs(difference) <= tolerance),
    }
