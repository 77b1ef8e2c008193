"""Physical effects a model may lack, one file each.

Both Pythons read these files, so they import only the standard library and numpy at the top.

A file declares `EFFECT` and says what the effect does: `CLOSED_FORM` maps a closed-form rig to the function that acts
in it, `SEED_SCENE` maps a place in the scene of the YADE bench rigs to the function that acts there (the places are
listed in yade_scripts/acting.py), `POWDER_SCENE` likewise in the scene of the repose rig
(yade_scripts/powder_scene.py). `parameters_in` names a rig in which the amount is another quantity. The first of an effect's parameters is its amount, which has a value that means
absent; further ones give its shape. `owns` names parameters of rigs that mean nothing without the effect. `physical` is the range published or reasoned for real materials; `min` and `max`
is what a fit may take.

An effect of the package is its one file: a rig on YADE finds by `acting_in` the effects that name it and have its scene.
Those that share a place act in the order of their `TURN`.
"""

from importlib import import_module
from pathlib import Path
from types import ModuleType

LAST = 1000  # turn of an effect that names none


def acting_in(rig: str, scene: str) -> tuple[ModuleType, ...]:
    """The package's effects that name a rig and act in its scene, "SEED_SCENE" or "POWDER_SCENE", in their turn."""
    files = [file.stem for file in sorted(Path(__file__).parent.glob("*.py")) if file.stem != "__init__"]
    effects = [import_module(f"{__name__}.{stem}") for stem in files]
    there = [effect for effect in effects if rig in effect.EFFECT["rigs"] and hasattr(effect, scene)]
    return tuple(sorted(there, key=lambda effect: getattr(effect, "TURN", LAST)))
