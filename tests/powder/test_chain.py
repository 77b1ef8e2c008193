"""The powder chain as a driver, on a stub in place of the simulator: a formula with noise, some of its heaps jammed."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import pellet_study as ps
from pellet_study.__main__ import main
from pellet_study.errors import InputError, SimulationError
from pellet_study.paper.designs import screening_factors
from pellet_study.powder import box, few_heaps, report
from pellet_study.powder import decisions as decisions_module
from pellet_study.powder import heaps as heaps_module
from pellet_study.powder.chain import Chain
from pellet_study.powder.decisions import STAGES, Screening
from pellet_study.powder.from_study import plan_of
from pellet_study.powder.heaps import FULL, QUICK, Heaps
from pellet_study.powder.plan import SYMBOLS
from pellet_study.powder.results import Results
from pellet_study.powder.text import summary
from pellet_study.report.powder import powder_stages
from pellet_study.study import load
from tests.helpers.json_keys import not_there, without_meaning
from yade_scripts import laws

SLOPES = {"B": -1.5, "C": 3.5, "G": 3.7}  # per coded unit of Table 6, half the paper's effects


class Formula:
    """Stands for dispatch.run: angle = level + slopes + noise of the seed; counts the heaps asked for.

    `numbers` has the heap of each seed, in the order in which they were asked for: 10_002 is the third of the screening,
    the climb's begin at 20_000, the surface's at 30_000, the validation's at 50_000. Those of `jammed` give no angle.
    """

    def __init__(self, level=40.75, slopes=SLOPES, noise=0.4, jammed=(), offset=0, flat=()):
        self.level, self.slopes, self.noise, self.jammed, self.asked = level, slopes, noise, jammed, []
        self.offset = offset  # of the seeds of the noise
        self.flat = flat  # heaps with an angle and no flank
        self.numbers = {}

    def number(self, seed):
        first = 10_000 * (seed // 10**9)
        return self.numbers.setdefault(seed, first + sum(first <= n < first + 10_000 for n in self.numbers.values()))

    def run(self, cases, store, *, workers=None, quiet=False):
        factors = {f.name: f for f in screening_factors()}
        rows = []
        for case in cases:
            self.asked.append(case["seed"])
            angle = self.level + self.noise * np.random.default_rng(case["seed"] + self.offset).normal()
            angle += sum(k * factors[n].coded(case["parameters"][SYMBOLS[n]]) for n, k in self.slopes.items())
            number = self.number(case["seed"])
            lost = number in self.jammed
            rows.append(
                {
                    "id": f"{case['seed']}",
                    "repose_angle_deg": None if lost else angle,
                    "repose_flank_deg": None if lost or number in self.flat else angle + 2,
                    "repose_triangle_deg": None if lost else angle,
                    "repose_moment_deg": None if lost else 10 + angle / 2,
                    "repose_height_deg": None if lost else angle + 5,
                    "discharge_time_s": None,
                    "fill_bulk_density_kg_m3": None,
                    "direction_error_deg": None if lost else 0.3,
                    "bond_number": 3.7,
                    "status": "jammed: 400 of 1503 grains came out" if lost else "ok",
                }
            )
        return pd.DataFrame(rows)


@pytest.fixture
def powder(tmp_path):
    """A study folder with the paper's measured angle; in the law in which A is an idle column."""
    folder = tmp_path / "powder"
    folder.mkdir()
    (folder / "study.toml").write_text(f'title = "powder"\ncontact_law = "{laws.LOCAL_DAMPING}"\n')
    (folder / "measurements.csv").write_text("rig,observable,value,sd\nrepose,repose_angle_deg,41.69,0.79\n")
    return folder


def quiet(line: str) -> None:
    """Stands for print."""


def work_of(folder: Path, stub: Formula, monkeypatch, sizes=FULL, say=quiet) -> tuple[Heaps, Results]:
    """The heaps of a study's plan, given by a stub, and its folder of results."""
    monkeypatch.setattr(heaps_module, "dispatch", stub)
    plan = plan_of(load(folder))
    return Heaps(plan, folder / ".store", sizes, say=say), Results(plan, folder)


def chain_of(folder: Path, stub: Formula, monkeypatch, **more) -> Chain:
    return Chain(*work_of(folder, stub, monkeypatch, **more))


def test_the_chain_finds_a_setting_with_the_target_angle(powder, monkeypatch):
    stub = Formula()
    chain = chain_of(powder, stub, monkeypatch)
    decisions = chain.run()
    assert list(decisions) == list(STAGES)
    assert decisions["screening"].factors == ["B", "C", "G"]
    assert decisions["climb"].reached
    point = decisions["optimum"].point
    factors = {f.name: f for f in chain.heaps.plan.factors}
    true = stub.level + sum(k * factors[n].coded(point[n]) for n, k in SLOPES.items())
    assert true == pytest.approx(41.69, abs=0.6)
    found = decisions["validation"]
    assert found.mean_deg == pytest.approx(true, abs=0.5)
    assert found.standard_error_deg <= FULL.wanted_error
    assert found.heaps >= 10
    heaps = [decisions[stage].heaps for stage in ("screening", "climb", "surface")]
    heaps += [attempt.heaps for attempt in found.attempts]
    assert len(set(stub.asked)) == sum(heaps)  # every heap has a seed of its own
    runs = pd.read_csv(powder / "runs.csv")
    assert len(runs) == len(set(runs["seed"])) == len(set(stub.asked))
    text = report.write(chain)
    assert "validation" in text and "not represented" in text
    for picture in ("screening/pareto.png", "climb/climb.png", "optimum/surface.png", "surface/predicted_observed.png"):
        assert (powder / picture).stat().st_size > 5000
    json.dumps(report.answer(chain.results), allow_nan=False)
    readings = pd.read_csv(powder / "screening" / "readings.csv").set_index(["reading", "factor"])["effect"]
    for name in "BCG":  # the stub's flank is the angle and 2 deg, its moment half of it
        assert readings["repose_flank_deg", name] == pytest.approx(readings["repose_angle_deg", name])
        assert readings["repose_moment_deg", name] == pytest.approx(readings["repose_angle_deg", name] / 2)
    assert "repose_moment_deg" in text


def test_each_key_of_the_answer_has_its_meaning(powder, tmp_path, monkeypatch):
    chain = chain_of(powder, Formula(), monkeypatch)
    chain.run()
    heaps, results = work_of(powder, Formula(), monkeypatch)
    few = report.path_answer(few_heaps.calibrate(heaps, results))
    answers = [{**answer, "assumed": {}} for answer in (report.answer(chain.results), few)]
    assert without_meaning("calibrate", *answers) == set()
    assert not_there("calibrate", answers) == set()


def test_the_measured_effects_are_recovered_with_honest_errors(powder, monkeypatch):
    chain_of(powder, Formula(), monkeypatch).run(["screening"])
    effects = pd.read_csv(powder / "screening" / "effects.csv").set_index("factor")
    for name, slope in SLOPES.items():
        row = effects.loc[name]
        assert row["effect_deg"] == pytest.approx(2 * slope, abs=3 * row["standard_error_deg"])
        assert row["sign"] == "as the paper"
    assert 0.1 < effects["standard_error_deg"].iloc[0] < 0.5  # noise 0.4: 0.4 * 2 / sqrt(12) = 0.23
    assert effects.loc["A", "sign"] == "not represented"


def test_stages_can_be_stopped_resumed_and_done_again(powder, monkeypatch):
    chain = chain_of(powder, Formula(), monkeypatch)
    with pytest.raises(InputError, match="screening was not run"):
        chain.run(["climb"])
    chain.run(["screening", "climb"])
    before = (powder / "climb" / "decision.json").read_text()
    again = chain_of(powder, Formula(), monkeypatch)
    again.run(["climb"])
    assert (powder / "climb" / "decision.json").read_text() == before
    assert list(again.run(["surface"])) == ["screening", "climb", "surface"]


def test_jammed_heaps_are_left_out_and_counted(powder, monkeypatch):
    said = []
    stub = Formula(jammed={10_002, 30_001})
    chain = chain_of(powder, stub, monkeypatch, say=said.append)
    decisions = chain.run()
    assert decisions["screening"].lost == 1 and decisions["surface"].lost == 1
    third = next(seed for seed, number in stub.numbers.items() if number == 10_002)
    assert any(f"seed {third}" in line and "jammed" in line for line in said)
    runs = pd.read_csv(powder / "runs.csv")
    assert runs.loc[runs["seed"] == third, "repose_angle_deg"].isna().all()
    with pytest.raises(SimulationError, match="only"):
        chain_of(powder, Formula(jammed=range(10_000, 10_040)), monkeypatch).run(["screening"])


def test_a_target_read_as_flanks_is_met_by_flanks_and_a_heap_without_them_is_lost(powder, monkeypatch):
    (powder / "measurements.csv").write_text("rig,observable,value,sd\nrepose,repose_flank_deg,41.69,0.79\n")
    said = []
    stub = Formula(flat={10_002})
    decisions = chain_of(powder, stub, monkeypatch, say=said.append).run(["screening"])
    assert decisions["screening"].lost == 1
    assert any("no repose_flank_deg: too flat" in line for line in said)
    runs = pd.read_csv(powder / "screening" / "runs.csv").set_index("seed")
    monkeypatch.undo()
    (powder / "measurements.csv").write_text("rig,observable,value,sd\nrepose,repose_angle_deg,41.69,0.79\n")
    angles = chain_of(powder, Formula(), monkeypatch)
    angles.run(["screening"])
    other = pd.read_csv(powder / "screening" / "runs.csv").set_index("seed")
    difference = (runs["repose_angle_deg"] - other["repose_angle_deg"]).dropna()
    assert len(difference) == len(other) - 1 and difference.to_numpy() == pytest.approx(2.0)


def test_as_many_heaps_as_terms_leave_no_scatter_and_are_refused(powder, monkeypatch):
    """Eight corners and a centre: mean, seven factors and curvature; a tenth heap is needed to tell their scatter."""
    lost = {*range(10_008, 10_012), *range(10_013, 10_040)}
    sizes = replace(FULL, repeats=1)
    with pytest.raises(SimulationError, match="only 9 of .* heaps gave an angle, 10 are needed"):
        chain_of(powder, Formula(jammed=lost), monkeypatch, sizes=sizes).run(["screening"])


def test_the_heap_whose_grains_are_kept_gave_an_angle(powder, monkeypatch):
    stub = Formula(jammed={50_000})
    chain_of(powder, stub, monkeypatch, sizes=replace(FULL, attempts=1)).run()
    assert stub.numbers[stub.asked[-1]] == 50_001


def test_a_target_outside_the_box_moves_it_and_is_met_by_no_extrapolation(powder, monkeypatch):
    decisions = chain_of(powder, Formula(level=31.5), monkeypatch).run()
    factors = {f.name: f for f in screening_factors()}
    point = decisions["optimum"].point
    assert decisions["climb"].moves + len(decisions["surface"].boxes) > 1
    assert abs(factors["C"].coded(point["C"])) > 1 or abs(factors["G"].coded(point["G"])) > 1
    for name, (low, high) in decisions["optimum"].box.items():
        assert min(low, high) - 1e-9 <= point[name] <= max(low, high) + 1e-9
    assert decisions["validation"].mean_deg == pytest.approx(41.69, abs=1.5)


def test_a_target_out_of_reach_is_said(powder, monkeypatch):
    decisions = chain_of(powder, Formula(level=5.0, slopes={"C": 0.5, "G": 0.4, "B": -0.3}), monkeypatch).run()
    assert not decisions["climb"].reached
    optimum, validation = decisions["optimum"], decisions["validation"]
    assert not optimum.reachable
    assert not validation.equivalent
    line = summary(optimum)
    assert f"not reachable in this box: it gives {optimum.lowest:.1f} to {optimum.highest:.1f} deg; nearest" in line
    assert "would do" not in line


def test_where_the_nothing_nearer_nothing_is_corrected_and_no_heap_is_wasted(powder, monkeypatch):
    stub = Formula(level=5.0, slopes={"C": 0.5, "G": 0.4, "B": -0.3})
    said = []
    chain = chain_of(powder, stub, monkeypatch, say=said.append)
    decisions = chain.run()
    found = decisions["validation"]
    assert found.nothing_nearer and len(found.attempts) == 1
    assert sum(number >= 50_000 for number in stub.numbers.values()) == found.heaps
    assert not any("corrected and validated" in line for line in said)
    text = report.write(chain)
    assert (
        "not corrected, as along the gradient the box has nothing nearer" in text
        and "the setting corrected" not in text
    )
    (words,) = (part.words for part in powder_stages(powder, (41.69, 0.79)) if part.kind == "validation")
    assert (
        "not corrected, as along the gradient the box has nothing nearer" in words[0]
        and "was corrected" not in words[0]
    )
    (surface,) = (p.words for p in powder_stages(powder, (41.69, 0.79)) if p.kind == "surface")
    assert "is not reachable in this box" in surface[1] and "recommended" not in surface[1]


class Sinking(Formula):
    """The heaps of the boxes after the first, known by their numbers, lie lower: moving the box led away from the target."""

    def run(self, cases, store, **options):
        rows = super().run(cases, store, **options)
        later = np.array([30_041 <= self.numbers[case["seed"]] < 40_000 for case in cases])  # 41 heaps a box
        rows["repose_angle_deg"] -= 5.0 * later
        return rows


def test_of_boxes_that_all_miss_the_nearest_counts(powder, monkeypatch):
    measured(powder, 45.0)
    chain = chain_of(powder, Sinking(level=30.0, slopes={"B": -0.3, "C": 0.5, "G": 0.4}, noise=0.1), monkeypatch)
    decisions = chain.run(STAGES[:4])
    surface = decisions["surface"]
    assert len(surface.boxes) == box.MOVES
    assert surface.chosen_box == 0
    assert surface.box == surface.boxes[surface.chosen_box] == decisions["optimum"].box
    design = pd.read_csv(powder / "surface" / "design.csv")
    low, high = surface.box["C"]
    assert design["C"].between(low - 1e-9, high + 1e-9).all()
    assert decisions["optimum"].highest > 30  # that of the first box's surface
    line = summary(surface)
    assert "3 boxes, the surface is that of number 1" in line and "predicted R2" in line


def test_levels_beyond_the_study_are_said(powder, monkeypatch):
    decisions = chain_of(powder, Formula(level=31.5), monkeypatch).run()
    optimum = decisions["optimum"]
    assert optimum.outside
    for name in optimum.outside:
        assert f"{name} {optimum.point[name]:.3f} (outside the range" in summary(optimum)
    words = " ".join(line for part in powder_stages(powder, (41.69, 0.79)) for line in part.words)
    assert "(outside the range" in words


def test_lost_heaps_of_every_stage_are_counted(powder, monkeypatch):
    decisions = chain_of(powder, Formula(jammed={10_002, 20_001, 30_001, 50_002}), monkeypatch).run()
    for stage in ("screening", "climb", "surface"):
        assert "1 of them gave no angle" in summary(decisions[stage])
    heaps = decisions["validation"].heaps
    line = summary(decisions["validation"])
    assert f"deg over {heaps - 1} of {heaps} heaps (1 gave no angle)" in line


def test_a_surface_whose_runs_do_not_give_the_predicted_r2_is_summed_up(powder, monkeypatch):
    """One heap a point, two of them lost: a run that is left fixes a coefficient by itself."""
    sizes = replace(FULL, repeats=1)
    chain = chain_of(powder, Formula(jammed={30_001, 30_005}), monkeypatch, sizes=sizes)
    decisions = chain.run(STAGES[:4])
    assert decisions["surface"].r2_predicted is None
    assert "predicted R2 not known" in report.write(chain)
    assert any("predicted not known" in line for p in powder_stages(powder, (41.69, 0.79)) for line in p.words)


def test_the_rule_of_the_screening_is_said():
    decision = Screening(
        factors=["B", "C", "G"], clear=["C", "D", "G"], coefficients={}, heaps=41, lost=0,
        curvature_deg=-1.25, curvature_standard_error_deg=0.5,
    )  # fmt: skip
    line = summary(decision)
    assert (
        "beyond two standard errors: C, D, G; the three largest effects go on: B, C, G, of which B is not clear" in line
    )
    assert "D is left out although clear" in line
    assert "go on: B, C, G, none of them clear" in summary(replace(decision, clear=[]))
    assert "-1.25 +- 0.50 deg" in line


def test_the_curvature_of_the_screening_is_that_of_its_heaps(powder, monkeypatch):
    decision = chain_of(powder, Formula(), monkeypatch).run(["screening"])["screening"]
    runs = pd.read_csv(powder / "screening" / "runs.csv")
    centre = (runs["A"] == 0.15) & (runs["G"] == 0.2)
    angles = runs["repose_angle_deg"]
    assert decision.curvature_deg == pytest.approx(angles[centre].mean() - angles[~centre].mean(), abs=1e-9)
    assert decision.curvature_standard_error_deg == pytest.approx(0.4 * (1 / 5 + 1 / 36) ** 0.5, rel=0.4)  # noise 0.4


def test_the_summary_stands_after_every_stage(powder, monkeypatch, capsys):
    class Interrupted(Formula):
        def run(self, cases, store, **options):
            if cases[0]["seed"] >= 3 * 10**9:
                raise KeyboardInterrupt
            return super().run(cases, store, **options)

    monkeypatch.setattr(heaps_module, "dispatch", Interrupted())
    assert main(["calibrate", str(powder)]) == 130
    text = (powder / "summary.txt").read_text()
    assert "climb       18 heaps" in text and "surface     not done yet" in text


def test_a_stage_before_its_time_is_refused_before_it_is_announced(powder, monkeypatch, capsys):
    monkeypatch.setattr(heaps_module, "dispatch", Formula())
    assert main(["calibrate", str(powder), "--only", "surface"]) == 2
    told = capsys.readouterr()
    assert told.out.startswith("assumed: ") and told.out.count("\n\n") == 1  # and nothing of a stage
    assert "climb was not run yet" in told.err


@pytest.mark.parametrize("workers", ("0", "-2"))
def test_less_than_one_worker_is_refused(powder, monkeypatch, capsys, workers):
    stub = Formula()
    monkeypatch.setattr(heaps_module, "dispatch", stub)
    assert main(["calibrate", str(powder), "--workers", workers]) == 2
    assert f"--workers {workers}: expected at least one" in capsys.readouterr().err
    assert stub.asked == []


def test_results_that_cannot_be_written_are_refused_with_the_option(powder, monkeypatch, capsys):
    stub = Formula()
    monkeypatch.setattr(heaps_module, "dispatch", stub)
    for place in ("/proc/foo", powder / "measurements.csv", powder / "measurements.csv" / "below"):
        assert main(["calibrate", str(powder), "--results", str(place)]) == 2
        assert f"--results {place}: cannot be made" in capsys.readouterr().err
    assert stub.asked == []


def test_the_margin_is_declared_before_and_not_changed_after(powder, monkeypatch):
    chain = chain_of(powder, Formula(), monkeypatch)
    chain.run()
    assert json.loads((powder / "validation" / "margin.json").read_text())["margin"] == 0.79
    (powder / "measurements.csv").write_text("rig,observable,value,sd\nrepose,repose_angle_deg,41.69,2.0\n")
    stub = Formula()
    for stages in (["validation"], STAGES):
        with pytest.raises(InputError, match="margin 0.79 deg, not 2.* --results"):
            chain_of(powder, stub, monkeypatch).run(stages)
    assert stub.asked == []


def test_the_quick_chain_reads_the_stages_it_does_not_do(powder, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(heaps_module, "dispatch", Formula(noise=1.2))
    full, quick = powder, tmp_path / "quick"
    assert main(["calibrate", str(full)]) == 0
    assert main(["calibrate", str(full), "--results", str(quick), "--quick", str(full)]) == 0
    text = capsys.readouterr().out.split("results in")[1]
    assert f"(read from {full})" in text
    assert "error at most" in text  # four heaps know no better
    assert len(pd.read_csv(quick / "validation" / "runs.csv")) == 4
    shared = pd.read_csv(quick / "screening" / "runs.csv").merge(pd.read_csv(full / "runs.csv"), on=["stage", "seed"])
    assert len(shared) == 12 + 3
    assert (shared["repose_angle_deg_x"] == shared["repose_angle_deg_y"]).all()
    before = (full / "runs.csv").read_bytes()
    assert main(["calibrate", str(full), "--quick", str(full)]) == 2
    assert "write over" in capsys.readouterr().err
    assert main(["calibrate", str(full), "--results", str(quick), "--quick", str(full), "--until", "climb"]) == 2
    assert (full / "runs.csv").read_bytes() == before


def test_studies_without_a_measured_angle_are_refused(powder):
    (powder / "measurements.csv").write_text("rig,observable,value,sd\nrebound,rebound_height_mm,8.01,0.1\n")
    with pytest.raises(InputError, match="repose"):
        plan_of(load(powder))
    (powder / "measurements.csv").write_text("rig,observable,value\nrepose,repose_angle_deg,41.69\n")
    with pytest.raises(InputError, match="sd"):
        plan_of(load(powder))


def test_repeats_are_heaps_at_the_same_points(powder, monkeypatch, capsys):
    monkeypatch.setattr(heaps_module, "dispatch", Formula())
    assert main(["calibrate", str(powder), "--until", "screening", "--repeats", "2"]) == 0
    runs = pd.read_csv(powder / "screening" / "runs.csv")
    assert len(runs) == 2 * 12 + 5
    assert (runs.loc[:11, list(SYMBOLS)].to_numpy() == runs.loc[17:, list(SYMBOLS)].to_numpy()).all()
    assert main(["calibrate", str(powder), "--repeats", "0"]) == 2
    assert "at least one" in capsys.readouterr().err


def test_repeats_hold_in_their_folder_until_others_are_given(powder, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(heaps_module, "dispatch", Formula())
    assert main(["calibrate", str(powder), "--until", "screening", "--repeats", "1"]) == 0
    law = f"--contact-law {laws.LOCAL_DAMPING}"
    assert decisions_module.command(powder) == f"pellet-study calibrate {powder} {law} --repeats 1"
    assert "as before" not in capsys.readouterr().out
    assert main(["calibrate", str(powder), "--until", "climb"]) == 0
    assert f"heaps at each point: 1, as before in {powder}; --repeats 3 for 3" in capsys.readouterr().out
    assert len(pd.read_csv(powder / "climb" / "runs.csv")) == box.CLIMB_POINTS
    assert main(["calibrate", str(powder), "--until", "climb", "--repeats", "3"]) == 0
    assert len(pd.read_csv(powder / "climb" / "runs.csv")) == 3 * box.CLIMB_POINTS
    assert decisions_module.command(powder) == f"pellet-study calibrate {powder} {law}"
    other = tmp_path / "hertz"
    words = [
        "calibrate",
        str(powder),
        "--results",
        str(other),
        "--contact-law",
        "cohesive_frictional",
        "--repeats",
        "2",
    ]
    assert main([*words, "--until", "screening"]) == 0
    assert decisions_module.command(other) == f"pellet-study calibrate {other} --repeats 2"


def test_both_laws_stand_side_by_side(powder, monkeypatch, capsys):
    monkeypatch.setattr(heaps_module, "dispatch", Formula())
    other = str(powder / "cohesive_frictional")
    assert (
        main(
            ["calibrate", str(powder), "--contact-law", "cohesive_frictional", "--results", other, "--until", "optimum"]
        )
        == 0
    )
    assert not (powder / "laws.csv").exists()
    assert main(["calibrate", str(powder)]) == 0
    table = pd.read_csv(powder / "laws.csv").set_index("factor")
    assert table.loc["A", "cohesive_frictional_local_damping_sign"] == "not represented"
    assert table.loc["A", "cohesive_frictional_sign"] == "not clear"  # the stub has no restitution
    assert table.loc["C", "cohesive_frictional_effect"] == table.loc["C", "cohesive_frictional_local_damping_effect"]
    assert "both contact laws" in capsys.readouterr().out


def test_a_setting_that_misses_is_corrected_and_validated_with_other_seeds(powder, monkeypatch):
    stub = Formula()
    chain = chain_of(powder, stub, monkeypatch)
    chain.run(STAGES[:4])
    file = powder / "optimum" / "decision.json"
    decision = json.loads(file.read_text())
    decision["point"]["G"] += 0.04  # 1.5 deg too much
    file.write_text(json.dumps(decision))
    found = chain.run(["validation"])["validation"]
    first, second = found.attempts
    assert not first.equivalent and found.equivalent
    assert second.mean_deg == found.mean_deg == pytest.approx(41.69, abs=0.6)
    runs = pd.read_csv(powder / "validation" / "runs.csv")
    assert len(runs) == first.heaps + second.heaps and runs["seed"].is_unique


def test_a_setting_that_cannot_pass_any_more_takes_no_further_heaps(powder, monkeypatch):
    """Heaps that scatter by 2 deg need 64 for a standard error of 0.25; 7 deg off shows after the first ten."""
    chain = chain_of(powder, Formula(noise=2.0), monkeypatch)
    chain.run(STAGES[:4])
    file = powder / "optimum" / "decision.json"
    decision = json.loads(file.read_text())
    decision["point"]["G"] += 0.2
    file.write_text(json.dumps(decision))
    first, second = chain.run(["validation"])["validation"].attempts
    assert first.heaps == FULL.fewest and not first.equivalent
    assert 30 < second.heaps <= FULL.most and second.standard_error_deg <= FULL.wanted_error


def measured(folder: Path, value: float, sd: float = 0.79) -> None:
    (folder / "measurements.csv").write_text(f"rig,observable,value,sd\nrepose,repose_angle_deg,{value},{sd}\n")


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda f: measured(f, 40.0), "target_deg 41.69 there, 40.0 here"),
        (lambda f: measured(f, 41.69, 1.0), "sd_deg 0.79 there, 1.0 here"),
        (
            lambda f: (f / "study.toml").write_text(
                f'contact_law = "{laws.LOCAL_DAMPING}"\n[parameters]\npowder_static_friction = {{ min = 0.5, max = 0.9 }}\n'
            ),
            "B 0.7 to 0.9 there, 0.5 to 0.9 here",
        ),
        (
            lambda f: (f / "study.toml").write_text(
                f'contact_law = "{laws.LOCAL_DAMPING}"\n[parameters]\npowder_density_kg_m3 = 1500\n'
            ),
            "powder_density_kg_m3 not given there, 1500.0 here",
        ),
        (
            lambda f: (f / "study.toml").write_text(
                f'surface_energy_scaling = "none"\ncontact_law = "{laws.LOCAL_DAMPING}"\n'
            ),
            "surface_energy_exponent 2.0 there, 0.0 here",
        ),
        (
            lambda f: (f / "measurements.csv").write_text(
                "rig,observable,value,sd,powder_mass_g\nrepose,repose_angle_deg,41.69,0.79,20\n"
            ),
            "powder_mass_g 25.0 there, 20.0 here",
        ),
    ],
)
def test_decisions_for_another_plan_are_refused(powder, monkeypatch, change, told):
    chain_of(powder, Formula(), monkeypatch).run(["screening"])
    change(powder)
    stub = Formula()
    with pytest.raises(InputError, match=told):
        chain_of(powder, stub, monkeypatch).run(["climb"])
    assert stub.asked == []


def test_what_was_decided_for_another_plan_is_left_out(powder, monkeypatch):
    chain_of(powder, Formula(), monkeypatch).run(STAGES[:4])
    measured(powder, 40.0)
    chain = chain_of(powder, Formula(), monkeypatch)
    decisions = chain.run(["screening"])
    assert list(decisions) == ["screening"]
    assert set(pd.read_csv(powder / "runs.csv")["stage"]) == {"screening"}
    text = report.write(chain)
    assert text.count("target_deg 41.69 there, 40.0 here") == 3  # climb, surface, optimum
    assert "coefficients of the surface" not in text and "effects (change" in text
    assert list(chain.run(STAGES[:4])) == list(STAGES[:4])
    assert set(pd.read_csv(powder / "runs.csv")["stage"]) == {"screening", "climb", "surface"}


def test_the_report_says_which_stage_was_decided_for_another_plan(powder, monkeypatch):
    chain_of(powder, Formula(), monkeypatch).run(STAGES[:3])
    shown = powder_stages(powder, (41.69, 0.79))
    assert len(shown) == 3 and not any("another plan" in line for part in shown for line in part.words)
    moved = powder_stages(powder, (40.0, 0.79))
    assert all("target_deg 41.69 there, 40 in the study now" in part.words[-1] for part in moved)
    measured(powder, 40.0)
    chain_of(powder, Formula(), monkeypatch).run(["screening"])
    screening, climb, surface = powder_stages(powder, (40.0, 0.79))
    assert not any("another plan" in line for line in screening.words)
    for part in (climb, surface):
        assert "target_deg 41.69 there, 40.0 here" in part.words[-1]
    assert any("41.69 deg within its scatter" in line for line in surface.words)  # with its own target


def test_a_decision_that_does_not_say_its_plan_is_refused(powder, monkeypatch):
    chain_of(powder, Formula(), monkeypatch).run(["screening", "climb"])
    file = powder / "screening" / "decision.json"
    old = json.loads(file.read_text())
    del old["plan"]
    file.write_text(json.dumps(old))
    chain = chain_of(powder, Formula(), monkeypatch)
    with pytest.raises(InputError, match="older version .* run calibrate on the whole chain there again .* store"):
        chain.run(["climb"])
    assert list(chain.run(["screening"])) == ["screening", "climb"]
    file.write_text("{")
    with pytest.raises(InputError, match="decision.json: is not what `calibrate` wrote"):
        chain_of(powder, Formula(), monkeypatch).run(["climb"])


def test_a_stage_that_stopped_half_way_is_not_done(powder, monkeypatch):
    chain_of(powder, Formula(), monkeypatch).run(["screening", "climb"])
    chain = chain_of(powder, Formula(jammed=range(20_000, 20_100)), monkeypatch)
    with pytest.raises(SimulationError):
        chain.run(["climb"])
    assert list(chain.run(["screening"])) == ["screening"]
    assert set(pd.read_csv(powder / "runs.csv")["stage"]) == {"screening"}


def test_the_other_contact_law_wants_a_folder_of_its_own_before_anything_is_simulated(powder, monkeypatch, capsys):
    monkeypatch.setattr(heaps_module, "dispatch", Formula())
    assert main(["calibrate", str(powder), "--until", "climb"]) == 0
    (powder / "screening").rename(powder / "kept")  # any stage is in the way
    before = {file: file.read_bytes() for file in powder.rglob("*") if file.is_file()}
    stub = Formula()
    monkeypatch.setattr(heaps_module, "dispatch", stub)
    capsys.readouterr()
    assert main(["calibrate", str(powder), "--contact-law", "cohesive_frictional"]) == 2
    told = capsys.readouterr().err
    assert "climb" in told and "cohesive_frictional" in told and "--results" in told
    assert stub.asked == []
    assert {file: file.read_bytes() for file in powder.rglob("*") if file.is_file()} == before


def test_quick_reads_only_decisions_for_its_own_plan(powder, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(heaps_module, "dispatch", Formula())
    assert main(["calibrate", str(powder)]) == 0
    quick = str(tmp_path / "quick")
    stub = Formula()
    monkeypatch.setattr(heaps_module, "dispatch", stub)
    words = ["calibrate", str(powder), "--results", quick, "--quick", str(powder)]
    assert main([*words, "--contact-law", "cohesive_frictional"]) == 2
    assert "contact_law cohesive_frictional_local_damping there, cohesive_frictional here" in capsys.readouterr().err
    (powder / "validation" / "decision.json").write_text(
        '{"contact_law": "cohesive_frictional_local_damping", "point": {}}'
    )
    assert main(words) == 2
    assert str(powder / "validation") in capsys.readouterr().err
    (powder / "validation" / "decision.json").unlink()
    measured(powder, 43.0)
    assert main(words) == 2
    assert "target_deg 41.69 there, 43.0 here" in capsys.readouterr().err
    assert stub.asked == []


def test_a_setting_that_was_read_is_validated_with_seeds_that_did_not_choose_it(powder, tmp_path, monkeypatch):
    first = Formula(noise=1.5)
    chain_of(powder, first, monkeypatch).run()
    before = set(first.asked)
    stub = Formula(noise=1.5)
    monkeypatch.setattr(heaps_module, "dispatch", stub)
    plan = plan_of(load(powder))
    folder = tmp_path / "quick"
    Chain(Heaps(plan, folder / ".store", QUICK), Results(plan, folder, powder)).run(["validation"])
    assert len(stub.asked) == 5  # four heaps, one of them again for its grains
    assert not before & set(stub.asked)
    assert all(seed // 10**9 == 5 for seed in stub.asked)
    full = json.loads((powder / "validation" / "decision.json").read_text())
    assert json.loads((folder / "validation" / "decision.json").read_text())["point"] == full["point"]


def test_both_laws_stand_side_by_side_only_for_one_plan(powder, monkeypatch):
    monkeypatch.setattr(heaps_module, "dispatch", Formula())
    other = ["--contact-law", "cohesive_frictional", "--results", str(powder / "cohesive_frictional")]
    assert main(["calibrate", str(powder), *other, "--until", "screening"]) == 0
    assert main(["calibrate", str(powder), "--until", "screening"]) == 0
    assert (powder / "laws.csv").exists()
    measured(powder, 43.0)
    assert main(["calibrate", str(powder), "--until", "screening"]) == 0
    assert not (powder / "laws.csv").exists()


def test_contradicting_rows_are_said_in_the_summary(powder, monkeypatch, capsys):
    monkeypatch.setattr(heaps_module, "dispatch", Formula())
    (powder / "measurements.csv").write_text(
        "rig,observable,value,sd\nrepose,repose_angle_deg,40,0.5\nrepose,repose_angle_deg,44,0.5\n"
    )
    assert main(["calibrate", str(powder), "--until", "screening"]) == 0
    assert "contradict" in capsys.readouterr().out
    assert "contradict" in (powder / "summary.txt").read_text()
    assert main(["calibrate", str(powder), "--few"]) == 0
    assert "contradict" in capsys.readouterr().out


def test_calibrate_says_which_ranges_are_the_source_papers(powder, monkeypatch, capsys):
    """Only B has a range of the study's own; the other six are screened, and nothing of the seven is called assumed."""
    monkeypatch.setattr(heaps_module, "dispatch", Formula())
    toml = powder / "study.toml"
    toml.write_text(toml.read_text() + "[parameters]\npowder_static_friction = { min = 0.5, max = 0.8 }\n")
    assert main(["calibrate", str(powder), "--until", "screening", "--json", str(powder / "answer.json")]) == 0
    said = capsys.readouterr().out
    assert "screened over the source paper's Table 6" in said and "powder_restitution (A) 0.05 to 0.25" in said
    assert "powder_static_friction (B)" not in said and "screening: 41 heaps" in said
    assumed = json.loads((powder / "answer.json").read_text())["assumed"]
    assert "powder_shear_modulus_pa" in assumed and not set(SYMBOLS.values()) & set(assumed)


def test_a_reading_whose_heaps_do_not_separate_the_factors_is_left_out_and_the_screening_goes_on(powder, monkeypatch):
    class FlatWithLittleCohesion(Formula):
        def run(self, cases, store, **more):
            found = super().run(cases, store, **more)
            flat = [case["parameters"]["powder_surface_energy"] < 0.15 for case in cases]
            return found.assign(repose_flank_deg=found["repose_flank_deg"].mask(flat))

    chain = chain_of(powder, FlatWithLittleCohesion(), monkeypatch)
    assert chain.run(("screening",))["screening"].factors == ["B", "C", "G"]
    readings = pd.read_csv(powder / "screening" / "readings.csv")["reading"]
    assert set(readings) == {"repose_angle_deg", "repose_moment_deg", "repose_height_deg"}


def test_python_and_the_command_assume_the_same(powder, monkeypatch, capsys):
    monkeypatch.setattr(heaps_module, "dispatch", Formula())
    assert main(["calibrate", str(powder), "--until", "screening", "--json", str(powder / "answer.json")]) == 0
    told = ps.calibrate(ps.load_study(powder), until="screening", results=powder)
    assert told["assumed"] == json.loads((powder / "answer.json").read_text())["assumed"]
