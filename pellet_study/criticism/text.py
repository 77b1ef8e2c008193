"""The readable page of each answer: strings made from results, printed by the commands."""

from collections.abc import Sequence

from pellet_study.criticism.compare import HELD_OUT_FAILS, Comparison
from pellet_study.criticism.diagnose import Diagnosis
from pellet_study.criticism.next_measurement import NextMeasurement
from pellet_study.criticism.ranking import Suspect
from pellet_study.criticism.refine import Refinement
from pellet_study.criticism.score_tests import Drift
from pellet_study.output.style import unit_in_words
from pellet_study.output.terminal import folded
from pellet_study.output.words import number, probability
from pellet_study.study.study import Study

LEGEND = (
    "(visible: share of its change that no constant imitates; score: of its shape, in standard errors; p adj.: over all "
    "candidates; chi2 drop: when it is fitted)"
)


def drift_words(drift: Drift) -> str:
    """Where it fails: `internal_friction would have to fall with layer_height_mm (layer_on_incline), z = -8.7`."""
    if drift.condition == "rig":
        what = (
            f"{drift.parameter} would have to be {'higher' if drift.z > 0 else 'lower'} in {drift.rig} than elsewhere"
        )
    elif drift.shape == "bends":
        way = "upwards" if drift.z > 0 else "downwards"
        what = f"{drift.parameter} would have to bend {way} over {drift.condition} ({drift.rig})"
    else:
        what = (
            f"{drift.parameter} would have to {'rise' if drift.z > 0 else 'fall'} with {drift.condition} ({drift.rig})"
        )
    return f"{what}, z = {drift.z:.1f}, p {probability(drift.p)}"


def fit_words(judged: bool | None, holdout_p: float | None) -> str:
    """Does it fit?"""
    if judged is None:
        return "as many free parameters as different cases, so that any readings are met: the fit says nothing"
    if not judged:
        return "the model does not fit"
    if holdout_p is not None and holdout_p < HELD_OUT_FAILS:
        return "the model fits the rows it was calibrated on, but not those held out"
    return "the model fits within the scatter of the readings"


def where_it_fails(found: Comparison) -> list[str]:
    """Sentences on drifting constants."""
    return [drift_words(d) for d in found.drifts if d.p < 0.01]


def comparison_page(study: Study, found: Comparison) -> str:
    """One page: the fit, where it fails, the constants, every row."""
    fit_rows = [r for r in found.rows if r.row.split == "fit"]
    lines = [
        f"{study.title}: {len(fit_rows)} rows fitted, {len(found.rows) - len(fit_rows)} held out; "
        f"rigs {', '.join(study.rigs)}",
        f"model: base{''.join(' + ' + e for e in found.effects)}",
        "",
    ]
    if found.chi2 is None:
        lines.append("FIT    neither sd nor replicates: how well the model fits cannot be judged from these data")
    else:
        lines.append(
            f"FIT    chi2 = {number(found.chi2)} on {found.dof}; lack of fit p {probability(found.lack_of_fit_p)}: "
            f"{fit_words(found.judged, found.holdout_p)}"
        )
        excuse = [f"{rig} {number(percent, 2)} %" for rig, percent in found.needed_setup_percent.items()]
        lines.append(f"       set-up scatter that would excuse it: {', '.join(excuse)}")
    if found.rms_error is not None:
        held = "" if found.holdout_rms_error is None else f"; held out {number(found.holdout_rms_error, 3)}"
        lines.append(f"       rms error {number(found.rms_error, 3)} {unit_in_words(found.rms_error_unit)}{held}")
    words = where_it_fails(found)
    lines += [
        "",
        "WHERE  " + (("\n       ").join(words) if words else "no calibrated constant drifts with a condition"),
        "",
    ]
    lines.append(f"{'constant':40s}{'value':>10s}   95 % interval")
    for name, value in found.parameters.items():
        if name in found.intervals:
            low, high = found.intervals[name]
            remark = "   not identified" if name in found.not_identified else ""
            remark += "   at its bound" if name in found.at_bound else ""
            lines.append(f"{name:40s}{number(value):>10s}   {number(low)} to {number(high)}{remark}")
        else:
            lines.append(f"{name:40s}{number(value):>10s}   fixed")
    lines += ["", *rows_table(found)]
    return folded([*lines, *warning_lines(found.warnings)])


def rows_table(found: Comparison, most: int = 40) -> list[str]:
    """Every row with its residual; the worst where there are many."""
    rows = list(found.rows)
    head = f"{'rig':18s}{'measured':>10s}{'predicted':>11s}{'z':>7s}  conditions"
    if len(rows) > most:
        rows = sorted(rows, key=lambda r: -abs(r.z if r.z is not None else r.residual))[:most]
        head += f"   (the worst {most} of {len(found.rows)})"
    varied = {
        c for r in found.rows for c in r.row.conditions
        if len({o.row.conditions.get(c) for o in found.rows if o.row.rig == r.row.rig}) > 1
    }  # fmt: skip
    lines = [head]
    for r in rows:
        shown = ", ".join(f"{c} {number(v)}" for c, v in r.row.conditions.items() if c in varied) or r.row.note
        z = "-" if r.z is None else f"{r.z:.1f}"
        held = "  held out" if r.row.split == "holdout" else ""
        lines.append(f"{r.row.rig:18s}{number(r.row.value):>10s}{number(r.predicted):>11s}{z:>7s}  {shown}{held}")
    return lines


def warning_lines(warnings: Sequence[str]) -> list[str]:
    """Warnings at the foot of a page."""
    return ["", *(f"NOTE   {warning}" for warning in dict.fromkeys(warnings))] if warnings else []


def size_words(study: Study, suspect: Suspect) -> str:
    """The fitted size against its physical range."""
    effect = study.catalogue.effects[suspect.effect]
    parts = []
    for name, value in suspect.value.items():
        quantity = effect.parameters[name]
        low, high = quantity.get("physical", (quantity["min"], quantity["max"]))
        unit = "" if quantity["unit"] == "1" else f" {quantity['unit']}"
        parts.append(f"{name} = {number(value, 3)} (physical {number(low, 3)} to {number(high, 3)}{unit})")
    return ", ".join(parts)


def ranking_table(study: Study, found: Diagnosis) -> list[str]:
    """The candidates, best first."""
    lines = [f"{'effect':28s}{'visible':>8s}{'score':>8s}{'p adj.':>9s}{'chi2 drop':>11s}"]
    for s in found.ranking:
        share = f"{s.effect:28s}{100 * s.visible_share:7.0f}%"
        if s.score is None:
            lines += [f"{share}{'-':>8s}{'-':>9s}{'-':>11s}", f"    {s.note}"]
            continue
        remark = s.note or ("explains" if s.explains else "")
        if s.beyond:
            remark += f": would need {', '.join(f'{k} = {number(v, 3)}' for k, v in s.beyond.items())}"
            remark += f" (then chi2 drop {s.beyond_chi2_drop:.1f})" if s.beyond_chi2_drop is not None else ""
        if s.note == "wrong sign" or (s.p_adjusted or 1) > 0.05:
            smallest = (
                "" if s.smallest_visible is None else f"from {number(s.smallest_visible, 3)} on it would be noticed"
            )
            remark = "; ".join(filter(None, (remark, smallest)))
        lines += [
            f"{share}{s.score:8.1f}{probability(s.p_adjusted):>9s}{s.chi2_drop:11.1f}",
            f"    {size_words(study, s)}{'; ' + remark if remark else ''}",
        ]
    return [*lines, LEGEND]


def next_words(proposal: NextMeasurement) -> str:
    """The next measurement in a sentence."""
    conditions = ", ".join(f"{c} {number(v)}" for c, v in proposal.conditions.items())
    rivals = "; ".join(
        f"{name} predicts {number(value, 3)} +- {number(proposal.uncertainties[name], 2)}"
        for name, value in proposal.predictions.items()
    )
    return f"{proposal.rig} {proposal.observable} at {conditions}: {rivals}"


def adequate_words(found: Comparison) -> str:
    """What `adequate` is worth."""
    words = "no missing effect is supported by these data"
    if found.chi2 is None:
        return f"{words}; how well the model fits cannot be judged without sd or replicates"
    if found.judged is None:
        return f"{words}, which could show none"
    if found.holdout_p is not None and found.holdout_p < HELD_OUT_FAILS:
        return f"{words}, but the rows held out contradict the model: fit some of them too"
    return words


def answer_lines(study: Study, found: Diagnosis) -> list[str]:
    """The verdict, what each named effect is, and what to measure next."""
    catalogue = study.catalogue
    named = [e for names in ((found.missing,) if found.missing else found.tied) for e in names]
    if found.verdict == "adequate":
        lines = [f"ANSWER adequate: {adequate_words(found.comparison)}"]
    elif found.verdict == "unexplained":
        lines = ["ANSWER unexplained: the model fails, and no candidate of a plausible size repairs it"]
    elif found.verdict == "missing":
        lines = [f"ANSWER missing: {' and '.join(found.missing)}"]
    else:
        lines = [f"ANSWER tied: {' or '.join(' + '.join(names) for names in found.tied)} explain it alike"]
    for name in dict.fromkeys(named):
        effect = catalogue.effects[name]
        lines.append(f"       {name}: {effect.means}. {effect.formula}  [{effect.source}]")
        lines += [f"         would show in {rig}: {where}" for rig, where in effect.rigs.items()]
    if found.alike_but_implausible:
        lines.append(
            f"       by the shape of the misfit alone {' and '.join(found.alike_but_implausible)} "
            "would explain it as well, "
            "but only at a size beyond the physical range"
        )
    if found.next_measurement is not None:
        lines += ["", f"NEXT   {next_words(found.next_measurement)}"]
    return lines


def diagnosis_page(study: Study, found: Diagnosis) -> str:
    """One page: where it fails, the ranking, the answer."""
    c = found.comparison
    words = where_it_fails(c)
    lines = [
        f"{study.title}: model base{''.join(' + ' + e for e in c.effects)}",
        f"chi2 = {number(c.chi2)} on {c.dof}, lack of fit p {probability(c.lack_of_fit_p)}; "
        f"is any candidate needed? p {probability(found.gate_p)} (over all candidates together)",
        *(f"WHERE  {w}" for w in words[:3]),
        "",
        *ranking_table(study, found),
        "",
        *answer_lines(study, found),
    ]
    return folded([*lines, *warning_lines(found.warnings)])


def ladder(steps: Sequence[dict]) -> list[str]:
    """The error falling step by step."""
    lines = [f"{'step':>4s}{'chi2':>10s}{'dof':>5s}{'lack of fit p':>15s}{'rms':>9s}{'held out':>10s}  effects"]
    for k, s in enumerate(steps):
        lines.append(
            f"{k:4d}{number(s['chi2']):>10s}{s['dof']:5d}{probability(s['lack_of_fit_p']):>15s}"
            f"{number(s['rms_error'], 3):>9s}"
            f"{number(s['holdout_rms_error'], 3):>10s}  {', '.join(s['effects']) or 'base'}"
        )
        for place, error in (s.get("level_out_rms_error") or {}).items():
            lines.append(f"{'':9s}each level of {place} predicted from the others: rms {number(error, 3)}")
    return lines


def refinement_page(study: Study, found: Refinement, steps: Sequence[dict]) -> str:
    """One page: the ladder and the last diagnosis."""
    added = ", ".join(found.added) or "nothing"
    lines = [f"{study.title}: added {added}; verdict {found.verdict}", "", *ladder(steps), ""]
    for k, d in enumerate(found.diagnoses):
        lines += [f"--- diagnosis {k + 1}", diagnosis_page(found.study, d), ""]
    return folded(lines).rstrip()
