"""A command as a user types it, in this process."""

from typer.testing import CliRunner

from shiplog.cli import app
from shiplog.exceptions import ShiplogError


def call(*arguments):
    """Exit code, stdout and stderr, with a ShiplogError handled as `main` does."""
    result = CliRunner().invoke(app.app, [str(a) for a in arguments])
    if isinstance(result.exception, ShiplogError):
        return result.exception.exit_code, result.stdout, str(result.exception)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.stdout, result.stderr
