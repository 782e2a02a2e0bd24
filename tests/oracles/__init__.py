"""Slow, plain second implementations that the tests compare plantune with.

Nothing here imports plantune.  Each module takes another way than the core:
`lsq` holds the whole regressor, `fopdt` adds up step responses, `loop` expands the
closed loop in Taylor series from one delay to the next, `resid` sums products,
`pem` differentiates scipy's filters and leaves the search to MINPACK.
"""
