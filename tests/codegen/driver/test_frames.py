"""Orthogonal directions of a frame against NumPy's Householder factorisation."""

from __future__ import annotations

import numpy as np
import pytest

from synchain.codegen.driver import frames

SIZE, COUNT, STRIDE = 6, 4, 8


def factorised(columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return orthonormal columns and the diagonal of the triangular factor."""
    rows = np.zeros((SIZE, STRIDE))
    rows[:, :COUNT] = columns
    flat, lengths = rows.ravel(), np.zeros(COUNT)
    frames.orthogonalise(flat, SIZE, STRIDE, COUNT, lengths, np.zeros(COUNT))
    return flat.reshape(SIZE, STRIDE)[:, :COUNT], lengths


@pytest.mark.parametrize("angle", [1.0, 1e-8, 1e-13])
def test_columns_that_nearly_agree(angle: float) -> None:
    random = np.random.default_rng(1)
    first = random.normal(size=(SIZE, 1))
    columns = first + angle * random.normal(size=(SIZE, COUNT))
    columns /= np.linalg.norm(columns, axis=0)
    basis, lengths = factorised(columns)
    np.testing.assert_allclose(basis.T @ basis, np.eye(COUNT), atol=4e-16 * SIZE)
    diagonal = np.abs(np.diagonal(np.linalg.qr(columns)[1]))
    np.testing.assert_allclose(lengths, diagonal, rtol=1e-13 / angle, atol=1e-16)


@pytest.mark.parametrize("lost", [(1,), (0, 2), (0, 1, 2, 3)])
def test_columns_that_vanish_or_repeat_are_replaced(lost: tuple[int, ...]) -> None:
    """A column of zeros, or a second one in the same direction: the others stay as they are."""
    columns = np.linalg.qr(np.random.default_rng(2).normal(size=(SIZE, COUNT)))[0]
    kept = [k for k in range(COUNT) if k not in lost]
    columns[:, lost] = 0.0
    repeated = columns.copy()
    if len(lost) == 1:
        repeated[:, 1] = columns[:, 0]
    for given in (columns, repeated):
        basis, lengths = factorised(given)
        np.testing.assert_allclose(basis.T @ basis, np.eye(COUNT), atol=4e-16 * SIZE)
        np.testing.assert_allclose(basis[:, kept], columns[:, kept], atol=1e-15)
        np.testing.assert_allclose(lengths, [float(k in kept) for k in range(COUNT)], atol=1e-15)


def close(growth: np.ndarray, lengths: np.ndarray, whole: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return the sums and the frame after one block with the volume -30, at rtol = 1e-8."""
    frame, sums = np.zeros((4, len(growth))), np.zeros(len(growth) + 1)
    frame[0], frame[2] = np.inf, lengths
    frames.close_block(growth, -30.0, whole, np.array([1e-8]), frame, sums)
    return sums, frame


def test_the_volume_tells_the_growth_of_a_single_lost_direction() -> None:
    growth, lengths = np.array([1.0, -np.inf, 0.5]), np.array([1.0, 0.0, 0.5])
    sums, frame = close(growth, lengths, True)
    np.testing.assert_allclose(sums, [1.0, -30.0 - 1.5 - np.log(0.5), 0.5 + np.log(0.5), -30.0], rtol=1e-15)
    np.testing.assert_array_equal(frame[:2], [[1.0, 0.0, 0.5], [0.0, 0.0, 0.0]])


def test_a_lost_direction_is_counted_if_the_volume_does_not_tell_its_growth() -> None:
    for lengths, whole, losses in (
        ([1.0, 0.0, 1.0], False, [0.0, 1.0, 0.0]),
        ([1.0, 0.0, 1e-8], True, [0.0, 1.0, 1.0]),
    ):
        sums, frame = close(np.array([1.0, -np.inf, 0.0]), np.array(lengths), whole)
        assert sums[1] == 0.0
        np.testing.assert_array_equal(frame[1], losses)
