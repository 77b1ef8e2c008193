"""What the name of a column says: its unit, and whether it is bookkeeping of the program that wrote the table."""

import re
import unicodedata

BRACKETED = re.compile(r"(?P<name>.*\S)\s*[(\[（【](?P<unit>[^()\[\]（）【】]*)[)\]）】]\s*")
SLASHED = re.compile(r"(?P<name>[^/]*[^/\s])\s*/\s*(?P<unit>[^\s,;]{1,16})")
NO_LETTER = re.compile(r"[^0-9a-z\u4e00-\u9fff]")

ORDER = {
    *("stdorder", "std", "standardorder", "standard", "runorder", "randomorder", "runno", "runnumber", "trialno"),
    *("标准序", "运行序", "试验序号"),
}
RUN_ORDER = {"runorder", "randomorder", "runno", "runnumber", "run", "order", "trialno", "运行序", "次序"}
"""Of ORDER and of the columns that count those that say in which order the runs were made, not where they stand in the design."""

RUN = (
    "runs?|trials?|tests?|exp|experiments?|samples?|specimens?|steps?|points?|rows?|obs|observations?|order|"
    "lauf|versuchs?|experimente?|proben?|schritt|punkt|zeile|reihe|"
    "essais?|experience|echantillon|etape|ligne|pruebas?|corridas?|ensayos?|experimentos?|muestra|paso|fila|"
    "ensaios?|amostra|passo|prova|esperimento|campione|试验|实验|样品|样本|运行|步骤"
)
NUMBER = "n|nos?|nr|num|number|nummer|numero|id|ids|idx|index|code|序号|编号|号|次序|番号|番"
COUNT = re.compile(
    rf"({RUN})?({NUMBER})|({NUMBER})(de|del|der|des|d|of|do|di)?({RUN})|({RUN})|"
    r"(lfd|lfde|laufende|fortlaufende|s|sl|sr|serial)(nr|no|nummer|number)|unnamed0|rownames"
)
"""What a column that numbers or names its rows is called, in some languages and either order of the words."""
POINT_TYPE = {"pttype", "pointtype", "spacetype", "buildtype", "点类型", "中心点", "centerpt", "centrept"}
BLOCK = re.compile(
    r"(blocks?|blk|blocking|bloc|bloque|days?|dates?|tag|datum|batch(es)?|lots?|charge|shifts?|schicht|weeks?|sessions?|"
    r"operators?|replicates?|reps?|replications?|jour|dia|fecha|giorno|lote|lotto|turno|区组|块|批次|批号|日期|天|班次|操作员|重复)(no|nr|number|id)?\d*"
)
DUMMY = re.compile(
    r"(dummy|dummies|dum|blank|unused|spare|empty|unassigned|虚拟|空列|空白|误差列|哑)(变量|因素|列|factor|column|var)?\d*[a-z]?"
)
ERROR = re.compile(
    r"(relative|rel|absolute|abs|angle)?(error|err|deviation|误差|相对误差|绝对误差|fehler)(percent|pct)?"
)


def split_unit(header: str) -> tuple[str, str]:
    """Name and unit of a column: `G (J/m^2)`, `time [min]` and `温度/℃` have one; "" where there is none."""
    found = BRACKETED.fullmatch(header) or SLASHED.fullmatch(header)
    return (found["name"].strip(), found["unit"].strip()) if found else (header, "")


def role(header: str) -> str | None:
    """`order`, `count`, `point type`, `block`, `dummy` or `error` where a column's name says so, else None.

    `order` is certain (a statistics program wrote it); `count` is so only if the column counts.
    """
    word = _word(header)
    for name, known in (("order", ORDER), ("point type", POINT_TYPE)):
        if word in known:
            return name
    for name, pattern in (("count", COUNT), ("block", BLOCK), ("dummy", DUMMY), ("error", ERROR)):
        if pattern.fullmatch(word):
            return name
    return None


def says_run_order(header: str) -> bool:
    """Whether a column's name says that it holds the order in which the runs were made."""
    return _word(header) in RUN_ORDER


def _word(header: str) -> str:
    """The letters of a name without accents, blanks and points: `Versuchs-Nr.` is `versuchsnr`, `Nº` and `#` are `no`."""
    plain = unicodedata.normalize("NFKD", split_unit(header)[0].replace("#", "no"))
    return NO_LETTER.sub("", plain.lower())


def found_in(name: str, headers: list[str]) -> str | None:
    """The header that a user means by a name: itself, or the only one that is this name with a unit."""
    if name in headers:
        return name
    bare = [header for header in headers if split_unit(header)[0] == name]
    return bare[0] if len(bare) == 1 else None
