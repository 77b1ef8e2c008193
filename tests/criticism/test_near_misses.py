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


FALL = """
import numpy as np

RIG = {
    "name": "fall",
    "parameters": {"gravity_m_s2": {"default": 9.81, "min": 9.0, "max": 10.5, "unit": "m/s2", "meaning": "g"}},
    "conditions": {
        "drop_height_mm": {"default": 300.0, "min": 10.0, "max": 3000.0, "unit": "mm", "meaning": "h"},
        "diameter_mm": {"default": 2.0, "min": 0.2, "max": 10.0, "unit": "mm", "meaning": "d"},
    },
    "observables": {"impact_speed_m_s": {"unit": "m/s", "meaning": "v"}},
}


def predict(parameters, conditions, effects):
    h, d, g = 1e-3 * conditions["drop_height_mm"], 1e-3 * conditions["diameter_mm"], parameters["gravity_m_s2"]
    k = 1e-9 + 0.0 * h
    for act, values in effects.values():
        k = act(k, d, values)
    return {"impact_speed_m_s": np.sqrt(-np.expm1(-2 * k * h) * g / k)}
"""
CONSTANT = """
EFFECT = {
    "name": "constant_drag", "means": "air brakes the ball", "formula": "dv/dt = -3 rho Cd/(4 rho_s d) v^2", "sides": 1,
    "parameters": {"cd": {"absent": 0.0, "min": 0.0, "max": 20.0, "physical": (0.0, 10.0), "unit": "1", "meaning": "Cd"}},
    "rigs": {"fall": "high drops of small balls"}, "signature": "-", "source": "this test",
}


def act(k, d, values):
    return k + 0.75 * 1.2 * values["cd"] / (1250.0 * d)


CLOSED_FORM = {"fall": act}
"""


def test_drag_of_real_spheres_against_a_constant_coefficient(tmp_path, capsys):
    """Balls that fall by Schiller & Naumann's law, whose coefficient falls with size and speed; the candidate's is constant."""
    from scipy.integrate import solve_ivp

    def speed(height, diameter):
        def gain(_, square):
            v = math.sqrt(max(square[0], 1e-12))
            reynolds = 1.2 * v * diameter / 1.81e-5
            coefficient = 24 / reynolds * (1 + 0.15 * reynolds**0.687)
            return 2 * (9.81 - 0.75 * 1.2 * coefficient * v * v / (1250.0 * diameter))

        return math.sqrt(solve_ivp(gain, (0, height), [0.0], rtol=1e-8).y[0, -1])

    path = tmp_path / "s"
    for name, text in (("rigs/fall.py", FALL), ("effects/constant_drag.py", CONSTANT)):
        (path / name).parent.mkdir(parents=True, exist_ok=True)
        (path / name).write_text(text)
    rng, lines = np.random.default_rng(1), ["rig,observable,value,sd,n,drop_height_mm,diameter_mm"]
    for diameter in (0.5, 1.0, 2.0):
        for height in (100, 200, 400, 800):
            v = speed(1e-3 * height, 1e-3 * diameter)
            value = v + 0.02 * v / math.sqrt(5) * rng.standard_normal()
            lines.append(f"fall,impact_speed_m_s,{value:.5f},{0.02 * v:.5f},5,{height},{diameter}")
    (path / "measurements.csv").write_text("\n".join(lines) + "\n")
    (path / "study.toml").write_text("[parameters]\ngravity_m_s2 = { min = 9.5, max = 10.1 }\n")
    answer, said, untouched = refined(path, capsys)
    assert answer["verdict"] == "missing" and answer["diagnoses"][-1]["missing"] == ["constant_drag"] and untouched
    [drift] = answer["drifting"]
    (_, first), (_, last) = drift["amounts"]
    assert last < first and "would have to fall with" in said  # as the Reynolds number grows
