"""Pictures of basins: the pixels, lines and labels are those of the numbers."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.colors import to_rgba

import synchain as sc

WELLS = sc.Scene(
    sc.Field({"x": "x - x**3"}), "x->x", sc.graphs.chain(2), parameters={"sigma": 0.01}, transient=40, window=5
)
NAMES = {"left": "mean(x_1) < 0 and mean(x_2) < 0", "right": "mean(x_1) > 0 and mean(x_2) > 0"}
GRID = np.linspace(-0.9, 0.9, 6)


@pytest.fixture(scope="module")
def image() -> sc.results.Basin:
    return sc.basin(WELLS, attractors=NAMES, x_1=GRID, x_2=GRID[::-1], show_progress=False)


@pytest.fixture(scope="module")
def swept() -> sc.results.Basin:
    return sc.basin(WELLS, attractors=NAMES, samples=20, sigma=[0.02, 0.0], nodes="each", show_progress=False)


@pytest.mark.parametrize("style", ["default", "dark_background"])
def test_an_image_has_the_colours_of_the_fates(image: sc.results.Basin, style: str) -> None:
    with plt.style.context(style):
        axes = image.plot(plt.subplots()[1])
    pixels = np.asarray(axes.collections[0].get_array()).reshape(6, 6)  # rows of x_2, upwards
    right = (GRID > 0)[:, None] & (GRID > 0)
    assert np.array_equal(pixels == image.labels.index("right"), right)
    legend = axes.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["left", "right", "other"]
    faces = [patch.get_facecolor() for patch in legend.get_patches()]
    assert len(set(faces)) == 3
    assert to_rgba(axes.get_facecolor()) not in faces


def test_shares_are_drawn_with_their_intervals(swept: sc.results.Basin) -> None:
    first = sc.basin(WELLS, attractors=NAMES, samples=20, sigma=[0.02, 0.0, 0.01], show_progress=False)
    axes = first.plot(plt.subplots()[1])
    (line,) = (each for each in axes.lines if each.get_label() == "left")
    assert list(line.get_xdata()) == [0.0, 0.01, 0.02]
    assert list(line.get_ydata()) == first.shares.sel(attractor="left").sortby("sigma").values.tolist()
    band = axes.collections[0].get_paths()[0].vertices[:, 1]
    assert band.max() == first.intervals.sel(attractor="left", bound="high").max()
    assert swept.plot(plt.subplots()[1]).get_xlabel() == "perturbed node"
    dots = swept.plot(plt.subplots()[1], kind="starts")
    assert sum(len(line.get_xdata()) for line in dots.lines) == 20


def test_kinds_without_numbers_are_refused(image: sc.results.Basin, swept: sc.results.Basin) -> None:
    with pytest.raises(
        ValueError, match=r"unknown kind of plot 'imag'; known: image, shares, starts; did you mean 'image'"
    ):
        image.plot(kind="imag")
    with pytest.raises(ValueError, match="no numbers for the plot 'image'; it has them for: shares, starts"):
        swept.plot(kind="image")
