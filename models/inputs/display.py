"""Base classes of values with HTML, LaTeX or a drawing in notebooks; the rooms above write these."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .keywords import check_methods

if TYPE_CHECKING:
    from typing import TypeAlias

    Axes: TypeAlias = Any


class HasHtml:
    """A value with HTML for notebooks, written by `synchain.runtime.reports`.

    Its public methods refuse wrong arguments as public functions do (`check_methods`).
    """

    __slots__ = ()

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        check_methods(cls)

    def _repr_html_(self) -> str:
        from synchain.runtime.reports.html import fragment

        return fragment(self)


class HasLatex(HasHtml):
    """A value with LaTeX besides."""

    __slots__ = ()

    def _repr_latex_(self) -> str:
        from synchain.runtime.reports.html import latex

        return latex(self)


class HasDrawing(HasHtml):
    """A graph, or a value with a graph."""

    __slots__ = ()

    def draw(self, ax: Axes | None = None, values: object = None, **style: Any) -> Axes:
        """Draw the graph: widths show weights, arrows one-way links, colours kinds of nodes or values.

        Parameters
        ----------
        ax : matplotlib axes, optional
            By default pyplot's current ones, or those of a new figure.
        values : array_like (n,), optional
            Colour of each node: whole numbers are classes, such as clusters; others are numbers of a colour map.
        **style
            Keywords of `matplotlib.axes.Axes.scatter` for the nodes, such as `cmap`, `vmin`, `s`.

        Returns
        -------
        matplotlib axes

        Examples
        --------
        >>> import synchain as sc
        >>> axes = sc.ring(6).draw(values=[0, 1, 2, 0, 1, 2])
        """
        from synchain.runtime.plots.graph_picture import draw_graph

        return draw_graph(self, ax, values, **style)
