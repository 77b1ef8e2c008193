"""One rebound case in the way yade-batch runs a study: one YADE process a line of its parameter table."""

import importlib.util
import os
import sys
from pathlib import Path

from yade.utils import readParamsFromTable

readParamsFromTable(seed=0, noTableOk=True)
from yade.params.table import seed  # noqa: E402

folder = Path(os.environ["SCRIPTS"])
spec = importlib.util.spec_from_file_location(
    "yade_scripts", folder / "__init__.py", submodule_search_locations=[str(folder)]
)
sys.modules["yade_scripts"] = importlib.util.module_from_spec(spec)
from yade_scripts import case, rebound  # noqa: E402

complete = {**case.example(rebound.RIG), "id": f"seed{seed}", "seed": seed}
case.Table(Path("results.csv"), case.columns(rebound.RIG)).append(case.run(complete, rebound))
