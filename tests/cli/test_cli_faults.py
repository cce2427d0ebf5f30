"""What goes wrong around the program: it is stopped, disks are full, inputs are pipes, outputs are inputs."""

from __future__ import annotations

import json
import os
import shlex
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.tracing.running import Rounds

from cli.outcome import Run, files

SPHERE = """
[[sources]]
name = "led"
kind = "point"
flux = 100

[[surfaces]]
name = "wall"
shape = { kind = "sphere", radius = 50 }
finish = { kind = "lambertian", reflectance = 0.999999 }
"""
"""A ray meets its wall a million times: a round of such rays takes an hour."""

DETECTOR = """
[[detectors]]
name = "far"
kind = "intensity"
"""


def started(folder: Path, *arguments: object, **environment: str) -> subprocess.Popen[str]:
    # A shell that runs the tests in the background has its programs ignore SIGINT, and they theirs.
    heed = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    return subprocess.Popen(
        [sys.executable, "-c", f"{heed}; from etendue.cli import main; main()", *map(str, arguments)],
        cwd=folder, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=os.environ | environment,
    )  # fmt: skip


@pytest.fixture
def rays(tmp_path: Path) -> Path:
    path = tmp_path / "led.tm25ray"
    et.write_rays(path, et.RingSource(rays=2000, seed=1))
    return path


@pytest.fixture(scope="module")
def many(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """More rays than are read in a moment."""
    path = tmp_path_factory.mktemp("many") / "many.tm25ray"
    et.write_rays(path, et.RingSource(rays=2_000_000, seed=1))
    return path


# --- being stopped ---------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)])
def test_every_signal_keeps_the_part_of_a_trace_and_says_how_to_go_on(
    number: int, status: int, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "lamp.toml").write_text(SPHERE.replace("0.999999", "0.5") + DETECTOR)
    for module in ("running", "work"):  # rounds of 65,536 rays
        monkeypatch.setattr(f"etendue.tracing.{module}.BATCHES", 1)
    arguments = ("trace", "lamp.toml", "--rays", "2e5", "--seed", "7", "-o", "it is.h5")
    inner = Rounds.__next__

    def struck(rounds: Rounds) -> et.TraceResult:
        if rounds._last is not None:
            signal.raise_signal(number)
        return inner(rounds)

    # Who runs the tests may ignore the signal, and so would the program.
    before = signal.signal(number, signal.SIG_DFL)
    try:
        with monkeypatch.context() as patch:
            patch.setattr(Rounds, "__next__", struck)
            ended, _, err = run(*arguments)
    finally:
        signal.signal(number, before)
    assert ended == status, err
    assert "half-written" in err
    assert files(tmp_path) == ["it is.h5", "lamp.toml"]
    part = et.TraceResult.load(tmp_path / "it is.h5")
    assert part.rays_done == 1 << 16
    (line,) = (line for line in err.splitlines() if "to go on" in line)
    command = shlex.split(line.partition(": ")[2])
    assert command == ["etendue", *arguments, "--resume", "it is.h5"]
    assert run(*command[1:]).status == 0
    assert et.TraceResult.load(tmp_path / "it is.h5").complete


BEGUN = """
import {module} as module
inner = module.{name}
def begins(*arguments, **options):
    print("begun", flush=True)
    return inner(*arguments, **options)
module.{name} = begins
from etendue.cli import main
main()
"""


@pytest.mark.slow
@pytest.mark.parametrize("verb", ["trace", "luminance", "fit", "convert"])
def test_a_long_verb_stops_within_a_moment(verb: str, many: Path, tmp_path: Path) -> None:
    """Also within a round that takes an hour; what cannot go on says so, and nothing is left behind."""
    (tmp_path / "lamp.toml").write_text(SPHERE + DETECTOR)
    look = ("--observer", "0,0", "--distance", "20", "--size", "10,10", "--pixels", "64,64")
    module, name, arguments = {
        "trace": ("etendue._core", "work_unit", ("lamp.toml", "--most-events", "100000000", "-o", "a.h5")),
        "luminance": (
            "etendue._core",
            "look_at_scene",
            ("lamp.toml", *look, "--rays-per-pixel", "1048576", "-o", "a.npz"),
        ),
        "fit": ("etendue.lightfield.fitting", "count_rays", (str(many), "--surface", "disk:radius=40", "-o", "a.h5")),
        "convert": ("etendue.cli.convert", "write_rays", (str(many), "a.csv")),
    }[verb]
    process = subprocess.Popen(
        [sys.executable, "-c", BEGUN.format(module=module, name=name), verb, *arguments],
        cwd=tmp_path, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    assert process.stdout is not None
    assert process.stdout.readline() == "begun\n", process.communicate()
    time.sleep(0.3)
    begun = time.monotonic()
    process.send_signal(signal.SIGTERM)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 143, err
    assert f"`etendue {verb}` cannot go on" in err
    assert files(tmp_path) == ["lamp.toml"]
    assert time.monotonic() - begun < 5  # on a machine with much else to do


def test_what_is_ignored_stays_ignored(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As `nohup` starts a program."""
    (tmp_path / "lamp.toml").write_text(SPHERE.replace("0.999999", "0.5") + DETECTOR)
    inner = Rounds.__next__

    def struck(rounds: Rounds) -> et.TraceResult:
        signal.raise_signal(signal.SIGHUP)
        return inner(rounds)

    monkeypatch.setattr(Rounds, "__next__", struck)
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        assert run("trace", "lamp.toml", "--rays", "100").status == 0
    finally:
        signal.signal(signal.SIGHUP, before)


# --- temporary files -------------------------------------------------------------------------------------------------

WRITER = """
import sys, time
from pathlib import Path
from etendue.formats.output import atomic_output
from etendue.formats.output_folder import atomic_folder
with atomic_output(Path("slow.csv")) as file, atomic_folder("slow", lambda old: False) as folder:
    file.write_text("half")
    (folder / "half").write_text("half")
    print("ready", flush=True)
    time.sleep(60)
"""


def test_temporary_files_of_the_living_stay_and_those_of_the_dead_go(rays: Path, run: Run, tmp_path: Path) -> None:
    process = subprocess.Popen([sys.executable, "-c", WRITER], cwd=tmp_path, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    written = {name for name in files(tmp_path) if name.startswith(".writing-")}
    assert len(written) == 3
    mine = tmp_path / ".writing-notes"
    mine.write_text("somebody's own")
    assert run("convert", rays, "a.csv").status == 0
    assert written <= set(files(tmp_path))
    process.kill()
    process.communicate()  # closes the pipe, too
    assert written <= set(files(tmp_path))
    assert run("convert", rays, "b.csv").status == 0
    assert files(tmp_path) == [".writing-notes", "a.csv", "b.csv", "led.tm25ray"]


# --- limits ----------------------------------------------------------------------------------------------------------


def limited(folder: Path, limit: str, size: int, *arguments: object) -> tuple[int, str]:
    """Exit status and standard error of the program under a limit."""
    code = f"""
import etendue, resource
from etendue.cli import main
import h5py, scipy.fft, scipy.ndimage
resource.setrlimit(resource.{limit}, ({size}, {size}))
main()
"""
    done = subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)],
        cwd=folder, capture_output=True, text=True, timeout=120, check=False, env=os.environ | {"RAYON_NUM_THREADS": "1"},
    )  # fmt: skip
    return done.returncode, done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("output", ["a.csv", "a.etd", "a.ray", "a.tm25ray"])
def test_a_full_disk_names_file_and_size(output: str, tmp_path: Path) -> None:
    """A limit on the size of files stands in for the disk; both are found by the same calls."""
    et.write_rays(tmp_path / "led.tm25ray", et.RingSource(rays=50_000, seed=1))
    more = ("--format", "lighttools") if output == "a.ray" else ()
    status, err = limited(tmp_path, "RLIMIT_FSIZE", 500_000, "convert", "led.tm25ray", output, *more)
    assert status == 1
    assert err.startswith(f"error: {output}: cannot write: "), err
    assert "bytes" in err
    assert "Traceback" not in err
    assert files(tmp_path) == ["led.tm25ray"]


def test_a_sample_that_no_disk_holds_is_refused_at_once(rays: Path, run: Run, tmp_path: Path) -> None:
    assert run("fit", rays, "-o", "led.h5", "--surface", "disk:radius=40", "--depths", "2,2,2,2").status == 0
    status, _, err = run("sample", "led.h5", "-n", 10**12, "-o", "all.tm25ray")
    assert status == 1
    assert "all.tm25ray: cannot write: 28,000,000,000,000 bytes are needed" in err
    assert files(tmp_path) == ["led.h5", "led.tm25ray"]


@pytest.mark.slow
def test_a_memory_limit_names_file_and_size(tmp_path: Path) -> None:
    et.write_rays(tmp_path / "led.tm25ray", et.RingSource(rays=50_000, seed=1))
    look = ("--observer", "0,0", "--distance", "200", "--size", "10,10", "--pixels", "8192,8192", "-o", "a.npz")
    status, err = limited(
        tmp_path, "RLIMIT_AS", 3 << 30, "luminance", "led.tm25ray", *look, "--method", "cone", "--threads", "1"
    )
    assert status == 1, err
    assert "led.tm25ray" in err
    assert "memory" in err
    assert "GB" in err
    assert "Traceback" not in err
    assert files(tmp_path) == ["led.tm25ray"]


@pytest.mark.skipif(os.geteuid() == 0, reason="whoever may do everything may write here too")
def test_a_folder_that_cannot_be_written_is_refused_before_any_work(rays: Path, run: Run, tmp_path: Path) -> None:
    (tmp_path / "shut").mkdir(mode=0o500)
    status, _, err = run("convert", rays, "shut/a.csv")
    assert (status, "shut" in err) == (1, True)


# --- outputs that are inputs -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("way", ["same", "dotted", "symlink", "hardlink"])
def test_an_output_that_is_an_input_is_refused(way: str, rays: Path, run: Run, tmp_path: Path) -> None:
    other = tmp_path / "other.tm25ray"
    if way == "symlink":
        other.symlink_to(rays)
    if way == "hardlink":
        other.hardlink_to(rays)
    names = {"same": "led.tm25ray", "dotted": "./x/../led.tm25ray"}
    (tmp_path / "x").mkdir()
    before = rays.read_bytes()
    status, _, err = run("convert", rays, names.get(way, other.name))
    assert status == 1
    assert "this is also an input" in err
    assert rays.read_bytes() == before


def test_no_verb_writes_over_what_it_reads(rays: Path, run: Run, tmp_path: Path) -> None:
    assert run("fit", rays, "-o", "a.h5", "--surface", "disk:radius=40", "--depths", "2,2,2,2").status == 0
    look = ("--observer", "0,0", "--distance", "200", "--size", "60,60", "--pixels", "4,4")
    assert run("luminance", rays, *look, "--method", "cone", "-o", "map.npz").status == 0
    (tmp_path / "lamp.toml").write_text(SPHERE.replace("0.999999", "0.5") + DETECTOR + "[[detectors]]\n"
        'name = "seen"\nkind = "rays"\nshape = { kind = "sphere", radius = 60 }\n'
        f'[[sources]]\nname = "file"\nkind = "rays"\nfile = "{rays.name}"\n')  # fmt: skip
    kept = {path: path.read_bytes() for path in tmp_path.iterdir()}
    for arguments in (
        ("sample", "a.h5", "-n", 10, "-o", "a.h5"),
        ("fit", rays, "-o", rays),
        ("luminance", rays, *look, "-o", rays),
        ("filter", "map.npz", "--kind", "average", "-o", "map.npz"),
        ("compare", "map.npz", "map.npz", "-o", "map.npz"),
        ("trace", "lamp.toml", "--rays", "10", "-o", "lamp.toml"),
        ("trace", "lamp.toml", "--rays", "10", "-o", rays),
    ):
        status, _, err = run(*arguments)
        assert (status, "this is also an input" in err) == (1, True), (arguments, err)
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == kept


def test_a_trace_may_go_on_in_its_own_file(run: Run, tmp_path: Path) -> None:
    (tmp_path / "lamp.toml").write_text(SPHERE.replace("0.999999", "0.5") + DETECTOR)
    assert run("trace", "lamp.toml", "--rays", "1000", "-o", "a.h5").status == 0
    assert run("trace", "lamp.toml", "--rays", "1000", "--resume", "a.h5", "-o", "a.h5").status == 0


# --- inputs that are no files ----------------------------------------------------------------------------------------


def fed(path: Path, data: bytes) -> threading.Thread:
    """A thread that writes to a pipe."""
    os.mkfifo(path)

    thread = threading.Thread(target=path.write_bytes, args=(data,), daemon=True)
    thread.start()
    return thread


@pytest.mark.parametrize("name", ["tm25", "csv", "etd"])
def test_a_pipe_is_read_as_the_file_that_comes_out_of_it(name: str, rays: Path, run: Run, tmp_path: Path) -> None:
    et.write_rays(tmp_path / "whole", et.read_rays(rays), name)
    fed(tmp_path / "pipe", (tmp_path / "whole").read_bytes())
    status, out, err = run("info", "pipe", "--json")
    assert status == 0, err
    (found,), (expected,) = json.loads(out), run("info", "whole", "--json").json
    assert (found.pop("file"), expected.pop("file")) == ("pipe", "whole")
    assert found == expected


def test_a_pipe_in_python_keeps_its_name(rays: Path, tmp_path: Path) -> None:
    fed(tmp_path / "pipe", rays.read_bytes())
    got = et.read_rays(tmp_path / "pipe")
    assert got.provenance.source == "pipe"
    assert np.array_equal(got.flux, et.read_rays(rays).flux)
    fed(tmp_path / "cut", rays.read_bytes()[:300])
    with pytest.raises(et.errors.FormatError, match=r"/cut: byte 300: "):
        et.read_rays(tmp_path / "cut")


@pytest.mark.slow
def test_a_pipe_without_a_writer_says_what_it_waits_for(rays: Path, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    process = started(tmp_path, "convert", "pipe", "a.csv")
    assert process.stderr is not None
    # However long the program takes to start, it is fed only after it has said that it waits.
    assert "pipe: waiting for something to be written to this pipe" in process.stderr.readline()
    (tmp_path / "pipe").write_bytes(rays.read_bytes())
    _, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    os.mkfifo(tmp_path / "silent")
    process = started(tmp_path, "convert", "silent", "b.csv")
    assert process.stderr is not None
    assert "silent: waiting" in process.stderr.readline()
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)
    assert process.returncode == 130


@pytest.mark.slow
def test_standard_input_and_process_substitution(rays: Path) -> None:
    program = f"{shlex.quote(sys.executable)} -c 'from etendue.cli import main; main()'"
    for text in (f"cat {rays} | {program} info /dev/stdin", f"{program} info <(cat {rays})"):
        done = subprocess.run(["/bin/bash", "-c", text], capture_output=True, text=True, timeout=60, check=False)
        assert done.returncode == 0, done.stderr
        assert "2,000" in done.stdout


def test_directories_devices_and_sockets_are_refused_by_name(run: Run, tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(tmp_path / "socket"))
        for path, kind in (("folder", "a directory"), ("socket", "a socket"), ("/dev/zero", "a device")):
            for verb in (
                ["info"],
                ["convert"],
                ["fit"],
                ["sample", "-n", "1"],
                ["filter", "--kind", "average"],
                ["trace"],
                ["intensity"],
            ):
                more: list[Any] = ["out.tm25ray"] if verb == ["convert"] else ["-o", "out.h5"] * (verb != ["info"])
                if verb[0] in {"filter", "intensity"}:
                    more = ["-o", "out.npz" if verb[0] == "filter" else "out.ies"]
                if verb[0] == "sample":
                    more = ["-o", "out.tm25ray"]
                status, _, err = run(*verb[:1], path, *verb[1:], *more)
                assert status in (1, 2), (verb, path)
                assert f"{path}: cannot read: this is {kind}" in err, (verb, err)


@pytest.mark.parametrize("output", ["/dev/stdout", "/dev/null", "pipe"])
def test_outputs_are_files(output: str, rays: Path, run: Run, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    status, _, err = run("convert", rays, output, "--format", "csv")
    assert status == 1
    assert f"{output}: cannot write: this is a device or a pipe" in err
