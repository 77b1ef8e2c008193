"""What a sealed trial on YADE is made of: conditions, free parameters, how often each is read, what is hidden."""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from pellet_study.files import writing
from pellet_study.rigs.catalogue import Catalogue, standard
from pellet_study.rigs.declared import Condition
from pellet_study.study.measurements import Measurement
from pellet_study.study.study import Setting, Study


@dataclass(frozen=True)
class Demonstration:
    """A study whose readings are simulated.

    Parameters
    ----------
    title : of the study
    observables : {rig: observable}
    conditions : (rig, conditions) of the rows; what is not named is the rig's default
    ranges : {free parameter: (start, low, high)}
    truth : {free parameter: (low, high)} from which the trials draw it
    repeats : {rig: single readings a row}
    scatter : {rig: standard deviation of single readings over their mean}, measured; for planning only
    instrument_sd : {rig: standard deviation of a reading} where the seed hardly matters: one is simulated, and its
        readings scatter by the instrument
    other_numerics : {rig: numerics} of every second trial
    trials : {kind: how many}; kinds are `one`, `nothing`, `outside`
    later : {lambda: how many} trials after these, that hide one effect at a strength
    strength_seeds : {rig: simulations a row, with and without what is hidden, from which its strength is measured}; none:
        strengths are those on the response surfaces
    known : {parameter: value} known for every row
    held_out : places of the rows that are kept back
    candidates : effects that diagnose may consider; None: all that act
    hides : effects hidden in turn; None: all that act
    same : {effect: the other one it is proportional to under all conditions}
    effort : of the study, simulations as a multiple of the least that answers
    contact_law : of the study and of what is simulated; None: each rig's default
    """

    title: str
    observables: Mapping[str, str]
    conditions: Sequence[tuple[str, Mapping[str, Condition]]]
    ranges: Mapping[str, tuple[float, float, float]]
    truth: Mapping[str, tuple[float, float]]
    repeats: Mapping[str, int]
    scatter: Mapping[str, float]
    other_numerics: Mapping[str, Mapping[str, float]]
    trials: Mapping[str, int]
    later: Mapping[float, int] = field(default_factory=dict)
    strength_seeds: Mapping[str, int] = field(default_factory=dict)
    instrument_sd: Mapping[str, float] = field(default_factory=dict)
    known: Mapping[str, float] = field(default_factory=dict)
    held_out: frozenset[int] = frozenset()
    candidates: tuple[str, ...] | None = None
    hides: tuple[str, ...] | None = None
    same: Mapping[str, str] = field(default_factory=dict)
    effort: float = 1.0
    contact_law: str | None = None

    @cached_property
    def catalogue(self) -> Catalogue:
        """The package's rigs and effects, as they are in these rigs."""
        return standard().within(list(self.observables))

    def rows(self, readings: Sequence[np.ndarray]) -> list[Measurement]:
        """A row for each condition, from its single readings."""
        found = []
        for k, ((rig, given), values) in enumerate(zip(self.conditions, readings, strict=True)):
            complete = self.catalogue.rigs[rig].default_conditions()
            complete |= {c: value if isinstance(value, str) else float(value) for c, value in given.items()}
            found.append(
                Measurement(
                    rig,
                    self.observables[rig],
                    float(np.mean(values)),
                    float(np.std(values, ddof=1)),
                    len(values),
                    complete,
                    dict(self.known),
                    "",
                    0.0,
                    "holdout" if k in self.held_out else "fit",
                    "",
                    k + 2,
                )
            )
        return found

    def study(self, measured: Sequence[Measurement], candidates: Catalogue | None = None) -> Study:
        """The study a user would make of such readings."""
        return Study(
            title=self.title,
            rows=tuple(measured),
            parameters={name: Setting(*values) for name, values in self.ranges.items()},
            effects={},
            catalogue=candidates or self.catalogue,
            candidates=self.candidates,
            effort=self.effort,
            contact_law=self.contact_law,
        )

    def write(self, folder: Path, measured: Sequence[Measurement]) -> None:
        """study.toml and measurements.csv of such a study."""
        lines = [f'title = "{self.title}"']
        if self.contact_law is not None:
            lines.append(f'contact_law = "{self.contact_law}"')
        if self.candidates is not None:
            quoted = ", ".join(f'"{name}"' for name in self.candidates)
            lines.append(f"candidates = [{quoted}]")
        if self.effort != 1:
            lines.append(f"effort = {self.effort}")
        lines += ["", "[parameters]"]
        lines += [
            f"{name} = {{ value = {value}, min = {low}, max = {high} }}"
            for name, (value, low, high) in self.ranges.items()
        ]
        writing.text(folder / "study.toml", "\n".join(lines) + "\n")
        names = list(dict.fromkeys(c for _, given in self.conditions for c in given))
        stream = io.StringIO()
        writer = csv.writer(stream, lineterminator="\n")
        split = ["split"] if self.held_out else []
        writer.writerow(["rig", "observable", "value", "sd", "n", *names, *self.known, *split])
        for (_, given), row in zip(self.conditions, measured, strict=True):
            values = [f"{row.value:.6g}", f"{row.sd:.6g}", row.n, *(given.get(name, "") for name in names)]
            kept = [row.split] if split else []
            writer.writerow([row.rig, row.observable, *values, *self.known.values(), *kept])
        writing.text(folder / "measurements.csv", stream.getvalue())

    def reading_sd(self, rig: str, mean: float) -> float:
        """Expected standard deviation of one reading."""
        return self.instrument_sd[rig] if rig in self.instrument_sd else self.scatter[rig] * abs(mean)

    def simulated(self, rig: str) -> int:
        """Simulated seeds a row."""
        return 1 if rig in self.instrument_sd else self.repeats[rig]

    def kinds(self) -> list[str]:
        """What each trial hides, in the order of the trials: any prefix of the first has its share of each kind.

        Those of `later` are called `lambda 4` and so on.
        """
        places = [((k + 0.5) / n, kind) for kind, n in self.trials.items() for k in range(n)]
        return [kind for _, kind in sorted(places)] + [
            f"lambda {lam:g}" for lam, n in self.later.items() for _ in range(n)
        ]
