"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from shiplog.cli import completion
from shiplog.exceptions import UsageError
from shiplog.nomenclature.channels import AUTO_WINDOW, LEAST_WINDOW


def page_file(report: Path | None) -> Path | None:
    """Whether --report can be written is known before the work."""
    if report is None:
        return None
    from shiplog.machine.paths import check_page

    return check_page(report, "--report")


def _ask_json(json_to: str | None) -> str | None:
    """Whether --json can be written is known before the work."""
    if json_to is None or json_to == "-":
        return json_to
    if not json_to:
        raise UsageError("--json is given no path.", hint="give --json a file's path, or -.")
    from shiplog.machine.paths import check_file

    return str(check_file(Path(json_to), "--json", streams=True))


def _window(text: str) -> str:
    """Whole seconds, or auto."""
    least = f"Input should be {AUTO_WINDOW}, or a whole number greater than or equal to "
    if text != AUTO_WINDOW and (not text.isdecimal() or int(text) < LEAST_WINDOW):
        raise typer.BadParameter(f"{least}{LEAST_WINDOW}")
    return text


Logs = Annotated[
    list[Path],
    typer.Argument(
        help="MCAP logs, recorders' files, all else that `convert` takes, or folders of them."
    ),
]
StoreOption = Annotated[Path, typer.Option("--store", help="Folder of ingested voyages.")]
ProfileOption = Annotated[
    str | None,
    typer.Option(
        "--profile",
        help="A shipped profile's name, or a TOML's path; unless given, the shipped one that the "
        "log's topics fit.",
        autocompletion=completion.profiles,
    ),
]
JsonOption = Annotated[
    str | None,
    typer.Option(
        "--json",
        metavar="PATH|-",
        help="Write the answer as JSON into this file; - is stdout.",
        callback=_ask_json,
    ),
]
ReportOption = Annotated[
    Path | None,
    typer.Option("--report", metavar="FILE", help="Also write one page with pictures: FILE.html."),
]
CHOSEN = "Names or shell patterns, several times; unless given,"
Voyages = Annotated[
    list[str] | None,
    typer.Option("--voyages", help=f"{CHOSEN} all.", autocompletion=completion.voyages),
]
TrainingVoyages = Annotated[
    list[str] | None,
    typer.Option(
        "--voyages",
        help=f"{CHOSEN} all of the store. A network's are split; physics are identified from all "
        "that are given.",
        autocompletion=completion.voyages,
    ),
]
TestVoyages = Annotated[
    list[str] | None,
    typer.Option(
        "--voyages",
        help=f"{CHOSEN} the run's test voyages, else all that it was not fitted to.",
        autocompletion=completion.voyages,
    ),
]
TrialVoyages = Annotated[
    list[str] | None,
    typer.Option(
        "--voyages",
        help=f"{CHOSEN} all that the run was not trained on.",
        autocompletion=completion.voyages,
    ),
]
Causes = Annotated[
    list[Path] | None,
    typer.Option("--cause", help="A Python file with causes of your own; several times."),
]
Simulators = Annotated[
    list[str] | None,
    typer.Option(
        "--simulator",
        metavar="PATH",
        help="The file of a simulator of your own, for a run of it: the run keeps no code. "
        "Several times.",
    ),
]
Seeds = Annotated[int, typer.Option(min=1, help="Number of seeds; they are numbered from 0.")]
Window = Annotated[int, typer.Option(min=LEAST_WINDOW, help="Length of a window in seconds.")]
AutoWindow = Annotated[
    str,
    typer.Option(
        "--window",
        metavar="SECONDS|auto",
        parser=_window,
        help="Length of a window in seconds; auto follows the ship, its length over its speed.",
    ),
]
Width = Annotated[int, typer.Option(min=1, help="Units of each hidden layer.")]
Epochs = Annotated[
    int | None, typer.Option(min=1, help="Cap the epochs (paper) or iterations (fast).")
]
Device = Annotated[
    str,
    typer.Option(
        help="cpu, or cuda: the paper's recipe on an NVIDIA GPU, all seeds at once.",
        autocompletion=completion.of_words(("cpu", "cuda")),
    ),
]
Validation = Annotated[
    list[str] | None,
    typer.Option(
        help="Voyages to validate on: names or shell patterns, several times.",
        autocompletion=completion.voyages,
    ),
]
STORE = Path("store")
