"""The paper's tables recomputed, with figures, as the files of one folder."""

from pathlib import Path

import numpy as np
import pandas as pd

from pellet_study.doe import figures, optimum, path_turning, steepest_climb
from pellet_study.files import writing
from pellet_study.output.style import new_axes, styled
from pellet_study.paper import designs
from pellet_study.paper.html import page
from pellet_study.paper.printed import table, tables
from pellet_study.paper.verdicts import Item

UNIT = "deg"
"""Unit of the paper's response, the repose angle."""


def write(folder: Path, items: list[Item]) -> list[Path]:
    """Write the audit, the recomputed tables and the figures; returns the paths.

    Parameters
    ----------
    folder : Path
        Made if it is not there; files of the same names are replaced.
    items : list of Item
        The audit.
    """
    frames = {"audit": pd.DataFrame([item.as_dict() for item in items]), **recomputed_tables()}
    paths = []
    for name, frame in frames.items():
        paths.append(folder / f"{name}.csv")
        writing.table(paths[-1], frame, float_format="%.8g")
    paths.append(folder / "audit.html")
    writing.text(paths[-1], page(items, "Audit of the source paper"))
    return paths + figures.save(drawn(), folder / "figures")


def recomputed_tables() -> dict[str, pd.DataFrame]:
    """{file name: table}: the designs as `pb` and `bbd` read them, the other tables recomputed."""
    screening, surface = designs.screening(), designs.surface()
    effects = pd.DataFrame(
        {
            "factor": list(screening.effects),
            "effect_deg": list(screening.effects.values()),
            "sum_of_squares_deg2": list(screening.sums_of_squares.values()),
            "contribution_percent": list(screening.contributions.values()),
            "p": list(screening.p.values()),
            "p_holm": list(screening.p_adjusted.values()),
        }
    )
    path, _ = climb()
    found = target()
    return {
        "table07_design": table(7).drop(columns="No."),
        "table08_effects": effects,
        "table09_anova": pd.DataFrame(screening.anova),
        "table10_climb": path.points.assign(predicted_angle_deg=path.predicted),
        "table12_design": table(12).drop(columns="No."),
        "table13_anova": pd.DataFrame(surface.anova),
        "equations": equations(),
        "optimum": pd.DataFrame(
            [
                {
                    "factor": e.name,
                    "lowest": min(e.physical),
                    "highest": max(e.physical),
                    "unidentified": e.unidentified,
                    "recommended": found.physical[e.name],
                    "published": tables()["text"]["optimum"][e.name],
                }
                for e in found.sheet_extents
            ]
        ),
    }


def equations() -> pd.DataFrame:
    """Coefficients of Eq. 1, 3 (physical) and 4 (coded, and in physical units under Table 11's coding)."""
    rows = []
    for number, equation in ((3, "1"), (5, "3")):
        for term, value in designs.bench_fit(number).coefficients.items():
            rows.append({"equation": equation, "term": term, "coded": None, "physical": value})
    surface = designs.surface()
    for term, value in surface.coefficients.items():
        physical = surface.physical_coefficients[term]
        rows.append({"equation": "4", "term": term, "coded": value, "physical": physical})
    return pd.DataFrame(rows)


def climb() -> tuple[steepest_climb.Climb, path_turning.Turning]:
    """The paper's path (Table 10), made from Table 7's fit, and where its printed errors turn."""
    model, factors = steepest_climb.first_order_model(designs.screening(), ["B", "C", "G"])
    path = steepest_climb.path(model, factors, points=6, equal_steps=True, start="worst")
    return path, path_turning.turning(table(10).drop(columns="No."), ascend=False, units=designs.UNITS)


def target() -> optimum.TargetSet:
    """The settings of Table 12's surface that meet the measured angle."""
    text = tables()["text"]
    angle, uncertainty = text["repose_angle_physical_deg"], text["repose_angle_physical_pm"]
    return optimum.target_set(designs.surface(), angle, uncertainty)


def drawn() -> dict:
    """{name: figure}."""
    screening, surface, found = designs.screening(), designs.surface(), target()
    return {
        "eq1_restitution": bench_curve(3, "restitution coefficient a1 (-)", "rebound height b1 (mm)", 8.01),
        "eq3_rolling_friction": bench_curve(5, "rolling friction coefficient a3 (-)", "rolling distance b3 (mm)", 69.2),
        "table08_pareto": figures.pareto(screening, UNIT),
        "table08_half_normal": figures.half_normal(screening.effects, screening.lenth, UNIT, screening.noise_contrasts),
        "table10_climb": figures.climb_path(climb()[0], UNIT, target=found.target),
        "table13_predicted_observed": figures.predicted_observed(surface, UNIT),
        "optimum_response_surface": figures.surface_contours(surface, found, UNIT),
    }


@styled
def bench_curve(number: int, xlabel: str, ylabel: str, measured: float):
    """The fit of Table 3 or 5 with the measured value it is solved for."""
    model = designs.bench_fit(number)
    x = model.coded[:, 0]
    line = np.linspace(x.min(), x.max(), 100)
    figure, axes = new_axes()
    axes.plot(x, model.response, "o", color=figures.DARK, label=f"simulated, Table {number}")
    axes.plot(line, model.predict(line[:, None]), color=figures.DARK, label="quadratic fit")
    axes.axhline(measured, color=figures.ACCENT, linestyle="--", label=f"measured {measured:g} mm")
    axes.set_xlabel(xlabel)
    axes.set_ylabel(ylabel)
    axes.legend()
    return figure
