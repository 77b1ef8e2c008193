"""What an answer says, each fact once and as data: text pages and the HTML report only lay it out.

Every function takes an answer as `answers` makes it, or as the JSON that a command left in the study: a comparison (also a
step of `refine` or `history`), a diagnosis, a list of steps.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from pellet_study.criticism.compare import HELD_OUT_FAILS
from pellet_study.criticism.constancy import Drift
from pellet_study.criticism.verdicts import Note
from pellet_study.output.words import number, probability
from pellet_study.rigs.catalogue import Catalogue, Effect
from pellet_study.rigs.declared import Condition
from pellet_study.study.study import Study

MOST_ASSUMED = 6  # parameters at their defaults that are spelt out
CLEAR_DRIFT = 0.01  # p below which a drift is named; a model fails from DRIFT on, a weaker one still says where to look
UNSEEN = 0.05  # adjusted p above which a candidate was not seen, so that its smallest visible size is of interest


@dataclass(frozen=True)
class Constant:
    """A constant of the model; `interval` is None where it is fixed, `remarks` say what is wrong with it."""

    name: str
    value: float
    interval: tuple[float, float] | None
    remarks: tuple[str, ...]


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
    """The next measurement; `separation` of the two explanations farthest apart, in standard uncertainties."""

    rig: str
    observable: str
    conditions: Mapping[str, Condition]
    predictions: tuple[Prediction, ...]
    separation: float


@dataclass(frozen=True)
class Step:
    """A step of the ladder; errors in the unit of its answer, `level_out` {rig.condition: error of levels left out}."""

    number: int
    effects: tuple[str, ...]
    chi2: float | None
    dof: int
    lack_of_fit_p: float | None
    rms_error: float | None
    holdout_rms_error: float | None
    noise_floor: float | None
    level_out: Mapping[str, float]


def model_name(effects: Sequence[str]) -> str:
    """`base`, or `base + cohesion`."""
    return "base" + "".join(f" + {name}" for name in effects)


def assumed_words(study: Study) -> str:
    """`layer_on_incline: channel_width_mm 100; parameters: density 1400`: defaults that an answer rests on; `` without any."""
    said = [
        f"{rig}: {', '.join(f'{name} {number(value)}' for name, value in names.items())}"
        for rig, names in study.assumed_conditions.items()
    ]
    parameters = study.assumed_parameters
    if len(parameters) > MOST_ASSUMED:
        said.append(f"{len(parameters)} parameters, which `pellet-study check` lists")
    elif parameters:
        said.append(", ".join(f"{name} {number(value)}" for name, value in parameters.items()))
    return "; ".join(said)


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
    return f"{what}, z = {drift.z:.1f}, p {probability(drift.p)}"


def failures(comparison: dict) -> list[str]:
    """Where a model fails: a sentence on every constant that clearly drifts, the worst first."""
    return [drift["words"] for drift in comparison["where"] if drift["p"] < CLEAR_DRIFT]


def held_out_contradict(comparison: dict) -> bool:
    """Whether the rows held out contradict a model."""
    p = comparison.get("holdout_p")
    return p is not None and p < HELD_OUT_FAILS


def fit_words(comparison: dict) -> str | None:
    """Does it fit? None where neither standard deviations nor replicates tell."""
    if comparison["chi2"] is None:
        return None
    if comparison["fits"] is None and comparison["lack_of_fit_p"] is None:
        return "as many free parameters as different cases, so that any readings are met: the fit says nothing"
    if comparison["fits"] is None:
        return "the fit did not end, so that chi2 is too large: whether the model fits cannot be said"
    if not comparison["fits"]:
        return "the model does not fit"
    if held_out_contradict(comparison):
        return "the model fits the rows it was calibrated on, but not those held out"
    return "the model fits within the scatter of the readings"


def constants(comparison: dict) -> list[Constant]:
    """Every constant of a model, fitted or fixed."""
    rows = []
    for name, value in comparison["parameters"].items():
        limits = comparison["intervals"].get(name)
        remarks = [
            words
            for words, names in (("not identified", "not_identified"), ("at its bound", "at_bound"))
            if name in comparison[names]
        ]
        rows.append(Constant(name, value, None if limits is None else (limits[0], limits[1]), tuple(remarks)))
    return rows


def varying(rows: Sequence[dict]) -> dict[str, list[str]]:
    """The conditions of each rig that change from row to row, {rig: names}."""
    names_of = {}
    for rig in dict.fromkeys(row["rig"] for row in rows):
        given = [row["conditions"] for row in rows if row["rig"] == rig]
        names = dict.fromkeys(name for conditions in given for name in conditions)
        names_of[rig] = [name for name in names if len({conditions.get(name) for conditions in given}) > 1]
    return names_of


def misfit(row: dict) -> float:
    """How far a row is off: in standard uncertainties, or, where they are unknown, in its unit."""
    return abs(row["z"] if row["z"] is not None else row["residual"])


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


def adequacy(comparison: dict) -> str:
    """What the verdict `adequate` is worth for a model."""
    words = "no missing effect is supported by these data"
    if comparison["chi2"] is None:
        return f"{words}; how well the model fits cannot be judged without sd or replicates"
    if comparison["fits"] is None:
        return f"{words}, which could show none"
    if held_out_contradict(comparison):
        return f"{words}, but the rows held out contradict the model: fit some of them too"
    return words


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
        proposed["rig"], proposed["observable"], proposed["conditions"], predictions, proposed["separation"]
    )


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
        )
        for number, step in enumerate(steps)
    ]
