"""Base classes of values that a notebook shows as HTML, LaTeX or a drawing; `synchain.runtime` makes these."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .keywords import check_methods

if TYPE_CHECKING:
    from typing import TypeAlias

    Animation: TypeAlias = Any
    ArrayLike: TypeAlias = Any
    Axes: TypeAlias = Any


class HasHtml:
    """A value with HTML for notebooks, written by `synchain.runtime.reports`.

    Public methods of a subclass refuse wrong arguments like public functions (`check_methods`).
    """

    __slots__ = ()

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        check_methods(cls)

    def _repr_html_(self) -> str:
        from synchain.runtime.reports.html import fragment

        return fragment(self)


class HasLatex(HasHtml):
    """A value with HTML and LaTeX."""

    __slots__ = ()

    def _repr_latex_(self) -> str:
        from synchain.runtime.reports.html import latex

        return latex(self)


class HasPlot(HasHtml):
    """A value with a plot of its numbers."""

    __slots__ = ()

    def plot(self, ax: Axes | None = None, **style: Any) -> Axes:
        """Draw the value into the current figure of pyplot, or into given axes.

        Parameters
        ----------
        ax : matplotlib axes, optional
            By default pyplot's current axes, or the axes of a new figure.
        **style
            Keywords of the Matplotlib artist that draws the main curve or the colours, such as
            `color`, `linewidth`, `cmap`.

        Returns
        -------
        matplotlib axes
            ``plt.show()`` shows the figure, a notebook shows it after the cell, and
            ``plt.savefig("figure.png")`` writes it.
        """
        from synchain.runtime.plots.drawing import drawn

        return drawn(self, ax, **style)


class HasAnimation(HasPlot):
    """A value that can be animated."""

    __slots__ = ()

    def animate(self, seconds: float = 10.0, fps: int = 25) -> Animation:
        """Return an animation of the first cell: a notebook plays it, ``save("motion.gif")`` writes it.

        Up to twelve oscillators with friction or stops are drawn as masses on a moving belt, between walls.  Held
        masses are orange; after an impact that the record of events has, the mass has a red edge.  Other oscillators
        are drawn as nodes of their graph, coloured by the first state.  A phase portrait is drawn beside them.

        Parameters
        ----------
        seconds : float, optional
            Length of the animation, which shows the whole recorded window.
        fps : int, optional
            Frames a second.

        Returns
        -------
        matplotlib.animation.FuncAnimation
            ``save`` writes GIF files with Pillow, and MP4 files with ffmpeg if ffmpeg is installed.

        Raises
        ------
        ValueError
            If no trajectory was recorded, or for more than 200 oscillators.

        Examples
        --------
        >>> import synchain as sc
        >>> scene = sc.Scene("friction", "spring", sc.graphs.chain(3), record=["trajectory"], contact="set-valued", window=4)
        >>> motion = sc.run(scene, sigma=0.1).animate(seconds=2)
        >>> motion.save("motion.gif")  # doctest: +SKIP
        """
        from synchain.runtime.plots.animation import animate

        return animate(self, seconds, fps)  # type: ignore[arg-type]  # self is a Result, the only subclass


class HasDrawing(HasHtml):
    """A graph, or a value that contains a graph."""

    __slots__ = ()

    def draw(self, ax: Axes | None = None, values: ArrayLike | None = None, **style: Any) -> Axes:
        """Draw the graph: line widths show weights, arrows show one-way links, colours show kinds of nodes or values.

        Parameters
        ----------
        ax : matplotlib axes, optional
            By default pyplot's current axes, or the axes of a new figure.
        values : array_like (n,), optional
            Values that colour the nodes: whole numbers are classes, such as clusters, and a node alone in its class is grey;
            other numbers use a colour map.
        **style
            Keywords of `matplotlib.axes.Axes.scatter` for the nodes, such as `cmap`, `vmin`, `s`.

        Returns
        -------
        matplotlib axes

        Examples
        --------
        >>> import synchain as sc
        >>> axes = sc.graphs.ring(6).draw(values=[0, 1, 2, 0, 1, 2])
        """
        from synchain.runtime.plots.graph_picture import draw_graph

        return draw_graph(self, ax, values, **style)
