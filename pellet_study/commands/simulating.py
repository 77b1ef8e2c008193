"""Options of the commands that may simulate; they stand for environment variables that simulations read."""

import argparse
import os

from pellet_study.simulation import settings

OPTIONS = {
    "scheduler": (settings.SCHEDULER, settings.scheduler),
    "time_limit": (settings.TIME_LIMIT, settings.time_limit_s),
    "workers": (settings.WORKERS, settings.workers),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Where, how long and on how many cores."""
    parser.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="simulate on a Dask cluster: tcp://HOST:PORT of its scheduler, or slurm:JOBS ($PELLET_STUDY_SCHEDULER)",
    )
    parser.add_argument(
        "--time-limit",
        metavar="SECONDS",
        help="longest time of one simulation; default: what its rig declares ($PELLET_STUDY_TIME_LIMIT_S)",
    )
    parser.add_argument(
        "--workers",
        metavar="N",
        help="YADE processes at once on this machine; default: one a core ($PELLET_STUDY_WORKERS)",
    )


def hand_on(arguments: argparse.Namespace) -> None:
    """Set the variables, and look at once whether they can be used.

    Raises
    ------
    InputError : one cannot
    """
    for option, (variable, read) in OPTIONS.items():
        given = getattr(arguments, option)
        read(given)
        if given:
            os.environ[variable] = given
