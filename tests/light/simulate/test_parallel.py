"""Work in threads: the order of results, and what runs before any thread."""

import threading

from tbcad.light.simulate.parallel import first_then_threads, in_threads


def test_results_are_in_the_items_order() -> None:
    items = list(range(40))
    assert in_threads(lambda item: item**2, items) == [item**2 for item in items]
    assert first_then_threads(lambda item: item**2, items) == [item**2 for item in items]
    assert first_then_threads(lambda item: item, []) == []


def test_the_first_item_is_done_alone() -> None:
    done = list[tuple[int, bool]]()

    def work(item: int) -> None:
        done.append((item, threading.current_thread() is threading.main_thread()))

    first_then_threads(work, list(range(20)))
    assert done[0] == (0, True)
    assert not any(on_main for _, on_main in done[1:])
