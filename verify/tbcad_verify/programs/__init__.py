"""The programs users open our files with: what they say about an export.

They are no part of the proof, which needs none of them; where they are installed, they are a
second opinion from code that neither tbcad nor the proof shares. Each runs as a child process,
on a copy of one file, in a private folder, with a time limit. None of them sees the export itself.
"""

from __future__ import annotations

from tbcad_verify.programs.answers import is_skipped
from tbcad_verify.programs.clients import client_checks
from tbcad_verify.programs.program_query import Wanted

__all__ = ["Wanted", "client_checks", "is_skipped"]
