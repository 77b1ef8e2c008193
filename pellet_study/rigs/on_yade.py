"""Complete cases for the rigs that run on YADE, and the package's own rigs by name, checks of the laws among them."""

from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path

from pellet_study.errors import InputError
from pellet_study.output.words import did_you_mean, nearest
from pellet_study.rigs.catalogue import declaring, standard
from pellet_study.rigs.declarations import rig_in
from pellet_study.rigs.declared import Condition, Rig
from pellet_study.rigs.scripts import SCRIPTS
from yade_scripts import case as case_file
from yade_scripts import laws

# Numerics of a law in a rig where the rig's own default is another law's: that of release 0.1, whose step holds without a
# damper between grains (docs/heap_checks.md).
OF_LAW = {("repose", laws.LOCAL_DAMPING): {"time_step_fraction": 0.18}}


@cache
def files() -> Mapping[str, Path]:
    """Files of the package's rigs on YADE and of its checks of the contact laws, by the rig's name."""
    return {file.stem: file for folder in (SCRIPTS, SCRIPTS / "checks") for file in declaring(folder, "RIG")}


@cache
def rig(name: str) -> Rig:
    """The package's rig on YADE, or check of the contact laws, of that name.

    Raises
    ------
    InputError : no such rig
    """
    if name not in files():
        raise InputError(
            f"rig {name!r} is unknown; there are {', '.join(sorted(files()))}{did_you_mean(name, files())}"
        )
    known = standard().rigs
    return known[name] if name in known else rig_in(files()[name])


def rigs_of(cases: Iterable[Mapping], given: Mapping[str, Rig] | None = None) -> dict[str, Rig]:
    """The rigs of some cases by name: those given, else the package's."""
    names = dict.fromkeys(case["rig"] for case in cases)
    return {name: given[name] if given and name in given else rig(name) for name in names}


def case(
    name: str | Rig,
    *,
    contact_law: str | None = None,
    seed: int = 0,
    parameters: Mapping[str, float] | None = None,
    conditions: Mapping[str, Condition] | None = None,
    effects: Mapping[str, Mapping[str, float]] | None = None,
    numerics: Mapping[str, float] | None = None,
) -> dict:
    """A complete case of a rig, given by itself or, one of the package's, by name; what is not given keeps its default.

    Raises
    ------
    InputError : a name or a word the rig does not know, or a rig that does not run on YADE
    """
    declared = rig(name) if isinstance(name, str) else name
    if not declared.on_yade:
        raise InputError(f"rig {declared.name} is a formula: nothing of it is simulated")
    complete: dict = {"rig": declared.name, "contact_law": contact_law or declared.contact_laws[0], "seed": int(seed)}
    for group, values in (("parameters", parameters), ("conditions", conditions), ("numerics", numerics)):
        known = getattr(declared, group)
        defaults = {key: quantity["default"] for key, quantity in known.items()}
        if group == "numerics":
            defaults |= OF_LAW.get((declared.name, complete["contact_law"]), {})
        complete[group] = defaults | _known(declared, group, values or {}, known)
    complete["effects"] = {
        effect: absent | _known(declared, effect, (effects or {}).get(effect, {}), absent)
        for effect, absent in case_file.absent(vars(declared)).items()
    }
    _known(declared, "effects", effects or {}, declared.effects)
    return complete


def _known(of: Rig, group: str, values: Mapping, known: Mapping) -> dict:
    """The values as floats, or InputError for a name, or a word, that is not known."""
    for key, value in values.items():
        if key not in known:
            what = group[:-1] if group.endswith("s") else group
            raise InputError(f"rig {of.name} has no {what} {key!r}{did_you_mean(key, known)}")
        options = known[key].get("options", ()) if isinstance(known[key], Mapping) else ()
        if options and value not in options:
            raise InputError(f"rig {of.name}: {key} {value!r} is unknown{nearest(value, options)}")
    return {key: float(value) if isinstance(value, (int, float)) else value for key, value in values.items()}
