"""The readable page of each answer: what `facts` says of it, laid out as text; printed by the commands."""

from collections.abc import Sequence

from pellet_study.criticism import answers, facts, fit_facts, verdict_facts
from pellet_study.criticism.compare import Comparison
from pellet_study.criticism.diagnose import Diagnosis
from pellet_study.criticism.facts import Candidate, Proposal
from pellet_study.criticism.fit_facts import Constant
from pellet_study.criticism.grades import RULE
from pellet_study.criticism.refine import Refinement
from pellet_study.criticism.used_sd import AS_STATED, UsedSd, used_words
from pellet_study.output.style import unit_in_words
from pellet_study.output.terminal import fold
from pellet_study.output.words import flush, number, probability, width
from pellet_study.rigs.catalogue import Catalogue
from pellet_study.study.study import Study

LEGEND = (
    "(visible: share of its change that no constant imitates; score: of its shape, in standard errors; p adj.: over all "
    "candidates; chi2 drop: when it is fitted)"
)
MOST_ROWS = 40  # of a table; the worst where there are more


def comparison_page(study: Study, compared: Comparison) -> str:
    """One page: the fit, where it fails, the constants, every row."""
    answer = answers.comparison(compared)
    fitted = sum(row["split"] == "fit" for row in answer["rows"])
    constants = fit_facts.constants(answer)
    room = width([constant.name for constant in constants], 40)
    left_out = f", {len(compared.left_out)} left out" if compared.left_out else ""
    lines = [
        f"{study.title}: {fitted} rows fitted, {len(compared.rows) - fitted} held out{left_out}; rigs {', '.join(study.rigs)}",
        f"model: {facts.model_name(compared.effects)}",
        *assumed_lines(study, answer),
        "",
        *fit_lines(answer),
        "",
        "WHERE  " + "\n       ".join(fit_facts.where_words(answer)),
        "",
        f"{'constant':{room}s}{'value':>10s}   95 % interval",
        *(line for constant in constants for line in constant_lines(constant, room)),
        "",
        *rows_table(answer["rows"], [row.row.note for row in compared.rows]),
        *left_out_lines(answer["left_out"]),
        *warning_lines(compared.warnings),
    ]
    return fold(lines)


def assumed_lines(study: Study, comparison: dict) -> list[str]:
    """What the answer rests on that no file of the study says, and whether equal rows differ more than they may."""
    words = facts.assumed_words(study)
    if not words:
        return []
    too = fit_facts.assumed_too(comparison, study.assumed_conditions)
    return [f"assumed: {words} (defaults, as no file of the study gives them)" + (f"; {too}" if too else "")]


def graded_lines(comparison: dict) -> list[str]:
    """How well a model fits, and by which rule."""
    fit = fit_facts.fit_words(comparison)
    if fit is None:
        return ["FIT    neither sd nor replicates: how well the model fits cannot be judged from these data"]
    return [f"FIT    chi2 = {number(comparison['chi2'])} on {comparison['dof']}; {fit}", f"       rule: {RULE}"]


def fit_lines(comparison: dict) -> list[str]:
    """How well a model fits, by which rule, and its error."""
    lines = graded_lines(comparison)
    if comparison["chi2"] is not None:
        excuse = [
            f"{rig} {number(float(f'{percent:.2g}'), 9)} %"
            for rig, percent in comparison["needed_setup_percent"].items()
        ]
        lines += noise_lines(comparison)
        lines.append(f"       set-up scatter that would excuse it: {', '.join(excuse)}")
    if comparison["rms_error"] is not None:
        held_out = comparison["holdout_rms_error"]
        lines.append(
            f"       rms error {error_words(comparison['rms_error'], comparison['rms_error_unit'])}"
            f"{'' if held_out is None else f'; held out {number(held_out, 3)}'}"
        )
    lines += [f"       scatter: {one['words']}" for one in comparison["scatter"]]
    if comparison["holdout_p"] is not None:
        lines.append(f"       rows held out: {fit_facts.held_out_words(comparison)}")
    return lines


def noise_lines(comparison: dict) -> list[str]:
    """What errors are the readings' and what the simulations'; nothing where none simulates."""
    said = fit_facts.noise_words(comparison)
    return [f"       error of a row: {said}"] if said else []


def error_words(error: float, unit: str) -> str:
    """An error with its unit; a number has none."""
    return number(error, 3) + ("" if unit in ("1", "") else f" {unit_in_words(unit)}")


def constant_lines(constant: Constant, room: int) -> list[str]:
    """A constant and its interval, and below what is wrong with it."""
    line = f"{constant.name:{room}s}{flush(number(constant.value), 10)}   "
    if constant.interval is None:
        return [f"{line}fixed"]
    return [f"{line}{' to '.join(map(number, constant.interval))}", *(f"    {words}" for words in constant.remarks)]


def columns_used(row: dict) -> str:
    """What the fit takes of a row beside its value and conditions: `sd 0.5, n 3, setup a, setup_sd 0.2`."""
    parts = [used_words(row["sd"], UsedSd(row.get("sd_used"), row.get("sd_from") or AS_STATED))]
    parts = list(filter(None, parts)) or ([] if row["sd"] is None else [f"sd {number(row['sd'], 3)}"])
    parts += [f"n {row['n']}"] if row["n"] > 1 else []
    parts += [f"setup {row['setup']}"] if row["setup"] else []
    parts += [f"setup_sd {number(row['setup_sd'], 3)}"] if row["setup_sd"] else []
    return ", ".join([*parts, *(f"{name} {number(value)}" for name, value in row["parameters"].items())])


def left_out_lines(rows: Sequence[dict]) -> list[str]:
    """Rows that nothing is made of, and why."""
    if not rows:
        return []
    lines = ["", "left out (split leave_out): used for nothing"]
    room = width([row["rig"] for row in rows], 18)
    for row in rows:
        conditions = ", ".join(f"{c} {number(v)}" for c, v in row["conditions"].items())
        lines.append(f"{row['rig']:{room}s}{flush(number(row['value']), 10)}  {conditions}: {row['reason']}")
    return lines


def rows_table(rows: Sequence[dict], notes: Sequence[str], most: int = MOST_ROWS) -> list[str]:
    """Every row with its residual, the worst where there are many; a row's note where none of its conditions varies."""
    room = width([row["rig"] for row in rows], 18)
    head = f"{'rig':{room}s}{'measured':>10s}{'predicted':>11s}{'z':>7s}  conditions"
    varied = {name for names in facts.varying(rows).values() for name in names}
    shown = list(zip(rows, notes, strict=True))
    if len(rows) > most:
        shown = sorted(shown, key=lambda item: facts.misfit(item[0]), reverse=True)[:most]
        head += f"   (the worst {most} of {len(rows)})"
    lines, used = [head], {columns_used(row) for row in rows}
    for row, note in shown:
        parts = [f"{c} {number(v)}" for c, v in row["conditions"].items() if c in varied] or [note]
        conditions = ", ".join(filter(None, [*parts, columns_used(row) if len(used) > 1 else ""]))
        z = "-" if row["z"] is None else f"{row['z']:.1f}"
        held_out = "  held out" if row["split"] == "holdout" else ""
        lines.append(
            f"{row['rig']:{room}s}{flush(number(row['value']), 10)}{flush(number(row['predicted']), 11)}{flush(z, 7)}  "
            f"{conditions}{held_out}"
        )
    if len(used) == 1 and (same := used.pop()):
        lines.append(f"in every row: {same}")
    return lines


def warning_lines(warnings: Sequence[str]) -> list[str]:
    """Warnings at the foot of a page."""
    return ["", *(f"NOTE   {warning}" for warning in dict.fromkeys(warnings))] if warnings else []


def size_words(candidate: Candidate) -> str:
    """The fitted size against its physical range."""
    parts = []
    for size in candidate.sizes:
        low, high = size.physical or (None, None)
        unit = "" if size.unit in ("1", None) else f" {size.unit}"
        parts.append(
            f"{size.parameter} = {number(size.value, 3)} (physical {number(low, 3)} to {number(high, 3)}{unit})"
        )
    return ", ".join(parts)


def ranking_table(catalogue: Catalogue, answer: dict) -> list[str]:
    """The candidates, best first."""
    candidates = facts.candidates(catalogue, answer)
    room = width([candidate.effect for candidate in candidates], 28)
    lines = [f"{'effect':{room}s}{'visible':>8s}{'score':>8s}{'p adj.':>9s}{'chi2 drop':>11s}"]
    for candidate in candidates:
        share = f"{candidate.effect:{room}s}{candidate.visible_percent:7.0f}%"
        if candidate.score is None and candidate.note:
            lines += [f"{share}{'-':>8s}{'-':>9s}{'-':>11s}", f"    {candidate.note}"]
            continue
        remark = verdict_facts.remark(answer, candidate)
        lines += [
            f"{share}{flush('-' if candidate.score is None else f'{candidate.score:.1f}', 8)}{probability(candidate.p_adjusted):>9s}{flush(f'{candidate.chi2_drop:.1f}', 11)}",
            f"    {size_words(candidate)}{'; ' + remark if remark else ''}",
        ]
    return [*lines, LEGEND]


def next_words(proposal: Proposal) -> str:
    """The next measurement in a sentence."""
    conditions = ", ".join(f"{c} {number(v)}" for c, v in proposal.conditions.items())
    rivals = "; ".join(
        f"{rival.explanation} predicts {number(rival.value, 3)} +- {number(rival.uncertainty, 2)}"
        for rival in proposal.predictions
    )
    return f"{proposal.rig} {proposal.observable} at {conditions}: {rivals}"


def answer_lines(study: Study, diagnosed: Diagnosis) -> list[str]:
    """The verdict, what each named effect is, and what to measure next."""
    answer = answers.diagnosis(diagnosed)
    finding = facts.finding(answer)
    lines = [f"ANSWER {verdict_facts.heading(answer)}: {verdict_facts.verdict(answer)}"]
    lines += [f"       {line}" for line in (*verdict_facts.beside(answer), *errors_table(answer))]
    for effect in facts.described(study.catalogue, finding.effects):
        lines.append(f"       {effect.name}: {effect.means}. {effect.formula}  [{effect.source}]")
        lines += [f"         would show in {rig}: {where}" for rig, where in effect.rigs.items()]
    if diagnosed.alike_but_implausible:
        lines.append(
            f"       by the shape of the misfit alone {' and '.join(diagnosed.alike_but_implausible)} "
            "would explain it as well, "
            "but only at a size beyond the physical range"
        )
    proposal = facts.proposal(answer)
    if proposal is not None:
        lines += ["", f"NEXT   {facts.test_words(answer['verdict'], proposal)}{next_words(proposal)}"]
        lines += [f"       there {facts.apart_words(proposal)}"] if len(proposal.predictions) > 2 else []
    return lines


def errors_table(answer: dict) -> list[str]:
    """What each explanation would do to the error, beside the present model."""
    rows = facts.errors(answer)
    if not rows:
        return []
    unit = answer["present"]["rms_error_unit"]
    said = "" if unit in ("1", "") else f" (rms in {unit_in_words(unit)})"
    room = width([" + ".join(row["effects"]) for row in rows], 27)
    lines = [
        f"what each would do to the error{said}",
        f"{'added':{room}s}{'chi2':>9s}{'rms':>8s}{'held out':>10s}{'its p':>9s}",
    ]
    for row in rows:
        lines.append(
            f"{' + '.join(row['effects']) or 'nothing':{room}s}{flush(number(row['chi2']), 9)}"
            f"{flush(number(row['rms_error'], 3), 8)}{flush(number(row['holdout_rms_error'], 3), 10)}"
            f"{flush(probability(row['holdout_p']), 9)}"
        )
    return lines


def gate_lines(diagnosed: Diagnosis) -> list[str]:
    """Whether any candidate is needed; nothing where there is none."""
    if not diagnosed.ranking:
        return []
    needed = f"       is any candidate needed? p {probability(diagnosed.gate_p)} over all candidates together"
    return [f"{needed}; one is below {diagnosed.gate:g}"]


def diagnosis_page(study: Study, diagnosed: Diagnosis, assumed: bool = True) -> str:
    """One page: where it fails, the ranking, the answer; what is assumed on top unless that stands above it."""
    comparison = answers.comparison(diagnosed.comparison)
    lines = [
        f"{study.title}: model {facts.model_name(comparison['effects'])}",
        *(assumed_lines(study, comparison) if assumed else []),
        *graded_lines(comparison),
        *noise_lines(comparison),
        *gate_lines(diagnosed),
        *(f"{'       ' if k else 'WHERE  '}{words}" for k, words in enumerate(fit_facts.failures(comparison)[:4])),
        "",
        *([*ranking_table(study.catalogue, answers.diagnosis(diagnosed)), ""] if diagnosed.ranking else []),
        *answer_lines(study, diagnosed),
    ]
    return fold([*lines, *warning_lines(diagnosed.warnings)])


def ladder(steps: Sequence[dict]) -> list[str]:
    """The error falling step by step."""
    lines = [f"{'step':>4s}{'chi2':>10s}{'dof':>5s}{'lack of fit p':>15s}{'rms':>9s}{'held out':>10s}  effects"]
    for step in facts.ladder(steps):
        lines += [f"{'':6s}measured: {words}" for words in step.measured]
        lines.append(
            f"{step.number:4d}{flush(number(step.chi2), 10)}{step.dof:5d}{probability(step.lack_of_fit_p):>15s}"
            f"{flush(number(step.rms_error, 3), 9)}"
            f"{flush(number(step.holdout_rms_error, 3), 10)}  {', '.join(step.effects) or 'base'}"
        )
        for place, error in step.level_out.items():
            lines.append(f"{'':9s}each level of {place} predicted from the others: rms {number(error, 3)}")
    return lines


def refinement_page(study: Study, refined: Refinement, steps: Sequence[dict]) -> str:
    """One page: the ladder and the last diagnosis."""
    added = ", ".join(refined.added) or "nothing"
    lines = [
        f"{study.title}: added {added}; verdict {verdict_facts.headline(answers.diagnosis(refined.last))}",
        *assumed_lines(refined.study, steps[0]),
        "",
        *ladder(steps),
        "",
    ]
    for k, diagnosis in enumerate(refined.diagnoses):
        lines += [f"--- diagnosis {k + 1}", diagnosis_page(refined.study, diagnosis, assumed=False), ""]
    return fold(lines).rstrip()
