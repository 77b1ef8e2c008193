"""The three-level designs that Box and Behnken published, their orthogonal blocks, and a design recognised.

Reference
---------
Box, Behnken, Some new three level designs for the study of quantitative variables, Technometrics 2 (1960) 455,
doi:10.1080/00401706.1960.10489912: for 3 to 7, 9 to 12 and 16 factors. Each takes a few factors at a time through a
two-level factorial while the others stay in the middle; which factors go together is a balanced, or partially
balanced, incomplete block design.
"""

from itertools import combinations, product

import numpy as np

from pellet_study.errors import InputError

TOGETHER = {
    3: "12 13 23",
    4: "12 13 14 23 24 34",
    5: "12 13 14 15 23 24 25 34 35 45",
    6: "124 235 346 145 256 136",
    7: "456 167 257 124 347 135 236",
    9: "147 258 369 123 456 789 159 348 267 168 249 357 147 258 369",
    10: "267A 125A 2378 2469 189A 345A 1478 3579 1369 4568",
    11: "3789B 1489A 259AB 136AB 1247B 12358 23469 3457A 4568B 15679 2678A",
    12: "1257 2368 3479 458A 569B 67AC 178B 289C 139A 24AB 35BC 146C",
    16: "1269 348B 5ADE 7CFG 237A 145C 6BEF 89DG 256D 478F 19AE 3BCG 367E 158G 2ABF 49CD 13DF 24EG 579B 68AC 46AG 359F "
    "17BD 28CE",
}
"""Factors varied together, 1 to 9 and then A to G; of 11 factors five at a time in the half fraction of 2^5."""

CLASSES = {
    4: "12 34|13 24|14 23",
    5: "12 34 25 13 45|23 14 35 15 24",
    9: "147 258 369|123 456 789|159 348 267|168 249 357|147 258 369",
    16: "1269 348B 5ADE 7CFG|237A 145C 6BEF 89DG|256D 478F 19AE 3BCG|367E 158G 2ABF 49CD|13DF 24EG 579B 68AC|"
    "46AG 359F 17BD 28CE",
}
"""Groups in which every factor is varied equally often: the published orthogonal blocks."""


def _groups(text: str) -> list[tuple[int, ...]]:
    """Indices of the factors varied together, from `TOGETHER`."""
    return [tuple("123456789ABCDEFG".index(letter) for letter in word) for word in text.split()]


def box_behnken_matrix(n_factors: int, centre_points: int = 5) -> np.ndarray:
    """Coded Box-Behnken design (n_runs, n_factors) as published, centre points at the end.

    Parameters
    ----------
    n_factors : int
        3 to 7, 9 to 12 or 16: 12, 24, 40, 48, 56, 120, 160, 176, 192 and 384 runs besides the centre points.
    centre_points : int
        1 or more; without replicates of the middle there is no pure error.

    Raises
    ------
    InputError
        If no design was published for so many factors, or there is no centre point.
    """
    if n_factors not in TOGETHER:
        composite = (
            "; a central composite of 8 factors has 64 + 16 runs and its centre points: --axial face --fraction"
            if n_factors == 8
            else "; screen many factors with pb first, and go on with the few that matter"
        )
        raise InputError(
            f"{n_factors} factors were asked for: expected 3 to 7, 9 to 12 or 16, for which Box and Behnken published "
            f"designs{composite if n_factors >= 8 else '; two factors take a central composite: --axial rotatable'}"
        )
    if centre_points < 1:
        raise InputError(f"{centre_points} centre points were asked for: expected 1 or more")
    rows = [row for group in _groups(TOGETHER[n_factors]) for row in _varied(group, n_factors)]
    return np.vstack([*rows, np.zeros((centre_points, n_factors))])


def _varied(group: tuple[int, ...], n_factors: int) -> np.ndarray:
    """The runs that vary one group of factors."""
    size = len(group) - (len(group) == 5)
    signs = np.array(list(product((-1.0, 1.0), repeat=size)))
    if size < len(group):
        signs = np.column_stack([signs, signs.prod(axis=1)])  # E = ABCD, resolution V
    rows = np.zeros((len(signs), n_factors))
    rows[:, list(group)] = signs
    return rows


def box_behnken_blocks(coded: np.ndarray, n_blocks: int) -> np.ndarray | None:
    """Published orthogonal blocks of a Box-Behnken matrix: the block of each run from 1, or None where there are none.

    Within a block every factor is varied equally often, or (three or four factors at a time) the runs have the
    same product of signs. Centre points are spread evenly, which keeps the blocks orthogonal if their number is
    a multiple of `n_blocks`.

    Parameters
    ----------
    coded : ndarray (n_runs, n_factors)
        From `box_behnken_matrix`.
    n_blocks : int
        3 for 4 factors, 2 for 5, 6, 7, 10 and 12, 5 or 10 for 9, 6 or 12 for 16.
    """
    n_factors = coded.shape[1]
    centre = ~coded.any(axis=1)
    group_of, size = _positions(coded[~centre], n_factors)
    classes = CLASSES.get(n_factors, "").split("|") if n_factors in CLASSES else []
    signs = 1 + (np.where(coded == 0, 1.0, coded).prod(axis=1)[~centre] > 0)
    if n_blocks == len(classes):
        chosen = group_of
    elif n_blocks == 2 and size in (3, 4):
        chosen = signs
    elif classes and size in (3, 4) and n_blocks == 2 * len(classes):
        chosen = 2 * (group_of - 1) + signs
    else:
        return None
    blocks = np.zeros(len(coded), dtype=int)
    blocks[~centre] = chosen
    blocks[centre] = 1 + np.arange(int(centre.sum())) % n_blocks
    return blocks


def _positions(runs: np.ndarray, n_factors: int) -> tuple[np.ndarray, int]:
    """The published class of each run, and how many factors are varied at a time.

    A group that stands in two classes (9 factors) goes to them in turn, a whole factorial each.
    """
    size = int(np.count_nonzero(runs[0]))
    found = np.ones(len(runs), dtype=int)
    if n_factors not in CLASSES:
        return found, size
    classes = [_groups(text) for text in CLASSES[n_factors].split("|")]
    seen: dict[tuple, int] = {}
    for i, run in enumerate(runs):
        key = tuple(map(int, np.flatnonzero(run)))
        places = [k for k, groups in enumerate(classes, start=1) if key in map(lambda g: tuple(sorted(g)), groups)]
        found[i] = places[seen.get(key, 0) // 2**size % len(places)]
        seen[key] = seen.get(key, 0) + 1
    return found, size


# -------------------------------------------------------------------------------------------------- recognised
UNKNOWN = "a design of no kind known here"


def recognise(coded) -> str:
    """What design a coded table (n_runs, n_factors) is, in words; in any row order and with the factors in any order.

    Knows full two-level factorials and orthogonal two-level arrays, Box-Behnken designs as published and those of pairs
    that are often taken for them, central composites; else says how many runs and levels there are.
    """
    coded = np.asarray(coded, dtype=float)
    n_factors = coded.shape[1]
    moved = np.abs(coded) > 1e-6
    centre = int((~moved.any(axis=1)).sum())
    runs = coded[moved.any(axis=1)]
    tail = f", {len(runs)} + {centre} centre point{'s' if centre != 1 else ''}" if centre else f", {len(runs)} runs"
    name = _two_level_name(runs) or _three_level_name(runs, n_factors) or _composite_name(runs)
    return (name or f"{UNKNOWN}, {len(np.unique(runs.round(6), axis=0))} different runs") + tail


def misplaced_level(coded) -> list[tuple[int, int, float]]:
    """(run, factor, level) of the cells that, set to another level, would make the table exactly a known design.

    Empty where it is one, or no single cell does so. In every known design the levels of a factor add up to 0, so the
    sum of the column tells the level; a centre run is not taken for another that was lost.
    """
    coded = np.asarray(coded, dtype=float).round(6)
    sums = coded.sum(axis=0)
    uneven = np.flatnonzero(np.abs(sums) > 1e-3)
    if len(uneven) != 1 or _exact(coded):
        return []
    column = int(uneven[0])
    found = []
    for run in np.flatnonzero(np.abs(coded).max(axis=1) > 1e-6):
        changed = coded.copy()
        changed[run, column] = _on_a_level(coded[run, column] - sums[column], coded)
        if _exact(changed):
            found.append((int(run), column, float(changed[run, column])))
    return found


def _on_a_level(value: float, coded: np.ndarray) -> float:
    """The level of the table, or its mirror image, that a value is but for rounding; else the value."""
    levels = np.concatenate([coded.ravel(), -coded.ravel()])
    nearest = float(levels[np.argmin(np.abs(levels - value))])
    return nearest if abs(nearest - value) < 5e-3 else value


def _exact(coded: np.ndarray) -> bool:
    """Whether a coded table is a known design with nothing amiss."""
    name = recognise(coded)
    return not any(word in name for word in (UNKNOWN, "not orthogonal", "which is not"))


def design_of(table) -> str:
    """What design a table is (see `recognise`).

    A categorical factor has no middle: where the others are at theirs the run is a centre run, and of a design with more
    than two levels the others alone tell the kind.
    """
    numeric = [factor.name for factor in table.factors if not factor.levels] or table.names
    others = table.coded[numeric].to_numpy(dtype=float)
    moved = (np.abs(others) > 1e-6).any(axis=1, keepdims=True)
    every = np.where(moved, table.coded.to_numpy(dtype=float), 0.0)
    return recognise(every if np.allclose(np.abs(every[moved[:, 0]]), 1) else others)


def _two_level_name(runs: np.ndarray) -> str | None:
    if not len(runs) or not np.allclose(np.abs(runs), 1):
        return None
    n_runs, n_factors = runs.shape
    distinct = len(np.unique(runs, axis=0))
    if distinct == 2**n_factors and n_runs % distinct == 0:
        return f"full two-level factorial of {n_factors} factors"
    full = np.column_stack([np.ones(n_runs), runs])
    if np.allclose(full.T @ full, n_runs * np.eye(n_factors + 1)):
        return f"orthogonal two-level design of {n_factors} factors"
    return f"two-level design of {n_factors} factors, not orthogonal"


def _three_level_name(runs: np.ndarray, n_factors: int) -> str | None:
    """By what does not depend on the order of the factors: how many runs each group of factors varied has."""
    if n_factors < 3 or not np.all(np.isin(np.abs(runs).round(6), (0, 1))):
        return None
    mine = _profile(runs)
    if n_factors in TOGETHER and mine == _profile(box_behnken_matrix(n_factors, 1)[:-1]) and _spread(runs):
        return f"Box-Behnken design of {n_factors} factors (1960)"
    pairs = {tuple(sorted(pair)): 4 for pair in combinations(range(n_factors), 2)}
    if _counts(runs) == pairs and _spread(runs):
        return f"all pairs of {n_factors} factors, which is not Box and Behnken's design of so many"
    return None


def _counts(runs: np.ndarray) -> dict[tuple, int]:
    groups = [tuple(np.flatnonzero(np.abs(run) > 0.5)) for run in runs]
    return {group: groups.count(group) for group in set(groups)}


def _profile(runs: np.ndarray) -> tuple:
    """Sizes of the groups, their runs, and how often two factors, and two groups, meet."""
    counts = _counts(runs)
    varied = np.array([[i in group for i in range(runs.shape[1])] for group in counts], dtype=int)
    weights = np.array(list(counts.values()))
    pairs = np.sort((varied * weights[:, None]).T @ varied, axis=None)
    return tuple(sorted(counts.values())), tuple(pairs), tuple(np.sort(varied @ varied.T, axis=None))


def _spread(runs: np.ndarray) -> bool:
    """Whether every product of two factors sums to zero, and every factor does, as in a factorial of each group."""
    products = runs.T @ runs
    return bool(np.allclose(products, np.diag(np.diag(products))) and np.allclose(runs.sum(axis=0), 0))


def _composite_name(runs: np.ndarray) -> str | None:
    cube, axial = runs[np.all(np.abs(np.abs(runs) - 1) < 1e-6, axis=1)], runs[(np.abs(runs) > 1e-6).sum(axis=1) == 1]
    if not len(cube) or not len(axial) or len(cube) + len(axial) != len(runs) or runs.shape[1] < 2:
        return None
    times = np.unique(cube.round(3), axis=0, return_counts=True)[1]
    if np.ptp(times) and np.log2(len(times)) % 1:  # a corner is there twice and another not at all
        return None
    if not np.log2(len(times)) % 1 and not np.allclose(cube.T @ cube, len(cube) * np.eye(cube.shape[1])):
        return None
    distances = np.unique(np.abs(axial).max(axis=1).round(3))
    if len(distances) != 1 or len(np.unique(axial.round(3), axis=0)) != 2 * runs.shape[1]:
        return None
    repeats = len(axial) / (2 * runs.shape[1])
    kind = "central composite"
    if abs(distances[0] - 1) < 1e-6:
        kind = "face-centred central composite"
    elif abs(distances[0] - (len(cube) / repeats) ** 0.25) < 0.01:
        kind = "rotatable central composite"
    return f"{kind} of {runs.shape[1]} factors, axial points at {distances[0]:g}"
