"""The frequency of the drive on the command line: set by `--omega`, and named in reports."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .outcome import WrongUse

if TYPE_CHECKING:
    from synchain.models.scenes.scene import Scene

__all__ = ["at_frequency", "drive_words"]


def at_frequency(scene: Scene, omega: float | None, where: str | None) -> dict[str, float]:
    """Return the parameter that sets the frequency of a scene's drive.

    Parameters
    ----------
    scene : Scene
        The scene with its drive.
    omega : float or None
        The frequency that --omega asks for, in radians per unit of time.
    where : str or None
        The user's word for the scene, for messages; None if no scene is named.

    Returns
    -------
    dict of str to float
        The parameter and its value; empty if `omega` is None.

    Raises
    ------
    WrongUse
        If `omega` is asked for and the drive has no frequency that is a parameter. Without
        `omega`: if an axis of the scene moves the frequency, or if no scene is named.
    """
    frequency = scene.drive.frequency
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
    names = set() if frequency is None else {s.name for s in frequency.free_symbols}
    swept = next((axis.name for axis in scene.axes if axis.name in names), None)
    if swept is not None:
        raise WrongUse(f"{where} sweeps {swept}; expected one frequency of the drive, e.g. --omega 1.4")
    return {}


def drive_words(scene: Scene) -> str:
    """The frequency of the drive in a headline, such as ", omega = 1.4"; nothing without one."""
    frequency, value = scene.drive.frequency, scene.angular_frequency
    if frequency is None or value is None:
        return ""
    return f", {frequency} = {value:g}" if frequency.free_symbols else f", drive frequency {value:g}"
