"""Inputs that are no regular files, or far too large: refused at once, in a process of its own that may be stopped."""

import json
import os
import resource
import struct
import subprocess
import sys
import time
import zlib
from pathlib import Path

import pytest

from tests.faults.driver import ROOT, paragraph
from tests.helpers.make_study import incline

PATIENCE_S = 60.0


def answered(*words, memory_mb: int | None = None) -> subprocess.CompletedProcess:
    """`pellet-study ...` with a time limit and, where given, a limit of memory."""

    def limit():
        if memory_mb:
            resource.setrlimit(resource.RLIMIT_AS, (memory_mb << 20, memory_mb << 20))

    return subprocess.run(
        [sys.executable, "-m", "pellet_study", *map(str, words)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        preexec_fn=limit,
        stdin=subprocess.DEVNULL,
    )


def pipe(place: Path) -> None:
    place.parent.mkdir(exist_ok=True)
    os.mkfifo(place)


def endless(place: Path) -> None:
    place.parent.mkdir(exist_ok=True)
    place.symlink_to("/dev/zero")


@pytest.fixture
def study(tmp_path) -> Path:
    """One that was refined, so that there is something to report."""
    folder = incline(tmp_path / "study", c=60.0)
    assert answered("refine", folder).returncode == 0
    return folder


@pytest.mark.parametrize("kind", [pipe, endless])
@pytest.mark.parametrize(
    "name, verb",
    [
        ("study.toml", "compare"),
        ("measurements.csv", "compare"),
        ("rigs/own.py", "compare"),
        ("effects/own.py", "compare"),
        ("history.json", "history"),
        ("compare.json", "report"),
        ("calibration.csv", "report"),
        ("screening/decision.json", "report"),
    ],
)
def test_what_is_no_regular_file_in_a_study_is_refused_at_once(study, kind, name, verb):
    (study / name).unlink(missing_ok=True)
    kind(study / name)
    found = answered(verb, study)
    assert found.returncode == 2 and paragraph(found.stderr) and Path(name).name in found.stderr
    what = (
        ["a pipe"] if kind is pipe else ["a device", "is a link", "outside the study"]
    )  # of code, and of measurements
    assert any(words in found.stderr for words in what)


@pytest.mark.parametrize("kind", [pipe, endless])
@pytest.mark.parametrize("words", [["angle", "heap.png"], ["angle", "heap.csv"], ["bbd", "t.csv"], ["pb", "t.xlsx"]])
def test_what_is_no_regular_file_is_no_photograph_and_no_table(tmp_path, kind, words):
    kind(tmp_path / words[1])
    found = answered(words[0], tmp_path / words[1])
    assert found.returncode == 2 and paragraph(found.stderr) and words[1] in found.stderr
    assert ("a pipe" if kind is pipe else "a device") in found.stderr


def png(file: Path, width: int, height: int) -> Path:
    """A grey picture of one tone: a few bytes, whatever its size."""

    def part(name: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))

    rows, packed = zlib.compressobj(9), b""
    for _ in range(height):
        packed += rows.compress(b"\0" * (1 + width))
    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    file.write_bytes(
        b"\x89PNG\r\n\x1a\n" + part(b"IHDR", head) + part(b"IDAT", packed + rows.flush()) + part(b"IEND", b"")
    )
    return file


def test_a_small_file_that_unpacks_to_gigabytes_is_refused_before(tmp_path):
    pytest.importorskip("skimage")
    photo = png(tmp_path / "large.png", 13_000, 13_000)
    assert photo.stat().st_size < 200_000
    began = time.monotonic()
    found = answered("angle", photo, "--figures", tmp_path / "o", memory_mb=2000)
    assert found.returncode == 2 and paragraph(found.stderr)
    assert "13000 x 13000 pixels" in found.stderr and "make the picture smaller" in found.stderr
    assert time.monotonic() - began < PATIENCE_S


def test_a_picture_larger_than_is_needed_is_read_reduced(tmp_path):
    pytest.importorskip("skimage")
    import numpy as np
    from PIL import Image

    from pellet_study.heap import photograph
    from tests.helpers.heap_photographs import draw

    small = Image.fromarray(np.uint8(np.round(255 * draw(40.0, 40.0))))
    for mode in ("RGB", "P", "L", "I;16"):
        large = small.resize((small.width * 10, small.height * 10), Image.Resampling.BILINEAR)
        if mode == "I;16":
            large = Image.fromarray(np.asarray(large.convert("L"), dtype=np.uint16) * 16)
        else:
            large = large.convert(mode)
        file = tmp_path / f"large_{mode[:1]}.png"
        large.save(file)
        assert photograph.measure(file).angle_deg == pytest.approx(40, abs=0.5), mode


def test_a_workbook_that_unpacks_to_gigabytes_is_refused(tmp_path):
    pytest.importorskip("openpyxl")
    import zipfile

    with zipfile.ZipFile(tmp_path / "bomb.xlsx", "w", zipfile.ZIP_DEFLATED) as archive:
        with archive.open("xl/worksheets/sheet1.xml", "w", force_zip64=True) as part:
            for _ in range(600):
                part.write(b" " * 1_000_000)
    found = answered("bbd", tmp_path / "bomb.xlsx")
    assert found.returncode == 2 and paragraph(found.stderr) and "when unpacked" in found.stderr


def test_json_that_is_nested_without_end_is_named(study):
    (study / "history.json").write_text("[" * 100_000)
    found = answered("history", study)
    assert found.returncode == 2 and paragraph(found.stderr) and "history.json" in found.stderr
    (study / "history.json").write_text(json.dumps({"steps": []}))
    assert answered("history", study).returncode == 2
