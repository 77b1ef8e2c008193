"""What the name of a column says: its unit, and whether it is bookkeeping of the program that wrote the table."""

import re

BRACKETED = re.compile(r"(?P<name>.*\S)\s*[(\[（【](?P<unit>[^()\[\]（）【】]*)[)\]）】]\s*")
SLASHED = re.compile(r"(?P<name>[^/]*[^/\s])\s*/\s*(?P<unit>[^\s,;]{1,16})")
WORD = re.compile(r"[^0-9a-z\u4e00-\u9fff]")

ORDER = {
    *("stdorder", "std", "standardorder", "standard", "runorder", "randomorder", "runno", "runnumber", "trialno"),
    *("标准序", "运行序", "试验序号"),
}
RUN_ORDER = {"runorder", "randomorder", "runno", "runnumber", "run", "order", "trialno", "运行序", "次序"}
"""Of ORDER and COUNT those that say in which order the runs were made, not where they stand in the design."""
COUNT = {
    *("run", "runs", "no", "number", "nr", "lfdnr", "index", "idx", "id", "step", "steps", "trial", "experiment", "exp"),
    *("expno", "experimentno", "test", "testno", "point", "order", "sample", "sampleno", "unnamed0", "rownames", "row"),
    *("versuch", "versuchsnr", "essai", "序号", "编号", "试验号", "实验号", "试验编号", "实验编号", "次序", "步骤"),
}  # fmt: skip
POINT_TYPE = {"pttype", "pointtype", "spacetype", "buildtype", "点类型", "中心点", "centerpt", "centrept"}
BLOCK = re.compile(
    r"(blocks?|blk|blocking|bloc|bloque|days?|dates?|tag|datum|batch(es)?|lots?|charge|shifts?|schicht|weeks?|sessions?|"
    r"operators?|replicates?|reps?|replications?|区组|块|批次|批号|日期|天|班次|操作员|重复)(no|nr|number|id)?\d*"
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
    word = WORD.sub("", split_unit(header)[0].lower())
    for name, known in (("order", ORDER), ("count", COUNT), ("point type", POINT_TYPE)):
        if word in known:
            return name
    for name, pattern in (("block", BLOCK), ("dummy", DUMMY), ("error", ERROR)):
        if pattern.fullmatch(word):
            return name
    return None


def says_run_order(header: str) -> bool:
    """Whether a column's name says that it holds the order in which the runs were made."""
    return WORD.sub("", split_unit(header)[0].lower()) in RUN_ORDER


def several_in(text: str, headers: list[str]) -> list[str]:
    """The headers that a list with commas names, each as `found_in` has it, or the word where it is none.

    A name may hold commas itself: of the words from one on, as many are taken together as are a header.
    """
    words, found = text.split(","), list[str]()
    while words:
        taken = len(words)
        while taken > 1 and found_in(",".join(words[:taken]).strip(), headers) is None:
            taken -= 1
        name = ",".join(words[:taken]).strip()
        found.append(found_in(name, headers) or name)
        words = words[taken:]
    return found


def found_in(name: str, headers: list[str]) -> str | None:
    """The header that a user means by a name: itself, or the only one that is this name with a unit."""
    if name in headers:
        return name
    bare = [header for header in headers if split_unit(header)[0] == name]
    return bare[0] if len(bare) == 1 else None
