"""What a trial's row says: which effects are named, whether that is right, and how far the error fell."""

from collections.abc import Sequence

from pellet_study.criticism.diagnose import GATE


def interval(hits: int, n: int) -> tuple[float, float]:
    """Clopper-Pearson 95 % interval of a share (Clopper & Pearson 1934, doi:10.1093/biomet/26.4.404)."""
    from scipy import stats

    low = stats.beta.ppf(0.025, hits, n - hits + 1) if hits else 0.0
    high = stats.beta.ppf(0.975, hits + 1, n - hits) if hits < n else 1.0
    return float(low), float(high)


def named(row: dict) -> set[str]:
    """Every effect an answer names: added, or in a tie."""
    return {e for e in row["added"].split("+") if e} | {e for t in row["tied"].split("|") for e in t.split("+") if e}


def right(row: dict) -> bool:
    """Unique and right: nothing but the truth added; a tie of effects that are one class counts as one."""
    hidden, tied = set(row["hidden"].split("+")), [t for t in row["tied"].split("|") if t]
    if row["verdict"] == "tied":
        return not row["added"] and len(tied) == 1 and set(tied[0].split("+")) == hidden
    return {e for e in row["added"].split("+") if e} == hidden


def wrong(row: dict) -> bool:
    """Unique and wrong: an answer without a tie that names something else."""
    tied = [t for t in row["tied"].split("|") if t]
    unique = bool(row["added"]) and not tied or (len(tied) == 1)
    return unique and not right(row)


def inside(row: dict) -> bool:
    """The truth is the answer or in the tie."""
    return set(row["hidden"].split("+")) <= named(row)


def unexplained(row: dict) -> bool:
    """It fails, and nothing is named."""
    return row["verdict"] == "unexplained" and not row["added"]


def names(row: dict) -> bool:
    """An effect is named."""
    return bool(named(row))


def noticed(row: dict) -> bool:
    """The first diagnosis is not `adequate`."""
    return row["first"] != "adequate"


def gate_opens(row: dict) -> bool:
    """Some candidate is needed."""
    return float(row["gate_p"]) < GATE


def improved(rows: Sequence[dict]) -> list[float]:
    """Error after over error before, trial by trial."""
    return [float(r["rms_after"]) / float(r["rms_before"]) for r in rows]
