"""Slow, plain second implementations that the tests compare plantune with.

Nothing here imports plantune.  Each module takes another way than the core:
`lsq` holds the whole regressor, `fopdt` adds up step responses, `loop` expands the
closed loop in Taylor series from one delay to the next, `resid` sums products,
`pem` differentiates scipy's filters and leaves the search to MINPACK.

For tuning and simulation: `rational` multiplies polynomials and takes their roots,
`delayed` counts roots that cross the axis as the delay grows, `peaks` finds Ms, Mt and
margins as roots in mpmath, `imc` holds the formulas of source 001, 3.6, `sampled_loop`
walks a sampled PID through every sample, `relay` goes from switch to switch in closed
form, `shaping` solves for one point of the frequency response and states rules,
`optimum` searches the best PI on a grid.

For step responses: `idt` holds the inverse digital transform of source 003 and its criterion,
`step_starts` poles and areas at once, `step_modes` sums of exponentials by variable projection
with numerical slopes, `step_process` a lag and a delay from rest at any time stamps.

For seeing the data: `noise`, `spectrum`, `frequency` add up every term of their sums, `impulse`
works on the whole covariance of y, `delay_ways` scans, `subspace` and `pbsid` project explicitly,
`excitation` makes test signals, `experiment_design` predicts deviations, `compression`,
`offset_steps`, `informative` and `irregular` look at what plant records do to a fit.
"""
