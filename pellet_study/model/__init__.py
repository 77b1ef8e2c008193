"""Predictions for the rows of a study: a closed form, or a surrogate fitted to simulations.

engine, response_surface < closed_form, sites < means < surrogate < model
"""
