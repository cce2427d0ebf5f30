"""The command line: each verb parses, calls one function of the package, and prints."""

from etendue.cli.app import main

__all__ = ["main"]
