"""Physical effects a model may lack, one file each.

Both Pythons read these files, so they import only the standard library and numpy at the top.

A file declares `EFFECT` and says what the effect does: `CLOSED_FORM` maps a closed-form rig to the function that acts
in it, `SEED_SCENE` maps a place in the scene of the YADE bench rigs to the function that acts there (the places are
listed in yade_scripts/acting.py), `POWDER_SCENE` likewise in the scene of the repose rig
(yade_scripts/powder_scene.py). `parameters_in` names a rig in which the amount is another quantity. The first of an effect's parameters is its amount, which has a value that means
absent; further ones give its shape. `physical` is the range published or reasoned for real materials; `min` and `max`
is what a fit may take.
"""
