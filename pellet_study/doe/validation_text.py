"""The tests of validation runs in words."""

from pellet_study.doe.text import number, percent, probability
from pellet_study.doe.validation import BesidePrediction, Equivalence, WithinLimits


def equivalence_text(found: Equivalence, response: str = "") -> str:
    """The equivalence test, the t test beside it; `response` where there are several."""
    runs, target = found.runs, found.target
    known = (
        f"{target.mean:.5g} (taken as known)"
        if target.sd is None
        else f"{target.mean:.5g}, sd {target.sd:.4g}, n {target.n}"
    )
    low, high = found.interval
    confidence = 100 * (1 - 2 * found.alpha)
    lines = [
        f"{_head(response)} {runs.mean:.5g}, sd {runs.sd:.4g}, n {runs.n}; target {known}",
        f"  difference {found.difference:.4g}, {confidence:.0f} % interval {low:.4g} to {high:.4g}; margin "
        f"+-{found.margin:g}",
        f"  equivalence (two one-sided t tests): p {probability(found.p)}: "
        + ("equivalent within the margin" if found.equivalent else "equivalence is not shown"),
        f"  difference (t test): p {probability(found.p_difference)}: "
        + (
            "a difference is shown"
            if found.different
            else "no difference is shown, which does not show that there is none"
        ),
        f"  power to show equivalence if there is no difference: {found.power:.2f}"
        + (f"; 0.80 needs n = {found.n_for_power}" if found.n_for_power else "; no n of the runs alone reaches 0.80"),
    ]
    return "\n".join(lines)


def within_limits_text(found: WithinLimits, response: str = "") -> str:
    """The one-sided tests against the limits; `response` where there are several."""
    runs = found.runs
    lines = [f"{_head(response)} {number(runs.mean)}, sd {number(runs.sd, 4)}, n {runs.n}"]
    if not found.p:
        lines.append("  its goal has no limit, so there is none to test the mean against")
    for word, (limit, p) in found.p.items():
        verdict = "shown" if p < found.alpha else "not shown"
        lines.append(f"  mean {word} {number(limit)} (one-sided t test): p {probability(p)}: {verdict}")
    return "\n".join(lines)


def _head(response: str) -> str:
    return f"validation{f' of {response}' if response else ''}: runs mean"


def together_text(shown: dict[str, bool], untested: list[str], alpha: float) -> str:
    """Whether the goals of several responses are all shown to be met; the level of all is that of each test."""
    missing = [name for name, met in shown.items() if not met] + untested
    if missing:
        return f"all goals together: not shown, for want of {', '.join(missing)}"
    return f"all goals together: shown; where one of them is not met, all tests pass with a probability of {alpha:g} at most"


def beside_prediction_text(found: BesidePrediction) -> str:
    """The single runs beside what was predicted of them."""
    low, high = map(number, found.prediction)
    level, new = percent(found.level), " in a new block" if found.of_mean else ""
    text = f"  {found.inside} of {found.n} runs lie in the {level} prediction interval of one run{new}, {low} to {high}"
    if found.of_mean:
        low, high = map(number, found.of_mean)
        lies = "lies beyond" if found.contradicted else "lies in"
        text += (
            f"\n  their mean {number(found.mean)} {lies} the {level} prediction interval of it, {low} to {high}: all of them taken "
            "as made in one new block, with the scatter between blocks"
        )
    return text


def contradicted_text(found: BesidePrediction) -> str:
    """What to do where too few runs do."""
    what = (
        f"the mean of the {found.n} validation runs lies beyond what the model predicts of it in a new block ({percent(found.level)})"
        if found.of_mean
        else f"{found.inside} of {found.n} validation runs lie where the model predicts {percent(found.level)} of them (p "
        f"{probability(found.p)})"
    )
    return (
        f"{what}: whatever the tests say, it does not hold at this setting, or something has changed since its "
        "runs; repeat a run of the design to see which, and do not predict with it before"
    )
