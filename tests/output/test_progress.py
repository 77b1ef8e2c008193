"""Progress of a campaign whose output goes into a file: seldom, and not at all where it is short."""

import io
import sys

from pellet_study.output import terminal


def test_a_short_campaign_says_nothing_in_a_file(monkeypatch):
    file = io.StringIO()
    monkeypatch.setattr(sys, "stderr", file)
    bar = terminal.progress(3, quiet=False)
    bar.update(3)
    bar.close()
    assert file.getvalue() == ""


def test_a_long_one_says_how_far_it_is_and_a_quiet_one_does_not(monkeypatch):
    monkeypatch.setattr(terminal, "SELDOM_S", 0.0)
    for quiet in (False, True):
        file = io.StringIO()
        monkeypatch.setattr(sys, "stderr", file)
        bar = terminal.progress(41, quiet)
        bar.update(12)
        bar.close()
        assert ("12/41" in file.getvalue()) is not quiet
