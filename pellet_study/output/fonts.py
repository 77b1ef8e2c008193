"""Which fonts the figures are drawn with, and which letters none of them has.

The first is matplotlib's own; those for other scripts follow where they are installed, for the letters it lacks.
Matplotlib is imported when a figure is asked for.
"""

from functools import lru_cache

FIRST = "DejaVu Sans"
OTHERS = (
    *("Noto Sans CJK SC", "Noto Sans CJK TC", "Noto Sans CJK JP", "Noto Sans CJK KR", "Noto Sans SC", "Noto Sans JP"),
    *("Source Han Sans SC", "Source Han Sans CN", "WenQuanYi Micro Hei", "WenQuanYi Zen Hei", "Droid Sans Fallback"),
    *("Microsoft YaHei", "SimHei", "SimSun", "DengXian", "PingFang SC", "Hiragino Sans GB", "Heiti SC", "STHeiti"),
    *("Songti SC", "AR PL UMing CN", "AR PL UKai CN", "IPAexGothic", "IPAGothic", "TakaoGothic", "Yu Gothic"),
    *("Hiragino Sans", "NanumGothic", "Malgun Gothic", "Apple SD Gothic Neo", "Arial Unicode MS", "Unifont"),
    *("Noto Sans Arabic", "Noto Sans Devanagari", "Noto Sans Thai", "Noto Sans Hebrew", "Noto Sans"),
)


@lru_cache(1)
def families() -> list[str]:
    """The families to draw with, in the order in which a letter is looked for."""
    from matplotlib.font_manager import fontManager

    installed = {font.name for font in fontManager.ttflist}
    return [FIRST, *(name for name in OTHERS if name in installed)]


@lru_cache(1)
def _faces() -> list:
    from matplotlib.font_manager import FontProperties, fontManager, get_font

    return [get_font(fontManager.findfont(FontProperties(family=[name]))) for name in families()]


@lru_cache(4096)
def _has(letter: str) -> bool:
    return letter.isspace() or any(face.get_char_index(ord(letter)) for face in _faces())


def missing(text: str) -> str:
    """The letters of a text that no font has."""
    return "".join(dict.fromkeys(letter for letter in text if not _has(letter)))
