"""What mkdocs does besides: files of results/ that pages show or link are put beside the pages."""

import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files, InclusionLevel

ROOT = Path(__file__).resolve().parents[2]
OUTSIDE = re.compile(r"\]\((?:\.\./)+(results/[^)#\s]+)\)")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add what the pages name of results/."""
    for page in files.documentation_pages():
        for name in OUTSIDE.findall(page.content_string):
            if files.get_file_from_path(name) is None:
                beside = File.generated(
                    config, name, abs_src_path=str(ROOT / name), inclusion=InclusionLevel.NOT_IN_NAV
                )
                files.append(beside)
    return files


def on_page_markdown(markdown: str, page: object, config: MkDocsConfig, files: Files) -> str:
    """results/ lies beside the pages in the site, above them in the project."""
    up = "../" * page.file.src_uri.count("/")  # type: ignore[attr-defined]
    return OUTSIDE.sub(lambda found: f"]({up}{found[1]})", markdown)
