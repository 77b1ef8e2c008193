"""A YADE of a version that nobody has checked: its laws are checked once, and what is off is named."""

import logging
import stat

import pytest

from pellet_study.rigs import on_yade
from pellet_study.simulation import dispatch, law_cases, unseen, yade

pytestmark = pytest.mark.yade


@pytest.fixture
def named(tmp_path, monkeypatch):
    """The real YADE, which calls itself by the name of a version."""

    def wrapped(version: str) -> None:
        real = yade.executable()
        file = tmp_path / f"yade-{version}"
        file.write_text(
            f'#!/bin/sh\nif [ "$1" = --version ]; then echo "Yade version: {version}, "; exit 0; fi\nexec {real} "$@"\n'
        )
        file.chmod(file.stat().st_mode | stat.S_IXUSR)
        monkeypatch.setenv("PELLET_STUDY_YADE", str(file))
        for known in (yade.executable, yade.version):
            known.cache_clear()

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    yield wrapped
    for known in (yade.executable, yade.version):
        known.cache_clear()


CASE = on_yade.case("restitution", parameters={"restitution": 0.5})
FEW = [CASE, on_yade.case("sliding", parameters={"static_friction": 0.6})]


def test_a_version_never_seen_is_checked_once_before_its_first_campaign(named, tmp_path, monkeypatch, caplog):
    monkeypatch.setattr(law_cases, "cases", lambda quick: FEW)  # two of the quick checks: the others are like them
    named("2031.1.0")
    with caplog.at_level(logging.WARNING):
        assert set(dispatch.run([CASE], tmp_path / "one", quiet=True)["status"]) == {"ok"}
        said = caplog.text
        caplog.clear()
        dispatch.run([CASE], tmp_path / "another", quiet=True)
    assert "2031.1.0 has not been checked" in said and "are off" not in said
    assert caplog.text == ""
    assert (tmp_path / "cache" / "pellet_study" / "yade-2031.1.0").is_dir()


def test_a_check_that_is_off_is_named(named, monkeypatch, caplog):
    """Half the speed is asked for with a step so long that no damper can have the restitution: off, whatever the version."""
    coarse = on_yade.case("restitution", parameters={"restitution": 0.05}, numerics={"time_step_fraction": 0.25})
    monkeypatch.setattr(law_cases, "cases", lambda quick: [coarse])
    monkeypatch.setattr("yade_scripts.checks.restitution.instead", lambda case: {})  # as if no limit were known
    named("2031.1.1")
    with caplog.at_level(logging.WARNING):
        off = unseen.check(1)
    assert list(off["check"]) == ["restitution"]
    assert "1 checks of its contact laws are off" in caplog.text and "requested 0.05, got" in caplog.text


def test_a_version_that_was_checked_is_not_checked_again(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert yade.version() in unseen.CHECKED
    assert unseen.check(1).empty
    assert not list(tmp_path.iterdir())
