"""The encoding of a text file, from its first bytes."""

import codecs

MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
ALL = ("utf-8-sig", "utf-16", "gb18030", "cp1252")
NAMES = {"utf-16": "UTF-16", "gb18030": "GBK (GB 18030)", "cp1252": "Windows-1252"}
COMMON_SHARE = 0.7  # of the double bytes; text in a Western code page has hardly any by chance


def encoding_of(first: bytes, allowed: tuple[str, ...] = ALL) -> str:
    """Python's name of the encoding that a file with these first bytes has; "utf-8-sig" where none is recognised.

    UTF-16 is known by its mark; what is no UTF-8 is GBK where its double bytes are common Chinese characters and
    signs (GB 2312, rows 1 to 9 and 16 to 55), and Windows-1252, which European spreadsheets write, where not.
    """
    marked = next((name for mark, name in MARKS if first.startswith(mark)), None)
    if marked is not None:
        return marked if marked in allowed else "utf-8-sig"
    try:
        codecs.getincrementaldecoder("utf-8")().decode(first)
        return "utf-8-sig"
    except UnicodeDecodeError:
        pass
    if any(byte < 32 and byte not in b"\t\n\r" for byte in first):
        return "utf-8-sig"
    if "gb18030" in allowed and _is_gbk(first):
        return "gb18030"
    return "cp1252" if "cp1252" in allowed and _decodes(first, "cp1252") else "utf-8-sig"


def _is_gbk(first: bytes) -> bool:
    if not _decodes(first, "gb18030"):
        return False
    doubles = common = place = 0
    while place < len(first) - 1:
        if first[place] < 0x80:
            place += 1
            continue
        lead, trail = first[place], first[place + 1]
        doubles += 1
        common += trail >= 0xA1 and (0xA1 <= lead <= 0xA9 or 0xB0 <= lead <= 0xD7)
        place += 2
    return doubles > 0 and common >= COMMON_SHARE * doubles


def _decodes(first: bytes, name: str) -> bool:
    try:
        codecs.getincrementaldecoder(name)().decode(first)
    except UnicodeDecodeError:
        return False
    return True
