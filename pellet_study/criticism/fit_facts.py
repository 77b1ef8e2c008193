"""What an answer says of how well a model fits and where it fails, each fact once: text pages and the HTML report lay it out.

Every function takes a comparison as `answers` makes it, or as the JSON that a command left in the study; an older one says
what it can.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from statistics import NormalDist, median

from pellet_study.criticism.compare import HELD_OUT_FAILS
from pellet_study.criticism.constancy import Drift
from pellet_study.criticism.entries import FAR_OFF
from pellet_study.criticism.facts import misfit, varying
from pellet_study.criticism.grades import DOUBTFUL
from pellet_study.criticism.intervals import IDENTIFIED
from pellet_study.criticism.spread import Scatter
from pellet_study.criticism.time_drift import TimeDrift
from pellet_study.criticism.verdicts import Grade, Note
from pellet_study.output.words import number, probability


@dataclass(frozen=True)
class Constant:
    """A constant of the model; `interval` is None where it is fixed, `remarks` say what is wrong with it."""

    name: str
    value: float
    interval: tuple[float, float] | None
    remarks: tuple[str, ...]


def drift_words(drift: Drift) -> str:
    """Where it fails: `internal_friction would have to fall with layer_height_mm (layer_on_incline), z = -8.7`."""
    if drift.condition == "rig":
        what = (
            f"{drift.parameter} would have to be {'higher' if drift.z > 0 else 'lower'} in {drift.rig} than elsewhere"
        )
    elif drift.shape == "bends":
        way = "upwards" if drift.z > 0 else "downwards"
        what = f"{drift.parameter} would have to bend {way} over {drift.condition} ({drift.rig})"
    elif drift.shape == "rises":
        what = (
            f"{drift.parameter} would have to {'rise' if drift.z > 0 else 'fall'} with {drift.condition} ({drift.rig})"
        )
    else:
        what = (
            f"{drift.parameter} would have to be {'higher' if drift.z > 0 else 'lower'} where {drift.condition} is "
            f"{drift.shape} ({drift.rig})"
        )
    instead = f" (or with {' or '.join(drift.instead)}, changed along with it)" if drift.instead else ""
    return f"{what}{instead}, z = {drift.z:.1f}, p {probability(drift.p)}"


def time_drift_words(drift: TimeDrift, unit: str) -> str:
    """`slip_angle_deg (slope_slip) rises with the order of its readings, by 2.1 +- 0.4 deg from the first to the last, z = ...`."""
    said = "" if unit in ("1", "") else f" {unit}"
    words = (
        f"{drift.observable} ({drift.rig}) {'rises' if drift.z > 0 else 'falls'} with the order of its readings, by "
        f"{number(abs(drift.change), 3)} +- {number(drift.error, 2)}{said} from the first to the last, z = {drift.z:.1f}, "
        f"p {probability(drift.p)}"
    )
    if drift.along:
        words += f"; they were taken in the order of {' and '.join(drift.along)}, so that nothing tells time from it"
    return words


def grade(comparison: dict) -> Grade | None:
    """The graded word; None where the data cannot say."""
    judged = comparison.get("fit")
    if judged is not None:
        return None if judged["grade"] is None else Grade(judged["grade"])
    return {True: Grade.FITS, False: Grade.FAILS, None: None}[comparison["fits"]]


def grade_words(comparison: dict) -> str:
    """The graded word with the test that decides: `doubtful: lack of fit p 0.009`."""
    judged = comparison.get("fit") or {}
    by = judged.get("by")
    lack = "" if by in (None, "lack of fit") else f" (lack of fit p {probability(comparison['lack_of_fit_p'])})"
    what = "of its tests the least p is that of " if grade(comparison) == Grade.FITS else ""
    test = f": {what}{by}{',' if what else ''} p {probability(judged['p'])}{lack}" if by else ""
    words = {
        Grade.FITS: "the model fits",
        Grade.DOUBTFUL: "the fit is doubtful",
        Grade.FAILS: "the model does not fit",
        None: "whether the model fits cannot be said",
    }
    return f"{words[grade(comparison)]}{test}"


def fit_words(comparison: dict) -> str | None:
    """Does it fit? None where neither standard deviations nor replicates tell."""
    if grade(comparison) is None:
        if comparison["chi2"] is None:
            return None
        if comparison["lack_of_fit_p"] is None:
            return "as many free parameters as different cases, so that any readings are met: the fit says nothing"
        return "the fit did not end, so that chi2 is too large: whether the model fits cannot be said"
    words = grade_words(comparison)
    if held_out_contradict(comparison) and grade(comparison) != Grade.FAILS:
        return f"{words} (of the rows it was calibrated on, not those held out, which contradict it)"
    return words


def held_out_contradict(comparison: dict) -> bool:
    """Whether the rows held out contradict a model."""
    p = comparison.get("holdout_p")
    return p is not None and p < HELD_OUT_FAILS


def doubted(comparison: dict) -> bool:
    """Whether anything speaks against a model: its fit, or the rows held out."""
    drifts = any(drift["p"] < DOUBTFUL for drift in comparison["where"])
    return drifts or grade(comparison) in (Grade.DOUBTFUL, Grade.FAILS) or held_out_contradict(comparison)


def held_out_words(comparison: dict) -> str:
    """How the rows held out stand to a model: `p 0.300: they agree with the model (they contradict it below 0.001)`.

    With a model that the rows fitted do not fit, they agree no more than those.
    """
    p = comparison.get("holdout_p")
    if p is None:
        return ""
    rule = f"they contradict it below {HELD_OUT_FAILS:g}"
    if p < HELD_OUT_FAILS:
        verb = "contradict"
    elif p < DOUBTFUL:
        verb, rule = "cast doubt on", f"{rule}, cast doubt on it below {DOUBTFUL:g}"
    else:
        verb = "do not contradict" if grade(comparison) == Grade.FAILS else "agree with"
    return f"p {probability(p)}: they {verb} the model ({rule})"


def noise_words(comparison: dict) -> str:
    """`rebound 0.35 from readings, 0.52 from simulations (noise share 2.2)`, medians of the rows fitted; empty without any."""
    said = []
    for rig, share in (comparison.get("noise_share") or {}).items():
        rows = [r for r in comparison["rows"] if r["rig"] == rig and r["split"] == "fit"]
        parts = [
            number(median(r[f"uncertainty_{source}"] for r in rows if r[f"uncertainty_{source}"]), 2)
            for source in ("readings", "simulations")
        ]
        said.append(f"{rig} {parts[0]} from readings, {parts[1]} from simulations (noise share {number(share, 2)})")
    return "; ".join(said)


def scatter_words(found: Scatter) -> str:
    """`rebound_height_mm (rebound): readings scatter by 48 %, simulations from seed to seed by 21 %, p < 0.001: too regular`."""
    said = (
        f"{found.observable} ({found.rig}): a reading scatters by {100 * found.measured:.2g} %, a simulation by "
        f"{100 * found.simulated:.2g} % from seed to seed, p {probability(found.p)}"
    )
    return f"{said}: the model is {found.judgement}" if found.judgement else said


def failures(comparison: dict) -> list[str]:
    """Where a model fails: every constant that drifts, every rig that lacks fit, and the worst row where it is far off."""
    found = [d["words"] for d in comparison["where"] if d["p"] < DOUBTFUL and d.get("alone", True)]
    found += [drift["words"] for drift in comparison.get("time_drift") or [] if drift["p"] < DOUBTFUL]
    by_rig = comparison.get("rig_lack_of_fit_p") or {}
    if len(by_rig) > 1:
        found += [
            f"{rig}: its rows are farther off than they scatter, lack of fit p {probability(p)}"
            for rig, p in by_rig.items()
            if p < DOUBTFUL / len(by_rig)
        ]
    worst = worst_row(comparison["rows"])
    if worst is not None and worst["z"] is not None and abs(worst["z"]) > far_off_limit(comparison):
        found.append(f"the worst row is {row_words(worst, comparison['rows'])}; {far_off_rule(comparison)}")
    return [*found, *filter(None, [lone_words(comparison)])]


def far_off_limit(comparison: dict) -> float:
    """Standard errors from which on the worst row is named."""
    limit = comparison.get("far_off_limit")
    return limit or NormalDist().inv_cdf(1 - FAR_OFF / (2 * max(len(comparison["rows"]), 1)))


def far_off_rule(comparison: dict) -> str:
    """`the worst of 18 is 3.2 standard errors off in 5 of 100 data sets of a model that lacks nothing`."""
    return (
        f"the worst of {len(comparison['rows'])} rows is beyond {far_off_limit(comparison):.1f} in {100 * FAR_OFF:g} of 100 data sets "
        "of a model that lacks nothing"
    )


def lone_words(told: dict) -> str:
    """The row that alone keeps a model from fitting, and what to do with it; empty where there is none."""
    row = told.get("lone_row")
    if row is None:
        return ""
    fits = {Grade.FITS: "the model fits", Grade.DOUBTFUL: "the fit is doubtful only"}.get(
        row["grade"], "the model fits"
    )
    if effects := row.get("with_effects"):
        fits = f"the model with {' + '.join(effects)} explains the others"
    unit = f" ({row['unit']}: is it given in another unit?)" if row["unit"] else ""
    return (
        f"it is line {row['line']} alone: without it {fits} (lack of fit p {probability(row['lack_of_fit_p'])}) and "
        f"{number(row['predicted'])} is predicted there, where {number(row['value'])} is given{unit}; check that row, or give it the "
        "split leave_out with a reason"
    )


def where_words(comparison: dict) -> list[str]:
    """Where a model fails, or that it fails nowhere and how far that was looked."""
    found = failures(comparison)
    if found:
        return found
    looked = "no calibrated constant drifts with a condition" if comparison["where"] else "no drift can be tested"
    worst = worst_row(comparison["rows"])
    if worst is None or worst["z"] is None:
        return [looked]
    return [
        f"{looked}, and no row is far off: the worst is {abs(worst['z']):.1f} standard errors off ({far_off_rule(comparison)})"
    ]


def worst_row(rows: Sequence[dict]) -> dict | None:
    """The row that is farthest off, in standard errors where these are known."""
    return max(rows, key=misfit, default=None)


def row_words(row: dict, rows: Sequence[dict]) -> str:
    """A row by what tells it from the others: `line 5, rebound at drop_height_mm 400: ... 31, predicted 25, 4.2 standard errors off`."""
    changing = varying(rows).get(row["rig"], ())
    conditions = ", ".join(f"{name} {number(value)}" for name, value in row["conditions"].items() if name in changing)
    z = "" if row["z"] is None else f", {abs(row['z']):.1f} standard errors off"
    line = f"line {row['line']}, " if row.get("line") else ""
    return (
        f"{line}{row['rig']}{' at ' + conditions if conditions else ''}: {row['observable']} {number(row['value'])}, predicted "
        f"{number(row['predicted'])}{z}{' (held out)' if row['split'] == 'holdout' else ''}"
    )


def constants(comparison: dict) -> list[Constant]:
    """Every constant of a model, fitted or fixed."""
    rows = []
    for name, value in comparison["parameters"].items():
        limits = comparison["intervals"].get(name)
        remarks = [not_identified(comparison, name)] if name in comparison["not_identified"] else []
        remarks += ["at its bound"] if name in comparison["at_bound"] else []
        remarks += [comparison["cautions"][name]] if name in (comparison.get("cautions") or {}) else []
        rows.append(Constant(name, value, None if limits is None else (limits[0], limits[1]), tuple(remarks)))
    return rows


def not_identified(comparison: dict, name: str) -> str:
    """That the data do not pin a constant down, by which rule and in which range."""
    share = (comparison.get("range_shares") or {}).get(name)
    if share is None:
        return "not identified"
    low, high = comparison["ranges"][name]
    taken = f"{100 * share:.0f} %" if share < 10 else "far more than all"
    return (
        f"not identified: its interval, uncut, takes {taken} of its range {number(low)} to {number(high)}; a constant is "
        f"identified where it takes less than {100 * IDENTIFIED:g} %"
    )


def adequacy(comparison: dict) -> str:
    """What the verdict `adequate` is worth for a model."""
    words = "no missing effect is supported by these data"
    if unable(comparison):
        words = "these data can show none of the candidates: they support no missing effect and exclude none"
    if over := replicates_words(comparison):
        words += f", of which {over}"
    if comparison["chi2"] is None:
        return f"{words}; how well the model fits cannot be judged without sd or replicates"
    if held_out_contradict(comparison):
        return f"{words}, but the rows held out contradict the model (p {probability(comparison['holdout_p'])}; the limit is {HELD_OUT_FAILS:g})"
    if comparison.get("fits", True) is None:
        return f"{words}, which could show none"
    if grade(comparison) == Grade.DOUBTFUL:
        return f"{words}, but {grade_words(comparison)}"
    return words


def unable(diagnosis: dict) -> bool:
    """Whether the data could show none of the candidates."""
    ranking = diagnosis.get("ranking") or []
    return bool(ranking) and all(s["note"] in (Note.NOT_SHOWN, Note.NOT_SIMULATED) for s in ranking)


def replicates_words(told: dict) -> str:
    """`equal rows of layer_on_incline differ 5.1 times as much as their sd says`; empty where they do not."""
    found = told.get("replicates_over_sd") or {}
    worst = {rig: max(times.values()) for rig, times in found.items()}
    return " and ".join(
        f"equal rows of {rig} differ {number(t, 2)} times as much as their sd says" for rig, t in worst.items()
    )


def assumed_too(told: dict, rigs: Collection[str]) -> str:
    """That what differs between equal rows may be a condition of these rigs that has no column; empty where they agree."""
    over = {rig: times for rig, times in (told.get("replicates_over_sd") or {}).items() if rig in rigs}
    words = replicates_words({"replicates_over_sd": over})
    return f"{words}: was one of these conditions changed between them? Give it a column" if words else ""
