"""Every example in a docstring runs and prints what it says; public names that a user meets first have one."""

import doctest
import importlib
import pkgutil

import pytest

import frep

PACKAGES = ("frep", "topologies", "graded", "conformal")
MODULES = sorted(
    name
    for package in PACKAGES
    for name in (
        package,
        *(m.name for m in pkgutil.walk_packages(importlib.import_module(package).__path__, f"{package}.")),
    )
    if not name.rsplit(".", 1)[-1].startswith("_")
)


@pytest.mark.parametrize("name", MODULES)
def test_examples(name):
    module = importlib.import_module(name)
    failed, _ = doctest.testmod(module, optionflags=doctest.NORMALIZE_WHITESPACE)
    assert failed == 0


@pytest.mark.parametrize("name", frep.__all__)
def test_public_names_are_documented(name):
    assert getattr(frep, name).__doc__


@pytest.mark.parametrize("name", ["Field", "Solid", "box", "sphere", "union", "coordinates", "foreign"])
def test_first_names_have_an_example(name):
    assert ">>>" in getattr(frep, name).__doc__
