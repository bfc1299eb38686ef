"""Words for the user: lines while something compiles, hints, limits before memory is taken, names
as formulas.
"""

from __future__ import annotations

import logging
import math
from argparse import ArgumentTypeError

import numpy as np
import pytest
from catalogue import PAIR
from test_load import SOURCE

from synchain import run
from synchain.codegen.machine_code import compile as loading
from synchain.models.presentation.writer import Latex
from synchain.runtime import cli
from synchain.runtime.cells.reduce import reduce_scene
from synchain.runtime.cli import main
from synchain.runtime.console.arguments import spaced
from synchain.runtime.engines import ladder_engine
from synchain.runtime.engines.scene_kernels import warn_of_chords, write_kernel
from synchain.runtime.prediction.synchronisability import Window
from synchain.runtime.support.error_text import interval_text, with_error
from synchain.runtime.sweeps.certify import check_certifiable
from synchain.runtime.sweeps.stream import claim

LARGE = {"sigma": np.linspace(0, 1, 1000), "x_1": np.linspace(0, 1, 1000), "x_2": np.linspace(0, 1, 1000)}


def test_what_rounds_to_zero_has_no_sign():
    tiny, window = -2.7e-05, Window(-2.7e-05, 0.3, 3e-05, 0.0, None, None)
    written = [interval_text([(tiny, 0.3)], [(3e-03, 0.0)]), interval_text([(-1e-9, -0.0)]), with_error(tiny, 1e-3)]
    assert [*written, with_error(-0.0), with_error(tiny), window.text()] == [
        "0.0000 ± 0.0030 … 0.3000", "-1e-09 … 0.0000", "0.0000 ± 0.0010", "0.0000", "-2.7e-05", "-2.7e-05... … 0.3000...",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("value", "error", "expected"),
    [
        (0.177216, 0.00052, "0.17722 ± 0.00052"),
        (0.177216, 0.0996, "0.18 ± 0.10"),
        (0.2326345, 5.5e-07, "0.23263450 ± 5.5e-07"),
        (123456.0, 1234.0, "123500 ± 1200"),
        (7.3, 1.0, "7.3 ± 1.0"),
        (0.3, 1e-17, "0.3000"),
        (-0.00099994, 0.0, "-0.0009999"),
        (-3.6548e-33, 8.1e-47, "-3.655e-33 ± 8.1e-47"),
        (1.76796e-06, 3e-13, "0.00000176796000 ± 3.0e-13"),
        (0.3, math.inf, "0.3000 ± unknown"),
        (0.3, math.nan, "0.3000 ± unknown"),
        (-math.inf, math.nan, "-inf"),
    ],
)
def test_a_value_has_the_decimal_place_of_its_error(value, error, expected):
    assert with_error(value, error) == expected


def test_dots_follow_the_ends_of_a_grid_but_not_a_lower_end_at_zero():
    assert interval_text([(0.0, 0.1), (0.2, 0.4)], grid_ends=(0.0, 0.4)) == "0.0000 … 0.1000; 0.2000 … 0.4000..."
    assert interval_text([(-0.4, 0.0)], [(math.inf, 0.0)], grid_ends=(-0.4, 0.0)) == "-0.4000... … 0.0000..."
    assert interval_text([(k, k + 0.5) for k in range(10)], most=1) == "0.0000 … 0.5000; 9 more"


def test_compiling_is_told_and_loading_is_not(tmp_path, monkeypatch, caplog):
    monkeypatch.setenv("SYNCHAIN_CACHE", str(tmp_path / "kernels"))
    said = ("compiling the driver of sweeps, 1 lane, ", "compiling a kernel for 1 oscillator (cash_karp), ")
    with caplog.at_level(logging.INFO, "synchain"):
        for _ in range(2):
            loading.forget()
            loading.load(SOURCE)
        assert [record.getMessage() for record in caplog.records] == [begin + "kept for later runs" for begin in said]
        monkeypatch.setenv("SYNCHAIN_CACHE", __file__)
        loading.forget()
        with pytest.warns(RuntimeWarning, match="not kept on disk"):
            loading.load(SOURCE)
    assert [record.getMessage() for record in caplog.records[2:]] == [
        begin + "for this process alone" for begin in said
    ]


def test_the_command_line_prints_what_is_told_and_leaves_no_trace(capsys):
    logger = logging.getLogger("synchain")
    before = logger.level, list(logger.handlers)
    with cli._log_lines("synchain run"):
        logging.getLogger("synchain.codegen.machine_code.compile").info("compiling a kernel")
    assert capsys.readouterr().err == "synchain run: compiling a kernel\n"
    assert (logger.level, logger.handlers) == before


@pytest.mark.parametrize(
    ("name", "written", "indexed"),
    [
        ("mu_k_2", r"\mu_{k,2}", r"\mu_{k,2,i}"),
        ("u_0", "u_0", "u_{0,i}"),
        ("u0", "u_0", "u_{0,i}"),
        ("theta_b", r"\vartheta_b", r"\vartheta_{b,i}"),
        ("mass_ratio", r"\mathrm{mass}_{\mathrm{ratio}}", r"\mathrm{mass}_{\mathrm{ratio},i}"),
        ("c_alpha", r"c_{\alpha}", r"c_{\alpha,i}"),
        ("Alpha", r"\mathrm{A}", r"\mathrm{A}_i"),
        ("a1b", r"\mathrm{a1b}", r"\mathrm{a1b}_i"),
    ],
)
def test_names_have_one_subscript(name, written, indexed):
    assert Latex().letter(name) == written
    assert Latex().letter(name, "i") == indexed


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("--symbolic --matrix {file} --value a", "--value: found 'a'; expected NAME=NUMBER, e.g. a=1/2"),
        ("circulant 9 --option a", "--option: found 'a'; expected NAME=VALUE, e.g. offsets=1,3"),
    ],
)
def test_a_hint_shows_the_option_that_was_used(text, expected, tmp_path, capsys):
    (tmp_path / "S.txt").write_text("a -a\n-b b\n")
    assert main(["spectrum", *text.format(file=tmp_path / "S.txt").split()]) == 2
    assert expected in capsys.readouterr().err


def test_grids_of_the_command_line_have_the_limit_of_an_axis():
    assert len(spaced("0:1:200001")) == 200001
    with pytest.raises(ArgumentTypeError, match="expected at most 10000000"):
        spaced("0:1:10000001")


def test_a_sweep_that_does_not_fit_is_refused_before_memory_is_taken():
    scene = PAIR.replace(axes=LARGE)
    with pytest.raises(ValueError, match=r"1000000000 cells, 144 GB in memory; expected at most 8 GB; .* with stream"):
        reduce_scene(scene, reduce=False).check_memory()
    fewer = {name: values[:300] for name, values in LARGE.items()}
    reduce_scene(PAIR.replace(axes=fewer), reduce=False).check_memory()
    with pytest.raises(ValueError, match="expected at most 8 GB"):
        run(scene, reduce=False)
    with pytest.raises(ValueError, match="found 1000000000, expected at most 10000000"):
        check_certifiable(scene)
    with pytest.raises(ValueError, match="found 1001000000 cells; expected at most 1000000000; use fewer"):
        PAIR.replace(axes={**LARGE, "x_2": range(1001)})


def test_the_room_for_section_points_is_bounded():
    """Two a period, and never more than LARGEST_ROOM numbers for the cells of a block together."""
    short = PAIR.replace(record=("section",), window=100 * np.pi)
    assert ladder_engine.first_room(short, 64 * 5) == 200 + 8
    assert ladder_engine.first_room(PAIR, 64 * 5) == 0
    long = PAIR.replace(record=("section",), window=1e8)
    assert 64 * 5 * (ladder_engine.first_room(long, 64 * 5) - 8) <= ladder_engine.LARGEST_ROOM
    assert ladder_engine.first_room(long, 5) == 1_000_000 + 8


@pytest.mark.filterwarnings("error")
def test_records_between_steps_of_straight_lines_are_warned_of():
    scene = PAIR.replace(integrator="rodas6p", record=("trajectory",), samples=5, parameters={"sigma": 1})
    with pytest.warns(RuntimeWarning, match="rodas6p draws straight lines .* errors of trajectory"):
        warn_of_chords(write_kernel(reduce_scene(scene, False)))
    for other in (scene.replace(integrator="rodas5p"), scene.replace(record=("sync_error",))):
        warn_of_chords(write_kernel(reduce_scene(other, False)))  # a warning would be an error


def test_messages_about_files_name_the_keyword_and_the_option(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"run without resume \(--resume\)"):
        claim(reduce_scene(PAIR), tmp_path / "a.nc", resume=True)
    (tmp_path / "a.nc").write_bytes(b"no netCDF")
    with pytest.raises(OSError, match=r"a\.nc is no netCDF file; expected a netCDF 3 result"):
        claim(reduce_scene(PAIR), tmp_path / "a.nc")
