"""Work in threads: the order of results, and what runs before any thread."""

import threading

from tbcad.light.simulate.parallel import first_then_threads


def test_the_first_item_is_done_alone_and_results_are_in_order() -> None:
    done = list[tuple[int, bool]]()

    def work(item: int) -> int:
        done.append((item, threading.current_thread() is threading.main_thread()))
        return item**2

    assert first_then_threads(work, range(20)) == [item**2 for item in range(20)]
    assert first_then_threads(work, []) == []
    assert done[0] == (0, True)
    assert not any(on_main for _, on_main in done[1:])
