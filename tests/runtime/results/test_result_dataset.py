"""A result reads like its dataset, and its attributes follow the CF conventions."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from synchain import Scene, open_result, run
from synchain.graphs import chain
from synchain.results import Result, Status


@cache
def swept() -> Result:
    scene = Scene(topology=chain(2), record=("sync_error", "trajectory"), samples=3, transient=1, window=1)
    return run(scene, sigma=[0.1, 0.2], omega=[1.1, 1.2, 1.3], show_progress=False)


def test_items_selections_and_names_are_those_of_the_dataset() -> None:
    result = swept()
    assert result["sync_error"].identical(result.data["sync_error"])
    assert result["time"].identical(result.data["time"])
    assert result[["status", "end"]].identical(result.data[["status", "end"]])
    assert result.sel(sigma=0.2, omega=1.2, component="v").identical(
        result.data.sel(sigma=0.2, omega=1.2, component="v")
    )
    assert result.sel({"sigma": 0.11}, method="nearest").sigma == 0.1
    assert result.isel(omega=-1).identical(result.data.isel(omega=-1))
    assert result.to_xarray() is result.data
    assert list(result) == list(result.data)
    assert "time" in result
    assert "nothing" not in result


def test_tables_have_a_row_for_each_cell_or_each_number() -> None:
    result = swept()
    cells = result.to_dataframe()
    assert cells.index.names == ["sigma", "omega"]
    assert len(cells) == 6
    assert "end" not in cells
    np.testing.assert_array_equal(cells["sync_error"], result.sync_error.values.ravel())
    samples = result.to_dataframe("trajectory")
    assert samples.index.names == ["sigma", "omega", "sample", "component", "node"]
    assert len(samples) == 6 * 3 * 2 * 2
    assert "time" in samples
    one = run(Scene(topology=chain(2), transient=1, window=1), show_progress=False)
    assert one.to_dataframe()["status"].tolist() == [Status.FINISHED]


def test_a_refusal_lists_the_variables_and_names_the_dataset() -> None:
    result = swept()
    for name in ("nothing", ["status", "nothing"]):
        with pytest.raises(KeyError, match=r"no 'nothing'; it has: .*sync_error.*; its dataset is \.data"):
            result[name]
    with pytest.raises(
        AttributeError, match=r"no 'groupby'; it has: .*; methods of its dataset: result\.data\.groupby"
    ):
        _ = result.groupby
    with pytest.raises(KeyError, match="not all values found"):
        result.sel(sigma=3.0)


@pytest.mark.parametrize("ending", ["nc", "nc4", "zarr"])
def test_units_and_flags_are_kept_by_files(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"a.{ending}"
    swept().save(path)
    found = open_result(path)
    assert isinstance(found, Result)
    assert found.data.attrs["Conventions"].startswith("CF-")
    flags = found["status"].attrs
    assert list(flags["flag_values"]) == [int(code) for code in Status]
    assert flags["flag_meanings"].split() == [code.name.lower() for code in Status]
    assert "units" not in flags
    assert {found[name].attrs["units"] for name in ("steps", "time", "end", "sync_error")} == {"1"}


def test_states_of_a_model_without_scales_have_its_own_units() -> None:
    result = run(Scene("duffing", "spring", chain(2), transient=1, window=1), show_progress=False)
    assert "units" not in result["end"].attrs
    assert result["steps"].attrs["units"] == "1"
    assert isinstance(result["end"], xr.DataArray)
