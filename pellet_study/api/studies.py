"""Studies from a folder, or from a data frame of readings and what is known and free."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pellet_study.api.answers import Check
from pellet_study.errors import InputError
from pellet_study.files import writing
from pellet_study.rigs.catalogue import Catalogue
from pellet_study.study.conditions import check_conditions
from pellet_study.study.load import assembled, load
from pellet_study.study.measurements import Measurement, read, refuse_sizes
from pellet_study.study.study import Setting, Study
from pellet_study.study.user_code import catalogue_of

if TYPE_CHECKING:
    import pandas as pd

Free = float | tuple[float, float] | tuple[float, float, float] | Setting
Words = str | tuple[str, ...] | list[str]


def load_study(folder: Path | str, library: Path | str | None = None) -> Study:
    """The study in a folder: study.toml, measurements.csv, and effects/ and rigs/ of its own.

    Parameters
    ----------
    library : folder with `effects/` and `rigs/` that several studies share; its files are run, and named when they are

    Raises
    ------
    InputError : anything in it cannot be used

    Examples
    --------
    >>> import pellet_study as ps
    >>> study = ps.load_study("results/wet_beads")
    >>> study.rigs, sorted(study.parameters)
    (('layer_on_incline',), ['internal_friction'])
    """
    return load(Path(folder), None if library is None else Path(library))


def check_study(study: Study) -> Check:
    """What was understood of a study and what its rows could show; nothing is simulated.

    Examples
    --------
    >>> import pellet_study as ps
    >>> found = ps.check_study(ps.load_study("results/wet_beads"))
    >>> [candidate["effect"] for candidate in found.candidates]
    ['stress_dependent_friction', 'cohesion', 'finite_thickness', 'side_wall_friction']
    """
    from pellet_study.criticism.understood import understood, understood_page

    answer = understood(study)
    return Check(answer, understood_page(answer), study)


def study_of(
    measurements: pd.DataFrame,
    *,
    parameters: Mapping[str, Free] | None = None,
    effects: Mapping[str, Mapping[str, Free]] | None = None,
    candidates: Sequence[str] | None = None,
    possible: Mapping[str, Mapping[str, Free | Words]] | None = None,
    contact_law: str | None = None,
    effort: float = 1.0,
    title: str = "study",
    folder: Path | str | None = None,
    library: Path | str | None = None,
) -> Study:
    """A study of a data frame of readings.

    Parameters
    ----------
    measurements : the columns of measurements.csv: `rig`, `observable`, `value`, conditions with their unit in the name;
        optional `sd`, `n`, `setup`, `setup_sd`, `split`, `reason`, `order`, `note` and known parameters
    parameters : a number is fixed; (min, max) or (value, min, max) is free; what is not named keeps its default
    effects : {effect: {parameter: as above}}, physics present beyond the base
    candidates : effects that `diagnose` may consider; default: all that act in the rigs used
    possible : {rig: {condition: (min, max)}} of what could be measured next; of a condition that is a word, one or a list
    contact_law : of the rigs on YADE
    effort : multiplies the number of simulations
    folder : where simulations are kept (.store) and answers written; needed for rigs on YADE
    library : as in `load_study`

    Raises
    ------
    InputError : anything in it cannot be used

    Examples
    --------
    >>> import pandas as pd
    >>> import pellet_study as ps
    >>> stress = [500.0, 1000.0, 2000.0, 4000.0]
    >>> readings = pd.DataFrame({"rig": "shear_cell", "observable": "shear_stress_pa", "sd": 10.0,
    ...                          "normal_stress_pa": stress, "value": [0.6 * s + 100 for s in stress]})
    >>> study = ps.study_of(readings, parameters={"internal_friction": (0.1, 1.5)})
    >>> print(ps.refine(study).verdict)
    adequate
    """
    given: dict[str, Any] = {"title": title, "effort": effort, "parameters": _settings(parameters)}
    given["effects"] = {name: _settings(values) for name, values in (effects or {}).items()}
    given["possible"] = {rig: _settings(ranges) for rig, ranges in (possible or {}).items()}
    given |= {} if candidates is None else {"candidates": list(candidates)}
    given |= {} if contact_law is None else {"contact_law": contact_law}
    where = Path(folder) if folder is not None else None
    if where is not None:
        writing.folder(where)
    shared = None if library is None else Path(library)
    everything = catalogue_of(where, shared)
    study = assembled(given, _rows(measurements, everything), everything, "study_of", where, shared)
    simulated = [rig for rig in study.rigs if study.catalogue.rigs[rig].on_yade]
    if simulated and where is None:
        raise InputError(f"{', '.join(simulated)} runs on YADE: name a folder for its simulations with folder=")
    return study


def _rows(measurements: pd.DataFrame, catalogue: Catalogue) -> tuple[Measurement, ...]:
    """The rows of a data frame, read as a file is, with the same checks."""
    with tempfile.TemporaryDirectory() as temporary:
        file = Path(temporary) / "measurements"
        measurements.to_csv(file, index=False)
        try:
            rows = read(file, catalogue)
            refuse_sizes(file, rows)
            check_conditions(file, rows, catalogue)
            return rows
        except InputError as error:
            raise InputError(str(error).replace(str(file), "measurements")) from None


def _settings(values: Mapping[str, Any] | None) -> dict[str, Any]:
    return {name: _setting(value) for name, value in (values or {}).items()}


def _setting(value: Free | Words) -> float | str | list | dict[str, Any]:
    """As study.toml has it."""
    if isinstance(value, Setting):
        value = (
            (value.value, value.low, value.high) if value.low is not None and value.high is not None else value.value
        )
    if not isinstance(value, tuple | list):
        return value
    if value and all(isinstance(word, str) for word in value):
        return list(value)
    names = ("min", "max") if len(value) == 2 else ("value", "min", "max")
    if len(value) != len(names):
        raise InputError(f"{value!r}: expected a number, (min, max) or (value, min, max)")
    return dict(zip(names, value, strict=True))
