"""Calibrate discrete element models of seeds and powders on YADE, and learn which physical effect they lack.

    import pellet_study as ps

    study = ps.load_study("results/wet_beads")
    answer = ps.refine(study)
    print(answer)                    # the page that `pellet-study refine` prints
    print(answer.verdict, answer.added)     # adequate ['cohesion']
    answer.frame()                   # the error falling step by step, as a data frame

Names are loaded when they are first used.
"""

from pellet_study import starting as starting  # isort: skip  # before anything that takes time
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

try:
    __version__ = version("pellet-study")
except PackageNotFoundError:  # imported from a source tree that was never installed
    __version__ = "0+source"

if TYPE_CHECKING:  # what is handed on; at run time `__getattr__` loads a name when it is first used
    from pellet_study import doe
    from pellet_study.api.answers import Check, Comparison, Diagnosis, Refinement
    from pellet_study.api.criticism import add, compare, diagnose, drop, next_measurement, refine
    from pellet_study.api.figures import draw
    from pellet_study.api.simulation import calibrate, simulate
    from pellet_study.api.studies import check_study, load_study, study_of
    from pellet_study.errors import InputError, SimulationError, StudyError
    from pellet_study.model.model import Model
    from pellet_study.rigs.on_yade import case
    from pellet_study.study.measurements import Measurement
    from pellet_study.study.study import Setting, Study

__all__ = [
    "Check",
    "Comparison",
    "Diagnosis",
    "InputError",
    "Measurement",
    "Model",
    "Refinement",
    "Setting",
    "SimulationError",
    "Study",
    "StudyError",
    "add",
    "calibrate",
    "case",
    "check_study",
    "compare",
    "diagnose",
    "doe",
    "draw",
    "drop",
    "load_study",
    "next_measurement",
    "refine",
    "simulate",
    "study_of",
]

_ROOMS = {
    "api.answers": ("Check", "Comparison", "Diagnosis", "Refinement"),
    "api.criticism": ("add", "compare", "diagnose", "drop", "next_measurement", "refine"),
    "api.figures": ("draw",),
    "api.simulation": ("calibrate", "simulate"),
    "api.studies": ("check_study", "load_study", "study_of"),
    "errors": ("InputError", "SimulationError", "StudyError"),
    "model.model": ("Model",),
    "rigs.on_yade": ("case",),
    "study.measurements": ("Measurement",),
    "study.study": ("Setting", "Study"),
}
_HOME = {name: room for room, names in _ROOMS.items() for name in names}


def __getattr__(name: str) -> Any:
    if name == "doe":
        return import_module("pellet_study.doe")
    if name not in _HOME:
        raise AttributeError(f"module 'pellet_study' has no attribute {name!r}")
    return getattr(import_module(f"pellet_study.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
