"""The frequency of the drive on the command line: set by `--omega`, and named in reports."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

from .outcome import WrongUse

if TYPE_CHECKING:
    from synchain.models.scenes.scene import Scene

__all__ = ["at_frequency", "drive_period", "drive_words"]


def at_frequency(scene: Scene, omega: float | None, where: str | None, given: Collection[str] = ()) -> dict[str, float]:
    """Return the parameter that sets the frequency of a scene's drive.

    Parameters
    ----------
    scene : Scene
        The scene with its drive.
    omega : float or None
        The frequency that --omega asks for, in radians per unit of time.
    where : str or None
        The user's word for the scene, for messages; None if no scene is named.
    given : collection of str
        The parameters that --set gives.

    Returns
    -------
    dict of str to float
        The parameter and its value; empty if `omega` is None.

    Raises
    ------
    WrongUse
        If `omega` is asked for and the drive has no frequency that is a parameter, or --set gives
        it. Without `omega` or --set: if an axis of the scene moves the frequency, or if no scene is
        named.
    """
    frequency = scene.drive.frequency
    names = set() if frequency is None else {s.name for s in frequency.free_symbols}
    if names & set(given):
        if omega is not None:
            raise WrongUse(f"found --omega beside --set {' '.join(sorted(names & set(given)))}; expected one of them")
        return {}
    if omega is not None:
        if frequency is None:
            raise WrongUse(f"--omega: the oscillator of {where} {scene.drive.problem}; leave it out")
        if not frequency.is_Symbol:
            raise WrongUse(
                f"--omega: the drive of {where} has the frequency {frequency}; expected one that is a parameter; "
                "leave it out"
            )
        return {frequency.name: omega}
    if where is None:
        raise WrongUse("expected a frequency of the drive, e.g. --omega 1.4, or a SCENE")
    swept = next((axis.name for axis in scene.axes if axis.name in names), None)
    if swept is not None:
        raise WrongUse(f"{where} sweeps {swept}; expected one frequency of the drive, e.g. --omega 1.4")
    return {}


def drive_words(scene: Scene, axes: Collection[str] = ()) -> str:
    """The frequency of the drive in a headline, such as ", omega = 1.4"; nothing without one, or if
    it is among `axes`.
    """
    frequency, value = scene.drive.frequency, scene.angular_frequency
    if frequency is None or value is None or {s.name for s in frequency.free_symbols} & set(axes):
        return ""
    return f", {frequency} = {value:g}" if frequency.free_symbols else f", drive frequency {value:g}"


def drive_period(scene: Scene, axes: Collection[str] = ()) -> float:
    """The period of the drive; 0 without one, or if its frequency is among `axes`."""
    return (scene.period or 0.0) if drive_words(scene, axes) else 0.0
