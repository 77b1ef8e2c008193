"""Rigs that are formulas: a file each, with the declaration `RIG` and `predict(parameters, conditions, effects)`.

`parameters` maps names to arrays that broadcast against the conditions (points down, rows across); `effects` maps the
name of each effect that is present to (act, values). `predict` returns {observable: array}.
"""
