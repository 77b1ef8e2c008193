"""What the seed bench tests left in a study folder, as parts of the report."""

from pathlib import Path

import pandas as pd

from pellet_study.bench import figures, printed, report
from pellet_study.bench.chain import BenchResult
from pellet_study.files import opening
from pellet_study.output.style import label, words
from pellet_study.report.parts import Stage, Table, picture, table


def bench_stages(folder: Path) -> list[Stage]:
    """The seed bench tests: one part with their table, then one a test."""
    if not (folder / "calibration.csv").exists():
        return []
    results = report.read(folder)
    together = Stage(
        kind="bench",
        heading="Seed bench tests",
        words=["One test after the other; parameters of later tests are off until their own, as in the source paper."],
        tables=[overview(results), *joint(folder)],
        short=in_short(results),
    )
    return [together, *map(sweep, results)]


def in_short(results: list[BenchResult]) -> str:
    """The parameters with their intervals, and how far off they leave each test."""
    found, errors = [], []
    for r in results:
        if r.value is None:
            found.append(f"{r.stage.rig} does not reach {r.reading.value:g} {words(r.stage.observable)[1]}")
            continue
        found.append(
            f"{r.stage.rig} {r.stage.symbol} = {r.value:.3g} (95 % {r.interval[0]:.3g} to {r.interval[1]:.3g}, source paper "
            f"{printed.solution(r.stage):g})"
        )
        if r.verification is not None:
            errors.append(f"{r.verification_error_percent:.1f}")
    off = f"; simulated there, they are {', '.join(errors)} % off the measurement" if errors else ""
    return f"Bench tests: {', '.join(found)}{off}."


def overview(results: list[BenchResult]) -> Table:
    """A row a test: its parameter beside the source paper's, and its verification."""
    rows = []
    for r in results:
        check = r.verification
        rows.append(
            [
                r.stage.rig,
                label(r.stage.parameter).replace("$", "").replace("_", ""),
                "not reached" if r.value is None else f"{r.value:.5f}",
                "-" if r.value is None else f"{r.interval[0]:.4f} to {r.interval[1]:.4f}",
                f"{printed.solution(r.stage):g}",
                f"{r.reading.value:g} {words(r.stage.observable)[1]}",
                "-" if check is None else f"{check.value:.2f} ± {check.standard_error:.2f}",
                "-" if check is None else f"{r.verification_error_percent:.2f} %",
            ]
        )
    head = (
        "test", "parameter", "ours", "95 % interval", "source paper", "measured", "simulated there", "error",
    )  # fmt: skip
    return table(head, rows, range(2, 8))


def sweep(result: BenchResult) -> Stage:
    """The sweep of a test and the parabola through it."""
    stage, curve = result.stage, result.curve
    equation = " ".join(f"{c:+.5g}{t}" for c, t in zip(curve.coefficients, ("", " a", " a²"), strict=True))
    return Stage(
        kind=stage.rig,
        heading=f"{stage.rig}: {words(stage.parameter)[0]} {stage.symbol}",
        words=[f"Fit to the level means: {words(stage.observable)[0]} = {equation}, R² = {curve.r2:.4f}."],
        pictures=[
            picture(
                figures.sweep(result),
                f"{stage.rig}: level means, fitted parabola with its band, measurement and root",
                "Points: mean over seeds with two standard errors. Line: parabola with its 95 % band. Dashed: the "
                "measurement; star: where the parabola meets it; shaded: 95 % interval of the parameter.",
            )
        ],
    )


def joint(folder: Path) -> list[Table]:
    """Each bench test predicted with every calibrated parameter at once; none where that was not simulated."""
    known = pd.read_csv(opening.stream(folder / "calibration.csv"))
    if "joint_prediction" not in known or known["joint_prediction"].isna().any():
        return []
    rows = [
        [
            r.rig,
            label(r.observable),
            f"{r.measured:g}",
            f"{r.joint_prediction:.4g}",
            f"{100 * (r.joint_prediction / r.measured - 1):+.1f} %",
        ]
        for r in known.itertuples()
    ]
    together = table(
        ("rig", "observable", "measured", "predicted", "difference"),
        rows,
        (2, 3, 4),
        "The seed bench tests with all calibrated parameters at once (stage by stage, those of later tests are off):",
    )
    return [together]
