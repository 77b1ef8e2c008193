"""The repose angle from photographs whose angle is known because they were drawn, or from simulated grains."""

import csv
import io
import json

import numpy as np
import pytest
from PIL import Image

from pellet_study.__main__ import main
from pellet_study.heap import photograph, render
from tests import ROOT
from tests.helpers.heap_photographs import TONES, draw, random_heap
from yade_scripts import heap

pytest.importorskip("skimage", reason="scikit-image is not installed: pip install -e .[test]")
IMAGES = 200
HEAP = ROOT / "results" / "checks" / "heap_on_a_plate.csv"


def saved(pixels, file):
    Image.fromarray(np.uint8(np.round(255 * pixels))).save(file)
    return file


def test_two_hundred_pictures_with_noise_blur_uneven_light_tilt_and_texture():
    """The right angle is the mean of both flanks, which differ by up to 8 deg: no isosceles triangle is as near to it."""
    found = {"flanks": [], "triangle": []}
    for seed in range(IMAGES):
        picture, angle = random_heap(seed)
        try:
            read = photograph.find(picture)
        except heap.NoHeap:
            for errors in found.values():
                errors.append((np.inf, 1.0))  # refused: as wrong as any
            continue
        apart = (read.flanks.left.angle_deg - read.flanks.right.angle_deg) / 2  # as drawn, and in the errors too
        for name, error in (("flanks", read.flank_error_deg), ("triangle", read.triangle_error_deg)):
            found[name].append((getattr(read, name).angle_deg - angle, np.sqrt(error**2 - apart**2)))
    for reading, nearest in (("flanks", 0.5), ("triangle", 1.2)):
        errors, uncertainties = np.abs(found[reading]).T
        assert (errors <= nearest).mean() >= 0.95, reading
        assert (errors <= 2 * uncertainties).mean() >= 0.9, reading
        assert np.median(uncertainties) < nearest / 2, reading  # and it is not merely large


@pytest.mark.parametrize("tones", TONES)
def test_both_flanks_and_the_tilt(tones):
    found = photograph.find(draw(45.0, 33.0, tones=tones, tilt_deg=3.0, seed=1))
    assert found.flanks.left.angle_deg == pytest.approx(45, abs=0.7)
    assert found.flanks.right.angle_deg == pytest.approx(33, abs=0.7)
    assert found.base.tilt_deg == pytest.approx(3, abs=0.3)
    assert found.base_is == ("heap's foot" if tones == "no plate" else "plate's edge")


def test_a_horizon_that_is_given_counts():
    found = photograph.find(draw(40.0, 40.0, tilt_deg=0.0), horizon_deg=4.0)
    assert found.flanks.left.angle_deg == pytest.approx(36, abs=0.5)
    assert found.flanks.right.angle_deg == pytest.approx(44, abs=0.5)
    assert found.base.tilt_deg == pytest.approx(4) and found.base_is == "--horizon"


def grains_of_a_cone(angle_deg: float, seed: int = 0):
    """Grains at random places in a cone of base radius 1, more than fill it."""
    rng = np.random.default_rng(seed)
    height = np.tan(np.radians(angle_deg))
    place = rng.uniform((-1, -1, 0), (1, 1, height), (60_000, 3))
    return place[place[:, 2] < height * (1 - np.hypot(place[:, 0], place[:, 1]))], 0.02


@pytest.mark.parametrize("angle", (28.0, 41.69))
def test_a_rendered_heap_has_the_angle_of_its_grains(angle):
    centres, radius = grains_of_a_cone(angle)
    radii = np.full(len(centres), radius)
    azimuth = 0.4
    x, height = heap.silhouette(centres, radii, azimuth + np.pi / 2)
    image = render.picture(
        centres, radii, width=480, azimuth_deg=np.degrees(azimuth), elevation_deg=0, plate=None, margin=0.15
    )
    found = photograph.find(image)
    assert found.flanks.angle_deg == pytest.approx(heap.fit_flanks(x, height).angle_deg, abs=0.5)
    assert found.flanks.angle_deg == pytest.approx(angle, abs=1.0)
    assert found.triangle.angle_deg == pytest.approx(heap.fit_triangle(x, height).angle_deg, abs=0.5)
    assert found.triangle.angle_deg == pytest.approx(angle, abs=1.5)


def two_heaps():
    left = draw(middle=0.28, width=0.36, texture=0, noise=0)
    right = draw(middle=0.74, width=0.36, texture=0, noise=0)
    return np.maximum(left, right)


def touching_heaps():
    left = draw(middle=0.35, width=0.36, texture=0, noise=0)
    right = draw(middle=0.62, width=0.36, texture=0, noise=0)
    return np.maximum(left, right)


BAD = {
    "cut off left": (lambda: draw(middle=0.2), "cut off at the left"),
    "cut off right": (lambda: draw(middle=0.8), "cut off at the right"),
    "cut off above": (lambda: draw(60.0, 60.0, width=0.75), "cut off at the upper"),
    "cut off below": (lambda: draw(tones="no plate", floor=1.1), "cut off at the lower"),
    "no heap": (lambda: draw(heap=False), "no heap"),
    "one tone": (lambda: np.full((320, 480, 3), 0.5), "no heap"),
    "noise": (lambda: np.random.default_rng(0).random((320, 480, 3)), "heap"),
    "two heaps": (two_heaps, "two heaps"),
    "two that touch": (touching_heaps, "two heaps"),
    "low contrast": (lambda: 0.5 + 0.03 * draw(noise=0.3), "no heap stands out"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_cannot_be_measured_is_said(name, tmp_path, capsys):
    make, reason = BAD[name]
    file = saved(np.clip(make(), 0, 1), tmp_path / "photo.png")
    assert main(["angle", str(file), "--figures", str(tmp_path / "overlays")]) == 2
    said = capsys.readouterr().err
    assert reason in said and "photo.png" in said and "Traceback" not in said
    assert not (tmp_path / "overlays").exists()


@pytest.mark.parametrize("name", ("text.jpg", "cut.png", "empty.png", "folder", "missing.png", "tiny.png"))
def test_a_picture_that_is_no_picture(name, tmp_path, capsys):
    file = tmp_path / name
    if name == "text.jpg":
        file.write_text("not a picture")
    elif name == "cut.png":
        whole = saved(draw(), tmp_path / "whole.png").read_bytes()
        file.write_bytes(whole[: len(whole) // 2])
    elif name == "empty.png":
        file.touch()
    elif name == "folder":
        file.mkdir()
    elif name == "tiny.png":
        saved(np.zeros((20, 20, 3)), file)
    assert main(["angle", str(file), "--figures", str(tmp_path / "overlays")]) == 2
    assert name in capsys.readouterr().err


@pytest.mark.parametrize("mode", ("L", "RGBA", "P", "I;16"))
def test_other_kinds_of_picture(mode, tmp_path):
    pixels = draw(40.0, 40.0)
    file = tmp_path / "photo.png"
    if mode == "I;16":
        Image.fromarray(np.uint16(65535 * pixels.mean(axis=2))).save(file)
    else:
        Image.fromarray(np.uint8(255 * pixels)).convert(mode).save(file)
    assert photograph.measure(file).angle_deg == pytest.approx(40, abs=0.5)


def test_a_picture_lying_on_its_side_is_turned_as_its_camera_says(tmp_path):
    turned = Image.fromarray(np.uint8(255 * draw(40.0, 40.0))).transpose(Image.Transpose.ROTATE_90)
    exif = Image.Exif()
    exif[0x0112] = 6  # to be shown turned by 90 deg clockwise
    turned.save(tmp_path / "photo.jpg", exif=exif, quality=95)
    assert photograph.measure(tmp_path / "photo.jpg").angle_deg == pytest.approx(40, abs=0.5)


def test_several_photographs_make_a_row_for_measurements(tmp_path, capsys):
    angles = (38.0, 40.0, 42.0)
    files = [saved(draw(a, a, seed=k), tmp_path / f"heap {k}.png") for k, a in enumerate(angles)]
    (tmp_path / "other").mkdir()
    files.append(saved(draw(40.0, 40.0, seed=9), tmp_path / "other" / "heap 0.png"))
    file, overlays = tmp_path / "a.json", tmp_path / "overlays"
    assert main(["angle", *map(str, files), "--figures", str(overlays), "--json", str(file)]) == 0
    answer = json.loads(file.read_text())
    assert answer["angle_deg"] == pytest.approx(40, abs=0.3)
    assert answer["sd"] == pytest.approx(np.std([38, 40, 42, 40], ddof=1), abs=0.3)
    assert answer["flank_deg"] == pytest.approx(40, abs=0.3) and answer["triangle_deg"] == answer["angle_deg"]
    assert all(abs(p["flank_deg"] - p["triangle_deg"]) < 0.5 for p in answer["photos"])
    assert len(answer["photos"]) == 4
    drawn = [p["overlay"] for p in answer["photos"]]
    assert len(set(drawn)) == 4 and all(Image.open(d).width > 600 for d in drawn)
    printed = capsys.readouterr().out
    assert all(len(line) <= 80 for line in printed.splitlines() if "results" not in line)
    table = printed[printed.index("rig,observable") :].splitlines()[:2]
    row = next(csv.DictReader(io.StringIO("\n".join(table))))
    assert row["rig"] == "repose" and row["observable"] == "repose_angle_deg" and row["n"] == "4"
    assert float(row["value"]) == pytest.approx(answer["angle_deg"], abs=0.01)
    assert float(row["sd"]) == pytest.approx(answer["sd"], rel=0.01)
    assert f"repose,repose_flank_deg,{answer['flank_deg']:.4g}," in printed


def test_one_photograph_has_no_scatter(tmp_path, capsys):
    file, answer = saved(draw(), tmp_path / "heap.png"), tmp_path / "a.json"
    assert main(["angle", str(file), "--figures", str(tmp_path / "o"), "--json", str(answer)]) == 0
    assert json.loads(answer.read_text())["sd"] is None
    assert "not known" in capsys.readouterr().out


def test_a_horizon_that_cannot_be_is_refused(tmp_path, capsys):
    file = saved(draw(), tmp_path / "heap.png")
    assert main(["angle", str(file), "--horizon", "80"]) == 2
    assert "--horizon" in capsys.readouterr().err


def test_without_scikit_image_it_says_what_to_install(tmp_path, monkeypatch, capsys):
    import sys

    file = saved(draw(), tmp_path / "heap.png")
    monkeypatch.setitem(sys.modules, "skimage", None)
    assert main(["angle", str(file)]) == 2
    assert "pellet-study[angle]" in capsys.readouterr().err


def test_pictures_of_a_simulated_heap_read_the_angle_of_its_grains(tmp_path):
    """A heap that YADE made of powder on a plate (release 0.1), pictured level from six sides."""
    centres, radii = render.read_grains(HEAP)
    centres, radii = heap.body(centres, radii)
    of_grains = heap.readings(centres, radii)
    flanks, triangles = [], []
    for azimuth in range(0, 180, 30):
        picture = render.picture(centres, radii, azimuth_deg=azimuth, elevation_deg=0, width=700)
        read = photograph.measure(saved(picture, tmp_path / "heap.png"))
        flanks.append(read.flanks.angle_deg)
        triangles.append(read.triangle.angle_deg)
    assert np.mean(flanks) == pytest.approx(of_grains.flank.angle_deg, abs=0.5)
    assert np.mean(triangles) == pytest.approx(of_grains.triangle.angle_deg, abs=0.5)


def test_a_heap_seen_from_above_is_doubted_and_gives_no_row(tmp_path, capsys):
    assert main(["angle", str(HEAP.parent / "figures" / "heap_on_a_plate.png"), "--figures", str(tmp_path)]) == 0
    told = capsys.readouterr()
    assert "seen from above" in told.err and "no row for measurements.csv" in told.out
    assert "rig,observable" not in told.out


def test_grains_are_read_three_ways_on_a_plate_and_on_a_disc(tmp_path, capsys):
    file = tmp_path / "a.json"
    assert main(["angle", str(HEAP), "--json", str(file)]) == 0
    on_plate, said = json.loads(file.read_text()), capsys.readouterr().out
    found = heap.readings(*render.read_grains(HEAP))
    (one,) = on_plate["heaps"]
    for name, reading in zip(("flank", "triangle", "moment"), found[:3], strict=True):
        assert one[f"{name}_deg"] == pytest.approx(reading.angle_deg)
        assert one[f"{name}_error_deg"] == pytest.approx(reading.standard_error_deg)
        assert f"{name} {reading.angle_deg:.2f} +- {reading.standard_error_deg:.2f} deg" in said
    assert on_plate["angle_deg"] == pytest.approx(found.repose.angle_deg)
    assert main(["angle", str(HEAP), "--base-diameter", "50", "--json", str(file)]) == 0
    on_disc = heap.readings(*render.read_grains(HEAP), 0.025)
    assert json.loads(file.read_text())["heaps"][0]["moment_deg"] == pytest.approx(on_disc.moment.angle_deg)


def test_a_layer_of_grains_has_no_flank_and_says_why(tmp_path, capsys):
    place = 2e-3 * np.stack([*np.ndindex(9, 9)])
    table = np.column_stack([place, np.full((81, 2), 1e-3)])
    np.savetxt(tmp_path / "g.csv", table, delimiter=",", header="x_m,y_m,z_m,radius_m", comments="")
    file = tmp_path / "a.json"
    assert main(["angle", str(tmp_path / "g.csv"), "--json", str(file)]) == 0
    (one,) = json.loads(file.read_text())["heaps"]
    assert one["flank_deg"] is None and one["angle_deg"] == 0
    assert "no flank (" in capsys.readouterr().out


@pytest.mark.parametrize(
    "arguments", [[str(HEAP), "--base-diameter", "0"], [str(HEAP), "--base-diameter", "nan"], ["photo.png", "--base-diameter", "50"]]
)  # fmt: skip
def test_a_base_that_cannot_be_is_refused(arguments, capsys):
    try:
        status = main(["angle", *arguments])
    except SystemExit as refused:  # what is no number is refused with the usage
        status = refused.code
    assert status == 2 and "--base-diameter" in capsys.readouterr().err
