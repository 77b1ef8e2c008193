"""Ctrl-C while the program is still importing ends it as one later does, without a traceback.

Imported first. From `attend` on an interrupt is an exception, as ever. A program that merely imports the package is let alone.
"""

import os
import signal
import sys
from typing import NoReturn

INTERRUPTED = 130
WORDS = "interrupted; what was finished is kept"


def _end(*_: object) -> NoReturn:
    os.write(2, f"pellet-study: {WORDS}\n".encode())
    os._exit(INTERRUPTED)


_program = sys.argv[:1] == ["-m"] or os.path.basename(sys.argv[0] if sys.argv else "").startswith("pellet-study")
if _program and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, _end)


def attend() -> None:
    """Take interrupts as exceptions again."""
    if signal.getsignal(signal.SIGINT) is _end:
        signal.signal(signal.SIGINT, signal.default_int_handler)
