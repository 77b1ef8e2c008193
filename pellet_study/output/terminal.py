"""What the commands show: pages, warnings, progress, and at the end where the results are and what comes next.

Colours and progress only on a terminal; NO_COLOR turns colours off (no-color.org).
"""

import os
import re
import sys
import textwrap
import threading
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, TextIO

from pellet_study.output.words import plain

if TYPE_CHECKING:
    from tqdm import tqdm

WIDTH = 80  # columns of a page
QUIET_S = 2.0  # work shorter than this is not announced
SELDOM_S = 300.0  # between lines of progress where the error stream is no terminal, as of a run over night
HEADS = "FIT|WHERE|ANSWER|NEXT|NOTE"
BOLD = re.compile(rf"^({HEADS}|results|next)\b", re.MULTILINE)


def fold(lines: Sequence[str]) -> str:
    """Lines as one page of 80 columns; what runs over continues below the text it belongs to."""
    page = []
    for line in "\n".join(lines).splitlines():
        if len(line) <= WIDTH:
            page.append(line)
            continue
        begun = re.match(rf"\s*(?:(?:{HEADS})\s+)?", line)
        head = begun.group() if begun else ""
        beyond = " " * (len(head) if head.strip() else len(head) + 2)
        page += textwrap.wrap(line, WIDTH, subsequent_indent=beyond, break_long_words=False, break_on_hyphens=False)
    return "\n".join(page)


def coloured(stream: TextIO) -> bool:
    """Whether a stream is a terminal that wants colours."""
    return stream.isatty() and "NO_COLOR" not in os.environ and os.environ.get("TERM") != "dumb"


def say(page: str) -> None:
    """Print a page; on a terminal long lines are folded, and the words its paragraphs begin with are bold."""
    page = plain(page)
    if sys.stdout.isatty():
        page = fold(page.splitlines())
    print(BOLD.sub("\033[1m\\1\033[0m", page) if coloured(sys.stdout) else page)


def warn(messages: Iterable[str], noted: Collection[str] = ()) -> None:
    """Warnings, each once, on the error stream; on a terminal without those that the page just printed there has as notes."""
    told = noted if sys.stdout.isatty() and sys.stderr.isatty() else ()
    for message in dict.fromkeys(message for message in messages if message not in told):
        text = plain(f"warning: {message}")
        print(f"\033[33m{text}\033[0m" if coloured(sys.stderr) else text, file=sys.stderr)


def progress(total: int, quiet: bool) -> "tqdm":
    """A bar of cases simulated, on the error stream; a line every `SELDOM_S` where that is no terminal, none if `quiet`."""
    from tqdm import tqdm

    seen = sys.stderr.isatty()
    seldom = {} if seen else {"delay": SELDOM_S, "mininterval": SELDOM_S, "maxinterval": SELDOM_S}
    return tqdm(total=total, unit="case", desc="simulating", disable=quiet, leave=not seen, **seldom)


def complain(message: object) -> None:
    """An error, or what is to be known of a run, on the error stream."""
    print(plain(f"pellet-study: {message}"), file=sys.stderr)


def done(where: object, command: str | None = None, first: str = "") -> None:
    """The last line of an answer: where the results are, which command comes next, and what is to be done before it."""
    say(
        f"\nresults: {where}"
        + (f"; next: {f'{first}, then ' if first else ''}pellet-study {command}" if command else "")
    )


@contextmanager
def working(on: str) -> Iterator[None]:
    """Say on a terminal what is being done and for how long, where it takes over two seconds."""
    from tqdm import tqdm

    if not sys.stderr.isatty():
        yield
        return
    ended = threading.Event()
    bar = tqdm(desc=on, bar_format="{desc}, {elapsed}", leave=False, delay=QUIET_S)

    def tick() -> None:
        while not ended.wait(0.5):
            bar.update(0)
            bar.refresh()

    ticking = threading.Thread(target=tick, daemon=True)
    ticking.start()
    try:
        yield
    finally:
        ended.set()
        ticking.join()
        bar.close()
