"""Surfaces made of rational Bézier patches."""
