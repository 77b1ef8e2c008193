"""What each stage of the powder calibration decided, as it stands in the stage's decision.json.

The order of the fields is that of the file. A field with a default is one that an older version did not write.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from pellet_study.errors import InputError
from pellet_study.files import opening
from pellet_study.powder.heaps import FULL
from pellet_study.powder.plan import DEFAULT_LAW

ALPHA = 0.05  # of the equivalence test, over all settings that are validated
CONTRADICTED = 0.01  # p of the readings' distance from the surfaces below which they contradict each other


@dataclass(frozen=True, kw_only=True)
class Screening:
    """The factors that go on (`factors`), those beyond two standard errors (`clear`), and what the heaps gave.

    `coefficients` per coded unit, `scatter_deg` of heaps at one point; `heaps` in all, `lost` of them gave no angle, `repeats` at a point.
    """

    factors: list[str]
    clear: list[str]
    coefficients: dict[str, float]
    curvature_deg: float | None = None
    curvature_standard_error_deg: float | None = None
    scatter_deg: float | None = None
    lost: int
    heaps: int
    repeats: int | None = None


@dataclass(frozen=True, kw_only=True)
class Climb:
    """Where the path meets the target (`centre`; the nearest point where it is not `reached`), and the `box` around it."""

    factors: list[str]
    reached: bool
    centre: dict[str, float]
    box: dict[str, list[float]]
    heaps: int
    lost: int
    moves: int
    repeats: int | None = None


@dataclass(frozen=True, kw_only=True)
class Surface:
    """The surface of the `box` that counts, number `chosen_box` of all `boxes`; `box_runs` of the `heaps` lie in it.

    `r2_predicted_ceiling` is the predicted R2 that a surface through the true mean of every point would have.
    """

    box: dict[str, list[float]]
    boxes: list[dict[str, list[float]]]
    chosen_box: int | None = None
    coefficients: dict[str, float]
    standard_errors: dict[str, float | None]
    r2: float
    r2_adjusted: float | None
    r2_predicted: float | None
    r2_predicted_ceiling: float | None = None
    lack_of_fit_p: float | None
    reachable: bool
    heaps: int
    lost: int
    box_runs: int
    repeats: int | None = None


@dataclass(frozen=True, kw_only=True)
class Met:
    """A measured reading (mean of `n` with their `sd`) beside the surfaces: at the setting recommended, and in the box.

    `standard_error` is that of the mean, wider where `sd` has few degrees of freedom (`freedom`); the surfaces give from
    `lowest` to `highest` in the box; `nearest` is the value there that is nearest to it, `out_of_reach` where that lies beyond the scatter.
    """

    observable: str
    measured: float
    sd: float
    n: int
    freedom: int
    standard_error: float
    predicted: float
    predicted_standard_error: float
    lowest: float
    highest: float
    nearest: float
    out_of_reach: bool


@dataclass(frozen=True, kw_only=True)
class Known:
    """The 95 % interval of a factor, the share of its range in the box that this takes, and what that is called.

    `at_end` are the ends of the box at which it ends, beyond which nothing was simulated.
    """

    factor: str
    low: float
    high: float
    share_of_range: float
    word: str
    at_end: list[float]


@dataclass(frozen=True, kw_only=True)
class Gain:
    """The share of the box that would be left, on average, by `n` further readings with a standard deviation `sd`."""

    observable: str
    n: int
    sd: float
    share_of_box: float


@dataclass(frozen=True, kw_only=True)
class Joint:
    """What all readings tell together.

    `varied` are the factors that are not on the surface, each anywhere in its range. `share_of_box` is that of the smallest region which holds 95 % of the posterior, `share_of_box_first` that of the first
    reading alone; `distance` the least squared distance of the readings from the surfaces in units of their scatter,
    `distance_p` its p; `doubtful` the one reading without which the others do not contradict each other, where all do. `gains` are
    further readings, best first. The surfaces are of `heaps`.
    """

    readings: list[Met]
    known: list[Known]
    varied: list[str]
    share_of_box: float
    share_of_box_first: float
    distance: float
    distance_p: float
    doubtful: str | None
    gains: list[Gain]
    heaps: int

    @property
    def contradictory(self) -> bool:
        """Whether the readings contradict each other on the surfaces, or the box."""
        return self.distance_p < CONTRADICTED


@dataclass(frozen=True, kw_only=True)
class Optimum:
    """The setting recommended (`point`), the share of the box that meets the target as well, and its extents.

    `joint` is what the readings tell of the factors; an older version wrote none.
    """

    point: dict[str, float]
    factors: list[str]
    outside: dict[str, str] = field(default_factory=dict)
    predicted_deg: float
    prediction_standard_error_deg: float | None
    reachable: bool
    rule: str
    fraction_of_box: float
    lowest: float
    highest: float
    unidentified: list[str]
    extents: dict[str, list[float]]
    bond_number: float
    box: dict[str, list[float]]
    joint: Joint | None = None


@dataclass(frozen=True, kw_only=True)
class Checked:
    """Another reading of the same heaps against what was measured: their mean and the two one-sided tests, within `margin`."""

    observable: str
    mean: float
    standard_error: float
    measured: float
    margin: float
    p_tost: float
    equivalent: bool
    p_difference: float
    attainable: bool


@dataclass(frozen=True, kw_only=True)
class Attempt:
    """Heaps at one setting against the measured angle: their mean (deg) and the two one-sided tests.

    `attainable` says whether enough heaps could show equivalence at all, the measured angle being known as it is. `others`
    are the other readings that were measured.
    """

    mean_deg: float
    sd_deg: float
    standard_error_deg: float
    interval_deg: list[float]
    heaps: int
    lost: int
    measured_deg: float
    error_percent: float
    error_interval_percent: list[float]
    margin_deg: float
    p_tost: float
    equivalent: bool
    p_difference: float
    attainable: bool = True
    point: dict[str, float]
    factors: list[str]
    outside: dict[str, str] = field(default_factory=dict)
    bond_number: float
    others: list[Checked] = field(default_factory=list)

    @property
    def beyond_showing(self) -> bool:
        """Whether all that is not shown equivalent could not be, by any number of heaps, and does not differ either."""
        every: list[Attempt | Checked] = [self, *self.others]
        open_ones = [one for one in every if not one.equivalent]
        return all(not one.attainable and one.p_difference > ALPHA for one in open_ones)

    @property
    def passed(self) -> bool:
        """Whether the angle and all other readings are shown equivalent."""
        return self.equivalent and all(one.equivalent for one in self.others)


@dataclass(frozen=True, kw_only=True)
class Validation(Attempt):
    """The last attempt, which counts, and all `attempts`; `nothing_nearer` where the box left no correction."""

    attempts: list[Attempt]
    nothing_nearer: bool = False


@dataclass(frozen=True, kw_only=True)
class PathSetting:
    """What a calibration in few heaps found: the setting at `place` on the path, its angle by the line (deg), and the test of it.

    `factors` are those that the path moves. `met` is False where the path ends before the target, `enough` False where the interval is
    not within the margin, for which the standard error is to be `wanted_error_deg`; `heaps` and `lost` count the screening too,
    `path_heaps` and `path_lost` do not. `needed_heaps` in all are the least whose interval can fit at this scatter.
    """

    point: dict[str, float]
    factors: list[str]
    outside: dict[str, str]
    place: float
    predicted_deg: float
    standard_error_deg: float
    wanted_error_deg: float
    enough: bool
    scatter_deg: float
    slope_deg: float
    met: bool
    heaps: int
    path_heaps: int
    path_lost: int
    lost: int
    needed_heaps: int
    validation: Attempt


Decision = Screening | Climb | Surface | Optimum | Validation
KINDS: dict[str, type] = {
    "screening": Screening, "climb": Climb, "surface": Surface, "optimum": Optimum, "validation": Validation,
}  # fmt: skip
STAGES = tuple(KINDS)


def decision_file(folder: Path, stage: str) -> Path:
    """Where a stage's decision stands in a folder of results."""
    return folder / stage / "decision.json"


def decided(folder: Path, stage: str) -> dict[str, Any]:
    """The JSON object in the file of a stage's decision: for which plan it was made, and the decision.

    Raises
    ------
    InputError : it cannot be read
    """
    file = decision_file(folder, stage)
    try:
        found = opening.json_in(file)
        if not isinstance(found, dict):
            raise ValueError("no object")
    except (OSError, ValueError) as error:
        raise _no_decision(file, error) from None
    return found


def read_decision(folder: Path, stage: str) -> Any:
    """The decision of a stage, of the class `KINDS` has for it.

    Raises
    ------
    InputError : the file cannot be read, or lacks a part of the decision
    """
    found = decided(folder, stage)
    try:
        if stage == "validation":
            found["attempts"] = [_attempt(Attempt, attempt) for attempt in found.get("attempts", [found])]
            return _attempt(Validation, found)
        if stage == "optimum" and found.get("joint"):
            found["joint"] = _joint(found["joint"])
        return _part(KINDS[stage], found)
    except (TypeError, AttributeError) as error:
        raise _no_decision(decision_file(folder, stage), error) from None


def _attempt(kind: type, told: Mapping[str, Any]) -> Any:
    """Heaps at a setting, of a JSON object."""
    return _part(kind, dict(told) | {"others": [_part(Checked, one) for one in told.get("others", [])]})


def _joint(told: Mapping[str, Any]) -> Joint:
    """What the readings tell, of a JSON object."""
    parts = {"readings": Met, "known": Known, "gains": Gain}
    return _part(Joint, dict(told) | {key: [_part(kind, one) for one in told[key]] for key, kind in parts.items()})


def _part(kind: type, told: Mapping[str, Any]) -> Any:
    """A decision from those keys of a JSON object that it has."""
    return kind(**{f.name: told[f.name] for f in fields(kind) if f.name in told})


def _no_decision(file: Path, error: Exception) -> InputError:
    return InputError(f"{file}: is not what `calibrate` wrote ({error}); run calibrate again")


def stages_in(folder: Path) -> list[str]:
    """The stages whose decision stands in a folder, in their order."""
    return [stage for stage in STAGES if decision_file(folder, stage).exists()]


def repeats_before(folder: Path) -> int | None:
    """Heaps at each point in the stages that a folder has, None where it has none or they do not say."""
    found = (decided(folder, stage) for stage in stages_in(folder))
    return next((decision["repeats"] for decision in found if "repeats" in decision), None)


def command(folder: Path) -> str:
    """The call of `calibrate` that did what stands in a folder, with its options."""
    words = f"pellet-study calibrate {folder.as_posix()}"
    law = next((decided(folder, stage).get("contact_law") for stage in stages_in(folder)), None)
    if law not in (None, DEFAULT_LAW):
        words += f" --contact-law {law}"
    if (repeats := repeats_before(folder)) not in (None, FULL.repeats):
        words += f" --repeats {repeats}"
    return words
