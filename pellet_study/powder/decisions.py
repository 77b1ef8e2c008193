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
class Optimum:
    """The setting recommended (`point`), the share of the box that meets the target as well, and its extents."""

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


@dataclass(frozen=True, kw_only=True)
class Attempt:
    """Heaps at one setting against the measured angle: their mean (deg) and the two one-sided tests.

    `attainable` says whether enough heaps could show equivalence at all, the measured angle being known as it is.
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


@dataclass(frozen=True, kw_only=True)
class Validation(Attempt):
    """The last attempt, which counts, and all `attempts`; `nothing_nearer` where the box left no correction."""

    attempts: list[Attempt]
    nothing_nearer: bool = False


@dataclass(frozen=True, kw_only=True)
class PathSetting:
    """What a calibration in few heaps found: the setting at `place` on the path, its angle by the line, deg.

    `met` is False where the path ends before the target, `enough` False where its most heaps do not give
    `wanted_error_deg`; `heaps` and `lost` count the screening too, `path_heaps` and `path_lost` do not.
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
            found["attempts"] = [_part(Attempt, attempt) for attempt in found.get("attempts", [found])]
        return _part(KINDS[stage], found)
    except (TypeError, AttributeError) as error:
        raise _no_decision(decision_file(folder, stage), error) from None


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
