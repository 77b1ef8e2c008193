"""Rigs and effects by name, from what their files declare, and complete cases for those that run on YADE.

catalogue, on_yade, closed_form/layer_on_incline, closed_form/shear_cell
"""

from pellet_study.rigs.on_yade import case, rig

__all__ = ["case", "rig"]
