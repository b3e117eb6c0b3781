"""Verification of the files that tbcad wrote, with code that shares nothing with tbcad."""

from __future__ import annotations

from tbcad_verify.cli import main
from tbcad_verify.errors import BadExport
from tbcad_verify.report.report import Report
from tbcad_verify.run.verify import verify

__all__ = ["BadExport", "Report", "main", "verify"]
