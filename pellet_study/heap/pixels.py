"""A picture file as an array of colours."""

from pathlib import Path

import numpy as np

from pellet_study.errors import InputError

LONGEST = 1000  # pixels of the longer side that are looked at
SHORTEST = 64


def read(file: Path) -> np.ndarray:
    """A picture as (rows, columns, 3) array, 0 to 1, upright, its longer side at most `LONGEST` pixels.

    Raises
    ------
    InputError : no picture, or one too small or too large
    """
    from PIL import Image, ImageOps, UnidentifiedImageError

    try:
        with Image.open(file) as opened:
            if min(opened.size) < SHORTEST:
                raise InputError(
                    f"{file}: {opened.width} x {opened.height} pixels; expected {SHORTEST} or more each way"
                )
            opened.draft("RGB", (2 * LONGEST, 2 * LONGEST))
            picture = ImageOps.exif_transpose(opened)
            if picture.mode[0] in "IF":  # 16 and 32 bits a pixel
                values = np.asarray(picture, dtype=float)
                span = float(np.ptp(values)) or 1.0
                picture = Image.fromarray(np.uint8(255 * (values - values.min()) / span))
            if picture.mode in ("RGBA", "LA", "PA") or "transparency" in picture.info:
                picture = picture.convert("RGBA")
                picture = Image.alpha_composite(Image.new("RGBA", picture.size, "white"), picture)
            picture = picture.convert("RGB")
            picture.thumbnail((LONGEST, LONGEST))
            return np.asarray(picture, dtype=float) / 255
    except FileNotFoundError:
        raise InputError(f"{file}: no such file") from None
    except Image.DecompressionBombError:
        raise InputError(f"{file}: the picture is too large; make it smaller") from None
    except UnidentifiedImageError:
        raise InputError(f"{file}: is no picture that can be read; expected JPEG, PNG, TIFF or the like") from None
    except (OSError, SyntaxError, ValueError) as error:
        raise InputError(f"{file}: cannot be read as a picture: {error}") from None
