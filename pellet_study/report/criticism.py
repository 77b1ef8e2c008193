"""What the model explains and what it lacks: the facts of the answers, laid out as parts of the page."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from pellet_study.criticism import facts, figures
from pellet_study.criticism.facts import Candidate
from pellet_study.criticism.verdicts import Note, Verdict
from pellet_study.output import style
from pellet_study.output.style import label
from pellet_study.output.words import number, probability
from pellet_study.report.parts import Picture, Table, picture, table
from pellet_study.rigs.catalogue import Effect
from pellet_study.study.study import Study

MOST_WORST = 8  # rows of the table of those predicted worst


@dataclass(frozen=True)
class ModelPart:
    """The present model: how well it fits, its constants, what it predicts."""

    fit: str
    parameters: Table
    pictures: list[Picture]


@dataclass(frozen=True)
class FailsPart:
    """Where the first and the last model fail, and the rows that the last one predicts worst."""

    words: list[str]
    pictures: list[Picture]
    rows: Table


@dataclass(frozen=True)
class MissingPart:
    """A diagnosis: its verdict, the effects it names, the ranking."""

    heading: str
    verdict: str
    effects: list[Effect]
    pictures: list[Picture]
    ranking: Table | None


@dataclass(frozen=True)
class LadderPart:
    """The error falling step by step."""

    pictures: list[Picture]
    steps: Table


@dataclass(frozen=True)
class NextPart:
    """The next measurement."""

    words: str
    pictures: list[Picture]


def fit_sentence(comparison: dict[str, Any]) -> str:
    """How well a model fits."""
    judged = facts.fit_words(comparison)
    if judged is None:
        return (
            "There are neither standard deviations nor replicates: how well it fits cannot be judged from these data."
        )
    return (
        f"chi² = {number(comparison['chi2'])} on {comparison['dof']}, lack of fit p "
        f"{probability(comparison['lack_of_fit_p'])}: {judged}."
    )


def model(comparison: dict[str, Any]) -> ModelPart:
    """The model that was compared."""
    rows = []
    for constant in facts.constants(comparison):
        text, unit = style.words(constant.name.replace(".", ": "))
        interval = "fixed" if constant.interval is None else " to ".join(map(number, constant.interval))
        rows.append([text, unit, number(constant.value), interval, ", ".join(constant.remarks)])
    return ModelPart(
        fit=f"Model: {facts.model_name(comparison['effects'])}. {fit_sentence(comparison)}",
        parameters=table(("constant", "unit", "value", "95 % interval", "remark"), rows, (2, 3)),
        pictures=[
            picture(
                figures.predictions(comparison["rows"]),
                "predicted against measured values, a panel for each observable",
                "Each point a row of measurements.csv; on the line, prediction and measurement are equal.",
            )
        ],
    )


def fails(steps: Sequence[dict[str, Any]], diagnoses: Sequence[dict[str, Any]]) -> FailsPart:
    """Where the models fail, of one comparison or more, the first and the last in words."""
    words = []
    for step in dict.fromkeys((0, len(steps) - 1)):
        failing = "; ".join(facts.failures(steps[step])) or "no calibrated constant drifts with a condition"
        words.append(f"Model {facts.model_name(steps[step]['effects'])}: {failing}.")
    pictures = [
        picture(
            figures.residuals(steps),
            "residual over its uncertainty against every condition",
            "Measured minus predicted, over the standard uncertainty of the row. In the band the scatter of the readings "
            "explains it. A model that lacks nothing scatters about 0 without a trend.",
        )
    ]
    drawn = next((d["by_level"] for d in diagnoses if d.get("by_level")), None)
    if drawn:
        pictures.append(
            picture(
                figures.constants(drawn),
                f"{drawn['parameter']} refitted at each level of {drawn['condition']}",
                "A constant of nature does not change with a condition of the test. Points: what each level alone would "
                "make of it. Lines: what a missing effect would make of it.",
            )
        )
    return FailsPart(words, pictures, worst_rows(steps[-1]))


def worst_rows(comparison: dict[str, Any]) -> Table:
    """The rows that a model predicts worst."""
    varying = facts.varying(comparison["rows"])
    worst = sorted(comparison["rows"], key=lambda row: -facts.misfit(row))[:MOST_WORST]
    rows = [
        [
            row["rig"],
            "; ".join(f"{label(c)} {number(v)}" for c, v in row["conditions"].items() if c in varying[row["rig"]]),
            number(row["value"]),
            number(row["predicted"]),
            "-" if row["z"] is None else f"{row['z']:.1f}",
        ]
        for row in worst
    ]
    head = ("rig", "conditions", "measured", "predicted", "residual / uncertainty")
    return table(head, rows, (2, 3, 4), f"The rows that {facts.model_name(comparison['effects'])} predicts worst")


def verdict(diagnosis: dict[str, Any]) -> str:
    """The verdict of a diagnosis in a sentence."""
    found = facts.finding(diagnosis)
    match found.verdict:
        case Verdict.MISSING:
            return f"Missing in {found.model}: {found.names}."
        case Verdict.TIED:
            return f"Tied in {found.model}: {found.names} explain it alike; these data cannot tell them apart."
        case Verdict.UNDECIDED:
            return f"Undecided: a fit on which the answer about {found.model} rests did not end."
        case Verdict.UNEXPLAINED:
            return f"Unexplained: {found.model} fails, and no candidate of a plausible size repairs it."
    return f"Adequate: nothing that {found.model} lacks is supported by these data."


def missing(study: Study, diagnosis: dict[str, Any]) -> MissingPart:
    """What a diagnosis names, and its ranking."""
    candidates = facts.candidates(study.catalogue, diagnosis)
    pictures = []
    if any(candidate.chi2_drop > 1 for candidate in candidates):
        pictures.append(
            picture(
                figures.ranking(diagnosis),
                "candidate effects ranked by the drop of chi²",
                "How much each candidate improves the fit. Everything that reaches into the band explains as well as the "
                "best: a tie, and then nothing is added. Hatched bars would need a size no material has.",
            )
        )
    needed = f"Is any candidate needed? p {probability(diagnosis['gate_p'])}, over all candidates together."
    return MissingPart(
        heading=f"Model {facts.model_name(diagnosis['effects'])}",
        verdict=f"{verdict(diagnosis)} {needed}",
        effects=facts.described(study.catalogue, facts.finding(diagnosis).effects),
        pictures=pictures,
        ranking=ranking(candidates) if candidates else None,
    )


def ranking(candidates: Sequence[Candidate]) -> Table:
    """The candidates, best first."""
    rows = [
        [
            candidate.effect,
            f"{candidate.visible_percent:.0f} %",
            "-" if candidate.score is None else f"{candidate.score:.1f}",
            probability(candidate.p_adjusted),
            f"{candidate.chi2_drop:.1f}",
            ", ".join(
                f"{style.words(size.parameter)[0]} {number(size.value, 3)} {style.words(size.parameter)[1]}".removesuffix(
                    " -"
                )
                for size in candidate.sizes
            ),
            remark(candidate),
        ]
        for candidate in candidates
    ]
    return table(
        ("effect", "visible", "score", "p adjusted", "chi² drop", "fitted size", "remark"), rows, (1, 2, 3, 4),
        "visible: share of the effect's signature that the calibration does not absorb; score: in standard errors",
    )  # fmt: skip


def remark(candidate: Candidate) -> str:
    """What speaks for or against a candidate."""
    words = candidate.note or ("explains" if candidate.explains else "does not explain")
    if candidate.beyond:
        sizes = ", ".join(f"{style.words(name)[0]} {number(value, 3)}" for name, value in candidate.beyond.items())
        words += f"; would need {sizes}"
    if candidate.noticed_from is not None and candidate.note in (Note.WRONG_SIGN, Note.NOT_SHOWN):
        words += f"; from {number(candidate.noticed_from, 3)} on it would be noticed"
    return words


def ladder(steps: Sequence[dict[str, Any]]) -> LadderPart:
    """The error falling step by step."""
    rows = [
        [
            step.number,
            facts.model_name(step.effects),
            number(step.chi2),
            step.dof,
            probability(step.lack_of_fit_p),
            number(step.rms_error, 3),
            number(step.holdout_rms_error, 3),
            number(step.noise_floor, 3),
        ]
        for step in facts.ladder(steps)
    ]
    unit = style.unit_in_words(steps[-1]["rms_error_unit"])
    return LadderPart(
        pictures=[
            picture(
                figures.ladder(steps),
                "rms error after each step, fitted and held out, above the noise floor",
                "The error of each model on the rows it was fitted to and on rows it has not seen. Below the noise floor "
                "a model would only follow the scatter of the readings.",
            )
        ],
        steps=table(
            ("step", "model", "chi²", "dof", "lack of fit p", f"rms error ({unit})", "held out", "noise floor"),
            rows,
            (0, 2, 3, 4, 5, 6, 7),
        ),
    )


def next_measurement(diagnoses: Sequence[dict[str, Any]]) -> NextPart | None:
    """The measurement that the last diagnosis which has one proposes."""
    proposing = next((d for d in reversed(diagnoses) if d["next_measurement"]), None)
    proposal = facts.proposal(proposing) if proposing else None
    if proposing is None or proposal is None:
        return None
    where = ", ".join(f"{label(c)} {number(v)}" for c, v in proposal.conditions.items())
    rivals = "; ".join(
        f"{rival.explanation} predicts {number(rival.value, 3)} ± {number(rival.uncertainty, 2)}"
        for rival in proposal.predictions
    )
    return NextPart(
        words=f"{proposal.rig}, {label(proposal.observable)}, at {where}: {rivals}. "
        f"The two best differ there by {proposal.separation:.1f} standard uncertainties.",
        pictures=[
            picture(
                figures.next_measurement(proposing["next_measurement"]),
                "what each explanation predicts for the proposed measurement",
                "One such reading tells the explanations apart that these data leave alike.",
            )
        ],
    )
