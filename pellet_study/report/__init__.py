"""One self-contained HTML page about a study, made of the files in its folder: `write(folder)`.

parts, beside < particles, criticism, missing, bench, powder < measured < page
"""

from pathlib import Path

__all__ = ["write"]


def write(folder: Path, library: Path | None = None) -> Path:
    """Write the page of a study; returns its absolute path. See `page.write`."""
    from pellet_study.report import page  # jinja2 and matplotlib only where a page is made

    return page.write(folder, library)
