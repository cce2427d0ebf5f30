"""How the threshold of the gridded algorithm was found: one row of measures for each."""

from __future__ import annotations

import csv
import dataclasses
import io
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.provenance import Provenance

Array = npt.NDArray[np.float64]

COLUMNS: dict[str, str] = {
    "threshold": "of E [%]",
    "bins": "mean number of bins of a patch",
    "unreached": "patches whose E is above the threshold even with the finest bins",
    "error": "E of eq. 3.3, mean over patches by their flux [%]",
    "table_flux": "exact integral of the tables over the flux of the rays",
    "ncc": "eq. 3.5 between the far field of the patches and that of the rays",
    "nrmse_thesis": "eq. 3.6 as printed",
    "nrmse": "true RMSE over the maximum of the rays' far field",
    "score": "held-out ln likelihood per ray, against a uniform light field [nat]",
    "score_error": "standard error of `score` [nat]",
}
"""What each column is."""


@dataclasses.dataclass(frozen=True, eq=False)
class ThresholdSweep:
    """Measures of gridded sources over their threshold; made by `etendue.goniophotometry.threshold_sweep`.

    Parameters
    ----------
    columns : dict of arrays, shape (t,)
        Keys of `COLUMNS`, one value for each threshold.
    patches : int
        Lit pixels.
    rays, held_out : int
        Rays on the surface in all, and those among them that only judged.
    provenance : Provenance

    Raises
    ------
    ArgumentError
        If a column is missing or has another length.

    Examples
    --------
    >>> columns = {name: np.array([1.0, 2.0]) for name in COLUMNS}
    >>> sweep = ThresholdSweep(columns | {"score": np.array([3.0, 2.5])}, patches=4, rays=100, held_out=10)
    >>> sweep.best("score"), sweep.best("ncc"), sweep["score"].tolist()
    (0, 1, [3.0, 2.5])
    """

    columns: dict[str, Array]
    patches: int
    rays: int
    held_out: int
    provenance: Provenance = dataclasses.field(default_factory=Provenance)

    def __post_init__(self) -> None:
        arrays = {name: np.array(values, dtype=np.float64) for name, values in self.columns.items()}
        shapes = {array.shape for array in arrays.values()}
        if set(arrays) != set(COLUMNS) or len(shapes) != 1 or len(shapes.pop()) != 1:
            raise ArgumentError(f"ThresholdSweep: give one row each of {', '.join(COLUMNS)}, all of one length.")
        for array in arrays.values():
            array.setflags(write=False)
        object.__setattr__(self, "columns", {name: arrays[name] for name in COLUMNS})

    def __getitem__(self, name: str) -> Array:
        """A column."""
        return self.columns[name]

    def __len__(self) -> int:
        """Number of thresholds."""
        return len(self.columns["threshold"])

    def best(self, criterion: str) -> int:
        """The row that a criterion would choose: the largest ``score`` or ``ncc``, the smallest of the others.

        Where several are equal it is that of the largest threshold.
        """
        values = self[criterion] if criterion in {"score", "ncc"} else -self[criterion]
        candidates = np.flatnonzero(values == np.nanmax(values))
        return int(candidates[np.argmax(self["threshold"][candidates])])

    def to_csv(self) -> str:
        """The table as text, with a line of names."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.columns)
        writer.writerows(zip(*(column.tolist() for column in self.columns.values()), strict=True))
        return text.getvalue()

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {
            "patches": self.patches,
            "rays": self.rays,
            "held_out": self.held_out,
            "rows": [
                dict(zip(self.columns, row, strict=True))
                for row in zip(*(column.tolist() for column in self.columns.values()), strict=True)
            ],
        }
