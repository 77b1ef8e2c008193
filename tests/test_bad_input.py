"""Bad input: every case ends with status 2 and one paragraph that names place, what was given and what is accepted."""

import json
import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from pellet_study.__main__ import main
from pellet_study.errors import InputError
from pellet_study.files import writing
from pellet_study.rigs import catalogue
from pellet_study.study.load import KEYS, load
from pellet_study.study.measurements import read

HEAD = "rig,observable,value,layer_height_mm"
ROW = "layer_on_incline,slip_angle_deg,30,20"
ROWS = "\n".join([HEAD, ROW, "layer_on_incline,slip_angle_deg,33,12", "layer_on_incline,slip_angle_deg,37,8"]) + "\n"
TOML = "[parameters]\ninternal_friction = { value = 0.5, min = 0.05, max = 2.0 }\n"


def cells(more: str = "", row: str = ROW, head: str = HEAD) -> str:
    return f"{head}{more}\n{row}\n"


MEASUREMENTS = {
    "an empty file": ("", ["empty", "rig, observable, value"]),
    "a heading only": (HEAD + "\n", ["no rows", "a reading"]),
    "blank lines only": ("\n\n\n", ["line 1", "rig, observable, value is missing"]),
    "no heading": (ROW + "\n", ["line 1", "'layer_on_incline'", "unknown"]),
    "no rig": ("observable,value\nslip_angle_deg,3\n", ["line 1", "column rig is missing"]),
    "no observable": ("rig,value\nshear_cell,3\n", ["line 1", "column observable is missing"]),
    "no value": ("rig,observable\nshear_cell,shear_stress_pa\n", ["line 1", "column value is missing"]),
    "a misspelt column": (
        cells(head=HEAD.replace("height", "hight")),
        ["line 1", "'layer_hight_mm'", "'layer_height_mm'"],
    ),
    "another unit in the name": (
        cells(head=HEAD.replace("_mm", "_cm")),
        ["line 1", "'layer_height_cm'", "'layer_height_mm'"],
    ),
    "no unit in the name": (cells(head=HEAD.replace("_mm", "")), ["line 1", "'layer_height'", "'layer_height_mm'"]),
    "a column twice": (cells(",value", ROW + ",1"), ["line 1", "'value'", "2 times"]),
    "an unnamed column": (cells(",", ROW + ",1"), ["line 1", "column ''", "accepted are"]),
    "another case of letters": (cells(head=HEAD.replace("rig", "Rig")), ["line 1", "'Rig'", "'rig'"]),
    "two decimal signs": (
        HEAD.replace(",", ";") + "\nlayer_on_incline;slip_angle_deg;30,5;20\nlayer_on_incline;slip_angle_deg;30.5;20\n",
        ["line 3", "'30.5'", "decimal comma"],
    ),
    "decimal commas between commas": (cells(row=ROW.replace("30", "30,5")), ["line 2", "5 cells", "4"]),
    "a cell too few": (cells(row="layer_on_incline,slip_angle_deg,30"), ["line 2", "3 cells", "4"]),
    "a cell too many": (cells(row=ROW + ",5"), ["line 2", "5 cells", "4"]),
    "an unknown rig": (
        cells(row=ROW.replace("incline", "inclin")),
        ["line 2", "'layer_on_inclin'", "'layer_on_incline'"],
    ),
    "no rig in a row": (cells(row=ROW.replace("layer_on_incline", "")), ["line 2", "rig ''", "layer_on_incline"]),
    "an unknown observable": (
        cells(row=ROW.replace("angle", "angel")),
        ["line 2", "'slip_angel_deg'", "'slip_angle_deg'"],
    ),
    "an observable of another rig": (
        cells(row=ROW.replace("slip_angle_deg", "shear_stress_pa")),
        ["line 2", "slip_angle_deg"],
    ),
    "a blank value": (cells(row=ROW.replace("30", "")), ["line 2", "value ''", "expected a number"]),
    "text as value": (cells(row=ROW.replace("30", "thirty")), ["line 2", "'thirty'", "expected a number"]),
    "a value with its unit": (cells(row=ROW.replace("30", "30 deg")), ["line 2", "'30 deg'", "expected a number"]),
    "nan": (cells(row=ROW.replace("30", "nan")), ["line 2", "'nan'", "not finite"]),
    "infinity": (cells(row=ROW.replace("30", "inf")), ["line 2", "'inf'", "not finite"]),
    "minus infinity as condition": (cells(row=ROW.replace("20", "-inf")), ["line 2", "layer_height_mm", "not finite"]),
    "a number too large": (cells(row=ROW.replace("30", "1e999")), ["line 2", "'1e999'", "not finite"]),
    "an sd of 1e-200": (cells(",sd", ROW + ",1e-200"), ["line 2", "sd 1e-200", "1e-60"]),
    "an sd of 1e300": (cells(",sd", ROW + ",1e300"), ["line 2", "sd 1e+300", "1e+60"]),
    "a height of 1e308": (cells(row=ROW.replace("20", "1e308")), ["line 2", "layer_height_mm 1e+308", "1e+60"]),
    "an underscore in a number": (cells(row=ROW.replace("30", "3_0")), ["line 2", "value '3_0'", "expected a number"]),
    "a date": (cells(row=ROW.replace("30", "2024-05-01")), ["line 2", "'2024-05-01'", "expected a number"]),
    "a formula": (cells(row=ROW.replace("30", "=A1+1")), ["line 2", "'=A1+1'", "expected a number"]),
    "a condition of zero": (cells(row=ROW.replace("20", "0")), ["line 2", "layer_height_mm", "more than 0"]),
    "a negative condition": (cells(row=ROW.replace("20", "-3")), ["line 2", "layer_height_mm '-3'", "more than 0"]),
    "a condition of another rig": (
        cells(",normal_stress_pa", ROW + ",100"),
        ["line 2", "normal_stress_pa", "leave the cell blank"],
    ),
    "a parameter of another rig": (
        cells(",seed_powder_restitution", ROW + ",0.5"),
        ["line 2", "seed_powder_restitution"],
    ),
    "a parameter outside its range": (
        cells(",internal_friction", ROW + ",-1"),
        ["line 2", "internal_friction '-1'", "0 to"],
    ),
    "a negative sd": (cells(",sd", ROW + ",-1"), ["line 2", "sd '-1'", "more than 0"]),
    "an sd of zero": (cells(",sd", ROW + ",0"), ["line 2", "sd '0'", "more than 0"]),
    "an sd that is nan": (cells(",sd", ROW + ",nan"), ["line 2", "sd 'nan'", "not finite"]),
    "n of zero": (cells(",n", ROW + ",0"), ["line 2", "n '0'", "at least 1"]),
    "a negative n": (cells(",n", ROW + ",-2"), ["line 2", "n '-2'", "at least 1"]),
    "half a reading": (cells(",n", ROW + ",2.5"), ["line 2", "n '2.5'", "whole number"]),
    "an infinite n": (cells(",n", ROW + ",inf"), ["line 2", "n 'inf'", "not finite"]),
    "a negative setup_sd": (cells(",setup_sd", ROW + ",-1"), ["line 2", "setup_sd '-1'", "at least 0"]),
    "an unknown split": (cells(",split", ROW + ",test"), ["line 2", "'test'", "fit, holdout, leave_out"]),
    "a row left out without a reason": (cells(",split", ROW + ",leave_out"), ["line 2", "leave_out", "`reason`"]),
    "a reason for a row that is fitted": (
        cells(",split,reason", ROW + ",,spilt"),
        ["line 2", "reason 'spilt'", "leave_out or holdout"],
    ),
    "an order that is no number": (cells(",order", ROW + ",first"), ["line 2", "order 'first'", "expected a number"]),
    "all rows left out": (cells(",split,reason", ROW + ",leave_out,spilt"), ["every row", "split `fit`"]),
    "a misspelt split": (cells(",split", ROW + ",holduot"), ["line 2", "'holdout'"]),
    "a quote that is not closed": (cells(",note", ROW + ',"my note'), ["line 2", "quote"]),
    "text after a quote": (cells(",note", ROW + ',"my" note'), ["line 2", "quote"]),
    "a NUL": (cells(",note", ROW + ",a\0b"), ["line 2", "0x00", "no UTF-8 text"]),
    "an escape sequence": (cells(",note", ROW + ",\x1b[2J"), ["line 2", "0x1b", "no UTF-8 text"]),
    "an error in a late row": (ROWS + ROW.replace("30", "x") + "\n", ["line 5", "'x'"]),
    "all rows held out": (cells(",split", ROW + ",holdout"), ["held out", "split `fit`"]),
    "bytes of a picture": (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", ["line 1", "0x89", "UTF-8"]),
    "half of UTF-16": (cells().encode("utf-16")[:-1], ["cannot be read", "utf-16"]),
    "Latin-1": (cells(",note", ROW + ",Schüttgut").encode("latin-1"), ["line 2", "0xfc", "UTF-8"]),
}

STUDY = {
    "no TOML": ("this is no toml", ["study.toml", "no valid TOML", "line 1"]),
    "a bracket that is not closed": ("[parameters\n", ["no valid TOML", "line 1"]),
    "a key twice": ('title = "a"\ntitle = "b"\n', ["no valid TOML", "line 2"]),
    "a table twice": ("[parameters]\n[parameters]\n", ["no valid TOML", "line 2"]),
    "a misspelt key": ('titel = "a"\n', ["'titel'", "'title'"]),
    "a misspelt table": ("[parameter]\n", ["'parameter'", "'parameters'"]),
    "a title that is a number": ("title = 3\n", ["title", "3", "text in quotes"]),
    "a title with an escape sequence": ('title = "\\u001b[2J"\n', ["title", "control characters"]),
    "a list as measurements": ('measurements = ["a.csv"]\n', ["measurements", "text in quotes"]),
    "measurements that are not there": ('measurements = "nowhere.csv"\n', ["nowhere.csv", "no such file"]),
    "measurements above the study": ('measurements = "../measurements.csv"\n', ["outside the study"]),
    "measurements by an absolute path": ('measurements = "/etc/passwd"\n', ["outside the study"]),
    "measurements that are a folder": ('measurements = "."\n', ["expected a file"]),
    "measurements that are no path": ('measurements = "a\\u0000b"\n', ["measurements", "control characters"]),
    "measurements of 300 letters": (f'measurements = "{"m" * 300}"\n', ["cannot be read", "too long"]),
    "an unknown contact law": ('contact_law = "hertz"\n', ["contact_law", "'hertz'", "hertz_mindlin"]),
    "a number as contact law": ("contact_law = 1\n", ["contact_law", "hertz_mindlin"]),
    "an unknown scaling": ('surface_energy_scaling = "bond"\n', ["surface_energy_scaling", "bond_number"]),
    "parameters that are no table": ("parameters = 3\n", ["parameters", "table"]),
    "a misspelt parameter": ("[parameters]\ninternal_fricton = 0.5\n", ["'internal_fricton'", "'internal_friction'"]),
    "min above max": ("[parameters]\ninternal_friction = { min = 2.0, max = 0.05 }\n", ["internal_friction", "min 2", "max 0.05"]),
    "min without max": ("[parameters]\ninternal_friction = { min = 0.1 }\n", ["internal_friction", "give both"]),
    "a value outside min and max": ("[parameters]\ninternal_friction = { value = 3, min = 0, max = 1 }\n", ["value 3", "outside"]),
    "a value outside what is possible": ("[parameters]\ninternal_friction = -0.5\n", ["internal_friction", "-0.5", "outside"]),
    "an unknown key of a parameter": ("[parameters]\ninternal_friction = { vaule = 3 }\n", ["'vaule'", "'value'"]),
    "an empty parameter": ("[parameters]\ninternal_friction = {}\n", ["internal_friction", "expected a number"]),
    "text as parameter": ('[parameters]\ninternal_friction = "0.5"\n', ["internal_friction", "finite number", "0.5"]),
    "nan as parameter": ("[parameters]\ninternal_friction = nan\n", ["internal_friction", "finite number"]),
    "infinity as max": ("[parameters]\ninternal_friction = { min = 0, max = inf }\n", ["max", "finite number"]),
    "a parameter of 1e-300": ("[parameters]\ninternal_friction = 1e-300\n", ["internal_friction", "1e-60"]),
    "true as parameter": ("[parameters]\ninternal_friction = true\n", ["internal_friction", "finite number"]),
    "a date as parameter": ("[parameters]\ninternal_friction = 2024-05-01\n", ["internal_friction", "finite number"]),
    "a whole number of 400 digits": (f"[parameters]\ninternal_friction = {'9' * 400}\n", ["internal_friction", "finite number"]),
    "an unknown effect": (TOML + "[effects]\ncohesoin = {}\n", ["'cohesoin'", "'cohesion'"]),
    "an effect that is a number": (TOML + "[effects]\ncohesion = 3\n", ["cohesion", "cohesive_stress_pa"]),
    "an unknown parameter of an effect": (TOML + "[effects]\ncohesion = { stress = 1 }\n", ["'stress'", "cohesive_stress_pa"]),
    "an effect outside its range": (TOML + "[effects]\ncohesion = { cohesive_stress_pa = -1e9 }\n", ["cohesive_stress_pa", "outside"]),
    "an effect that acts in no rig used": (TOML + "[effects]\nair_drag = { drag_factor = 0.5 }\n", ["air_drag", "acts in none"]),
    "candidates that are text": ('candidates = "cohesion"\n', ["candidates", "list of effect names"]),
    "candidates that are numbers": ("candidates = [1]\n", ["candidates", "list of effect names"]),
    "an unknown candidate": ('candidates = ["cohesoin"]\n', ["'cohesoin'", "'cohesion'"]),
    "a candidate that acts in no rig used": ('candidates = ["air_drag"]\n', ["air_drag", "acts in none"]),
    "a possible rig that is unknown": ("[possible.shear_box]\nx = 1\n", ["'shear_box'", "shear_cell"]),
    "a possible condition that is unknown": ("[possible.layer_on_incline]\nheight_mm = 1\n", ["height_mm", "layer_height_mm"]),
    "a possible range turned round": ("[possible.layer_on_incline]\nlayer_height_mm = { min = 9, max = 1 }\n", ["min 9", "max 1"]),
    "a possible height of zero": ("[possible.layer_on_incline]\nlayer_height_mm = 0\n", ["layer_height_mm", "more than 0"]),
    "possible that is no table": ("possible = 1\n", ["possible", "table"]),
    "a parameter without its effect": ("[parameters]\npowder_surface_energy = 0.1\n", ["powder_surface_energy"]),
    "more free parameters than rows": (
        TOML + "[effects]\ncohesion = { cohesive_stress_pa = { min = 0, max = 100 } }\n"
        "side_wall_friction = { wall_friction = { min = 0, max = 1 } }\nfinite_thickness = {}\n",
        ["free parameters", "3 different cases"],
    ),
    "a key of 20000 parts": ("a." * 20000 + "a = 1\n", ["no valid TOML", "more than 8 parts"]),
    "a heading of 20000 parts": ("[" + "a . " * 20000 + "a]\n", ["no valid TOML", "more than 8 parts"]),
    "a quoted key of 20000 parts": ('"a".' * 20000 + "a = 1\n", ["no valid TOML", "more than 8 parts"]),
    "10000 brackets": ("title = " + "[" * 10000 + "]" * 10000 + "\n", ["no valid TOML"]),
    "two million letters": ('title = "' + "a" * 2_000_000 + '"\n', ["at most 1000000 bytes"]),
    "bytes that are no text": (b"\xff\xfe\x00", ["UTF-8"]),
}  # fmt: skip


def folder(path: Path, toml: str | bytes = TOML, rows: str | bytes = ROWS) -> Path:
    path.mkdir()
    for name, text in (("study.toml", toml), ("measurements.csv", rows)):
        (path / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def seen(path: Path) -> dict:
    """Everything below a folder."""
    return {file: file.lstat().st_mtime_ns for file in path.rglob("*")}


def refused(path: Path, capsys, words, command: str = "compare") -> str:
    """The study is refused in the way that is promised."""
    before = seen(path)
    status = main([command, str(path)])
    said = capsys.readouterr()
    assert status == 2, said
    assert said.out == "" and "Traceback" not in said.err and len(said.err.strip().splitlines()) == 1, said.err
    for word in words:
        assert word in said.err
    assert seen(path) == before
    return said.err


@pytest.mark.parametrize("case", MEASUREMENTS)
def test_measurements_are_refused(tmp_path, capsys, case):
    rows, words = MEASUREMENTS[case]
    refused(
        folder(tmp_path / "study", rows=rows),
        capsys,
        words if case.startswith("all rows") else ["measurements.csv", *words],
    )


@pytest.mark.parametrize("case", STUDY)
def test_studies_are_refused(tmp_path, capsys, case):
    toml, words = STUDY[case]
    refused(folder(tmp_path / "study", toml), capsys, words)


def test_there_are_enough_of_them():
    assert len(MEASUREMENTS) + len(STUDY) >= 100


@pytest.mark.parametrize("command", ["compare", "diagnose", "refine", "bench", "history"])
def test_every_command_refuses_alike(tmp_path, capsys, command):
    refused(folder(tmp_path / "study", rows=cells(row=ROW.replace("30", "x"))), capsys, ["line 2", "'x'"], command)


@pytest.mark.parametrize(
    "change",
    [
        lambda text: "\ufeff" + text,
        lambda text: text.replace("\n", "\r\n"),
        lambda text: "\ufeff" + text.replace("\n", "\r\n"),
        lambda text: text.replace("\n", "\r"),
        lambda text: text.rstrip("\n"),
        lambda text: text.replace("\n", "\n\n") + "\n , , , \n",
        lambda text: text.replace(",", " , "),
        lambda text: text.replace("layer_on_incline", '"layer_on_incline"'),
    ],
    ids=["BOM", "CRLF", "BOM and CRLF", "CR", "no last newline", "blank lines", "blanks", "quotes"],
)
def test_other_ways_to_write_the_same_are_accepted(tmp_path, change):
    one = load(folder(tmp_path / "one"))
    toml = change(TOML) if change("\n") in ("\ufeff\n", "\r\n", "\ufeff\r\n") else TOML
    other = load(folder(tmp_path / "other", toml, change(ROWS)))
    assert [(r.value, r.conditions) for r in other.rows] == [(r.value, r.conditions) for r in one.rows]
    assert other.parameters == one.parameters


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace(",", ";").replace(".", ",").encode(),
        lambda text: text.replace(",", "\t").encode(),
        lambda text: ("sep=;\r\n" + text.replace(",", ";").replace("\n", ";;\r\n") + ";;;;;\r\n").encode(),
        lambda text: text.encode("utf-16"),
        lambda text: text.replace(",", ";").replace(".", ",").encode("utf-16"),
        lambda text: (text.replace("\n", ",note\n", 1).replace("30.5,20", "30.5,20,堆积角测量")).encode("gbk"),
        lambda text: text.replace("30.5", '"30,5"').encode(),
    ],
    ids=["semicolons", "tabs", "sep=", "UTF-16", "UTF-16 and semicolons", "GBK", "quoted decimal commas"],
)
def test_what_other_programs_write_is_read(tmp_path, change):
    row = ROW.replace("30", "30.5")
    text = f"{HEAD}\n{row}\n"
    path = folder(tmp_path / "study", rows=text)
    (path / "measurements.csv").write_bytes(change(text))
    rows = load(path).rows
    assert [(r.value, r.conditions["layer_height_mm"]) for r in rows] == [(30.5, 20.0)]


def test_a_workbook_of_measurements_is_read(tmp_path):
    from openpyxl import Workbook

    path = folder(tmp_path / "study", TOML.replace("[", 'measurements = "readings.xlsx"\n[', 1))
    book = Workbook()
    for row in ([*HEAD.split(","), "sd"], ["layer_on_incline", "slip_angle_deg", 30.5, 20, "#N/A"]):
        book.active.append(row)
    book.save(path / "readings.xlsx")
    row = load(path).rows[0]
    assert (row.value, row.conditions["layer_height_mm"], row.sd) == (30.5, 20.0, None)


def test_notes_keep_what_was_written(tmp_path):
    note = '<b onclick="x()">50 % &amp; more</b>, \u2028 "quoted"; two\nlines'
    quoted = '"' + note.replace('"', '""') + '"'
    rows = read(
        folder(tmp_path / "s", rows=f"{HEAD},note\n{ROW},{quoted}\n{ROW},\n") / "measurements.csv", catalogue.standard()
    )
    assert rows[0].note == note
    assert [row.line for row in rows] == [2, 4]


def test_a_million_rows_are_accepted(tmp_path):
    file = tmp_path / "measurements.csv"
    with open(file, "w") as stream:
        stream.write(HEAD + "\n")
        stream.writelines(f"layer_on_incline,slip_angle_deg,30,{8 + k % 50}\n" for k in range(10**6))
    rows = read(file, catalogue.standard())
    assert len(rows) == 10**6 and rows[-1].line == 10**6 + 1 and rows[-1].conditions["layer_height_mm"] == 57.0


@pytest.mark.parametrize("name", ["study.toml", "measurements.csv"])
def test_a_line_of_a_gigabyte_is_refused_unread(tmp_path, capsys, name):
    path = folder(tmp_path / "study", rows=ROWS + "a" * 2_000_000)
    os.truncate(path / name, 10**9)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    refused(path, capsys, ["line 5: longer than 1000000"] if name.endswith("csv") else ["at most 1000000 bytes"])
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 100_000  # kB


def test_links_in_a_circle(tmp_path, capsys):
    path = folder(tmp_path / "study")
    (path / "measurements.csv").unlink()
    (path / "measurements.csv").symlink_to("again.csv")
    (path / "again.csv").symlink_to("measurements.csv")
    refused(path, capsys, ["measurements"])


def test_a_link_out_of_the_study(tmp_path, capsys):
    path = folder(tmp_path / "study")
    (path / "measurements.csv").rename(tmp_path / "elsewhere.csv")
    (path / "measurements.csv").symlink_to("../elsewhere.csv")
    refused(path, capsys, ["measurements.csv", "outside the study"])


@pytest.mark.parametrize("name", ["study.toml", "measurements.csv"])
def test_a_pipe_is_not_waited_for(tmp_path, capsys, name):
    path = folder(tmp_path / "study")
    (path / name).unlink()
    os.mkfifo(path / name)
    refused(path, capsys, [name, "expected a"])


def test_no_study_at_all(tmp_path, capsys):
    for path in (tmp_path / "nowhere", tmp_path / "file"):
        (tmp_path / "file").touch()
        assert main(["compare", str(path)]) == 2
        assert str(path) in capsys.readouterr().err


OWN = """
EFFECT = {
    "name": "suction", "means": "m", "formula": "f", "sides": 1, "rigs": {"layer_on_incline": "everywhere"},
    "parameters": {"stress_pa": {"absent": 0.0, "min": 0.0, "max": 900.0, "unit": "Pa", "meaning": "s"}},
    "signature": "s", "source": "this test",
}
CLOSED_FORM = {"layer_on_incline": lambda shear, normal, conditions, values: shear + values["stress_pa"]}
"""


def test_code_of_the_studys_own_is_named_when_it_is_run_and_leaves_nothing(tmp_path):
    path = folder(tmp_path / "study")
    (path / "effects").mkdir()
    (path / "effects" / "suction.py").write_text(OWN)
    found = subprocess.run([sys.executable, "-m", "pellet_study", "diagnose", path], capture_output=True, text=True)
    assert found.returncode == 0, found.stderr
    assert f"running {path / 'effects' / 'suction.py'}, code of the study's own" in found.stderr
    assert "suction" in found.stdout
    assert [file.name for file in (path / "effects").iterdir()] == ["suction.py"]


@pytest.mark.parametrize("linked", ["effects", "effects/suction.py"])
def test_code_from_outside_the_study_is_not_run(tmp_path, capsys, linked):
    path, other = folder(tmp_path / "study"), tmp_path / "other"
    (other / "effects").mkdir(parents=True)
    (other / "effects" / "suction.py").write_text(OWN + "raise SystemExit('it was run')\n")
    (path / linked).parent.mkdir(exist_ok=True)
    (path / linked).symlink_to(other / linked)
    assert "it was run" not in refused(path, capsys, ["suction.py", "from the study's folder only"])


@pytest.mark.parametrize(
    "text, words",
    [
        ("EFFECT = {", ["suction.py", "SyntaxError"]),
        ("\nEFFECT = {}\n", ["suction.py", "EFFECT lacks name"]),
        (OWN + "raise SystemExit(0)\n", ["suction.py", "SystemExit"]),
        (OWN + "1 / 0\n", ["suction.py", "ZeroDivisionError"]),
        (OWN.replace('"max": 900.0', '"max": -1.0'), ["suction.py", "stress_pa", "min"]),
        (OWN.replace('"min": 0.0, ', ""), ["suction.py", "stress_pa", "lacks min"]),
        (OWN.replace('"parameters": {', '"parameters": 3, "p": {'), ["suction.py"]),
        (
            OWN.replace('"parameters": {', '"parameters_in": {"rebound": {}}, "parameters": {'),
            ["suction.py", "rebound", "one file"],
        ),
    ],
)
def test_code_of_the_studys_own_that_is_broken(tmp_path, capsys, text, words):
    path = folder(tmp_path / "study")
    (path / "effects").mkdir()
    (path / "effects" / "suction.py").write_text(text)
    before = seen(path)
    assert main(["compare", str(path)]) == 2
    said = capsys.readouterr().err
    assert "Traceback" not in said and all(word in said for word in words), said
    assert seen(path) == before


SCENE = """
def friction(mu, load, values):
    return mu + values["stress_pa"]


"""


def own_act(text: str) -> str:
    """OWN with another `act`, defined before it is used."""
    declaration, used = OWN.split("CLOSED_FORM")[0], 'CLOSED_FORM = {"layer_on_incline": act}\n'
    return f"{declaration}\n\ndef act(shear, normal, conditions, values):\n    return {text}\n\n\n{used}"


@pytest.mark.parametrize(
    "text, words",
    [
        (own_act("shear + values['stres_pa']"), ["suction.py: line 10", "'stres_pa'", "did you mean 'stress_pa'"]),
        (own_act("shear + values['stress_pa'] * conditions['height_mm']"), ["line 10", "'height_mm'", "layer_height_mm"]),
        (own_act("shear + values['stress_pa'] / 0 * 'a'"), ["line 10", "TypeError"]),
        (own_act("5.0"), ["suction.py: act", "a single float"]),
        (own_act("(shear + values['stress_pa'])[0, :1].repeat(5)"), ["suction.py: act", "array of shape (5,)"]),
        (own_act("None"), ["suction.py: act", "NoneType"]),
        (own_act("shear + (values['stress_pa'] - 1.0) ** 0.5"), ["suction.py: act", "is not a number at", "stress_pa 0"]),
        (own_act("shear + 10 + values['stress_pa']"), ["suction.py", "not inert", "stress_pa = 0", "slip_angle_deg"]),
        (OWN.replace('"layer_on_incline": "everywhere"', '"layer_on_inclin": "x"'), ["did you mean 'layer_on_incline'"]),
        (OWN.replace('CLOSED_FORM = {"layer_on', 'CLOSED_FORM = {"layers_on'), ["CLOSED_FORM", "did you mean 'layer_on"]),
        (OWN.replace('": "everywhere"', '": "", "shear_cell": ""'), ["shear_cell", "add CLOSED_FORM = {\"shear_cell\""]),
        (OWN.replace('": "everywhere"', '": "", "slope_slip": ""'), ["slope_slip", "no SEED_SCENE", "friction", "reading"]),
        (OWN.replace('": "everywhere"', '": "", "repose": ""'), ["repose", "no POWDER_SCENE", "wall_pair"]),
        (
            OWN.replace('": "everywhere"', '": "", "slope_slip": ""') + SCENE + 'SEED_SCENE = {"frction": friction}\n',
            ["suction.py: SEED_SCENE", "'frction'", "did you mean 'friction'"],
        ),
        (
            OWN.replace('": "everywhere"', '": "", "repose": ""') + SCENE + 'POWDER_SCENE = {"wallpair": friction}\n',
            ["suction.py: POWDER_SCENE", "'wallpair'", "did you mean 'wall_pair'"],
        ),
        (OWN + SCENE + 'SEED_SCENE = {"friction": friction}\n', ["SEED_SCENE acts in none of the rigs"]),
    ],
)  # fmt: skip
def test_an_effect_of_ones_own_that_does_not_act_as_it_says(tmp_path, capsys, text, words):
    path = folder(tmp_path / "study")
    (path / "effects").mkdir()
    (path / "effects" / "suction.py").write_text(text)
    refused(path, capsys, words)


RIG = """
RIG = {
    "name": "pad", "observables": {"slip_stress_pa": "t"},
    "parameters": {"mu": {"default": 0.4, "min": 0.0, "max": 2.0, "unit": "1", "meaning": "m"}},
    "conditions": {"load_pa": {"default": 9.0, "min": 1.0, "max": 99.0, "unit": "Pa", "meaning": "l"}},
}


def predict(parameters, conditions, effects):
    return {"slip_stress_pa": parameters["mu"] * conditions["load_pa"]}
"""


@pytest.mark.parametrize(
    "old, new, words",
    [
        ('{"slip_stress_pa": par', '{"slip_stress": par', ["pad.py: predict returned slip_stress", "slip_stress_pa"]),
        ('conditions["load_pa"]}', 'conditions["lod_pa"]}', ["pad.py: line 10", "'lod_pa'", "did you mean 'load_pa'"]),
        ('{"slip_stress_pa": par', '{"slip_stress_pa": 1.0} or {1: par', ["pad.py: predict", "a single float"]),
        ('return {"slip_stress_pa": ', 'return dict([1]) or {"slip_stress_pa": ', ["pad.py: line 10", "TypeError"]),
        (
            'conditions["load_pa"]}',
            '(conditions["load_pa"] - 8) ** 0.5}',
            ["pad.py", "is not a number at", "load_pa 7"],
        ),
        ('"default": 9.0, ', "", ["pad.py: load_pa lacks default"]),
        ('"default": 0.4', '"default": 3.0', ["pad.py: mu: expected min <= default <= max"]),
        ('{"slip_stress_pa": "t"}', '["slip_stress_pa"]', ["pad.py: observables", "name: meaning"]),
        ("def predict", "def predicts", ["pad.py: has neither predict", "nor", "simulate"]),
        (
            "def predict(",
            "def simulate(case): pass\n\n\ndef other(",
            ["pad.py: RIG lacks contact_laws, effects, numerics"],
        ),
    ],
)
def test_a_rig_of_ones_own_that_does_not_answer_as_it_says(tmp_path, capsys, old, new, words):
    path = folder(tmp_path / "study")
    (path / "rigs").mkdir()
    (path / "rigs" / "pad.py").write_text(RIG)
    (path / "measurements.csv").write_text(
        "rig,observable,value,load_pa\npad,slip_stress_pa,3,7\npad,slip_stress_pa,4,9\n"
    )
    (path / "study.toml").write_text("[parameters]\nmu = { min = 0.1, max = 1.0 }\n")
    load(path)
    (path / "rigs" / "pad.py").write_text(RIG.replace(old, new))
    refused(path, capsys, words)


# Property-based: whatever the files hold, they are read or refused with InputError, and nothing else happens.

WORDS = st.sampled_from(
    [*HEAD.split(","), "sd", "n", "split", "note", "setup", "setup_sd", "internal_friction", "shear_cell", "fit", "holdout"]
    + ["layer_on_incline", "slip_angle_deg", "", "0", "-1", "1e308", "nan", "inf", "٣", "1_000", "0x10", '"', "\ufeff", " "]
)  # fmt: skip
CELL = st.one_of(WORDS, st.text(max_size=12), st.floats().map(repr), st.integers().map(str))
LINES = st.lists(st.lists(CELL, max_size=8).map(",".join), max_size=8).map("\n".join)
NICE = st.lists(
    st.tuples(st.floats(0, allow_nan=False, allow_infinity=False), st.floats(1e-300, 1e300), st.integers(1, 10**9)),
    min_size=1,
)


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(text=st.one_of(LINES, LINES.map(lambda rest: f"{HEAD},sd,n,split\n{rest}"), st.binary(max_size=300)))
def test_any_measurements_are_read_or_refused(tmp_path, text):
    file = tmp_path / "measurements.csv"
    file.write_bytes(text if isinstance(text, bytes) else text.encode(errors="surrogatepass"))
    try:
        rows = read(file, catalogue.standard())
    except InputError as error:
        assert str(file) in str(error) and "\n" not in str(error)
    else:
        assert rows and all(row.value == row.value and row.n >= 1 and (row.sd is None or row.sd > 0) for row in rows)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(given_rows=NICE)
def test_good_measurements_are_read_to_the_last_digit(tmp_path, given_rows):
    file = tmp_path / "measurements.csv"
    lines = [f"shear_cell,shear_stress_pa,{value!r},{stress!r},{n}" for value, stress, n in given_rows]
    file.write_text("\n".join(["rig,observable,value,normal_stress_pa,n", *lines]))
    found = [(row.value, row.conditions["normal_stress_pa"], row.n) for row in read(file, catalogue.standard())]
    assert found == given_rows


KEYS = st.sampled_from(
    [*KEYS, "internal_friction", "cohesion", "cohesive_stress_pa", "value", "min", "max", "layer_on_incline", "layer_height_mm"]
)  # fmt: skip
SCALAR = st.one_of(
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=8),
    st.sampled_from(["measurements.csv", "../x", "cohesion"]),
)
VALUE = st.recursive(
    SCALAR, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=3), max_leaves=6
)


def toml(value) -> str:
    """A value as TOML."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {toml(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return '"' + "".join(f"\\U{ord(c):08x}" for c in value if not 0xD800 <= ord(c) < 0xE000) + '"'
    return repr(value)


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(whole=st.dictionaries(KEYS, VALUE, max_size=4))
def test_any_study_is_read_or_refused(tmp_path, whole):
    path = tmp_path / "study"
    if not path.exists():
        folder(path)
    (path / "study.toml").write_text("\n".join(f"{key} = {toml(value)}" for key, value in whole.items()))
    try:
        found = load(path)
    except InputError as error:
        assert str(path) in str(error) and "\n" not in str(error)
    else:
        assert len(found.rows) == 3


@pytest.mark.parametrize(
    "words, expected",
    [
        (["bbd", "--design", "B=0,7,0,9", "C=0,25,0,45", "G=0,1,0,3"], ["B=0,7,0,9", "4 fields", "decimal points"]),
        (["pb", "--design", "A=0,7,0", "B=1,2"], ["A=0,7,0", "decimal points"]),
        (["pb", "--design", "A=1_0,20", "B=1,2"], ["A=1_0,20", "not understood"]),
        (["pb", "--design", "A=1e-300,1", "B=1,2"], ["A=1e-300,1"]),
        (["bbd", "{table}", "--factor", "A=0,90,0,82"], ["A=0,90,0,82", "4 fields", "decimal points"]),
        (["bbd", "{table}", "--target", "5", "--verify", "41,1,41,5,40,9"], ["--verify", "41,1;41,5;40,9"]),
        (["bbd", "{table}", "--target", "5", "--verify", "4_1,4_2"], ["--verify 4_1,4_2", "numbers"]),
        (["bbd", "{huge}"], ["column 'y'", "row 2", "1e+60"]),
        (["bbd", "{small}"], ["column 'y'", "row 2", "1e-60"]),
    ],
)
def test_numbers_of_designs_are_refused(tmp_path, capsys, words, expected):
    coded = [(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1)] + [(0, 0)]
    tables = {name: tmp_path / f"{name}.csv" for name in ("table", "huge", "small")}
    for file, power in zip(tables.values(), ("", "e200", "e-200"), strict=True):
        rows = [f"{5 + a},{7 + b},{5 + a + 0.1 * b * k}{power}" for k, (a, b) in enumerate(coded)]
        file.write_text("A,B,y\n" + "\n".join(rows) + "\n")
    assert main([word.format(**tables) for word in words]) == 2
    said = capsys.readouterr()
    assert said.out == "" and "Traceback" not in said.err
    for word in expected:
        assert word in said.err


@pytest.mark.parametrize("option", ["--target", "--uncertainty", "--alpha"])
@pytest.mark.parametrize("word", ["1_0", "nan", "inf", "0,5", "1e300", "five"])
def test_an_option_is_a_finite_number_with_a_point(tmp_path, capsys, option, word):
    coded = [(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1)] + [(0, 0)]
    rows = [f"{5 + a},{7 + b},{5 + a + 0.1 * b * k}" for k, (a, b) in enumerate(coded)]
    (tmp_path / "t.csv").write_text("A,B,y\n" + "\n".join(rows) + "\n")
    target = [] if option == "--target" else ["--target", "5"]
    try:
        status = main(["bbd", str(tmp_path / "t.csv"), *target, f"{option}={word}"])
    except SystemExit as ended:  # argparse's own
        status = ended.code
    said = capsys.readouterr().err
    assert status == 2 and word in said and "expected" in said


def test_levels_and_responses_keep_their_digits_whatever_their_unit(tmp_path, capsys):
    """A Hamaker constant in J beside one in 1e-20 J: the same design, the same analysis."""
    designs = []
    for low, high in (("1e-20", "9e-20"), ("1", "9")):
        assert main(["pb", "--design", f"H={low},{high}", "B=0.7,0.9", "G=0.1,0.3", "--runs", "8", "--seed", "1"]) == 0
        designs.append([line.split(",") for line in capsys.readouterr().out.splitlines()[1:]])
    assert {row[2] for row in designs[0]} == {"1e-20", "9e-20"} and {row[2] for row in designs[1]} == {"1.0", "9.0"}
    answers = []
    for unit, scale in (("1e-20", 1e-12), ("1", 1.0)):
        rows = [f"{float(row[2]) * (1e-20 if unit != '1' else 1)},{row[3]},{row[4]}," for row in designs[1]]
        noise = [0.3, -0.1, 0.2, 0.0, -0.4, 0.1, 0.25, -0.2]
        rows = [
            f"{row}{scale * (5 + 0.4 * float(given[2]) + e):.6g}"
            for row, given, e in zip(rows, designs[1], noise, strict=True)
        ]
        (tmp_path / f"{unit}.csv").write_text("H,B,G,y\n" + "\n".join(rows) + "\n")
        file = tmp_path / f"{unit}.json"
        assert main(["pb", str(tmp_path / f"{unit}.csv"), "--json", str(file)]) == 0
        answers.append(json.loads(file.read_text())["effects"])
    capsys.readouterr()
    assert answers[1]["H"] == pytest.approx(3.2, abs=0.5)
    for name in "HBG":
        assert answers[0][name] / 1e-12 == pytest.approx(answers[1][name], rel=1e-4)


def test_an_answer_never_holds_a_number_that_is_none(tmp_path):
    with pytest.raises(InputError, match=r"no finite number at rows\.1\.z"):
        writing.json(tmp_path / "a.json", {"rows": [{"z": 1.0}, {"z": float("nan")}]})
    assert not (tmp_path / "a.json").exists()
