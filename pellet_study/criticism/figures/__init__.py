"""Figures of model criticism, drawn from the answers a study folder keeps (compare.json, diagnose.json, history.json).

An effect has the same colour in all of them where each is given `effects`, the names of all that act in the study's rigs.
"""

from pellet_study.criticism.figures.errors import ladder, predictions, residuals, tied_errors
from pellet_study.criticism.figures.explanations import constants, next_measurement, ranking
from pellet_study.criticism.figures.readings import readings

__all__ = [
    "constants",
    "ladder",
    "next_measurement",
    "predictions",
    "ranking",
    "readings",
    "residuals",
    "tied_errors",
]
