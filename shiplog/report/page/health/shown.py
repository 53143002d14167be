"""Pictures and page of voyages' health; what is heavy is imported when one is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from shiplog.voyages.store.store import Store

if TYPE_CHECKING:
    from shiplog.report.figures.plots import Plots


def plots(store: Store, names: Sequence[str]) -> Plots:
    from shiplog.report.figures.plots import Plots
    from shiplog.report.page.health.page import content

    return Plots(content(store, names, {name: store.report(name) for name in names}))


def rendered(store: Store, names: Sequence[str]) -> str:
    from shiplog.report.page import html
    from shiplog.report.page.health.page import of_voyages

    return html.render(of_voyages(store, names))
