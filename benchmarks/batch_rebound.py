"""One rebound case in the way yade-batch runs a study: one YADE process a line of its parameter table."""

import importlib.util
import sys
from pathlib import Path

from yade.utils import readParamsFromTable

readParamsFromTable(seed=0, results="results.csv", noTableOk=True)
from yade.params.table import results, seed  # noqa: E402

folder = Path(sys.argv[0]).resolve().parent.parent / "yade_scripts"
spec = importlib.util.spec_from_file_location(
    "yade_scripts", folder / "__init__.py", submodule_search_locations=[str(folder)]
)
sys.modules["yade_scripts"] = importlib.util.module_from_spec(spec)
from yade_scripts import case, rebound  # noqa: E402

complete = {**case.example(rebound.RIG), "id": f"seed{seed}", "seed": seed}
case.Table(Path(results), case.columns(rebound.RIG)).append(case.run(complete, rebound))
