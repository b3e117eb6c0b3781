"""All mutations there are."""

from __future__ import annotations

from corpus.broken_3mfs import THREEMFS
from corpus.broken_files import FILES, HEAVY
from corpus.broken_meshes import MESHES
from corpus.broken_records import RECORDS
from corpus.broken_steps import STEPS
from corpus.mutation import Mutation

BROKEN: tuple[Mutation, ...] = (*MESHES, *THREEMFS, *STEPS, *RECORDS, *FILES)
ALL: tuple[Mutation, ...] = (*BROKEN, *HEAVY)
