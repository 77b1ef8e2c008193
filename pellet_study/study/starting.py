"""A study to start from: of the bench rigs together, of any one rig, or of a rig of the user's own; it runs as it stands."""

import csv
import io
import re
from collections.abc import Mapping
from importlib.resources import files
from typing import Any

import numpy as np

from pellet_study.errors import InputError
from pellet_study.output.words import did_you_mean, number
from pellet_study.rigs.catalogue import Catalogue, standard
from pellet_study.rigs.declared import Rig

LEVELS = 6  # of the condition that varies in the readings made up
SCATTER = 0.02  # of a reading made up
CALIBRATED = {  # the parameter that a rig is there to calibrate, where it is not the first
    "slope_slip": "seed_powder_static_friction",
    "inclined_roll": "seed_powder_rolling_friction",
    "repose": "powder_static_friction",
}
PRINTED = {  # the source paper's readings, at the default conditions, and their sd where it prints one
    "rebound": (8.01, None),
    "slope_slip": (31.85, None),
    "inclined_roll": (69.2, None),
    "repose": (41.69, 0.79),
}
OWN_LEVELS, OWN_SLOPE, OWN_OFFSET = (5, 10, 20, 40, 60, 90), 2.0, 4.0  # of the example for a rig of one's own


def bench_study() -> dict[str, str]:
    """{file: text} of a study of the three bench rigs with the source paper's readings."""
    return {name: _template(name) for name in ("study.toml", "measurements.csv")}


def study_of_rig(name: str, own: bool = False) -> dict[str, str]:
    """{file: text} of a study of one rig; of one of the user's own, from a commented template, where none has that name.

    Raises
    ------
    InputError : the name is nearly that of a rig, taken already, or no name
    """
    known = standard()
    if name in known.rigs and own:
        raise InputError(
            f"rig {name!r} comes with the package; give a rig of your own another name, or leave out --own"
        )
    if name in known.rigs:
        return _of_known(known.rigs[name], known)
    if not own and (hint := did_you_mean(name, known.rigs)):
        raise InputError(f"rig {name!r} is unknown{hint} For a rig of your own of that name add --own")
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name):
        raise InputError(f"rig {name!r}: expected a name of small letters, digits and _, as in my_rig")
    return _of_own(name)


def _template(name: str) -> str:
    return files("pellet_study.study").joinpath("template", name).read_text(encoding="utf-8")


def _of_own(name: str) -> dict[str, str]:
    """A rig and an effect of the user's own, and readings made up with that effect, for it to be found."""
    draw = np.random.default_rng(1)
    rows = [
        {
            "rig": name,
            "observable": "reading_mm",
            "value": f"{OWN_SLOPE * x + OWN_OFFSET + draw.normal():.4g}",
            "sd": "1",
            "setting_mm": f"{x}",
        }
        for x in OWN_LEVELS
    ]
    effect = f"{name}_offset"
    code = {
        f"rigs/{name}.py": _template("own_rig.txt"),
        f"effects/{effect}.py": _template("own_effect.txt"),
    }
    toml = [
        "# A study: what is measured (measurements.csv) and what the model assumes (here).",
        f'title = "{name}"',
        "",
        "[parameters]",
        "# A number is fixed; { value, min, max } is free to be calibrated; what is not named keeps its default.",
        "sensitivity = { value = 2.0, min = 0.5, max = 5.0 }",
        "",
        "[effects]",
        f"# physics present beyond the base; `pellet-study add FOLDER {effect}` writes here",
    ]
    texts = {file: text.replace("MY_RIG", name).replace("MY_EFFECT", effect) for file, text in code.items()}
    return {**texts, "study.toml": "\n".join(toml) + "\n", "measurements.csv": _csv(_in_random_order(rows))}


def _of_known(rig: Rig, known: Catalogue) -> dict[str, str]:
    """A study of a rig that comes with the package."""
    free = CALIBRATED.get(rig.name, next(iter(rig.parameters)))
    owned = {parameter for effect in known.effects.values() for parameter in effect.owns}
    toml = [
        "# A study: what is measured (measurements.csv) and what the model assumes (here).",
        f'title = "{rig.name}"',
        *([f'contact_law = "{rig.contact_laws[0]}"   # or {", ".join(rig.contact_laws[1:])}'] if rig.on_yade else []),
        "",
        "[parameters]",
        "# A number is fixed; { value, min, max } is free to be calibrated; what is not named keeps its default.",
        f"{free} = {{ value = {rig.parameters[free]['default']:g}, min = {rig.parameters[free]['min']:g}, "
        f"max = {rig.parameters[free]['max']:g} }}   # {_said(rig.parameters[free])}",
        *(f"# {n} = {q['default']:g}   # {_said(q)}" for n, q in rig.parameters.items() if n not in {free, *owned}),
        "",
        "[effects]",
        "# Physics present beyond the base; `pellet-study add FOLDER EFFECT` writes here. Acting in this rig:",
        *(f"#   {name}: {known.effects[name].means}" for name in known.acting(rig.name)),
        "",
        f"# [possible.{rig.name}]   # what could be measured next; default: the rig's usual range",
        *(f"# {n} = {_range(q)}   # {_said(q)}" for n, q in rig.conditions.items()),
    ]
    rows = _printed(rig) if rig.on_yade else _made_up(rig)
    return {"study.toml": "\n".join(toml) + "\n", "measurements.csv": _csv(rows)}


def _range(quantity: Mapping) -> str:
    """A range in TOML, or the words that a condition may be."""
    if "options" in quantity:
        return "[" + ", ".join(f'"{word}"' for word in quantity["options"]) + "]"
    return f"{{ min = {quantity['min']:g}, max = {quantity['max']:g} }}"


def _said(quantity: Mapping) -> str:
    unit = quantity.get("unit", "1")
    return quantity.get("meaning", "") + (f", {unit}" if unit != "1" else "")


def _printed(rig: Rig) -> list[dict[str, Any]]:
    """One reading at the default conditions: the source paper's, or one made up, to be replaced."""
    observable = next(iter(rig.observables))
    low, high = rig.usual.get(observable) or rig.readable.get(observable, (0.0, 2.0))
    value, sd = PRINTED.get(rig.name, (0.5 * (low + high), None))
    note = (
        "the source paper's reading: put your own here" if rig.name in PRINTED else "made up: put your own reading here"
    )
    return [_row(rig, observable, f"{value:g}", "" if sd is None else f"{sd:g}", {}, note)]


def _made_up(rig: Rig) -> list[dict[str, Any]]:
    """Readings that a formula predicts at its defaults, with scatter, over its first condition."""
    observable = next(iter(rig.observables))
    varied = next(name for name, quantity in rig.conditions.items() if "options" not in quantity)
    low, high = rig.conditions[varied]["min"], rig.conditions[varied]["max"]
    levels = np.geomspace(low, high, LEVELS) if low > 0 else np.linspace(low, high, LEVELS)
    levels = np.array([float(f"{level:.3g}") for level in levels])
    parameters = {name: np.array([[float(q["default"])]]) for name, q in rig.parameters.items()}
    conditions: dict[str, Any] = {n: np.full(LEVELS, q["default"]) for n, q in rig.conditions.items()}
    conditions |= {varied: levels, "median_normal_stress_pa": 1.0}
    assert rig.predict is not None
    predicted = np.ravel(np.broadcast_to(rig.predict(parameters, conditions, {})[observable], (1, LEVELS)))
    values = predicted * (1 + SCATTER * np.random.default_rng(1).normal(size=LEVELS))
    rows = [
        _row(
            rig, observable, f"{value:.4g}", f"{SCATTER * abs(mean):.2g}", {varied: level}, "made up: put your own here"
        )
        for value, mean, level in zip(values, predicted, levels, strict=True)
    ]
    return _in_random_order(rows)


def _row(rig: Rig, observable: str, value: str, sd: str, conditions: Mapping[str, float], note: str) -> dict[str, Any]:
    given = {name: number(conditions.get(name, q["default"])) for name, q in rig.conditions.items()}
    return {"rig": rig.name, "observable": observable, "value": value, "sd": sd, **given, "note": note}


def _in_random_order(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Rows with a random order of reading."""
    order = np.random.default_rng(2).permutation(len(rows)) + 1
    return [{**row, "order": int(k)} for row, k in zip(rows, order, strict=True)]


def _csv(rows: list[dict[str, Any]]) -> str:
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()
