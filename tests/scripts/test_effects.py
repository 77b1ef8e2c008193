"""Effects of the YADE bench rigs: declared once, absent is not there, continuous from zero, right against closed forms.

All cases run in one campaign; each test names the cases it needs, by what it compares.
"""

import shutil
import subprocess
import sys
from itertools import chain
from math import atan, cos, degrees, pi, radians, sin, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.spatial import ConvexHull

from pellet_study.errors import InputError
from pellet_study.rigs import catalogue, on_yade
from pellet_study.rigs.declarations import rig_in
from pellet_study.rigs.scripts import SCRIPTS, imported
from pellet_study.simulation import dispatch, yade
from tests import HELPERS
from yade_scripts import contacts, laws, particles
from yade_scripts.seed_scene import GRAVITY

pytestmark = pytest.mark.yade

BENCH = ("rebound", "slope_slip", "inclined_roll")
PAIRS = [(rig, effect) for rig in BENCH for effect in on_yade.rig(rig).effects]
GRADUAL = [pair for pair in PAIRS if pair[1] != "reading_offset" and pair != ("inclined_roll", "seed_shape")]
SIZES = (1.5, 3.0)  # mm
E0, MU = 0.5, 0.5
OBSERVABLE = {"rebound": "rebound_height_mm", "slope_slip": "slip_angle_deg", "inclined_roll": "roll_distance_mm"}
SHORT_RUN = {"slope_deg": 40.0, "release_distance_mm": 25.0}
FINE = {"time_step_fraction": 0.02}


def amount(effect: str, value: float) -> dict:
    """An effect at an amount."""
    return {effect: {catalogue.standard().effects[effect].amount: value}}


def seed_mass(length_mm: float) -> float:
    return particles.seed_mass_properties(length_mm, 1250.0)[0]


def sphere_mass(length_mm: float) -> float:
    return 1250.0 * pi / 6 * (1e-3 * length_mm) ** 3


def drop(length: float, height: float, effect: str, value: float):
    conditions = {"seed_length_mm": length, "drop_height_mm": height}
    parameters = {"seed_powder_restitution": E0}
    return "sphere_rebound", parameters, conditions, amount(effect, value), FINE


def slip(length: float, effect: str, value: float, friction: float = MU, load_mg: float = 0.0, hold_ms: float = 2.0):
    conditions = {"seed_length_mm": length, "added_mass_mg": load_mg}
    parameters = {"seed_powder_static_friction": friction}
    return "slope_slip", parameters, conditions, amount(effect, value), {"hold_ms": hold_ms}


def run_along(length: float, effect: str, value: float, friction: float, rolling: float = 0.0, **conditions):
    parameters = {"seed_powder_static_friction": friction, "seed_powder_rolling_friction": rolling}
    return "sphere_on_plate", parameters, {"seed_length_mm": length, **conditions}, amount(effect, value), {}


def thrown_aslant(length: float, compliance: float):
    parameters = {"seed_powder_restitution": 0.9, "seed_powder_static_friction": 1.5}
    conditions = {"seed_length_mm": length, "speed_m_s": 0.5, "impact_m_s": 1.0, "rolls": 0.0, "time_s": 1e-3}
    numerics = {"time_step_fraction": 0.02, "stiffness_scale": 1.0}
    return "sphere_on_plate", parameters, conditions, amount("tangential_compliance", compliance), numerics


def plain(rig: str, effects: dict, **conditions):
    """A seed with friction and rolling friction; a sphere in the roll, as a tumbling seed magnifies every cause."""
    parameters = {"seed_powder_static_friction": 0.6, "seed_powder_rolling_friction": 0.05}
    if rig == "inclined_roll":
        parameters["seed_powder_rolling_friction"] = 0.3
        return "sphere_roll", parameters, SHORT_RUN | conditions, effects, {"rest_speed_mm_s": 10.0}
    return rig, parameters, conditions, effects, {}


def barely(effect: str) -> float:
    """A hundred-thousandth of the largest physical amount beyond the value that means absent."""
    quantity = catalogue.standard().effects[effect].parameters[catalogue.standard().effects[effect].amount]
    return quantity["absent"] + 1e-5 * (quantity["physical"][1] - quantity["absent"])


DROPS = [
    (length, height, effect, value)
    for length in SIZES
    for height in (50.0, 400.0)
    for effect, value in (
        ("viscoelastic_restitution", 0.1),
        ("viscoelastic_restitution", 0.4),
        ("plastic_restitution", 1.0),
        ("plastic_restitution", 8.0),
        ("air_drag", 1.0),
        ("air_drag", 5.0),
    )
]
ADHESIVE = [(1.5, 1e-4), (1.5, 5e-4), (3.0, 5e-4)]
LOADED = [(3.0, 0.1, 0.0), (3.0, 0.33, 20.0), (1.5, 0.33, 0.0)]
TILTED = [(1.5, -3.0), (3.0, 2.0)]
STOUT = [(length, factor) for length in SIZES for factor in (0.75, 1.25)]
ROLLING = [(length, rolling, k) for length in SIZES for rolling, k in ((0.0, 0.3), (0.05, 1.0))]
COMPLIANT = [(length, compliance) for length in SIZES for compliance in (1.0, 30.0)]


@pytest.fixture(scope="module")
def read(tmp_path_factory):
    """Reading of a case, looked up in the campaign."""
    rolls = {"speed_m_s": 0.8, "time_s": 0.15}
    slides = {"speed_m_s": 1.0, "time_s": 0.04, "rolls": 0.0}
    wanted = list(
        chain(
            (drop(*d) for d in DROPS),
            (slip(length, "adhesion", energy) for length, energy in ADHESIVE),
            (slip(length, "load_dependent_friction", n, load_mg=load) for length, n, load in LOADED),
            (slip(length, "seed_shape", f, friction=1.4, hold_ms=12.0) for length, f in STOUT),
            (slip(length, "plate_tilt", tilt) for length, tilt in TILTED),
            (run_along(length, "speed_dependent_rolling", k, 0.6, mu, **rolls) for length, mu, k in ROLLING),
            (run_along(length, "adhesion", 1e-3, 0.6, 0.1, **rolls) for length in SIZES),
            (run_along(length, "air_drag", 3.0, 0.6, speed_m_s=2.0, time_s=0.15) for length in SIZES),
            (run_along(length, "load_dependent_friction", 0.33, 0.3, **slides) for length in SIZES),
            (thrown_aslant(length, c) for length, c in COMPLIANT),
            (plain(rig, {}) for rig in BENCH),
            (plain(rig, amount("reading_offset", 1.5)) for rig in BENCH),
            (plain(rig, amount(effect, barely(effect))) for rig, effect in GRADUAL),
            [
                plain("rebound", amount("reading_offset", 1.5), plate_tilt_deg=5.0),
                plain("rebound", amount("plate_tilt", 5.0)),
                plain("rebound", {}, plate_tilt_deg=5.0),
                plain("inclined_roll", amount("plate_tilt", 2.0)),
                plain("inclined_roll", {}, slope_deg=42.0),
            ],
        )
    )
    known = {file.stem: rig_in(file) for file in (HELPERS / "effect_rigs").glob("*.py")}
    cases = [
        on_yade.case(
            known.get(rig, rig), parameters=parameters, conditions=conditions, effects=effects, numerics=numerics
        )
        for rig, parameters, conditions, effects, numerics in wanted
    ]
    rows = dispatch.run(cases, tmp_path_factory.mktemp("effects") / ".store", rigs=known, workers=1, quiet=True)
    assert set(rows["status"]) == {"ok"}, rows.loc[rows["status"] != "ok", ["rig", "status"]].to_string()
    found = {repr(case): row for case, (_, row) in zip(wanted, rows.iterrows(), strict=True)}
    return lambda case: found[repr(case)]


def test_every_effect_is_declared_once_and_by_the_rigs_it_names():
    effects = catalogue.standard().effects
    for name in {effect for _, effect in PAIRS}:
        assert {rig for rig, effect in PAIRS if effect == name} == set(effects[name].rigs) & set(BENCH)
        assert effects[name].source and effects[name].formula and effects[name].signature
        for rig in effects[name].rigs:
            assert on_yade.rig(rig).effects[name] is not None
            assert on_yade.case(rig)["effects"][name] == effects[name].neutral()
            assert name in catalogue.standard().acting(rig)
    assert len({effect for _, effect in PAIRS}) == 10


def test_an_effect_of_the_package_is_one_file(tmp_path):
    """A copy of yade_scripts with one more file in effects/: its rig knows it, by what the file says."""
    shutil.copytree(SCRIPTS, tmp_path / "yade_scripts", ignore=shutil.ignore_patterns("__pycache__"))
    effects = tmp_path / "yade_scripts" / "effects"
    text = (effects / "plate_tilt.py").read_text().replace('"plate_tilt"', '"bent_plate"')
    (effects / "bent_plate.py").write_text(text)
    question = "from yade_scripts import slope_slip as rig; print(*rig.RIG['effects'])"
    found = subprocess.run(
        [sys.executable, "-c", question], cwd=tmp_path, capture_output=True, text=True, check=True
    ).stdout.split()
    assert set(found) == {*on_yade.rig("slope_slip").effects, "bent_plate"}


def test_an_effect_is_refused_by_a_rig_it_does_not_touch():
    with pytest.raises(InputError, match="slope_slip has no effect 'air_drag'"):
        on_yade.case("slope_slip", effects=amount("air_drag", 1.0))


@pytest.mark.parametrize("name", BENCH)
def test_the_fingerprint_of_a_rig_covers_its_effects(name):
    files = {file.name for file in imported(on_yade.rig(name).script.read_bytes())}
    assert {f"{effect}.py" for effect in on_yade.rig(name).effects} | {"acting.py"} <= files


@pytest.mark.skipif(yade.version() != "2023.02a", reason="the values are those of YADE 2023.02a")
def test_absent_effects_leave_the_answers_as_they_were_without_effects(read):
    """Values of the rigs before they knew any effect."""
    assert read(plain("rebound", {}))["rebound_height_mm"] == pytest.approx(3.090639480302488, rel=1e-9)
    assert read(plain("slope_slip", {}))["slip_angle_deg"] == 30.986328125


@pytest.mark.parametrize(("rig", "effect"), GRADUAL)
def test_an_effect_begins_continuously_from_absent(rig, effect, read):
    without = read(plain(rig, {}))[OBSERVABLE[rig]]
    with_it = read(plain(rig, amount(effect, barely(effect))))[OBSERVABLE[rig]]
    assert with_it == pytest.approx(without, rel=1e-3)


def test_the_shape_begins_continuously_from_the_measured_one():
    measured, nearly = particles.alfalfa_seed(2.2), particles.alfalfa_seed(2.2, 1 + 1e-9)
    assert np.allclose(measured[0], nearly[0], rtol=1e-8) and np.allclose(measured[1], nearly[1], rtol=1e-8)
    assert np.allclose(
        particles.seed_mass_properties(2.2, 1250.0)[1],
        particles.seed_mass_properties(2.2, 1250.0, 1 + 1e-9)[1],
        rtol=1e-6,
    )


@pytest.mark.parametrize("rig", BENCH)
def test_the_reading_offset_is_added(rig, read):
    shift = read(plain(rig, amount("reading_offset", 1.5)))[OBSERVABLE[rig]] - read(plain(rig, {}))[OBSERVABLE[rig]]
    assert shift == pytest.approx(1.5, abs=1e-9)


def test_the_reading_offset_moves_no_ratio_of_speeds(read):
    tilted = {"plate_tilt_deg": 5.0}
    shifted, plainly = (
        read(plain("rebound", amount("reading_offset", 1.5), **tilted)),
        read(plain("rebound", {}, **tilted)),
    )
    assert shifted["rebound_height_mm"] == pytest.approx(plainly["rebound_height_mm"] + 1.5, abs=1e-9)
    assert shifted["tangential_restitution"] == plainly["tangential_restitution"] > 0


@pytest.mark.parametrize(("length", "tilt"), TILTED)
def test_a_tilted_plate_shifts_the_slip_angle_by_its_tilt(length, tilt, read):
    found = read(slip(length, "plate_tilt", tilt))["slip_angle_deg"]
    assert found == pytest.approx(degrees(atan(MU)) - tilt, abs=0.06)


def test_a_tilted_plate_is_the_same_as_its_condition(read):
    for effect, condition in (
        (plain("rebound", amount("plate_tilt", 5.0)), plain("rebound", {}, plate_tilt_deg=5.0)),
        (plain("inclined_roll", amount("plate_tilt", 2.0)), plain("inclined_roll", {}, slope_deg=42.0)),
    ):
        observable = "rebound_height_mm" if effect[0] == "rebound" else "roll_distance_mm"
        assert read(effect)[observable] == read(condition)[observable]


def sphere_drag(length: float, speed: float, factor: float) -> float:
    """Deceleration (m/s2) of a sphere in air by Schiller & Naumann's coefficient, 0.44 from Re = 1000 on."""
    reynolds = 1.2 * speed * 1e-3 * length / 1.81e-5
    coefficient = 24 / max(reynolds, 1e-9) * (1 + 0.15 * reynolds**0.687) if reynolds < 1000 else 0.44
    return factor * 0.75 * 1.2 * coefficient * speed**2 / (1250.0 * 1e-3 * length)


def fallen(length: float, height: float, factor: float) -> float:
    """Speed squared (m2/s2) after a fall through a height (m)."""
    falling = lambda _, square: 2 * (GRAVITY - sphere_drag(length, sqrt(max(square[0], 0.0)), factor))  # noqa: E731
    return float(solve_ivp(falling, (0, height), [0.0], rtol=1e-8).y[0, -1])


def risen(length: float, square: float, factor: float) -> float:
    """Height (m) to which a sphere rises."""
    up = lambda s, _: 1 / (2 * (GRAVITY + sphere_drag(length, sqrt(square - s), factor)))  # noqa: E731
    return float(solve_ivp(up, (0, square), [0.0], rtol=1e-8).y[0, -1])


def restitution(effect: str, value: float, speed: float) -> float:
    """Restitution of the two laws, as published."""
    if effect == "viscoelastic_restitution":
        loss = value * speed**0.2
        return E0 * (1 - loss + 0.6 * loss**2)
    y = 1 / (value * speed)
    if effect == "air_drag" or y >= 1:
        return E0
    return E0 * sqrt(6 * sqrt(3) / 5) * sqrt(1 - y**2 / 6) * (y / (y + 2 * sqrt(6 / 5 - y**2 / 5))) ** 0.25


@pytest.mark.parametrize(("length", "height", "effect", "value"), DROPS)
def test_a_sphere_rebounds_by_the_law_of_restitution_and_of_drag(length, height, effect, value, read):
    """Height v^2/(2 g) of a sphere; 2.2 % of it, as the time step leaves 1 % of the restitution open."""
    factor = value if effect == "air_drag" else 0.0
    square = fallen(length, 1e-3 * height, factor)
    expected = 1e3 * risen(length, restitution(effect, value, sqrt(square)) ** 2 * square, factor)
    assert read(drop(length, height, effect, value))["rebound_height_mm"] == pytest.approx(expected, rel=0.022)


@pytest.mark.parametrize(("length", "energy"), ADHESIVE)
def test_an_adhesive_seed_slips_by_the_two_term_law(length, energy, read):
    """sin a = mu (cos a + F/W) with the JKR pull-off F of the six spheres a flat seed touches with."""
    weight = seed_mass(length) * GRAVITY
    _, radii = particles.alfalfa_seed(length)
    pull = sum(contacts.pull_off_force(energy, radius) for radius in radii)
    expected = degrees(brentq(lambda a: sin(a) - MU * (cos(a) + pull / weight), 0, pi / 2))
    assert expected > degrees(atan(MU)) + 0.8
    assert read(slip(length, "adhesion", energy))["slip_angle_deg"] == pytest.approx(expected, abs=0.06)


@pytest.mark.parametrize(("length", "exponent", "load_mg"), LOADED)
def test_friction_falls_as_a_power_of_the_load(length, exponent, load_mg, read):
    weight = (seed_mass(length) + 1e-6 * load_mg) * GRAVITY
    expected = degrees(brentq(lambda a: sin(a) / cos(a) - MU * (weight * cos(a) / 2e-5) ** -exponent, 0, 1.5))
    found = read(slip(length, "load_dependent_friction", exponent, load_mg=load_mg))["slip_angle_deg"]
    assert found == pytest.approx(expected, abs=0.06)


@pytest.mark.parametrize("length", SIZES)
def test_a_sphere_slides_with_the_friction_of_its_load(length, read):
    friction = 0.3 * (sphere_mass(length) * GRAVITY / 2e-5) ** -0.33
    case = run_along(length, "load_dependent_friction", 0.33, 0.3, speed_m_s=1.0, time_s=0.04, rolls=0.0)
    assert read(case)["speed_after_m_s"] == pytest.approx(1 - friction * GRAVITY * 0.04, rel=1e-3)


@pytest.mark.parametrize(("length", "factor"), STOUT)
def test_a_stout_seed_tips_over_where_its_weight_leaves_its_base(length, factor, read):
    yaw = radians(10.0) * (2 * particles.even_points(0)[0] - 1)
    centres, radii = particles.alfalfa_seed(length, factor)
    downhill = np.array([cos(yaw), -sin(yaw)])
    sides = ConvexHull(centres[:, :2]).equations
    reach = min(-side[2] / (side[:2] @ downhill) for side in sides if side[:2] @ downhill > 1e-9)
    expected = degrees(atan(reach / radii[0]))
    found = read(slip(length, "seed_shape", factor, friction=1.4, hold_ms=12.0))["slip_angle_deg"]
    assert found == pytest.approx(min(expected, degrees(atan(1.4))), abs=0.15)


@pytest.mark.parametrize("length", SIZES)
@pytest.mark.parametrize("factor", [0.75, 1.25])
def test_the_shape_keeps_the_length_and_changes_the_width(length, factor):
    centres, radii = particles.alfalfa_seed(length, factor)
    size = (centres + radii[:, None]).max(axis=0) - (centres - radii[:, None]).min(axis=0)
    assert size[0] == pytest.approx(1e-3 * length)
    assert size[0] / size[1] == pytest.approx(factor * 2.2 / 1.3)
    assert size[1] / size[2] == pytest.approx(1.3)


@pytest.mark.parametrize(("length", "rolling", "k"), ROLLING)
def test_a_rolling_sphere_slows_by_the_friction_of_its_speed(length, rolling, k, read):
    """dv/dt = -g (mu_r + k v)/(1 + I/(m R^2))."""
    expected = solve_ivp(lambda _, v: -GRAVITY / 1.4 * (rolling + k * v), (0, 0.15), [0.8], rtol=1e-9).y[0, -1]
    case = run_along(length, "speed_dependent_rolling", k, 0.6, rolling, speed_m_s=0.8, time_s=0.15)
    assert read(case)["speed_after_m_s"] == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("length", SIZES)
def test_an_adhesive_sphere_rolls_against_load_and_pull(length, read):
    """dv/dt = -mu_r (g + F/m)/(1 + I/(m R^2))."""
    pull = contacts.pull_off_force(1e-3, 5e-4 * length)
    row = read(run_along(length, "adhesion", 1e-3, 0.6, 0.1, speed_m_s=0.8, time_s=0.15))
    expected = 0.1 * (GRAVITY + pull / sphere_mass(length)) / 1.4 * row["time_run_s"]
    assert pull / sphere_mass(length) > 0.04 * GRAVITY
    assert 0.8 - row["speed_after_m_s"] == pytest.approx(expected, rel=3e-3)


@pytest.mark.parametrize("length", SIZES)
def test_a_rolling_sphere_slows_by_drag(length, read):
    """dv/dt = -(drag/m)/(1 + I/(m R^2)), by the law of a sphere three times over."""
    slows = lambda _, v: -sphere_drag(length, v[0], 3.0) / 1.4  # noqa: E731
    case = run_along(length, "air_drag", 3.0, 0.6, speed_m_s=2.0, time_s=0.15)
    expected = solve_ivp(slows, (0, 0.15), [2.0], rtol=1e-8).y[0, -1]
    assert read(case)["speed_after_m_s"] == pytest.approx(expected, rel=1e-3)


def aslant(length: float, compliance: float, kno: float, kso: float) -> float:
    """Speed along the plate (m/s) after an oblique impact of a sphere, by its equations of motion."""
    mass, radius, friction, step = sphere_mass(length), 5e-4 * length, 1.5, 2e-8
    normal, along = contacts.damping_ratio(0.9), contacts.tangential_damping_ratio(0.9)
    overlap, approach, speed, spin, shear = 0.0, 1.0, 0.5, 0.0, 0.0
    while overlap >= 0:
        root = sqrt(max(overlap, 1e-15))
        tangential = kso / (1 + compliance) * root
        push = max(0.0, kno * overlap * root + 2 * normal * sqrt(mass * 1.5 * kno * root) * approach)
        slip_speed = speed - spin * radius
        shear += tangential * slip_speed * step
        damper = 2 * along * sqrt(mass * tangential) * slip_speed
        if abs(shear) > friction * push:
            shear, damper = np.copysign(friction * push, shear), 0.0
        approach -= push / mass * step
        overlap += approach * step
        speed -= (shear + damper) / mass * step
        spin += (shear + damper) / (0.4 * mass * radius) * step
    return float(speed)


@pytest.mark.parametrize(("length", "compliance"), COMPLIANT)
def test_a_compliant_contact_changes_an_oblique_impact_as_computed(length, compliance, read):
    row = read(thrown_aslant(length, compliance))
    expected = aslant(length, compliance, row["kno"], row["kso"])
    assert row["speed_after_m_s"] == pytest.approx(expected, rel=0.025)
    assert abs(expected - aslant(length, 0.0, row["kno"], row["kso"])) > 0.003


def test_a_law_without_restitution_says_so(tmp_path):
    case = on_yade.case("rebound", contact_law=laws.LOCAL_DAMPING, effects=amount("plastic_restitution", 1.0))
    row = dispatch.run([case], tmp_path / ".store", workers=1, quiet=True).iloc[0]
    assert "no restitution" in row["status"]
