"""What is missing and what would tell it: the verdict, the candidates, what each does to the error, the next measurement."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from pellet_study.criticism import facts, figures, verdict_facts
from pellet_study.criticism.facts import Candidate, Size
from pellet_study.output import style
from pellet_study.output.style import declared
from pellet_study.output.words import number, probability
from pellet_study.report.parts import Picture, Table, picture, table
from pellet_study.rigs.catalogue import Effect
from pellet_study.study.study import Study


@dataclass(frozen=True)
class MissingPart:
    """A diagnosis: its verdict, the effects it names, the ranking."""

    heading: str
    verdict: str
    effects: list[Effect]
    pictures: list[Picture]
    ranking: Table | None


@dataclass(frozen=True)
class NextPart:
    """The next measurement."""

    words: str
    pictures: list[Picture]


def verdict(diagnosis: dict[str, Any]) -> str:
    """The verdict of a diagnosis in a sentence, and what stands beside it."""
    found = facts.finding(diagnosis)
    words = (
        f"{verdict_facts.heading(diagnosis).capitalize()}: {verdict_facts.verdict(diagnosis)} (model {found.model})."
    )
    return " ".join([words, *(f"{line[0].upper()}{line[1:]}." for line in verdict_facts.beside(diagnosis))])


def missing(study: Study, diagnosis: dict[str, Any]) -> MissingPart:
    """What a diagnosis names, and its ranking."""
    candidates = facts.candidates(study.catalogue, diagnosis)
    pictures = []
    if any(candidate.chi2_drop > 1 for candidate in candidates):
        pictures.append(
            picture(
                figures.ranking(diagnosis, study.acting()),
                "candidate effects ranked by the drop of chi²",
                _ranking_caption(diagnosis),
            )
        )
    limit = diagnosis.get("gate_limit_p")
    needed = f"Is any candidate needed? p {probability(diagnosis['gate_p'])}, over all candidates together" + (
        "." if limit is None else f"; one is below {limit:g}."
    )
    return MissingPart(
        heading=f"Model {facts.model_name(diagnosis['effects'])}",
        verdict=f"{verdict(diagnosis)} {needed}",
        effects=facts.described(study.catalogue, facts.finding(diagnosis).effects),
        pictures=pictures,
        ranking=ranking(diagnosis, candidates) if candidates else None,
    )


def _ranking_caption(diagnosis: dict[str, Any]) -> str:
    """How to read the ranking: of the bars that are drawn."""
    kinds = {verdict_facts.standing(diagnosis, suspect) for suspect in diagnosis["ranking"]}
    words = ["How much each candidate improves the fit."]
    said = {
        verdict_facts.MISSING: "The coloured bar explains the data.",
        verdict_facts.TIED: "Coloured bars explain the data: a tie, and nothing is added.",
        verdict_facts.PAIRED: "Crossed bars explain them only together, as the verdict says; the bar is of each alone.",
        verdict_facts.EXPLAINS: "Dotted bars explain them too, but less well.",
        verdict_facts.IMPLAUSIBLE: "Hatched bars would need a size no material has.",
        verdict_facts.REFUSED: "Grey bars improve the fit and leave a misfit all the same.",
        verdict_facts.NOT_NEEDED: "Grey bars are not needed: the model stands without them.",
    }
    words += [sentence for kind, sentence in said.items() if kind in kinds]
    if kinds & {verdict_facts.MISSING, verdict_facts.TIED} and diagnosis.get("chi2") is not None:
        words.append("What explains the data and reaches into the band is tied with the best.")
    return " ".join(words)


def ranking(diagnosis: dict[str, Any], candidates: Sequence[Candidate]) -> Table:
    """The candidates, best first."""
    rows = [
        [
            candidate.effect,
            f"{candidate.visible_percent:.0f} %",
            "-" if candidate.score is None else f"{candidate.score:.1f}",
            probability(candidate.p_adjusted),
            f"{candidate.chi2_drop:.1f}",
            ", ".join(map(size_words, candidate.sizes)),
            verdict_facts.remark(diagnosis, candidate),
        ]
        for candidate in candidates
    ]
    return table(
        ("effect", "visible", "score", "p adjusted", "chi² drop", "fitted size", "remark"), rows, (1, 2, 3, 4),
        "visible: share of the effect's signature that the calibration does not absorb; score: in standard errors",
    )  # fmt: skip


def size_words(size: Size) -> str:
    """A fitted size with its unit as declared."""
    text, unit = style.words(size.parameter, size.unit or "")
    return f"{text} {number(size.value, 3)} {unit}".removesuffix(" -")


def errors(diagnosis: dict[str, Any]) -> Table | None:
    """What each explanation that a verdict names would do to the error; None where it names none."""
    found = facts.errors(diagnosis)
    if not found:
        return None
    unit = style.unit_in_words(diagnosis["present"]["rms_error_unit"])
    rows = [
        [
            " + ".join(row["effects"]) or "nothing",
            number(row["chi2"]),
            row["dof"],
            probability(row["lack_of_fit_p"]),
            number(row["rms_error"], 3),
            number(row["holdout_rms_error"], 3),
            probability(row["holdout_p"]),
        ]
        for row in found
    ]
    head = ("added", "chi²", "dof", "lack of fit p", f"rms error ({unit})", "held out", "p of held out")
    caption = f"What each would do to the error of {facts.model_name(diagnosis['effects'])}"
    return table(head, rows, range(1, 7), caption)


def next_measurement(study: Study, diagnoses: Sequence[dict[str, Any]]) -> NextPart | None:
    """The measurement that the last diagnosis which has one proposes."""
    proposing = next((d for d in reversed(diagnoses) if d["next_measurement"]), None)
    proposal = facts.proposal(proposing) if proposing else None
    if proposing is None or proposal is None:
        return None
    units = study.units_of(proposal.rig) if proposal.rig in study.catalogue.rigs else study.units
    where = ", ".join(f"{declared(c, units)} {number(v)}" for c, v in proposal.conditions.items())
    rivals = "; ".join(
        f"{rival.explanation} predicts {number(rival.value, 3)} ± {number(rival.uncertainty, 2)}"
        for rival in proposal.predictions
    )
    why = facts.test_words(proposing["verdict"], proposal)
    return NextPart(
        words=f"{why[:1].upper()}{why[1:]}{proposal.rig}, {declared(proposal.observable, units)}, at {where}: {rivals}. "
        f"There {facts.apart_words(proposal)}.",
        pictures=[
            picture(
                figures.next_measurement(proposing["next_measurement"], study.acting()),
                "what each explanation predicts for the proposed measurement",
                "What each explanation predicts for one such reading; bars: ± 2 standard uncertainties, that of the reading included.",
            )
        ],
    )
