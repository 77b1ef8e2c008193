"""Keys of an answer against their meanings in docs/generate."""

import sys
from collections.abc import Iterable

from tests import ROOT

sys.path.insert(0, str(ROOT / "docs" / "generate"))
from json_keys import MEANINGS  # noqa: E402
from nested import paths  # noqa: E402

sys.path.pop(0)


def without_meaning(command: str, *answers: dict) -> set[str]:
    """Keys of answers that the reference does not tell."""
    return {path for answer in answers for path in paths(answer, MEANINGS[command])} - set(MEANINGS[command])


def not_there(command: str, answers: Iterable[dict]) -> set[str]:
    """Keys that the reference tells and that none of the answers has."""
    return set(MEANINGS[command]) - {path for answer in answers for path in paths(answer, MEANINGS[command])}
