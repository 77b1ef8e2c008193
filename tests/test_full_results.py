"""The committed heaps of results/full: refitted they give the committed effects, simulated again the same bits."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pellet_study import dispatch, powder_chain, rigs, study, yade
from pellet_study.doe import box_behnken, plackett_burman
from pellet_study.doe.factors import Factor
from pellet_study.powder_chain import SYMBOLS, table_of

FULL = Path(__file__).parent.parent / "results" / "full"
if not (FULL / "runs.csv").exists():
    pytest.skip("no heap of results/full is committed yet", allow_module_level=True)
RUNS = pd.read_csv(FULL / "runs.csv", dtype=str)
NUMBERS = [name for name in (*SYMBOLS, "seed", "repose_angle_deg", "box") if name in RUNS]
RUNS[NUMBERS] = RUNS[NUMBERS].map(float)  # to the last digit
VERSION = "2023.02a"  # of the YADE that made them


def good(stage: str) -> pd.DataFrame:
    return RUNS[(RUNS["stage"] == stage) & (RUNS["verdict"] == "ok")]


def test_every_heap_has_its_own_seed_and_a_verdict():
    assert RUNS["seed"].is_unique
    assert RUNS["verdict"].notna().all()
    assert RUNS.loc[RUNS["verdict"] == "ok", "repose_angle_deg"].between(5, 80).all()


@pytest.mark.skipif(not (FULL / "screening" / "effects.csv").exists(), reason="the screening is not done yet")
def test_the_screening_refitted_gives_the_committed_effects():
    factors = powder_chain.plan_of(study.load(FULL)).factors
    found = plackett_burman.analyse(table_of(good("screening"), factors))
    committed = pd.read_csv(FULL / "screening" / "effects.csv").set_index("factor")
    for name, effect in found.effects.items():
        assert effect == pytest.approx(committed.loc[name, "effect_deg"], abs=1e-9)
        error = 2 * found.model.standard_errors[name]
        assert error == pytest.approx(committed.loc[name, "standard_error_deg"], abs=1e-9)


@pytest.mark.skipif(not (FULL / "surface" / "coefficients.csv").exists(), reason="the surface is not done yet")
def test_the_surface_refitted_gives_the_committed_coefficients():
    committed = pd.read_csv(FULL / "surface" / "coefficients.csv").set_index("term")["coefficient_deg"]
    runs = good("surface")
    last = runs[runs["box"] == runs["box"].max()]
    decision = json.loads((FULL / "surface" / "decision.json").read_text())
    factors = [Factor(name, *levels) for name, levels in decision["box"].items()]
    found = box_behnken.analyse(table_of(last, factors)).model.coefficients
    for term, value in found.items():
        assert value == pytest.approx(committed[term], abs=1e-9)


@pytest.mark.skipif(yade.version() != VERSION, reason=f"the committed heaps are those of YADE {VERSION}")
def test_a_heap_simulated_again_has_the_same_bits(tmp_path):
    plan = powder_chain.plan_of(study.load(FULL))
    cheap = RUNS[(RUNS["verdict"] == "ok") & (RUNS["D"] >= 0.15)]  # others take three times as long
    row = cheap.iloc[np.random.default_rng().integers(len(cheap))]
    case = rigs.case(
        "repose",
        contact_law=plan.contact_law,
        seed=int(row["seed"]),
        parameters=plan.fixed | {SYMBOLS[name]: row[name] for name in SYMBOLS},
        conditions=plan.conditions,
        numerics=plan.numerics,
    )
    again = dispatch.run([case], tmp_path / ".store", workers=1, quiet=True).iloc[0]
    assert again["repose_angle_deg"] == pytest.approx(row["repose_angle_deg"], rel=1e-15, abs=0), f"seed {row['seed']}"
