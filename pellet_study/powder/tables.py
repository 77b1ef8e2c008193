"""Tables of the powder calibration."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from pellet_study.doe import box_behnken, plackett_burman
from pellet_study.doe.design_table import DesignTable, code_design
from pellet_study.doe.factors import Factor
from pellet_study.doe.linear_model import LinearFit
from pellet_study.errors import InputError
from pellet_study.paper import printed as paper
from pellet_study.powder.decisions import Surface
from pellet_study.powder.plan import OBSERVABLE, OTHER_READINGS, SYMBOLS, Plan

ANGLE = "repose angle"


def table_of(runs: pd.DataFrame, factors: list[Factor]) -> DesignTable:
    """The runs as a design table in the factors given, the angle under the name that figures show."""
    frame = runs[[f.name for f in factors] + [OBSERVABLE]].reset_index(drop=True)
    return code_design(frame.rename(columns={OBSERVABLE: ANGLE}), factors, source="runs.csv")


def surface_of(runs: pd.DataFrame, decision: Surface, units: Mapping[str, str]) -> box_behnken.Surface:
    """The Box-Behnken surface of the box that a decision chose, of the runs there that gave an angle."""
    chosen = runs["box"].max() if decision.chosen_box is None else decision.chosen_box
    there = runs[(runs["box"] == chosen) & (runs["verdict"] == "ok")]
    factors = [Factor(name, low, high, units.get(name, "-")) for name, (low, high) in decision.box.items()]
    return box_behnken.analyse(table_of(there, factors))


def scatter(runs: pd.DataFrame) -> float | None:
    """Standard deviation over seeds of the heaps at one point, pooled over the points that have several, deg."""
    names = [name for name in SYMBOLS if name in runs]
    groups = [g[OBSERVABLE] for _, g in runs.groupby(names) if len(g) > 1]
    freedom = sum(len(g) - 1 for g in groups)
    return float(np.sqrt(sum((len(g) - 1) * g.var(ddof=1) for g in groups) / freedom)) if groups else None


def errors_of(model: LinearFit) -> dict[str, float]:
    """Standard errors of the terms; all are known where more heaps gave an angle than there are terms."""
    return {term: error for term, error in model.standard_errors.items() if error is not None}


def effects_table(plan: Plan, found: plackett_burman.Screening, errors: Mapping[str, float]) -> pd.DataFrame:
    """Our effects with their standard errors beside the paper's Table 8, sign by sign."""
    printed = {name: float(cells["Stdized effects"]) for name, cells in paper.printed_cells(8).items()}
    rows = []
    for name, effect in found.effects.items():
        clear = abs(effect) > 2 * errors[name]
        note = plan.idle.get(name, "")
        sign = "as the paper" if np.sign(effect) == np.sign(printed[name]) else "opposite"
        if note:
            sign = "not represented"
        elif not clear:
            sign = "not clear"
        rows.append(
            {
                "factor": name,
                "effect_deg": effect,
                "standard_error_deg": errors[name],
                "p": found.p[name],
                "beyond_two_errors": clear,
                "paper_effect_deg": printed[name],
                "sign": sign,
                "note": note,
            }
        )
    return pd.DataFrame(rows)


def readings_table(runs: pd.DataFrame, factors: list[Factor], measured: str, least: int) -> pd.DataFrame:
    """Effects by each reading of the same heaps, in its unit: what each tells, and how far that is a matter of how a heap is read.

    `measured` is the reading that stands under the name of the angle. A row a reading and factor, with the scatter of that
    reading between heaps at one point. Left out are a reading that fewer than `least` heaps have, or heaps that do not
    separate the factors, and one that equals the measured one.
    """
    rows = []
    others = (name for name in OTHER_READINGS if name != measured and not runs[name].equals(runs[OBSERVABLE]))
    for reading in (measured, *others):
        read = runs if reading == measured else runs.assign(**{OBSERVABLE: runs[reading]})
        read = read[read[OBSERVABLE].notna()]
        if len(read) < least:
            continue
        try:
            found = plackett_burman.analyse(table_of(read, factors), interactions=False)
        except InputError:  # the heaps that have it do not separate the factors
            continue
        errors = errors_of(found.model)
        rows += [
            {
                "reading": reading,
                "factor": name,
                "effect": effect,
                "standard_error": 2 * errors[name],
                "scatter": scatter(read),
                "heaps": len(read),
            }
            for name, effect in found.effects.items()
        ]
    return pd.DataFrame(rows)


def coefficients_table(found: box_behnken.Surface) -> pd.DataFrame:
    """Our coefficients in coded units with standard errors, beside the paper's equation 4 where it has the term."""
    printed = paper.tables()["equations"]["4"]
    theirs = dict(zip(printed["terms"], printed["coefs"], strict=True))
    errors = errors_of(found.model)
    return pd.DataFrame(
        [
            {
                "term": term,
                "coefficient_deg": value,
                "standard_error_deg": errors[term],
                "beyond_two_errors": abs(value) > 2 * errors[term],
                "paper_coefficient_deg": theirs.get(term),
            }
            for term, value in found.model.coefficients.items()
        ]
    )
