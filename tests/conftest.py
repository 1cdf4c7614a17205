"""Settings for all tests."""

from hypothesis import settings

# The first example of a test may compile kernels: how long it takes says nothing. The same examples each time
# make the test command's answer depend on the code alone; `--hypothesis-profile random` looks further.
settings.register_profile("same", deadline=None, derandomize=True)
settings.register_profile("random", deadline=None)
settings.load_profile("same")
