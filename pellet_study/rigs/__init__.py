"""Rigs and effects by name, from what their files declare, and complete cases for those that run on YADE.

    elsewhere, scripts < declared < known < declarations < catalogue < on_yade, closed_form/layer_on_incline, closed_form/shear_cell

It hands on the package's rigs by name and their cases, and the catalogue that a study adds its own to.
"""

from pellet_study.rigs import elsewhere as elsewhere  # isort: skip  # before what it prepares
from pellet_study.rigs.catalogue import Catalogue, standard
from pellet_study.rigs.declared import Acting, Effect, Rig
from pellet_study.rigs.on_yade import case, rig

__all__ = ["Acting", "Catalogue", "Effect", "Rig", "case", "rig", "standard"]
