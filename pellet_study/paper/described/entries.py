"""The tables of a TOML file, their keys taken one by one; an error names file, table, key and what is expected."""

from collections.abc import Collection
from pathlib import Path

from pellet_study.errors import InputError
from pellet_study.files.toml import toml_in
from pellet_study.output.words import nearest
from pellet_study.paper.verdicts import is_printed

REQUIRED = object()


class Entry:
    """One table of the file.

    Parameters
    ----------
    content : dict
        Its keys; what `take` and its kin do not ask for is an error when `close` is called.
    file : Path
    place : str
        Of the table in the file, such as `[[analysis]] 1`; empty for the file itself.
    """

    def __init__(self, content: dict, file: Path, place: str = ""):
        self.content, self.file, self.place = content, file, place
        self.asked: list[str] = []

    def fail(self, key: str, expected: str):
        """Raise the error of a key.

        Raises
        ------
        InputError
            Always.
        """
        where = f"{self.file}{', ' + self.place if self.place else ''}, key {key!r}"
        found = f"found {self.content[key]!r}" if key in self.content else "it is missing"
        raise InputError(f"{where}: expected {expected}; {found}")

    def take(self, key: str, kind: type | tuple[type, ...], expected: str, default=REQUIRED):
        """The value of a key."""
        self.asked.append(key)
        if key not in self.content:
            return self.fail(key, expected) if default is REQUIRED else default
        value = self.content[key]
        if not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool):
            self.fail(key, expected)
        return value

    def text(self, key: str, expected: str = "a text in quotes", default=REQUIRED) -> str:
        return self.take(key, str, expected, default)

    def number(self, key: str, expected: str = "a number", default=REQUIRED) -> float:
        value = self.take(key, (int, float), expected, default)
        return value if value is None else float(value)

    def choice(self, key: str, accepted: Collection[str], default=REQUIRED) -> str:
        expected = f"one of {', '.join(map(repr, accepted))}"
        value = self.text(key, expected, default)
        if value is not None and value not in accepted:
            self.fail(key, expected)
        return value

    def words(self, key: str, expected: str = 'a list of texts such as ["A", "B"]', default=()) -> list[str]:
        value = self.take(key, (str, list), expected, default)
        value = [value] if isinstance(value, str) else list(value)
        if not all(isinstance(word, str) for word in value):
            self.fail(key, expected)
        return value

    def printed(self, key: str, default=REQUIRED) -> str:
        """A number as printed: a text, so that its last digit is known."""
        expected = 'the number as printed, in quotes, such as "0.30" or "<0.0001"'
        value = self.text(key, expected, default)
        if value is not None and not is_printed(value):
            self.fail(key, expected)
        return value

    def exact(self, key: str, default=REQUIRED) -> str:
        """A number as printed that is no bound."""
        value = self.printed(key, default)
        if value is not None and value.strip().startswith("<"):
            self.fail(key, 'a number as printed, in quotes, that is no bound, such as "0.30"')
        return value

    def printed_list(self, key: str) -> list[str]:
        values = self.words(key, 'a list of numbers as printed, such as ["-0.92", "-1.32"]')
        if not all(map(is_printed, values)):
            self.fail(key, 'a list of numbers as printed, such as ["-0.92", "-1.32"]')
        return values

    def table(self, key: str) -> "Entry":
        """A table below this one; empty where it is not there."""
        content = self.take(key, dict, "a table of keys", {})
        return Entry(content, self.file, f"{self.place}.{key}" if self.place else f"[{key}]")

    def tables(self, key: str) -> list["Entry"]:
        """The tables `[[key]]`."""
        content = self.take(key, list, f"tables headed [[{key}]]", [])
        if not all(isinstance(table, dict) for table in content):
            self.fail(key, f"tables headed [[{key}]]")
        return [Entry(table, self.file, f"[[{key}]] {k}") for k, table in enumerate(content, start=1)]

    def printed_table(self, key: str) -> dict[str, str]:
        """{name: number as printed}."""
        below = self.table(key)
        return {name: below.printed(name) for name in below.content}

    def close(self) -> None:
        """Refuse keys that nobody asked for."""
        unknown = [key for key in self.content if key not in self.asked]
        if unknown:
            self.fail(unknown[0], f"a key that is known here{nearest(unknown[0], self.asked)}")


def read(file: Path) -> Entry:
    """The file's own table.

    Raises
    ------
    InputError
        If it cannot be read or is not TOML.
    """
    return Entry(
        toml_in(file, "a paper is described by a paper.toml in its folder (docs/audit_a_paper.md)", "not TOML"), file
    )
