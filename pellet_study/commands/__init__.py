"""One file a command: `add_arguments(parser)` declares it, `run(arguments)` does it and returns the JSON answer.

`run` prints the readable answer; `__main__` writes what it returns to the file that `--json` names.
A command's file is imported only when that command is called, so each pays for its own libraries alone.
"""

COMMANDS = {
    "doctor": "what is installed, which YADE, whether its contact laws pass their checks",
    "init": "make a study folder to start from",
    "bench": "calibrate the three seed bench tests: rebound, slope slip, inclined rolling",
    "pb": "analyse a Plackett-Burman table, climb from it, or make one",
    "bbd": "analyse a Box-Behnken or central composite table, meet a target, or make one",
    "audit": "recompute the printed numbers of the source paper",
}
