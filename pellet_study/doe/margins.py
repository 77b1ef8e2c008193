"""The margins of equivalence, one of each response, declared in a file before the validation runs are made."""

import json
from pathlib import Path

import numpy as np

from pellet_study.errors import InputError
from pellet_study.files import opening, writing


def declare_margin(path: Path, margin: float, unit: str = "", response: str | None = None, only: bool = True) -> None:
    """Write the margin of a response down before the runs, beside those of other responses.

    Parameters
    ----------
    path : Path
    margin : float
        Positive, response unit.
    unit : str
    response : str, optional
        Whose margin it is; None for a study of one quantity.
    only : bool
        Whether a margin that stands there without a name can only be this response's.

    Raises
    ------
    InputError
        If the margin is not positive, or another one stands there for this response already.
    """
    if not np.isfinite(margin) or margin <= 0:
        raise InputError(f"the margin is {margin:g}: expected a positive number in the response's unit")
    told = _declared(path) if path.exists() else {}
    before = _margin_of(told, response, only)
    if before is not None and before != margin:
        raise InputError(
            f"{path} declares the margin {before:g}{_of(response)} already, not {margin:g}: a margin is not "
            "changed after it was declared; use another file for another test"
        )
    if before is not None:
        return
    entry = {"margin": margin, "unit": unit}
    told = {**told, **entry} if response is None else {**told, "margins": {**told.get("margins", {}), response: entry}}
    writing.text(path, json.dumps(told, ensure_ascii=False) + "\n", ours=writing.anything)


def read_margin(path: Path, response: str | None = None, only: bool = True) -> float:
    """The margin declared in a file for a response; see `declare_margin`.

    Raises
    ------
    InputError
        If there is none: an equivalence test without a margin declared beforehand is refused, and so is one with the
        margin of another response.
    """
    try:
        told = _declared(path)
    except FileNotFoundError:
        raise InputError(
            f"no margin was declared in {path}: declare it before the runs are made, with --declare-margin"
        ) from None
    found = _margin_of(told, response, only)
    if found is not None:
        return found
    if "margin" in told and response is not None:
        raise InputError(
            f"{path} declares a margin without saying of which response, and the table has others beside {response!r}: "
            f"where it is this one's write {json.dumps({'margins': {response: told}}, ensure_ascii=False)} into the file, "
            "else declare this one's with --declare-margin"
        )
    known = ", ".join(told.get("margins", {}))
    raise InputError(
        f"{path} declares no margin{_of(response)}, but of {known}: declare it before the runs are made, with "
        "--declare-margin"
    )


def _of(response: str | None) -> str:
    return "" if response is None else f" of {response}"


def _margin_of(told: dict, response: str | None, only: bool) -> float | None:
    """The margin of a response among those declared; one without a name where it can only be this one's."""
    entry = told.get("margins", {}).get(response) or (told if response is None or only else {})
    return float(entry["margin"]) if "margin" in entry else None


def _declared(path: Path) -> dict:
    """The file of declared margins: {"margins": {response: {"margin", "unit"}}}, or one {"margin", "unit"} without a name."""
    try:
        told = opening.json_in(path)
        entries = [*told.get("margins", {}).values(), *([told] if "margin" in told else [])]
        if not entries or any(
            isinstance(entry["margin"], bool) or not isinstance(entry["margin"], int | float) for entry in entries
        ):
            raise TypeError
        return told
    except (ValueError, KeyError, TypeError, AttributeError):
        raise InputError(f'{path} declares no margin: expected {{"margin": number, "unit": "..."}}') from None
