"""Estimators that learn one sample at a time, on line or over a record."""

from plantune._core import RLS, Bank

__all__ = ["RLS", "Bank"]
