"""A page of one result, or of several next to each other; and its pictures as files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from shiplog.nomenclature.contract import CONTRACT
from shiplog.report.page import html, results
from shiplog.report.page.comparison import alike
from shiplog.report.page.comparison import page as comparison_page
from shiplog.report.page.health import page as health_page
from shiplog.report.result import Answer
from shiplog.voyages.store.store import Store


def report_results(
    paths: Sequence[Path], out: Path | None, figures: Path | None, anyway: bool = False
) -> Answer:
    """Writes what is asked for. Raises ShiplogError."""
    if len(paths) == 1:
        page, content, place = results.page_of(paths[0])
    else:
        results.refuse_same_names(paths)
        items = [results.item_of(path) for path in paths]
        if not anyway:
            alike.refuse_unlike(items)
        page, content, place = comparison_page.of_items(items), None, Path("report.html")
    made = [] if figures is None else results.pictures_of(content, figures)
    to = html.write(page, out or place)
    lines, found = [f"Page: {to}"], {"contract": CONTRACT, "page": str(to)}
    if figures is not None:
        lines.append(f"Pictures: {len(made)} files in {figures}")
        found["figures"] = str(figures)
    return Answer(lines, found)


def health_report(store: Store, names: Sequence[str], page: Path) -> Path:
    """The page of what `ingest` found in these voyages. Raises ShiplogError."""
    return html.write(health_page.of_voyages(store, list(dict.fromkeys(names))), page)
