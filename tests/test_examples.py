"""The examples in docstrings run and give what they show; every public name has one."""

import contextlib
import dis
import doctest
import importlib
import inspect
import io
from functools import cache

import numpy as np
import pytest
from recordings import ROOT

import mocap_skel
from mocap_skel import artificial, spherefit

FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
FACES = (mocap_skel, spherefit, artificial)


def with_examples():
    """The modules of the package whose source has an example; none is imported to see that."""
    package = ROOT / "mocap_skel"
    for path in sorted(package.rglob("*.py")):
        if ">>> " in path.read_text(encoding="utf-8"):
            parts = path.relative_to(ROOT).with_suffix("").parts
            yield ".".join(parts).removesuffix(".__init__")


@pytest.mark.parametrize("name", [*with_examples()])
def test_the_examples_of_a_module_give_what_they_show(name, monkeypatch):
    """As pasted into Python at the root of the repository."""
    monkeypatch.chdir(ROOT)
    found = doctest.DocTestFinder().find(importlib.import_module(name))
    # numpy's own way to print, whatever another test has set.
    plain = {"precision": 8, "threshold": 1000, "linewidth": 75, "suppress": False}
    with np.printoptions(**plain):
        for each in (test for test in found if test.examples):
            told = io.StringIO()
            runner = doctest.DocTestRunner(optionflags=FLAGS)
            with contextlib.redirect_stdout(told):
                failed, tried = runner.run(each, out=told.write, clear_globs=False)
            assert tried and not failed, told.getvalue()


@cache
def public():
    """The functions and classes that the package's faces list, by their names there."""
    every = {
        f"{face.__name__}.{name}": getattr(face, name) for face in FACES for name in face.__all__
    }
    return {
        name: thing
        for name, thing in every.items()
        if inspect.isfunction(thing) or inspect.isclass(thing)
    }


def test_every_public_name_has_an_example():
    without = {name for name, thing in public().items() if ">>> " not in (thing.__doc__ or "")}
    assert not without


# What these call can raise, and does not where they call it: a batch's members without a sphere are NaN, and
# a skeleton that was read holds together; a clip that was read has an axis that points up.
NEVER_RAISE = {
    "mocap_skel.spherefit.marker_noise",
    "mocap_skel.artificial.figure_of",
    "mocap_skel.joint_angles",
    "mocap_skel.angles_table",
    "mocap_skel.joints_table",
}


def may_raise(thing, seen):
    """Whether a function, a class's constructor, or what they call of the package, has a `raise`."""
    if inspect.isclass(thing):
        own = vars(thing)
        thing = own.get("__post_init__", own.get("__init__"))
    thing = inspect.unwrap(thing) if callable(thing) else None
    if (
        not inspect.isfunction(thing)
        or not thing.__module__.startswith("mocap_skel")
        or thing in seen
    ):
        return False
    seen.add(thing)
    codes = [thing.__code__]
    for code in codes:
        codes += [inner for inner in code.co_consts if inspect.iscode(inner)]
    if any(step.opname == "RAISE_VARARGS" for code in codes for step in dis.get_instructions(code)):
        return True
    called = {name for code in codes for name in code.co_names}
    return any(may_raise(thing.__globals__.get(name), seen) for name in called)


def test_what_can_raise_says_so():
    silent = {
        name
        for name, thing in public().items()
        if may_raise(thing, set()) and "Raises:" not in thing.__doc__
    }
    assert silent == NEVER_RAISE
