"""When readings were taken: a drift of the instrument with time is tested, told from an effect, or said to be one with it."""

import numpy as np
import pytest

from tests.helpers.make_study import HEIGHTS_MM, command, folder, slip_angle_deg

IN_TURN = np.arange(1, 19)  # the thinnest layers first, three readings each
AT_RANDOM = np.random.default_rng(5).permutation(IN_TURN)
PER_READING = -0.3  # deg, of a drift


def study(path, order, drift: float, cohesion: float = 0.0, column: bool = True, candidates: str = ""):
    rng = np.random.default_rng(3)
    lines = ["rig,observable,value,layer_height_mm" + (",order" if column else "")]
    for k, height in enumerate(np.repeat(HEIGHTS_MM, 3)):
        value = slip_angle_deg(height, 0.6, cohesion) + drift * order[k] + 0.3 * rng.standard_normal()
        lines.append(f"layer_on_incline,slip_angle_deg,{value:.3f},{height:g}" + (f",{order[k]}" if column else ""))
    made = folder(path, lines)
    if candidates:
        file = made / "study.toml"
        file.write_text(f"candidates = {candidates}\n{file.read_text()}")
    return made


def refined(path, capsys):
    status, answer = command("refine", path, json_file=path.parent / "answer.json")
    assert status == 0
    return answer, " ".join(capsys.readouterr().out.split())


def test_a_drift_in_the_order_of_the_heights_is_not_taken_for_an_effect(tmp_path, capsys):
    """-0.3 deg a reading over heights in a geometric row is all but a power of the stress."""
    answer, said = refined(study(tmp_path / "s", IN_TURN, PER_READING), capsys)
    assert answer["verdict"] == "tied" and answer["added"] == [] and "stress_dependent_friction" in answer["tied"]
    [drift] = answer["by_time"]
    assert drift["along"] == ["layer_height_mm"]
    assert "a drift of slip_angle_deg with time each explain it" in said and "randomise the order" in said
    assert "so that nothing tells time from it" in said


def test_a_drift_in_random_order_is_seen_as_one(tmp_path, capsys):
    answer, said = refined(study(tmp_path / "s", AT_RANDOM, PER_READING), capsys)
    assert answer["verdict"] == "unexplained" and answer["added"] == []
    [drift] = answer["steps"][0]["time_drift"]
    assert drift["p"] < 0.001 and drift["along"] == []
    assert drift["change"] == pytest.approx(17 * PER_READING, abs=3 * drift["error"]) and drift["error"] < 0.8
    assert "slip_angle_deg (layer_on_incline) falls with the order of its readings" in said
    assert [one["observable"] for one in answer["by_time"]] == ["slip_angle_deg"]


def test_readings_that_do_not_drift_are_not_said_to(tmp_path, capsys):
    answer, said = refined(study(tmp_path / "s", AT_RANDOM, 0.0, cohesion=40.0), capsys)
    assert answer["added"] == ["cohesion"] and answer["verdict"] == "adequate"
    assert answer["steps"][-1]["time_drift"][0]["p"] > 0.05 and answer["by_time"] == []
    assert "randomise" not in said


def test_chance_finds_a_drift_as_often_as_it_may(tmp_path):
    """Two hundred sets without a drift: p below .05 in about ten of them."""
    from dataclasses import replace

    from pellet_study.criticism.compare import compare
    from pellet_study.study.load import load

    rows, found = load(study(tmp_path / "s", AT_RANDOM, 0.0)), []
    rng = np.random.default_rng(8)
    for _ in range(200):
        noisy = [
            replace(r, value=slip_angle_deg(r.conditions["layer_height_mm"], 0.6, 0.0) + 0.3 * rng.standard_normal())
            for r in rows.rows
        ]
        found.append(compare(replace(rows, rows=tuple(noisy))).time_drifts[0].p)
    assert 2 <= sum(p < 0.05 for p in found) <= 19


@pytest.mark.parametrize("name", ["diagnose", "refine"])
def test_without_an_order_the_answer_says_to_randomise_it(tmp_path, capsys, name):
    assert command(name, study(tmp_path / "s", AT_RANDOM, 0.0, cohesion=40.0, column=False))[0] == 0
    assert "no row has an `order`" in " ".join(capsys.readouterr().out.split())


def test_residuals_are_drawn_against_the_order(tmp_path):
    import pellet_study as ps

    figure = ps.draw(ps.compare(ps.load_study(study(tmp_path / "s", AT_RANDOM, PER_READING))), "residuals")
    labels = [axes.get_xlabel() for axes in figure.axes]
    assert "order of the reading (-)" in labels
    places = figure.axes[labels.index("order of the reading (-)")].collections[-1].get_offsets()
    assert sorted(places[:, 0]) == sorted(map(float, AT_RANDOM))


def test_the_report_says_it_too(tmp_path):
    path = study(tmp_path / "s", IN_TURN, PER_READING)
    assert command("refine", path)[0] == 0 and command("report", path)[0] == 0
    page = (path / "report.html").read_text()
    assert "A drift of slip_angle_deg (layer_on_incline) with time explains it as well" in page


STRESSES_PA = (500.0, 1000.0, 2000.0, 4000.0) * 2
DRIFTING = (1, 5, 3, 8, 2, 7, 4, 6)
PER_TURN_PA = 40.0


def sheared(path, lines=()):
    """Shear stresses 0.5 s + 40 Pa a turn, sd 5 Pa, and lines of another rig."""
    header = "rig,observable,value,normal_stress_pa,layer_height_mm,sd,order"
    cells = [
        f"shear_cell,shear_stress_pa,{0.5 * s + PER_TURN_PA * k},{s},,5,{k}"
        for s, k in zip(STRESSES_PA, DRIFTING, strict=True)
    ]
    return folder(path, [header, *cells, *lines])


def test_a_drift_is_seen_beside_a_rig_without_sd(tmp_path):
    """Whose scatter nothing tells; that of the rig that drifts is stated."""
    unknown = [f"layer_on_incline,slip_angle_deg,{slip_angle_deg(h, 0.5, 0):.3f},,{h:g},," for h in HEIGHTS_MM]
    for lines in ([], unknown):
        status, answer = command(
            "compare", sheared(tmp_path / f"{len(lines)}", lines), json_file=tmp_path / "answer.json"
        )
        assert status == 0
        [drift] = answer["time_drift"]
        assert drift["p"] < 0.01


def test_replicates_of_one_rig_say_nothing_of_the_sd_of_another(tmp_path):
    """Six hundred right replicates on the incline, and stresses as they should be."""
    rng = np.random.default_rng(8)
    header = "rig,observable,value,normal_stress_pa,layer_height_mm,sd"
    cells = [f"shear_cell,shear_stress_pa,{0.5 * s + 5 * rng.standard_normal():.2f},{s},,5" for s in STRESSES_PA]
    incline = [
        f"layer_on_incline,slip_angle_deg,{slip_angle_deg(h, 0.5, 0) + 0.5 * rng.standard_normal():.3f},,{h:g},0.5"
        for h in (8, 20, 50)
        for _ in range(200)
    ]
    made = folder(tmp_path / "s", [header, *cells, *incline])
    status, answer = command("compare", made, json_file=tmp_path / "answer.json")
    assert status == 0 and not any("shear_cell" in said for said in answer["warnings"])


@pytest.mark.parametrize("sd", (0.3, 2.0))
def test_one_repeat_that_is_off_is_no_drift_whatever_sd_was_stated(tmp_path, sd):
    """A stated sd that the only repeat contradicts is used for nothing, the test of a drift included."""
    heights = np.geomspace(8, 60, 18)
    order = np.random.default_rng(1).permutation(18) + 1
    values = [
        slip_angle_deg(h, 0.6, 0.0) + 0.3 * e
        for h, e in zip(heights, np.random.default_rng(2).normal(size=18), strict=True)
    ]
    early = int(np.argmin(order))
    taken = [*zip(heights, values, order, strict=True), (heights[early], values[early] + 3.0, 19)]
    lines = ["rig,observable,value,sd,layer_height_mm,order"]
    lines += [f"layer_on_incline,slip_angle_deg,{value:.2f},{sd},{h:.4f},{k}" for h, value, k in taken]
    status, answer = command("compare", folder(tmp_path / "s", lines), json_file=tmp_path / "answer.json")
    [drift] = answer["time_drift"]
    assert status == 0 and drift["p"] > 0.1 and abs(drift["z"]) < 2
