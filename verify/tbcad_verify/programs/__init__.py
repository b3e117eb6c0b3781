"""Programs that users open the files of a build with, and what they report about a build.

The verification does not need them. Where they are installed, they are a second opinion from code
that neither tbcad nor the verification shares. Each runs as a child process with a time limit, on
a copy of one file in a private folder. None of them sees the build itself.
"""

from __future__ import annotations

from tbcad_verify.programs.program_query import ExpectedPart, is_skipped
from tbcad_verify.programs.programs import check_with_programs

__all__ = ["ExpectedPart", "check_with_programs", "is_skipped"]
