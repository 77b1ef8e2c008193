"""The scatter of readings against that of the simulations, a closed form with a known scatter in YADE's place."""

import numpy as np
import pandas as pd
import pytest

from pellet_study.simulation import dispatch
from tests.helpers.make_study import command

HEIGHTS = (60.0, 100.0, 160.0, 250.0)
OWN = 0.3  # scatter of a simulation over its mean


@pytest.fixture(autouse=True)
def in_yades_place(monkeypatch):
    """Rebounds of e^2 h, scattering by `OWN` from seed to seed."""

    def run(cases, store, **_):
        store.mkdir(parents=True, exist_ok=True)
        heights = [
            case["parameters"]["seed_powder_restitution"] ** 2
            * case["conditions"]["drop_height_mm"]
            * (1 + OWN * np.random.default_rng(case["seed"]).standard_normal())
            for case in cases
        ]
        return pd.DataFrame({"rebound_height_mm": heights, "status": "ok"})

    monkeypatch.setattr(dispatch, "run", run)


def compared(path, scatter: float, stated: bool, capsys):
    """A study of twelve readings a height, each row a mean with its sd or each a reading."""
    path.mkdir()
    rng, lines = np.random.default_rng(6), ["rig,observable,value,drop_height_mm" + (",sd,n" if stated else "")]
    for height in HEIGHTS:
        readings = 0.09 * height * (1 + scatter * rng.standard_normal(12))
        if stated:
            lines.append(f"rebound,rebound_height_mm,{readings.mean():.4f},{height},{readings.std(ddof=1):.4f},12")
        else:
            lines += [f"rebound,rebound_height_mm,{max(value, 0.01):.4f},{height}" for value in readings]
    (path / "measurements.csv").write_text("\n".join(lines) + "\n")
    (path / "study.toml").write_text(
        "candidates = []\n[parameters]\nseed_powder_restitution = { value = 0.3, min = 0.2, max = 0.5 }\n"
    )
    status, answer = command("compare", path, json_file=path.parent / "answer.json")
    assert status == 0
    [found] = answer["scatter"]
    return found, " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize("stated", [True, False])
@pytest.mark.parametrize(
    ("scatter", "judgement"), [(OWN, None), (0.9 * OWN, None), (0.1, "too wild"), (0.6, "too regular")]
)
def test_the_scatter_of_readings_is_held_against_the_models(tmp_path, capsys, scatter, judgement, stated):
    found, said = compared(tmp_path / "s", scatter, stated, capsys)
    assert found["judgement"] == judgement and (found["p"] < 0.001) == (judgement is not None)
    assert found["simulated"] == pytest.approx(OWN, rel=0.15)
    assert found["measured"] == pytest.approx(scatter, rel=0.3)
    assert "scatter: rebound_height_mm (rebound): a reading scatters by" in said
    assert (f"the model is {judgement}" in said) == (judgement is not None)


def test_a_formula_has_no_scatter(tmp_path):
    from tests.helpers.make_study import incline

    status, answer = command("compare", incline(tmp_path / "s"), json_file=tmp_path / "a.json")
    assert status == 0 and answer["scatter"] == [] and answer["noise_share"] == {}
