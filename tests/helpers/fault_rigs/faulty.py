"""A stand-in for a rig, for tests of the driver: runs in YADE, simulates nothing, and fails in the way it is told to."""

import ctypes
import errno
import os
import signal
import subprocess
import time
from pathlib import Path

from yade_scripts.case import Failed, quantity

RIG = {
    "name": "faulty",
    "contact_laws": ("hertz_mindlin",),
    "parameters": {},
    "conditions": {
        "fault": quantity(
            0,
            0,
            200,
            "1",
            "0 none, 1 abort, 2 hang, 3 not a number, 4 exception, 5 refused, 6 exit status 3, 7 exit status 0, 8 no reason, "
            "9 misnamed, 10 bad address, 11 killed, 12 killed once, 13 memory, 14 full disk, 15 hang outside Python, "
            "100 + n ended by signal n, 200 a grandchild that survives",
        ),
        "pause_s": quantity(0, 0, 60, "s", "time the case takes"),
    },
    "effects": {},
    "numerics": {},
    "observables": {"answer": "three times the seed"},
    "random": False,
    "time_limit_s": 2.0,
}


def simulate(case: dict) -> dict:
    """Three times the seed, or a fault."""
    fault = case["conditions"]["fault"]
    time.sleep(case["conditions"]["pause_s"])
    if fault == 1:
        os.write(2, b"these are the last words\n")
        os.abort()
    if fault == 2:
        while True:
            time.sleep(1)
    if fault == 4:
        raise ZeroDivisionError("an exception in the rig")
    if fault == 5:
        raise Failed("the rig's own check refused it")
    if fault == 6:
        os._exit(3)
    if fault == 7:
        raise SystemExit(0)
    if fault == 8:
        raise Failed
    if fault == 10:
        ctypes.string_at(0)
    if fault == 11:
        os.kill(os.getpid(), signal.SIGKILL)
    if fault == 12 and not Path(os.environ["FAULTY_MARK"]).exists():
        Path(os.environ["FAULTY_MARK"]).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    if fault == 13:
        bytearray(1 << 60)
    if fault == 14:
        raise OSError(errno.ENOSPC, "No space left on device")
    if fault == 15:
        ctypes.PyDLL(None).sleep(3600)  # holds Python's lock, as a simulation does that never returns to it
    if 100 < fault < 200:
        os.kill(os.getpid(), int(fault) - 100)
        time.sleep(60)
    if fault == 200:
        subprocess.Popen(["sleep", "300"], start_new_session=True, close_fds=False)
    if fault == 9:
        return {"answr": 1.0}
    return {"answer": float("nan") if fault == 3 else 3.0 * case["seed"]}
