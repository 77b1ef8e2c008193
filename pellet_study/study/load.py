"""A study folder read and checked: study.toml, its measurements, and effects and rigs of the user's own."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from pellet_study.errors import InputError
from pellet_study.files.toml import toml_in
from pellet_study.output.words import nearest
from pellet_study.rigs.catalogue import Catalogue
from pellet_study.rigs.declared import Effect
from pellet_study.study.checked_code import check_on_rows
from pellet_study.study.conditions import check_conditions, remarks
from pellet_study.study.measurements import Measurement, read, refuse_sizes
from pellet_study.study.ranges import refuse_beyond, unusual_parameter
from pellet_study.study.study import RESTITUTION_AT, SCALINGS, SEEDS_BY, Possible, Setting, Study, check, settings
from pellet_study.study.user_code import catalogue_of
from pellet_study.study.values import choice, setting, table, text, words
from pellet_study.tables.rows import STRAY, stray_return
from yade_scripts import laws

KEYS = {  # of study.toml
    "title": "one line; by default the name of the folder",
    "measurements": 'the file of the readings, inside the study; by default "measurements.csv"',
    "contact_law": "of the rigs on YADE; by default each rig's own",
    "candidates": "a list of the effects that `diagnose` may consider; by default every one that acts in the rigs used",
    "parameters": "a table: a number is fixed, `{ value, min, max }` is free; what is not named keeps its default",
    "effects": "a table of the effects present beyond the base model, a table of parameters each; `add` and `refine` write here",
    "possible": "a table for each rig: what could be measured next, `{ min, max }` or a list of words for each condition",
    "surface_energy_scaling": "how surface energy goes with the amplification of the grains: so that the Bond number stays, or not at all",
    "restitution_at": "whether the damper of a seed takes its whole mass, or the mass effective at the contact",
    "effort": "simulations of the rigs on YADE, as a multiple of the least that answers",
    "seeds_by": "what the seeds of the heaps of `calibrate` belong to: the setting, or the place in the design as in release 0.1",
}
CONTACT_LAWS = tuple(laws.LAWS)
EFFORT = {"min": 0.5, "max": 100.0}  # simulations of the rigs on YADE, as a multiple of the least that answers


def load(folder: Path, library: Path | None = None, instead: Path | None = None) -> Study:
    """Read and check a study folder.

    Parameters
    ----------
    library : a folder with `effects/` and `rigs/` of the user's own that several studies share; it is given by whoever
        loads a study, never by the study, because what is in it is run
    instead : a file read in place of the study's measurements, to try it

    Raises
    ------
    InputError : anything in it cannot be used
    """
    folder, library = Path(folder), None if library is None else Path(library)
    _refuse_no_folder(folder)
    file = folder / "study.toml"
    given = toml_in(file, "a study is a folder with study.toml and measurements.csv", explain=_stray)
    refuse_unknown(given, file)
    everything = catalogue_of(folder, library)
    measurements = instead or _inside(folder, file, text(file, given, "measurements", "measurements.csv"))
    rows = read(measurements, everything)
    refuse_sizes(measurements, rows)
    check_conditions(measurements, rows, everything)
    return assembled(given, rows, everything, file, folder, library)


def measurements_of(folder: Path) -> Path:
    """The file that a study's measurements are in.

    Raises
    ------
    InputError : it is no study, or the file lies outside it
    """
    _refuse_no_folder(folder)
    file = folder / "study.toml"
    given = toml_in(file, "a study is a folder with study.toml and measurements.csv", explain=_stray)
    return _inside(folder, file, text(file, given, "measurements", "measurements.csv"))


def _refuse_no_folder(folder: Path) -> None:
    """A study is a folder: where a file of it is given, the folder is named."""
    if folder.is_file():
        inside = (folder.parent / "study.toml").is_file()
        advice = f"give the folder it is in, {folder.parent}" if inside else "put it there as measurements.csv"
        raise InputError(f"{folder}: is a file; a study is a folder with study.toml and measurements.csv: {advice}")


def refuse_unknown(given: Mapping, file: Path | str) -> None:
    """Refuse keys that study.toml does not have."""
    for key in given:
        if key not in KEYS:
            raise InputError(f"{file}: {key!r} is unknown{nearest(key, KEYS)}")


def assembled(
    given: Mapping,
    rows: tuple[Measurement, ...],
    everything: Catalogue,
    file: Path | str,
    folder: Path | None,
    library: Path | None = None,
) -> Study:
    """A checked study of what study.toml says, given as tables, and of measured rows; `file` is named in errors."""
    rows, left_out = _parted(file, rows)
    possible = _possible(file, table(file, given, "possible"), everything)
    rigs = list(dict.fromkeys([*(row.rig for row in rows), *possible]))
    catalogue = everything.within(rigs)
    law = choice(file, given, "contact_law", CONTACT_LAWS)
    study = Study(
        title=text(file, given, "title", folder.resolve().name if folder else "study"),
        rows=rows,
        parameters=_parameters(file, table(file, given, "parameters"), catalogue, rigs),
        effects=_effects(file, table(file, given, "effects"), catalogue),
        catalogue=catalogue,
        candidates=_candidates(file, given.get("candidates"), catalogue, rigs),
        possible=possible,
        contact_law=law,
        surface_energy_scaling=choice(file, given, "surface_energy_scaling", SCALINGS) or "bond_number",
        restitution_at=choice(file, given, "restitution_at", RESTITUTION_AT) or "centre",
        effort=setting(f"{file}: effort", given.get("effort", 1.0), EFFORT).value,
        seeds_by=choice(file, given, "seeds_by", SEEDS_BY) or "setting",
        folder=folder,
        library=library,
        left_out=left_out,
    )
    check(study, f"{file}: ")
    check_on_rows(catalogue, rows, {name: given.value for name, given in study.parameters.items()})
    fixed = {name: given.value for name, given in study.parameters.items() if not given.free}
    of_effects = [words for name, given in study.effects.items() for words in _unusual(catalogue.effects[name], given)]
    return replace(study, remarks=(*remarks(rows, catalogue, fixed), *of_effects))


def _parted(file: Path | str, rows: tuple[Measurement, ...]) -> tuple[tuple[Measurement, ...], tuple[Measurement, ...]]:
    """The rows that are used, and those left out."""
    used = tuple(row for row in rows if row.split != "leave_out")
    if not used:
        raise InputError(f"{file}: every row of the measurements is left out; give some the split `fit`")
    return used, tuple(row for row in rows if row.split == "leave_out")


def _stray(text_of: str) -> str | None:
    """What to say of a return within a line of study.toml."""
    stray = stray_return(text_of)
    return f"line {stray}: {STRAY}" if stray else None


def _inside(folder: Path, file: Path, name: str) -> Path:
    path = folder / name
    try:
        inside = path.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError, ValueError) as error:  # links in a circle; no path at all
        raise InputError(f"{file}: measurements {name!r} is no path: {error}") from None
    if not inside:
        raise InputError(f"{file}: measurements {name!r} lies outside the study; copy the file into {folder}")
    return path


def _parameters(file: Path | str, given: Mapping, catalogue: Catalogue, rigs: Collection[str]) -> dict[str, Setting]:
    known = {name: q for rig in catalogue.rigs.values() for name, q in rig.parameters.items()}
    of_rigs = {name for rig in rigs for name in catalogue.rigs[rig].parameters}
    found: dict[str, Setting] = {}
    for name, value in given.items():
        if name not in known:
            raise InputError(f"{file}: parameters: {name!r} is unknown in {', '.join(rigs)}{nearest(name, of_rigs)}")
        found[name] = setting(f"{file}: parameters: {name}", value, known[name])
    return found


def _effects(file: Path | str, given: Mapping, catalogue: Catalogue) -> dict[str, dict[str, Setting]]:
    found: dict[str, dict[str, Setting]] = {}
    for name, values in given.items():
        effect = catalogue.effect(name, f"{file}: effects: ")
        if not isinstance(values, dict):
            raise InputError(f"{file}: effects: {name}: expected {{ {effect.amount} = ... }}, got {values!r}")
        for key in values:
            if key not in effect.parameters:
                raise InputError(f"{file}: effects: {name}: {key!r} is unknown{nearest(key, effect.parameters)}")
        found[name] = settings(effect, {})
        for key, value in values.items():
            found[name][key] = setting(f"{file}: effects: {name}: {key}", value, effect.parameters[key])
    return found


def _unusual(effect: Effect, given: Mapping[str, Setting]) -> list[str]:
    """What to say of an effect's fixed values beyond their physical range."""
    words = [unusual_parameter(name, effect.parameters[name], [s.value]) for name, s in given.items() if not s.free]
    return [f"{effect.name}: {said}" for said in words if said]


def _candidates(file: Path | str, given: Any, catalogue: Catalogue, rigs: Sequence[str]) -> tuple[str, ...] | None:
    if given is None:
        return None
    if not isinstance(given, list) or not all(isinstance(name, str) for name in given):
        raise InputError(f"{file}: candidates: expected a list of effect names, got {given!r}")
    for name in given:
        catalogue.effect(name, f"{file}: candidates: ", rigs)
    return tuple(dict.fromkeys(given))


def _possible(file: Path | str, given: Mapping, catalogue: Catalogue) -> dict[str, dict[str, Possible]]:
    found: dict[str, dict[str, Possible]] = {}
    for name, ranges in given.items():
        rig = catalogue.rig(name, f"{file}: possible: ")
        if not isinstance(ranges, dict):
            raise InputError(
                f"{file}: possible.{name}: expected condition = {{ min = ..., max = ... }}, got {ranges!r}"
            )
        found[name] = {}
        for condition, given_range in ranges.items():
            where = f"{file}: possible.{name}: {condition}"
            if condition not in rig.conditions:
                raise InputError(f"{where!s} is unknown{nearest(condition, rig.conditions)}")
            if options := rig.options(condition):
                found[name][condition] = words(where, given_range, options)
                continue
            level = setting(where, given_range)
            low = level.value if level.low is None else level.low
            high = level.value if level.high is None else level.high
            found[name][condition] = low, high
            if rig.conditions[condition].get("positive") and low <= 0:
                raise InputError(f"{where}: expected more than 0")
            for end in (low, high):
                refuse_beyond(f"{file}: possible.{name}", condition, end, rig.conditions[condition])
    return found
