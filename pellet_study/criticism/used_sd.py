"""Which standard deviation of a reading each row was fitted with, and why that one."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pellet_study.criticism.cell_means import cells_of
from pellet_study.criticism.scatter import EQUAL, GroupSd, readings_of, sd_of_group
from pellet_study.study.measurements import Measurement

AS_STATED = "as stated"
ROUNDING = 5e-3  # share by which a standard deviation may differ from the stated one and count as that


class UsedSd(NamedTuple):
    """A row's standard deviation of one reading as it is used, None where nothing tells it, and why."""

    sd: float | None
    why: str


def used_sds(rows: Sequence[Measurement]) -> list[UsedSd]:
    """What each row was fitted with; a row held out has what the rows fitted of its rig and observable make of its own."""
    found: dict[int, UsedSd] = {}
    groups: dict[tuple[str, str], tuple[GroupSd, float | None]] = {}
    for name in dict.fromkeys((row.rig, row.observable) for row in rows):
        cells = cells_of([row for row in rows if (row.rig, row.observable) == name and row.split == "fit"])
        if not cells:
            continue
        group = sd_of_group(*name, readings_of(cells))
        repeated = any(len(cell) > 1 for cell in cells)
        for cell, sd, known in zip(cells, group.sd, group.known, strict=True):
            for row in cell:
                found[id(row)] = _of_row(row, float(sd) if known else None, group, repeated)
        groups[name] = group, float(np.median(group.sd)) if group.known.all() else None
    for row in rows:
        if id(row) not in found:
            found[id(row)] = _held_out(row, *groups.get((row.rig, row.observable), (None, None)))
    return [found[id(row)] for row in rows]


def used_words(stated: float | None, used: UsedSd) -> str:
    """`sd 0.5; sd used 2.6: replicates scatter 5.1 times as much`; empty where the stated one is used."""
    if used.why == AS_STATED:
        return ""
    sd = "none" if used.sd is None else f"{used.sd:.3g}"
    return f"{'' if stated is None else f'sd {stated:.3g}; '}sd used {sd}: {used.why}"


def _of_row(row: Measurement, sd: float | None, group: GroupSd, repeated: bool) -> UsedSd:
    """Of a row that is fitted."""
    if sd is None:
        return UsedSd(None, "neither sd nor replicates")
    if row.sd is None:
        return UsedSd(sd, "of the replicates" if repeated else "of the rows that state one")
    if abs(sd - row.sd) <= ROUNDING * row.sd:
        return UsedSd(sd, AS_STATED)
    if group.contradicted is not None:
        return UsedSd(sd, f"replicates scatter {group.contradicted:.2g} times as much as the stated ones say")
    if row.resolution > row.sd and abs(sd - row.resolution) <= EQUAL + ROUNDING * sd:
        return UsedSd(sd, "the resolution, which is coarser")
    return UsedSd(sd, "steadied over the rows, as few readings are behind each")


def _held_out(row: Measurement, group: GroupSd | None, middle: float | None) -> UsedSd:
    """Of a row that is held out."""
    if row.sd is None:
        return UsedSd(middle, "neither sd nor replicates" if middle is None else "of the rows fitted, their median")
    stated = max(row.sd, row.resolution)
    if group is not None and group.contradicted is not None:
        words = f"replicates scatter {group.contradicted:.2g} times as much as the stated ones say"
        return UsedSd(stated * group.contradicted, words)
    return UsedSd(stated, AS_STATED if stated == row.sd else "the resolution, which is coarser")
