"""Every documented shape of a study against every command about studies, on the command line: none may end in a traceback.

On a rig that is a formula, and on one that goes by response surfaces, a closed form in YADE's place.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pellet_study.__main__ import main
from pellet_study.simulation import dispatch
from tests.helpers.make_study import slip_angle_deg


@dataclass(frozen=True)
class Bench:
    """A rig with something hidden: its column, its levels, the parameter that is calibrated, and what a level reads."""

    rig: str
    observable: str
    condition: str
    levels: tuple[float, ...]
    parameter: str
    hidden: str
    amount: str
    size: float
    reads: Callable[[float, float], float]  # at a level, with a value of the parameter


def with_adhesion(length: float, mu: float, energy: float = 4e-5, tilt: float = 0.0) -> float:
    """Slip angle of a seed whose adhesion over weight goes with 1/length^2, in YADE's place."""
    return float(np.degrees(np.arctan(mu * (1 + 5e3 * energy * (2.2 / length) ** 2))) - tilt)


INCLINE = Bench(
    "layer_on_incline", "slip_angle_deg", "layer_height_mm", (8, 12, 18, 27, 40, 60), "internal_friction", "cohesion",
    "cohesive_stress_pa", 40.0, lambda height, mu: slip_angle_deg(height, mu, 40.0),
)  # fmt: skip
SEEDS = Bench(
    "slope_slip", "slip_angle_deg", "seed_length_mm", (1.5, 1.8, 2.2, 2.6, 2.8, 3.0), "seed_powder_static_friction",
    "adhesion", "surface_energy", 4e-5, with_adhesion,
)  # fmt: skip
NOISE = (0.2, -0.3, 0.1)  # deg, of three readings; they do not sum to nothing
FREE = "{ value = 0.5, min = 0.3, max = 0.9 }"
CANDIDATES = {"cohesion": ["cohesion", "finite_thickness"], "adhesion": ["adhesion", "plate_tilt"]}


@dataclass(frozen=True)
class Shape:
    """What a study looks like: columns beside rig, observable, value and the condition, cells of level k and reading j."""

    columns: str = ""
    cells: Callable[[int, int], str] = lambda k, j: ""
    repeats: int = 3
    levels: int = 6
    free: str = FREE
    toml: str = ""
    effects: str = ""
    known: Callable[[int], float | None] = lambda k: None  # a parameter column's value at a level
    whole: Callable[[str], bytes] = lambda text: text.encode()
    finds: bool | None = True  # the hidden effect; None where it is there, or where nothing can be said
    varies: bool = True
    refused: str = ""


def at_two_known(k: int) -> float | None:
    return {0: 0.45, 3: 0.6}.get(k)


SHAPES = {
    "replicates": Shape(),
    "sd and n": Shape("sd,n", lambda k, j: "0.3,5", repeats=1),
    "sd in some rows": Shape("sd", lambda k, j: "0.3" if k % 2 else ""),
    "neither sd nor replicates": Shape(repeats=1),
    "resolution": Shape("resolution", lambda k, j: "0.1"),
    "set-ups that rows share": Shape("setup,setup_sd", lambda k, j: f"day {k % 2},0.2"),
    "a set-up a row": Shape("setup,setup_sd,sd", lambda k, j: f"s{k}{j},0.2,0.3"),
    "rows held out": Shape("split", lambda k, j: "holdout" if k == 4 else "fit"),
    "a row left out": Shape("split,reason", lambda k, j: "leave_out,torn" if (k, j) == (2, 0) else "fit,"),
    "an order": Shape("order", lambda k, j: str(1 + (7 * (3 * k + j)) % 18)),
    "an order with blanks": Shape("order", lambda k, j: str(1 + k) if j else ""),
    "notes": Shape("note", lambda k, j: "damp" if j else ""),
    "a parameter known in some rows": Shape(known=at_two_known),
    "a parameter known in rows held out": Shape(
        "split", lambda k, j: "holdout" if k == 3 else "fit", known=lambda k: {3: 0.6}.get(k)
    ),
    "a parameter known in every row": Shape(known=lambda k: 0.5),
    "nothing free": Shape(free="0.5"),
    "free without a value": Shape(free="{ min = 0.3, max = 0.9 }"),
    "the effect there, fixed": Shape(effects="fixed", finds=None),
    "the effect there, free": Shape(effects="free", finds=None),
    "no candidate": Shape(toml="candidates = []", finds=None),
    "what is possible": Shape(toml="possible"),
    "decimal commas": Shape(whole=lambda text: text.replace(",", ";").replace(".", ",").encode()),
    "UTF-16": Shape(whole=lambda text: text.encode("utf-16")),
    "one row": Shape(levels=1, repeats=1, finds=None),
    "one level": Shape(levels=1, finds=None),
    "as many levels as parameters, and one": Shape(levels=2, finds=None),
    "the condition left out": Shape(varies=False, finds=None),
    "everything held out": Shape("split", lambda k, j: "holdout", refused="every row is held out"),
}


def written(folder: Path, bench: Bench, shape: Shape) -> Path:
    """A study of a shape."""
    known = any(shape.known(k) is not None for k in range(shape.levels))
    head = ["rig", "observable", "value", bench.condition, shape.columns, bench.parameter if known else ""]
    lines = [",".join(filter(None, head if shape.varies else [*head[:3], *head[4:]]))]
    for k, level in enumerate(bench.levels[: shape.levels]):
        for j in range(shape.repeats):
            given = shape.known(k)
            value = bench.reads(level if shape.varies else bench.levels[2], 0.5 if given is None else given) + NOISE[j]
            cells = [bench.rig, bench.observable, f"{value:.3f}"]
            cells += [f"{level}"] if shape.varies else []
            cells += [shape.cells(k, j)] if shape.columns else []
            cells += ["" if given is None else f"{given}"] if known else []
            lines.append(",".join(cells))
    amount = {"fixed": f"{bench.size}", "free": f"{{ value = {bench.size}, min = 0.0, max = {4 * bench.size} }}"}
    toml = [f"candidates = {json.dumps(CANDIDATES[bench.hidden])}"] if not shape.toml.startswith("candidates") else []
    toml += [shape.toml] if shape.toml.startswith("candidates") else []
    toml += ["[parameters]", f"{bench.parameter} = {shape.free}"]
    if shape.effects:
        toml += ["[effects]", f"{bench.hidden} = {{ {bench.amount} = {amount[shape.effects]} }}"]
    if shape.toml == "possible":
        toml += [
            f"[possible.{bench.rig}]",
            f"{bench.condition} = {{ min = {bench.levels[0]}, max = {bench.levels[-1]} }}",
        ]
    folder.mkdir()
    (folder / "study.toml").write_text("\n".join(toml) + "\n")
    (folder / "measurements.csv").write_bytes(shape.whole("\n".join(lines) + "\n"))
    return folder


@pytest.fixture
def in_yades_place(monkeypatch):
    """Cases of slope_slip answered by `with_adhesion`, with a scatter over the seeds of a thousandth."""

    def run(cases, store, **_):
        store.mkdir(parents=True, exist_ok=True)
        angles = []
        for case in cases:
            effects = case["effects"]
            scatter = 1 + 1e-3 * np.random.default_rng(case["seed"]).standard_normal()
            angles.append(
                with_adhesion(
                    case["conditions"]["seed_length_mm"],
                    case["parameters"]["seed_powder_static_friction"] * scatter,
                    effects["adhesion"]["surface_energy"],
                    effects["plate_tilt"]["tilt_deg"],
                )
            )
        return pd.DataFrame({"slip_angle_deg": angles, "status": "ok"})

    monkeypatch.setattr(dispatch, "run", run)


def asked(folder: Path, capsys, name: str, *more: str, status: int = 0) -> tuple[dict, str]:
    """The JSON of a command and what it said, after its exit status."""
    file = folder.parent / "answer.json"
    file.unlink(missing_ok=True)
    found = main([name, str(folder), *more, "--json", str(file)])
    said = capsys.readouterr()
    assert found == status, f"{name}: {said.err}"
    assert "Traceback" not in said.err and len(said.err.splitlines()) < 12
    return (json.loads(file.read_text()) if status == 0 else {}), said.out + said.err


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("bench", [INCLINE, SEEDS], ids=lambda bench: bench.rig)
def test_a_study_of_this_shape_is_answered_by_every_command(bench, name, tmp_path, capsys, in_yades_place):
    shape = SHAPES[name]
    folder = written(tmp_path / "s", bench, shape)
    before = (folder / "study.toml").read_text()
    asked(folder, capsys, "check")
    if shape.refused:
        for command in ("compare", "diagnose", "refine"):
            assert shape.refused in asked(folder, capsys, command, status=2)[1]
        return
    compared, _ = asked(folder, capsys, "compare")
    assert all(np.isfinite(row["predicted"]) for row in compared["rows"])
    diagnosed, _ = asked(folder, capsys, "diagnose")
    if shape.finds:
        assert bench.hidden in (*diagnosed["missing"], *diagnosed["tied"])
    if not shape.effects:
        too_few = shape.levels * shape.repeats < 2
        asked(folder, capsys, "add", bench.hidden, status=2 if too_few else 0)
        if not too_few:
            asked(folder, capsys, "history")
            asked(folder, capsys, "drop", bench.hidden)
            assert (folder / "study.toml").read_text().replace("[effects]", "").split() == before.split()
    refined, _ = asked(folder, capsys, "refine")
    assert refined["verdict"] in ("adequate", "missing", "tied", "unexplained", "undecided")
    if shape.finds and not diagnosed["tied"]:
        assert refined["added"] == [bench.hidden]
        assert refined["steps"][-1]["rms_error"] < 0.5 * refined["steps"][0]["rms_error"]
    if shape.effects:
        assert (refined["verdict"], refined["added"]) == ("adequate", [])
    asked(folder, capsys, "history")
    asked(folder, capsys, "report")


def test_a_parameter_known_in_some_rows_is_fitted_to_the_others_only(tmp_path, capsys, in_yades_place):
    """Two reference plates of known friction, four lengths of unknown: adhesion is found, and the friction of 0.5."""
    folder = written(tmp_path / "s", SEEDS, SHAPES["a parameter known in some rows"])
    refined, _ = asked(folder, capsys, "refine")
    last = refined["steps"][-1]["parameters"]
    assert last["seed_powder_static_friction"] == pytest.approx(0.5, rel=0.02)
    assert last["adhesion.surface_energy"] == pytest.approx(4e-5, rel=0.2)


WORDS = """
import numpy as np

RIG = {
    "name": "slide",
    "parameters": {"mu": {"default": 0.5, "min": 0.05, "max": 2.0, "unit": "1", "meaning": "friction"}},
    "conditions": {
        "plate": {"default": "steel", "options": ("steel", "glass", "paper"), "unit": "", "meaning": "what it lies on"},
        "load_g": {"default": 10.0, "min": 1.0, "max": 100.0, "unit": "g", "meaning": "load"},
    },
    "observables": {"angle_deg": "tilt", "force_mn": {"unit": "mN", "meaning": "pull"}},
}


def predict(parameters, conditions, effects):
    angle = np.degrees(np.arctan(parameters["mu"])) + 0 * conditions["load_g"]
    return {"angle_deg": angle, "force_mn": 9.81 * parameters["mu"] * conditions["load_g"]}
"""
SEVERAL = {
    "two rigs": (
        "rig,observable,value,sd,n,layer_height_mm,normal_stress_pa,internal_friction\n"
        + "".join(
            f"layer_on_incline,slip_angle_deg,{slip_angle_deg(h, 0.5, 40.0):.2f},0.3,5,{h},,\n" for h in (8, 15, 30, 60)
        )
        + "".join(f"shear_cell,shear_stress_pa,{0.5 * s + 40:.1f},10,5,,{s},\n" for s in (500, 2000, 8000))
        + "shear_cell,shear_stress_pa,640,10,5,,1000,0.6\n",
        "internal_friction = { min = 0.1, max = 1.5 }",
        ["cohesion"],
    ),
    "a rig of one's own, words, two observables": (
        "rig,observable,value,sd,n,plate,load_g\n"
        + "".join(
            f"slide,{o},{v},{sd},5,{plate},{load}\n"
            for load in (5, 20)
            for plate in ("steel", "glass")
            for o, v, sd in (("angle_deg", 26.6, 0.3), ("force_mn", round(9.81 * 0.5 * load, 2), 0.5))
        ),
        "mu = { min = 0.1, max = 1.5 }",
        [],
    ),
}


@pytest.mark.parametrize("name", SEVERAL)
def test_studies_of_several_rigs_observables_and_words_are_answered_too(name, tmp_path, capsys):
    rows, free, added = SEVERAL[name]
    folder = tmp_path / "s"
    (folder / "rigs").mkdir(parents=True)
    (folder / "rigs" / "slide.py").write_text(WORDS)
    (folder / "measurements.csv").write_text(rows)
    (folder / "study.toml").write_text(f"[parameters]\n{free}\n")
    for command in ("check", "compare", "diagnose"):
        asked(folder, capsys, command)
    refined, _ = asked(folder, capsys, "refine")
    assert (refined["verdict"], refined["added"]) == ("adequate", added)
    for command in ("history", "report"):
        asked(folder, capsys, command)
