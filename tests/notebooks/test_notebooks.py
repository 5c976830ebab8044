"""Notebooks run from top to bottom, show what they promise, and are stored without outputs and without logic."""

import ast
import base64
import re
from pathlib import Path

import nbformat
import numpy as np
import pytest
from jupyter_client import AsyncKernelManager
from jupyter_client.kernelspec import KernelSpecManager
from nbclient import NotebookClient

FOLDER = Path(__file__).parents[2] / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
#: A cell that draws calls one of the package's plots.
DRAWS = re.compile(r"\b\w+_(plot|figure)\(")


def code_cells(notebook: nbformat.NotebookNode) -> list[nbformat.NotebookNode]:
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def executed(path: Path) -> nbformat.NotebookNode:
    """Run a notebook with the interpreter that runs this test, whatever kernels the machine has installed."""
    notebook = nbformat.read(path, as_version=4)
    # Without folders to search, the only kernel is ipykernel of this environment.
    kernels = KernelSpecManager(kernel_dirs=[])
    manager = AsyncKernelManager(kernel_name="python3", kernel_spec_manager=kernels)
    resources = {"metadata": {"path": str(path.parent)}}
    NotebookClient(notebook, km=manager, timeout=300, resources=resources).execute()
    return notebook


@pytest.fixture
def own_jupyter(tmp_path, monkeypatch):
    """Keep the settings of whoever runs the test out, and files of the kernel out of their home."""
    for name in ("JUPYTER_RUNTIME_DIR", "JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR", "IPYTHONDIR"):
        monkeypatch.setenv(name, str(tmp_path / name.lower()))
    monkeypatch.delenv("MPLBACKEND", raising=False)


def test_there_is_a_notebook_on_coverage():
    assert FOLDER / "coverage.ipynb" in NOTEBOOKS


@pytest.mark.usefixtures("own_jupyter")
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_runs_and_every_figure_appears(path):
    notebook = executed(path)
    drawing = [cell for cell in code_cells(notebook) if DRAWS.search(cell.source)]
    assert drawing
    for cell in drawing:
        images = [output.data["image/png"] for output in cell.outputs if "image/png" in output.get("data", {})]
        assert len(images) == 1, cell.source
        assert base64.b64decode(images[0]).startswith(b"\x89PNG"), cell.source
    for cell in code_cells(notebook):
        assert not [output for output in cell.outputs if output.get("name") == "stderr"], cell.outputs


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_is_stored_without_outputs(path):
    notebook = nbformat.read(path, as_version=nbformat.NO_CONVERT)
    nbformat.validate(notebook)
    assert (notebook.nbformat, notebook.nbformat_minor) == (4, 5)
    assert notebook.metadata.kernelspec.name == "python3"
    for cell in code_cells(notebook):
        assert cell.outputs == [], cell.source
        assert cell.execution_count is None, cell.source


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_holds_no_logic_of_its_own(path):
    notebook = nbformat.read(path, as_version=4)
    source = "\n".join(re.sub(r"^%.*$", "", cell.source, flags=re.MULTILINE) for cell in code_cells(notebook))
    logic = (ast.FunctionDef, ast.ClassDef, ast.Lambda, ast.For, ast.While, ast.If, ast.Try)
    assert [ast.unparse(node) for node in ast.walk(ast.parse(source)) if isinstance(node, logic)] == []


def test_the_texts_of_the_coverage_notebook_quote_what_it_computes():
    from rfiddesign.catalog import antenna
    from rfiddesign.geometry import aliased_headings, blind_distances, coverage, make_layout, make_pattern

    words = " ".join(
        cell.source.replace("\n", " ")
        for cell in nbformat.read(FOLDER / "coverage.ipynb", as_version=4).cells
        if cell.cell_type == "markdown"
    )
    eyes, cross_8 = antenna("60x60").area, make_layout("cross-8")
    pair = make_layout({"kind": "bar", "n": 2, "spacing_mm": 250})

    def sees(layout, area, density):
        return coverage(layout, area, make_pattern("square", tags_per_m2=density)).k_coverage[0]

    assert "see a tag at 94 % of all places from 9 tags/m² on; eight of 60 mm need about 150" in words
    assert sees(pair, antenna("320x230").area, 9) == pytest.approx(0.94, abs=0.005)
    assert sees(cross_8, eyes, 100) < 0.94 < sees(cross_8, eyes, 150)

    assert "(22,600 against 24,400 mm²)" in words
    assert 8 * eyes.area_mm2 == pytest.approx(22_600, abs=50)
    assert 96 * antenna("30x30").area.area_mm2 == pytest.approx(24_400, abs=50)

    moved = make_layout({"kind": "cross", "first_mm": 110, "spacing_mm": 80})
    floor = make_pattern("square", pitch_mm=250)
    assert "antennas at 110 and 190 mm" in words
    assert aliased_headings(cross_8, eyes, floor)
    assert not aliased_headings(moved, eyes, floor)
    assert max(drive.max_mm for drive in blind_distances(moved, eyes, floor, range(91))) < 600
    assert abs(sees(moved, eyes, 16) - sees(cross_8, eyes, 16)) < 0.02

    assert "at 300 mm only 60 and 120 mm" in words
    sparse = make_pattern("square", pitch_mm=300)
    free = [
        (inner, outer)
        for inner in range(60, 191, 10)
        for outer in range(max(120, inner + 60), 271, 10)
        if not aliased_headings(
            make_layout({"kind": "cross", "first_mm": inner, "spacing_mm": outer - inner}), eyes, sparse
        )
    ]
    assert free == [(60, 120)]

    assert "(44, 25, 16 and 11 tags/m²)" in words
    densities = [make_pattern("square", pitch_mm=pitch).tags_per_m2 for pitch in (150, 200, 250, 300)]
    np.testing.assert_array_equal(np.round(densities), [44, 25, 16, 11])
