"""Tasks in this process, or in others."""

import os

import pytest

from mocap_skel.studies.parallel import in_parallel


def test_one_worker_is_this_process_and_works_when_asked():
    done = []
    work = in_parallel(done.append, [1, 2, 3], 1)
    assert done == []
    next(work)
    assert done == [1]
    assert list(in_parallel(str, [3, 1, 2], 1)) == ["3", "1", "2"]
    assert list(in_parallel(str, [], None)) == []


def test_a_single_task_starts_no_process():
    here = list(in_parallel(lambda _: os.getpid(), ["a task"], 4))
    assert here == [os.getpid()]


def test_other_processes_use_one_thread_each_and_leave_this_one_as_it_was(monkeypatch):
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "7")
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    before = dict(os.environ)
    asked = ["OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "PATH"]
    assert list(in_parallel(os.getenv, asked, 2)) == ["1", "1", os.environ["PATH"]]
    assert dict(os.environ) == before


def test_what_a_task_raises_comes_at_its_result():
    work = in_parallel(int, ["1", "no number", "3"], 2)
    assert next(work) == 1
    with pytest.raises(ValueError, match="no number"):
        next(work)
