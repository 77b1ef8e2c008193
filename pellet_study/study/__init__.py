"""A study folder: study.toml, its measurements, effects and rigs of the user's own, and what is remembered of it.

    units < ranges < measurements, jumps < spreads < conditions, continuity, misplaced < scene_trials < checked_code < user_code < study < values < load, edit, history, starting
    < measured

It hands on what a study is and how one is read.
"""

from pellet_study.study.load import load
from pellet_study.study.measurements import Measurement
from pellet_study.study.study import Setting, Study

__all__ = ["Measurement", "Setting", "Study", "load"]
