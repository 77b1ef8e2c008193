"""The errors a user can meet; each carries the exit status the command line ends with."""


class StudyError(Exception):
    """The base of all errors reported as one readable paragraph instead of a traceback."""

    exit_status = 1


class InputError(StudyError):
    """What the user gave cannot be used: says what was given, what was expected, what to do."""

    exit_status = 2


class SimulationError(StudyError):
    """Simulations failed where the answer needs them."""

    exit_status = 3
