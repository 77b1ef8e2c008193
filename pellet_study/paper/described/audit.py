"""The audit of a described paper: every printed number recomputed from its printed runs."""

from dataclasses import dataclass
from pathlib import Path

from pellet_study.doe.optimum import TargetSet
from pellet_study.errors import InputError
from pellet_study.paper.described.analyses import Fit, fitted, read_table
from pellet_study.paper.described.claims import claim
from pellet_study.paper.described.climbs import climb
from pellet_study.paper.described.description import FILE, Analysis, Description
from pellet_study.paper.described.goal import goal
from pellet_study.paper.described.printed_numbers import design, printed_numbers
from pellet_study.paper.described.reading import read_description
from pellet_study.paper.verdicts import Item, printed_number


@dataclass(frozen=True)
class PaperAudit:
    """The items of a paper, its fits by the names of their analyses, and the settings that meet its target."""

    paper: Description
    items: list[Item]
    fits: dict[str, Fit]
    target: TargetSet | None


def audit_folder(folder: Path) -> PaperAudit:
    """The audit of the paper that a folder describes.

    Raises
    ------
    InputError
        Naming file and key where the description cannot be used.
    """
    paper = read_description(Path(folder))
    items, fits = [], {}
    for analysis in paper.analyses:
        table, fits[analysis.name] = _fit(analysis)
        items += design(analysis, table)
        items += printed_numbers(analysis, table, fits[analysis.name])
        said = [one for one in paper.claims if one.analysis == analysis.name]
        items += [claim(one, fits[analysis.name], str(paper.folder / FILE)) for one in said]
    for path in paper.climbs:
        items += climb(path, fits[path.analysis], *_wanted(paper))
    more, found = goal(paper, fits)
    return PaperAudit(paper, items + more, fits, found)


def _wanted(paper: Description) -> tuple[float | None, bool]:
    """The response wanted, and whether it is the lowest where there is no number."""
    if paper.goal is None or paper.goal.value is None:
        return None, paper.goal is not None and paper.goal.want == "minimum"
    return printed_number(paper.goal.value), False


def _fit(analysis: Analysis):
    """Runs and fit; what the table lacks is said with the place of its analysis in the description."""
    place = f"{analysis.table.parent / FILE}, [[analysis]] ({analysis.name}): "
    try:
        table = read_table(analysis)
        fit = fitted(analysis, table)
    except InputError as error:
        raise InputError(place + str(error)) from None
    levels = {level for block in table.blocks for level in block.levels}
    if analysis.intercept_in_block is not None and analysis.intercept_in_block not in levels:
        raise InputError(
            f"{place}key 'intercept_in_block': expected one of the blocks {', '.join(sorted(levels)) or '(none is named)'}; "
            f"found {analysis.intercept_in_block!r}"
        )
    return table, fit
