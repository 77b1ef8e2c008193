"""The contact laws against closed forms: the table of what was asked and what was measured."""

import importlib
from types import ModuleType

import pandas as pd

from pellet_study.rigs.declared import Rig
from pellet_study.rigs.on_yade import rig as rig_of
from pellet_study.simulation.law_cases import LOCAL_DAMPING

RELATIVE_TOLERANCE = 0.02
ABSOLUTE_TOLERANCE = 0.005  # of restitution, and of whatever is asked to be zero
COLUMNS = ["check", "contact_law", "setting", "requested", "measured", "difference", "tolerance", "within", "remark"]

NO_REASON = "no limit of the law is known that explains this"


def _module(check: str) -> ModuleType:
    """The check's file, with its closed forms."""
    return importlib.import_module(f"yade_scripts.checks.{check}")


def table(rows: pd.DataFrame) -> pd.DataFrame:
    """What was requested and what was measured, a row an observable of a case.

    Where a law gives something else than what it is asked for and there is a closed form for that, a second row
    compares the measurement with it; its remark starts with "instead".

    Parameters
    ----------
    rows : of `dispatch.run(law_cases.cases(), ...)`

    Returns
    -------
    Columns `check`, `contact_law`, `setting`, `requested`, `measured`, `difference` (measured less requested),
    `tolerance` (2 % of the request; 0.005 if that is more, for restitution and for requests of zero), `within`, and
    `remark`: why not, and by how much.
    """
    lines = []
    for row in rows.to_dict("records"):
        check = row["rig"]
        rig, module = rig_of(check), _module(check)
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


def _setting(row: dict, rig: Rig, names: tuple[str, ...]) -> str:
    """What tells a case from others: the check's two leading names, the damping, and whatever is no default."""
    declared = {**rig.parameters, **rig.conditions, **rig.numerics}
    damping = "cohesive_frictional_damping"
    shown = [name for name in names if name in names[:2] or row[name] != declared[name]["default"]]
    shown = [name for name in shown if name != damping]
    if damping in names and row["contact_law"] == LOCAL_DAMPING:
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
