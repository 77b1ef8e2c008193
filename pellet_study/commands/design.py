"""`pellet-study design`: judge a design, extend it, mend it, and say how many runs it takes."""

import argparse
import re
from collections.abc import Sequence
from pathlib import Path

from pellet_study.commands.design_tables import save_sheet, warn
from pellet_study.commands.numbers import number, whole
from pellet_study.commands.responses import others_of
from pellet_study.errors import InputError
from pellet_study.output.terminal import done, say

EXAMPLES = """\
TABLE.csv: a design, run or not: factor columns, then the response, empty where it was not measured. Designs are made by
`pb --design` and `bbd --design`.

examples:
  pellet-study design power screening.csv --sd 0.8 --effect 2
  pellet-study design score surface.csv --model quadratic
  pellet-study design fold screening.csv --output folded.csv
  pellet-study design fold screening.csv --on A --output folded.csv
  pellet-study design axial screening.csv --factors A,B,C --axial rotatable --output surface.csv
  pellet-study design repair surface.csv --model quadratic --repeats 2 --output again.csv
`pellet-study design VERB --help` lists the options of each.
"""
VERBS = {
    "power": "how likely an effect is found, and how many runs that takes",
    "score": "efficiencies, prediction variance, VIF, aliases of a design",
    "fold": "fold-over of a screening: runs with signs reversed, what they free from aliasing",
    "axial": "axial points added to a two-level design that was run",
    "repair": "a design with lost runs: which of them to repeat",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.epilog = EXAMPLES
    verbs = parser.add_subparsers(dest="verb", metavar="VERB", required=True)
    added = {name: verbs.add_parser(name, help=words, description=words) for name, words in VERBS.items()}
    for name, verb in added.items():
        _add_table(verb)
        if name in ("power", "score", "repair"):
            verb.add_argument("--model", choices=("main", "interactions", "quadratic"),
                              help="terms to be fitted (default: what pb fits at two levels, quadratic at more)")  # fmt: skip
        if name in ("fold", "axial", "repair"):
            verb.add_argument(
                "--output", metavar="FILE", type=Path, help="write the table with the runs to make (.csv, .xlsx)"
            )
            verb.add_argument("--seed", metavar="N", type=whole, help="of the random order (default: a new one)")
            verb.add_argument(
                "--force", action="store_true", default=argparse.SUPPRESS, help="overwrite a table that is there"
            )
    added["power"].add_argument("--sd", type=number, required=True, help="standard deviation of a run made again")
    added["power"].add_argument("--effect", type=number, required=True, help="change from -1 to +1 that matters")
    added["power"].add_argument("--alpha", type=number, default=0.05, help="level of the tests (0.05)")
    added["power"].add_argument("--power", type=number, default=0.8, help="power wanted (0.8)")
    added["fold"].add_argument("--on", metavar="A,B", help="reverse these factors only (default: all)")
    added["axial"].add_argument("--factors", metavar="A,B", help="factors of the surface (default: all)")
    added["axial"].add_argument(
        "--axial", metavar="rotatable|face|orthogonal|VALUE", default="rotatable", help="distance (rotatable)"
    )
    added["axial"].add_argument("--centre", metavar="N", type=whole, default=3, help="centre points beside them (3)")
    added["axial"].add_argument(
        "--hold", metavar="D=LEVEL,E=LEVEL", help="physical levels of the other factors (their middle)"
    )
    added["repair"].add_argument(
        "--repeats", metavar="N", type=whole, help="runs to repeat (default: as few as will do)"
    )


def _add_table(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("table", metavar="TABLE.csv", type=Path, help="the design")
    verb.add_argument("--factor", metavar="NAME=LOW,HIGH[,UNIT]", action="append", default=[],
                      help="levels coded -1 and +1; NAME=WORD,WORD is categorical")  # fmt: skip
    verb.add_argument("--ignore", metavar="NAME", action="append", default=[], help="a column that is no factor")
    verb.add_argument("--block", metavar="NAME", action="append", default=[], help="a column that says which block")
    verb.add_argument("--response", metavar="NAME", nargs="+", action="extend", default=[],
                      help="columns that are responses, after TABLE.csv (default: the last column)")  # fmt: skip
    verb.add_argument(
        "--json", metavar="FILE", type=Path, default=argparse.SUPPRESS, help="also write the answer as JSON"
    )


def run(arguments: argparse.Namespace) -> dict:
    """Answer one verb; prints the readable answer and returns the JSON one."""
    from pellet_study.doe.factors import parse_factors
    from pellet_study.doe.planned_table import read_planned

    others_of(arguments)  # each named once
    factors = parse_factors(arguments.factor)
    table = read_planned(arguments.table, factors, arguments.ignore, arguments.block, arguments.response)
    answer = {
        "power": _power, "score": _score, "fold": _fold, "axial": _axial, "repair": _repair,
    }[arguments.verb](arguments, table)  # fmt: skip
    warnings = [*table.notes, *answer.pop("warnings", [])]
    warn(warnings)
    return {**answer, "warnings": warnings}


def _model(arguments, table) -> str:
    """The model asked for, or that of the design's levels."""
    import numpy as np

    from pellet_study.doe.interactions import clear_interactions
    from pellet_study.doe.score import block_columns
    from pellet_study.doe.terms import interaction_terms

    if arguments.model:
        return arguments.model
    levels = np.abs(table.coded[:, [not factor.levels for factor in table.factors]])
    off = levels[levels.max(axis=1, initial=0.0) > 0.5]
    if not np.all(np.abs(off - 1) < 0.1):
        return "quadratic"
    centre, between = np.asarray(table.centre), block_columns(table.blocks)
    clear = clear_interactions(table.names, table.coded, centre, () if between is None else between.T)
    every = len(table.names) > 1 and len(clear) == len(interaction_terms(table.names))
    return "interactions" if every else "main"


def _power(arguments, table) -> dict:
    import numpy as np

    from pellet_study.doe import design_text, power
    from pellet_study.doe.answers import plain
    from pellet_study.doe.score import block_columns, model_terms
    from pellet_study.doe.terms import columns_of

    model = _model(arguments, table)
    terms = model_terms(table.names, model)
    matrix = columns_of(table.coded, terms)
    extra = [block_columns(table.blocks)] if table.blocks else []
    if model != "quadratic" and table.centre.any():
        extra.append(table.centre[:, None].astype(float))  # as pb fits them
    found = power.design_power(
        np.column_stack([matrix, *extra]), terms, arguments.sd, arguments.effect, arguments.alpha, arguments.power
    )
    runs = None
    if model == "main":
        runs = power.screening_runs(len(table.names), arguments.sd, arguments.effect, arguments.alpha, arguments.power)
    say(design_text.power_text(found, runs))
    return {**plain(found), "model": model, "runs_needed": found.runs_needed, "screening_runs_needed": runs}


def _score(arguments, table) -> dict:
    from pellet_study.doe import design_text
    from pellet_study.doe.answers import plain
    from pellet_study.doe.score import score

    found = score(table.names, table.coded, _model(arguments, table), table.blocks, table.centre)
    say(design_text.score_text(found))
    return plain(found)


def _fold(arguments, table) -> dict:
    from pellet_study.doe import design_text
    from pellet_study.doe.answers import plain
    from pellet_study.doe.factors import factors_meant
    from pellet_study.doe.fold_over import fold_over

    on = factors_meant(arguments.on, table.names) if arguments.on else None
    found = fold_over(table.names, table.coded[~table.centre], on)
    say(design_text.fold_text(found))
    return {**plain(found), **_extend(arguments, table, found.added, "pb")}


def _axial(arguments, table) -> dict:
    from pellet_study.doe import design_text
    from pellet_study.doe.answers import plain
    from pellet_study.doe.augment import add_axial
    from pellet_study.doe.cautions import axial_cautions
    from pellet_study.doe.factors import factor_meant, factors_meant

    kept = factors_meant(arguments.factors, table.names) if arguments.factors else None
    named = {factor.name: factor for factor in table.factors}
    held = {}
    for word, level in _held(arguments.hold, table.factors).items():
        name = factor_meant(word, table.names)
        held[name] = float(named[name].coded(level))
    words = [name for name, factor in named.items() if factor.levels and (kept is None or name in kept)]
    if words:
        raise InputError(
            f"{words[0]!r} is categorical and has no axial points: name the other factors with --factors; its first level "
            "is kept in the new runs"
        )
    found = add_axial(table.names, table.coded, kept, arguments.axial, arguments.centre, held)
    say(design_text.axial_text(found, arguments.centre))
    warnings = axial_cautions([named[name] for name in found.names], found.distance)
    others = [name for name in table.names if name not in found.names]
    return {**plain(found), **_extend(arguments, table, found.added, "bbd", others, found.names), "warnings": warnings}


def _held(given: str | None, factors) -> dict[str, float]:
    """{factor: level} of --hold, a named level as the number it is coded with."""
    from pellet_study.doe.factors import parse_levels

    for factor in factors:
        for coded, word in zip((-1.0, 1.0), factor.levels, strict=False):
            named = rf"(^|,)({re.escape(factor.name)})={re.escape(word)}(?=,|$)"
            given = given and re.sub(named, rf"\g<1>\g<2>={factor.physical(coded):g}", given)
    return parse_levels(given) if given else {}


def _repair(arguments, table) -> dict:
    import numpy as np

    from pellet_study.doe import design_text
    from pellet_study.doe.answers import plain
    from pellet_study.doe.planned_table import runs_to_repeat
    from pellet_study.doe.repair import repair
    from pellet_study.doe.run_sheet import new_seed
    from pellet_study.doe.score import block_columns, model_terms
    from pellet_study.doe.terms import columns_of

    terms = model_terms(table.names, _model(arguments, table))
    matrix, names = columns_of(table.coded, terms), list(terms)
    if table.blocks and (extra := block_columns(table.blocks)) is not None:
        matrix = np.column_stack([matrix, extra])
        names += [f"block {i + 2}" for i in range(extra.shape[1])]
    found = repair(matrix, table.lost, names, arguments.repeats)
    runs = [", ".join(f"{f.name} {f.word(x)}" for f, x in zip(table.factors, row, strict=True)) for row in table.coded]
    say(design_text.repair_text(found, table.lines, runs))
    answer = {**plain(found), "rows": [table.lines[i] for i in found.repeated]}
    seed = new_seed() if arguments.seed is None else arguments.seed
    frame = runs_to_repeat(table, found.repeated, seed)
    save_sheet(frame, arguments.output, seed, len(found.repeated), len(arguments.response) or 1)
    if arguments.output:
        done(arguments.output)
    return answer


def _extend(arguments, table, added, command: str, others: Sequence[str] = (), surface: Sequence[str] = ()) -> dict:
    """Write the table with the runs added; what is done with it next."""
    import shlex

    from pellet_study.doe.planned_table import extended, next_block
    from pellet_study.doe.run_sheet import new_seed

    seed = new_seed() if arguments.seed is None else arguments.seed
    frame = extended(table, added, next_block(table), seed)
    save_sheet(frame, arguments.output, seed, len(added), len(arguments.response) or 1)
    if arguments.output:
        named = {
            factor.name: factor for factor in table.factors
        }  # a factor with named levels has no square, and may act
        words = [word for name in others for word in ("--block" if named[name].levels else "--ignore", name)]
        for factor in table.factors:
            if factor.name in surface or (command == "pb" and (factor.levels or factor.low > factor.high)):
                words += ["--factor", factor.declaration]
        if arguments.response:
            words += ["--response", *arguments.response]
        done(arguments.output, f"{command} {shlex.join([str(arguments.output), '--block', 'block', *words])}")
    return {"seed": seed, "runs": len(frame), "added": len(added)}
