"""How code runs: kernels, threads, and results that are kept.

- `jit`: decorators of kernels; `inlined_code`: no machine code for functions that are only inlined; `kernel_cache`: machine code on disk; `signatures`: their types as JSON
- `warm`: compiling kernels ahead of time, from the table ``kernels.json``
- `parallel`: threads, progress and cancelling
- `stages`: results kept by their arguments; `disk_cache`: results on disk; `ownership`: whose files these are
"""
