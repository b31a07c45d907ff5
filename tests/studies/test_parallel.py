"""Tasks in this process, or in others."""

from mocap_skel.studies.parallel import in_parallel


def test_one_worker_is_this_process_and_works_when_asked():
    done = []
    work = in_parallel(done.append, [1, 2, 3], 1)
    assert done == []
    next(work)
    assert done == [1]
    assert list(in_parallel(str, [3, 1, 2], 1)) == ["3", "1", "2"]
    assert list(in_parallel(str, [], None)) == []
