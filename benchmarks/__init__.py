"""Benchmarks: ``python -m benchmarks`` prints tables; with ``--publish`` it writes ``benchmarks/results``."""
