"""Compiled kernels are used only as long as all kernel files are those they were compiled from."""

from pathlib import Path

import pytest

from rfiddesign.numerics.stale_code import forget_stale_code


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """Two kernel files, one other file, and what numba compiled from the first."""
    (tmp_path / "low" / "__pycache__").mkdir(parents=True)
    (tmp_path / "low" / "_sine_kernels.py").write_text("s = 1\n")
    (tmp_path / "_run_kernels.py").write_text("r = 1\n")
    (tmp_path / "page.py").write_text("p = 1\n")
    return tmp_path


def compile_in(package: Path) -> Path:
    compiled = package / "low" / "__pycache__" / "_sine_kernels.sine-1.py311.nbi"
    compiled.write_bytes(b"code")
    return compiled


def test_code_of_unknown_age_is_forgotten_and_later_code_is_kept(package):
    compiled = compile_in(package)
    assert forget_stale_code(package)
    assert not compiled.exists()
    compile_in(package)
    assert not forget_stale_code(package)
    assert compiled.exists()


def test_a_change_in_any_kernel_file_makes_all_code_stale(package):
    forget_stale_code(package)
    for change in (
        lambda: (package / "_run_kernels.py").write_text("r = 2\n"),
        lambda: (package / "_run_kernels.py").rename(package / "_drive_kernels.py"),
        lambda: (package / "_drive_kernels.py").unlink(),
        lambda: (package / "low" / "_new_kernels.py").write_text(""),
    ):
        compiled = compile_in(package)
        change()
        assert forget_stale_code(package)
        assert not compiled.exists()


def test_other_files_may_change(package):
    forget_stale_code(package)
    compiled = compile_in(package)
    (package / "page.py").write_text("p = 2\n")
    assert not forget_stale_code(package)
    assert compiled.exists()


def test_a_folder_that_cannot_be_written_is_left_alone(package, monkeypatch):
    def refuse(*arguments, **options):
        raise PermissionError

    compiled = compile_in(package)
    monkeypatch.setattr("rfiddesign.numerics.stale_code.tempfile.NamedTemporaryFile", refuse)
    monkeypatch.setattr(Path, "unlink", refuse)
    assert forget_stale_code(package)
    assert compiled.exists()
