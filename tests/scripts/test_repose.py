"""The repose rig: each parameter moves its own contact constant, runs repeat, verdicts are told, effects act."""

from itertools import product
from math import pi

import numpy as np
import pytest

from pellet_study.powder.plan import SYMBOLS
from pellet_study.rigs import on_yade
from pellet_study.rigs.declarations import rig_in
from pellet_study.simulation import dispatch
from tests import HELPERS
from yade_scripts import contacts, laws, powder_scene

pytestmark = pytest.mark.yade

LAWS = tuple(laws.LAWS)
OWN = {  # the constant each parameter moves
    "powder_restitution": "powder_damping",
    "powder_static_friction": "powder_friction",
    "powder_rolling_friction": "powder_rolling",
    "powder_steel_restitution": "steel_damping",
    "powder_steel_static_friction": "steel_friction",
    "powder_steel_rolling_friction": "steel_rolling",
    "powder_surface_energy": "powder_adhesion",
}
BASE = {
    "powder_restitution": 0.2,
    "powder_static_friction": 0.8,
    "powder_rolling_friction": 0.25,
    "powder_steel_restitution": 0.3,
    "powder_steel_static_friction": 0.7,
    "powder_steel_rolling_friction": 0.35,
    "powder_surface_energy": 0.2,
}
ENERGY = 1.5 * pi  # pull-off over surface energy and effective radius
EFFECTS = {  # an amount, the conditions, and what the contact constants become
    "cohesion": ({"surface_energy_j_m2": 0.3}, {}, {"powder_adhesion": ENERGY * 0.5}),
    "rolling_resistance": ({"rolling_friction": 0.2}, {}, {"powder_rolling": 0.45, "steel_rolling": 0.55}),
    "liquid_bridges": ({"surface_tension_n_m": 0.06}, {}, {"powder_adhesion": ENERGY * 0.2 + 2 * pi * 0.06}),
    "wall_friction": ({"added_friction": -0.4}, {}, {"steel_friction": 0.3}),
    "amplification_size": ({"exponent_error": 2.0}, {"amplification": 7.0}, {"powder_adhesion": ENERGY * 0.2}),
}
SMALL = {"protocol": "funnel", "powder_mass_g": 3.0, "outlet_height_mm": 30.0, "outlet_diameter_mm": 20.0}
FUNNEL = {"funnel_diameter_mm": 26.0}


def small(rig="repose", law="cohesive_frictional", seed=1, effects=None, conditions=None, numerics=None, **parameters):
    """A heap of some 180 grains."""
    return on_yade.case(
        rig,
        contact_law=law,
        seed=seed,
        parameters=BASE | parameters,
        conditions=SMALL | (conditions or {}),
        effects=effects,
        numerics=FUNNEL | (numerics or {}),
    )


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    return tmp_path_factory.mktemp("repose") / ".store"


def run(store, cases, rigs=None):
    return dispatch.run(cases, store, rigs=rigs, workers=1, quiet=True)


@pytest.fixture(scope="module")
def constants(store):
    """The contact constants of each law at BASE, Hertz-Mindlin without surface energy, and with one parameter moved at a time."""
    contacts = rig_in(HELPERS / "powder_rigs" / "powder_contacts.py")
    equal = {"size_spread": 0.0}
    own = {law: {"powder_surface_energy": 0.0} if law == laws.HERTZ_MINDLIN else {} for law in LAWS}
    cases = {(law, None): small(contacts, law, numerics=equal, **own[law]) for law in LAWS}
    cases |= {
        (law, name): small(contacts, law, numerics=equal, **own[law] | {name: BASE[name] + 0.1})
        for law, name in product(LAWS, OWN)
        if law != laws.HERTZ_MINDLIN or name != "powder_surface_energy"
    }
    cases |= {
        ("cohesive_frictional", effect): small(contacts, numerics=equal, conditions=amplified, effects={effect: values})
        for effect, (values, amplified, _) in EFFECTS.items()
    }
    rows = run(store, list(cases.values()), {contacts.name: contacts})
    assert set(rows["status"]) == {"ok"}, rows[["contact_law", "status"]].to_string()
    return {
        key: row[list(set(OWN.values()) | {"steel_adhesion"})]
        for key, (_, row) in zip(cases, rows.iterrows(), strict=True)
    }


@pytest.mark.parametrize(
    ("law", "name"), [each for each in product(LAWS, OWN) if each != (laws.HERTZ_MINDLIN, "powder_surface_energy")]
)
def test_each_parameter_moves_its_own_contact_constant_and_no_other(constants, law, name):
    change = (constants[law, name] - constants[law, None]).astype(float).abs()
    moved = set(change.index[change > 1e-9])
    idle = law == laws.LOCAL_DAMPING and name == "powder_restitution"
    assert moved == (set() if idle else {OWN[name]})


@pytest.mark.parametrize("law", LAWS)
def test_contact_constants_have_the_values_asked_for(constants, law):
    found = constants[law, None]
    assert found["powder_friction"] == pytest.approx(0.8)
    assert found["steel_friction"] == pytest.approx(0.7)
    assert found["powder_rolling"] == pytest.approx(0.25)
    assert found["steel_rolling"] == pytest.approx(0.35)  # above the powder's: not clipped by it
    energy = 0.0 if law == laws.HERTZ_MINDLIN else 0.2
    assert found["powder_adhesion"] == pytest.approx(1.5 * pi * energy, abs=1e-9)
    assert found["steel_damping"] == pytest.approx(contacts.damping_ratio(0.3))
    if law == "hertz_mindlin":
        assert found["powder_damping"] == pytest.approx(contacts.damping_ratio(0.2))


@pytest.mark.parametrize("effect", EFFECTS)
def test_an_effect_acts_on_its_contact_constants_and_on_no_other(constants, effect):
    found, plain = constants["cohesive_frictional", effect], constants["cohesive_frictional", None]
    for name, value in {**plain, **EFFECTS[effect][2]}.items():
        assert found[name] == pytest.approx(value, abs=1e-9), name


@pytest.mark.parametrize("law", LAWS)
def test_air_slows_every_grain_by_the_law_of_a_sphere(store, law):
    """Schiller & Naumann at 1 m/s for grains of one size, twice over; none without the effect."""
    air = rig_in(HELPERS / "powder_rigs" / "powder_air.py")
    same = {"size_spread": 0.0}
    energy = {"powder_surface_energy": 0.0} if law == laws.HERTZ_MINDLIN else {}
    factors = ({"air_drag": {"drag_factor": 2.0}}, {})
    rows = run(store, [small(air, law, numerics=same, effects=e, **energy) for e in factors], {air.name: air})
    assert set(rows["status"]) == {"ok"}, rows["status"].to_string()
    diameter = 6 * 431.3e-6
    reynolds = 1.2 * diameter / 1.81e-5
    expected = 2.0 * 0.75 * 1.2 / (1833.0 * diameter) * 24 / reynolds * (1 + 0.15 * reynolds**0.687)
    expected *= 1.3 if law == laws.LOCAL_DAMPING else 1.0  # it strengthens what slows by its damping, 0.3
    for observable in air.observables:
        assert rows[observable].tolist() == pytest.approx([expected, 0.0], rel=2e-3, abs=1e-9)


FRICTIONAL = {  # a base without the effects' own physics
    "powder_rolling_friction": 0.0,
    "powder_steel_rolling_friction": 0.3,
    "powder_surface_energy": 0.0,
}
SEEDS = range(1, 7)


@pytest.fixture(scope="module")
def started(store):
    """{effect or None: angles} of frictional heaps without, and with a hundred-thousandth of the physical limit.

    By local damping: without it grains that roll freely on each other lie too flat for flanks to be read.
    """
    limits = {"cohesion": 4e-6, "rolling_resistance": 6e-6}
    key = {name: next(iter(on_yade.rig("repose").effects[name])) for name in limits}
    amounts = {None: {}} | {name: {name: {key[name]: barely}} for name, barely in limits.items()}
    law = laws.LOCAL_DAMPING
    cases = [small(law=law, seed=seed, effects=effect, **FRICTIONAL) for effect in amounts.values() for seed in SEEDS]
    rows = run(store, cases)
    assert set(rows["status"]) == {"ok"}, rows["status"].to_string()
    angles = rows["repose_angle_deg"].to_numpy().reshape(len(amounts), len(SEEDS))
    return dict(zip(amounts, angles, strict=True))


@pytest.mark.parametrize("effect", ["cohesion", "rolling_resistance"])
def test_an_effect_of_heaps_begins_continuously_from_absent(started, effect):
    """A heap is chaotic: not heap by heap, but in the mean over seeds."""
    without, barely = started[None], started[effect]
    assert (without != barely).any()  # the effect acts
    error = np.hypot(without.std(ddof=1), barely.std(ddof=1)) / np.sqrt(len(SEEDS))
    assert abs(barely.mean() - without.mean()) < 3 * error
    assert error < 1.5


def test_an_absent_effect_is_bit_equal_and_a_present_one_is_its_parameter(store):
    """Amounts and parameters chosen so that their sum is exact."""
    quarter = small(powder_surface_energy=0.25, powder_rolling_friction=0.25, powder_steel_rolling_friction=0.25)
    absent = {name: {p: 0.0 for p in parameters} for name, parameters in on_yade.rig("repose").effects.items()}
    assert absent == quarter["effects"]
    both = small(
        powder_surface_energy=0.125,
        powder_rolling_friction=0.125,
        powder_steel_rolling_friction=0.125,
        effects={"cohesion": {"surface_energy_j_m2": 0.125}, "rolling_resistance": {"rolling_friction": 0.125}},
    )
    rows = run(store, [quarter, both])
    assert rows["id"].nunique() == 2
    for name in on_yade.rig("repose").observables:
        np.testing.assert_array_equal(*rows[name], err_msg=name)  # what does not apply is no number in both


def test_bond_number_of_the_source_papers_powder():
    """1.9 at G = 0.1 J/m2 and 5.6 at 0.3 for R = 1.294 mm; kept by any amplification when G goes with its square."""
    for energy, expected in ((0.1, 1.87), (0.3, 5.61)):
        assert powder_scene.bond_number(energy, 1.294e-3, 1833.0) == pytest.approx(expected, abs=0.01)
    for k in (4.0, 8.0):
        radius = powder_scene.grain_radius(431.3, k)
        assert powder_scene.bond_number(0.2 * (k / 6) ** 2, radius, 1833.0) == pytest.approx(3.74, abs=0.01)


def test_radii_keep_the_mass():
    drawn = powder_scene.radii(500, 1e-3, 0.3, np.random.default_rng(0))
    assert np.mean(drawn**3) == pytest.approx(1e-9)
    assert drawn.max() / drawn.min() > 1.5


@pytest.fixture(scope="module")
def heaps(store):
    """All heaps of this file, in one campaign."""
    cases = {
        "plain": small(),
        "other seed": small(seed=2),
        "frictionless": small(powder_static_friction=0.0, powder_rolling_friction=0.0, powder_surface_energy=0.0),
        "jammed": small(
            powder_surface_energy=0.6,
            numerics={"vibration_mm": 0.0},
            conditions={"powder_mass_g": 4.0, "outlet_diameter_mm": 9.0},
        ),
        "blown up": small(
            numerics={"time_step_fraction": 0.4},
            law=laws.HERTZ_MINDLIN,
            powder_restitution=0.05,
            powder_surface_energy=0.0,
        ),
        "no grains": small(conditions={"powder_mass_g": 1.0, "amplification": 7.0}),
    }
    rows = run(store, list(cases.values()))
    return {key: row for key, (_, row) in zip(cases, rows.iterrows(), strict=True)}


def test_a_heap_comes_to_rest_and_says_how_steep_it_is(heaps):
    heap = heaps["plain"]
    assert heap["status"] == "ok"
    assert 15 < heap["repose_angle_deg"] < 60
    assert heap["grains"] == 180
    assert heap["largest_overlap"] < 0.3
    assert heap["heap_height_mm"] < 30
    assert np.isnan(heap["repose_height_deg"])  # on an endless plate


def test_a_heap_says_how_fast_it_came(heaps):
    """In a few falls of the funnel's height; 180 grains fill it too low for a bulk density."""
    plain, slippery = heaps["plain"], heaps["frictionless"]
    assert 0.05 < slippery["discharge_time_s"] <= plain["discharge_time_s"] < 1.0
    assert plain["discharge_time_s"] < plain["end_time_s"]
    assert np.isnan(plain["fill_bulk_density_kg_m3"])


def test_a_heap_on_a_base_has_its_height_and_a_lifted_cylinder_no_discharge(store):
    on_base = {"protocol": "lifted_cylinder", "base_diameter_mm": 14.0, "powder_mass_g": 4.0}
    heap = run(
        store, [small(conditions=on_base, numerics={"cylinder_diameter_mm": 13.0}, powder_surface_energy=0.0)]
    ).iloc[0]
    assert heap["status"] == "ok", heap["status"]
    assert np.isnan(heap["discharge_time_s"])
    assert 0.4 < heap["fill_bulk_density_kg_m3"] / 1833 < 0.75
    assert heap["repose_height_deg"] == pytest.approx(np.degrees(np.arctan(heap["heap_height_mm"] / 7.0)), abs=0.5)


def test_the_same_case_gives_the_same_bits_and_another_seed_another_heap(heaps, tmp_path):
    again = dispatch.run([small()], tmp_path / ".store", workers=1, quiet=True).iloc[0]
    assert again["repose_angle_deg"] == heaps["plain"]["repose_angle_deg"]
    assert again["end_time_s"] == heaps["plain"]["end_time_s"]
    assert heaps["other seed"]["repose_angle_deg"] != heaps["plain"]["repose_angle_deg"]


@pytest.mark.parametrize(
    ("name", "verdict"),
    [
        ("jammed", "jammed: "),
        ("blown up", "blew up in the "),
        ("no grains", "grains make no heap"),
    ],
)
def test_what_is_no_heap_is_told(heaps, name, verdict):
    assert verdict in heaps[name]["status"]
    assert np.isnan(heaps[name]["repose_angle_deg"])


def test_grains_without_friction_lie_flat_and_that_is_an_answer(heaps):
    assert heaps["frictionless"]["status"] == "ok"
    assert heaps["frictionless"]["repose_angle_deg"] < 10


def test_grains_are_written_on_request(tmp_path, monkeypatch):
    monkeypatch.setenv("PELLET_STUDY_GRAINS", str(tmp_path))
    row = dispatch.run([small(seed=3)], tmp_path / ".store", workers=1, quiet=True).iloc[0]
    from yade_scripts import heap

    table = np.loadtxt(tmp_path / f"{row['id']}.csv", delimiter=",", skiprows=1)
    found = heap.readings(table[:, :3], table[:, 3]).repose
    assert found.angle_deg == pytest.approx(row["repose_angle_deg"], abs=1e-6)


def test_the_chain_knows_the_rigs_parameters():
    assert set(SYMBOLS.values()) == set(OWN)


def test_a_law_has_the_time_step_it_needs():
    """Heaps with a damper between grains are wrong at local damping's step (results/checks/repose_time_steps.csv)."""
    step = {law: on_yade.case("repose", contact_law=law)["numerics"]["time_step_fraction"] for law in LAWS}
    assert step == dict.fromkeys(LAWS, 0.09) | {laws.LOCAL_DAMPING: 0.18}
    given = on_yade.case("repose", contact_law="hertz_mindlin", numerics={"time_step_fraction": 0.05})
    assert given["numerics"]["time_step_fraction"] == 0.05
