"""The report of a scene: one page that needs nothing else, legible in a light, a dark and a printed form."""

from __future__ import annotations

import re
import shutil
import subprocess
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from synchain import Field, Scene, load_scene, msf, run
from synchain.graphs import topology
from synchain.runtime.cli import main
from synchain.runtime.reports.html import provenance_rows
from synchain.runtime.reports.scene_report import Effort, _ends, report

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
needs_browser = pytest.mark.skipif(BROWSER is None, reason="no Chromium is installed")

FAST = Effort(strengths=13, precision=0.05, periods=30.0, values=4)
DARK = "--blink-settings=preferredColorScheme=0"
SIZE = (900, 2400)


@pytest.fixture(scope="module")
def page() -> str:
    scene = load_scene("figure_4a").replace(transient=20.0, window=5.0, title="A <scene> & more")
    return report(scene, FAST, show_progress=False)


@pytest.fixture(scope="module")
def folder(page: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder_of_pages = tmp_path_factory.mktemp("page")
    (folder_of_pages / "page.html").write_text(page, encoding="utf-8")
    for part in ("math", "img", "svg"):
        hidden = page.replace("</head>", f"<style>{part}{{visibility:hidden}}</style></head>")
        (folder_of_pages / f"no_{part}.html").write_text(hidden, encoding="utf-8")
    return folder_of_pages


def browse(file: Path, *options: str) -> str:
    """Open a file in headless Chromium; returns what it says, console messages among it."""
    command = [
        str(BROWSER),
        *("--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--enable-logging=stderr"),
        *("--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update"),
        "--disable-sync",
        f"--user-data-dir={file.parent / 'profile'}",
        f"--window-size={SIZE[0]},{SIZE[1]}",
        *options,
        file.as_uri(),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


def seen(folder: Path, name: str, *options: str) -> np.ndarray:
    """The pixels (height, width, 3) of a page, from 0 to 1."""
    picture = folder / f"{name}.png"
    browse(folder / f"{name}.html", f"--screenshot={picture}", *options)
    return np.asarray(imread(picture))[:, :, :3]


def test_the_page_needs_nothing_else(page: str) -> None:
    assert re.findall(r"<(?:script|link|iframe|object)|@import|url\(", page) == []
    assert {source[:22] for source in re.findall(r'src="([^"]*)"', page)} == {"data:image/png;base64,"}
    assert "default-src 'none'" in page
    addresses = set(re.findall(r"https?://[^\s\"'<]+", page))
    assert addresses <= {"http://www.w3.org/2000/svg"}, "names of formats are no addresses"


def test_the_page_has_all_its_parts(page: str) -> None:
    assert re.findall(r"<h2>(.*?)</h2>", page) == [
        *("Equations", "Numbers", "Network and exact spectrum", "Master stability function", "Sweep", "Provenance")
    ]
    assert "<h1>A &lt;scene&gt; &amp; more</h1>" in page
    assert "<scene>" not in page
    assert page.count("<img ") == 2
    assert "4 of the scene&#x27;s 601 cells" in page or "4 of the scene's 601 cells" in page
    assert load_scene("figure_4a").equations.digest in page


def test_parts_that_a_scene_does_not_have_are_absent_or_explained() -> None:
    alone = report(load_scene("figure_1b").replace(axes=(), transient=1.0, window=1.0), FAST, show_progress=False)
    assert "Master stability" not in alone
    assert "Sweep" not in alone
    unequal = Scene(
        oscillator="duffing", nodes=[{"at": [2], "oscillator": "van_der_pol"}], topology=load_scene("figure_5").topology
    )
    assert re.search(r"This scene has none: [^<]*unequal|This scene has none: [^<]*kinds", report(unequal, FAST))


def test_the_command_writes_the_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "new" / "page.html"
    assert main(["report", "figure_1b", "--out", str(target), "--quick"]) == 0
    assert str(target) in capsys.readouterr().out
    assert target.read_text("utf-8").startswith("<!DOCTYPE html>")
    assert main(["report", "figure_1b", "--out", str(tmp_path)]) == 2
    assert "is a folder" in capsys.readouterr().err
    for name in ("page.pdf", "page"):
        assert main(["report", "figure_1b", "--out", str(tmp_path / name)]) == 2
        assert "expected .html" in capsys.readouterr().err
        assert not (tmp_path / name).exists()


def test_a_file_that_is_no_scene_is_said_to_be_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("result.nc").write_bytes(b"CDF")
    assert main(["report", "result.nc", "--out", "page.html"]) == 2
    assert "found a file of another kind; expected a scene, whose name ends in .toml" in capsys.readouterr().err


def test_the_function_of_a_swept_scene_is_that_of_its_own_values() -> None:
    scene = Scene("harmonic", "spring", topology("chain", 2), record=(), transient=1, window=1)
    text = "The sweep moves x_1, v_1; this function"
    assert text in report(scene.replace(axes={"sigma": [0.2], "x_1": [0.1, 0.2], "v_1": [0.0, 0.1]}), FAST)
    assert "The sweep moves" not in report(scene.replace(axes={"sigma": [0.2, 0.4]}), FAST)


@pytest.mark.parametrize(
    ("strengths", "message"),
    [
        ([0, 1], "alpha = 1 ends"),
        ([-0.5, 1], "= -0.5 and at 1 "),
        ([-2, 0], "= 0 ends"),
        ([-0.5, 0], "= -0.5 and at 0 "),
    ],
)
def test_ranges_that_end_with_the_grid_are_said_to_do_so(strengths: list[float], message: str) -> None:
    """x' = -x: the exponent -1 - alpha is negative above -1; a grid of strengths from 0 up begins by itself."""
    result = msf(Scene(Field({"x": "-x"}), "x->x", topology("chain", 2)), strengths, starts=1, show_progress=False)
    assert message in _ends(result)


@pytest.mark.parametrize(("record", "pictures"), [(("sync_error",), 3), ((), 2)])
def test_observables_and_the_sweep_are_shown(
    record: tuple[str, ...], pictures: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "synchain.runtime.reports.scene_report.run", partial(run, width=1)
    )  # the drivers of other tests
    scene = Scene(
        "harmonic", "spring", topology("chain", 2), record=record, transient=1, window=1, axes={"sigma": [0.1, 0.2]},
        observe={"place": "mean(nodes.mean(x))"}, integrator="dop853",
    )  # fmt: skip
    page = report(scene, FAST, show_progress=False)
    assert page.count("<img ") == pictures
    assert page.count('alt="place"') == 1
    assert "sigma from 0.1 to 0.2, 2 values" in page
    assert "place = mean(nodes.mean(x))" in page


def test_what_is_drawn_is_said() -> None:
    scene = Scene(topology=topology("chain", 2), realisations=3, draws={"x": "uniform(0, 1)", "omega": [1, 1.1, 1.2]})
    assert dict(provenance_rows(scene))["drawn"] == "x = uniform(0.0, 1.0); omega = a list, 3 realisations"
    assert "drawn" not in dict(provenance_rows(scene.replace(realisations=0, draws=None)))


@needs_browser
def test_the_browser_has_no_complaint_and_asks_for_nothing(folder: Path) -> None:
    log = folder / "net.json"
    said = browse(folder / "page.html", "--dump-dom", f"--log-net-log={log}", "--disable-background-networking")
    assert "CONSOLE" not in said
    requested = re.findall(r'"url":"(https?:[^"]*)"', log.read_text(errors="replace"))
    assert [url for url in requested if "w3.org" in url] == []
    bad = folder / "bad.html"
    bad.write_text(
        (folder / "page.html").read_text("utf-8").replace("<h1>", '<img src="http://localhost:9/a.png"><h1>')
    )
    assert "CONSOLE" in browse(bad, "--dump-dom"), "a request would be a complaint"


@needs_browser
@pytest.mark.parametrize("options", [pytest.param((), marks=pytest.mark.long), (DARK,)], ids=["light", "dark"])
def test_formulas_axes_and_graph_are_seen(folder: Path, options: tuple[str, ...]) -> None:
    picture = seen(folder, "page", *options)
    ground = picture[5, 5]
    assert (ground.mean() < 0.3) == bool(options)
    for name, least in (("no_math", 1000), ("no_img", 5000), ("no_svg", 1000)):
        other = seen(folder, name, *options)
        assert int(np.any(np.abs(picture - other) > 0.2, axis=2).sum()) > least, name
    curve = np.all(np.abs(picture - np.array([0x00, 0x72, 0xB2]) / 255) < 0.1, axis=2)
    assert int(curve.sum()) > 500
    heading = np.abs(picture[: SIZE[1] // 12, 60:] - ground).max(axis=2)
    assert heading.max() > 0.7, "the heading stands out of the ground"


@needs_browser
def test_it_prints(folder: Path) -> None:
    paper = folder / "page.pdf"
    browse(folder / "page.html", f"--print-to-pdf={paper}", "--no-pdf-header-footer", DARK)
    assert paper.read_bytes().startswith(b"%PDF")
    assert paper.stat().st_size > 20_000
