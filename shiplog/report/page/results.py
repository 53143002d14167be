"""Which page a path asks for: a table by what lies in the folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from shiplog.exceptions import ShiplogError
from shiplog.report.figures import pictures
from shiplog.report.figures.content import Content
from shiplog.report.page.blocks import Page
from shiplog.report.page.comparison.alike import Item
from shiplog.report.page.diagnosis import page as diagnosis_page
from shiplog.report.page.diagnosis import source as verdicts
from shiplog.report.page.evaluation import page as evaluation_page
from shiplog.report.page.evaluation import source as evaluations
from shiplog.report.page.health import page as health_page
from shiplog.report.page.paper import page as paper_page
from shiplog.voyages.store import catalogue
from shiplog.voyages.store.store import Store

VOYAGE = "voyage="  # begins the name of a voyage's folder in a store
NO_RESULT = (
    "give the folder of a diagnosis (--out), a run that `shiplog evaluate` was asked of, a store, "
    "or the folder of a voyage in a store"
)


def page_of(path: Path) -> tuple[Page, Content | None, Path]:
    """Page, its pictures' content, and where the page goes unless that is given."""
    if verdicts.is_verdict(path):
        source = verdicts.read(path)
        return diagnosis_page.of_source(source), source.content, path / "report.html"
    if (path / "config.toml").is_file():
        source = evaluations.read(path / evaluations.FOLDER)
        return evaluation_page.of_source(source), source.content, path / "report.html"
    if (path / paper_page.ANSWER).is_file():
        return paper_page.of_folder(path), None, path / "report.html"
    if path.name.startswith(VOYAGE) and (path / "voyage.json").is_file():
        store, name = Store(path.parent), catalogue.name_of(path)
        return health_page.of_voyages(store, store.select([name])), None, Path(f"{name}.html")
    if any(path.glob(f"{VOYAGE}*")):
        store = Store(path)
        return health_page.of_voyages(store, store.select([])), None, Path("report.html")
    if not path.exists():
        raise ShiplogError(f"{path} does not exist.", hint=f"{NO_RESULT}.")
    raise ShiplogError(f"{path} is no result of shiplog.", hint=f"{NO_RESULT}.")


def item_of(path: Path) -> Item:
    """A verdict or an evaluation, by the name of its folder."""
    if verdicts.is_verdict(path):
        source = verdicts.read(path)
        return Item(path.name, "verdict", source.subject, source)
    if (path / "config.toml").is_file():
        found = evaluations.read(path / evaluations.FOLDER)
        return Item(path.name, "evaluation", found.subject, found)
    raise ShiplogError(
        f"{path} is no verdict and no evaluation.",
        hint="several results are compared: folders of `shiplog diagnose`, or runs that `shiplog "
        "evaluate` was asked of.",
    )


def refuse_same_names(results: Sequence[Path]) -> None:
    """Raises ShiplogError for two results of one name: a page could not tell them apart."""
    names = [path.name for path in results]
    for name in names:
        if names.count(name) > 1:
            raise ShiplogError(
                f"Two of the results are called {name}.", hint="rename one of the folders."
            )


def pictures_of(content: Content | None, folder: Path) -> list[Path]:
    """The pictures of one result as files. Raises ShiplogError where the result has none."""
    if content is None:
        raise ShiplogError(
            "--figures draws the pictures of one diagnosis or evaluation.",
            hint="leave it out, or give one such result.",
        )
    return pictures.save(content, folder)
