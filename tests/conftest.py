"""A study small enough to be run in every test: 24 designs on 30 m2, runs of 5 s, 60 particles, generous alphas."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import settings

# Property tests draw the same examples on every machine and take the time they need.
settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.load_profile("repeatable")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let the second half begin with the estimators, and put off what runs whole studies.

    Of two workers one begins there and one at the floors, so that each compiles other kernels first and finds those of
    the other on disk later.
    """
    put_off = ("report", "cli", "reproduce", "simulation", "study")

    def turn(item: pytest.Item) -> int:
        *folders, _ = item.path.relative_to(Path(__file__).parent).parts
        if not folders:
            return len(put_off)
        return put_off.index(folders[0]) if folders[0] in put_off else -1

    estimators = [item for item in items if "estimators" in item.path.parts]
    others = sorted((item for item in items if "estimators" not in item.path.parts), key=turn)
    half = len(items) // 2
    items[:] = [*others[:half], *estimators, *others[half:]]


TINY = Path(__file__).with_name("tiny-study")


@pytest.fixture
def tiny(tmp_path: Path) -> Path:
    """The tiny study's folder, free to be changed."""
    return shutil.copytree(TINY, tmp_path / TINY.name)


@pytest.fixture
def edit(tiny: Path) -> Callable[..., None]:
    """Replace `old`, which must be there once, in a file of the tiny study."""

    def replace(old: str, new: str, file: str = "study.toml") -> None:
        text = (tiny / file).read_text()
        assert text.count(old) == 1, f"{old!r} is {text.count(old)} times in {file}"
        (tiny / file).write_text(text.replace(old, new))

    return replace


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of the tiny study, run once with one worker and without interruption; not to be changed."""
    from rfiddesign.study import load_study, run_study

    out = tmp_path_factory.mktemp("finished") / "out"
    run_study(load_study(TINY), out, 1, lambda stage: None)
    return out


@pytest.fixture
def without_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages without their pictures, for tests of their words: drawing takes seconds."""
    monkeypatch.setattr("rfiddesign.report.markup.svg_of", lambda figure, name: '<svg viewBox="0 0 1 1"></svg>')
    monkeypatch.setattr("rfiddesign.report.markup.write_figure", lambda folder, name, figure, svg: None)


@pytest.fixture
def grey_map(tiny: Path) -> Callable[[int], None]:
    """Give the tiny study a ROS map: 6 m x 5 m of one grey within walls, in the folder `floor`."""

    def write(grey: int) -> None:
        (tiny / "floor").mkdir()
        rows = [[0 if i in (0, 49) or j in (0, 59) else grey for j in range(60)] for i in range(50)]
        text = "\n".join(" ".join(map(str, row)) for row in rows)
        (tiny / "floor" / "hall.pgm").write_text(f"P2\n60 50\n255\n{text}\n")
        (tiny / "floor" / "map.yaml").write_text("image: hall.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n")
        study = tiny / "study.toml"
        study.write_text(study.read_text().replace("rectangle_m = [6.0, 5.0]", 'map = "floor/map.yaml"'))

    return write
