"""Libraries that not everybody needs: what each is for, and the extra that installs it. No other file knows."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from etendue.errors import MissingLibraryError


class Extra(NamedTuple):
    """An extra of the package.

    Parameters
    ----------
    name : str
        As in ``pip install 'etendue[name]'``.
    purpose : str
        What its library is for, in the plural.
    endings : tuple of str
        Endings of files that cannot be written without it.

    Examples
    --------
    >>> EXTRAS["matplotlib"].name, EXTRAS["matplotlib"].endings
    ('plot', ('.png', '.pdf', '.gif', '.mp4'))
    """

    name: str
    purpose: str
    endings: tuple[str, ...] = ()


EXTRAS: dict[str, Extra] = {
    "matplotlib": Extra("plot", "pictures", (".png", ".pdf", ".gif", ".mp4")),
    "cascadio": Extra("step", "STEP files"),
    "scipy": Extra("scans", "interpolations of scattered points and scans in two dimensions"),
    "xlrd": Extra("xls", "workbooks of goniometers"),
    "anywidget": Extra("notebook", "pages in notebooks"),
    "xarray": Extra("xarray", "datasets of xarray"),
}
"""By the name of the library."""


def require(library: str) -> ModuleType:
    """Import a library of `EXTRAS`.

    Raises
    ------
    MissingLibraryError
        If it is not installed; names the extra.

    Examples
    --------
    >>> require("matplotlib").__name__
    'matplotlib'
    """
    try:
        return importlib.import_module(library)
    except ModuleNotFoundError as error:
        if error.name != library:
            raise
        extra = EXTRAS[library]
        raise MissingLibraryError(library, extra.purpose, extra.name) from None


def scipy_part(name: str) -> Any:
    """Import a part of SciPy, which states no types.

    Raises
    ------
    MissingLibraryError
        If it is not installed.

    Examples
    --------
    >>> scipy_part("sparse").__name__
    'scipy.sparse'
    """
    require("scipy")
    return importlib.import_module(f"scipy.{name}")


def require_for(path: Path) -> None:
    """Import the library without which a file cannot be written, if there is one.

    Raises
    ------
    MissingLibraryError
        If it is not installed.

    Examples
    --------
    >>> require_for(Path("map.npz"))
    """
    for library, extra in EXTRAS.items():
        if path.suffix.lower() in extra.endings:
            require(library)
