"""One file a command: `add_arguments(parser)` declares it, `run(arguments)` does it and returns the JSON answer.

`run` prints the readable answer; `__main__` writes what it returns to the file that `--json` names.
A command's file is imported only when that command is called, so each pays for its own libraries alone.

    numbers, simulating < arguments, responses < design_tables < other_command, surface, wanted < validating < following < add, angle, audit, bbd, bench, calibrate, challenge, check,
    compare, design, diagnose, doctor, drop, history, init, pb, refine, report
"""

COMMANDS = {
    "doctor": "what is installed, which YADE, whether its contact laws pass their checks",
    "init": "make a study folder to start from",
    "check": "what was understood of a study and what its rows could show, without a simulation",
    "bench": "calibrate the three seed bench tests: rebound, slope slip, inclined rolling",
    "calibrate": "the paper's powder calibration: screening, climb, surface, optimum, validation of the repose angle",
    "pb": "analyse a Plackett-Burman table, climb from it, or make one",
    "bbd": "analyse a Box-Behnken or central composite table, meet a target, or make one",
    "design": "judge a design, extend or mend it: power, score, fold-over, axial points, lost runs",
    "compare": "calibrate the present model of a study, say how well it fits and where it fails",
    "diagnose": "rank the physical effects a study's model lacks",
    "add": "add an effect to a study and recalibrate",
    "drop": "take an effect out of a study and recalibrate",
    "refine": "compare, diagnose, add, again, until the measurements are explained",
    "history": "the error falling step by step",
    "angle": "the repose angle of a heap from photographs",
    "report": "one self-contained HTML page about a study",
    "challenge": "hidden-effect trials: is the effect that was hidden the one that is named?",
    "audit": "recompute the printed numbers of the source paper, or of a paper that a folder describes",
}

SIMULATING = ("doctor", "bench", "calibrate", "compare", "diagnose", "add", "drop", "refine", "challenge")
"""Commands that may simulate, and take --scheduler, --time-limit and --workers."""

EDITING = ("add", "drop", "refine")
"""Commands that edit study.toml and the history: one at a time on a study."""
