"""What `bench` found, in words: each stage, the paper beside, what differs."""

from collections.abc import Sequence

import numpy as np

from pellet_study.bench import printed
from pellet_study.bench.chain import BenchResult
from pellet_study.bench.parabola import Parabola

CAUTION = [
    "  a1 is of this law and not to be carried to another code: the damper takes the seed's whole mass, so that e holds for",
    "  central impacts only; what the other convention does to a1: results/checks/restitution_convention.csv",
]


def summary(results: Sequence[BenchResult], contact_law: str, at_contact: bool = False) -> str:
    """The calibration in words: each stage, the paper beside, what differs.

    Parameters
    ----------
    at_contact : whether the damper takes the mass effective at the contact, so that e holds at each
    """
    lines = [f"Bench calibration, contact law {contact_law}, one stage after the other as in the paper", ""]
    lines.append("test               ours      95 % interval  paper     verification         error")
    for result in results:
        stage, check = result.stage, result.verification
        unit = stage.observable.rsplit("_", 1)[1]
        if result.value is None or check is None:
            lines.append(f"{stage.rig + ' ' + stage.symbol:16s}  not reached inside the sweep")
            continue
        interval = f"{result.interval[0]:.4f} to {result.interval[1]:.4f}"
        there = f"{check.value:.2f}+-{check.standard_error:.2f} {unit}"
        error = f"{result.verification_error_percent:.2f}+-{100 * check.standard_error / result.reading.value:.2f} %"
        lines.append(
            f"{stage.rig + ' ' + stage.symbol:16s} {result.value:6.4f}  {interval:>17s}  "
            f"{printed.solution(stage):.3f}  {there:>15s}  {error:>12s}"
        )
    for result in results:
        lines += ["", *_details(result)]
        lines += CAUTION if result.stage.rig == "rebound" and not at_contact else []
    lines += ["", *_joint(results)]
    return "\n".join(lines)


def _equation(curve: Parabola, symbol: str) -> str:
    c0, c1, c2 = curve.coefficients
    return f"{c0:.5g} {c1:+.5g} {symbol} {c2:+.5g} {symbol}^2   R2 = {curve.r2:.5f}"


def _details(result: BenchResult) -> list[str]:
    stage, curve = result.stage, result.curve
    low, high = result.sweep[stage.observable].min(), result.sweep[stage.observable].max()
    failed = int(result.sweep["failed"].sum())
    lines = [
        f"{stage.rig} ({stage.symbol}), measured {result.reading.value:g}:",
        f"  ours   {_equation(curve, stage.symbol)}",
    ]
    lines += [
        f"         {name:9s} 95 % {a:.5g} to {b:.5g}"
        for name, (a, b) in zip(("constant", "linear", "quadratic"), curve.intervals, strict=True)
    ]
    paper = printed.sweep(stage)
    if paper is not None:
        lines.append(f"  paper  {_equation(paper.curve, stage.symbol)}   (recomputed from Table {stage.table})")
        theirs, ours = _log_slopes(result, paper)
        gap = np.sqrt(np.mean((result.sweep[stage.observable].to_numpy() - paper.y) ** 2))
        lines.append(f"  log-log slope over the sweep: paper {theirs:.2f}, ours {ours:.2f}; rms difference {gap:.3g}")
    lines.append(f"  sweep reaches {low:.4g} to {high:.4g}" + (f"; {failed} runs failed" if failed else ""))
    if result.value is None:
        lines.append(
            f"  the measurement {result.reading.value:g} is not met between {curve.low:g} and {curve.high:g}: "
            "check the rig's conditions in measurements.csv (apparatus dimensions are inferred, not printed)"
        )
    return lines + _precision(result) + _remark(result)


def _precision(result: BenchResult) -> list[str]:
    """What the verification error can tell, given its own standard error."""
    check, measured = result.verification, result.reading.value
    if check is None or result.value is None:
        return []
    known = 100 * check.standard_error / measured
    curve_error = float(result.curve.standard_error(result.value))
    difference = check.value - measured
    both = float(np.hypot(check.standard_error, curve_error))
    lines = []
    if abs(difference) > 0.01 * measured:
        share = abs(difference) / both
        meaning = "what scatter gives" if share < 2 else "more than scatter: the parabola does not follow the rig there"
        lines.append(
            f"  verification is off by {difference:+.2f}: {share:.1f} times the standard error of that difference (curve"
        )
        lines.append(f"  {curve_error:.2f}, verification {check.standard_error:.2f}), {meaning}")
    if known >= 0.5:
        needed = int(np.ceil(check.n * (known / 0.5) ** 2 / 100) * 100)
        one = check.standard_error * np.sqrt(check.n)
        lines.append(
            f"  one seed scatters with {one:.3g}: to know a mean to 0.5 % takes about {needed} seeds (--effort)"
        )
    return lines


def _remark(result: BenchResult) -> list[str]:
    """What the difference from the paper suggests; only for the paper's own readings."""
    stage = result.stage
    if result.reading.value != printed.measured(stage):
        return []
    if stage.rig == "slope_slip" and result.value is not None:
        return _slip_remark(result.reading.value, result.value, printed.solution(stage))
    paper = printed.sweep(stage)
    if stage.rig == "rebound" and paper is not None:
        lines = ["  a rigid central bounce would rise as a1^2 (log-log slope 2)"]
        if max(_log_slopes(result, paper)) < 1.8:
            lines[0] += "; here a seed that lands tilted turns part of"
            lines.append(
                "  its fall into spin, and spin into height at a second touch, whatever a1 is: the curve is flatter"
            )
        return lines
    return []


def _slip_remark(angle_deg: float, ours: float, paper: float) -> list[str]:
    """The tangent of the slip angle beside the paper's static friction."""
    tangent = np.tan(np.radians(angle_deg))
    lines = [f"  a sliding seed gives tan({angle_deg:g} deg) = {tangent:.4f}; the paper's {paper:g} would slide at"]
    lines.append(f"  {np.degrees(np.arctan(paper)):.2f} deg")
    if paper > 1.02 * ours:
        lines[-1] += ": its seed must have started to tip or roll before it slid"
    return lines


def _log_slopes(result: BenchResult, paper: printed.PrintedSweep) -> tuple[float, float]:
    """Slope of log reading over log parameter across the paper's levels: the paper's, ours."""
    ours = result.sweep[result.stage.observable].to_numpy()
    theirs, own = (float(np.polyfit(np.log(paper.x), np.log(np.maximum(v, 1e-9)), 1)[0]) for v in (paper.y, ours))
    return theirs, own


def _joint(results: Sequence[BenchResult]) -> list[str]:
    """Each rig with every calibrated parameter switched on, which the stage-by-stage way never looks at."""
    lines = ["All calibrated parameters at once (the paper sets those of later stages to 0 and never looks back):"]
    for result in results:
        joint, reading = result.joint, result.reading
        if joint is None:
            return []
        lines.append(
            f"  {result.stage.rig:14s} measured {reading.value:g}, predicted {joint.value:.2f} +- {joint.standard_error:.2f}"
            f" ({100 * (joint.value / reading.value - 1):+.1f} %)"
        )
    first = results[0]
    if first.joint and first.stage.rig == "rebound" and abs(first.joint.value / first.reading.value - 1) > 0.05:
        lines.append(
            "  So the paper's statement that a2 and a3 do not affect the rebound does not hold for a seed that is no sphere."
        )
    return lines
