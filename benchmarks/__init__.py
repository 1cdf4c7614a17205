"""Benchmarks: ``python -m benchmarks`` runs them all, prints tables and writes ``benchmarks/results.csv``."""
