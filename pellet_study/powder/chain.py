"""The source paper's powder calibration on the repose rig: screening, climb, surface, optimum, validation.

Each stage is a function of the study and of the decisions before it, which stand in files; so a stage can be stopped
after, resumed, or done again by itself. Each decision says for which plan it was made, and is used for no other. Heaps
that gave no angle (an arch, a blow-up) are left out and counted.
"""

import json
import os
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.special import stdtrit

from pellet_study.doe import box_behnken, optimum, plackett_burman, validation
from pellet_study.doe.answers import plain
from pellet_study.doe.factors import Factor
from pellet_study.errors import InputError, SimulationError
from pellet_study.powder.box import CLIMB_POINTS, HALF_BOX, MOVES, allowed, box_around, crossing, moved
from pellet_study.powder.decisions import STAGES, read_decision
from pellet_study.powder.heaps import FULL, KEEP_GRAINS, SEEDS_A_STAGE, SEEDS_OF_READ, Sizes
from pellet_study.powder.plan import OBSERVABLE, RIG, SYMBOLS, Plan, bond, differences
from pellet_study.powder.tables import coefficients_table, effects_table, scatter, surface_of, table_of
from pellet_study.powder.text import summary
from pellet_study.powder.validation import ALPHA, LEAST_GAIN
from pellet_study.rigs import on_yade
from pellet_study.simulate import dispatch


@dataclass
class Chain:
    """The chain of one study: its plan, its folder of results, its store.

    `say` gets a line a stage, `after` the chain and its decisions when a stage is done; `decisions_from` is the folder of
    another chain's results, whose decisions stand for the stages that are not done here.
    """

    plan: Plan
    folder: Path
    store: Path
    sizes: Sizes = FULL
    workers: int | None = None
    quiet: bool = False
    say: Callable[[str], None] = print
    decisions_from: Path | None = None
    after: Callable[["Chain", dict[str, dict]], object] = lambda chain, decisions: None

    # ------------------------------------------------------------------------------------------- heaps and files
    def heaps(self, stage: str, points: Sequence[Mapping[str, float]], first: int = 0) -> pd.DataFrame:
        """A heap at each point ({factor: physical level}; the others at the middle of their range), seeds in order.

        Returns
        -------
        Columns `stage`, `seed`, the factors, `repose_angle_deg` (missing where there is none), `direction_error_deg`,
        `bond_number`, `verdict`, `id`.
        """
        middle = {factor.name: factor.centre for factor in self.plan.factors}
        base = SEEDS_A_STAGE * (1 + STAGES.index(stage)) + first
        cases, levels = [], []
        for k, point in enumerate(points):
            level = {name: round(float(x), 10) for name, x in {**middle, **point}.items()}
            levels.append(level)
            cases.append(
                on_yade.case(
                    RIG,
                    contact_law=self.plan.contact_law,
                    seed=base + k,
                    parameters=self.plan.fixed | {SYMBOLS[name]: value for name, value in level.items()},
                    conditions=self.plan.conditions,
                    numerics=self.plan.numerics,
                )
            )
        found = dispatch.run(cases, self.store, workers=self.workers, quiet=self.quiet)
        table = pd.DataFrame(levels)
        table.insert(0, "seed", [case["seed"] for case in cases])
        table.insert(0, "stage", stage)
        for name in (OBSERVABLE, "direction_error_deg", "bond_number"):
            table[name] = pd.to_numeric(found[name], errors="coerce").to_numpy()
        table["verdict"] = found["status"].to_numpy()
        table["id"] = found["id"].to_numpy()
        return table

    def repeated(self, points: list, coded: np.ndarray) -> list:
        """The points of a design, then those beside its centre again."""
        beside = [point for point, row in zip(points, coded, strict=True) if np.any(row)]
        return points + (self.sizes.repeats - 1) * beside

    def write(self, stage: str, name: str, content: pd.DataFrame | Mapping) -> None:
        """A table of a stage or its decision. With a new table an old decision goes: it was made from others."""
        folder = self.folder / stage
        folder.mkdir(parents=True, exist_ok=True)
        if name != "decision":
            (folder / "decision.json").unlink(missing_ok=True)
        if isinstance(content, pd.DataFrame):
            content.to_csv(folder / f"{name}.csv", index=False, lineterminator="\n")
        else:
            text = json.dumps(self.plan.record | plain(content), indent=1, allow_nan=False)
            (folder / f"{name}.json").write_text(text + "\n", encoding="utf-8")

    # ----------------------------------------------------------------------------------------------------- decisions
    def home(self, stage: str) -> Path | None:
        """The folder whose decision of a stage counts: this chain's, else the one it reads; None where neither has it."""
        folders = (self.folder, self.decisions_from)
        return next((f for f in folders if f is not None and (f / stage / "decision.json").exists()), None)

    def differs(self, folder: Path, stage: str) -> str:
        """In what the plan of a folder's decision differs from this one, in words; "" where it is the same."""
        decided = read_decision(folder, stage)
        if "plan" not in decided:
            return "it does not say what it was decided for (an older version wrote it)"
        here = self.plan.record
        return "; ".join(differences({key: decided.get(key) for key in here}, here))

    def checked(self, folder: Path, stage: str) -> dict:
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

    def decision(self, stage: str) -> dict:
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

    def check_folders(self) -> None:
        """Refuse, before anything is simulated, to write over the other contact law or margin, and to read for another plan.

        Raises
        ------
        InputError : names what is in the way
        """
        for stage in STAGES:
            if (self.folder / stage / "decision.json").exists():
                law = read_decision(self.folder, stage).get("contact_law")
                if law != self.plan.contact_law:
                    raise InputError(
                        f"{self.folder / stage}: was decided with {law}, not {self.plan.contact_law}; give --results another "
                        f"folder, such as {self.folder / self.plan.contact_law}"
                    )
            if self.decisions_from is not None and (self.decisions_from / stage / "decision.json").exists():
                self.checked(self.decisions_from, stage)
        margin = self.folder / "validation" / "margin.json"
        if margin.exists() and (declared := validation.read_margin(margin)) != self.plan.margin:
            raise InputError(
                f"{margin}: declares the margin {declared:g} deg, not {self.plan.margin:g}: a margin is not changed after it "
                "was declared; give --results another folder"
            )

    def done(self, stage: str) -> bool:
        """Whether this folder has the stage, for this plan."""
        return (self.folder / stage / "decision.json").exists() and not self.differs(self.folder, stage)

    # ----------------------------------------------------------------------------------------------------------- runs
    def good(self, runs: pd.DataFrame, stage: str, least: int) -> pd.DataFrame:
        """The runs that gave an angle; says what was lost.

        Raises
        ------
        SimulationError : fewer than the analysis needs
        """
        good = runs[runs["verdict"] == "ok"]
        lost = runs[runs["verdict"] != "ok"]
        for _, row in lost.iterrows():
            self.say(f"  {stage}: the heap of seed {row['seed']} gave no angle: {row['verdict']}")
        if len(good) < least:
            raise SimulationError(
                f"{stage}: only {len(good)} of {len(runs)} heaps gave an angle, {least} are needed; "
                f"first reason: {lost['verdict'].iloc[0]}"
            )
        return good

    # ------------------------------------------------------------------------------------------------------ stages
    def screening(self) -> dict:
        """Plackett-Burman with centre points: which parameters move the angle."""
        factors = self.plan.factors
        coded = plackett_burman.coded_matrix(len(factors), centre_points=self.sizes.centre_points)
        points = [{f.name: float(f.physical(x)) for f, x in zip(factors, row, strict=True)} for row in coded]
        self.write("screening", "design", pd.DataFrame(points).round(10))
        runs = self.heaps("screening", self.repeated(points, coded))
        self.write("screening", "runs", runs)
        good = self.good(runs, "screening", len(factors) + 2)
        found = plackett_burman.analyse(table_of(good, factors))
        errors = {name: 2 * error for name, error in found.model.standard_errors.items() if name in found.effects}
        effects = effects_table(self.plan, found, errors)
        self.write("screening", "effects", effects)
        rank = sorted((n for n in found.effects if n not in self.plan.idle), key=lambda name: -abs(found.effects[name]))
        chosen = sorted(rank[:3])
        decision = {
            "factors": chosen,
            "clear": [name for name in found.effects if abs(found.effects[name]) > 2 * errors[name]],
            "coefficients": {name: found.model.coefficients[name] for name in found.effects},
            "curvature_deg": found.curvature.estimate if found.curvature else None,
            "curvature_standard_error_deg": float(found.model.results.bse[-1]) if found.curvature else None,
            "scatter_deg": scatter(good),
            "lost": int((runs["verdict"] != "ok").sum()),
            "heaps": len(runs),
            "repeats": self.sizes.repeats,
        }
        self.write("screening", "decision", decision)
        self.screened = found  # for the figures of this call
        return decision

    def climb(self) -> dict:
        """Runs along the gradient of the screening, through the middle of its box; where they meet the target."""
        screened = self.decision("screening")
        names = screened["factors"]
        factors = [f for f in self.plan.factors if f.name in names]
        slopes = np.array([screened["coefficients"][f.name] for f in factors])
        uphill = slopes / np.abs(slopes).max()
        step = 2 / (CLIMB_POINTS - 1)
        coded = [(k * step - 1) * uphill for k in range(CLIMB_POINTS)]
        known = on_yade.rig(RIG).parameters
        runs = pd.DataFrame()
        for move in range(MOVES):
            points = [{f.name: float(f.physical(x)) for f, x in zip(factors, row, strict=True)} for row in coded]
            self.write("climb", "design", pd.DataFrame(points).round(10))
            runs = self.heaps("climb", [point for point in points for _ in range(self.sizes.repeats)])
            self.write("climb", "runs", runs)
            good = self.good(runs, "climb", 2 * self.sizes.repeats + 1)  # two places at least
            along = np.array([float(row @ uphill) for row in coded]) / (uphill @ uphill)  # -1 to 1 inside the first box
            place = crossing(
                np.repeat(along, self.sizes.repeats)[good.index], good[OBSERVABLE].to_numpy(), self.plan.target
            )
            ends = {True: along.max() + step * np.array([1, 2]), False: along.min() - step * np.array([1, 2])}
            beyond = [x * uphill for x in ends[bool(place > 0)] if allowed(x * uphill, factors, known)]
            reached = bool(along.min() <= place <= along.max())
            if reached or not beyond or move == MOVES - 1:
                break
            self.say(f"  climb: {self.plan.target:g} deg is not met along the path; it goes on beyond the box")
            coded = coded + beyond  # at the end of the list, so that earlier points keep their seeds
        centre = float(np.clip(place, along.min(), along.max()))
        boxes = box_around(centre * uphill, HALF_BOX * step, factors, known)
        decision = {
            "factors": names,
            "reached": reached,
            "centre": {f.name: float(f.physical(x)) for f, x in zip(factors, centre * uphill, strict=True)},
            "box": boxes,
            "heaps": len(runs),
            "lost": int((runs["verdict"] != "ok").sum()),
            "moves": move,
            "repeats": self.sizes.repeats,
        }
        self.write("climb", "decision", decision)
        return decision

    def surface(self) -> dict:
        """Box-Behnken around the climb's best place; the box moves where the target lies outside.

        Where no box has the target, the one whose surface comes nearest to it counts.
        """
        climbed = self.decision("climb")
        units = {f.name: f.unit for f in self.plan.factors}
        factors = [Factor(name, *levels, units[name]) for name, levels in climbed["box"].items()]
        known = on_yade.rig(RIG).parameters
        boxes, designs, fits, gaps, everything = [], [], [], [], []
        for move in range(MOVES):
            coded = box_behnken.coded_matrix(len(factors), self.sizes.centre_points)
            points = [{f.name: float(f.physical(x)) for f, x in zip(factors, row, strict=True)} for row in coded]
            designs.append(pd.DataFrame(points).round(10))
            self.write("surface", "design", designs[-1])
            runs = self.heaps("surface", self.repeated(points, coded), first=1000 * move)
            runs["box"] = move
            everything.append(runs)
            self.write("surface", "runs", pd.concat(everything, ignore_index=True))
            found = box_behnken.analyse(table_of(self.good(runs, "surface", 12), factors))
            target = optimum.target_set(found, self.plan.target, self.plan.sd)
            boxes.append({f.name: [f.low, f.high] for f in factors})
            fits.append(found)
            gaps.append(max(target.lowest - self.plan.target, self.plan.target - target.highest, 0.0))
            if target.reachable or move == MOVES - 1:
                break
            self.say(
                f"  surface: the box gives {target.lowest:.1f} to {target.highest:.1f} deg, not "
                f"{self.plan.target:g}; it moves"
            )
            slopes = np.array([found.model.coefficients[f.name] for f in factors])
            up = 1 if target.highest < self.plan.target else -1
            shift = up * slopes / np.abs(slopes).max()
            factors = [moved(f, x, known[SYMBOLS[f.name]]) for f, x in zip(factors, shift, strict=True)]
        chosen = int(np.argmin(gaps))
        found = fits[chosen]
        if chosen != move:
            self.say(f"  surface: box {chosen + 1} of {move + 1} comes nearest to {self.plan.target:g} deg and counts")
            self.write("surface", "design", designs[chosen])
        self.write("surface", "coefficients", coefficients_table(found))
        decision = {
            "box": boxes[chosen],
            "boxes": boxes,
            "chosen_box": chosen,
            "coefficients": found.model.coefficients,
            "standard_errors": found.model.standard_errors,
            "r2": found.r2,
            "r2_adjusted": found.r2_adjusted,
            "r2_predicted": found.r2_predicted,
            "lack_of_fit_p": found.lack_of_fit_p,
            "reachable": gaps[chosen] == 0,
            "heaps": int(sum(map(len, everything))),
            "lost": int(sum((r["verdict"] != "ok").sum() for r in everything)),
            "box_runs": len(everything[chosen]),
            "repeats": self.sizes.repeats,
        }
        self.write("surface", "decision", decision)
        return decision

    def optimum(self) -> dict:
        """The settings of the surface's box that meet the target, and the one recommended among them, else the nearest."""
        found = self._refit_surface()
        target = optimum.target_set(found, self.plan.target, self.plan.sd)
        middle = {f.name: f.centre for f in self.plan.factors}
        point = {**middle, **target.physical}
        decision = {
            "point": point,
            "factors": list(target.physical),
            "outside": self.plan.outside(point),
            "predicted_deg": target.prediction.predicted,
            "prediction_standard_error_deg": target.prediction.standard_error,
            "reachable": bool(target.reachable),
            "rule": target.rule_in_words,
            "fraction_of_box": target.fraction,
            "lowest": target.lowest,
            "highest": target.highest,
            "unidentified": target.unidentified,
            "extents": {e.name: list(e.physical) for e in target.extents},
            "bond_number": bond(self.plan, point["G"]),
            "box": {f.name: [f.low, f.high] for f in found.table.factors},
        }
        self.targeted = target
        self.write("optimum", "decision", decision)
        return decision

    def _refit_surface(self):
        """The surface fitted again from its file of runs, that beside its decision."""
        runs = pd.read_csv(self.home("surface") / "surface" / "runs.csv")
        return surface_of(runs, self.decision("surface"), {f.name: f.unit for f in self.plan.factors})

    def validation(self) -> dict:
        """Heaps at the optimum with seeds nobody has used: is their mean the measured angle?

        Where that is not shown, the setting is corrected along the surface's gradient by what is missing, and validated
        anew with other seeds. Both attempts stay in the table and in the decision; the last one counts. There is no
        second one where the box has nothing nearer to the target along that gradient, nor where the measured angle is known so
        badly that no heaps can show equivalence and the heaps do not differ from it.
        """
        point, tables, attempts, nothing_nearer = self.chosen(), [], [], False
        (self.folder / "validation").mkdir(parents=True, exist_ok=True)
        validation.declare_margin(self.folder / "validation" / "margin.json", self.plan.margin, "deg")
        first = SEEDS_OF_READ if self.reads_setting else 0
        while True:
            runs = self.validating_heaps(point, first + 1000 * len(attempts))
            tables.append(runs.assign(attempt=len(attempts)))
            self.write("validation", "runs", pd.concat(tables, ignore_index=True))
            attempts.append(self.judged(runs, point))
            if attempts[-1]["equivalent"] or len(attempts) == self.sizes.attempts:
                break
            if not attempts[-1]["attainable"] and attempts[-1]["p_difference"] > ALPHA:
                break
            better = self.corrected(point, attempts[-1]["mean_deg"])
            if nothing_nearer := better is None:
                break
            point = better
        whole = int((runs["verdict"] == "ok").idxmax())  # the first that gave an angle
        self.keep_grains(point, first + 1000 * (len(attempts) - 1) + whole)
        decision = {**attempts[-1], "attempts": attempts, "nothing_nearer": nothing_nearer}
        self.write("validation", "decision", decision)
        return decision

    @property
    def reads_setting(self) -> bool:
        """Whether the setting to validate is another chain's."""
        return self.decisions_from is not None and self.home("optimum") == self.decisions_from

    def chosen(self) -> dict[str, float]:
        """The setting to validate: the optimum; where it is read from another chain, what that chain's validation left."""
        if self.reads_setting and (self.decisions_from / "validation" / "decision.json").exists():
            return self.checked(self.decisions_from, "validation")["point"]
        return self.decision("optimum")["point"]

    def validating_heaps(self, point: Mapping[str, float], first: int) -> pd.DataFrame:
        """As many heaps at a setting as the wanted standard error of their mean needs.

        It stops once their scatter so far is small enough, sooner where that happens to come out small: the standard error
        is then a little too small, and so is the chance stated of passing a setting just outside the margin.
        """
        heaps = self.sizes.fewest
        while True:
            runs = self.heaps("validation", [point] * heaps, first=first)
            good = runs.loc[runs["verdict"] == "ok", OBSERVABLE]
            error = float(good.std(ddof=1) / np.sqrt(len(good))) if len(good) > 1 else np.inf
            if error <= self.sizes.wanted_error or heaps >= self.sizes.most:
                return runs
            more = heaps * (error / self.sizes.wanted_error) ** 2
            heaps = int(min(self.sizes.most, max(heaps + 1, np.ceil(more)))) if np.isfinite(more) else self.sizes.most

    def judged(self, runs: pd.DataFrame, point: Mapping[str, float]) -> dict:
        """The mean of heaps at a setting against the measured angle."""
        good = self.good(runs, "validation", 2)[OBSERVABLE]
        target = self.plan.target
        tested = validation.equivalence(
            validation.sample_of(good),
            self.plan.measured,
            self.plan.margin,
            alpha=ALPHA / self.sizes.attempts,
        )
        mean, error = float(good.mean()), float(good.std(ddof=1) / np.sqrt(len(good)))
        half = float(stdtrit(len(good) - 1, 0.975) * error)
        return {
            "mean_deg": mean,
            "sd_deg": float(good.std(ddof=1)),
            "standard_error_deg": error,
            "interval_deg": [mean - half, mean + half],
            "heaps": len(runs),
            "lost": int((runs["verdict"] != "ok").sum()),
            "measured_deg": target,
            "error_percent": 100 * abs(mean - target) / target,
            "error_interval_percent": [100 * (mean - half - target) / target, 100 * (mean + half - target) / target],
            "margin_deg": self.plan.margin,
            "p_tost": tested.p,
            "equivalent": tested.equivalent,
            "p_difference": tested.p_difference,
            "attainable": self.plan.attainable(ALPHA / self.sizes.attempts),
            "point": dict(point),
            "factors": self.decision("optimum")["factors"],
            "outside": self.plan.outside(point),
            "bond_number": bond(self.plan, point["G"]),
        }

    def corrected(self, point: Mapping[str, float], mean: float) -> dict[str, float] | None:
        """The setting moved along the surface's gradient by what its heaps miss; None where the box leaves no way."""
        found = self._refit_surface()
        factors = found.table.factors
        here = np.array([f.coded(point[f.name]) for f in factors])
        gradient = np.ravel(found.model.gradient(here))
        miss = self.plan.target - mean
        there = np.clip(here + miss * gradient / (gradient @ gradient), -1, 1)
        if np.sign(miss) * gradient @ (there - here) < LEAST_GAIN * abs(miss):
            self.say(
                f"  validation: {mean:.2f} deg is not shown to be the measured angle, but along the gradient the box has nothing nearer: it is not corrected"
            )
            return None
        self.say(
            f"  validation: {mean:.2f} deg is not shown to be the measured angle; the setting is corrected and validated anew"
        )
        return {**point, **{f.name: float(f.physical(x)) for f, x in zip(factors, there, strict=True)}}

    @property
    def grains(self) -> Path:
        """File of the grains of one heap at the optimum."""
        return self.folder / "heap_grains.csv"

    def keep_grains(self, point: Mapping[str, float], first: int) -> None:
        """A heap of the validation once more, its grains kept; stored by itself, so once only."""
        folder = self.store.resolve() / "grains"
        folder.mkdir(parents=True, exist_ok=True)
        os.environ[KEEP_GRAINS] = str(folder)
        try:
            again = replace(self, store=folder).heaps("validation", [point], first=first).iloc[0]
        finally:
            del os.environ[KEEP_GRAINS]
        left = folder / f"{again['id']}.csv"
        if left.exists():
            shutil.copy(left, self.grains)

    def run(self, stages: Sequence[str] = STAGES) -> dict[str, dict]:
        """The stages named, in the paper's order; {stage: decision} of those done so far."""
        self.check_folders()
        for before, stage in pairwise(STAGES):
            if stage in stages and before not in stages:
                self.decision(before)  # refuses where there is none
        for remark in self.plan.remarks:
            self.say(remark)
        for stage in STAGES:
            if stage in stages:
                self.say(f"{stage} ...")
                decision = getattr(self, stage)()
                self.say(f"  {stage}: {summary(stage, decision)}")
                self.gather()
                self.after(self, self.decided())
        return self.decided()

    def decided(self) -> dict[str, dict]:
        """{stage: decision} of the stages done so far for this plan."""
        homes = {stage: home for stage in STAGES if (home := self.home(stage)) is not None}
        return {s: read_decision(home, s) for s, home in homes.items() if not self.differs(home, s)}

    def gather(self) -> None:
        """runs.csv: a row a heap of every stage done so far for this plan."""
        tables = [
            pd.read_csv(f, dtype=str) for s in STAGES if (f := self.folder / s / "runs.csv").exists() and self.done(s)
        ]
        if tables:
            pd.concat(tables, ignore_index=True).to_csv(self.folder / "runs.csv", index=False, lineterminator="\n")
