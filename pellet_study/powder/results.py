"""The folder of a powder calibration's results: tables and decisions, each used only for the plan it was made for."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from pellet_study.doe import margins
from pellet_study.doe.answers import plain
from pellet_study.errors import InputError
from pellet_study.files import opening, writing
from pellet_study.powder.decisions import (
    STAGES,
    Decision,
    PathSetting,
    decided,
    decision_file,
    read_decision,
    stages_in,
)
from pellet_study.powder.plan import Plan, differences, with_conditions, without_target

OF_A_TARGET = (
    "optimum",
    "validation",
)  # stages that belong to what was measured; the surface only to ranges and conditions


@dataclass(frozen=True)
class Results:
    """What the chain of one plan left in a folder, a folder a stage.

    `decisions_from` is the folder of another chain's results, whose decisions stand for the stages that are not done here;
    with `any_target` those up to the surface, whatever was measured there.
    """

    plan: Plan
    folder: Path
    decisions_from: Path | None = None
    any_target: bool = False

    @property
    def grains(self) -> Path:
        """File of the grains of one heap at the setting that was validated."""
        return self.folder / "heap_grains.csv"

    def margin(self, stage: str) -> Path:
        """File in which the margin of a stage's equivalence test is declared before its heaps."""
        return self.folder / stage / "margin.json"

    def declare_margin(self, stage: str) -> None:
        """Write the margin of a stage's equivalence test down.

        Raises
        ------
        InputError : another one stands there
        """
        self.refuse_margin(stage)
        margins.declare_margin(self.margin(stage), self.plan.margin, "deg")

    def refuse_margin(self, stage: str) -> None:
        """Refuse to go on beside another margin that was declared.

        Raises
        ------
        InputError : names it
        """
        file = self.margin(stage)
        if file.exists() and (declared := margins.read_margin(file)) != self.plan.margin:
            raise InputError(
                f"{file}: declares the margin {declared:g} deg, not {self.plan.margin:g}: a margin is not changed after it "
                "was declared; give --results another folder"
            )

    @property
    def read_setting(self) -> Path | None:
        """The folder of another chain where the setting to validate is that chain's."""
        return self.decisions_from if self.home("optimum") == self.decisions_from else None

    def write_table(self, stage: str, name: str, table: pd.DataFrame) -> None:
        """A table of a stage. With it an old decision goes: it was made from others."""
        writing.remove(decision_file(self.folder, stage))
        writing.table(self.folder / stage / f"{name}.csv", table)

    def write_decision(self, stage: str, decision: Decision | PathSetting) -> None:
        """The decision of a stage, with the plan it was made for."""
        writing.json(decision_file(self.folder, stage), self.plan.record | plain(asdict(decision)))

    def home(self, stage: str) -> Path | None:
        """The folder whose decision of a stage counts: this chain's, else the one it reads; None where neither has it."""
        folders: tuple[Path | None, ...] = (self.folder, self.decisions_from)
        if self.any_target:
            folders = (self.folder,) if stage in OF_A_TARGET else (self.decisions_from,)
        return next((f for f in folders if f is not None and decision_file(f, stage).exists()), None)

    def differs(self, folder: Path, stage: str) -> str:
        """In what the plan of a folder's decision differs from this one, in words; "" where it is the same."""
        there, here = decided(folder, stage), self.plan.record
        if "plan" not in there:
            return "it does not say what it was decided for (an older version wrote it)"
        there = with_conditions({key: there.get(key) for key in here})
        if self.any_target and folder == self.decisions_from:
            there, here = without_target(there), without_target(here)
        return "; ".join(differences(there, here))

    def checked(self, folder: Path, stage: str) -> Any:
        """A folder's decision of a stage, made for this plan.

        Raises
        ------
        InputError : it was made for another one
        """
        if different := self.differs(folder, stage):
            remedy = "or give --results another folder" if folder == self.folder else "or name another folder"
            raise InputError(
                f"{folder / stage}: not decided for this plan: {different}; run calibrate on the whole chain there again "
                f"(heaps that stay the same come from its store), {remedy}"
            )
        return read_decision(folder, stage)

    def decision(self, stage: str) -> Any:
        """What a stage decided, from its file.

        Raises
        ------
        InputError : the stage was not run, or for another plan
        """
        folder = self.home(stage)
        if folder is None:
            raise InputError(
                f"{self.folder / stage}: the stage {stage} was not run yet; run calibrate without --only first"
            )
        return self.checked(folder, stage)

    def check(self) -> None:
        """Refuse, before anything is simulated, to write over the other contact law or margin, and to read for another plan.

        Raises
        ------
        InputError : names what is in the way
        """
        for stage in STAGES:
            if decision_file(self.folder, stage).exists():
                law = decided(self.folder, stage).get("contact_law")
                if law != self.plan.contact_law:
                    raise InputError(
                        f"{self.folder / stage}: was decided with {law}, not {self.plan.contact_law}; give --results another "
                        f"folder, such as {self.folder / self.plan.contact_law}"
                    )
            if self.decisions_from is not None and decision_file(self.decisions_from, stage).exists():
                if not (self.any_target and stage in OF_A_TARGET):
                    self.checked(self.decisions_from, stage)
        self.refuse_margin("validation")

    def done(self, stage: str) -> bool:
        """Whether this folder has the stage, for this plan."""
        return stage in stages_in(self.folder) and not self.differs(self.folder, stage)

    def counting(self) -> dict[str, Path]:
        """{stage: folder of its decision} of the stages done so far for this plan, in their order."""
        homes = {stage: home for stage in STAGES if (home := self.home(stage)) is not None}
        return {stage: home for stage, home in homes.items() if not self.differs(home, stage)}

    def decisions(self) -> dict[str, Decision]:
        """{stage: decision} of the stages done so far for this plan."""
        return {stage: read_decision(home, stage) for stage, home in self.counting().items()}

    def as_written(self) -> dict[str, Mapping[str, Any]]:
        """{stage: JSON object of its file} of the stages done so far for this plan."""
        return {stage: decided(home, stage) for stage, home in self.counting().items()}

    def gather(self) -> None:
        """runs.csv: a row a heap of every stage done so far for this plan."""
        files = {stage: self.folder / stage / "runs.csv" for stage in STAGES}
        tables = [
            pd.read_csv(opening.stream(f), dtype=str) for stage, f in files.items() if f.exists() and self.done(stage)
        ]
        if tables:
            writing.table(self.folder / "runs.csv", pd.concat(tables, ignore_index=True))
