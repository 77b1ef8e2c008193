"""A picture of a heap of each protocol, with its readings: results/checks/figures/protocols.png.

    .venv/bin/python benchmarks/heap_pictures.py

Heaps of 500 grains at the middle of the paper's Table 6, one seed; two minutes. The fixed grains of the rough base are dark.
"""

import os
import tempfile
from pathlib import Path

import numpy as np
from repose_checks import FIRST_SEED, FOLDER, case, shaped

from pellet_study.heap import render
from pellet_study.output import style
from pellet_study.output.style import STYLE
from pellet_study.simulation import dispatch
from yade_scripts.apparatus import Base
from yade_scripts.repose import PROTOCOLS

NAMES = {
    "defined_base": "defined base: poured until it runs over",
    "lifted_cylinder": "lifted cylinder, on the same base",
    "funnel": "funnel: a fixed mass on an endless plate",
}
READINGS = ("flank", "triangle", "moment")


def heap(protocol: str) -> tuple[np.ndarray, np.ndarray, dict]:
    """Grains of a heap, and its row."""
    wanted = case(FIRST_SEED, shaped(500) | {"protocol": protocol})
    with tempfile.TemporaryDirectory(prefix="heap-") as folder:
        os.environ["PELLET_STUDY_GRAINS"] = folder
        row = dispatch.run([wanted], Path(folder) / ".store", workers=1, quiet=True).iloc[0]
        if row["status"] != "ok":
            raise SystemExit(f"{protocol}: {row['status']}")
        centres, radii = render.read_grains(Path(folder) / f"{row['id']}.csv")
    return centres, radii, dict(row)


def draw() -> None:
    """The three, side by side."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    with plt.rc_context(STYLE):
        figure, panels = plt.subplots(1, len(PROTOCOLS), figsize=(10.5, 3.2), layout="constrained")
        for axes, protocol in zip(panels, PROTOCOLS, strict=True):
            centres, radii, row = heap(protocol)
            colours = np.tile(render.GRAIN, (len(radii), 1))
            if protocol != "funnel":
                fixed = Base(0.5e-3 * row["base_diameter_mm"], row["base"] == "rough").places(radii.mean(), 0.0)
                centres = np.vstack([centres, fixed])
                radii = np.append(radii, np.full(len(fixed), radii.mean()))
                colours = np.vstack([colours, np.full((len(fixed), 3), 0.35)])
            plate = 0.0 if protocol == "funnel" else None
            axes.imshow(render.picture(centres, radii, colour=colours, plate=plate))
            axes.set_axis_off()
            said = ", ".join(f"{name} {row[f'repose_{name}_deg']:.1f}" for name in READINGS)
            axes.set_title(f"{NAMES[protocol]}\n{said} deg", fontsize=9)
        style.save(figure, FOLDER / "figures" / "protocols.png")


if __name__ == "__main__":
    draw()
