"""A ray file without a near field: no map, but an intensity distribution."""

from __future__ import annotations

from pathlib import Path

import etendue as et
import numpy as np

from cli.outcome import Run, files


def test_a_file_without_positions_is_refused_by_luminance_and_taken_by_intensity(run: Run, tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    k = rng.normal((0.4, 0.1, 1.2), 1.0, (3000, 3))
    k /= np.linalg.norm(k, axis=1)[:, None]
    file = tmp_path / "far.tm25ray"
    et.write_rays(file, et.RaySet(np.zeros_like(k), k, np.full(len(k), 0.01)), format="tm25")
    place = ("--observer", "0,0", "--distance", "500", "--size", "3,3", "--pixels", "8,8")
    for verb in (("luminance", file, *place, "-o", tmp_path / "map.npz"), ("fit", file, "-o", tmp_path / "far.h5")):
        refused = run(*verb)
        assert refused.status == 1
        assert file.name in refused.err
        assert "pass one point" in refused.err
        assert "etendue intensity" in refused.err
    assert run("intensity", file, "-o", tmp_path / "far.ies").status == 0
    assert files(tmp_path) == ["far.ies", "far.tm25ray"]
