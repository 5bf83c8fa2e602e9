"""What the tests of this room share."""

from __future__ import annotations

import pytest
from support.parts.meshes import from_manifold
from support.parts.simple_parts import three_boxes

from slicing.decomposition.decompose import decompose


@pytest.fixture(scope="module")
def boxes():
    return from_manifold(three_boxes(), "boxes")


@pytest.fixture(scope="module")
def plain(boxes):
    return decompose(boxes)
