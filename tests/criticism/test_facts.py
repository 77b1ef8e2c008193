"""What an answer says, as data: names, conditions that vary, and effects that a catalogue lacks."""

import pytest

from pellet_study.criticism import facts, least_squares
from pellet_study.criticism.compare import compare
from pellet_study.criticism.verdicts import Note, Verdict
from pellet_study.rigs import catalogue
from pellet_study.study.load import load
from tests.helpers.make_study import incline

SUSPECT = {
    "effect": "cohesion", "score": 7.9, "p_adjusted": 0.0002, "chi2_drop": 64.1, "value": {"cohesive_stress_pa": 110.0},
    "visible_share": 0.53, "smallest_visible": 20.0, "explains": True, "note": "", "beyond": {},
}  # fmt: skip


@pytest.mark.parametrize(
    "missing, tied, names, effects",
    [
        (["a"], [], "a", ("a",)),
        (["a", "b"], [], "a and b", ("a", "b")),
        ([], ["a", ["a", "b"]], "a or a + b", ("a", "b")),
        ([], [], "", ()),
    ],
)
def test_a_verdict_names_its_effects_once(missing, tied, names, effects):
    found = facts.finding({"verdict": "tied", "effects": ["c"], "missing": missing, "tied": tied})
    assert (found.verdict, found.model, found.names, found.effects) == (Verdict.TIED, "base + c", names, effects)


def test_only_conditions_that_change_within_a_rig_vary():
    rows = [
        {"rig": "one", "conditions": {"x": 1.0, "y": 5.0}},
        {"rig": "one", "conditions": {"x": 2.0, "y": 5.0}},
        {"rig": "other", "conditions": {"x": 3.0}},
    ]
    assert facts.varying(rows) == {"one": ["x"], "other": []}


def test_a_size_has_the_range_of_the_catalogue_unless_the_effect_is_unknown_there():
    standard = catalogue.standard()
    known, unknown = facts.candidates(standard, {"ranking": [SUSPECT, {**SUSPECT, "effect": "of_last_year"}]})
    quantity = standard.effects["cohesion"].parameters["cohesive_stress_pa"]
    assert known.sizes[0].physical == tuple(quantity["physical"]) and known.sizes[0].unit == quantity["unit"]
    assert unknown.sizes[0].physical is None and unknown.sizes[0].value == 110.0


@pytest.mark.parametrize("note, p, unseen", [("", 0.01, False), ("", 0.2, True), (Note.WRONG_SIGN, 0.01, True)])
def test_a_candidate_is_unseen_by_its_p_or_its_sign(note, p, unseen):
    (one,) = facts.candidates(catalogue.standard(), {"ranking": [{**SUSPECT, "note": note, "p_adjusted": p}]})
    assert one.unseen == unseen


def test_a_fit_cut_short_is_known_to_have_not_converged(tmp_path, monkeypatch):
    study = load(incline(tmp_path, c=40.0))
    assert compare(study).converged
    monkeypatch.setattr(least_squares, "ROUNDS", 0)
    assert not compare(study).converged
