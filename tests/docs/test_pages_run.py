"""Every block of the documentation is what it says, and the runnable ones run."""

from __future__ import annotations

import doctest
import os
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.scene import compile_scene
from oracles.step import half_ball

from docs.pages import PAGES, ROOT, Block, blocks, name_of

PUBLIC = "Cyl10k.1.tm25ray"
"""The file of the tutorial."""

LANGUAGES = {"python", "console", "toml", "text", "sh"}
"""``python`` and ``console`` run here, ``toml`` is a scene that is compiled; ``text`` is shown only; ``sh`` installs and
checks, which CI does."""

RUNNABLE = {"python", "console", "toml"}
FEWEST = {"python": 15, "console": 8, "toml": 8}
"""Blocks that must be found, so that a page that moved does not silence this test."""

DOCTEST_FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


def lobe(rng: np.random.Generator, n: int, exponent: float) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Points and directions of a small LED whose lobe leans to +X: no symmetry."""
    position = np.stack([rng.uniform(-0.6, 0.6, n), rng.uniform(-0.4, 0.5, n), np.full(n, 0.3)], axis=1)
    cos = rng.random(n) ** (1 / (exponent + 1))
    sin, phi, lean = np.sqrt(1 - cos**2), rng.uniform(0, 2 * np.pi, n), np.radians(8)
    p, q, r = sin * np.cos(phi), sin * np.sin(phi), cos
    direction = np.stack([p * np.cos(lean) + r * np.sin(lean), q, r * np.cos(lean) - p * np.sin(lean)], axis=1)
    return position, direction


@pytest.fixture(scope="session")
def materials(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Path:
    """The files that the pages speak of: one LED in lumens, one in watts with wavelengths, a white one in two files."""
    folder = tmp_path_factory.mktemp("materials")
    rng = np.random.default_rng(20)
    position, direction = lobe(rng, 20_000, 1.2)
    et.write_rays(folder / "led.tm25ray", et.RaySet(position, direction, np.full(20_000, 250.0 / 20_000)))
    for file, kind, n, watts, low, high in (
        ("watts.tm25ray", "tm25", 10_000, 0.6, 500, 660),
        ("blue.ray", "lighttools", 20_000, 0.4, 440, 470),
        ("yellow.ray", "lighttools", 30_000, 0.5, 510, 680),
    ):
        position, direction = lobe(rng, n, 1.0)
        nm = rng.uniform(low, high, n)
        rays = et.RaySet(position, direction, np.full(n, watts / n), flux_unit="W", wavelength=nm)
        et.write_rays(folder / file, rays, format=kind)
    vinyl = et.bsdf.Mixture(
        parts=[{"kind": "lambertian", "reflectance": 0.1}, {"kind": "gaussian", "peak": 0.3, "sigma": 0.2}]
    )
    et.write_bsdf(folder / "vinyl.bsdf", vinyl)
    lobe_of = 'kind = "cosine-power"\npeak = 2897.5\nexponent = 18204\nway = "transmitted"\n'
    (folder / "diffuser.toml").write_text(lobe_of, encoding="utf-8")
    brushed = 'kind = "gaussian"\npeak = 9.0\nsigma = 0.06\naspect = 3.0\naxis = [1, 0, 0]\n'
    (folder / "brushed.toml").write_text(brushed, encoding="utf-8")
    shutil.copy(ROOT / "examples" / "half-ball.step", folder)
    try:
        shutil.copy(request.getfixturevalue("samples") / "rays" / PUBLIC, folder)
    except pytest.skip.Exception:
        et.write_rays(folder / PUBLIC, cylinder(rng, 10_000))
    return folder


def cylinder(rng: np.random.Generator, n: int) -> et.RaySet:
    """Rays of a Lambertian side of a cylinder, which stands in for the public file of the tutorial."""
    phi, lean = rng.uniform(0, 2 * np.pi, n), rng.uniform(0, 2 * np.pi, n)
    cos = np.sqrt(rng.random(n))
    sin = np.sqrt(1 - cos**2)
    out, around = np.stack([np.cos(phi), np.sin(phi), 0 * phi], 1), np.stack([-np.sin(phi), np.cos(phi), 0 * phi], 1)
    up = np.array([0.0, 0.0, 1.0])
    direction = cos[:, None] * out + sin[:, None] * (np.cos(lean)[:, None] * around + np.sin(lean)[:, None] * up)
    position = 0.65 * out + rng.uniform(9, 13, n)[:, None] * up
    return et.RaySet(position, direction, np.full(n, 1.0 / n))


def test_the_tutorial_runs_on_its_public_file(samples: Path, materials: Path) -> None:
    """Without the sample files another one stands in for it, and this test is skipped."""
    assert (materials / PUBLIC).read_bytes() == (samples / "rays" / PUBLIC).read_bytes()


def test_the_lens_of_the_tutorial_is_half_a_ball() -> None:
    assert (ROOT / "examples" / "half-ball.step").read_text(encoding="ascii") == half_ball(8.0)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_every_block_says_what_it_is(page: Path) -> None:
    for block in blocks(page):
        assert block.language in LANGUAGES, f"{name_of(page)}:{block.line}: {block.language!r} is none of {LANGUAGES}"


def test_the_blocks_were_found() -> None:
    found = [block.language for page in PAGES for block in blocks(page)]
    assert set(found) == LANGUAGES
    for language, fewest in FEWEST.items():
        assert found.count(language) >= fewest


@pytest.mark.slow
# A page is many commands, each of which has a limit of its own; on a busy machine they add up.
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("page", [p for p in PAGES if any(b.language in RUNNABLE for b in blocks(p))], ids=name_of)
def test_blocks_run(page: Path, materials: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks of a page run in order, in one namespace and one folder that holds the ray files the pages speak of."""
    for file in materials.iterdir():
        shutil.copy(file, tmp_path)
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {"__name__": "__main__"}
    for block in blocks(page):
        if block.language == "python":
            run_python(block, name_of(page), names)
        elif block.language == "console":
            run_console(block, name_of(page))
        elif block.language == "toml":
            compile_toml(block, name_of(page))


def compile_toml(block: Block, page: str) -> None:
    """Keep a scene under the name in its first line, for the blocks that follow, and compile it."""
    name = re.fullmatch(r"# (\w+\.toml)", block.text.splitlines()[0])
    assert name, f"{page}:{block.line}: the first line of a scene is a remark with the name of its file"
    Path(name[1]).write_text(block.text, encoding="utf-8")
    compile_scene(et.Scene.load(name[1]))


def run_python(block: Block, page: str, names: dict[str, Any]) -> None:
    """Run a block as a program, or as an interactive session if it shows one."""
    if not block.text.lstrip().startswith(">>>"):
        # Lines are moved to where they stand in the page, so that a traceback points there.
        exec(compile("\n" * (block.line - 1) + block.text, page, "exec"), names)  # noqa: S102
        return
    session = doctest.DocTestParser().get_doctest(block.text, names, page, page, block.line - 1)
    session.globs = names
    report: list[str] = []
    doctest.DocTestRunner(optionflags=DOCTEST_FLAGS).run(session, out=report.append, clear_globs=False)
    assert not report, "".join(report)


def run_console(block: Block, page: str) -> None:
    """Run each ``$ etendue …`` or ``$ python examples/…``; what it prints must be the lines below, if there are any."""
    environment = {**os.environ, "COLUMNS": "120", "NO_COLOR": "1", "PYTHONUTF8": "1"}
    commands = re.split(r"^\$ ", block.text.replace("\\\n", " "), flags=re.MULTILINE)
    assert not commands[0].strip(), f"{page}:{block.line}: a console block begins with $"
    for text in commands[1:]:
        command, _, expected = text.partition("\n")
        arguments = program(shlex.split(command))
        done = subprocess.run(
            arguments, capture_output=True, encoding="utf-8", env=environment, timeout=200, check=False
        )
        printed = done.stderr + done.stdout
        place = f"{page}:{block.line}: {command}"
        assert done.returncode == 0, f"{place}\n{printed}"
        agrees = doctest.OutputChecker().check_output(expected, printed, DOCTEST_FLAGS)
        assert agrees or not expected.strip(), f"{place}\nprinted:\n{printed}\nshown:\n{expected}"


def program(command: list[str]) -> list[str]:
    """What a command line starts: the installed étendue, or an example of the project with this Python."""
    name, first, *rest = command
    if name == "python" and first.startswith("examples/"):
        return [sys.executable, str(ROOT / first), *rest]
    assert name == "etendue", f"{name!r} is not étendue's command"
    path = shutil.which(name, path=sysconfig.get_path("scripts"))
    assert path, "the command etendue is not installed beside this Python"
    return [path, first, *rest]
