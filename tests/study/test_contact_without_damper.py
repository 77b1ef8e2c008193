"""A restitution at the contact is refused where the law has no damper, when the study is loaded."""

import pytest

from tests.helpers.make_study import command, folder


@pytest.mark.parametrize("law, refused", [("cohesive_frictional_local_damping", True), ("cohesive_frictional", False)])
def test_it_is_refused_with_what_to_do(tmp_path, capsys, law, refused):
    study = folder(tmp_path, ["rig,observable,value,sd", "rebound,rebound_height_mm,8,1"])
    toml = f'contact_law = "{law}"\nrestitution_at = "contact"\n[parameters]\nseed_powder_static_friction = 0.3\n'
    (study / "study.toml").write_text(toml)
    assert command("check", study)[0] == (2 if refused else 0)
    said = " ".join(capsys.readouterr().err.split())
    assert ('has no damper that could take a mass; expected restitution_at = "centre"' in said) == refused
    (study / "study.toml").write_text(toml.replace('"contact"', '"centre"'))
    assert command("check", study)[0] == 0
