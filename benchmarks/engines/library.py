"""An engine of the LAMMPS family in this process: its library, fed with the commands of its input language.

LIGGGHTS descends from LAMMPS, and both still offer the same few C functions. An error ends the process; what the engine said of it
stands in the file `said`.
"""

import ctypes
from pathlib import Path

import numpy as np

SAID = "engine.txt"
LONGEST = 100  # numbers in a list of a command: LIGGGHTS reads lines of 2,048 characters


class Library:
    """One running engine.

    Parameters
    ----------
    name : of the shared library
    folder : for what it says
    """

    def __init__(self, name: str, folder: Path):
        self._library = ctypes.CDLL(name)
        words = [b"engine", b"-log", b"none", b"-screen", str(folder / SAID).encode()]
        given, handle = (ctypes.c_char_p * len(words))(*words), ctypes.c_void_p()
        begin = self._library.lammps_open_no_mpi
        begin.restype = ctypes.c_void_p
        if hasattr(self._library, "lammps_version"):  # a newer LAMMPS returns the handle
            handle = ctypes.c_void_p(begin(len(words), given, None))
        else:
            begin(len(words), given, ctypes.byref(handle))
        self._handle = handle
        for function in ("lammps_extract_atom", "lammps_extract_global"):
            getattr(self._library, function).restype = ctypes.c_void_p

    def do(self, *commands: str) -> None:
        """Carry out commands."""
        for command in commands:
            self._library.lammps_command(self._handle, command.encode())

    def numbers(self) -> np.ndarray:
        """Numbers of the grains there are, in the engine's order of the moment."""
        return np.ctypeslib.as_array(self._of("id", ctypes.c_int), (self._count(),)).copy()

    def vectors(self, name: str) -> np.ndarray:
        """(n, 3) array of a vector that each grain has, such as `x` or `v`, in the same order."""
        rows = self._of(name, ctypes.POINTER(ctypes.c_double))
        return np.ctypeslib.as_array(rows[0], (self._count(), 3)).copy()

    def erase(self, numbers: np.ndarray) -> None:
        """Take grains away."""
        for start in range(0, len(numbers), LONGEST):
            self.do("group gone id " + " ".join(map(str, numbers[start : start + LONGEST])))
        self.do("delete_atoms group gone compress no", "group gone delete")

    def _of(self, name: str, kind: type):
        address = self._library.lammps_extract_atom(self._handle, name.encode())
        return ctypes.cast(address, ctypes.POINTER(kind))

    def _count(self) -> int:
        address = self._library.lammps_extract_global(self._handle, b"nlocal")
        return ctypes.cast(address, ctypes.POINTER(ctypes.c_int))[0]
