"""Of the site: the page of the commands, written from their docstrings while the site is built."""

from __future__ import annotations

import re
import typing

import click
import typer

HERE = "<!-- commands -->"


def on_page_markdown(markdown: str, **_: object) -> str:
    """mkdocs calls it with every page."""
    return markdown.replace(HERE, commands()) if HERE in markdown else markdown


def commands() -> str:
    """A section a command: what it does, how it is called, its arguments and options."""
    from shiplog.cli.app import app

    group = typing.cast(click.Group, typer.main.get_command(app))
    return "\n\n".join(_command(name, one) for name, one in group.commands.items())


def _command(name: str, command: click.Command) -> str:
    text, *examples = (command.help or "").split("Example: ")
    context = click.Context(command, info_name=f"shiplog {name}")
    usage = f"{context.command_path} {' '.join(command.collect_usage_pieces(context))}"
    blocks = [f"## {name}", _escaped(text.strip()), f"    {usage}", _rows(command, context)]
    if examples:
        lines = [re.sub(r"\s+", " ", one).strip() for one in examples]
        blocks.append("\n    ".join(("Example:\n", *lines)))
    return "\n\n".join(blocks)


def _rows(command: click.Command, context: click.Context) -> str:
    lines = ["| argument or option | what it is |", "| --- | --- |"]
    for one in command.get_params(context):
        record = one.get_help_record(context)
        if record is None or one.name == "help":
            continue
        name, what = record
        name = name.replace("|", " or ")  # no bar may stand in code within a table
        lines.append(f"| `{_cell(name)}` | {_escaped(_cell(what))} |")
    return "\n".join(lines)


def _cell(text: str) -> str:
    return re.sub(r"\s+", " ", text).replace("|", "\\|")


def _escaped(text: str) -> str:
    """Nothing in a help text is Markdown."""
    return re.sub(r"([*_<\[])", r"\\\1", text)
