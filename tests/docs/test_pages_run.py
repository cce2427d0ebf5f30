"""Every block of the documentation is what it says, and the runnable ones run."""

from __future__ import annotations

import contextlib
import os
import shutil
from pathlib import Path

import pytest
from etendue.lightfield.fit_cache import FOLDER_VARIABLE
from oracles.step import half_ball

from docs.materials import PUBLIC, write_materials
from docs.pages import PAGES, ROOT, blocks, name_of
from docs.running import installed, run_apart, run_command, run_page

LANGUAGES = {"python", "console", "toml", "text", "sh"}
"""``python`` and ``console`` run here, ``toml`` is a scene that is compiled; ``text`` is shown only; ``sh`` installs and
checks, which CI does."""

RUNNABLE = {"python", "console", "toml"}
FEWEST = {"python": 15, "console": 8, "toml": 8}
"""Blocks that must be found, so that a page that moved does not silence this test."""


@pytest.fixture(scope="session")
def materials(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Path:
    """A folder with the files that the pages speak of."""
    folder = tmp_path_factory.mktemp("materials")
    write_materials(folder)
    with contextlib.suppress(pytest.skip.Exception):
        shutil.copy(request.getfixturevalue("samples") / "rays" / PUBLIC, folder)
    return folder


@pytest.fixture(scope="session")
def kept_fields(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder for the light fields that pages fit, the same for all workers: a file is fitted once in a run."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "kept"
    folder.mkdir(exist_ok=True)
    return folder


def test_the_tutorial_runs_on_its_public_file(samples: Path, materials: Path) -> None:
    """Without the sample files another one stands in for it, and this test is skipped."""
    assert (materials / PUBLIC).read_bytes() == (samples / "rays" / PUBLIC).read_bytes()


def test_the_lens_of_the_tutorial_is_half_a_ball() -> None:
    assert (ROOT / "examples" / "half-ball.step").read_text(encoding="ascii") == half_ball(8.0)


@pytest.mark.parametrize("arguments", [["--version"], ["info", "no-such.ray"]])
def test_commands_run_here_as_those_that_are_installed(arguments: list[str]) -> None:
    """Status and words; what a page calls does not start a process."""
    assert run_command(["etendue", *arguments]) == run_apart([installed(), *arguments])


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
def test_blocks_run(
    page: Path, materials: Path, kept_fields: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In one folder that holds the ray files the pages speak of; fits are kept as a reader's are."""
    for file in materials.iterdir():
        shutil.copy(file, tmp_path)
    monkeypatch.setenv(FOLDER_VARIABLE, str(kept_fields))
    monkeypatch.chdir(tmp_path)
    run_page(page)
