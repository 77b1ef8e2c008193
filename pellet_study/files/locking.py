"""One at a time: an advisory lock on an open file or folder, held until it is released or its last holder ends."""

import errno
from collections.abc import Callable
from pathlib import Path

from pellet_study.errors import InputError

NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL}


def available() -> bool:
    """Whether this operating system has file locks (Windows has none)."""
    try:
        import fcntl
    except ImportError:
        return False
    return hasattr(fcntl, "flock")


def hold(descriptor: int, place: Path, wait: Callable[[], None]) -> None:
    """Lock an open descriptor (flock); `wait` is called once where another process has it.

    Raises
    ------
    InputError : the file system, or this operating system, has no locks
    """
    if not available():  # only what runs on YADE has several writers
        raise InputError(f"{place}: simulations on YADE need Linux; this operating system has no file locks")
    import fcntl

    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            wait()
            fcntl.flock(descriptor, fcntl.LOCK_EX)
    except OSError as error:
        if error.errno not in NO_LOCKS:
            raise
        raise InputError(
            f"{place}: its file system has no locks ({error.strerror}), so that two commands could write there at once; "
            "put the study on a disk that has locks, as a local one"
        ) from None


def release(descriptor: int) -> None:
    """Let go of a lock, also for processes that share the descriptor and outlive their work."""
    import fcntl

    fcntl.flock(descriptor, fcntl.LOCK_UN)
