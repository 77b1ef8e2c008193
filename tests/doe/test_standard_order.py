"""Tables beside the design whose runs they number: the very cell, runs exchanged, columns under each other's headers."""

import shlex

import numpy as np
import pandas as pd
import pytest

from pellet_study.__main__ import main

DESIGNS = {
    "screening": "pb --design T=100,130,C t=3,7,min p=0.8,1.6,MPa glue=120,180 water=4,8 acid=0.5,1.5 --centre 3",
    "surface": "bbd --design T=140,170,C t=7,11,min glue=187,247",
    "composite": "bbd --design T=140,170,C t=7,11,min glue=187,247 --axial rotatable --blocks 3 --centre 6",
    "reversed": "bbd --design B=0.90,0.82 C=0.25,0.33 G=0.10,0.18 --face-centred",
}


def sheet(tmp_path, kind) -> tuple[str, pd.DataFrame]:
    """The command, and its run sheet filled with readings of a plane."""
    path = tmp_path / "sheet.csv"
    assert main([*DESIGNS[kind].split(), "--seed", "3", "--output", str(path)]) == 0
    frame = pd.read_csv(path)
    names = [name for name in frame if name not in ("run", "standard_order", "block", "response")]
    coded = (frame[names] - frame[names].mean()) / frame[names].std()
    noise = np.random.default_rng(5).normal(size=len(frame))
    frame["response"] = (50 + 3 * coded.iloc[:, 0] - 2 * coded.iloc[:, 1] + 0.3 * noise).round(2)
    return DESIGNS[kind].split()[0], frame


def warnings_of(tmp_path, capsys, command, frame) -> str:
    path = tmp_path / "filled.csv"
    frame.to_csv(path, index=False)
    capsys.readouterr()
    assert main([command, str(path), *(("--block", "block") if "block" in frame else ())]) == 0
    return capsys.readouterr().err


@pytest.mark.parametrize("kind", DESIGNS)
def test_a_sheet_as_it_was_made_has_nothing_amiss(tmp_path, capsys, kind):
    """In any order of its rows, with runs lost, and a level run a little off its place."""
    command, frame = sheet(tmp_path, kind)
    frame.loc[2, "response"] = np.nan
    assert "standard_order the" not in warnings_of(tmp_path, capsys, command, frame.sample(frac=1, random_state=1))


@pytest.mark.parametrize("kind, name", [("screening", "t (min)"), ("surface", "glue"), ("composite", "T (C)")])
def test_the_one_cell_is_named_where_the_runs_alone_leave_several(tmp_path, capsys, kind, name):
    command, frame = sheet(tmp_path, kind)
    low, high = frame[name].quantile([0.2, 0.8], interpolation="nearest")
    row = frame.index[np.isclose(frame[name], low)][0]
    frame.loc[row, name] = high
    told = warnings_of(tmp_path, capsys, command, frame)
    assert f"column {name!r}, row {row + 2}: {high:g} where {low:g} is expected: by their standard_order" in told
    assert told.count("is expected") == 1


def test_axial_points_added_to_a_screening_are_no_slips(tmp_path, capsys):
    """Four of six factors go on, named in another order than the table's; a level typed wrong among the new runs is named."""
    _, frame = sheet(tmp_path, "screening")
    made, path = tmp_path / "made.csv", tmp_path / "axial.csv"
    frame.to_csv(made, index=False)
    words = ["--factors", "glue,T,p,t", "--axial", "1.5", "--seed", "2", "--output", str(path)]
    assert main(["design", "axial", str(made), *words]) == 0
    asked = capsys.readouterr().out.split("next: pellet-study ")[-1].splitlines()[0]
    frame = pd.read_csv(path)
    frame["response"] = frame["response"].fillna(50.0) + np.random.default_rng(1).normal(size=len(frame))
    frame.to_csv(path, index=False)
    assert main(shlex.split(asked)) == 0
    assert "standard_order the runs have" not in capsys.readouterr().err
    heat = next(name for name in frame if name.startswith("T"))
    row = frame.index[frame[heat] > 130][0]
    frame.loc[row, heat] = 122.5
    frame.to_csv(path, index=False)
    assert main(shlex.split(asked)) == 0
    assert f"column {heat!r}, row {row + 2}: 122.5 where 137.5 is expected" in capsys.readouterr().err


def test_two_runs_exchanged_are_named_cell_by_cell(tmp_path, capsys):
    command, frame = sheet(tmp_path, "screening")
    names = ["T (C)", "t (min)", "p (MPa)", "glue", "water", "acid"]
    differ = [name for name in names if frame.loc[0, name] != frame.loc[1, name]]
    frame.loc[[0, 1], names] = frame.loc[[1, 0], names].to_numpy()
    told = warnings_of(tmp_path, capsys, command, frame)
    assert told.count("is expected") == 2 * len(differ)
    assert all(f"column {name!r}, row {row}" in told for name in differ for row in (2, 3))


@pytest.mark.parametrize("kind, one, other", [("screening", "p (MPa)", "acid"), ("surface", "T (C)", "glue")])
def test_columns_under_each_others_headers_are_named(tmp_path, capsys, kind, one, other):
    command, frame = sheet(tmp_path, kind)
    frame[[one, other]] = frame[[other, one]].to_numpy()
    told = warnings_of(tmp_path, capsys, command, frame)
    assert f"{one!r} under {other!r}" in told and f"{other!r} under {one!r}" in told
    assert "stand under each other's headers" in told and "is expected" not in told


def test_an_order_that_numbers_another_design_says_nothing(tmp_path, capsys):
    """Numbers of a design made elsewhere: the rule of the runs alone holds as before."""
    command, frame = sheet(tmp_path, "surface")
    frame["standard_order"] = frame["run"]
    assert "by their standard_order" not in warnings_of(tmp_path, capsys, command, frame)


def test_a_column_of_dates_numbers_no_design(tmp_path, capsys):
    """A design with as many runs as a date has seconds would not fit into memory."""
    command, frame = sheet(tmp_path, "screening")
    frame["standard_order"] = [20260101000000 + k for k in range(len(frame))]
    said = warnings_of(tmp_path, capsys, command, frame)
    assert said.count("warning:") == 1 and "left out: run, standard_order" in said
