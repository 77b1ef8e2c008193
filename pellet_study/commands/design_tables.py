"""What `pb` and `bbd` share: the table of a design, its arguments, what is left out, where it is written."""

import argparse
import shlex
import sys
from contextlib import contextmanager
from pathlib import Path

from pellet_study.commands.arguments import add_look, check_look
from pellet_study.commands.numbers import number, whole
from pellet_study.errors import InputError
from pellet_study.output.terminal import complain, done, say


def add_table_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments that `pb` and `bbd` share."""
    parser.add_argument("table", metavar="TABLE.csv", type=Path, nargs="?", help="the design that was run")
    parser.add_argument(
        "--factor", metavar="NAME=LOW,HIGH[,UNIT]", action="append", default=[],
        help="physical values of -1 and +1 (LOW may be the larger); default: the column's least and greatest",
    )  # fmt: skip
    parser.add_argument("--ignore", metavar="NAME", action="append", default=[], help="a column that is no factor")
    parser.add_argument(
        "--block", metavar="NAME", action="append", default=[],
        help="a column that says in which block (day, batch) a run was made: fitted beside the factors",
    )  # fmt: skip
    parser.add_argument("--alpha", type=number, default=0.05, help="significance level (0.05)")
    parser.add_argument("--unit", metavar="[NAME=]UNIT", action="append", help="unit of the response, for the figures")
    parser.add_argument("--figures", metavar="DIR", type=Path, help="write the figures there")
    add_look(parser)


def kept(arguments: argparse.Namespace) -> str:
    """Where an analysis went."""
    places = [str(place) for place in (arguments.figures, arguments.json) if place]
    return ", ".join(places) or "above (--json FILE and --figures DIR keep them)"


def again(arguments: argparse.Namespace) -> str:
    """The table and what was said of its columns, as words of a command to follow."""
    words = [str(arguments.table)]
    for option in ("factor", "ignore", "block"):
        words += [word for given in getattr(arguments, option) for word in (f"--{option}", given)]
    if arguments.response:
        words += ["--response", *arguments.response]
    return shlex.join(words)


def check_arguments(arguments: argparse.Namespace) -> None:
    """Refuse what argparse cannot.

    Raises
    ------
    InputError
        If there is neither a table nor a design to make, or alpha is no level.
    """
    if (arguments.table is None) == (arguments.design is None):
        taking = (
            "response",
            "maximise",
            "minimise",
            "transform",
        )  # options that may have taken the table for their value
        taken = not arguments.design and any(getattr(arguments, option, None) for option in taking)
        after = "; the table stands before --response and the like" if taken else ""
        raise InputError(
            f"expected a table to analyse (TABLE.csv) or a design to make (--design), one of the two{after}"
        )
    check_look(arguments)
    if not 0 < arguments.alpha < 1:
        raise InputError(f"--alpha {arguments.alpha:g}: expected a level between 0 and 1, such as 0.05")


def warn(messages: list[str]) -> None:
    """Warnings go to the error stream, below the answer."""
    for message in messages:
        complain(f"warning: {message}")


@contextmanager
def writing(path: Path):
    """Turn a failure to write into an error that names the place.

    Raises
    ------
    InputError
        If the place cannot be written to.
    """
    try:
        yield
    except OSError as error:
        raise InputError(
            f"cannot write {path}: {error.strerror or error}; give a place that can be written to"
        ) from None


def add_making_arguments(parser: argparse.ArgumentParser, centre: int):
    """The arguments of a new design that `pb` and `bbd` share; returns their group."""
    making = parser.add_argument_group("a new design")
    making.add_argument(
        "--design", metavar="A=LOW,HIGH[,UNIT]", nargs="+",
        help="make the run sheet of these factors" + ("" if centre else "; A=WORD,WORD is categorical"),
    )  # fmt: skip
    making.add_argument("--centre", metavar="N", type=whole, default=centre, help=f"centre points ({centre})")
    making.add_argument("--blocks", metavar="N", type=whole, default=1, help="blocks (days, batches) to run it in (1)")
    making.add_argument("--seed", metavar="N", type=whole, help="of the random order (default: a new one, printed)")
    making.add_argument("--output", metavar="FILE", type=Path, help="write it there, .csv or .xlsx (default: print it)")
    return making


def write_design(sheet, path: Path | None, command: str) -> dict:
    """Print a run sheet or write it as a table whose response is to be filled in.

    Raises
    ------
    InputError
        If there is a file already and it is not forced, or the place cannot be written to.
    """
    import shlex

    from pellet_study.doe.design_text import blocks_text

    to_fill = [name for name in sheet.frame.columns if (sheet.frame[name] == "").all()]
    save_sheet(sheet.frame, path, sheet.seed, len(sheet.frame), len(to_fill))
    words = blocks_text(sheet)
    if words:
        print(words, file=sys.stdout if path else sys.stderr)
    if path:
        words_again = ["--block", "block"] if sheet.n_blocks > 1 else []
        for factor in sheet.factors:
            if factor.levels or factor.low > factor.high or abs(sheet.coded).max() > 1:
                words_again += ["--factor", factor.declaration]
        if len(to_fill) > 1:
            words_again += ["--response", *to_fill]
        done(path, f"{command} {shlex.join([str(path), *words_again])}")
    return {
        "runs": len(sheet.frame),
        "design": sheet.design.to_dict(orient="records"),
        "standard_order": sheet.frame["standard_order"].tolist(),
        "blocks": sheet.frame["block"].tolist() if sheet.n_blocks > 1 else None,
        "orthogonal_blocks": sheet.orthogonal_blocks if sheet.n_blocks > 1 else None,
        "block_confounded": sheet.confounded if sheet.n_blocks > 1 else None,
        "seed": sheet.seed,
    }


def save_sheet(frame, path: Path | None, seed: int, n_new: int, n_responses: int = 1) -> None:
    """Write a table with runs to make, or print it as CSV; says how many and in which order, and what to fill in.

    Raises
    ------
    InputError
        If there is a file already and it is not forced, or the place cannot be written to.
    """
    from pellet_study.doe.run_sheet import write_sheet

    if path is None:
        print(frame.to_csv(index=False), end="")
        complain(f"random order, seed {seed} (--seed {seed} gives it again)")
        return
    with writing(path):
        write_sheet(frame, path)
    columns = "the last column" if n_responses == 1 else f"the last {n_responses} columns"
    runs = f"{len(frame)} runs" if n_new == len(frame) else f"{len(frame)} runs, {n_new} of them to make,"
    say(
        f"{runs} written to {path} in random order (seed {seed}): make them in the order of the column run, fill {columns} in"
    )
