"""A result folder that the tests of the report share; they must not write to its inputs."""

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture(scope="session")
def synthetic() -> ModuleType:
    """The module that writes made-up result folders."""
    spec = importlib.util.spec_from_file_location("synthetic_results", Path(__file__).with_name("synthetic.py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def folder(synthetic, tmp_path_factory) -> Path:
    """A folder with answers for 5 and 200 robots, the report drawn; a title and a source that want to do harm."""
    from rfiddesign.report import write_report

    path = tmp_path_factory.mktemp("results")
    synthetic.write_folder(path, title='Hall <script>alert("x")</script> & more', tag_source="=HYPERLINK(A1)")
    write_report(path)
    return path
