"""What `bench` found, as tables, figures, text and JSON."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from pellet_study.bench import figures, parabola
from pellet_study.bench.chain import STAGES, Calibrated, Mean, Reading
from pellet_study.errors import InputError
from pellet_study.output import style
from pellet_study.paper import printed as paper

PAPER_MEASURED = {"a1": "b1_physical_mm", "a2": "b2_physical_deg", "a3": "b3_physical_mm"}
PAPER_FOUND = {"a1": "a1_solution", "a2": "a2_solution", "a3": "a3_solution"}


def answer(results: Sequence[Calibrated]) -> dict:
    """The stages as JSON."""
    return {"stages": [_stage(result) for result in results]}


def _stage(result: Calibrated) -> dict:
    stage, check = result.stage, result.verification
    return {
        "rig": stage.rig,
        "parameter": stage.parameter,
        "value": result.value,
        "interval": [_number(x) for x in result.interval],
        "r2": result.curve.r2,
        "coefficients": [float(c) for c in result.curve.coefficients],
        "coefficient_intervals": [[float(x) for x in pair] for pair in result.curve.intervals],
        "observable": stage.observable,
        "measured": result.reading.value,
        "verification": check and check.value,
        "verification_standard_error": check and check.standard_error,
        "verification_error_percent": result.verification_error_percent,
        "joint_prediction": result.joint and result.joint.value,
    }


def _number(x: float) -> float | None:
    return float(x) if np.isfinite(x) else None


def write_runs(runs: Sequence[pd.DataFrame], file: Path) -> None:
    """Every simulation of a call as one table, sorted by case id; written whole or not at all."""
    together = pd.concat(runs).drop_duplicates("id").sort_values("id")
    temporary = file.with_suffix(".csv.new")
    together.to_csv(temporary, index=False, lineterminator="\n")
    temporary.replace(file)


def write(results: Sequence[Calibrated], folder: Path, contact_law: str) -> str:
    """Write sweeps, calibration, figures and summary into the study; returns the summary."""
    table = []
    for stage in STAGES:  # what an earlier call with other measurements left
        (folder / f"sweep_{stage.rig}.csv").unlink(missing_ok=True)
        (folder / "figures" / f"{stage.rig}.png").unlink(missing_ok=True)
    for result in results:
        stage = result.stage
        result.sweep.round(6).to_csv(folder / f"sweep_{stage.rig}.csv", index=False, lineterminator="\n")
        style.save(figure(result), folder / "figures" / f"{stage.rig}.png")
        record = _stage(result)
        low, high = record.pop("interval")
        coefficients = dict(zip(("c0", "c1", "c2"), record.pop("coefficients"), strict=True))
        record.pop("coefficient_intervals")
        table.append({**record, "interval_low": low, "interval_high": high, **coefficients})
    pd.DataFrame(table).to_csv(folder / "calibration.csv", index=False, lineterminator="\n", float_format="%.6g")
    text = summary(results, contact_law)
    (folder / "summary.txt").write_text(text + "\n", encoding="utf-8")
    return text


def figure(result: Calibrated):
    """The sweep of a stage, the paper's rows beside it where they are printed."""
    rows, curve = _printed(result.stage.table)
    return figures.sweep(result, *(rows if rows else (None, None)), curve)


def read(folder: Path) -> list[Calibrated]:
    """The stages as `write` left them in a study (sds and conditions of the readings are not kept there).

    Raises
    ------
    InputError : a file is not what was written
    """
    file = folder / "calibration.csv"
    found = []
    try:
        for record in pd.read_csv(file).to_dict(orient="records"):
            stage = next(s for s in STAGES if s.rig == record["rig"])
            file = folder / f"sweep_{stage.rig}.csv"
            sweep = pd.read_csv(file)
            check = None
            if np.isfinite(record["verification"]):
                check = Mean(record["verification"], record["verification_standard_error"], 0, 0)
            found.append(
                Calibrated(
                    stage,
                    Reading(record["measured"], None, 1, {}),
                    sweep,
                    parabola.fit(sweep[stage.parameter].to_numpy(), sweep[stage.observable].to_numpy()),
                    _number(record["value"]),
                    (record["interval_low"], record["interval_high"]),
                    check,
                )
            )
    except (OSError, ValueError, KeyError, StopIteration) as error:
        raise InputError(f"{file}: is not what `bench` wrote ({error}); run `pellet-study bench` again") from None
    return found


def _printed(number: int | None):
    """The paper's rows of a bench table and the parabola through them."""
    if number is None:
        return None, None
    rows = paper.table(number)
    x, y = rows.iloc[:, 1].to_numpy(float), rows.iloc[:, 2].to_numpy(float)
    return (x, y), parabola.fit(x, y)


def summary(results: Sequence[Calibrated], contact_law: str) -> str:
    """The calibration in words: each stage, the paper beside, what differs."""
    printed = paper.tables()["text"]
    lines = [f"Bench calibration, contact law {contact_law}, one stage after the other as in the paper", ""]
    lines.append("test               ours      95 % interval  paper     verification         error")
    for result in results:
        stage, check = result.stage, result.verification
        unit = stage.observable.rsplit("_", 1)[1]
        if result.value is None:
            lines.append(f"{stage.rig + ' ' + stage.symbol:16s}  not reached inside the sweep")
            continue
        interval = f"{result.interval[0]:.4f} to {result.interval[1]:.4f}"
        there = f"{check.value:.2f}+-{check.standard_error:.2f} {unit}"
        error = f"{result.verification_error_percent:.2f}+-{100 * check.standard_error / result.reading.value:.2f} %"
        lines.append(
            f"{stage.rig + ' ' + stage.symbol:16s} {result.value:6.4f}  {interval:>17s}  "
            f"{printed[PAPER_FOUND[stage.symbol]]:.3f}  {there:>15s}  {error:>12s}"
        )
    for result in results:
        lines += ["", *_details(result)]
    lines += ["", *_joint(results)]
    return "\n".join(lines)


def _equation(curve: parabola.Quadratic, symbol: str) -> str:
    c0, c1, c2 = curve.coefficients
    return f"{c0:.5g} {c1:+.5g} {symbol} {c2:+.5g} {symbol}^2   R2 = {curve.r2:.5f}"


def _details(result: Calibrated) -> list[str]:
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
    rows, printed = _printed(stage.table)
    if printed is not None:
        lines.append(f"  paper  {_equation(printed, stage.symbol)}   (recomputed from Table {stage.table})")
        x, y = rows
        ours = result.sweep[stage.observable].to_numpy()
        slopes = _log_slopes(result)
        gap = np.sqrt(np.mean((ours - y) ** 2))
        lines.append(
            f"  log-log slope over the sweep: paper {slopes[0]:.2f}, ours {slopes[1]:.2f}; rms difference {gap:.3g}"
        )
    lines.append(f"  sweep reaches {low:.4g} to {high:.4g}" + (f"; {failed} runs failed" if failed else ""))
    if result.value is None:
        lines.append(
            f"  the measurement {result.reading.value:g} is not met between {curve.low:g} and {curve.high:g}: "
            "check the rig's conditions in measurements.csv (apparatus dimensions are inferred, not printed)"
        )
    return lines + _precision(result) + _remark(result)


def _precision(result: Calibrated) -> list[str]:
    """What the verification error can tell, given its own standard error."""
    check, measured = result.verification, result.reading.value
    if check is None:
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


def _remark(result: Calibrated) -> list[str]:
    """What the difference from the paper suggests; only for the paper's own readings."""
    stage = result.stage
    printed = paper.tables()["text"]
    if result.reading.value != printed[PAPER_MEASURED[stage.symbol]]:
        return []
    if stage.rig == "slope_slip" and result.value is not None:
        tangent, found = np.tan(np.radians(result.reading.value)), printed[PAPER_FOUND[stage.symbol]]
        lines = [
            f"  a sliding seed gives tan({result.reading.value:g} deg) = {tangent:.4f}; the paper's {found:g} would slide at"
        ]
        lines.append(f"  {np.degrees(np.arctan(found)):.2f} deg")
        if found > 1.02 * result.value:
            lines[-1] += ": its seed must have started to tip or roll before it slid"
        return lines
    if stage.rig == "rebound":
        slopes = _log_slopes(result)
        lines = ["  a rigid central bounce would rise as a1^2 (log-log slope 2)"]
        if max(slopes) < 1.8:
            lines[0] += "; here a seed that lands tilted turns part of"
            lines.append(
                "  its fall into spin, and spin into height at a second touch, whatever a1 is: the curve is flatter"
            )
        return lines
    return []


def _log_slopes(result: Calibrated) -> tuple[float, float]:
    """Slope of log reading over log parameter across the sweep: the paper's, ours."""
    (x, y), _ = _printed(result.stage.table)
    ours = result.sweep[result.stage.observable].to_numpy()
    return tuple(float(np.polyfit(np.log(x), np.log(np.maximum(v, 1e-9)), 1)[0]) for v in (y, ours))


def _joint(results: Sequence[Calibrated]) -> list[str]:
    """Each rig with every calibrated parameter switched on, which the stage-by-stage way never looks at."""
    if any(result.joint is None for result in results):
        return []
    lines = ["All calibrated parameters at once (the paper sets those of later stages to 0 and never looks back):"]
    for result in results:
        joint, reading = result.joint, result.reading
        lines.append(
            f"  {result.stage.rig:14s} measured {reading.value:g}, predicted {joint.value:.2f} +- {joint.standard_error:.2f}"
            f" ({100 * (joint.value / reading.value - 1):+.1f} %)"
        )
    first = results[0]
    if first.stage.rig == "rebound" and abs(first.joint.value / first.reading.value - 1) > 0.05:
        lines.append(
            "  So the paper's statement that a2 and a3 do not affect the rebound does not hold for a seed that is no sphere."
        )
    return lines
