"""Names of factors that hold a comma, as those of chemicals do."""

import pytest

from pellet_study.doe.factors import factors_meant, parse_levels
from pellet_study.errors import InputError


@pytest.mark.parametrize(
    "text, levels",
    [
        ("2,4-D=1.5", {"2,4-D": 1.5}),
        ("2,4-D=1.5,B=2", {"2,4-D": 1.5, "B": 2.0}),
        ("B=2.0,2,4-D=1.5", {"B": 2.0, "2,4-D": 1.5}),
        ("1,2-diol=3,2,4-D (mg)=1", None),
        ("B=0,887,C=3", None),
        ("B=0,887", None),
    ],
)
def test_levels_of_names_with_commas(text, levels):
    if levels is None:
        with pytest.raises(InputError, match="decimal points"):
            parse_levels(text)
    else:
        assert parse_levels(text) == levels


def test_names_with_commas_in_a_list():
    assert factors_meant("2,4-D,B", ["A", "B", "2,4-D (mg)"]) == ["2,4-D (mg)", "B"]
    with pytest.raises(InputError, match="'X' is no factor"):
        factors_meant("B,X,A", ["A", "B"])
