"""The source paper's printed tables, equations and sentences, as data."""

import json
from functools import cache
from importlib.resources import files

import pandas as pd


@cache
def tables() -> dict:
    """The content of tables.json: `tables`, `equations` and `text` as printed."""
    return json.loads(files("pellet_study.paper").joinpath("tables.json").read_text(encoding="utf-8"))


def table(number: int) -> pd.DataFrame:
    """One printed table as numbers (columns named as printed; cells that are no plain number are missing)."""
    printed = tables()["tables"][str(number)]
    return pd.DataFrame(printed["values"], columns=printed["columns"])


def printed_cells(number: int) -> dict[str, dict[str, str]]:
    """{row label: {column: printed cell}} of a table whose first column names its rows."""
    content = tables()["tables"][str(number)]
    return {row[0]: dict(zip(content["columns"], row, strict=True)) for row in content["printed"]}


def printed_text() -> dict:
    """The numbers printed in the running text."""
    return tables()["text"]
