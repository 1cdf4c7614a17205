"""Small surfaces here are cut into several parcels, as large ones are elsewhere."""

from collections.abc import Iterator

import pytest

from upholster.synthesis.quilt import parcels


@pytest.fixture(scope="module", autouse=True)
def small_parcels() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(parcels, "MOST_WHOLE", 1000)
        patch.setattr(parcels, "SIDE", 100)
        patch.setattr(parcels, "BLOCKS", 4)
        yield
