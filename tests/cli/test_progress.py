"""Whoever waits is told why."""

from numba import njit

from rfiddesign.cli.progress import CountDisplay, Display, StepDisplay


def a_kernel():
    """A kernel that nobody compiled yet."""

    @njit
    def doubled(x):
        return 2 * x

    return doubled


def test_a_compilation_that_takes_its_time_is_told_once(capsys, monkeypatch):
    monkeypatch.setattr("rfiddesign.cli.progress.PATIENCE_S", 0.0)
    with Display():
        assert capsys.readouterr().err == ""
        a_kernel()(1)
        told = " ".join(capsys.readouterr().err.split())
        assert "compiling doubled; once after an installation, half a minute in all" in told
        a_kernel()(1)
        assert capsys.readouterr().err == ""
    a_kernel()(1)
    assert capsys.readouterr().err == ""


def test_a_quick_compilation_is_not_told(capsys):
    with Display():
        a_kernel()(1)
    assert capsys.readouterr().err == ""


def test_nothing_is_told_of_what_is_compiled_already(capsys):
    kernel = a_kernel()
    kernel(1)
    with Display():
        kernel(2)
    assert capsys.readouterr().err == ""


def test_progress_is_told_now_and_then_where_there_is_no_terminal(capsys, monkeypatch):
    monkeypatch.setattr("rfiddesign.cli.progress.PLAIN_INTERVAL_S", 0.0)
    with CountDisplay("20 runs", 20) as display:
        display.show(7)
    assert "20 runs: 7 of 20" in capsys.readouterr().err


def test_several_things_one_after_the_other_are_counted_each(capsys, monkeypatch):
    monkeypatch.setattr("rfiddesign.cli.progress.PLAIN_INTERVAL_S", 0.0)
    with StepDisplay() as display:
        display.show("table 1, MCL (1 of 2)", 3, 2000)
    assert "table 1, MCL (1 of 2): 3 of 2,000 runs" in " ".join(capsys.readouterr().err.split())
