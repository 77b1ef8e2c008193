"""The law checks of both YADEs side by side: asked, measured by the one here, and by that of Debian 13.

    .venv/bin/python benchmarks/law_checks_versions.py          # results/checks/law_checks_versions.csv, ten minutes
    .venv/bin/python benchmarks/law_checks_versions.py --here   # of the YADE here alone, as CSV on the standard output

The second column of a version is whether the check is within its tolerance there.
"""

import sys
import tempfile
from pathlib import Path

import other_yade
import pandas as pd

from pellet_study.simulation import dispatch, law_cases, law_checks, yade

FILE = other_yade.ROOT / "results" / "checks" / "law_checks_versions.csv"
KEYS = ["check", "contact_law", "setting", "requested"]


def here() -> pd.DataFrame:
    """The comparisons with what was requested, on this YADE."""
    with tempfile.TemporaryDirectory() as folder:
        table = law_checks.table(dispatch.run(law_cases.cases(), Path(folder) / ".store", workers=1, quiet=True))
    table = table[~table["remark"].str.startswith("instead")].reset_index(drop=True)
    version = yade.version()
    return table[[*KEYS, "measured", "within"]].rename(columns={"measured": version, "within": f"within {version}"})


if __name__ == "__main__":
    if "--here" in sys.argv:
        print(here().to_csv(index=False))
    else:
        one, other = here(), other_yade.table(Path(__file__).name, KEYS[0])
        assert list(one["setting"]) == list(other["setting"])
        whole = pd.concat([one, other.drop(columns=KEYS)], axis=1)
        FILE.parent.mkdir(parents=True, exist_ok=True)
        whole.to_csv(FILE, index=False, lineterminator="\n", float_format="%.6g")
        versions = [name for name in whole if name[0].isdigit()]
        alike = (whole[versions[0]] - whole[versions[1]]).abs() <= 1e-3 * whole["requested"].abs().clip(lower=1e-3)
        print(f"{len(whole)} checks; measured alike to a thousandth of what was asked: {alike.sum()}; the others:")
        print(whole.loc[~alike, [*KEYS, *versions]].to_string(index=False))
        for version in versions:
            print(f"{version}: {whole[f'within {version}'].sum()} within their tolerance")
