"""Nature's version of an effect by another law than the candidate's: named, with the drift of its amount; not added."""

import math

import numpy as np
import pytest

from tests.helpers.make_study import HEIGHTS_MM, command, folder


def layers(path, excess, sd=0.25, seed=2):
    """Slip angles of layers with tan a = 0.5 + excess(h), candidates cohesion alone."""
    rng = np.random.default_rng(seed)
    lines = ["rig,observable,value,sd,n,layer_height_mm"]
    for h in HEIGHTS_MM:
        value = math.degrees(math.atan(0.5 + excess(h))) + sd / math.sqrt(5) * rng.standard_normal()
        lines.append(f"layer_on_incline,slip_angle_deg,{value:.4f},{sd},5,{h:g}")
    made = folder(path, lines)
    file = made / "study.toml"
    file.write_text(f'candidates = ["cohesion"]\n{file.read_text()}')
    return made


def refined(path, capsys):
    before = (path / "study.toml").read_text()
    status, answer = command("refine", path, json_file=path.parent / "answer.json")
    assert status == 0
    return answer, " ".join(capsys.readouterr().out.split()), (path / "study.toml").read_text() == before


def test_cohesion_by_another_power_of_the_height_is_a_near_miss(tmp_path, capsys):
    """An excess that goes with h^-0.6: a cohesive stress, excess rho g h cos a, that would rise with h^0.4."""
    answer, said, untouched = refined(layers(tmp_path / "s", lambda h: 0.16 * (20 / h) ** 0.6), capsys)
    assert answer["verdict"] == "missing" and answer["diagnoses"][-1]["missing"] == ["cohesion"]
    assert answer["added"] == [] and untouched
    [drift] = answer["drifting"]
    assert (drift["effect"], drift["condition"]) == ("cohesion", "layer_height_mm")
    (low, first), (high, last) = drift["amounts"]
    assert (low, high) == (8, 60) and 1.2 < last / first < 60**0.4
    assert "would have to rise with layer_height_mm" in said and "ANSWER missing: cohesion" in said
    assert (
        answer["rivals"][0]["effects"] == ["cohesion"]
        and answer["rivals"][0]["rms_error"] < 0.5 * answer["steps"][0]["rms_error"]
    )


def test_the_candidates_own_law_is_no_near_miss(tmp_path, capsys):
    def cohesive(h):
        return math.tan(math.radians(_slip(h))) - 0.5

    answer, _, untouched = refined(layers(tmp_path / "s", cohesive), capsys)
    assert answer["added"] == ["cohesion"] and answer["drifting"] == [] and not untouched


def _slip(height):
    from tests.helpers.make_study import slip_angle_deg

    return slip_angle_deg(height, 0.5, 40.0)


@pytest.mark.parametrize("wave", [0.06, 0.12])
def test_an_effect_of_another_kind_is_none(tmp_path, capsys, wave):
    """An excess that comes and goes with the height."""
    answer, said, _ = refined(layers(tmp_path / "s", lambda h: wave * math.sin(3 * math.log(h))), capsys)
    assert answer["verdict"] == "unexplained" and answer["drifting"] == [] and answer["added"] == []
    assert "nearest: cohesion" in said
