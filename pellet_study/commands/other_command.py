"""A table that the other of `pb` and `bbd` analyses: what it is, and the command that does."""

import argparse

from pellet_study.commands.design_tables import again
from pellet_study.commands.responses import each_able, read_tables
from pellet_study.errors import InputError


def for_the_other(arguments: argparse.Namespace, command: str, error: InputError) -> InputError:
    """The error of a table that `pb` or `bbd` refuses: where the other `command` analyses it, with what it is and how.

    The other analysis is tried, so that the advice works when it is followed.
    """
    from pellet_study.doe.factors import parse_factors
    from pellet_study.doe.published_designs import UNKNOWN, design_of

    try:
        tables, _ = read_tables(arguments, parse_factors(arguments.factor), 5 if command == "bbd" else 3)
        each_able(tables, lambda name: _analysed(command, tables[name]))
    except InputError:
        return error
    kind = design_of(next(iter(tables.values())))
    levels, why = (
        ("runs at three levels or more of each factor", "pb fits main effects at two levels")
        if command == "bbd"
        else ("runs at two levels", "bbd fits squares, which two levels and their middle do not separate")
    )
    return InputError(
        f"{arguments.table} holds {levels if UNKNOWN in kind else f'this design: {kind}'}; {why}. Analyse it with: "
        f"pellet-study {command} {again(arguments)}"
    )


def _analysed(command: str, table):
    from pellet_study.doe import box_behnken, plackett_burman

    return (box_behnken if command == "bbd" else plackett_burman).analyse(table)
