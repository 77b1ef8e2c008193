"""A newcomer's rig with effects of his own: what is promised comes, a wrong row is named, what is advised works."""

from pathlib import Path

import numpy as np
import pytest

from tests.criticism.test_words import asked
from tests.helpers.make_study import command

RIG = """
import numpy as np

RIG = {
    "name": "drop",
    "parameters": {"restitution": {"default": 0.8, "min": 0.05, "max": 1.0, "unit": "1", "meaning": "e"}},
    "conditions": {"drop_height_mm": {"default": 300.0, "min": 10.0, "max": 5000.0, "unit": "mm", "meaning": "h"}},
    "observables": {"rebound_mm": {"unit": "mm", "meaning": "rise"}},
}


def predict(parameters, conditions, effects):
    height = conditions["drop_height_mm"]
    e = parameters["restitution"] * np.ones_like(height)
    for act, values in effects.values():
        e = act(e, height, conditions, values)
    return {"rebound_mm": e**2 * height}
"""
EFFECT = """
import numpy as np

EFFECT = {{
    "name": "{name}",
    "means": "{name}",
    "formula": "{name}",
    "parameters": {{"amount": {{"absent": 0.0, "min": 0.0, "max": {most}, "unit": "s/m", "meaning": "a"}}}},
    "sides": 1,
    "rigs": {{"drop": "falls with height"}},
    "signature": "falls with height",
    "source": "own",
}}


def act(e, height_mm, conditions, values):
    v = np.sqrt(2 * 9.81e-3 * height_mm)
    return {law}


CLOSED_FORM = {{"drop": act}}
"""
# flat up to 0.1, where no ball is as fast as the yield speed, and from 1 on, where all are: then it is the restitution
PLASTIC = "e * np.maximum(1.0, values['amount'] * v) ** -0.25"
DRAG = "e * np.exp(-values['amount'] * height_mm / 1000)"
HEIGHTS = (51, 100, 200, 350, 500, 800, 1200, 1800, 2600, 4000)


def rises(law: str, amount: float, e0: float = 0.8) -> np.ndarray:
    """The law without the package."""
    h = np.array(HEIGHTS, dtype=float)
    e = eval(law, {"np": np, "e": e0, "v": np.sqrt(2 * 9.81e-3 * h), "height_mm": h, "values": {"amount": amount}})
    return e**2 * h


def ball(path: Path, values, sd, effects: dict[str, tuple[str, float]], rows=None) -> Path:
    for folder in ("rigs", "effects"):
        (path / folder).mkdir(parents=True, exist_ok=True)
    (path / "rigs" / "drop.py").write_text(RIG)
    for name, (law, most) in effects.items():
        (path / "effects" / f"{name}.py").write_text(EFFECT.format(name=name, law=law, most=most))
    (path / "study.toml").write_text("[parameters]\nrestitution = { value = 0.5, min = 0.1, max = 1.0 }\n")
    told = rows or [
        f"drop,rebound_mm,{v:.4f},{'' if s is None else f'{s:.5f}'},{h}"
        for h, v, s in zip(HEIGHTS, values, sd, strict=True)
    ]
    head = "rig,observable,value,sd,drop_height_mm" + (",setup_sd" if rows else "")
    (path / "measurements.csv").write_text("\n".join([head, *told]) + "\n")
    return path


def noisy(values, share=0.01, seed=1):
    return values * (1 + share * np.random.default_rng(seed).standard_normal(len(values))), share * values


@pytest.mark.parametrize("value", [None, 0.0, 15.0])
def test_an_effect_that_is_flat_where_it_begins_ends_where_diagnose_promised(tmp_path, capsys, value):
    """Added by the command, or written into study.toml by hand where it is flat; then asked again."""
    values, sd = noisy(rises(PLASTIC, 0.4))
    study = ball(tmp_path / "s", values, sd, {"plastic": (PLASTIC, 20.0)})
    told = asked("diagnose", study, capsys)[1]
    assert told["missing"] == ["plastic"]
    promised = told["rivals"][0]
    if value is None:
        status, after = command("add", study, "plastic", json_file=tmp_path / "a.json")
        assert status == 0
    else:
        with (study / "study.toml").open("a") as file:
            file.write(f"\n[effects.plastic]\namount = {{ value = {value}, min = 0.0, max = 20.0 }}\n")
        after = asked("compare", study, capsys)[1]
    assert after["chi2"] == pytest.approx(promised["chi2"], abs=0.02)
    assert after["parameters"]["plastic.amount"] == pytest.approx(0.4, rel=0.15)
    status, again = command("refine", study, json_file=tmp_path / "r.json")
    assert again["verdict"] == "adequate" and again["steps"][-1]["chi2"] == pytest.approx(promised["chi2"], abs=0.02)


@pytest.mark.parametrize("law, amount", [(PLASTIC, 0.4), (DRAG, 0.06)])
def test_a_row_typed_wrong_beside_a_hidden_effect_is_named(tmp_path, capsys, law, amount):
    values, sd = noisy(rises(law, amount))
    values[4] *= 1.3
    study = ball(tmp_path / "s", values, sd, {"plastic": (PLASTIC, 20.0), "drag": (DRAG, 1.0)})
    page, answer = asked("diagnose", study, capsys)
    assert answer["lone_row"] is not None and answer["lone_row"]["line"] == 6
    assert answer["lone_row"]["predicted"] == pytest.approx(rises(law, amount)[4], rel=0.05)
    assert "it is line 6 alone" in page


@pytest.mark.parametrize("law, amount", [(PLASTIC, 0.16), (DRAG, 0.02)])
def test_an_honest_row_at_the_end_of_the_range_is_not_blamed_for_an_effect(tmp_path, capsys, law, amount):
    for seed in range(4):
        values, sd = noisy(rises(law, amount), seed=seed)
        study = ball(tmp_path / str(seed), values, sd, {"plastic": (PLASTIC, 20.0), "drag": (DRAG, 1.0)})
        for name in ("compare", "diagnose"):
            page, answer = asked(name, study, capsys)
            assert answer["lone_row"] is None and "alone: without it" not in page


def test_an_effect_that_hardly_shows_is_tied_where_it_explains_as_well(tmp_path, capsys):
    """No sd: what is left of it beside the restitution is small, and a look-alike shows by more."""
    faint = "e * (1 - values['amount'] * (1 + 0.004 * (height_mm / 1000) ** 2))"
    values, _ = noisy(rises(faint, 0.3, e0=0.95), share=0.0005)
    bend = "e * (1 - values['amount'] * (height_mm / 1000) ** 2)"
    study = ball(tmp_path / "s", values, [None] * len(values), {"faint": (faint, 0.6), "bend": (bend, 0.05)})
    page, answer = asked("diagnose", study, capsys)
    shares = {s["effect"]: s["visible_share"] for s in answer["ranking"]}
    assert shares["faint"] < 0.03 < shares["bend"], shares
    assert answer["verdict"] == "tied" and set(answer["tied"]) == {"faint", "bend"} and answer["faint"] == ["faint"]
    first = " ".join(page[page.index("ANSWER") :].split())
    assert "of faint only" in first.split("NEXT")[0] and "too little to be seen by itself" in first


def test_set_up_scatter_that_undoes_a_verdict_has_a_unit_and_undoes_it_when_entered(tmp_path, capsys):
    """Readings of proportional scatter over a wide range: one number for all rows would not do."""
    found = 0
    for seed in range(12):
        values, sd = noisy(rises(DRAG, 0.0075), seed=seed)
        study = ball(tmp_path / str(seed), values, sd, {"drag": (DRAG, 1.0)})
        page, answer = asked("diagnose", study, capsys)
        if not answer["undone"]:
            continue
        found += 1
        entry = {one["line"]: one["setup_sd"] for one in answer["undone"]["by_line"]}
        assert f"{min(entry.values()):.3g} mm in line 2 to" in " ".join(page.split())
        rows = [
            f"drop,rebound_mm,{v:.4f},{s:.5f},{h},{entry[k + 2]!r}"
            for k, (h, v, s) in enumerate(zip(HEIGHTS, values, sd, strict=True))
        ]
        told = ball(tmp_path / f"e{seed}", values, sd, {"drag": (DRAG, 1.0)}, rows)
        declared = asked("diagnose", told, capsys)[1]
        assert declared["verdict"] == answer["undone"]["verdict"] != answer["verdict"]
        if found == 2:
            break
    assert found
