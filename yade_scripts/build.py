"""What a YADE build lacks of what the contact laws use, and what that costs.

yade -x -n yade_scripts/build.py lacks.json
"""

import json
import sys
from pathlib import Path

COSTS = {
    "a second Mindlin functor (PartialSatMat)": "hertz_mindlin heaps set each new contact in Python, 1.4 times the time of a step",
    "cohesive bonds that break (CohFrictPhys.unpMax = 0)": "cohesive_frictional heaps with surface energy set each new contact "
    "in Python, 1.4 times the time of a step; none without surface energy",
}


def lacks() -> dict[str, str]:
    """{what this YADE does not have: what it costs}; to be asked inside YADE."""
    import yade

    there = (hasattr(yade, "PartialSatMat"), yade.CohFrictPhys().unpMax >= 0)
    return {what: cost for (what, cost), has in zip(COSTS.items(), there, strict=True) if not has}


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(json.dumps(lacks()))
