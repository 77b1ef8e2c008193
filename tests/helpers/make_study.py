"""Study folders for tests: measurements from formulas written anew here, not from the package."""

import json
import math
from pathlib import Path

import numpy as np

from pellet_study.__main__ import main

HEIGHTS_MM = (8.0, 12.0, 18.0, 27.0, 40.0, 60.0)
STRESSES_PA = (500.0, 1000.0, 2000.0, 4000.0, 8000.0)
TOML = """title = "test"  # a comment that stays

[parameters]
internal_friction = {{ value = 0.5, min = 0.05, max = 2.0 }}
{more}"""


def slip_angle_deg(height_mm: float, mu: float, c: float, density: float = 1400.0) -> float:
    """tan a = mu + c/(rho g h cos a), solved as sin(a - phi) = c cos(phi)/(rho g h), tan(phi) = mu."""
    phi = math.atan(mu)
    return math.degrees(phi + math.asin(c * math.cos(phi) / (density * 9.81e-3 * height_mm)))


def folder(path: Path, lines: list[str], more: str = "") -> Path:
    """A study folder from the lines of its measurements file."""
    path.mkdir(parents=True, exist_ok=True)
    (path / "study.toml").write_text(TOML.format(more=more))
    (path / "measurements.csv").write_text("\n".join(lines) + "\n")
    return path


def incline(path: Path, mu=0.5, c=0.0, sd=0.5, repeats=3, seed=1, state_sd=False, more="", heights=HEIGHTS_MM) -> Path:
    """Slip angles of a layer with Gaussian scatter."""
    rng = np.random.default_rng(seed)
    lines = ["rig,observable,value,layer_height_mm" + (",sd" if state_sd else "")]
    for h in heights:
        for _ in range(repeats):
            value = slip_angle_deg(h, mu, c) + sd * rng.standard_normal()
            lines.append(f"layer_on_incline,slip_angle_deg,{value:.4f},{h:g}" + (f",{sd}" if state_sd else ""))
    return folder(path, lines, more)


def command(*words, json_file: Path | None = None):
    """Exit status and JSON answer of a command."""
    arguments = [str(w) for w in words] + (["--json", str(json_file)] if json_file else [])
    status = main(arguments)
    return status, json.loads(json_file.read_text()) if json_file and json_file.exists() else None
