"""Model criticism: does the model fit, where does it fail, which absent effect would explain it, what to measure next.

verdicts, scatter, ways < cell_means < used_sd, outlying, least_squares < starts < calibration < lack_of_fit, score_tests < constancy, intervals
< residuals < spread, time_drift < grades, holdout < entries, likely_unit, reading_order < bounds < compare < signatures < rivals
< explanations, ranking, possible, predictions, outcomes < near_misses, next_measurement < diagnose < by_level, noise, suspicious
< robustness < refine, facts, understood, curves < fit_facts < answers, verdict_facts < text
< figures/readings < figures/errors, figures/explanations
"""

from pellet_study.criticism.calibration import CalibratedStudy, fit_study
from pellet_study.criticism.cell_means import CellMeans
from pellet_study.criticism.compare import Comparison
from pellet_study.criticism.diagnose import Diagnosis
from pellet_study.criticism.next_measurement import NextMeasurement
from pellet_study.criticism.refine import Refinement
from pellet_study.criticism.verdicts import Note, Verdict

__all__ = [
    "CalibratedStudy",
    "CellMeans",
    "Comparison",
    "Diagnosis",
    "NextMeasurement",
    "Note",
    "Refinement",
    "Verdict",
    "fit_study",
]
