"""The command line: `pellet-study COMMAND ...`, the only place that prints errors and sets the exit status."""

import argparse
import importlib
import json
import os
import sys
from pathlib import Path

import pellet_study
from pellet_study.commands import COMMANDS
from pellet_study.errors import InputError, StudyError

INTERRUPTED = 130


def _parser(chosen: str | None) -> argparse.ArgumentParser:
    """The full list of commands, with the arguments of the chosen one (the others are not imported)."""
    parser = argparse.ArgumentParser(prog="pellet-study", description=pellet_study.__doc__)
    parser.add_argument("--version", action="version", version=f"pellet-study {pellet_study.__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name, summary in COMMANDS.items():
        command = commands.add_parser(
            name, help=summary, description=summary, formatter_class=argparse.RawDescriptionHelpFormatter
        )
        if name == chosen:
            module = importlib.import_module(f"pellet_study.commands.{name}")
            module.add_arguments(command)
            command.add_argument("--json", metavar="FILE", type=Path, help="also write the answer as JSON")
            command.set_defaults(run=module.run)
    return parser


def _check_json(file: Path | None) -> None:
    """Refuse a file that cannot be written before anything is computed for it."""
    if file is not None and (str(file) == "-" or file.is_dir() or not file.absolute().parent.is_dir()):
        raise InputError(f"--json {file}: expected a file in a folder that exists; make {file.absolute().parent} first")


def main(argv: list[str] | None = None) -> int:
    """Run one command; returns the exit status (0 answered, 2 bad input, 3 simulations failed, 130 interrupted)."""
    argv = sys.argv[1:] if argv is None else argv
    chosen = next((word for word in argv if word in COMMANDS), None)
    arguments = _parser(chosen).parse_args(argv)
    try:
        _check_json(arguments.json)
        answer = arguments.run(arguments)
        if arguments.json is not None:
            arguments.json.write_text(json.dumps(answer, indent=1, allow_nan=False) + "\n", encoding="utf-8")
        sys.stdout.flush()
    except StudyError as error:
        print(f"pellet-study: {error}", file=sys.stderr)
        return error.exit_status
    except KeyboardInterrupt:
        print("pellet-study: interrupted; what was finished is kept", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:  # `pellet-study ... | head`: the reader has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except OSError as error:
        print(f"pellet-study: {error}", file=sys.stderr)
        return StudyError.exit_status
    return 0


if __name__ == "__main__":
    sys.exit(main())
