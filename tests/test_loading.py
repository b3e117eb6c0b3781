import gc

import pytest

from tbcad.loading import large_libraries
from tbcad.own_process import own_process


def test_no_garbage_is_looked_for_while_libraries_are_loaded() -> None:
    before = gc.get_freeze_count()
    with own_process(), large_libraries():
        assert not gc.isenabled()
        kept = [[k] for k in range(1000)]
    assert gc.isenabled()
    assert gc.get_freeze_count() >= before + len(kept)


def test_a_library_that_is_missing_changes_nothing_else() -> None:
    with pytest.raises(ModuleNotFoundError), own_process(), large_libraries():
        import no_such_library  # type: ignore[import-not-found] # noqa: F401
    assert gc.isenabled()


def test_who_wants_no_search_has_none_afterwards() -> None:
    gc.disable()
    try:
        with own_process(), large_libraries():
            pass
        assert not gc.isenabled()
    finally:
        gc.enable()


def test_a_guest_leaves_the_collector_alone() -> None:
    before = gc.get_freeze_count()
    with large_libraries():
        assert gc.isenabled()
    assert gc.get_freeze_count() == before
