"""Measures at fewer places, where a test asks whether they are right and not how sure."""

from collections.abc import Iterator

import pytest

from upholster.covering.measure import places


@pytest.fixture(scope="module")
def few_samples() -> Iterator[None]:
    """Size and direction are measured at an eighth of the places."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(places, "MOST_SAMPLES", places.MOST_SAMPLES // 8)
        yield
