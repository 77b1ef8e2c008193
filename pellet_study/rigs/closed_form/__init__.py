"""Rigs that are formulas: a file each, with the declaration `RIG` and `predict(parameters, conditions, effects)`.

`parameters` maps names to arrays that broadcast against the conditions (points down, rows across); `effects` maps the
name of each effect that is present to (act, values). A condition that is a word out of a list is an array of words.
`predict` returns {observable: array}.
"""
