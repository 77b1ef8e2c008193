"""Off Linux: what declares rigs is read all the same, though simulations on YADE need file locks that are not there.

Imported first. `yade_scripts.case` has the locks of a store beside the declarations of rigs; where the operating system has
none (Windows), it is imported without them, and a store refuses before it would call them (`files/locking.py`).
"""

import importlib
import sys
from types import ModuleType

LOCKS = "fcntl"


def _without_locks() -> None:
    before = [sys.modules[LOCKS]] if LOCKS in sys.modules else []
    sys.modules[LOCKS] = ModuleType(LOCKS)
    try:
        importlib.import_module("yade_scripts.case")
    finally:
        del sys.modules[LOCKS]
        if before:
            sys.modules[LOCKS] = before[0]


try:
    importlib.import_module(LOCKS)
except ImportError:
    _without_locks()
