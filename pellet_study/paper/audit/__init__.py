"""The audit of the source paper: every printed number recomputed from the printed rows.

Printed values come from tables.json, recomputed ones and reasons from the fits. One module a part of the
paper, one function a table or claim, each returning its items in the order they are printed.
"""

from pellet_study.paper.audit.bench import bench_test, missing_test
from pellet_study.paper.audit.climb import climb
from pellet_study.paper.audit.optimum import optimum
from pellet_study.paper.audit.screening import effects, screening_anova, screening_design
from pellet_study.paper.audit.surface import equation_four, goodness_of_fit, surface_anova, surface_design
from pellet_study.paper.audit.verification import time_step, verification
from pellet_study.paper.verdicts import Item, counts

__all__ = ["audit", "counts"]


def audit() -> list[Item]:
    """All items, in the order of the paper."""
    sections = [bench_test("3", "1"), missing_test(), bench_test("5", "3")]
    sections += [screening_design(), effects(), screening_anova(), climb()]
    sections += [surface_design(), surface_anova(), equation_four(), goodness_of_fit()]
    sections += [optimum(), verification(), time_step()]
    return [item for section in sections for item in section]
