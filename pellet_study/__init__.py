"""Calibrate discrete element models of seeds and powders on YADE, and learn which physical effect they lack."""

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("pellet-study")
except PackageNotFoundError:  # imported from a source tree that was never installed
    __version__ = "0+source"
