"""Predictions for the rows of a study: a closed form, or a surrogate fitted to simulations.

    engine, terms < closed_form, response_surface, sites < effect_surface, means, surfaces < surrogate < model

It hands on the model and what it predicts for.
"""

from pellet_study.model.model import Case, Model, Prediction

__all__ = ["Case", "Model", "Prediction"]
