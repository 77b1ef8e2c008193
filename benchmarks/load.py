"""Time and memory against size: stored results collected in a table, and diagnose on many rows.

    .venv/bin/python benchmarks/load.py [--results benchmarks]

Each size runs in a process of its own, so that its peak memory is its own; writes load.csv and load.png. The aims:
100,000 stored results in under 5 s, diagnose with 10,000 rows and 20 candidates in under 10 s, compare with 20,000 rows
in under 3 s over 6 conditions and in under 30 s over as many, growing with an exponent of at most 1.1, memory below 1 GB.
"""

import argparse
import csv
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

SIZES = {
    "collect": (1_000, 10_000, 100_000),
    "diagnose": (100, 1_000, 10_000),
    "read": (10_000, 100_000, 1_000_000),
    "compare": (5_000, 10_000, 20_000),
    "distinct": (5_000, 10_000, 20_000),
}
AIMS = {"collect": (100_000, 5.0), "diagnose": (10_000, 10.0), "compare": (20_000, 3.0), "distinct": (20_000, 30.0)}
GROWTH = 1.1  # largest exponent of the time of `compare` against its rows
LABELS = {
    "collect": "stored results collected in a table",
    "diagnose": "rows in diagnose, 20 candidates",
    "read": "rows of measurements.csv read",
    "compare": "rows in compare, 6 conditions",
    "distinct": "rows in compare, all conditions distinct",
}
MEMORY_MB = 1000.0
EFFECT = """EFFECT = {{
    "name": "{name}", "means": "a further pull", "formula": "c h^{power}", "sides": 1,
    "rigs": {{"layer_on_incline": "everywhere"}},
    "parameters": {{"pull_pa": {{"absent": 0.0, "min": 0.0, "max": 500.0, "unit": "Pa", "meaning": "c"}}}},
    "signature": "grows with the height to the power {power}", "source": "this benchmark",
}}


def act(shear, normal, conditions, values):
    return shear + values["pull_pa"] * (conditions["layer_height_mm"] / 20) ** {power}


CLOSED_FORM = {{"layer_on_incline": act}}
"""


def clocks() -> np.ndarray:
    """Time of day and of the processor, s; they differ where other programs run as well."""
    return np.array([time.perf_counter(), time.process_time()])


def collect(size: int, folder: Path) -> np.ndarray:
    """Seconds from cases to their table, all of them stored; the rows are written as YADE writes them."""
    from pellet_study.rigs import on_yade
    from pellet_study.simulation import dispatch
    from pellet_study.simulation.store import Store, key
    from yade_scripts.case import flat, line, sealed

    rig, store = on_yade.rig("rebound"), Store(folder / "store")
    store.folder.mkdir()
    names = store.columns(rig)
    cases = [
        on_yade.case("rebound", seed=seed, conditions={"drop_height_mm": 20 + seed / 1000}) for seed in range(size)
    ]
    with open(store.table(rig), "wb") as table:
        table.write(b"heading\n")
        for case in cases:
            row = {**flat({**case, "id": key(case, rig)}), "rebound_height_mm": 7 + case["seed"] / 7, "status": "ok"}
            table.write(sealed(line(row, names)))
    start = clocks()
    found = dispatch.run(cases, folder / "store")
    seconds = clocks() - start
    assert len(found) == size and (found["status"] == "ok").all()
    return seconds


def diagnose(size: int, folder: Path) -> np.ndarray:
    """Seconds of `diagnose` with as many rows, half as many different cases, and 20 candidates."""
    from pellet_study.criticism.diagnose import diagnose as find
    from pellet_study.study.load import load

    (folder / "effects").mkdir()
    rng = np.random.default_rng(1)
    rows = ["rig,observable,value,layer_height_mm,sd,setup,setup_sd"]
    for k in range(size):
        height = 5 + 60 * (k // 2) / size
        angle = np.degrees(np.arctan(0.5 + 60 / (1400 * 9.81e-3 * height))) + 0.3 * rng.standard_normal()
        rows.append(f"layer_on_incline,slip_angle_deg,{angle:.4f},{height:.6g},0.3,,")
    (folder / "measurements.csv").write_text("\n".join(rows) + "\n")
    (folder / "study.toml").write_text("[parameters]\ninternal_friction = { value = 0.5, min = 0.05, max = 2.0 }\n")
    have = len(load(folder).absent())
    for k in range(20 - have):
        name = f"pull_{k}"
        (folder / "effects" / f"{name}.py").write_text(EFFECT.format(name=name, power=-2 + 0.23 * k))
    study = load(folder)
    assert len(study.absent()) == 20, study.absent()
    start = clocks()
    found = find(study)
    seconds = clocks() - start
    assert len(found.ranking) == 20
    return seconds


def read(size: int, folder: Path) -> np.ndarray:
    """Seconds to read and check as many rows."""
    from pellet_study.rigs import catalogue
    from pellet_study.study import measurements

    file = folder / "measurements.csv"
    with open(file, "w") as stream:
        stream.write("rig,observable,value,layer_height_mm\n")
        stream.writelines(f"layer_on_incline,slip_angle_deg,30,{8 + k % 50}\n" for k in range(size))
    start = clocks()
    rows = measurements.read(file, catalogue.standard())
    seconds = clocks() - start
    assert len(rows) == size
    return seconds


def compare(size: int, folder: Path, conditions: int = 6) -> np.ndarray:
    """Seconds of `compare` with as many rows over some conditions, loading and writing included."""
    from pellet_study.api import criticism
    from pellet_study.study.load import load

    rng = np.random.default_rng(1)
    rows = ["rig,observable,value,layer_height_mm,sd"]
    for k in range(size):
        height = 8 + 52 * (k % conditions) / conditions
        rows.append(f"layer_on_incline,slip_angle_deg,{26.5 + 0.5 * rng.standard_normal():.4f},{height:.6f},0.5")
    (folder / "measurements.csv").write_text("\n".join(rows) + "\n")
    (folder / "study.toml").write_text("[parameters]\ninternal_friction = { value = 0.5, min = 0.05, max = 2.0 }\n")
    start = clocks()
    found = criticism.compare(load(folder), write=True)
    seconds = clocks() - start
    assert len(found.rows) == size
    return seconds


def distinct(size: int, folder: Path) -> np.ndarray:
    """The same over as many conditions as rows."""
    return compare(size, folder, size)


def growth(rows: list[dict]) -> dict[str, float]:
    """Exponent of the processor's time against the size, from the second size on (the first has the imports in it)."""
    found = {}
    for what in ("compare", "distinct"):
        mine = [row for row in rows if row["what"] == what][-2:]
        ratios = [mine[1][name] / mine[0][name] for name in ("processor_seconds", "size")]
        found[what] = float(np.log(ratios[0]) / np.log(ratios[1]))
    return found


def measured(what: str, size: int) -> dict:
    """One size, in a process of its own."""
    done = subprocess.run([sys.executable, __file__, "--one", what, str(size)], capture_output=True, text=True)
    if done.returncode:
        sys.exit(done.stderr)
    wall, processor, memory = map(float, done.stdout.split()[-3:])
    print(f"{LABELS[what]:45s}{size:>9d}{wall:9.2f} s{processor:9.2f} s of processor{memory:8.0f} MB", flush=True)
    return {"what": what, "size": size, "seconds": wall, "processor_seconds": processor, "peak_memory_mb": memory}


def one(what: str, size: int) -> None:
    """What `measured` starts."""
    with tempfile.TemporaryDirectory() as folder:
        wall, processor = {
            "collect": collect,
            "diagnose": diagnose,
            "read": read,
            "compare": compare,
            "distinct": distinct,
        }[what](size, Path(folder))
    print(f"{wall:.3f} {processor:.3f} {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3:.1f}")


def draw(rows: list[dict], file: Path) -> None:
    """Time and memory against size."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    for mark, (what, label) in zip("os^Dv", LABELS.items(), strict=True):
        mine = [row for row in rows if row["what"] == what]
        sizes = [row["size"] for row in mine]
        (drawn,) = left.loglog(sizes, [row["seconds"] for row in mine], mark + "-", label=label)
        right.loglog(sizes, [row["peak_memory_mb"] for row in mine], mark + "-")
        if what in AIMS:
            left.plot(*AIMS[what], "_", color=drawn.get_color(), markersize=16, markeredgewidth=2)
    right.axhline(MEMORY_MB, color="0.6", linewidth=1)
    left.set(xlabel="size", ylabel="time, s (bars: what is aimed at)")
    right.set(xlabel="size", ylabel="peak memory, MB (line: the aim)", ylim=(50, 2000))
    left.legend(frameon=False, fontsize=8)
    figure.savefig(file, dpi=150)


def main() -> int:
    """Measure, write, draw; 1 where an aim is missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--one", nargs=2, metavar=("WHAT", "SIZE"), help=argparse.SUPPRESS)
    parser.add_argument("--results", type=Path, default=Path(__file__).parent, metavar="FOLDER")
    arguments = parser.parse_args()
    if arguments.one:
        one(arguments.one[0], int(arguments.one[1]))
        return 0
    rows = [measured(what, size) for what, sizes in SIZES.items() for size in sizes]
    with open(arguments.results / "load.csv", "w", newline="") as stream:
        table = csv.DictWriter(stream, rows[0], lineterminator="\n")
        table.writeheader()
        table.writerows(rows)
    draw(rows, arguments.results / "load.png")
    slow = [
        row
        for row in rows
        if row["what"] in AIMS and row["size"] == AIMS[row["what"]][0] and row["seconds"] > AIMS[row["what"]][1]
    ]
    large = [row for row in rows if row["peak_memory_mb"] > MEMORY_MB]
    steep = {what: exponent for what, exponent in growth(rows).items() if exponent > GROWTH}
    for what, exponent in growth(rows).items():
        print(f"{LABELS[what]}: time grows with the power {exponent:.2f}")
    for missed in [*slow, *large, *steep.items()]:
        print("aim missed:", missed)
    return int(bool(slow or large or steep))


if __name__ == "__main__":
    sys.exit(main())
