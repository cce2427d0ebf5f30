"""Files that a scene names: where they are looked for, and tables of two columns."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError, nearest_name
from etendue.formats.encodings import decoded
from etendue.formats.rays.text_rows import number

Array = npt.NDArray[np.float64]

LARGEST_TABLE = 1 << 26
"""Most bytes of a table in a text file."""


@dataclasses.dataclass(frozen=True)
class Files:
    """The folder from which relative paths of a scene count.

    Examples
    --------
    >>> Files(Path("luminaires")).find("led.tm25ray").as_posix()
    'luminaires/led.tm25ray'
    """

    folder: Path = Path()

    def find(self, name: str | Path) -> Path:
        """The path of a file that the scene names."""
        return self.folder / name


def no_such_file(path: str | Path) -> str:
    """What to say of a file that is not there: its path, and the nearest name in its folder.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     _ = (Path(folder) / "pet.h5").write_bytes(b"")
    ...     no_such_file(Path(folder) / "pett.h5").replace(folder, "…")
    "there is no file …/pett.h5. Did you mean 'pet.h5'?"
    """
    missing = Path(path)
    try:
        near = nearest_name(missing.name, [one.name for one in missing.parent.iterdir()])
    except OSError:
        near = None
    return f"there is no file {missing}" + (f". Did you mean {near!r}?" if near else "")


def read_columns(path: Path) -> Array:
    r"""Two columns of numbers from a text file, sorted by the first, shape (n, 2).

    Columns are parted by commas, semicolons or blanks; what follows ``#`` is left out.

    Raises
    ------
    FormatError
        If a line does not hold two finite numbers, or the first column holds a number twice.
    OSError
        If the file cannot be opened.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "index.csv"
    ...     _ = path.write_text("700, 1.4\n400, 1.6")
    ...     read_columns(path).tolist()
    [[400.0, 1.6], [700.0, 1.4]]
    """
    with path.open("rb") as file:
        data = file.read(LARGEST_TABLE + 1)
    if len(data) > LARGEST_TABLE:
        raise FormatError(path, "length", "more than 64 MiB", "A table of a material has some hundred lines.")
    rows: list[tuple[float, float]] = []
    for at, line in enumerate(decoded(path, data).splitlines(), 1):
        words = line.partition("#")[0].replace(",", " ").replace(";", " ").split()
        if not words:
            continue
        try:
            first, second = map(number, words)
        except ValueError:
            found = f"{line[:60]!r}"
            raise FormatError(path, f"line {at}", found, "Each line holds two numbers; # begins a remark.") from None
        rows.append((first, second))
    table = np.array(sorted(rows), dtype=np.float64).reshape(-1, 2)
    if not len(table):
        raise FormatError(path, "whole file", "there are no numbers", "Each line holds two numbers.")
    if not np.isfinite(table).all():
        raise FormatError(path, "numbers", "one is not finite", "Take the line out.")
    if (np.diff(table[:, 0]) <= 0.0).any():
        raise FormatError(path, "first column", "a number stands there twice", "Keep one of the lines.")
    return table
