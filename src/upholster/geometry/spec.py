"""The text form of a built-in surface, written: `surface_from_spec` reads it back exactly."""

__all__ = ["spec_text"]


def spec_text(name: str, **values: float | int | str | tuple[int, int]) -> str:
    """Return ``name:parameter=value,…``; floats are written such that they are read back to the bit."""
    return f"{name}:" + ",".join(f"{key}={_written(value)}" for key, value in values.items())


def _written(value: float | int | str | tuple[int, int]) -> str:
    if isinstance(value, float):
        return repr(float(value))  # NumPy's floats write themselves otherwise
    return f"{value[0]}x{value[1]}" if isinstance(value, tuple) else str(value)
