"""What all tests share: how hard hypothesis looks, and random numbers that do not depend on other tests."""

from __future__ import annotations

import os
import zlib

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

# Kernels load on first use, so that one slow example means nothing; a law is searched in fifty examples unless it asks
# for more.
_COMMON = {"deadline": None, "max_examples": 50, "suppress_health_check": [HealthCheck.too_slow]}
settings.register_profile("local", **_COMMON)
settings.register_profile("ci", **_COMMON, derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "local")


@pytest.fixture(autouse=True)
def same_random_numbers(request: pytest.FixtureRequest) -> None:
    """A module's generators start anew for each test, lest its numbers depend on what else ran in its process, and in what order."""
    for name, value in vars(getattr(request.node, "module", None) or object).items():
        if isinstance(value, np.random.Generator):
            seed = zlib.crc32(f"{request.node.nodeid} {name}".encode())
            value.bit_generator.state = type(value.bit_generator)(seed).state
