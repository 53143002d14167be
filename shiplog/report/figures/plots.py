"""The pictures of a result in Python: `result.plot()` and `result.plot.<name>(ax=…)`."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from shiplog.exceptions import listed
from shiplog.report.figures import pictures
from shiplog.report.figures.content import Content

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


class Plots:
    """Called, all pictures in one figure; as attributes, each alone: `plot.closeup()`.

    A picture takes `ax`, axes to draw on (polar ones for `wind`). One of a voyage takes `voyage`,
    the first unless given. Each returns its matplotlib figure.
    """

    def __init__(self, content: Content) -> None:
        self._content = content

    def __call__(self) -> Figure:
        return pictures.every(self._content)

    def __getattr__(self, name: str) -> Callable[..., Figure]:
        if name.startswith("_") or name not in pictures.PICTURES:
            known = listed(pictures.PICTURES, most=30)
            raise AttributeError(f"there is no picture {name!r}; there are {known}")

        def draw(ax: Axes | None = None, voyage: str | None = None) -> Figure:
            content = self._content
            if pictures.PICTURES[name].voyage:
                names = content.data.names
                if voyage is not None and voyage not in names:
                    raise KeyError(f"{voyage!r} is not among {listed(names)}")
                content = pictures.of_voyage(content, voyage or names[0])
            return pictures.figure(name, content, ax)

        draw.__name__, draw.__doc__ = name, pictures.PICTURES[name].title
        return draw

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *pictures.PICTURES]

    def __repr__(self) -> str:
        return f"<pictures {listed(pictures.PICTURES, most=30)}>"
