"""All mutations there are."""

from __future__ import annotations

from tests.verify.corpus.broken_3mfs import THREEMFS
from tests.verify.corpus.broken_files import FILES, HEAVY
from tests.verify.corpus.broken_meshes import MESHES
from tests.verify.corpus.broken_records import RECORDS
from tests.verify.corpus.broken_steps import STEPS
from tests.verify.corpus.mutation import Mutation

BROKEN: tuple[Mutation, ...] = (*MESHES, *THREEMFS, *STEPS, *RECORDS, *FILES)
ALL: tuple[Mutation, ...] = (*BROKEN, *HEAVY)
