"""BSDFs as the core holds them, built once: the tables of some take a tenth of a second."""

from __future__ import annotations

import collections
import threading
from collections.abc import Mapping
from typing import Any

from etendue import _core
from etendue.quantities.fingerprint import fingerprint

MOST = 32
"""BSDFs that are kept, those asked for last."""

_built: collections.OrderedDict[str, _core.Bsdf] = collections.OrderedDict()
_lock = threading.Lock()


def built(record: Mapping[str, Any]) -> _core.Bsdf:
    """The BSDF of a record, as `Bsdf.record` gives it.

    Raises
    ------
    ValueError
        What is wrong with the record.

    Examples
    --------
    >>> from etendue.description.files import Files
    >>> from etendue.scatter.models import Gaussian
    >>> record = Gaussian(peak=5, sigma=0.15).record(Files())
    >>> built(record) is built(dict(record))
    True
    """
    key = fingerprint(record)
    with _lock:
        if key in _built:
            _built.move_to_end(key)
            return _built[key]
    bsdf = _core.Bsdf(dict(record))
    with _lock:
        _built[key] = bsdf
        while len(_built) > MOST:
            _built.popitem(last=False)
    return bsdf


def core_scene(record: Mapping[str, Any]) -> _core.Scene:
    """The scene of a record, with finishes that are built already where they are.

    Examples
    --------
    >>> import etendue as et
    >>> core_scene(et.scene.compile_scene(et.Scene()).record).may_focus()
    False
    """
    return _core.Scene({**record, "finishes": [built(finish) for finish in record["finishes"]]})
