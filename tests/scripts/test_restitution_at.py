"""The two conventions for a hit off centre: the damper takes the seed's whole mass, or the mass effective at the contact."""

import pandas as pd
import pytest

from pellet_study.rigs import on_yade
from pellet_study.rigs.declarations import rig_in
from pellet_study.simulation import dispatch
from tests import HELPERS, ROOT
from tests.helpers.make_study import command
from yade_scripts import laws

pytestmark = pytest.mark.yade

FINE = {"time_step_fraction": 0.01}


@pytest.fixture(scope="module")
def landings(tmp_path_factory):
    """{(e, at the contact, pitch): restitution of the point that touches}."""
    rig = rig_in(HELPERS / "effect_rigs" / "landing_askew.py")
    wanted = [(e, at, pitch) for e in (0.25, 0.5) for at in (0.0, 1.0) for pitch in (40.0, 90.0)]
    cases = [
        on_yade.case(
            rig,
            parameters={"seed_powder_restitution": e},
            conditions={"pitch_deg": pitch, "speed_m_s": 0.1},  # slow: the lever changes little
            numerics={**FINE, "damping_at_contact": at},
        )
        for e, at, pitch in wanted
    ]
    rows = dispatch.run(cases, tmp_path_factory.mktemp("askew"), rigs={rig.name: rig}, workers=1, quiet=True)
    assert set(rows["status"]) == {"ok"}, rows["status"].to_string()
    return dict(zip(wanted, rows["restitution_there"], strict=True))


@pytest.mark.parametrize("e", [0.25, 0.5])
def test_the_mass_at_the_contact_keeps_e_off_centre(landings, e):
    assert landings[e, 1.0, 40.0] == pytest.approx(e, rel=0.02)
    assert landings[e, 0.0, 40.0] < 0.94 * e  # the whole mass takes more


@pytest.mark.parametrize("e", [0.25, 0.5])
def test_on_its_end_both_are_the_same(landings, e):
    assert landings[e, 1.0, 90.0] == pytest.approx(landings[e, 0.0, 90.0], rel=1e-6) == pytest.approx(e, rel=0.02)


def test_a_law_without_a_damper_refuses_it(tmp_path):
    case = on_yade.case("rebound", contact_law=laws.LOCAL_DAMPING, numerics={"damping_at_contact": 1.0})
    assert "no damper" in dispatch.run([case], tmp_path / ".store", workers=1, quiet=True).iloc[0]["status"]


def study(path, restitution_at: str = ""):
    path.mkdir()
    toml = f'restitution_at = "{restitution_at}"\n' if restitution_at else ""
    (path / "study.toml").write_text(f"{toml}[parameters]\nseed_powder_restitution = {{ min = 0.1, max = 0.6 }}\n")
    rows = [f"rebound,rebound_height_mm,{v},0.5,5,{h}" for h, v in ((60, 5), (120, 9))]
    (path / "measurements.csv").write_text("\n".join(["rig,observable,value,sd,n,drop_height_mm", *rows]) + "\n")
    return path


def test_a_study_says_of_e_that_it_is_of_this_law(tmp_path, monkeypatch, capsys):
    """A closed form in YADE's place: heights e^2 h, more by a fifth where the damper takes the mass at the contact."""
    asked = []

    def run(cases, store, **_):
        store.mkdir(parents=True, exist_ok=True)
        asked.extend(case["numerics"]["damping_at_contact"] for case in cases)
        heights = [
            c["parameters"]["seed_powder_restitution"] ** 2
            * c["conditions"]["drop_height_mm"]
            * (1.2 if c["numerics"]["damping_at_contact"] else 1.0)
            for c in cases
        ]
        return pd.DataFrame({"rebound_height_mm": heights, "status": "ok"})

    monkeypatch.setattr(dispatch, "run", run)
    found = {}
    for convention in ("centre", "contact"):
        status, answer = command("compare", study(tmp_path / convention, convention), json_file=tmp_path / "a.json")
        said = " ".join(capsys.readouterr().out.split())
        assert status == 0 and ("not to be carried to another code" in said) == (convention == "centre")
        assert bool(answer["cautions"]) == (convention == "centre")
        found[convention] = answer["parameters"]["seed_powder_restitution"]
    assert set(asked) == {0.0, 1.0}
    assert found["contact"] == pytest.approx(found["centre"] / 1.2**0.5, rel=0.01)


def test_a_convention_that_is_none_is_refused(tmp_path, capsys):
    assert command("compare", study(tmp_path / "s", "middle"))[0] == 2
    said = capsys.readouterr().err
    assert "restitution_at" in said and "centre" in said and "contact" in said


def test_what_the_convention_does_to_a1_is_shown():
    table = pd.read_csv(ROOT / "results" / "checks" / "restitution_convention.csv")
    levels, met = table.iloc[:-1], table.iloc[-1]
    assert (levels["change_percent"] > 0).all()
    assert met["at_contact_mm"] < met["whole_mass_mm"] and "a1 that meets" in met["a1"]
