"""A picture file as an array of colours."""

import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pellet_study.errors import InputError
from pellet_study.files import opening

if TYPE_CHECKING:
    from PIL.Image import Image as Picture

LONGEST = 1000  # pixels of the longer side that are looked at
SHORTEST = 64
MOST_PIXELS = 60_000_000  # decoded; a JPEG is decoded at a fraction of its size


def read(file: Path) -> np.ndarray:
    """A picture as (rows, columns, 3) array, 0 to 1, upright, its longer side at most `LONGEST` pixels.

    Raises
    ------
    InputError : no picture, or one too small or too large
    """
    from PIL import Image, ImageOps, UnidentifiedImageError

    try:
        content = opening.stream(file)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # its size is looked at below
            opened = Image.open(content)
        with opened:
            if min(opened.size) < SHORTEST:
                raise InputError(
                    f"{file}: {opened.width} x {opened.height} pixels; expected {SHORTEST} or more each way"
                )
            opened.draft("RGB", (2 * LONGEST, 2 * LONGEST))
            if opened.width * opened.height > MOST_PIXELS:
                raise InputError(
                    f"{file}: {opened.width} x {opened.height} pixels; expected at most {MOST_PIXELS // 1_000_000} million, an "
                    f"angle needs no more than {LONGEST} each way; make the picture smaller"
                )
            picture = ImageOps.exif_transpose(_reduced(opened))
            if picture.mode[0] in "IF":  # 16 and 32 bits a pixel
                values = np.asarray(picture, dtype=float)
                dark, bright = np.percentile(values, [0.1, 99.9])  # a pixel that is stuck is not the brightest
                span = float(bright - dark) or 1.0
                picture = Image.fromarray(np.uint8(255 * np.clip((values - dark) / span, 0, 1)))
            if picture.mode in ("RGBA", "LA", "PA") or "transparency" in picture.info:
                picture = picture.convert("RGBA")
                picture = Image.alpha_composite(Image.new("RGBA", picture.size, "white"), picture)
            picture = picture.convert("RGB")
            picture.thumbnail((LONGEST, LONGEST))
            return np.asarray(picture, dtype=float) / 255
    except MemoryError:
        raise InputError(f"{file}: does not fit into memory; make the picture smaller") from None
    except FileNotFoundError:
        raise InputError(f"{file}: no such file") from None
    except Image.DecompressionBombError:
        raise InputError(f"{file}: the picture is too large; make it smaller") from None
    except UnidentifiedImageError:
        raise InputError(f"{file}: is no picture that can be read; expected JPEG, PNG, TIFF or the like") from None
    except (OSError, SyntaxError, ValueError) as error:
        raise InputError(f"{file}: cannot be read as a picture: {error}") from None


def _reduced(picture: "Picture") -> "Picture":
    """A picture much larger than is looked at, made smaller by a whole factor; others as they are."""
    factor = max(picture.size) // (2 * LONGEST)
    if factor < 2:
        return picture
    orientation = picture.getexif()
    whole = picture.convert({"P": "RGBA", "1": "L", "PA": "RGBA", "LA": "RGBA"}.get(picture.mode, picture.mode))
    whole = whole.convert("I") if whole.mode.startswith("I;") else whole
    smaller = whole.reduce(factor)
    smaller.info["exif"] = orientation.tobytes()
    return smaller
