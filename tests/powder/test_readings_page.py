"""The table of docs/identify.md is that of the committed screening."""

import pandas as pd

from tests import ROOT

TABLE = ROOT / "results" / "full" / "screening" / "readings.csv"
DIGITS = {"discharge_time_s": 3, "fill_bulk_density_kg_m3": 1}


def lines() -> list[str]:
    """A line a reading: effects, those beyond two standard errors bold, their standard error, the scatter of heaps."""
    found = []
    for reading, rows in pd.read_csv(TABLE).groupby("reading", sort=False):
        digits, error = DIGITS.get(reading, 2), rows["standard_error"].max()
        told = [f"{effect:+.{digits}f}" for effect in rows["effect"]]
        bold = [
            f"**{one}**" if abs(effect) > 2 * error else one for one, effect in zip(told, rows["effect"], strict=True)
        ]
        found.append(f"| `{reading}` | {' | '.join(bold)} | {error:.{digits}f} | {rows['scatter'].max():.{digits}f} |")
    return found


def test_the_page_has_the_effects_of_the_committed_screening():
    page = (ROOT / "docs" / "identify.md").read_text().splitlines()
    first = next(k for k, line in enumerate(page) if line.startswith("|---")) + 1
    assert page[first : first + len(lines())] == lines()
    assert not page[first + len(lines())].startswith("|")
