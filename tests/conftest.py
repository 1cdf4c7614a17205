"""Settings for all tests."""

from hypothesis import settings

# The first example of a test may compile kernels: how long it takes says nothing.
settings.register_profile("upholster", deadline=None)
settings.load_profile("upholster")
