"""The program `etendue`, and what happens when one of its verbs fails."""

from __future__ import annotations

import sys
import warnings
from typing import Annotated, cast

import typer

from etendue.cli.stopping import Stop, stoppable
from etendue.cli.terminal import (
    INTERRUPTED,
    MISTAKE,
    complain,
    complain_of,
    complain_of_mistake,
    complain_of_usage,
    spell_out_unknown_letters,
)
from etendue.cli.verbs import VerbGroup, add_verbs
from etendue.errors import EtendueError, SceneWarning
from etendue.formats.input import WaitingWarning
from etendue.quantities.provenance import version
from etendue.quantities.report import ChangedFileWarning

app = typer.Typer(
    cls=VerbGroup,
    help="Luminance maps of light sources and luminaires from ray files, with an error bar in every pixel.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
add_verbs(app)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"etendue {version()}")
        raise typer.Exit


@app.callback()
def _common(
    _version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    pass


def _show_warning(message: Warning | str, *_where: object, **_more: object) -> None:
    complain(f"warning: {message}")


def main() -> None:
    """Run the program; the exit status is 0, 1 for an error of the data, 2 for one of usage.

    It is 70 for a mistake of the program itself, whose traceback is shown.
    After Ctrl-C it is 130, after SIGTERM 143, after SIGHUP 129; all three end it in the same clean way.
    """
    # Complaints about files are printed by the verbs, once and in full.
    warnings.simplefilter("ignore")
    # What is wrong with a scene is worth knowing before hours of tracing.
    warnings.simplefilter("default", SceneWarning)
    # So is what nobody can see from the answer: that a file changed meanwhile, or that nothing happens.
    warnings.simplefilter("default", ChangedFileWarning)
    warnings.simplefilter("default", WaitingWarning)
    warnings.showwarning = _show_warning
    spell_out_unknown_letters()
    with stoppable() as stop:
        sys.exit(_status(stop))


def _status(stop: Stop) -> int:
    try:
        status = app(standalone_mode=False)
    except (EtendueError, OSError) as error:
        complain_of(error)
        return 1
    except (KeyboardInterrupt, typer.Abort):
        status = INTERRUPTED
    except Exception as error:  # noqa: BLE001 - what nobody foresaw is shown here, so that no text in it acts on a terminal
        # The parser's own errors know how to show themselves, with the nearest name.
        if not hasattr(error, "show"):
            complain_of_mistake(error)
            return MISTAKE
        complain_of_usage(cast(typer.BadParameter, error))
        return int(getattr(error, "exit_code", 2))
    # The parser returns this status for Ctrl-C as well; a trace has said what it kept.
    if status == INTERRUPTED:
        complain("stopped; no file was left half-written")
        return stop.status
    return status if isinstance(status, int) else 0
