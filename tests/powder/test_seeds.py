"""Which seed a heap of the powder chain has: that of its setting, wherever the design has it; or, as before, of its place."""

import numpy as np
import pandas as pd
import pytest

from pellet_study.doe import box_behnken, screening_designs
from pellet_study.errors import InputError
from pellet_study.powder import heaps as heaps_module
from pellet_study.powder.chain import Chain
from pellet_study.powder.from_study import plan_of
from pellet_study.powder.heaps import FIRST_SEED, Heaps, seeds_by_setting
from pellet_study.powder.plan import SYMBOLS
from pellet_study.powder.results import Results
from pellet_study.study import load
from tests.powder.test_chain import Formula

STAGES = ("screening", "climb", "surface")


def study(folder, more=""):
    folder.mkdir()
    (folder / "study.toml").write_text(f'title = "powder"\n{more}')
    (folder / "measurements.csv").write_text("rig,observable,value,sd\nrepose,repose_angle_deg,41.69,0.79\n")
    return folder


def chained(folder, monkeypatch) -> pd.DataFrame:
    """The heaps of the chain up to the surface, on a formula without noise."""
    monkeypatch.setattr(heaps_module, "dispatch", Formula(noise=0.0))
    plan = plan_of(load(folder))
    Chain(Heaps(plan, folder / ".store"), Results(plan, folder)).run(STAGES)
    return pd.read_csv(folder / "runs.csv")


def by_seed(runs: pd.DataFrame) -> dict[int, tuple]:
    return {row["seed"]: (row["stage"], *(round(row[n], 6) for n in SYMBOLS)) for _, row in runs.iterrows()}


def shuffled(matrix, seed):
    """A design whose rows stand in another order, those of its centre among them."""

    def found(*arguments, **options):
        coded = matrix(*arguments, **options)
        return coded[np.random.default_rng(seed).permutation(len(coded))]

    return found


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_another_order_of_the_designs_asks_for_the_same_heaps(tmp_path, monkeypatch, seed):
    before = chained(study(tmp_path / "before"), monkeypatch)
    for design in (screening_designs, box_behnken):
        monkeypatch.setattr(design, "coded_matrix", shuffled(design.coded_matrix, seed))
    after = chained(study(tmp_path / "after"), monkeypatch)
    assert not before[list(SYMBOLS)].equals(after[list(SYMBOLS)])
    assert by_seed(before) == by_seed(after)
    assert before["seed"].is_unique


def test_by_place_the_seeds_are_those_of_release_0_1(tmp_path, monkeypatch):
    runs = chained(study(tmp_path / "old", 'seeds_by = "place"\n'), monkeypatch)
    for stage, of_stage in runs.groupby("stage"):
        assert of_stage["seed"].tolist() == list(range(FIRST_SEED[stage], FIRST_SEED[stage] + len(of_stage)))


def test_what_a_heap_is_tells_its_seed():
    level = {"B": 0.8, "G": 0.2}
    one, two = seeds_by_setting("climb", [level, level])
    assert one != two  # another heap at the same setting
    assert [one] == seeds_by_setting("climb", [{"G": 0.2, "B": 0.8}])  # whatever the order of the factors
    assert [two, one] != seeds_by_setting("climb", [level, level], first=1000)
    assert [one] == seeds_by_setting("climb", [{"B": 0.8 + 4e-16, "G": 0.2}])  # another machine's last digit
    assert len({one, *seeds_by_setting("surface", [level]), *seeds_by_setting("climb", [{"B": 0.81, "G": 0.2}])}) == 3
    many = seeds_by_setting("climb", [{"B": b} for b in np.linspace(0, 1, 500)] * 2)
    assert len(set(many)) == 1000 and all(2 * 10**9 <= seed < 3 * 10**9 for seed in many)


def test_an_unknown_rule_of_seeds_is_refused(tmp_path):
    with pytest.raises(InputError, match="seeds_by 'order' is unknown; accepted are place, setting"):
        load(study(tmp_path / "s", 'seeds_by = "order"\n'))
