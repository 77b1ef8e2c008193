"""The source paper's powder calibration on the repose rig: screening, climb, surface, optimum, validation.

Each stage is a function of the plan and of the decisions before it, which stand in files; so a stage can be stopped
after, resumed, or done again by itself. Each decision says for which plan it was made, and is used for no other. Heaps
that gave no angle (an arch, a blow-up) are left out and counted.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from pellet_study.doe import plackett_burman
from pellet_study.doe.optimum import TargetSet
from pellet_study.powder.climb import climb
from pellet_study.powder.decisions import STAGES, Decision
from pellet_study.powder.heaps import Heaps
from pellet_study.powder.identified import Identified
from pellet_study.powder.results import Results
from pellet_study.powder.screening import screen
from pellet_study.powder.surface import meet_target, surface
from pellet_study.powder.text import summary
from pellet_study.powder.validation import validate


@dataclass
class Chain:
    """The stages of one plan: its heaps, its folder of results.

    `after` gets the results when a stage is done. `screened`, `targeted` and `identified` are the analyses of the last call
    of `run`, for its figures; None where that stage was not done in it.
    """

    heaps: Heaps
    results: Results
    after: Callable[[Results], object] = lambda results: None
    screened: plackett_burman.Screening | None = field(default=None, init=False)
    targeted: TargetSet | None = field(default=None, init=False)
    identified: Identified | None = field(default=None, init=False)

    def run(self, stages: Sequence[str] = STAGES) -> dict[str, Decision]:
        """The stages named, in the paper's order; {stage: decision} of those done so far.

        Raises
        ------
        InputError : a stage before them was not run, or something in the folders is of another plan, law or margin
        SimulationError : too few heaps of a stage gave an angle
        """
        self.results.check()
        for before, stage in pairwise(STAGES):
            if stage in stages and before not in stages:
                self.results.decision(before)  # refuses where there is none
        say = self.heaps.say
        for remark in self.heaps.plan.remarks:
            say(remark)
        for stage in STAGES:
            if stage in stages:
                say(f"{stage} ...")
                decision = self.stage(stage)
                say(f"  {stage}: {summary(decision)}")
                self.results.gather()
                self.after(self.results)
        return self.results.decisions()

    def stage(self, stage: str) -> Decision:
        """Do one stage."""
        match stage:
            case "screening":
                screening, self.screened = screen(self.heaps, self.results)
                return screening
            case "climb":
                return climb(self.heaps, self.results)
            case "surface":
                return surface(self.heaps, self.results)
            case "optimum":
                optimum, self.targeted, self.identified = meet_target(self.heaps.plan, self.results)
                return optimum
            case "validation":
                return validate(self.heaps, self.results)
        raise ValueError(f"{stage!r}: expected one of {', '.join(STAGES)}")
