"""The particles of a study, rendered: the seed clump where a bench test is used, heaps where their grains are kept."""

from pathlib import Path

from pellet_study.errors import InputError
from pellet_study.heap import render
from pellet_study.report.parts import Picture, picture, rendering
from pellet_study.study.study import Study
from yade_scripts import heap
from yade_scripts.particles import SEED_LENGTH_MM, alfalfa_seed

BENCH = ("rebound", "slope_slip", "inclined_roll")


def particles(study: Study, folder: Path) -> list[Picture]:
    """Pictures of what was simulated."""
    found = []
    if set(study.rigs) & set(BENCH):
        centres, radii = alfalfa_seed()
        image = render.picture(
            centres, radii, width=640, azimuth_deg=-60, elevation_deg=28, colour=render.SEED, plate=None, vary=0
        )
        found.append(
            rendering(
                image,
                "the seed: six overlapping balls",
                f"The alfalfa seed of the bench tests, a clump of {len(radii)} overlapping balls, {SEED_LENGTH_MM:g} mm long.",
            )
        )
    for file in sorted(folder.glob("*grains*.csv")):
        centres, radii = render.read_grains(file)
        try:
            fitted = render.profile(centres, radii)
        except heap.NoHeap as error:
            raise InputError(f"{file}: {error}") from None
        found.append(
            rendering(
                render.picture(*heap.body(centres, radii), width=1000),
                f"a heap of {len(radii)} grains",
                f"A heap as simulated: {len(radii)} grains ({file.name}), the few that rolled far away not shown.",
            )
        )
        found.append(
            picture(
                fitted,
                "outline of the heap with a line through each flank and the least-squares triangle",
                "The same heap from one side, and the lines and the triangle whose angles are averaged over many sides.",
            )
        )
    return found
