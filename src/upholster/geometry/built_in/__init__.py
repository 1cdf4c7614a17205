"""Surfaces by name or from files of control nets.

- `catalog`: built-in surfaces by name; `parameter_checks`: their parameters
- `plane`, `sphere`, `cyclide`, `revolution`, `circle`: the builders
- `surface_files`: control nets from files
"""
