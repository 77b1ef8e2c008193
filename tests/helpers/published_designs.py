"""Tables of designs that others published, with their answers in the tests that use them."""

import numpy as np
import pandas as pd

TREAD_FACTORS = ["silica", "silane", "sulfur"]
TREAD_RESPONSES = ["abrasion", "modulus", "elongation", "hardness"]


def tyre_tread() -> pd.DataFrame:
    """The tyre tread compound of Derringer and Suich 1980: silica, silane and sulfur (coded), axial points at 1.633.

    As printed in the vignette of the R package qualityTools (CRAN, version 1.55, section 5.8): the responses y1 to y4;
    the order of the runs is that of its `[c(5,2,3,8,1,6,7,4,9:20),]` undone.
    """
    a = 1.633
    rows = [
        (-1, -1, 1, 102, 900, 470, 67.5), (1, -1, -1, 120, 860, 410, 65), (-1, 1, -1, 117, 800, 570, 77.5),
        (1, 1, 1, 198, 2294, 240, 74.5), (-1, -1, -1, 103, 490, 640, 62.5), (1, -1, 1, 132, 1289, 270, 67),
        (-1, 1, 1, 132, 1270, 410, 78), (1, 1, -1, 139, 1090, 380, 70), (-a, 0, 0, 102, 770, 590, 76),
        (a, 0, 0, 154, 1690, 260, 70), (0, -a, 0, 96, 700, 520, 63), (0, a, 0, 163, 1540, 380, 75),
        (0, 0, -a, 116, 2184, 520, 65), (0, 0, a, 153, 1784, 290, 71), (0, 0, 0, 133, 1300, 380, 70),
        (0, 0, 0, 133, 1300, 380, 68.5), (0, 0, 0, 140, 1145, 430, 68), (0, 0, 0, 142, 1090, 430, 68),
        (0, 0, 0, 145, 1260, 390, 69), (0, 0, 0, 142, 1344, 390, 70),
    ]  # fmt: skip
    return pd.DataFrame(rows, columns=[*TREAD_FACTORS, *TREAD_RESPONSES])


def worsted_yarn() -> pd.DataFrame:
    """Cycles to failure of worsted yarn over length (mm), amplitude (mm) and load (g), 3 x 3 x 3: Box and Cox 1964.

    As printed in the help page of `eql` of the R package EQL; the data set Wool of the R package carData agrees but for
    its row 16 (443 for 442).
    """
    cycles = [
        674, 370, 292, 338, 266, 210, 170, 118, 90, 1414, 1198, 634, 1022, 620, 438, 442, 332, 220,
        3636, 3184, 2000, 1568, 1070, 566, 1140, 884, 360,
    ]  # fmt: skip
    levels = np.array(np.meshgrid([250, 300, 350], [8, 9, 10], [40, 45, 50], indexing="ij")).reshape(3, -1).T
    return pd.DataFrame(levels, columns=["length", "amplitude", "load"]).assign(cycles=cycles)
