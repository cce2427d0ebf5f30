"""A fingerprint of what a computation starts from: equal for equal input, whatever it is called."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from etendue import _core

SAMPLE = 1 << 16
"""Rays at both ends of a set that its fingerprint is made of."""


def fingerprint(record: Mapping[str, Any]) -> str:
    """SHA-256 of a scene as the tracer takes it, the content of its files included.

    Of ray sets, the number of rays and those at both ends stand for all; of light fields, their flux and their luminance
    at some points.

    Parameters
    ----------
    record : mapping
        Plain values, arrays, and ray sets and light fields of the compiled core, nested.

    Examples
    --------
    >>> fingerprint({"n": 1.5, "faces": [{"radius": 2}]}) == fingerprint({"faces": [{"radius": 2.0}], "n": 1.5})
    True
    >>> fingerprint({"n": 1.5}) == fingerprint({"n": 1.51})
    False
    """
    digest = hashlib.sha256()
    _feed(digest, record)
    return digest.hexdigest()


def _feed(digest: Any, value: Any) -> None:
    """Add a plain value to a digest, with its kind and length, so that no two values look alike."""
    # Numbers and texts, of which there are most, before the kinds that Python has to ask about at length.
    match value:
        case str():
            digest.update(b"s%d:" % len(value) + value.encode())
        case bool() | None:
            digest.update(repr(value).encode())
        case int() | float() | np.number():
            digest.update(b"f" + struct.pack("<d", float(value)))
        case np.ndarray():
            digest.update(f"a{value.dtype.kind}{value.shape}".encode())
            digest.update(np.ascontiguousarray(value).data)
        case dict() | Mapping():
            digest.update(b"{%d" % len(value))
            for key in sorted(value):
                _feed(digest, key)
                _feed(digest, value[key])
        case list() | tuple() | Sequence():
            digest.update(b"[%d" % len(value))
            for held in value:
                _feed(digest, held)
        case _core.LightField():
            flux = value.flux()
            _feed(digest, flux)
            spread = np.random.default_rng(1).random((SAMPLE >> 4, 4))
            for part in range(len(flux)):
                _feed(digest, value.at(part, spread)[0])
        case _:
            n = len(value)
            _feed(digest, n)
            for start, stop in ((0, min(n, SAMPLE)), (max(n - SAMPLE, 0), n)):
                for array in _core.read_rays(value, start, stop):
                    _feed(digest, array)
                colours = _core.read_colours(value, start, stop)
                if colours.size:
                    _feed(digest, colours)
