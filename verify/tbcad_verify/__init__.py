"""Verification of the files that tbcad wrote, with code that shares nothing with tbcad.

Loading this module is quick; each name is loaded when it is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tbcad_verify.cli import main
    from tbcad_verify.errors import BadExport
    from tbcad_verify.report.report import Report
    from tbcad_verify.run.verify import verify

__all__ = ["BadExport", "Report", "main", "verify"]

_MODULES = {
    "BadExport": "tbcad_verify.errors",
    "Report": "tbcad_verify.report.report",
    "main": "tbcad_verify.cli",
    "verify": "tbcad_verify.run.verify",
}


def __getattr__(name: str) -> object:
    """Load a public name when it is first used (PEP 562)."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_MODULES[name]), name)
    globals()[name] = value
    return value
