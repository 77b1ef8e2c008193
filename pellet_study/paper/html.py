"""An audit as a page, and as a table for a page of one's own."""

import html

from pellet_study.paper.verdicts import Item, counts


def page(items: list[Item], title: str) -> str:
    """The audit as one self-contained HTML page."""
    summary = ", ".join(f"{number} {verdict}" for verdict, number in counts(items).items())
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        f"<title>{html.escape(title)}</title>\n"
        "<style>body{font:15px sans-serif;margin:2em;max-width:80em}table{border-collapse:collapse}"
        "td,th{border-bottom:1px solid #ccc;padding:.3em .6em;text-align:left;vertical-align:top}"
        ".inconsistent{background:#f6dcdc;font-weight:bold}</style></head>\n<body>\n"
        f"<h1>{html.escape(title)}</h1>\n"
        f"<p>{len(items)} items: {html.escape(summary)}.</p>\n{section(items)}\n</body></html>\n"
    )


def section(items: list[Item]) -> str:
    """The audit as an HTML table, for a page of one's own."""
    head = ("section", "item", "published", "recomputed", "verdict", "reason")
    lines = ["<table>", "<tr>" + "".join(f"<th>{name}</th>" for name in head) + "</tr>"]
    for item in items:
        cells = [item.section, item.item, item.published, shown(item.recomputed), item.verdict, item.reason]
        marked = "".join(f"<td>{html.escape(cell)}</td>" for cell in cells)
        lines.append(f'<tr class="{item.verdict.replace(" ", "-")}">{marked}</tr>')
    return "\n".join([*lines, "</table>"])


def shown(value) -> str:
    """A recomputed value for reading."""
    if value is None:
        return "-"
    return value if isinstance(value, str) else f"{value:.7g}"
