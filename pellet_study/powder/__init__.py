"""The powder calibration of the source paper: screening, climb, surface, optimum and validation of a repose angle.

plan < heaps < decisions, box, tables, validation < text < chain < few_heaps, figures < report
"""
