"""What an answer says, each fact once and as data: text pages and the HTML report only lay it out.

Every function takes an answer as `answers` makes it, or as the JSON that a command left in the study: a comparison (also a
step of `refine` or `history`), a diagnosis, a list of steps.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from pellet_study.criticism.verdicts import SEPARATES, Note, Verdict
from pellet_study.output.words import number
from pellet_study.rigs.catalogue import Catalogue, Effect
from pellet_study.rigs.declared import Condition
from pellet_study.study.study import Study

MOST_ASSUMED = 6  # parameters at their defaults that are spelt out
UNSEEN = 0.05  # adjusted p above which a candidate was not seen, so that its smallest visible size is of interest


@dataclass(frozen=True)
class Size:
    """A fitted parameter of a candidate; `physical` range and `unit` are None where the catalogue lacks its effect."""

    parameter: str
    value: float
    physical: tuple[float, float] | None
    unit: str | None


@dataclass(frozen=True)
class Candidate:
    """A row of the ranking.

    `visible_percent` is the share of its change that no constant imitates, `beyond` the size it would need without its
    physical limit, `noticed_from` the size from which on it would be noticed; `unseen` says that it was not.
    """

    effect: str
    visible_percent: float
    score: float | None
    p_adjusted: float | None
    chi2_drop: float
    sizes: tuple[Size, ...]
    note: str
    explains: bool
    beyond: Mapping[str, float]
    beyond_chi2_drop: float | None
    noticed_from: float | None

    @property
    def unseen(self) -> bool:
        """Whether the data show nothing of it."""
        return self.note == Note.WRONG_SIGN or (self.p_adjusted or 1) > UNSEEN


@dataclass(frozen=True)
class Finding:
    """A verdict on a model: `names` in words (`a and b` are missing, `a or b + c` are tied), `effects` one by one."""

    verdict: str
    model: str
    names: str
    effects: tuple[str, ...]


@dataclass(frozen=True)
class Prediction:
    """What an explanation predicts for the next measurement, and the standard uncertainty of a reading about it."""

    explanation: str
    value: float
    uncertainty: float


@dataclass(frozen=True)
class Proposal:
    """The next measurement; `separation` of the two explanations farthest apart, in standard uncertainties.

    `farthest` and `closest` name two explanations, `least_separation` is that of the closest; an answer of an older version
    has none of these.
    """

    rig: str
    observable: str
    conditions: Mapping[str, Condition]
    predictions: tuple[Prediction, ...]
    separation: float
    farthest: tuple[str, ...] = ()
    least_separation: float | None = None
    closest: tuple[str, ...] = ()


@dataclass(frozen=True)
class Step:
    """A step of the ladder; errors in the unit of its answer, `level_out` {rig.condition: error of levels left out}; `measured`
    are readings that were added before it, in words."""

    number: int
    effects: tuple[str, ...]
    chi2: float | None
    dof: int
    lack_of_fit_p: float | None
    rms_error: float | None
    holdout_rms_error: float | None
    noise_floor: float | None
    level_out: Mapping[str, float]
    measured: tuple[str, ...] = ()


def model_name(effects: Sequence[str]) -> str:
    """`base`, or `base + cohesion`."""
    return "base" + "".join(f" + {name}" for name in effects)


def assumed_words(study: Study, varied: Collection[str] = ()) -> str:
    """`layer_on_incline: channel_width_mm 100; parameters: density 1400`: defaults that an answer rests on; `` without any.

    `varied` are parameters that the command varies, so that their defaults are not taken.
    """
    said = [
        f"{rig}: {', '.join(f'{name} {number(value)}' for name, value in names.items())}"
        for rig, names in study.assumed_conditions.items()
    ]
    parameters = {name: value for name, value in study.assumed_parameters.items() if name not in varied}
    if len(parameters) > MOST_ASSUMED:
        said.append(f"{len(parameters)} parameters, which `pellet-study check` lists")
    elif parameters:
        said.append(", ".join(f"{name} {number(value)}" for name, value in parameters.items()))
    return "; ".join(said)


def varying(rows: Sequence[dict]) -> dict[str, list[str]]:
    """The conditions of each rig that change from row to row, {rig: names}."""
    names_of = {}
    for rig in dict.fromkeys(row["rig"] for row in rows):
        given = [row["conditions"] for row in rows if row["rig"] == rig]
        names = dict.fromkeys(name for conditions in given for name in conditions)
        names_of[rig] = [name for name in names if len({conditions.get(name) for conditions in given}) > 1]
    return names_of


def misfit(row: dict) -> tuple[bool, float]:
    """Orders rows by how far they are off: first those whose uncertainty is known, in it, then the others in their unit."""
    known = row["z"] is not None
    return known, abs(row["z"] if known else row["residual"])


def finding(diagnosis: dict) -> Finding:
    """The verdict of a diagnosis, and what it names."""
    missing = list(diagnosis["missing"])
    alternatives = [[names] if isinstance(names, str) else list(names) for names in diagnosis["tied"]]
    words = " and ".join(missing) if missing else " or ".join(" + ".join(names) for names in alternatives)
    effects = missing or [name for names in alternatives for name in names]
    return Finding(diagnosis["verdict"], model_name(diagnosis["effects"]), words, tuple(dict.fromkeys(effects)))


def described(catalogue: Catalogue, names: Collection[str]) -> list[Effect]:
    """What is known of some effects; those that a catalogue lacks are left out."""
    return [catalogue.effects[name] for name in names if name in catalogue.effects]


def candidates(catalogue: Catalogue, diagnosis: dict) -> list[Candidate]:
    """The ranking, best first."""
    return [
        Candidate(
            effect=suspect["effect"],
            visible_percent=100 * suspect["visible_share"],
            score=suspect["score"],
            p_adjusted=suspect["p_adjusted"],
            chi2_drop=suspect["chi2_drop"],
            sizes=tuple(_size(catalogue, suspect["effect"], *item) for item in suspect["value"].items()),
            note=suspect["note"],
            explains=suspect["explains"],
            beyond=suspect["beyond"],
            beyond_chi2_drop=suspect.get("beyond_chi2_drop"),
            noticed_from=suspect["smallest_visible"],
        )
        for suspect in diagnosis["ranking"]
    ]


def _size(catalogue: Catalogue, effect: str, parameter: str, value: float) -> Size:
    quantity = catalogue.effects[effect].parameters.get(parameter) if effect in catalogue.effects else None
    if quantity is None:
        return Size(parameter, value, None, None)
    low, high = quantity.get("physical", (quantity["min"], quantity["max"]))
    return Size(parameter, value, (low, high), quantity["unit"])


def proposal(diagnosis: dict) -> Proposal | None:
    """The next measurement that a diagnosis proposes."""
    proposed = diagnosis["next_measurement"]
    if not proposed:
        return None
    predictions = tuple(
        Prediction(name, value, proposed["uncertainties"][name]) for name, value in proposed["predictions"].items()
    )
    return Proposal(
        proposed["rig"],
        proposed["observable"],
        proposed["conditions"],
        predictions,
        proposed["separation"],
        tuple(proposed.get("farthest", ())),
        proposed.get("least_separation"),
        tuple(proposed.get("closest", ())),
    )


def test_words(verdict: str, proposal: Proposal) -> str:
    """What a measurement is for where one explanation stands alone; empty where it tells several apart."""
    named, *others = (rival.explanation for rival in proposal.predictions)
    if verdict != "missing" or len(others) != 1:
        return ""
    return f"nothing needs telling apart; to test {named} against the runner-up, {others[0]}: "


def apart_words(proposed: Proposal) -> str:
    """How far the explanations lie apart at the measurement proposed, and whether one reading tells all of them apart."""
    pair = " and ".join(proposed.farthest) or "the two farthest apart"
    words = f"{pair} differ by {proposed.separation:.1f} standard uncertainties"
    if proposed.least_separation is None or len(proposed.predictions) < 3:
        return words
    if proposed.least_separation**2 >= SEPARATES:
        return f"{words}, no two by less than {proposed.least_separation:.1f}"
    return f"{words}, but {' and '.join(proposed.closest)} by {proposed.least_separation:.1f} only: one such reading leaves these alike"


def ladder(steps: Sequence[dict]) -> list[Step]:
    """The error falling step by step."""
    return [
        Step(
            number=number,
            effects=tuple(step["effects"]),
            chi2=step["chi2"],
            dof=step["dof"],
            lack_of_fit_p=step["lack_of_fit_p"],
            rms_error=step["rms_error"],
            holdout_rms_error=step["holdout_rms_error"],
            noise_floor=step.get("noise_floor"),
            level_out=step.get("level_out_rms_error") or {},
            measured=tuple(measured_words(row, step["rows"]) for row in step.get("measured") or []),
        )
        for number, step in enumerate(steps)
    ]


def measured_words(row: dict, rows: Sequence[dict]) -> str:
    """`layer_on_incline slip_angle_deg 41.2 at layer_height_mm 5`: a reading by what tells it from the others."""
    changing = varying(rows).get(row["rig"]) or list(row["conditions"])
    at = ", ".join(f"{name} {number(row['conditions'][name])}" for name in changing)
    return f"{row['rig']} {row['observable']} {number(row['value'])}{' at ' + at if at else ''}"


def errors(diagnosis: dict) -> list[dict]:
    """What each explanation that a verdict names would do to the error, the present model first; empty where it names none."""
    rivals = diagnosis.get("rivals") or []
    return [{**diagnosis["present"], "effects": []}, *rivals] if rivals else []


def undone_words(diagnosis: dict) -> str:
    """Which set-up scatter, declared nowhere, would undo a verdict; empty where that was not looked for."""
    found = diagnosis.get("undone")
    if found is None:
        stood = diagnosis["verdict"] in (Verdict.MISSING, Verdict.TIED) and diagnosis.get("undone_tested")
        return "it stands with one standard error of undeclared set-up scatter too" if stood else ""
    left = names_of(found["effects"])
    return (
        f"set-up scatter that replicates do not see, of {number(found['standard_errors'], 2)} standard errors of a mean "
        f"(setup_sd of {setup_words(found)}), would undo this (then {found['verdict']}"
        f"{' ' + left if left else ''}); state what is known of it in setup_sd"
    )


def setup_words(found: Mapping) -> str:
    """What to enter as `setup_sd`: `drop rebound_mm 0.4 mm`, or row by row where rows differ."""
    said = []
    for rig, of_rig in found["by_rig"].items():
        for observable, median in of_rig.items():
            unit = (found.get("units") or {}).get(observable, "")
            unit = "" if unit in ("", "1") else f" {unit}"
            of_line = {
                r["line"]: r["setup_sd"]
                for r in found.get("by_line") or []
                if (r["rig"], r["observable"]) == (rig, observable)
            }
            sizes = sorted(set(of_line.values())) or [median]
            if len(sizes) == 1:
                said.append(f"{rig} {observable} {number(sizes[0], 3)}{unit}")
                continue
            first, last = min(of_line, key=of_line.__getitem__), max(of_line, key=of_line.__getitem__)
            said.append(
                f"{rig} {observable} from {number(sizes[0], 3)}{unit} in line {first} to {number(sizes[-1], 3)}{unit} in line {last}, "
                f"{number(found['standard_errors'], 4)} times the uncertainty of each row's mean"
            )
    return ", ".join(said)


def limited_words(diagnosis: dict) -> str:
    """Why simulations leave it undecided, and what it would take; empty where they do not."""
    found = diagnosis.get("limited")
    if found is None:
        return ""
    share, most = number(found["noise_share"], 2), number(found["most"], 2)
    minutes = f", {number(found['cpu_minutes'], 2)} cpu minutes" if found["cpu_minutes"] else ""  # where none was timed
    return (
        f"the simulations of {found['rig']} scatter too much: their variance is {share} times the readings' (at most {most} decides), "
        f"and without it a missing effect could show; it would take about {found['simulations']} more "
        f"simulations{minutes}: `refine` with a larger --budget, or narrower ranges of the free parameters"
    )


def time_words(diagnosis: dict) -> str:
    """What a drift of the instrument with time would explain, or that no row tells when it was taken; empty where neither."""
    drifts = diagnosis.get("by_time") or []
    if drifts:
        names = " and ".join(f"{one['observable']} ({one['rig']})" for one in drifts)
        return (
            f"a drift of {names} with time explains it as well; randomise the order of the readings, and take them again in "
            "another order"
        )
    if diagnosis.get("unordered") and diagnosis["verdict"] in (Verdict.MISSING, Verdict.TIED):
        return (
            "no row has an `order`: a drift of the instrument with time would look like an effect of what was changed meanwhile; "
            "randomise the order of the readings and note it (1, 2, ...)"
        )
    return ""


def fitted_too_words(diagnosis: dict) -> str:
    """Which held-out rows, fitted too, would let an effect be named; empty where none would."""
    found = diagnosis.get("fitted_too")
    if found is None:
        return ""
    names = names_of(found["effects"])
    if found.get("drifting"):
        return (
            f"with the rows {places(found['conditions'])} fitted too, {names} would come nearest, with an amount that drifts: nothing "
            "would be added"
        )
    return f"with the rows {places(found['conditions'])} fitted too, {names} would be named ({found['verdict']})"


def places(conditions: Sequence[Mapping]) -> str:
    """Conditions in words: `layer_on_incline at layer_height_mm 10 and at layer_height_mm 15`."""
    by_rig: dict[str, list[str]] = {}
    for given in conditions:
        words = ", ".join(f"{name} {number(value)}" for name, value in given.items() if name != "rig")
        by_rig.setdefault(given["rig"], []).append(words)
    return "; ".join(f"of {rig} at {' and at '.join(words)}" for rig, words in by_rig.items())


def names_of(explanations: Sequence) -> str:
    """Explanations, each an effect or a list of them: `a or b + c`."""
    return " or ".join(one if isinstance(one, str) else " + ".join(one) for one in explanations)


def miss_words(diagnosis: dict) -> str:
    """What comes nearest to explaining the data, what it does to chi2, and why it is refused; empty where nothing does."""
    miss = diagnosis.get("nearest_miss")
    if miss is None:
        return ""
    before, after = diagnosis["present"]["chi2"], miss["chi2"]
    does = "is fitted" if after is None else f"takes chi2 from {number(before, 3)} to {number(after, 3)}"
    return f"{' + '.join(miss['effects'])} {does}, but is refused: {miss['refused']}; with it the worst row is {miss['worst_row']['words']}"
