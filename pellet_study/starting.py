"""Ctrl-C ends the program with 130 and one sentence whenever it comes: in imports, in the midst of work, at the end.

Imported first. Until `attend` an interrupt ends the program at once, as nothing is held yet; from then on it is an
exception, as ever; after `ignore` it changes nothing. A program that merely imports the package is let alone.
"""

import _thread
import os
import signal
import sys
import threading
from typing import NoReturn

INTERRUPTED = 130
WORDS = "interrupted; what was finished is kept, and the same command goes on"
AGAIN_S = 0.05
_asked = False  # whether it came: a library may have made another exception of it


def _end(*_: object) -> NoReturn:
    os.write(2, f"pellet-study: {WORDS}\n".encode())
    os._exit(INTERRUPTED)


def _interrupt(*_: object) -> NoReturn:
    global _asked
    _asked = True
    raise KeyboardInterrupt


def _again(lost: "sys.UnraisableHookArgs") -> None:
    """An interrupt that fell into a callback, from where none is passed on, comes again when that has ended."""
    if lost.exc_type is KeyboardInterrupt:
        later = threading.Timer(AGAIN_S, _thread.interrupt_main)
        later.daemon = True
        later.start()
    else:
        sys.__unraisablehook__(lost)


_program = sys.argv[:1] == ["-m"] or os.path.basename(sys.argv[0] if sys.argv else "").startswith("pellet-study")
_program = _program and signal.getsignal(signal.SIGINT) is signal.default_int_handler
if _program:
    signal.signal(signal.SIGINT, _end)


def attend() -> None:
    """Take interrupts as exceptions."""
    if _program:
        sys.unraisablehook = _again
        signal.signal(signal.SIGINT, _interrupt)


def ignore() -> None:
    """All is said: an interrupt comes too late."""
    if _program:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def interrupted(error: BaseException) -> bool:
    """Whether an exception is, or came of, an interrupt."""
    return _asked or isinstance(error, KeyboardInterrupt)


def leave() -> int:
    """Exit status of an interrupted program; it ends here, as Python would go by SIGINT where code made of text was interrupted."""
    if _program:
        for stream in (sys.stdout, sys.stderr):
            try:
                stream.flush()
            except OSError:
                pass  # it was closed, or nobody reads it
        os._exit(INTERRUPTED)
    return INTERRUPTED
