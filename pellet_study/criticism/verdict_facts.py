"""What a verdict says and what stands beside it, each sentence once: text pages and the HTML report lay it out.

Every function takes a diagnosis as `answers` makes it, or as the JSON that a command left in the study.
"""

from pellet_study.criticism import facts, fit_facts
from pellet_study.criticism.facts import Candidate
from pellet_study.criticism.verdicts import Grade, Note, Verdict
from pellet_study.output.words import number, probability

UNSEEN = (Note.WRONG_SIGN, Note.NOT_SHOWN, Note.NOT_SIMULATED)
MISSING, TIED, PAIRED, EXPLAINS, AS_TIME, IMPLAUSIBLE, REFUSED, NOT_NEEDED, NOT_SEEN = (
    "missing",
    "tied",
    "explains only together with another",
    "explains, but clearly less well",
    "explains, as a drift with time does",
    "only at an implausible size",
    "does not explain",
    "not needed",
    "not seen in these data",
)
"""What a candidate of the ranking is to its verdict."""


def standing(diagnosis: dict, suspect: dict) -> str:
    """What a candidate is to the verdict: the words of the ranking's legend, of its table and of its caption."""
    name = suspect["effect"]
    if name in diagnosis["missing"]:
        return MISSING if len(diagnosis["missing"]) == 1 else PAIRED
    if name in diagnosis["tied"]:
        return TIED
    if any(name in pair for pair in diagnosis["tied"] if not isinstance(pair, str)):
        return PAIRED
    if suspect["note"] == Note.IMPLAUSIBLE_SIZE:
        return IMPLAUSIBLE
    if suspect["note"] in UNSEEN:
        return NOT_SEEN
    if diagnosis["verdict"] == Verdict.ADEQUATE:
        return NOT_NEEDED
    if diagnosis["verdict"] == Verdict.UNEXPLAINED and suspect["explains"]:
        return AS_TIME if diagnosis.get("by_time") else REFUSED
    return EXPLAINS if suspect["explains"] else REFUSED


def remark(diagnosis: dict, candidate: Candidate) -> str:
    """What speaks for or against a candidate, and from which size on it would be noticed where it was not.

    The latter is reckoned about the present model, so that it is said of one that does not fit, or below a larger fitted
    size, nowhere.
    """
    suspect = next(s for s in diagnosis["ranking"] if s["effect"] == candidate.effect)
    stands = standing(diagnosis, suspect)
    words = candidate.note or {MISSING: "explains", TIED: "explains"}.get(stands, stands)
    if candidate.beyond:
        words += f": would need {', '.join(f'{k} = {number(v, 3)}' for k, v in candidate.beyond.items())}"
        if candidate.beyond_chi2_drop is not None:
            words += f" (then chi2 drop {candidate.beyond_chi2_drop:.1f})"
    size = abs(candidate.sizes[0].value) if candidate.sizes else 0.0
    fails = (diagnosis.get("fit") or {}).get("grade") == Grade.FAILS
    if candidate.unseen and candidate.noticed_from is not None and not fails and size < abs(candidate.noticed_from):
        words += f"; from {number(candidate.noticed_from, 3)} on it would be noticed"
    return words


def heading(diagnosis: dict) -> str:
    """The name of a verdict; of one that leaves the model as it is, that rows held out contradict it."""
    contradicted = diagnosis.get("holdout_contradicts") and diagnosis["verdict"] == Verdict.ADEQUATE
    return (
        f"{diagnosis['verdict']}, but contradicted by the rows held out" if contradicted else str(diagnosis["verdict"])
    )


def headline(diagnosis: dict) -> str:
    """A verdict where nothing more is said of it: with what speaks against one that leaves the model as it is."""
    words = heading(diagnosis)
    doubtful = diagnosis["verdict"] == Verdict.ADEQUATE and fit_facts.grade(diagnosis) == Grade.DOUBTFUL
    return f"{words}, though the fit is doubtful" if doubtful and words == Verdict.ADEQUATE else words


def nothing_next(diagnosis: dict) -> str:
    """Why no further measurement is proposed."""
    why = {
        Verdict.MISSING: "nothing has to be told apart",
        Verdict.ADEQUATE: "no effect is named, so that nothing has to be told apart",
        Verdict.TIED: "none within the possible conditions separates the explanations that are tied",
        Verdict.UNEXPLAINED: "no candidate explains the data, so that there are none to tell apart",
        Verdict.UNDECIDED: "the verdict is undecided",
    }[Verdict(diagnosis["verdict"])]
    if diagnosis.get("holdout_contradicts") and diagnosis["verdict"] == Verdict.ADEQUATE:
        why = "no effect is named; but the rows held out contradict the model, and fitted too they may tell why"
    return f"No further measurement is proposed: {why}."


def verdict(diagnosis: dict) -> str:
    """A verdict in words, without its name: what is missing or tied, and how the rows held out stand to it."""
    found = facts.finding(diagnosis)
    drifts = "".join(f" and a drift of {one['observable']} with time" for one in diagnosis.get("by_time") or [])
    match found.verdict:
        case Verdict.MISSING:
            words = found.names
        case Verdict.TIED:
            words = f"{found.names}{drifts} each explain it; these data cannot tell them apart{faint_words(diagnosis)}"
        case Verdict.UNDECIDED:
            words = facts.limited_words(diagnosis) or "a fit on which the answer rests did not end (see the notes)"
        case Verdict.UNEXPLAINED:
            words = "the model fails, and no candidate of a plausible size repairs it"
            if not diagnosis["ranking"]:
                words = "the model fails, and there is no candidate that could repair it"
        case _:
            return fit_facts.adequacy({**(diagnosis.get("present") or {}), **diagnosis})
    return words + held_out_too(diagnosis)


def faint_words(diagnosis: dict) -> str:
    """Which of those named the constants imitate almost wholly, so that the data hardly show it; empty where none is."""
    names = diagnosis.get("faint") or []
    shares = {s["effect"]: 100 * s["visible_share"] for s in diagnosis["ranking"] if s["effect"] in names}
    said = " and ".join(f"of {name} only {number(shares[name], 2)} %" for name in names)
    return f" ({said} shows beside the constants, too little to be seen by itself)" if said else ""


def held_out_too(diagnosis: dict) -> str:
    """That the rows held out contradict the model that is diagnosed, and what they say of the explanations."""
    if not diagnosis.get("holdout_contradicts"):
        return ""
    without = " without it" if diagnosis["verdict"] in (Verdict.MISSING, Verdict.TIED) else ""
    said = f"; the rows held out contradict the model{without} (p {probability(diagnosis['holdout_p'])}; the limit is "
    said += f"{diagnosis['holdout_limit_p']:g})"
    groups: dict[str, list[str]] = {
        "contradict it too with": [],
        "agree with it with": [],
        "cannot be held against it with": [],
    }
    for rival in diagnosis.get("rivals") or []:
        judged = "contradict it too with" if rival["holdout_contradicts"] else "agree with it with"
        words = judged if rival["holdout_p"] is not None else "cannot be held against it with"
        groups[words].append(" + ".join(rival["effects"]))
    for words, names in groups.items():
        said += f"; they {words} {' and with '.join(names)}" if names else ""
    return said


def beside(diagnosis: dict) -> list[str]:
    """What stands beside a verdict: a row that is alone in it, what would change it, the nearest miss or the worst row."""
    lines = [one["words"] for one in diagnosis.get("drifting") or []]
    lines += ["an amount that drifts is no constant: `refine` does not add it, `add` does"] if lines else []
    lines.append(fit_facts.lone_words(diagnosis))
    lines += [facts.time_words(diagnosis), facts.fitted_too_words(diagnosis), facts.undone_words(diagnosis)]
    if diagnosis.get("nearest_miss") is not None:
        lines.append(f"nearest: {facts.miss_words(diagnosis)}")
    elif diagnosis["verdict"] == Verdict.UNEXPLAINED and diagnosis.get("worst_row"):
        lines.append(f"the worst row is {diagnosis['worst_row']['words']}")
    return [line for line in lines if line]


def fit_too(diagnosis: dict) -> str:
    """What to do before the next command where the rows held out contradict the model and could tell more; else empty."""
    found = diagnosis["fitted_too"]
    if found is not None and found.get("drifting"):
        return ""
    if found is not None:
        return f"set split to fit in the rows {facts.places(found['conditions'])}"
    judged = [rival["holdout_contradicts"] for rival in diagnosis.get("rivals") or []]
    tells = diagnosis["verdict"] == Verdict.ADEQUATE or (diagnosis["verdict"] == Verdict.TIED and any(judged))
    return "set split to fit in some of the rows held out" if tells and diagnosis["holdout_contradicts"] else ""
