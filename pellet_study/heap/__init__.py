"""Heaps seen: the repose angle in a photograph, and pictures of simulated grains.

    pixels, plate < segmentation, doubts < photograph, render < report

`measure(file)` gives the angle of a photograph, `read_grains` and `picture` show simulated heaps.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pellet_study.heap.photograph import Photograph, measure
    from pellet_study.heap.render import picture, profile, read_grains

__all__ = ["Photograph", "measure", "picture", "profile", "read_grains"]
_HOMES = {
    "Photograph": "photograph", "measure": "photograph",
    "picture": "render", "profile": "render", "read_grains": "render",
}  # fmt: skip


def __getattr__(name: str) -> Any:
    """The names handed on, imported when they are asked for: pictures of grains need pandas."""
    if name in _HOMES:
        return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
