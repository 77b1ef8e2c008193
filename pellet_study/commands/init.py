"""`pellet-study init`: a study folder to start from."""

import argparse
from pathlib import Path

from pellet_study.errors import InputError
from pellet_study.files import writing
from pellet_study.output.terminal import done, say
from pellet_study.study.starting import bench_study, study_of_rig

EPILOG = """\
The folder starts with the source paper's three bench readings; with --rig it is about one rig: one that comes with the
package, or, under a name that none has, one of your own from a commented template (rigs/ and effects/ of the study). It runs
as it stands; put your own readings in measurements.csv.

examples:
  pellet-study init seeds && pellet-study bench seeds
  pellet-study init beads --rig layer_on_incline && pellet-study refine beads
  pellet-study init drops --rig ball_drop && pellet-study check drops
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.epilog = EPILOG
    parser.add_argument("folder", metavar="FOLDER", type=Path, help="folder to make")
    parser.add_argument("--rig", metavar="RIG", help="a rig of the package, or the name of one of your own")
    parser.add_argument("--own", action="store_true", help="RIG is one of your own, however near another's its name is")


def run(arguments: argparse.Namespace) -> dict:
    """Write the study; nothing that exists is overwritten."""
    folder = arguments.folder
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder} exists and is not an empty folder; give the name of a new one")
    if arguments.own and not arguments.rig:
        raise InputError("--own: name the rig of your own with --rig NAME")
    texts = study_of_rig(arguments.rig, arguments.own) if arguments.rig else bench_study()
    try:
        writing.folder(folder)
        for name, text in texts.items():
            writing.text(folder / name, text)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made: {error.strerror}") from None
    say(f"{folder} is a study: study.toml says what is fixed and free, measurements.csv what was measured.")
    code = [name for name in texts if name.endswith(".py")]
    if code:
        say(f"No rig of the package is called {arguments.rig}: {' and '.join(code)} are templates for one of your own.")
    if arguments.rig:
        say("Its readings are an example; put your own in their place.")
    done(folder, f"{'check' if arguments.rig else 'bench'} {folder}")
    return {"path": str(folder.resolve()), "files": sorted(texts)}
