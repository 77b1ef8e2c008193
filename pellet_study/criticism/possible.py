"""What could be measured next: a grid over the conditions of a study's rigs."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import combinations, product

import numpy as np

from pellet_study.model.model import Case
from pellet_study.rigs.declared import Condition, Rig
from pellet_study.study.measurements import Measurement
from pellet_study.study.study import Possible, Study

LEVELS = 9  # per condition; 729 cases with three conditions
FEW_LEVELS = 3  # where simulations must answer


def possible_cases(study: Study, count: int = LEVELS, effects: Iterable[str] | None = None) -> list[Case]:
    """What could be measured next: a grid over each rig's ranges and words, two conditions at a time, the others as measured.

    Of the rigs in which one of some effects acts (default: all). With few levels one condition at a time, as their
    predictions must be simulated.
    """
    cases = []
    for name in dict.fromkeys([*study.rigs, *(study.possible or {})]):
        if effects is not None and not set(effects) & set(study.catalogue.acting(name)):
            continue
        given = (study.possible or {}).get(name)
        if given is None and study.possible:
            continue
        rig = study.catalogue.rigs[name]
        rows = [row for row in study.rows if row.rig == name]
        usual = _usual(rig, rows)
        levels = levels_of(rig, given, count)
        observables = {row.observable for row in rows} or set(list(rig.observables)[:1])
        known = dict(rows[0].parameters) if rows else {}
        for values in _grid(levels, usual, count):
            conditions = {**usual, **dict(zip(levels, values, strict=True))}
            cases += [Case(name, observable, conditions, known) for observable in sorted(observables)]
    return list({(c.rig, c.observable, tuple(c.conditions.values())): c for c in cases}.values())


def _usual(rig: Rig, rows: Sequence[Measurement]) -> dict[str, Condition]:
    """The conditions of a rig as measured: the median of a number, the commonest word; the defaults without rows."""
    if not rows:
        return rig.default_conditions()
    usual: dict[str, Condition] = {}
    for condition in rig.conditions:
        measured = [row.conditions[condition] for row in rows]
        common = Counter(measured).most_common(1)[0][0]
        usual[condition] = common if rig.options(condition) else float(np.median(np.array(measured, dtype=float)))
    return usual


def levels_of(rig: Rig, given: Mapping[str, Possible] | None, count: int) -> dict[str, list[Condition]]:
    """Levels of each condition that may be set: over the ranges and words given, else over those the rig can do."""
    levels: dict[str, list[Condition]] = {}
    for condition, quantity in rig.conditions.items():
        if given is not None:
            if condition not in given:
                continue
            limits = given[condition]
        elif quantity.get("of_material"):  # another material is another question
            continue
        else:
            limits = rig.options(condition) or (quantity["min"], quantity["max"])
        if rig.options(condition):
            levels[condition] = list(limits)
            continue
        low, high = map(float, limits)
        between = np.geomspace(low, high, count) if low > 0 else np.linspace(low, high, count)
        levels[condition] = list(between.tolist()) if low < high else [low]  # to the last digit
    return levels


def _grid(levels: Mapping[str, list[Condition]], usual: Mapping[str, Condition], count: int) -> Iterator[tuple]:
    """Values of the conditions that have levels: in all combinations up to three, else two at a time; of few one at a time."""
    if count <= FEW_LEVELS:
        for c in levels:
            for x in levels[c]:
                yield tuple(x if other == c else usual[other] for other in levels)
    elif len(levels) <= 3:
        yield from product(*levels.values())
    else:
        for a, b in combinations(levels, 2):
            for x, y in product(levels[a], levels[b]):
                yield tuple(x if c == a else y if c == b else usual[c] for c in levels)


def needs_simulation(study: Study) -> bool:
    """Whether simulations must tell what one of the possible measurements would show."""
    return any(study.catalogue.rigs[rig].predict is None for rig in (*study.rigs, *(study.possible or {})))
