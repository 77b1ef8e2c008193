"""The powder calibration of the source paper: screening, climb, surface, optimum and validation of a repose angle.

`from_study.plan_of(study)` says what a study asks for, `Chain` does it:

    plan < from_study, heaps, box < decisions < text, tables, results < responses < posterior < gains < identified
    < screening, climb, surface, uphill < validation, path_line
    < chain, few_heaps, figures < report
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pellet_study.powder.chain import Chain
    from pellet_study.powder.from_study import plan_of
    from pellet_study.powder.heaps import Heaps
    from pellet_study.powder.plan import Plan
    from pellet_study.powder.results import Results

__all__ = ["Chain", "Heaps", "Plan", "Results", "plan_of"]
_HOMES = {"Chain": "chain", "Heaps": "heaps", "Plan": "plan", "Results": "results", "plan_of": "from_study"}


def __getattr__(name: str) -> Any:
    """The names handed on, imported when they are asked for: most of them need pandas."""
    if name in _HOMES:
        return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
