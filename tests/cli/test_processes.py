"""The command line as a process of its own: what it imports, and how it stops."""

import signal
import subprocess
import sys
import time

import pytest

from rfiddesign.study.storage import RunTable

HEAVY = ("numba", "matplotlib", "scipy", "shapely", "pydantic")


@pytest.mark.parametrize("arguments", [["--help"], ["run", "--help"], ["--version"]])
def test_help_imports_nothing_heavy(arguments):
    code = (
        "import sys\nfrom rfiddesign.cli import main\n"
        f"try:\n    main({arguments!r})\nexcept SystemExit:\n    pass\n"
        f"print([name for name in {HEAVY!r} if name in sys.modules])"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.splitlines()[-1] == "[]"


def test_help_names_every_command():
    answer = subprocess.run([sys.executable, "-m", "rfiddesign", "--help"], capture_output=True, text=True, check=True)
    assert all(name in answer.stdout for name in ("run", "check", "evaluate", "coverage", "report", "reproduce"))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_says_how_to_go_on_and_keeps_its_runs(tiny, edit, finished, tmp_path, number):
    # Some ten seconds of work, its kernels compiled by `finished`, in a child that was told to ignore Ctrl-C, as a
    # shell tells its jobs in the background.
    edit("n_particles = 60", "n_particles = 20000")
    out = tmp_path / "out"
    code = (
        "import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\n"
        f"from rfiddesign.cli import main\nmain(['run', {str(tiny)!r}, '--out', {str(out)!r}, '--json'])"
    )
    child = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 60
    while not (out / "runs.sqlite").exists():
        assert child.poll() is None, child.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.05)
    time.sleep(1.5)
    child.send_signal(number)
    printed, told = child.communicate(timeout=30)
    assert child.returncode == 130
    assert printed == ""
    assert told.splitlines()[-1] == f"interrupted; what was done is in {out}: the same command goes on from there"
    assert not (out / "result.json").exists()
    with RunTable(out / "runs.sqlite") as table:
        assert sum(len(runs) for runs in table.runs().values()) > 0
