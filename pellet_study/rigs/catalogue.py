"""Rigs and effects by name, read from what their files declare; a study's own are added in `study/user_code.py`."""

import importlib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

from pellet_study.errors import InputError
from pellet_study.files import opening
from pellet_study.output.words import nearest
from pellet_study.rigs.declarations import effect_from, rig_from
from pellet_study.rigs.declared import Effect, Rig
from pellet_study.rigs.known import with_ranges
from pellet_study.rigs.scripts import SCRIPTS

LARGEST_CODE = 1_000_000  # bytes
CLOSED_FORM = Path(__file__).resolve().parent / "closed_form"


@dataclass(frozen=True)
class Catalogue:
    """Rigs and effects by name."""

    rigs: Mapping[str, Rig]
    effects: Mapping[str, Effect]

    def acting(self, rig: str) -> list[str]:
        """Names of the effects that act in a rig."""
        if self.rigs[rig].on_yade:
            added = [name for name, effect in self.effects.items() if effect.file and rig in effect.rigs]
            return [name for name in self.rigs[rig].effects if name in self.effects and name not in added] + added
        return [name for name, effect in self.effects.items() if rig in effect.closed_form]

    def within(self, rigs: Sequence[str]) -> "Catalogue":
        """The same with each effect's parameters as they are in the rigs of a study.

        Raises
        ------
        InputError : an effect's parameters differ between two of these rigs
        """
        acting = {rig: self.acting(rig) for rig in rigs}
        effects = {
            name: effect.within([rig for rig in rigs if name in acting[rig]]) if effect.parameters_in else effect
            for name, effect in self.effects.items()
        }
        return replace(self, effects=effects)

    def rig(self, name: str, where: str = "") -> Rig:
        """The rig of that name, or InputError with the nearest name."""
        if name not in self.rigs:
            raise InputError(
                f"{where}rig {name!r} is unknown: it comes neither with the package nor with a file of the study's rigs/ "
                f"(or a library's){nearest(name, self.rigs)}"
            )
        return self.rigs[name]

    def effect(self, name: str, where: str = "", rigs: Iterable[str] | None = None) -> Effect:
        """The effect of that name, or InputError with the nearest name, of those that act in some rigs where these are named."""
        if name not in self.effects:
            acting = self.effects if rigs is None else dict.fromkeys(e for rig in rigs for e in self.acting(rig))
            raise InputError(f"{where}effect {name!r} is unknown{nearest(name, acting)}")
        return self.effects[name]


def declaring(folder: Path, what: str) -> list[Path]:
    """The files of a folder that declare a RIG or an EFFECT.

    Raises
    ------
    InputError : one of them cannot be read
    """
    return [file for file in sorted(folder.glob("*.py")) if declares(_text(file), what)]


def _text(file: Path) -> str:
    try:
        return opening.content(file, LARGEST_CODE, what="a file of code").decode(errors="replace")
    except FileNotFoundError:
        why = (
            f"is a link to {file.readlink()}, where there is no file" if file.is_symlink() else "is not there any more"
        )
    except IsADirectoryError:
        why = "is a folder; expected a Python file"
    except OSError as error:
        why = f"cannot be read: {error.strerror}"
    raise InputError(f"{file}: {why}; put the file of the rig or effect there, or take this away")


def declares(text: str, what: str) -> bool:
    """Whether a line of Python begins with `RIG =` or `EFFECT =`, a type between them or not."""
    return re.search(rf"^{what}\s*(:[^=\n]*)?=\s*(\{{|dict\b)", text, re.MULTILINE) is not None


@cache
def standard() -> Catalogue:
    """The rigs and effects that come with the package."""
    rigs = [rig_from(importlib.import_module(f"yade_scripts.{f.stem}"), f) for f in declaring(SCRIPTS, "RIG")]
    rigs += [
        rig_from(importlib.import_module(f"pellet_study.rigs.closed_form.{f.stem}"), f)
        for f in declaring(CLOSED_FORM, "RIG")
    ]
    effects = [
        effect_from(importlib.import_module(f"yade_scripts.effects.{f.stem}"), f)
        for f in declaring(SCRIPTS / "effects", "EFFECT")
    ]
    return Catalogue(
        {rig.name: with_ranges(rig) for rig in rigs}, {e.name: e for e in sorted(effects, key=lambda e: e.order)}
    )
