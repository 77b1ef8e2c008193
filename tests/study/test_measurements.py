"""measurements.csv: what is accepted, and what is refused with file, line, what was given and what is accepted."""

import numpy as np
import pytest

from pellet_study.errors import InputError
from pellet_study.rigs import catalogue
from pellet_study.study.measurements import read

HEADER = "rig,observable,value,layer_height_mm"
ROW = "layer_on_incline,slip_angle_deg,30,20"


def rows_of(tmp_path, *lines):
    file = tmp_path / "measurements.csv"
    file.write_text("\n".join(lines) + "\n")
    return read(file, catalogue.standard())


def test_defaults_are_filled_in(tmp_path):
    row = rows_of(tmp_path, HEADER, ROW)[0]
    assert (row.n, row.sd, row.split, row.setup_sd) == (1, None, "fit", 0.0)
    assert row.conditions["bulk_density_kg_m3"] == 1400.0
    assert row.conditions["layer_height_mm"] == 20.0


def test_known_parameter_and_blank_condition_of_another_rig(tmp_path):
    rows = rows_of(
        tmp_path,
        "rig,observable,value,layer_height_mm,normal_stress_pa,internal_friction,note",
        "layer_on_incline,slip_angle_deg,30,20,,0.4,first",
        "shear_cell,shear_stress_pa,500,,1000,,",
    )
    assert rows[0].parameters == {"internal_friction": 0.4}
    assert rows[1].conditions == {"normal_stress_pa": 1000.0}
    assert rows[0].note == "first"


@pytest.mark.parametrize(
    "lines, words",
    [
        (
            (HEADER.replace("layer_height_mm", "layer_hieght_mm"), ROW),
            ("line 1", "layer_hieght_mm", "did you mean 'layer_height_mm'"),
        ),
        ((HEADER + ",value", ROW + ",1"), ("line 1", "'value'", "2 times")),
        (("rig,value", "shear_cell,1"), ("observable", "missing")),
        (
            (HEADER, "layer_on_inclin,slip_angle_deg,30,20"),
            ("line 2", "layer_on_inclin", "did you mean 'layer_on_incline'"),
        ),
        ((HEADER, "layer_on_incline,slip_angle,30,20"), ("line 2", "slip_angle", "slip_angle_deg")),
        ((HEADER, ROW, "layer_on_incline,slip_angle_deg,thirty,20"), ("line 3", "thirty", "expected a number")),
        ((HEADER, "layer_on_incline,slip_angle_deg,nan,20"), ("line 2", "finite")),
        ((HEADER, "layer_on_incline,slip_angle_deg,30,-3"), ("line 2", "layer_height_mm", "more than 0")),
        ((HEADER, "layer_on_incline,slip_angle_deg,30"), ("line 2", "3 cells", "4")),
        ((HEADER, "shear_cell,shear_stress_pa,30,20"), ("line 2", "shear_cell", "layer_height_mm", "blank")),
        ((HEADER + ",sd", ROW + ",0"), ("line 2", "sd", "more than 0")),
        ((HEADER + ",n", ROW + ",2.5"), ("line 2", "n", "whole number")),
        ((HEADER + ",split", ROW + ",test"), ("line 2", "test", "holdout")),
        ((HEADER, ROW, "layer_on_incline,slip_angle_deg,120,20"), ("line 3", "'120'", "from 0 to 80")),
        (("rig,observable,value", "slope_slip,slip_angle_deg,120"), ("line 2", "'120'", "from 0 to 90")),
        ((HEADER,), ("no rows",)),
    ],
)
def test_refused(tmp_path, lines, words):
    with pytest.raises(InputError) as error:
        rows_of(tmp_path, *lines)
    for word in ("measurements.csv", *words):
        assert word in str(error.value)


def test_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match="nowhere.csv"):
        read(tmp_path / "nowhere.csv", catalogue.standard())


@pytest.mark.parametrize("number", (2, 3, 4, 7, 10))
def test_the_median_of_all_others_is_each_row_s(number):
    from pellet_study.study.spreads import median_of_others

    values = np.random.default_rng(number).integers(0, 5, number).astype(float)  # with ties
    assert list(median_of_others(values)) == [np.median(np.delete(values, k)) for k in range(number)]
