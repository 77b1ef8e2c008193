"""What several readings tell of the parameters, on surfaces whose truth is a formula."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from pellet_study.__main__ import main
from pellet_study.doe import box_behnken
from pellet_study.doe.factors import Factor
from pellet_study.errors import InputError, SimulationError
from pellet_study.paper.designs import screening_factors
from pellet_study.powder import heaps as heaps_module
from pellet_study.powder import identified, report, responses
from pellet_study.powder.chain import Chain
from pellet_study.powder.decisions import read_decision
from pellet_study.powder.figures import corner
from pellet_study.powder.from_study import plan_of
from pellet_study.powder.gains import expected_share
from pellet_study.powder.plan import SYMBOLS, Reading
from pellet_study.powder.posterior import Block, posterior
from pellet_study.powder.text import joint_lines
from pellet_study.report.powder import measured_angle, powder_stages
from pellet_study.study import load
from tests.powder.test_chain import SLOPES, Formula, work_of

FACTORS = [Factor("B", 0.7, 0.9, "-"), Factor("C", 0.25, 0.45, "-"), Factor("G", 0.1, 0.3, "J/m2")]
NAMES = ["angle", "height", "time"]
LEVEL = np.array([40.0, 45.0, 0.45])
SLOPE = np.array([[1.0, 0.2, 0.01], [1.5, 0.5, -0.02], [2.0, 2.5, 0.05]])  # (factors, readings)
SCATTER = np.array([[4.0, 1.5, 0.01], [1.5, 2.0, 0.0], [0.01, 0.0, 4e-4]])  # of one heap
CODED = np.repeat(box_behnken.coded_matrix(3, 5), 3, axis=0)


def truth(coded):
    return LEVEL + np.asarray(coded) @ SLOPE


def simulated(random):
    return responses.fit(
        FACTORS, NAMES, CODED, truth(CODED) + random.multivariate_normal(np.zeros(3), SCATTER, len(CODED))
    )


def block_of(surfaces, at, random, n=6, names=NAMES):
    """Means of n measured pourings of a powder at coded levels, in some of the readings."""
    keep = [NAMES.index(name) for name in names]
    covariance = SCATTER[np.ix_(keep, keep)] / n
    measured = random.multivariate_normal(truth(at)[keep], covariance)
    return Block(surfaces.of(names), measured, covariance)


def drawn(found, number, seed=0):
    """Coded settings drawn from a posterior."""
    return found.coded[np.random.default_rng(seed).choice(len(found.weights), number, p=found.weights)]


def test_surfaces_of_all_readings_are_those_of_each_by_itself():
    random = np.random.default_rng(0)
    surfaces = simulated(random)
    readings = surfaces.predict(CODED)
    assert readings.shape == (len(CODED), 3)
    table = pd.DataFrame(CODED, columns=["B", "C", "G"])
    from pellet_study.doe.design_table import code_design

    y = truth(CODED) + random.normal(size=(len(CODED), 3))
    both = responses.fit(FACTORS, NAMES, CODED, y)
    for k, name in enumerate(NAMES):
        physical = pd.DataFrame({f.name: f.physical(table[f.name]) for f in FACTORS}).assign(**{name: y[:, k]})
        one = box_behnken.analyse(code_design(physical, FACTORS, source="made"))
        assert both.coefficients[:, k] == pytest.approx(list(one.coefficients.values()))
        assert both.scatter[k, k] == pytest.approx(one.model.mean_square_error)


def test_the_scatter_of_surfaces_is_that_of_the_heaps_and_their_common_part():
    random = np.random.default_rng(1)
    found = np.mean([simulated(random).scatter for _ in range(300)], axis=0)
    assert found == pytest.approx(SCATTER, rel=0.05, abs=0.01)


def test_what_a_quadratic_misses_is_not_taken_for_scatter():
    """A cubic of half-height 3 in one factor: no quadratic follows it at the points of a Box-Behnken design and its edges."""
    random = np.random.default_rng(2)
    points = np.vstack([CODED, np.repeat(np.eye(3) * 0.5, 3, axis=0), np.repeat(-np.eye(3) * 0.5, 3, axis=0)])
    y = truth(points) + random.multivariate_normal(np.zeros(3), SCATTER / 100, len(points))
    straight = responses.fit(FACTORS, NAMES, points, y)
    y[:, 0] += 12 * (points[:, 2] ** 3 - points[:, 2] * 0.8)
    bent = responses.fit(FACTORS, NAMES, points, y)
    assert straight.misfit[0, 0] < 0.1
    assert bent.misfit[0, 0] > 0.5 and bent.misfit[1, 1] < 0.1
    assert np.linalg.eigvalsh(bent.misfit).min() > -1e-9


def test_too_few_heaps_for_a_surface_are_refused():
    with pytest.raises(SimulationError, match="10 heaps have all of angle, height, time"):
        responses.fit(FACTORS, NAMES, CODED[:10], truth(CODED[:10]))


def test_the_region_holds_the_truth_as_often_as_it_says():
    """200 powders, each with surfaces and readings of its own: 95 % expected, 0.904 to 0.996 at 3 standard errors."""
    random = np.random.default_rng(3)
    held, inside = 0, np.zeros(3)
    for _ in range(200):
        at = random.uniform(-1, 1, 3)
        found = posterior(block_of(simulated(random), at, random))
        held += found.holds(at)
        for i, factor in enumerate(FACTORS):
            low, high = found.interval(i)
            inside[i] += low <= factor.physical(at[i]) <= high
    assert 0.904 < held / 200 < 0.996
    assert np.all(inside / 200 > 0.89)


def test_more_readings_leave_less_of_the_box():
    random = np.random.default_rng(4)
    surfaces, at = simulated(random), np.array([0.2, -0.3, 0.4])
    shares = [posterior(block_of(surfaces, at, np.random.default_rng(9), 30, NAMES[:k])).share() for k in (1, 2, 3)]
    assert shares[0] > shares[1] > shares[2]
    exact = block_of(surfaces, at, np.random.default_rng(9), 10**6, NAMES)
    assert posterior(exact).share() < shares[2]


def test_a_posterior_far_smaller_than_the_box_is_filled_anew():
    """Exact surfaces and readings of little scatter: the region is an ellipsoid of chi2(3) = 7.815, its volume over that of the box."""
    surfaces = replace(responses.fit(FACTORS, NAMES, CODED, truth(CODED)), freedom=10**6)
    sd = 0.02 * np.sqrt(np.diag(SCATTER))
    at = np.array([0.1, 0.2, -0.3])
    found = posterior(Block(surfaces, truth(at), np.diag(sd**2)))
    volume = 4 / 3 * np.pi * 7.815**1.5 * sd.prod() / abs(np.linalg.det(SLOPE)) / 8
    assert found.part < 0.1
    assert found.share() == pytest.approx(volume, rel=0.03)
    assert found.best == pytest.approx(at, abs=0.02)
    assert found.holds(at) and not found.holds(at + 0.5)


def test_intervals_and_draws_are_those_of_the_weights():
    random = np.random.default_rng(5)
    found = posterior(block_of(simulated(random), [0, 0, 0], random))
    draws = drawn(found, 20_000)
    for i, factor in enumerate(FACTORS):
        assert found.interval(i) == pytest.approx(np.quantile(factor.physical(draws[:, i]), [0.025, 0.975]), abs=0.004)
    inside = found.region()
    assert found.weights[inside].sum() == pytest.approx(0.95, abs=1e-3)
    assert found.weights[inside].min() >= found.weights[~inside].max()


def test_the_recommended_setting_is_among_the_densest_and_nearest_to_the_middle():
    random = np.random.default_rng(6)
    found = posterior(block_of(simulated(random), [0.5, 0.5, 0.5], random))
    among = found.coded[found.region(0.1)]
    assert (found.recommended**2).sum() == pytest.approx((among**2).sum(axis=1).min())


def test_the_expected_gain_is_what_the_reading_gives_on_average():
    """The third reading of powders drawn from the posterior, added for real: the mean share of 60 is the one foretold."""
    random = np.random.default_rng(7)
    surfaces = simulated(random)
    two = block_of(surfaces, [0.1, 0.2, 0.3], random, names=NAMES[:2])
    found = posterior(two)
    covariance = SCATTER / 6
    foretold = expected_share(found, Block(surfaces, np.append(two.measured, np.nan), covariance))
    shares = []
    for at in drawn(found, 60, seed=1):
        whole = covariance + surfaces.covariance(at[None, :])[0]
        shared = np.linalg.solve(whole[:2, :2], whole[:2, 2])
        predicted = surfaces.predict(at[None, :])[0]
        mean = predicted[2] + shared @ (two.measured - predicted[:2])
        reading = random.normal(mean, np.sqrt(whole[2, 2] - shared @ whole[:2, 2]))
        shares.append(posterior(Block(surfaces, np.append(two.measured, reading), covariance)).share())
    assert foretold < found.share()
    assert foretold == pytest.approx(np.mean(shares), abs=3 * np.std(shares) / 60**0.5 + 0.003)


def test_readings_of_one_pouring_go_together_as_those_of_a_heap_do():
    readings = [Reading("angle", 40, 3.0, 9, 0), Reading("height", 45, 1.5, 9, 0), Reading("time", 0.4, 0.03, 4, 0)]
    found = identified.measured_covariance(readings, SCATTER)
    sd = np.sqrt(np.diag(SCATTER))  # 2, 1.41, 0.02
    assert np.sqrt(np.diag(found)) == pytest.approx([1.0, 0.5, 0.015])
    rho = 0.95 * SCATTER / np.outer(sd, sd)
    assert found[0, 1] == pytest.approx(rho[0, 1] * sd[0] * sd[1] / 9)  # what the measured sds have beyond is their own
    # nine angles, the first four of them with a time: cov of the means is rho s s' 4/(9 4)
    assert found[0, 2] == pytest.approx(rho[0, 2] * sd[0] * sd[2] * 4 / (9 * 4))
    few = identified.measured_covariance([replace(readings[0], n=5, freedom=4)], SCATTER[:1, :1])
    assert few[0, 0] == pytest.approx(9 / 5 * (2.776445 / 1.959964) ** 2, rel=1e-5)


def test_a_second_reading_that_is_the_same_number_tells_next_to_nothing():
    """The height equal to the angle but for its name: no crash, and no more than a twentieth gained."""
    random = np.random.default_rng(11)
    y = truth(CODED) + random.multivariate_normal(np.zeros(3), SCATTER, len(CODED))
    y[:, 1] = y[:, 0] + 2
    surfaces = responses.fit(FACTORS, NAMES, CODED, y)
    shares = []
    for names, sds in ((NAMES[:1], [0.8]), (NAMES[:2], [0.8, 1.5])):
        readings = [
            Reading(name, 40.0 + 2 * k, sd, 20, 19) for k, (name, sd) in enumerate(zip(names, sds, strict=True))
        ]
        few = surfaces.of(names)
        covariance = identified.measured_covariance(readings, few.scatter)
        shares.append(posterior(Block(few, np.array([one.value for one in readings]), covariance)).share())
    assert 0.95 < shares[1] / shares[0] <= 1.02


# ------------------------------------------------------------------------------------------------- in the chain
class Pouring(Formula):
    """Stands for dispatch.run: a heap's angle by `Formula`, and the discharge and the fill of the same pouring, formulas too."""

    TIME = {"B": 0.04, "C": 0.0, "G": 0.08}  # s per coded unit of Table 6
    DENSITY = {"B": 0.0, "C": -25.0, "G": -25.0}  # kg/m3

    def run(self, cases, store, **options):
        found = super().run(cases, store, **options)
        factors = {f.name: f for f in screening_factors()}
        noise = np.array([np.random.default_rng([case["seed"], 7]).normal(size=2) for case in cases])
        for k, (name, level, slopes, sd) in enumerate(
            [("discharge_time_s", 0.45, self.TIME, 0.01), ("fill_bulk_density_kg_m3", 930.0, self.DENSITY, 5.0)]
        ):
            found[name] = level + sd * noise[:, k]
            for n, slope in slopes.items():
                found[name] += slope * np.array([factors[n].coded(case["parameters"][SYMBOLS[n]]) for case in cases])
        return found


AT = {"B": 0.78, "C": 0.37, "G": 0.19}  # the powder whose readings are "measured"


def readings_at(point, time=0.0):
    coded = {f.name: f.coded(point[f.name]) for f in screening_factors() if f.name in point}
    angle = 40.75 + sum(SLOPES[n] * x for n, x in coded.items())
    flow = 0.45 + sum(Pouring.TIME[n] * x for n, x in coded.items()) + time
    density = 930 + sum(Pouring.DENSITY[n] * x for n, x in coded.items())
    return (
        "rig,observable,value,sd,n\n"
        f"repose,repose_angle_deg,{angle:.4f},0.8,20\n"
        f"repose,discharge_time_s,{flow:.4f},0.02,20\n"
        f"repose,fill_bulk_density_kg_m3,{density:.4f},5,20\n"
    )


@pytest.fixture
def several(tmp_path):
    folder = tmp_path / "powder"
    folder.mkdir()
    (folder / "study.toml").write_text('title = "powder"\n')
    (folder / "measurements.csv").write_text(readings_at(AT))
    return folder


def test_three_readings_find_the_three_parameters_that_one_angle_leaves_open(several, monkeypatch):
    heaps, results = work_of(several, Pouring(), monkeypatch)
    chain = Chain(heaps, results)
    decided = chain.run()
    joint = decided["optimum"].joint
    assert [one.observable for one in joint.readings] == [
        "repose_angle_deg", "discharge_time_s", "fill_bulk_density_kg_m3",
    ]  # fmt: skip
    for one in joint.known:
        assert one.low <= AT[one.factor] <= one.high
    assert sum(one.word != "not identified" for one in joint.known) >= 2
    assert joint.share_of_box < joint.share_of_box_first / 3
    assert joint.doubtful is None and joint.distance_p > 0.01
    validated = decided["validation"]
    assert [one.observable for one in validated.others] == ["discharge_time_s", "fill_bulk_density_kg_m3"]
    assert validated.passed and all(one.equivalent for one in validated.others)
    assert read_decision(several, "optimum") == decided["optimum"]
    assert read_decision(several, "validation") == validated
    text = report.write(chain)
    for line in joint_lines(joint):
        assert line in text
    assert "discharge_time_s" in text and (several / "optimum" / "corner.png").stat().st_size > 5000
    json.dumps(report.answer(results), allow_nan=False)
    shown = {stage.kind: stage for stage in powder_stages(several, (41.0, 0.8))}
    assert "discharge_time_s" in str(shown["optimum"].tables[1].rows)
    assert shown["optimum"].pictures


def test_the_angle_alone_says_which_reading_to_take_next(several, monkeypatch):
    (several / "measurements.csv").write_text("".join(readings_at(AT).splitlines(keepends=True)[:2]))
    heaps, results = work_of(several, Pouring(), monkeypatch)
    decided = Chain(heaps, results).run(["screening", "climb", "surface", "optimum"])
    joint = decided["optimum"].joint
    assert joint.share_of_box == joint.share_of_box_first > 0.1
    assert joint.gains[0].observable in ("discharge_time_s", "fill_bulk_density_kg_m3")
    assert joint.gains[0].share_of_box < 0.8 * joint.share_of_box
    assert any(one.word == "not identified" for one in joint.known)
    more = next(gain for gain in joint.gains if gain.observable == "repose_angle_deg")
    assert more.n == 60 and more.share_of_box > joint.gains[0].share_of_box


def test_a_reading_that_no_powder_of_the_box_has_is_named_with_the_nearest_value(several, monkeypatch):
    (several / "measurements.csv").write_text(readings_at(AT, time=1.5))
    heaps, results = work_of(several, Pouring(), monkeypatch)
    chain = Chain(heaps, results)
    chain.run(["screening", "climb", "surface", "optimum"])
    joint = results.decision("optimum").joint
    (flow,) = (one for one in joint.readings if one.observable == "discharge_time_s")
    assert flow.out_of_reach and flow.nearest == pytest.approx(flow.highest)
    assert "but discharge_time_s" in report.text_of(results).split("optimum")[1].splitlines()[0]
    assert "cannot be had in the box, which gives" in report.text_of(results)


def test_readings_that_contradict_each_other_are_named(several, monkeypatch):
    """Time and density move with G alone here: a high time beside a high density cannot be, though each can be had."""

    class OfEnergy(Pouring):
        TIME = {"G": 0.08}
        DENSITY = {"G": -25.0}

    lines = readings_at(AT).splitlines()
    lines[2] = "repose,discharge_time_s,0.50,0.005,20"
    lines[3] = "repose,fill_bulk_density_kg_m3,945,3,20"
    (several / "measurements.csv").write_text("\n".join(lines) + "\n")
    heaps, results = work_of(several, OfEnergy(), monkeypatch)
    Chain(heaps, results).run(["screening", "climb", "surface", "optimum"])
    joint = results.decision("optimum").joint
    assert joint.contradictory and not any(one.out_of_reach for one in joint.readings)
    assert joint.doubtful is None  # without either of the two the rest agree
    assert "the readings contradict each other" in report.text_of(results)


def test_readings_that_are_moved_together_and_agree_do_not_contradict(tmp_path, monkeypatch):
    """All three move with G alone: one direction of the box for three readings; 40 powders, p below 0.05 in 2 expected."""
    random = np.random.default_rng(12)
    slope = np.zeros((3, 3))
    slope[2] = [3.0, 2.0, 0.05]
    low = 0
    for _ in range(40):
        at = random.uniform(-0.8, 0.8, 3)
        y = LEVEL + CODED @ slope + random.multivariate_normal(np.zeros(3), SCATTER, len(CODED))
        measured = random.multivariate_normal(LEVEL + at @ slope, SCATTER / 6)
        found = posterior(Block(responses.fit(FACTORS, NAMES, CODED, y), measured, SCATTER / 6))
        low += identified._contradiction(found) < 0.05
    assert low <= 6


def test_the_angle_that_is_the_triangle_steers_wherever_it_stands(several, monkeypatch):
    text = "rig,observable,value,sd,n\nrepose,repose_flank_deg,43.5,0.9,20\nrepose,repose_angle_deg,41.4,0.8,20\n"
    (several / "measurements.csv").write_text(text)
    plan = plan_of(load(several))
    assert (plan.observable, [one.observable for one in plan.others]) == ("repose_angle_deg", ["repose_flank_deg"])
    assert measured_angle(load(several)) == (41.4, 0.8)  # the report's, too
    heaps, results = work_of(several, Pouring(), monkeypatch)
    decided = Chain(heaps, results).run()
    assert decided["validation"].others[0].mean == pytest.approx(decided["validation"].mean_deg + 2, abs=1e-6)


def test_stated_sds_of_several_single_rows_are_taken_as_known():
    one = Reading("angle", 41.25, 0.8, 2, 0)
    assert one.sample.sd / one.sample.n**0.5 == pytest.approx(0.8 / 2**0.5)
    assert not one.attainable(0.025) and replace(one, n=9).attainable(0.025)


def test_a_reading_that_no_heap_has_is_refused_after_the_screening(several, monkeypatch):
    class Still(Pouring):
        def run(self, cases, store, **options):
            return super().run(cases, store, **options).assign(discharge_time_s=None)

    heaps, results = work_of(several, Still(), monkeypatch)
    with pytest.raises(SimulationError, match="discharge_time_s was measured, but none of the 41 heaps has it"):
        Chain(heaps, results).run(["screening"])


def test_the_angle_steers_wherever_it_stands_and_other_conditions_are_refused(several):
    lines = readings_at(AT).splitlines()
    (several / "measurements.csv").write_text("\n".join([lines[0], lines[2], lines[1], lines[3]]) + "\n")
    plan = plan_of(load(several))
    assert plan.observable == "repose_angle_deg"
    assert [one.observable for one in plan.readings] == [
        "repose_angle_deg", "discharge_time_s", "fill_bulk_density_kg_m3",
    ]  # fmt: skip
    (several / "measurements.csv").write_text("\n".join([lines[0], lines[2]]) + "\n")
    with pytest.raises(InputError, match="no repose angle"):
        plan_of(load(several))
    (several / "measurements.csv").write_text(
        "rig,observable,value,sd,protocol\nrepose,repose_angle_deg,40,1,defined_base\nrepose,discharge_time_s,1,0.1,funnel\n"
    )
    with pytest.raises(InputError, match="differ in their conditions"):
        plan_of(load(several))


def test_what_the_other_factors_may_do_widens_what_the_readings_tell(several, monkeypatch):
    """D moves the time by 0.05 s a coded unit and the density by -20 kg/m3, together: b b'/3."""

    class Steel(Pouring):
        TIME = {**Pouring.TIME, "D": 0.05}
        DENSITY = {**Pouring.DENSITY, "D": -20.0}

    heaps, results = work_of(several, Steel(), monkeypatch)
    Chain(heaps, results).run(["screening", "climb", "surface", "optimum"])
    found = identified.surface_heaps(heaps.plan, results)
    assert [f.name for f in found.others] == ["A", "D", "E", "F"]
    moved = found.moved_by_others(["discharge_time_s", "fill_bulk_density_kg_m3"])
    assert moved == pytest.approx(np.outer([0.05, -20.0], [0.05, -20.0]) / 3, rel=0.25)
    wide = results.decision("optimum").joint
    assert wide.varied == ["A", "D", "E", "F"]
    heaps, results = work_of(several, Pouring(), monkeypatch)
    (several / "screening" / "decision.json").unlink()
    Chain(heaps, results).run(["screening", "climb", "surface", "optimum"])
    assert results.decision("optimum").joint.share_of_box < 0.8 * wide.share_of_box
    assert "with A, D, E and F anywhere in their ranges" in report.text_of(results)


def test_a_powder_of_which_some_is_known_is_calibrated_in_the_rest(several, monkeypatch):
    """A and D to F known: three factors, so that the surface has all of them."""
    known = "".join(f"{SYMBOLS[name]} = {0.15 if name in 'AD' else 0.7}\n" for name in "ADE")
    toml = f"[parameters]\n{known}{SYMBOLS['F']} = 0.29\n[effects]\nrolling_resistance = {{ rolling_friction = 0.0 }}\n"
    (several / "study.toml").write_text(toml)
    heaps, results = work_of(several, Pouring(), monkeypatch)
    chain = Chain(heaps, results)
    decided = chain.run(["screening", "climb", "surface", "optimum"])
    assert heaps.plan.fixed[SYMBOLS["F"]] == 0.29
    assert decided["screening"].factors == ["B", "C", "G"] and decided["optimum"].joint.varied == []
    assert "anywhere in" not in report.write(chain)
    assert set(pd.read_csv(several / "screening" / "effects.csv")["factor"]) == set("BCG")


def test_a_powder_is_calibrated_on_the_surface_of_another(several, tmp_path, monkeypatch, capsys):
    heaps, results = work_of(several, Pouring(), monkeypatch)
    Chain(heaps, results).run(["screening", "climb", "surface"])
    other = tmp_path / "other"
    other.mkdir()
    (other / "study.toml").write_text('title = "other"\n')
    readings = readings_at({"B": 0.8, "C": 0.34, "G": 0.21}).replace(",0.02,20", ",0.03,20").replace(",5,20", ",15,20")
    (other / "measurements.csv").write_text(readings)
    stub = Pouring()
    monkeypatch.setattr(heaps_module, "dispatch", stub)
    words = ["calibrate", str(other), "--surface", str(several)]
    assert main([*words, "--until", "optimum"]) == 0
    assert stub.asked == []
    found = read_decision(other, "optimum").joint
    for one in found.known:
        assert one.low <= {"B": 0.8, "C": 0.34, "G": 0.21}[one.factor] <= one.high
    assert "surface     (read from" in capsys.readouterr().out
    assert main(words) == 0
    assert read_decision(other, "validation").passed and len(stub.asked) < 250
    assert main([*words, "--repeats", "2"]) == 2 and main([*words, "--only", "climb"]) == 2
    assert main(["calibrate", str(several), "--surface", str(several)]) == 2
    assert main(["calibrate", str(other), "--surface", str(tmp_path / "none")]) == 2
    (other / "measurements.csv").write_text(readings_at(AT).replace("repose_angle_deg", "repose_flank_deg"))
    assert main(words) == 2
    assert "observable repose_angle_deg there, repose_flank_deg here" in capsys.readouterr().err


def test_the_corner_figure_has_a_panel_a_pair():
    random = np.random.default_rng(8)
    surfaces = simulated(random)
    first = posterior(block_of(surfaces, [0, 0, 0], random, names=NAMES[:1]))
    found = posterior(block_of(surfaces, [0, 0, 0], random))
    figure = corner(found, first, "angle", found.recommended)
    assert len([axes for axes in figure.axes if axes.get_visible()]) == 6
