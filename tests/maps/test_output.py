"""`atomic_output`: the file holds the old content or the whole new one, and nothing else is left behind."""

from __future__ import annotations

import os
import stat
import threading
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from etendue.errors import ArgumentError, OutputError
from etendue.formats.output import atomic_output


def test_new_file_appears_whole(tmp_path: Path) -> None:
    target = tmp_path / "map.exr"
    with atomic_output(target) as temporary:
        assert temporary.parent == tmp_path
        assert temporary.suffix == ".exr"
        temporary.write_bytes(b"half")
        assert not target.exists()
        temporary.write_bytes(b"whole")
    assert target.read_bytes() == b"whole"
    assert list(tmp_path.iterdir()) == [target]


@pytest.mark.skipif(os.name != "posix", reason="only POSIX systems flush folders")
def test_what_is_written_outlives_a_power_cut(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The content is flushed before the file takes its name, and the name afterwards."""
    target, flushed = tmp_path / "map.csv", []

    def flush(handle: int) -> None:
        number = os.fstat(handle).st_ino
        content = "its name" if number == tmp_path.stat().st_ino else os.pread(handle, 99, 0).decode()
        flushed.append((content, target.exists()))

    monkeypatch.setattr(os, "fsync", flush)
    with atomic_output(target) as temporary:
        temporary.write_text("whole")
    assert flushed == [("whole", False), ("its name", True)]


@pytest.mark.parametrize("failure", [RuntimeError, KeyboardInterrupt, SystemExit, MemoryError])
@pytest.mark.parametrize("existing", [True, False])
def test_failure_leaves_the_old_file_and_no_litter(
    tmp_path: Path, failure: type[BaseException], existing: bool
) -> None:
    target = tmp_path / "map.csv"
    if existing:
        target.write_text("old")
    with pytest.raises(failure):
        _write_and_fail(target, failure)
    assert [path.read_text() for path in tmp_path.iterdir()] == (["old"] if existing else [])


def _write_and_fail(target: Path, failure: type[BaseException]) -> None:
    with atomic_output(target) as temporary:
        temporary.write_text("new")
        raise failure


def test_failure_of_the_replacement_itself_leaves_no_litter(tmp_path: Path) -> None:
    target = tmp_path / "map.csv"
    target.write_text("old")
    with pytest.raises(OutputError, match=r"map\.csv"), atomic_output(target) as temporary:
        temporary.unlink()
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_permissions(tmp_path: Path) -> None:
    """A new file gets what `open` would give it, a replaced one keeps its own."""
    plain, new, kept = tmp_path / "plain", tmp_path / "new", tmp_path / "kept"
    plain.touch()
    with atomic_output(new):
        pass
    assert stat.S_IMODE(new.stat().st_mode) == stat.S_IMODE(plain.stat().st_mode)
    kept.touch()
    kept.chmod(0o640)
    with atomic_output(kept):
        pass
    assert stat.S_IMODE(kept.stat().st_mode) == 0o640


def test_a_link_survives_and_its_target_is_replaced(tmp_path: Path) -> None:
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    real, link = folder / "real.npz", tmp_path / "link.npz"
    real.write_text("old")
    link.symlink_to(real)
    with atomic_output(link) as temporary:
        temporary.write_text("new")
    assert link.is_symlink()
    assert real.read_text() == "new"


def test_missing_directory_is_named(tmp_path: Path) -> None:
    with pytest.raises(ArgumentError, match=r"absent does not exist"), atomic_output(tmp_path / "absent" / "map.exr"):
        pytest.fail("the block must not run")


def test_directory_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ArgumentError, match=r"this is a directory"), atomic_output(tmp_path):
        pytest.fail("the block must not run")


@pytest.mark.skipif(os.name != "posix", reason="named pipes are made with os.mkfifo, which only POSIX systems have")
def test_device_is_refused(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(ArgumentError, match=r"device or a pipe"), atomic_output(pipe):
        pytest.fail("the block must not run")
    assert stat.S_ISFIFO(pipe.stat().st_mode)


@pytest.mark.skipif(not os.access("/dev/shm", os.W_OK), reason="only Linux has /dev/shm")  # noqa: S108 - it is what is tested
def test_files_in_memory_are_ordinary_ones() -> None:
    with TemporaryDirectory(dir="/dev/shm") as folder:
        with atomic_output(Path(folder) / "map.csv") as temporary:
            temporary.write_text("whole")
        assert (Path(folder) / "map.csv").read_text() == "whole"
    with pytest.raises(ArgumentError, match=r"device or a pipe"), atomic_output(Path("/dev/map.csv")):
        pytest.fail("the block must not run")


def test_two_writers_at_once_do_not_mix(tmp_path: Path) -> None:
    """Each writer has its own temporary file; the last to finish wins with its whole content."""
    target = tmp_path / "map.npz"
    barrier = threading.Barrier(8)

    def write(letter: str) -> None:
        with atomic_output(target) as temporary, temporary.open("w") as stream:
            for _ in range(100):
                stream.write(letter)
            stream.flush()
            barrier.wait()

    threads = [threading.Thread(target=write, args=(letter,)) for letter in "abcdefgh"]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    content = target.read_text()
    assert content == content[0] * 100
    assert list(tmp_path.iterdir()) == [target]
