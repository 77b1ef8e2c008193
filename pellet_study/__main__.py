"""The command line: `pellet-study COMMAND ...`, the only place that prints errors and sets the exit status."""

import argparse
import importlib
import logging
import os
import sys
import warnings
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

import pellet_study
from pellet_study import starting
from pellet_study.commands import COMMANDS, EDITING, SIMULATING, simulating
from pellet_study.errors import InputError, StudyError
from pellet_study.files import opening, outputs, writing
from pellet_study.output.terminal import complain
from pellet_study.output.words import plain

OPEN = ("/dev/fd/", "/proc/self/fd/")
NAMED = {
    f"{folder}{number}": name
    for number, name in (("1", "stdout"), ("2", "stderr"))
    for folder in ("/dev/fd/", "/proc/self/fd/")
} | {"/dev/stdout": "stdout", "/dev/stderr": "stderr"}
KEPT = ("history.json", "margin.json", "decision.json")  # read again by later commands


def _parser(chosen: str | None) -> argparse.ArgumentParser:
    """The full list of commands, with the arguments of the chosen one (the others are not imported)."""
    parser = argparse.ArgumentParser(prog="pellet-study", description=(pellet_study.__doc__ or "").partition("\n")[0])
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
            command.add_argument(
                "--force",
                action="store_true",
                help="overwrite files that are there and were not written by this program",
            )
            if name in SIMULATING:
                simulating.add_arguments(command)
            command.set_defaults(run=module.run)
    return parser


def _check_folder(folder: Path | None) -> None:
    """Refuse a study that results cannot be written to before anything is computed for it."""
    if folder is not None and folder.is_dir() and not os.access(folder, os.W_OK | os.X_OK):
        raise InputError(
            f"{folder}: you may not write there, and results go into the study; copy the study to a folder of your own"
        )


def _check_results(arguments: argparse.Namespace) -> None:
    """Refuse to replace what somebody else put where the results go before they are computed."""
    study = getattr(arguments, "study", None)
    if study is None:
        return
    figures = getattr(arguments, "figures", None)
    where = study / "figures" if figures == Path() else figures  # --figures without a folder
    outputs.check(arguments.command, getattr(arguments, "results", None) or study, where)


def _check_json(file: Path | None) -> None:
    """Refuse a file that cannot be written, or holds something else, before anything is computed for it."""
    if file is None or _is_stream(file):
        return
    if str(file) == "-" or file.is_dir() or not file.absolute().parent.is_dir():
        raise InputError(f"--json {file}: expected a file in a folder that exists; make {file.absolute().parent} first")
    writing.check(file, ours=_is_answer(file))


def _is_answer(file: Path) -> Callable[[bytes, bytes], bool]:
    """What an answer may replace: another answer, but not what a study remembers by."""
    return writing.nothing if file.name in KEPT else writing.is_answer


def _is_stream(file: Path) -> bool:
    """Whether a name is that of a device, as /dev/null, or of what is open already, as /dev/stdout or the shell's >(...)."""
    return str(file).startswith(OPEN) or str(file) in NAMED or file.is_char_device()


def _leave_json(file: Path, answer: object) -> None:
    text = writing.as_json(answer)
    if not _is_stream(file):
        writing.text(file, text, ours=_is_answer(file))
    elif str(file) in NAMED:  # written on; opened by its name, a file that the shell opened would begin anew
        print(text, end="", file=getattr(sys, NAMED[str(file)]), flush=True)
    else:
        file.write_text(text, encoding="utf-8")


def main(argv: list[str] | None = None) -> int:
    """Run one command; returns the exit status (0 answered, 2 bad input, 3 simulations failed, 130 interrupted)."""
    _own_surroundings()
    _own_log()
    try:
        starting.attend()
        status = _told(sys.argv[1:] if argv is None else argv)
        starting.ignore()
        return status
    except BaseException as error:
        starting.ignore()  # a second one changes nothing
        if not starting.interrupted(error):
            raise
    complain(starting.WORDS)
    return starting.leave()


def _told(argv: list[str]) -> int:
    """Run one command; what went wrong is said in a sentence."""
    try:
        return _answer(argv)
    except StudyError as error:
        if starting.interrupted(error):
            raise
        complain(error)
        return error.exit_status
    except BrokenPipeError:  # `pellet-study ... | head`: the reader has seen enough
        _give_up_stdout()
        return 0
    except OSError as error:
        if starting.interrupted(error):
            raise
        complain(_words(error))
        _give_up_stdout()
        return InputError.exit_status


def _answer(argv: list[str]) -> int:
    chosen = next((word for word in argv if word in COMMANDS), None)
    arguments = _parser(chosen).parse_args(argv)
    with writing.forced(arguments.force):
        _check_json(arguments.json)
        _check_results(arguments)
    _check_folder(getattr(arguments, "study", None))
    if arguments.command in SIMULATING:
        simulating.hand_on(arguments)
    with writing.forced(arguments.force), _held(arguments):
        answer = arguments.run(arguments)
        if arguments.json is not None:
            _leave_json(arguments.json, answer)
    sys.stdout.flush()
    return 0


def _held(arguments: argparse.Namespace) -> AbstractContextManager[None]:
    """The study, held where the command edits it."""
    if arguments.command not in EDITING:
        return nullcontext()
    from pellet_study.study.edit import alone

    return alone(arguments.study)


def _give_up_stdout() -> None:
    """Nothing more is written there: not what is still in its buffer either, when the program ends."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


class _Plain(logging.Formatter):
    """Lines of the log as a terminal only shows them."""

    def format(self, record: logging.LogRecord) -> str:
        return plain(super().format(record))


def _own_log() -> None:
    """Our log and warnings reach the terminal as sentences; those of other programs do not."""
    logging.getLogger("pellet_study").setLevel(logging.INFO)
    if not logging.getLogger().handlers:
        logging.basicConfig()
        logging.getLogger().handlers[0].setFormatter(_Plain("pellet-study: %(message)s"))
        logging.getLogger().handlers[0].addFilter(logging.Filter("pellet_study"))  # others' lines are not passed on
    if not sys.warnoptions:
        warnings.simplefilter("ignore")  # nor are warnings to programmers: what a user must know is said in the answer
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")  # a terminal that has no such letter


def _own_surroundings() -> None:
    """Streams that are closed lead nowhere; settings of matplotlib of the user's, for other figures, change nothing."""
    opening.fill_streams()
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))
    os.environ.update(MPLBACKEND="agg", MATPLOTLIBRC=os.devnull)


def _words(error: OSError) -> str:
    """What the system refused, and what to do."""
    place = f"{error.filename}: " if error.filename else ""
    advice = "what was finished is kept; mend it and call again"
    return f"{place}{error.strerror or error}; {advice}"


if __name__ == "__main__":
    sys.exit(main())
