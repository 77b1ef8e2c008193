"""Pages of docs/reference, made of what the code declares: run `make reference` where a test says that they are stale."""

import argparse
import ast
import importlib
import inspect
import sys
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import pellet_study
from pellet_study.commands import COMMANDS, SIMULATING, simulating
from pellet_study.rigs.catalogue import standard
from pellet_study.rigs.declarations import OF_EVERY_RIG, ON_YADE
from pellet_study.rigs.declared import Effect, Rig
from pellet_study.rigs.known import OBSERVABLES
from pellet_study.study.load import CONTACT_LAWS, EFFORT, KEYS
from pellet_study.study.measurements import COLUMNS, REQUIRED
from pellet_study.study.ranges import reading_words
from pellet_study.study.study import RESTITUTION_AT, SCALINGS, SEEDS_BY
from pellet_study.study.values import KEYS_OF_SETTING

DOCS = Path(__file__).resolve().parents[1]
ROOT = DOCS.parent
MADE = "<!-- made by `make reference` of what the code declares: change it there -->"
STUDY = {
    "contact_law": CONTACT_LAWS,
    "surface_energy_scaling": tuple(SCALINGS),
    "restitution_at": tuple(RESTITUTION_AT),
    "seeds_by": SEEDS_BY,
}


def cell(value: object) -> str:
    """Text within a table."""
    return " ".join(str(value).split()).replace("|", "\\|")


def table(header: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """A table of Markdown; `-` where there is nothing to say."""
    header = list(header)
    lines = [header, ["---"] * len(header), *([cell(v) or "-" for v in row] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def words(names: Iterable[str]) -> str:
    """Names as code, with commas."""
    return ", ".join(f"`{name}`" for name in names)


def number(value: float) -> str:
    """A number with the digits it needs."""
    return f"{value:.6g}"


def page(title: str, *parts: str) -> str:
    """A page."""
    return "\n\n".join([f"# {title}", MADE, *(part for part in parts if part)]) + "\n"


def measurements_page() -> str:
    """Columns of measurements.csv."""
    catalogue = standard()
    rows = [(f"`{name}`", "yes" if name in REQUIRED else "no", meaning) for name, meaning in COLUMNS.items()]
    rigs = [
        (f"`{rig.name}`", words(rig.observables), words(rig.conditions), words(rig.parameters))
        for rig in catalogue.rigs.values()
    ]
    return page(
        "measurements.csv",
        "A row is a reading, or a mean of `n` readings. Any other column, or one that is given twice, is refused.",
        table(("column", "required", "meaning"), rows),
        "## Columns of the rigs",
        "Each condition of a rig may have a column of its name, its unit in it; where no row gives it, its default is assumed, "
        "and every answer says so. A column named like a parameter says that its value is known for that row, where it is then "
        "not fitted. Ranges and defaults: [rigs](rigs.md).",
        table(("rig", "observables", "conditions", "parameters"), rigs),
    )


def study_page() -> str:
    """Keys of study.toml."""
    rows = [(f"`{name}`", meaning, words(STUDY.get(name, ()))) for name, meaning in KEYS.items()]
    return page(
        "study.toml",
        "Any other key is refused.",
        table(("key", "meaning", "one of"), rows),
        f"A parameter, of a rig or of an effect, is a number (fixed) or a table of {words(KEYS_OF_SETTING)}: `min` and `max` make it "
        f"free, `value` is where its fit begins. `effort` lies from {number(EFFORT['min'])} to {number(EFFORT['max'])}; "
        "1 is the default. Names, ranges and defaults: [rigs](rigs.md), [effects](effects.md).",
    )


def quantities(declared: Mapping[str, Mapping]) -> str:
    """A table of declared parameters or conditions."""
    rows = []
    for name, q in declared.items():
        of = words(q["options"]) if "options" in q else f"{number(q['min'])} to {number(q['max'])}"
        default = q.get("default", q.get("absent"))
        rows.append(
            (
                f"`{name}`",
                default if isinstance(default, str) else number(default),
                of,
                q.get("unit", ""),
                q.get("meaning", ""),
                *((span(q["physical"]) if "physical" in q else of, q["source"]) if "source" in q else ()),
            )
        )
    sourced = all("source" in q for q in declared.values())
    head = ("name", "default", "from, to", "unit", "meaning", *(("usual", "usual range from") if sourced else ()))
    return table(head, rows)


def span(ends: Iterable[float]) -> str:
    """A range."""
    return " to ".join(map(number, ends))


def rig_part(rig: Rig, acting: Iterable[str]) -> list[str]:
    """What a rig declares."""
    engine = "On YADE" if rig.on_yade else "Closed form"
    file = rig.file.relative_to(ROOT) if rig.file else ""
    laws = f"; contact laws {words(rig.contact_laws)}" if rig.contact_laws else ""
    parts = [f"## {rig.name}", f"{engine}, `{file}`{laws}. Effects that act in it: {words(acting)}."]
    parts += [
        table(
            ("observable", "unit", "can be read", "usual", "meaning", "usual range from"),
            (
                (
                    f"`{n}`",
                    rig.units[n],
                    reading_words(*rig.readable[n], ""),
                    span(rig.usual[n]),
                    meaning,
                    OBSERVABLES[n].source,
                )
                for n, meaning in rig.observables.items()
            ),
        )
    ]
    for title, declared in (
        ("Conditions", rig.conditions),
        ("Parameters", rig.parameters),
        ("Numerics", rig.numerics),
    ):
        parts += [f"### {title} of {rig.name}", quantities(declared)] if declared else []
    return parts


def rigs_page() -> str:
    """What every rig of the package declares."""
    catalogue = standard()
    parts = [part for rig in catalogue.rigs.values() for part in rig_part(rig, catalogue.acting(rig.name))]
    return page(
        "Rigs",
        f"A rig's file declares `RIG`, a dict with {words(OF_EVERY_RIG)}, on YADE also {words(ON_YADE)}, and has `predict` (a closed "
        "form) or `simulate` (on YADE): [add your own rig and effect](../add_a_rig_and_an_effect.md). Every parameter lies within its "
        "range; a condition may lie beyond its usual range, and is then warned of. Numerics are set by hand only, in cases.",
        *parts,
    )


def effect_part(effect: Effect) -> list[str]:
    """What an effect declares."""
    rows = []
    kinds = {"": effect.parameters} if not effect.parameters_in else effect.parameters_in
    for rig, declared in kinds.items():
        for name, q in declared.items():
            low, high = q.get("physical", (q["min"], q["max"]))
            absent = number(q["absent"]) if "absent" in q else "-"
            rows.append((f"`{name}`", rig, absent, f"{number(low)} to {number(high)}", q["unit"], q["meaning"]))
    return [
        f"## {effect.name}",
        f"{effect.means[0].upper()}{effect.means[1:]}: `{cell(effect.formula)}`. To expect: {effect.signature}.",
        table(("parameter", "in", "absent", "physical range", "unit", "meaning"), rows),
        table(("rig", "where it shows"), ((f"`{rig}`", where) for rig, where in effect.rigs.items())),
        f"Source: {effect.source}.",
    ]


def effects_page() -> str:
    """What every effect of the package declares."""
    effects = standard().effects
    return page(
        "Effects",
        "An effect's file declares `EFFECT`; its first parameter is the amount, whose value in the column `absent` means that it is "
        "not there. An amount beyond the physical range is called implausible and is never added.",
        table(("effect", "acts in"), ((f"[{e.name}](#{e.name})", words(e.rigs)) for e in effects.values())),
        *(part for effect in effects.values() for part in effect_part(effect)),
    )


def option(action: argparse.Action) -> tuple[str, str]:
    """An argument of a command and what it does."""
    shown = action.metavar if isinstance(action.metavar, str) else " ".join(action.metavar or ())
    value = shown or ("|".join(map(str, action.choices)) if action.choices else action.dest.upper())
    if action.nargs == 0:
        value = ""
    name = f"{', '.join(action.option_strings)} {value}".strip() if action.option_strings else value
    help_of = action.help or ""
    for what, told in (("%(default)s", action.default), ("%(default)g", action.default)):
        help_of = help_of.replace(what, str(told) if what.endswith("s") else number(told) if what in help_of else "")
    return f"`{cell(name)}`", help_of.replace("%%", "%")


def arguments(parser: argparse.ArgumentParser) -> str:
    """A table of the arguments of a command."""
    rows = [option(a) for a in parser._actions if a.dest not in ("help", "verb") and a.help != argparse.SUPPRESS]
    return table(("argument", "meaning"), rows) if rows else ""


def verbs(parser: argparse.ArgumentParser) -> list[str]:
    """Commands of a command, with their arguments."""
    within = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
    return [
        part
        for action in within
        for name, verb in action.choices.items()
        for part in (
            f"### {parser.prog} {name}",
            f"{verb.description[0].upper()}{verb.description[1:]}.",
            arguments(verb),
        )
    ]


def commands_page() -> str:
    """Every command with its arguments."""
    parts = []
    for name, summary in COMMANDS.items():
        parser = argparse.ArgumentParser(prog=name)
        module = importlib.import_module(f"pellet_study.commands.{name}")
        module.add_arguments(parser)
        if name in SIMULATING:
            simulating.add_arguments(parser)
        parts += [f"## {name}", f"{summary[0].upper()}{summary[1:]}.", arguments(parser), *verbs(parser)]
        parts += [f"```text\n{parser.epilog.strip()}\n```"] if parser.epilog else []
    return page(
        "Commands",
        "`pellet-study COMMAND ...`; each also takes `--json FILE` (the answer, [machine-readable](json.md)) and `--force` (write over "
        "files that the program did not write). Exit status: 0 answered, 2 wrong input, 3 simulations failed where the answer needs "
        "them, 130 interrupted.",
        *parts,
    )


def signature(node: ast.FunctionDef) -> str:
    """`name(arguments) -> what`, as it is written."""
    returns = f" -> {ast.unparse(node.returns)}" if node.returns else ""
    return f"{node.name}({ast.unparse(node.args)}){returns}"


def definition(thing: object) -> ast.AST:
    """The parsed definition of a function or class."""
    return ast.parse(inspect.getsource(thing)).body[0]  # type: ignore[arg-type]


def python_page() -> str:
    """Every public name of the package."""
    parts = []
    for name in pellet_study.__all__:
        thing = getattr(pellet_study, name)
        told = inspect.cleandoc(thing.__doc__ or "")
        if inspect.ismodule(thing):
            parts += [f"## ps.{name}", f"The module `{thing.__name__}`: {told.splitlines()[0]}"]
            continue
        node = definition(thing)
        heading = signature(node) if isinstance(node, ast.FunctionDef) else f"class {name}"
        parts += [f"## ps.{name}", f"```python\n{heading}\n```", f"```text\n{told}\n```"]
    return page("Python", "`import pellet_study as ps`; how they go together: [from Python](../python.md).", *parts)


def json_page() -> str:
    """Keys of the answers."""
    from json_keys import MEANINGS  # beside this file

    parts = [
        part
        for command, meanings in MEANINGS.items()
        for part in (f"## {command}", table(("key", "meaning"), ((f"`{key}`", told) for key, told in meanings.items())))
    ]
    return page(
        "JSON of the answers",
        "`--json FILE` writes it, `answer.json` of Python is the same. What is unknown is null; p values are between 0 and 1; "
        "`compare.json`, `diagnose.json`, `refine.json` and `history.json` in the study hold the last answer. `rows[].sd` is a key of "
        "every entry of `rows`, `fit.grade` one within `fit`; braces stand for names of the study's own.",
        *parts,
    )


PAGES: dict[str, Callable[[], str]] = {
    "measurements": measurements_page,
    "study_toml": study_page,
    "json": json_page,
    "rigs": rigs_page,
    "effects": effects_page,
    "commands": commands_page,
    "python": python_page,
}


def pages() -> dict[Path, str]:
    """Every page by its file."""
    sys.path.insert(0, str(Path(__file__).parent))
    try:
        return {DOCS / "reference" / f"{name}.md": made() for name, made in PAGES.items()}
    finally:
        sys.path.remove(str(Path(__file__).parent))


if __name__ == "__main__":
    for file, text in pages().items():
        file.write_text(text, encoding="utf-8")
