"""Which standard deviation of a reading each row was fitted with, and why that one."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from pellet_study.criticism.cell_means import cells_of
from pellet_study.criticism.scatter import (
    EQUAL,
    GroupSd,
    no_less_than_resolution,
    pooled_sd,
    readings_of,
    sd_of_group,
)
from pellet_study.model.model import key
from pellet_study.study.measurements import Measurement

AS_STATED = "as stated"
NOWHERE: Mapping[int, float] = MappingProxyType({})
ROUNDING = 5e-3  # share by which a standard deviation may differ from the stated one and count as that


class UsedSd(NamedTuple):
    """A row's standard deviation of one reading as it is used, None where nothing tells it, and why."""

    sd: float | None
    why: str


def used_sds(rows: Sequence[Measurement], at: Mapping[int, float] = NOWHERE) -> list[UsedSd]:
    """What each row was fitted with; a row held out has what `reading_sd` makes of it, with the same `at`."""
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
    for row, sd in zip(rows, reading_sd(rows, at), strict=True):
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
        return UsedSd(
            sd, "of the rows fitted, for a reading of this size" if group is not None else "of the rows that state one"
        )
    if group is not None and group.contradicted is not None:
        words = f"replicates scatter {group.contradicted:.2g} times as much as the stated ones say"
        return UsedSd(sd * group.contradicted, words)
    return UsedSd(sd, AS_STATED if sd == row.sd else "the resolution, which is coarser")


def reading_sd(rows: Sequence[Measurement], at: Mapping[int, float] = NOWHERE) -> list[float | None]:
    """Standard deviation of one reading for each row: as stated, else pooled from replicates, else None.

    Replicates, and stated ones that stand for others, are those of the rows fitted. A row held out whose sd is blank has what their
    rule says of a reading of its size: noise that grows with the reading is not that of the row nearest to it.

    Parameters
    ----------
    at : {id of a row held out: its size}, as a model predicts it; default the mean of the rows held out under the same conditions
    """
    of: dict[tuple[str, str], list[Measurement]] = {}
    for row in rows:
        of.setdefault((row.rig, row.observable), []).append(row)
    found = {id(row): max(row.sd, row.resolution) for row in rows if row.sd is not None}
    for group in of.values():
        blank = [row for row in group if row.sd is None]
        fitted, held = ([row for row in blank if (row.split == "fit") is fit] for fit in (True, False))
        cells: dict[tuple, list[Measurement]] = {}
        for row in fitted:
            cells.setdefault((key(row), row.setup), []).append(row)
        readings = readings_of(list(cells.values()))
        stated = [row for row in group if row.sd is not None and row.split == "fit"]
        beside: dict[tuple, list[Measurement]] = {}
        for row in held:
            beside.setdefault((key(row), row.setup), []).append(row)
        middle = {id(row): mean for cell in beside.values() for mean in [_mean(cell)] for row in cell}
        sizes = np.array([at.get(id(row), middle[id(row)]) for row in held])
        if readings.repeats.sum() > 0:
            dof = readings.repeats
            own = np.sqrt(readings.within / np.maximum(dof, 1))
            pooled = pooled_sd(readings.mean, own, dof)
            sds, _ = no_less_than_resolution("", pooled, np.abs(readings.mean), readings.resolution, readings.step)
            for row in fitted:
                found[id(row)] = float(sds[np.argmin(np.abs(readings.mean - row.value))])
            # the floor, where it is one for all
            least = sds.min() if (sds > pooled).all() else readings.resolution.max()
            of_held = np.maximum(pooled_sd(readings.mean, own, dof, sizes), least)
        elif stated:
            sds = np.array([found[id(row)] for row in stated])
            found |= dict.fromkeys(map(id, fitted), float(np.sqrt(np.mean(sds**2))))
            of_held = pooled_sd(np.array([row.value for row in stated]), sds, np.ones(len(sds)), sizes)
        else:
            continue
        found |= {id(row): max(float(sd), row.resolution) for row, sd in zip(held, of_held, strict=True)}
    return [found.get(id(row)) for row in rows]


def _mean(rows: Sequence[Measurement]) -> float:
    """Of all readings behind some rows."""
    return float(np.average([r.value for r in rows], weights=[r.n for r in rows]))
