"""An effect of one's own that jumps or moves in steps is refused, one that is continuous never is."""

import numpy as np
import pytest

from pellet_study.__main__ import main
from pellet_study.challenge import twins
from pellet_study.rigs import standard
from pellet_study.rigs.declared import Effect, Rig
from pellet_study.study.continuity import refuse_jumps
from pellet_study.study.scene_trials import refuse_jumps_in_scenes
from tests.helpers.make_study import folder, slip_angle_deg
from tests.test_bad_input import own_act

CONTINUOUS = {
    "a line": "shear + x",
    "a root": "shear + 10 * np.sqrt(x)",
    "a steep root": "shear + 300 * (x / 900) ** 0.1",
    "a logarithm": "shear + 300 * np.where(x > 0, 1 / np.log(np.e / np.maximum(x / 900, 1e-300)), 0.0)",
    "a power": "shear * (normal / 200) ** (-x / 2700)",
    "from a threshold on": "shear + np.maximum(x - 300, 0.0)",
    "up to saturation": "shear + np.minimum(x, 20)",
    "a flank a hundredth of a percent wide": "shear + 200 * (1 + np.tanh((x - 400) / 0.05))",
    "flat at first": "shear + 1e3 * (x / 900) ** 8",
    "waves": "shear * (1 + 0.1 * np.sin(x))",
    "a table": "shear + np.interp(x, [0, 200, 210, 900], [0, 1, 300, 301])",
    "two branches that meet": "np.where(normal < x, shear * (2 - normal / np.maximum(x, 1e-9)), shear)",
    "next to nothing": "shear * (1 + 1e-12 * x)",
}
JUMPS = {
    "on or off": ("shear + np.where(x > 0, 100.0, 0.0) + x", ["where it is absent, stress_pa = 0", "must go to nothing"]),
    "a sign": ("shear * (1 + 0.1 * np.sign(x))", ["where it is absent"]),
    "rounded up": ("shear + 200 * np.ceil(x / 200)", ["where it is absent"]),
    "a threshold": ("shear + x + np.where(x > 371, 200.0, 0.0)", ["jumps at stress_pa = 371", "take out the threshold"]),
    "a threshold of the load": ("np.where(normal < x, 1.2 * shear, shear)", ["jumps at stress_pa", "at once"]),
    "whole hundreds": ("shear + 100 * np.floor(x / 100)", ["jumps at stress_pa", "at once"]),
    "whole pascals": ("shear + np.floor(x)", ["suction.py: suction"]),
    "tenths of a pascal": ("shear + np.round(x, 1)", ["moves in steps", "stress_pa", "take out what rounds"]),
    "hundredths of a pascal": ("shear + np.round(x, 2)", ["moves in steps"]),
    "whole numbers": ("shear + 50 * (x / 50).astype(int)", ["jumps at stress_pa"]),
}  # fmt: skip


def study(path, act):
    """Wet beads with an effect of the study's own."""
    rows = [f"layer_on_incline,slip_angle_deg,{slip_angle_deg(h, 0.5, 60):.3f},0.5,{h}" for h in (8, 16, 32, 60)]
    folder(path, ["rig,observable,value,sd,layer_height_mm", *rows])
    (path / "effects").mkdir()
    text = own_act(act.replace("x", "values['stress_pa']") if "np" not in act else act)
    text = text.replace("    return ", "    x = values['stress_pa']\n    return ", 1)
    (path / "effects" / "suction.py").write_text(f"import numpy as np\n{text}")
    return path


@pytest.mark.parametrize("name", CONTINUOUS)
def test_what_is_continuous_is_not_refused(tmp_path, capsys, name):
    status = main(["compare", str(study(tmp_path / "s", CONTINUOUS[name]))])
    assert status == 0, capsys.readouterr().err


@pytest.mark.parametrize("name", JUMPS)
def test_what_jumps_or_moves_in_steps_is_refused(tmp_path, capsys, name):
    act, words = JUMPS[name]
    assert main(["compare", str(study(tmp_path / "s", act))]) == 2
    said = capsys.readouterr()
    assert said.out == "" and all(word in said.err for word in ["suction.py: suction", "slip_angle_deg", *words]), (
        said.err
    )


SEED = """
import math

EFFECT = {
    "name": "grip", "means": "m", "formula": "f", "sides": 1, "rigs": {"slope_slip": "holds to steeper angles"},
    "parameters": {"extra": {"absent": 0.0, "min": 0.0, "max": 1.0, "unit": "1", "meaning": "x"}},
    "signature": "s", "source": "this test",
}


def friction(mu, load_n, values):
    x = values["extra"]
    return ACT


SEED_SCENE = {"friction": friction}
"""


@pytest.mark.parametrize(
    "act, words",
    [
        ("mu + x", []),
        ("mu * (1 + x * (load_n / 1e-4) ** -0.3)", []),
        ("mu + math.sqrt(x)", []),
        ("mu + max(x - 0.2, 0.0)", []),
        ("mu + (0.3 if x > 0 else 0.0)", ["where it is absent, extra = 0", "friction of slope_slip"]),
        ("mu + (0.3 + x if x > 0.41 else x)", ["jumps at extra = 0.41"]),
        ("mu + round(x, 3)", ["grip.py: grip", "friction of slope_slip"]),
    ],
)
def test_an_effect_in_a_scene_on_yade_is_asked_too(tmp_path, capsys, act, words):
    rows = [f"slope_slip,slip_angle_deg,{31 + k},0.5,{m}" for k, m in enumerate((0, 5, 20))]
    path = folder(tmp_path / "s", ["rig,observable,value,sd,added_mass_mg", *rows])
    (path / "study.toml").write_text("[parameters]\nseed_powder_static_friction = { min = 0.3, max = 0.9 }\n")
    (path / "effects").mkdir()
    (path / "effects" / "grip.py").write_text(SEED.replace("ACT", act))
    assert main(["check", str(path)]) == (2 if words else 0)
    said = capsys.readouterr().err
    assert all(word in said for word in words), said


def test_the_packages_effects_in_scenes_pass():
    known = standard()
    rigs = [rig for rig in known.rigs.values() if rig.on_yade]
    tried = [effect for effect in known.effects.values() if "SEED_SCENE" in effect.scenes]
    for effect in tried:
        refuse_jumps_in_scenes(effect, [rig for rig in rigs if effect.name in known.acting(rig.name)])
    assert len(tried) >= 8


def conditions_of(rig: Rig, seed: int) -> dict:
    """Seven conditions anywhere in a rig's ranges."""
    draw = np.random.default_rng(seed)
    found: dict = {
        c: np.sort(draw.uniform(max(q["min"], 1e-3 * q["max"]), q["max"], 7)) for c, q in rig.conditions.items()
    }
    stresses = rig.normal_stress(found, 30.0) if rig.normal_stress else [1.0]
    return {**found, "median_normal_stress_pa": float(np.median(stresses))}


@pytest.mark.parametrize("catalogue", [standard(), twins.catalogue(True)], ids=["package", "twins"])
def test_the_packages_own_effects_pass(catalogue):
    tried = 0
    for rig in catalogue.rigs.values():
        for name in [] if rig.on_yade else catalogue.acting(rig.name):
            for seed in range(3):
                refuse_jumps(rig, catalogue.effects[name].within([rig.name]), conditions_of(rig, seed), {})
                tried += 1
    assert tried >= 18


@pytest.mark.parametrize("digits", [4, 6])
def test_what_a_rigs_solver_leaves_is_no_fault_of_the_effect(digits):
    """A fall with drag, integrated with steps whose number depends on everything: predictions are rough by 1e-digits."""

    def predict(parameters, conditions, effects):
        height = conditions["drop_height_mm"]
        drag = sum((act(0.0 * height, values) for act, values in effects.values()), 0.0 * height)
        rough = np.sin(1e9 * (parameters["restitution"] + height + 3 * drag)) if effects else 0.0
        fall = height * np.exp(-drag * height / 1000)
        return {
            "rebound_height_mm": parameters["restitution"] ** 2
            * fall
            * (1 + np.round(rough) * 10.0**-digits * (drag > 0))
        }

    number = {"default": 0.8, "min": 0.1, "max": 1.0}
    height = {"default": 300.0, "min": 10.0, "max": 3000.0}
    parameters = {"cd": {"absent": 0.0, "min": 0.0, "max": 0.3}}
    rig = Rig("ball", None, {"restitution": number}, {"drop_height_mm": height}, {"rebound_height_mm": "h"}, predict)
    act = {"ball": lambda drag, values: drag + values["cd"]}
    effect = Effect("drag", "", "", parameters, 1, {"ball": ""}, "", "", closed_form=act)
    refuse_jumps(rig, effect, {"drop_height_mm": np.array([100.0, 300.0, 900.0])}, {})


DROP = """
import numpy as np

RIG = {
    "name": "drop",
    "parameters": {"restitution": {"default": 0.8, "min": 0.1, "max": 1.0, "unit": "1", "meaning": "e"}},
    "conditions": {"drop_height_mm": {"default": 300.0, "min": 10.0, "max": 3000.0, "unit": "mm", "meaning": "h"}},
    "observables": {"rebound_mm": {"unit": "mm", "meaning": "rise"}},
}


def predict(parameters, conditions, effects):
    height = conditions["drop_height_mm"]
    v = parameters["restitution"] ** 2 * height
    for act, values in effects.values():
        v = act(v, height, values["x"])
    return {"rebound_mm": READING}
"""
LOSS = """
import numpy as np

EFFECT = {
    "name": "loss", "means": "m", "formula": "f", "sides": 1, "rigs": {"drop": "everywhere"},
    "parameters": {"x": {"absent": 0.0, "min": 0.0, "max": HIGH, "unit": "1", "meaning": "x"}},
    "signature": "s", "source": "this test",
}


def act(v, h, x):
    return ACT


CLOSED_FORM = {"drop": act}
"""


def dropped(path, act, reading="v", high=5.0):
    """Rebounds from three heights, with an effect on them; the rig reads them in its own way."""
    rows = [f"drop,rebound_mm,{0.64 * h},1,{h}" for h in (100, 300, 900)]
    folder(path, ["rig,observable,value,sd,drop_height_mm", *rows])
    (path / "study.toml").write_text("[parameters]\nrestitution = { value = 0.8, min = 0.5, max = 0.98 }\n")
    for place, text in (("rigs/drop.py", DROP.replace("READING", reading)), ("effects/loss.py", LOSS)):
        (path / place).parent.mkdir()
        (path / place).write_text(text.replace("ACT", act).replace("HIGH", str(high)))
    return path


@pytest.mark.parametrize("high", [0.5, 1.0, 3.0, 5.0, 20.0, 100.0])
@pytest.mark.parametrize("act", ["v + np.round(x, 1)", "v + np.where(x > 0, np.round(v + x * h / 1000, 1) - v, 0)"])
def test_steps_of_a_tenth_are_refused_however_many_there_are(tmp_path, capsys, act, high):
    assert main(["compare", str(dropped(tmp_path / "s", act, high=high))]) == 2
    assert "loss.py: loss" in capsys.readouterr().err


@pytest.mark.parametrize("reading", ["np.round(v, 4)", "np.round(v, 1)", "np.where(v < 60, 0.0, v)"])
@pytest.mark.parametrize("act", ["v - 1e-3 * x", "v - 0.1 * x", "v - 2 * x", "v * (1 - 1e-3 * x * h / 1000)"])
def test_a_rig_that_rounds_or_has_a_threshold_makes_no_continuous_effect_be_refused(tmp_path, capsys, act, reading):
    assert main(["compare", str(dropped(tmp_path / "s", act, reading))]) == 0, capsys.readouterr().err


@pytest.mark.parametrize(
    "act, reading",
    [
        ("v + np.round(x, 1)", "np.round(v, 2)"),
        ("v * np.where(x > 0, 1.03, 1.0)", "np.where(v < 60, 0.0, v)"),
        ("v + x + np.where(x > 2.2, 8.0, 0.0)", "np.where(v < 60, 0.0, v)"),
    ],
)
def test_a_rig_that_rounds_or_has_a_threshold_excuses_no_larger_jumps_of_an_effect(tmp_path, capsys, act, reading):
    assert main(["compare", str(dropped(tmp_path / "s", act, reading))]) == 2
    assert "loss.py: loss" in capsys.readouterr().err


@pytest.mark.parametrize("place, what", [("effects/loss.py", "effect"), ("rigs/drop.py", "rig")])
def test_two_files_that_declare_one_name_are_refused(tmp_path, capsys, place, what):
    path = dropped(tmp_path / "s", "v + x")
    copy = (path / place).with_name("other.py")
    copy.write_text((path / place).read_text())
    assert main(["compare", str(path)]) == 2
    said = capsys.readouterr().err
    assert f"other.py: declares the {what} '{(path / place).stem}', as" in said and str(path / place) in said
    copy.rename(f"{copy}.off")  # the advice, followed
    assert main(["compare", str(path)]) == 0


def test_an_effect_whose_rig_has_no_file_says_that_the_rig_is_missing(tmp_path, capsys):
    path = dropped(tmp_path / "s", "v + x")
    (path / "rigs" / "drop.py").unlink()
    assert main(["compare", str(path)]) == 2
    said = capsys.readouterr().err
    assert (
        "'drop', a rig that comes neither with the package nor with a file of rigs/" in said and "rigs/drop.py" in said
    )


def test_an_effect_that_changes_nothing_anywhere_is_refused_and_one_that_does_elsewhere_is_not(tmp_path, capsys):
    """A slip in the name of a place: no measurement could show it. One that acts above 500 Pa only is an effect."""
    assert main(["check", str(study(tmp_path / "idle", "shear + 0.0 * np.asarray(x)"))]) == 2
    said = capsys.readouterr().err
    assert "suction changes no reading of layer_on_incline" in said and "CLOSED_FORM" in said
    elsewhere = "shear + x * np.maximum(normal - 500.0, 0.0) / 500.0"
    assert main(["check", str(study(tmp_path / "elsewhere", elsewhere))]) == 0


def test_a_nan_that_an_effect_makes_is_told_of_the_effect(tmp_path, capsys):
    """The rig of the study's own is without fault: it is the effect's file that is named first."""
    made = tmp_path / "s"
    assert main(["init", str(made), "--rig", "cup"]) == 0
    file = made / "effects" / "cup_offset.py"
    file.write_text(file.read_text().replace('values["offset_mm"]', 'float("nan") * values["offset_mm"]'))
    capsys.readouterr()
    assert main(["check", str(made)]) == 2
    said = capsys.readouterr().err.splitlines()[-1]
    assert said.startswith(f"pellet-study: {file}: with cup_offset, and not without it") and "median_normal" not in said
