"""The bench calibration of the source paper: rebound, slope slip and inclined rolling of a seed, stage by stage.

parabola < chain < sensitivity, figures < report
"""
