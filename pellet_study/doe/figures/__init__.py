"""Figures of the designs: effects, response surfaces, sections through them, residuals, a climb with its runs, the regions of several responses.

The look is that of `pellet_study.output.style`; matplotlib is imported when a figure is asked for.
"""

from pathlib import Path

from pellet_study.doe.figures.climbs import climb_path, path_runs
from pellet_study.doe.figures.contours import surface_3d, surface_contours
from pellet_study.doe.figures.effects import half_normal, pareto
from pellet_study.doe.figures.regions import overlaid_regions
from pellet_study.doe.figures.residuals import predicted_observed, residual_plots
from pellet_study.doe.figures.sections import interactions, observed_interactions, perturbation
from pellet_study.output import style

DARK, LIGHT, ACCENT = style.MODEL, style.LIGHT, style.MEASURED

__all__ = [
    "climb_path",
    "half_normal",
    "interactions",
    "observed_interactions",
    "overlaid_regions",
    "pareto",
    "path_runs",
    "perturbation",
    "predicted_observed",
    "residual_plots",
    "surface_3d",
    "surface_contours",
]


def save(figures: dict, folder: Path) -> list[Path]:
    """Write {name: figure} as files of one format without a date in them; returns the paths."""
    return style.save_all(figures, folder)
