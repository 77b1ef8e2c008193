"""The bench calibration of the source paper: rebound, slope slip and inclined rolling of a seed, stage by stage.

`readings(rows)` says what was measured, `calibrate(Seeds(...), readings)` does it:

    stages, parabola < readings < seeds < chain, printed < sensitivity, figures, text < report
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pellet_study.bench.chain import BenchResult, calibrate
    from pellet_study.bench.seeds import Seeds

__all__ = ["BenchResult", "Seeds", "calibrate"]
_HOMES = {"BenchResult": "chain", "Seeds": "seeds", "calibrate": "chain"}


def __getattr__(name: str) -> Any:
    """The names handed on, imported when they are asked for: they need pandas."""
    if name in _HOMES:
        return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
