"""Luminance from rays: the cone estimator, filters, comparison."""
