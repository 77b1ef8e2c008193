"""A condition that is a word out of a list: what a case may say."""

import pytest

from yade_scripts import case as case_file

RIG = {
    "name": "made_up",
    "contact_laws": ("hertz_mindlin",),
    "parameters": {},
    "conditions": {
        "protocol": case_file.choice("defined_base", ("defined_base", "funnel"), "how the heap is made"),
        "height_mm": case_file.quantity(1, 0, 2, "mm", "height"),
    },
    "effects": {},
    "numerics": {},
    "observables": {"answer": "the answer"},
}


def test_a_case_has_the_default_word_or_another_of_the_list():
    case = case_file.example(RIG)
    assert case["conditions"]["protocol"] == "defined_base"
    case_file.check(case, RIG)
    case["conditions"]["protocol"] = "funnel"
    case_file.check(case, RIG)


@pytest.mark.parametrize("word", ["funel", "", None, 1.0, ["funnel"], "defined_basefunnel"])
def test_any_other_word_is_refused_with_those_there_are(word):
    case = case_file.example(RIG)
    case["conditions"]["protocol"] = word
    with pytest.raises(ValueError, match="protocol: expected one of defined_base, funnel, got "):
        case_file.check(case, RIG)


def test_a_number_stays_a_number():
    case = case_file.example(RIG)
    case["conditions"]["height_mm"] = "funnel"
    with pytest.raises(ValueError, match="height_mm: expected a finite number"):
        case_file.check(case, RIG)
