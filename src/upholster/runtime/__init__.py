"""How code runs: kernels, threads, and results that are kept.

- `jit`: decorators of kernels; `inlined_code`: functions that are only inlined, without
  machine code of their own; `kernel_cache`: machine code on disk; `signatures`: kernels' types as JSON
- `warm`: compiling kernels ahead of time, from the table ``kernels.json``
- `parallel`: threads, progress and cancelling
- `stages`: results kept by their arguments; `disk_cache`: results on disk; `ownership`: whose files these are
"""
