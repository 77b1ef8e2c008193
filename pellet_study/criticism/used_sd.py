"""Which standard deviation of a reading each row was fitted with, and why that one."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pellet_study.criticism.cell_means import cells_of
from pellet_study.criticism.scatter import (
    EQUAL,
    GroupSd,
    last_digit,
    no_less_than_resolution,
    pooled_sd,
    readings_of,
    sd_of_group,
)
from pellet_study.model.model import key
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
    groups: dict[tuple[str, str], GroupSd] = {}
    for name in dict.fromkeys((row.rig, row.observable) for row in rows):
        cells = cells_of([row for row in rows if (row.rig, row.observable) == name and row.split == "fit"])
        if not cells:
            continue
        group = sd_of_group(*name, readings_of(cells))
        repeated = any(len(cell) > 1 for cell in cells)
        for cell, sd, known in zip(cells, group.sd, group.known, strict=True):
            for row in cell:
                found[id(row)] = _of_row(row, float(sd) if known else None, group, repeated)
        groups[name] = group
    for row, sd in zip(rows, reading_sd(rows), strict=True):
        if id(row) not in found:
            found[id(row)] = _held_out(row, sd, groups.get((row.rig, row.observable)))
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


def _held_out(row: Measurement, sd: float | None, group: GroupSd | None) -> UsedSd:
    """Of a row that is held out, with what `reading_sd` has for it."""
    if sd is None:
        return UsedSd(None, "neither sd nor replicates")
    if row.sd is None:
        return UsedSd(sd, "of the rows fitted, for a reading of this size")
    if group is not None and group.contradicted is not None:
        words = f"replicates scatter {group.contradicted:.2g} times as much as the stated ones say"
        return UsedSd(sd * group.contradicted, words)
    return UsedSd(sd, AS_STATED if sd == row.sd else "the resolution, which is coarser")


def reading_sd(rows: Sequence[Measurement]) -> list[float | None]:
    """Standard deviation of one reading for each row: as stated, else pooled from replicates, else None.

    Replicates are those of the rows fitted. A row held out has what their rule says of a reading of its size: noise that grows
    with the reading is not that of the row nearest to it.
    """
    blank: dict[tuple[str, str], dict[tuple, list[Measurement]]] = {}
    stated: dict[tuple[str, str], list[float]] = {}
    for row in rows:
        group = row.rig, row.observable
        if row.sd is not None:
            stated.setdefault(group, []).append(row.sd)
        elif row.split == "fit":
            blank.setdefault(group, {}).setdefault((key(row), row.setup), []).append(row)
    of_stated = {group: float(np.sqrt(np.mean(np.square(sds)))) for group, sds in stated.items()}
    pooled: dict[tuple[str, str], tuple] = {}
    held: dict[int, float] = {}
    for group, replicates in blank.items():
        means = np.array([np.average([r.value for r in c], weights=[r.n for r in c]) for c in replicates.values()])
        dof = np.array([len(c) - 1.0 for c in replicates.values()])
        if not len(means) or dof.sum() == 0:
            continue
        within = np.array(
            [sum(r.n * (r.value - m) ** 2 for r in c) for c, m in zip(replicates.values(), means, strict=True)]
        )
        sd = np.sqrt(within / np.maximum(dof, 1))
        resolution = np.array([max(r.resolution for r in c) for c in replicates.values()])
        step = np.array([last_digit([r.value for r in c]) for c in replicates.values()])
        asked = [r for r in rows if (r.rig, r.observable) == group and r.sd is None and r.split == "holdout"]
        at = np.array([*means, *(r.value for r in asked)])
        resolution = np.append(resolution, [r.resolution or resolution.max() for r in asked])
        step = np.append(step, [last_digit([r.value]) for r in asked])
        sds, _ = no_less_than_resolution("", pooled_sd(means, sd, dof, at), np.abs(at), resolution, step)
        pooled[group] = (means, sds[: len(means)])
        held |= dict(zip(map(id, asked), sds[len(means) :], strict=True))
    known: list[float | None] = []
    for row in rows:
        spread = None if row.sd is None else max(row.sd, row.resolution)
        if spread is None and id(row) in held:
            spread = float(held[id(row)])
        elif spread is None and (row.rig, row.observable) in pooled:
            means, sd = pooled[row.rig, row.observable]
            spread = float(sd[np.argmin(np.abs(means - row.value))])
        known.append(of_stated.get((row.rig, row.observable)) if spread is None else spread)
    return known
