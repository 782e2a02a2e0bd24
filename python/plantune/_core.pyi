"""The compiled core as the Python side sees it: values in by attribute, arrays and dicts out.

Every function may raise a `PlantuneError`.  Arrays are C-contiguous float64; frequencies are
rad/s, times and `Ts` seconds, `input` counts from 0.  A dict holds the fields of the value that is
built from it; square and stacked arrays come flat, notes as dicts.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypeAlias, TypedDict

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import Unpack

from plantune.adapt.settings import Settings
from plantune.models import (
    PID,
    FrequencyResponse,
    MatrixPolyModel,
    PolyModel,
    ProcessModel,
    StateSpace,
    TermModel,
)
from plantune.models.base import LinearModel
from plantune.models.hysteresis import ChargeLeak, PlayStack, SeriesSlip
from plantune.models.hysteresis.base import HysteresisModel
from plantune.notes import Limits
from plantune.record import Record
from plantune.recursive import Trace
from plantune.simulate import Actuator, Schedule, VaryingPlant
from plantune.tune.optimal import Wish
from plantune.validate import Verdict

__version__: str

Floats: TypeAlias = NDArray[np.float64]
Complexes: TypeAlias = NDArray[np.complex128]
Band: TypeAlias = tuple[Floats, Floats]
Interval: TypeAlias = tuple[float, float]
Fields: TypeAlias = dict[str, Any]
Model: TypeAlias = LinearModel | StateSpace | None  # of a fit; None is refused (U01)
Several: TypeAlias = MatrixPolyModel | StateSpace
Forgetting: TypeAlias = Literal["exponential", "directional", "variable", "kalman"]
Drawn: TypeAlias = tuple[Model, Floats, int, float, float | None]  # `Fit.drawn_from`

# --- records, limits ---------------------------------------------------------------------------

def check_record(rec: Record, limits: Limits) -> str:
    """Refuse a record that is wrong (D codes); return the fingerprint of its numbers."""

def default_limits() -> dict[str, float]:
    """Every threshold by its code."""

# --- signals -----------------------------------------------------------------------------------

def prbs(n: int, hold: int, bits: int, seed: int) -> Floats:
    """`n` rows of -1 and +1 of a maximum-length sequence, each value held for `hold` rows."""

def register_bits(n: int, hold: int) -> int:
    """Fewest bits with which a PRBS of `n` rows does not repeat."""

def gbn(n: int, hold: float, least: int, seed: int) -> Floats:
    """Generalised binary noise of -1 and +1."""

def multisine(
    n: int, period: int, band: tuple[float, float], Ts: float, seed: int | None
) -> Floats:
    """Multisine with a peak of 1; Schroeder's phases without a seed."""

def chirp(n: int, Ts: float, band: tuple[float, float], logarithmic: bool) -> Floats:
    """Sine that sweeps over a band in rad/s."""

def staircase(levels: list[float], hold: int) -> Floats:
    """Levels, each held for some rows."""

def crest_factor(u: Floats) -> float:
    """Peak over root mean square."""

def drive(kind: str, n: int, period: int) -> Floats:
    """`n` rows in [-1, 1] of a "square", "staircase", "trapezoid" or "chirp"."""

def envelope(y: Floats, start: int, end: int, buckets: int) -> NDArray[np.uintp]:
    """Rows of `y[start:end]` worth drawing: least and greatest of each bucket."""

def uniform_step(t: Floats, limits: Limits) -> float:
    """Sample time of ascending stamps; refuses steps that differ (D15)."""

def steps(t: Floats) -> Fields | None:
    """Median, 1 % and 99 % quantile of the steps, how many are gaps, how many do not go on."""

def resample(
    t: Floats, x: Floats, held: Sequence[bool], Ts: float
) -> tuple[Floats, Floats, list[int], NDArray[np.int64]]:
    """Return times, columns (n, m), starts and original rows of `x` (N, m) on the grid of `Ts`."""

def decimate(
    rec: Record, further: Floats, held: Sequence[bool], Ts: float, limits: Limits
) -> Fields:
    """`u y further valid starts rows`, seconds `after` each row, `left_out` segments, `marks`.

    `marks` holds the `count` of outputs that no longer count, what is `left` of an unknown start
    of unit size, and `notes`.
    """

def has_no_level(rec: Record, limits: Limits) -> bool:
    """Whether no column has a level left: the record's own means were removed."""

def remove_means(x: Floats, valid: NDArray[np.bool_]) -> tuple[Floats, list[float]]:
    """`x` (N, n) without the mean of each column over the rows that count, and these means."""

def remove_lines(
    x: Floats, t: Floats, valid: NDArray[np.bool_]
) -> tuple[Floats, list[tuple[float, float, float]]]:
    """`x` (N, n) without each column's line, and level, slope, middle time of each."""

def without_lines(x: Floats, t: Floats, lines: Sequence[tuple[float, float, float]]) -> Floats:
    """`x` (N, n) less one line per column: level, slope, middle time."""

def without_steps(x: Floats, at: Sequence[int], sizes: Sequence[float]) -> Floats:
    """`x` (N,) less steps of these sizes from these rows on."""

def offset_steps(x: Floats) -> Fields:
    """`at sizes sd levels ratio slope` of a signal whose level steps or drifts."""

def without_levels(x: Floats, levels: Sequence[float]) -> Floats:
    """`x` (N, n) less one level per column."""

def smooth(
    rec: Record, r: Floats | None, both: bool, limits: Limits
) -> tuple[Fields, list[tuple[int, int]]]:
    """`u y r valid` smoothed over three rows, y alone unless `both`; the ranges of rows left."""

def prefilter(
    rec: Record, r: Floats | None, design: Butterworth, limits: Limits
) -> tuple[Fields, Fields]:
    """`u y r valid` behind the filter, and its marks, as of `decimate`."""

def stretches(
    rec: Record,
    r: Floats | None,
    T_max: float,
    L_max: float,
    tolerance: float,
    steady: bool,
    limits: Limits,
) -> Fields:
    """Ranges `kept`, those `dropped` and their `dropped_rows`, and the rows `needed`."""

class Butterworth:
    """A Butterworth filter: its design, and the filter of one signal on its way."""

    def __init__(self, band: str, order: int, w: float | Sequence[float], Ts: float) -> None: ...
    def step(self, x: float) -> float:
        """Filter the next sample; the first is taken as a level that has always been there."""

    def run(self, x: Sequence[float] | Floats) -> Floats:
        """Filter samples (N,): `step` in a loop, to the last bit."""

    def freqresp(self, w: Sequence[float] | Floats) -> Complexes:
        """Frequency response at `w` (N,)."""

    def step_response(self, n: int) -> Floats:
        """Response to a unit step at row 0, `n` rows."""

    def forgets(self, share: float) -> int:
        """Rows until what was before row 0 is forgotten to this share.

        That is until `sum over j > k of |h(j)|` is no more than it.
        """

    @property
    def sos(self) -> Floats:
        """`b0 b1 b2 1 a1 a2` of each section."""

    @property
    def prototype(self) -> Complexes:
        """Poles at a cut-off of 1 rad/s."""

    @property
    def prewarped(self) -> float | list[float]:
        """Cut-off in the plane of the bilinear map."""

    @property
    def poles(self) -> Complexes:
        """In z."""

    @property
    def settling(self) -> float:
        """Seconds until the step response stays within 2 % of its own peak from its end."""

# --- models ------------------------------------------------------------------------------------

def simulate(model: Model, u: Floats, Ts: float, x0: float, offset: float) -> Floats:
    """Output (N,) for the input `u` (N, nu), which is zero before row 0."""

def freqresp(model: Model, input: int, w: Floats) -> Complexes:
    """Frequency response with the exact delay."""

def phase_deg(model: Model, input: int, w: Floats) -> Floats:
    """Phase in degrees, unwrapped, the delay counted in full."""

def check_frequency_response(response: FrequencyResponse) -> None:
    """Refuse frequencies that do not ascend or lie beyond `pi/Ts`, points that are no numbers."""

def disc_factor() -> float:
    """Radius of a 95 % disc over the standard deviation of the complex error."""

def frequency_bode(
    response: FrequencyResponse, output: int, input: int, keep: Sequence[bool]
) -> tuple[list[Floats], list[Floats]]:
    """Magnitude, low, high; phase in degrees, low, high; NaN where not kept."""

def frequency_seen(model: Model, input: int, Ts: float | None, w: Floats) -> Complexes:
    """Response of a model as data show it: sampled behind a zero-order hold if `Ts` is given."""

def frequency_fit(
    response: FrequencyResponse,
    output: int,
    input: int,
    structure: str | tuple[int, int, int, bool],
) -> Fields:
    """Fit a process code, or polynomials `nb, nf, nk, delay`."""

def frequency_verdict(response: FrequencyResponse, model: Model) -> Fields:
    """Distance of a model from the points in radii (n, nu), and whether it passes."""

def step_response(model: Model, input: int, t: Floats) -> Floats: ...
def poles(model: Model) -> Complexes:
    """In z for sampled models, in 1/s for process models."""

def zeros(model: Model, input: int) -> Complexes: ...
def pulse_transfer(model: PolyModel, input: int) -> tuple[list[float], list[float]]:
    """Numerator and denominator in descending powers of z, delay included."""

def dc_gain(model: Model) -> list[float]:
    """One per input; infinite for an integrator."""

def resonance(model: Model, input: int) -> tuple[float, float] | None:
    """Frequency in rad/s and damping of the poorly damped poles that ring most."""

def horizon(model: Model) -> float:
    """Seconds until a step response is seen whole."""

def pid_transfer(pid: PID) -> tuple[list[float], list[float]]:
    """Numerator and denominator from the error, descending powers of s, or of z if sampled."""

def gains(pid: PID) -> tuple[float, float]:
    """`Ki, Kd` of a controller."""

def to_form(
    pid: PID, form: str, pv_span: float | None, op_span: float | None, minutes: bool
) -> dict[str, float]:
    """Return settings by their letters; a U01 may have the nearest and its deviation as result."""

def from_form(
    form: str,
    settings: list[float],
    rest: PID,
    pv_span: float | None,
    op_span: float | None,
    minutes: bool,
) -> Fields:
    """Fields of `PID` but `c filter Ts`; `rest` has the weights, filter and sample time."""

def enter(
    pid: PID, profile: object, pv_span: float | None, op_span: float | None, digits: int | None
) -> Fields:
    """`values direct c notes`, and fields of `PID` as `controller` and `unrounded`.

    `profile` has `form gain signed settings`.  A refusal as of `to_form`.
    """

def c2d(model: Model, Ts: float) -> Fields:
    """Fields of `PolyModel`, every polynomial of an input in a list."""

def transfer(model: Model) -> Fields:
    """Fields of `TransferFunction`."""

def d2c(model: PolyModel) -> Fields:
    """Fields of `ProcessModel`."""

# --- models of several outputs -----------------------------------------------------------------

def matrix_simulate(model: Several, u: Floats, Ts: float | None) -> Floats:
    """Return the outputs (N, ny) from rest; a model in continuous time needs a `Ts`."""

def matrix_over_record(
    rec: Record, model: Several, horizon: int | None, offset: list[float], limits: Limits
) -> tuple[list[int], list[Floats]]:
    """Rows, and each output there; `horizon` counts steps ahead, None simulates."""

def matrix_check(
    rec: Record,
    model: Several,
    output: int,
    options: tuple[str, list[float] | None, int],
    limits: Limits,
) -> Fields:
    """As `check`, of one output; the options are `x0, offset, lags`."""

def matrix_freqresp(model: Several, w: list[float]) -> Complexes:
    """Entries of `(w, ny, nu)`, flat."""

def matrix_poles(model: Several) -> Complexes: ...
def matrix_dc_gain(model: Several) -> Floats: ...
def matrix_state_space(model: Several) -> Fields:
    """Fields of `StateSpace`, flat, with its sizes `n ny nu`."""

# --- models by states --------------------------------------------------------------------------

def states_of(model: PolyModel) -> Fields:
    """Fields of `StateSpace`, flat."""

def states_polynomial(model: StateSpace) -> Fields:
    """Fields of `PolyModel`."""

def states_sampled(model: StateSpace, Ts: float) -> Fields: ...
def states_continuous(model: StateSpace) -> Fields: ...
def states_zeros(model: StateSpace, pair: tuple[int, int] | None) -> Complexes:
    """Of the whole square model, or of one output and input."""

def states_simulate(model: StateSpace, u: Floats, x0: list[float]) -> Floats:
    """Return the outputs of flat inputs, flat, from a state on."""

def states_reduced(model: StateSpace, n: int) -> tuple[Fields, Floats, float]:
    """Return the reduced model, the Hankel singular values, the bound of the error."""

def subspace(
    rec: Record, n: int | None, options: Any, limits: Limits
) -> tuple[Fields, list[tuple[int, float, float]]]:
    """Fields of `Fit`; order, loss and criterion of every order tried."""

def subspace_bands(
    rec: Record,
    fitted: tuple[StateSpace, list[float]],
    options: Any,
    draws: tuple[int, int | None, int],
    limits: Limits,
) -> tuple[list[Fields], list[list[float]], int]:
    """Models of drawn records, their offsets, rows in a block; draws are `runs, block, seed`."""

def deviations(rows: Floats) -> Floats:
    """Return the standard deviation of each column."""

def pbsid(
    rec: Record, n: int, blocks: tuple[int, int], terms: tuple[bool, bool], limits: Limits
) -> Fields:
    """Fields of `Fit`; the blocks are `past, future`, the terms `direct, offset`."""

def subspace_frequency(
    w: Floats,
    G: Complexes,
    size: tuple[int, int],
    Ts: float | None,
    n: int | None,
    stable: bool,
) -> Fields:
    """Fields of `FrequencyFit`; `G` flat, of `size = ny, nu`."""

# --- models over records and in loops ----------------------------------------------------------

def over_record(
    rec: Record,
    model: Model,
    horizon: int | None,
    x0: str,
    offset: float | None,
    limits: Limits,
) -> tuple[list[int], Floats, float, list[list[float]]]:
    """Rows, model output there, offset (estimated when None) and initial state of each segment.

    `horizon` counts steps ahead, None simulates; `x0` is "estimate" or "zero".
    """

def closed_loop(
    plant: LinearModel | VaryingPlant,
    pid: PID,
    dt: float,
    r: Floats,
    out: Floats,
    *,
    d: Floats | None = None,
    dy: Floats | None = None,
    noise: Floats | None = None,
    p: Floats | None = None,
    manual: Floats | None = None,
    offset: float = 0.0,
    u0: float = 0.0,
    actuator: Actuator | None = None,
    y_step: float = 0.0,
    anti_windup: str = "clamping",
    Tt: float | None = None,
    settings: list[tuple[int, PID]] = ...,
    schedule: Schedule | None = None,
) -> Fields:
    """Fill the rows `t r y u` of `out` (4, N + 1), every signal held for `dt`.

    Gives the `rows` filled, `indices` and `notes` as dicts; `anti_windup` is "clamping",
    "back_calculation" or "none".
    """

def simulate_varying(plant: VaryingPlant, u: Floats, Ts: float, u0: float) -> Floats:
    """Output of a plant that varies, from rest at `u0`."""

def table(axes: list[list[float]], values: list[float], points: Floats) -> Floats:
    """Values of a table, row-major, at points (N, signals); multilinear, held at the edges."""

def default_horizon(model: LinearModel, pid: PID) -> float:
    """Seconds until a loop of sound settings has settled many times over."""

def load_horizon(model: LinearModel, pid: PID) -> float:
    """As `default_horizon`, and until a load has died out, at most 50 times as long."""

def simulate_relay(
    model: ProcessModel,
    low: float,
    high: float,
    hysteresis: float,
    Ts: float,
    r: float,
    offset: float,
    rest: int,
    noise: Floats,
) -> tuple[Floats, Floats]:
    """Input and measured output (N,) under a relay, which takes over after `rest` rows."""

class LoopSimulator:
    """A first-order plant under a sampled PID, one sample at a time."""

    def __init__(
        self,
        K: float,
        T: float,
        L: float,
        Ts: float,
        pid: PID,
        *,
        offset: float = 0.0,
        u0: float = 0.0,
        longest: float = 0.0,
        actuator: Actuator | None = None,
        y_step: float = 0.0,
        anti_windup: str = "clamping",
        Tt: float | None = None,
    ) -> None: ...
    def step(self, r: float, noise: float = 0.0) -> tuple[float, float]:
        """Go to the next sample: `u` from there on, and the `y` read there."""

    def hold(self, r: float, u: float, noise: float = 0.0) -> tuple[float, float]:
        """Go to the next sample in manual: the output is `u` within its limits."""

    def set(self, pid: PID) -> None:
        """Take other controller settings from the next sample on, without a bump."""

    def set_plant(self, K: float, T: float, L: float, offset: float) -> None:
        """Take other parameters of the plant: they bring it to the next sample."""

    @property
    def pid(self) -> PID:
        """The settings at work."""

    @property
    def plant(self) -> tuple[float, float, float, float]:
        """`K, T, L, offset` now."""

# --- findings and fits -------------------------------------------------------------------------

def experiment(model: Any, wishes: Any, limits: Limits) -> Fields:
    """`t u y trials notes` of a planned experiment."""

def predicted_sd(model: Any, u: Floats, Ts: float, noise_sd: float, ar: list[float]) -> Fields:
    """`y sd relative notes`: what an input will tell of K, T and L."""

def health(rec: Record, limits: Limits) -> Fields:
    """Fields of `Health` but `source`; stretches, spikes and sentinels as tuples."""

def exclude(
    rec: Record, ends: list[tuple[float, float]] | None, guess: bool, stuck: bool, limits: Limits
) -> Fields:
    """`kept` ranges of rows, `log` and `notes` of a record without stuck and saturated rows."""

def compression(
    rec: Record, keep: bool, limits: Limits
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]: ...
def spikes(rec: Record, limits: Limits) -> tuple[list[int], list[int], list[Fields]]:
    """Row of the record and output of each spike (D19), and a note per output."""

def noise(
    rec: Record,
    column: int,
    parts: int | None,
    lags: int | None,
    way: tuple[int | None, float, str],
    limits: Limits,
) -> Fields:
    """Moments, histogram, autocorrelation, spectra and parts of a signal; inputs count first."""

def spectrum(
    rec: Record, column: int, way: tuple[int | None, float, str], limits: Limits
) -> Fields:
    """Welch's density of a signal: rows of a stretch, overlap and window in `way`."""

def response(rec: Record, way: Fields, memory: float | None, limits: Limits) -> Fields:
    """Frequency response (n, ny, nu) flat, discs and coherence; `memory` is T + L in seconds."""

def coherence(rec: Record, way: Fields, memory: float | None, limits: Limits) -> Fields:
    """Coherence of each pair (n, ny, nu) flat, of all inputs together, and bands."""

def excitation(rec: Record, limits: Limits) -> tuple[list[Fields], float | None]:
    """Excitation of each input, and T + L in seconds where a quick model gives it."""

def excitation_orders(rec: Record, most: int, limits: Limits) -> list[int]:
    """Parameters of a linear model that each input supports (X02), up to `most`."""

def input_moves(rec: Record, limits: Limits) -> bool:
    """Whether every input moves (X01)."""

def is_irregular(rec: Record, limits: Limits) -> bool:
    """Whether the stamps within its segments are not uniform."""

def mean_step(t: Floats, starts: Sequence[int]) -> float | None:
    """Mean step between stamps within segments; None where no two follow each other."""

def informative(rec: Record, window: int, input: int, output: int, limits: Limits) -> Fields:
    """Fields of `Informative` but `record`; stretches as dicts, windows as lists and arrays."""

def delay(rec: Record, input: int, nk: tuple[int, ...], limits: Limits) -> Fields:
    """Fields of `DelayScan` but `source`; `nk` is the lowest and the highest delay."""

def xcorr(rec: Record, columns: tuple[int, int], lags: int, limits: Limits) -> Fields:
    """Fields of `Correlation` but `source`; `columns` are the input and the output."""

def delay_evidence(rec: Record, input: int, nk: tuple[int, ...], limits: Limits) -> Fields:
    """Fields of `DelayEvidence` but `source`; its findings are fields in turn."""

def impulse(
    rec: Record,
    output: int,
    options: tuple[int, str | None, bool, int | None, bool],
    limits: Limits,
) -> Fields:
    """Fields of `ImpulseResponse`; `options` are `n, kernel, direct, nk, whiten`.

    A list has one entry per input; `weights` count from `first` on.
    """

def least_squares(phi: Floats, y: Floats) -> Fields:
    """Fields of `Fit` but `method source Ts`; no model."""

def arx(rec: Record, orders: object, offset: bool, robust: bool, limits: Limits) -> Fields:
    """Fields of `Fit` but `method source Ts`; `orders` has `na nb nc nd nf nk`."""

def term_arx(
    rec: Record,
    orders: object,
    regressors: Sequence[tuple[str, int | None]],
    given: Floats,
    offset: bool,
    limits: Limits,
) -> Fields:
    """As `arx`, with one input more for each regressor; the offset is the constant `d`."""

def check_terms(texts: Sequence[str], names: Sequence[str]) -> None:
    """Refuse terms that cannot be read (U01)."""

def term_simulate(model: TermModel, u: Floats, given: Floats, y: Floats) -> Floats:
    """Output of a `TermModel`, from the outputs `y` that are known."""

def term_over_record(
    rec: Record, model: TermModel, given: Floats, horizon: int | None, limits: Limits
) -> tuple[list[int], Floats]:
    """Rows with history, and the output predicted there."""

def term_check(rec: Record, model: TermModel, given: Floats, lags: int, limits: Limits) -> Fields:
    """Fields of `Verdict`, as `check`."""

def forecast(
    rec: Record,
    model: Model,
    u: Floats,
    offset: float,
    P: Floats,
    loss: float,
    N: int,
    parameters: int,
    limits: Limits,
) -> tuple[Floats, Floats]:
    """Output to come and its standard deviation."""

def matrix_arx(
    rec: Record, na: int, nb: int, nk: list[int], offset: bool, limits: Limits
) -> Fields:
    """Fields of `Fit` but `method source Ts`, of several outputs."""

def pem(rec: Record, orders: object, offset: bool, x0: str, robust: bool, limits: Limits) -> Fields:
    """Fields of `Fit` but `method source Ts`; `x0` is "estimate" or "zero"."""

def iv4(rec: Record, orders: object, offset: bool, rounds: int, limits: Limits) -> Fields:
    """Fields of `Fit` but `method source Ts`; `orders` has `na nb nk`, all others zero."""

def order_choice(
    rec: Record,
    candidates: Sequence[object],
    fresh: Record | None,
    offset: bool,
    limits: Limits,
) -> Fields:
    """Fields of `OrderTable` but `source`; `best` and `runner_up` are places among `rows`."""

def process(
    rec: Record,
    codes: list[str],
    noise: str | tuple[int, int],
    offset: bool | str,
    L: Interval | None,
    robust: bool,
    limits: Limits,
) -> Fields:
    """Fields of `Fit` but `method source Ts`; `L` bounds the delay."""

def srivc(
    rec: Record, orders: tuple[int, int], offset: bool, L: Interval | None, limits: Limits
) -> Fields:
    """Fields of `Fit` but `method source Ts`; `orders` are `n, nb`, `L` bounds the delay."""

def derived_quantities(model: Model, P: Floats | None) -> list[tuple[str, float, float]]:
    """Name, value and standard deviation of what follows from the parameters; `P` is flat."""

def roots_with_sd(
    model: Model, P: Floats, zeros_from: int | None
) -> list[tuple[float, float, list[float]]]:
    """Real and imaginary part of the poles, or of the zeros from an input, and their covariance."""

def step_with_sd(model: Model, P: Floats, input: int, t: Floats) -> Band:
    """Return the unit step response and its standard deviation."""

def bode_with_sd(model: Model, P: Floats, input: int, w: Floats) -> tuple[Band, Band]:
    """Magnitude and phase in degrees, each with its standard deviation."""

def scores(
    rec: Record, model: Model, offset: float | None, x0: str, limits: Limits
) -> tuple[Floats, Floats, list[int]]:
    """`psi = -d eps/d(theta, O)` (N, n), `eps` (N) and the rows of the record."""

def sandwich(
    rec: Record, model: Model, offset: float | None, x0: str, limits: Limits
) -> tuple[Floats, Floats, Fields]:
    """Covariance, the standard deviations of `theta`, and a note."""

def bootstrap(
    rec: Record,
    model: Model,
    offset: float | None,
    x0: str,
    runs: int,
    block: int | None,
    seed: int,
    limits: Limits,
) -> Fields:
    """`estimates` (runs, m), `low`, `high`, `block`, and their spread `P`, `sd`."""

def process_sandwich(
    rec: Record, known: object, P: Floats, limits: Limits
) -> tuple[Floats, Floats, Floats, Fields]:
    """Covariance, deviations of `theta`, factors by which all grew, and a note; `P` is flat.

    `known` has `codes plants c d N loss offset` of a process fit.
    """

def process_bootstrap(
    rec: Record, known: object, options: tuple[int, int | None, int], limits: Limits
) -> Fields:
    """Fields as of `bootstrap`; `options` are runs, block, seed."""

def sign_perturbed_sums(
    phi: Floats, y: Floats, sizes: tuple[int, int], seed: int
) -> tuple[Floats, Floats, float]:
    """Estimate, half widths of the ellipsoid around the region, its radius; `sizes` is m, q."""

def sps_contains(
    phi: Floats, y: Floats, thetas: list[list[float]], sizes: tuple[int, int], seed: int
) -> list[bool]:
    """Which of `thetas` are inside the region."""

def sps_arx_box(
    rec: Record,
    model: PolyModel,
    offset: float | None,
    sizes: tuple[int, int],
    seed: int,
    limits: Limits,
) -> tuple[Floats, Floats, Floats]:
    """Estimate with the constant last, and the ends of the region along each entry."""

def sps_arx_contains(
    rec: Record,
    model: Model,
    thetas: list[list[float]],
    sizes: tuple[int, int],
    seed: int,
    limits: Limits,
) -> list[bool]:
    """Which of `thetas` are inside, for the orders of an ARX model."""

def areas(rec: Record, step_at: float | None, limits: Limits) -> tuple[float, float, float]:
    """`K, T, L` from the areas under a step response."""

def idt_criterion(
    rec: Record,
    order: int | None,
    max_order: int,
    step_at: float | None,
    gain: float | None,
    lag: int | None,
    eps: float,
    limits: Limits,
) -> Fields:
    """Fields of `IdtCriterion` but `source`; poles by criterion (15) of source 003."""

def step_modes(
    rec: Record,
    order: int | None,
    max_order: int,
    step_at: float | None,
    gain: float | None,
    limits: Limits,
) -> Fields:
    """Fields of `StepModes` but `source`; without an order the data choose it."""

def normal_interval(x: float, sd: float) -> tuple[float, float]:
    """Return the 95 % interval of a normal law."""

def stretched(interval: tuple[float, float], x: float, factor: float) -> tuple[float, float]:
    """Return an interval around `x` with both ends `factor` times as far."""

def widened(P: Floats, n: int, factor: float) -> tuple[Floats, Floats]:
    """Covariance (flat) and the first `n` standard deviations, `factor` times as wide."""

# --- estimators that learn one sample at a time -------------------------------------------------

class InverseTransform:
    """The inverse digital transform: from samples of a response back to the input."""

    def __init__(
        self,
        poles: Sequence[complex] | Complexes,
        Ts: float,
        gain: float = 1.0,
        lag: int = 1,
        differentiation: bool = False,
    ) -> None: ...
    def step(self, y: float) -> float:
        """Take one sample of `y` and return the input; NaN before the window is full.

        A sample that is refused changes nothing.
        """

    def run(self, y: Sequence[float] | Floats) -> Floats:
        """Take samples (N,) and return the inputs (N,): `step` in a loop, to the last bit."""

    def restart(self) -> None:
        """Forget all samples, as after a gap: NaN until the window is full again."""

    @property
    def order(self) -> int:
        """Number of poles."""

    @property
    def coefficients(self) -> Floats:
        """Of `x(n) = sum d_j y(n - j lag) / gain` (order + 1,)."""

    @property
    def noise_gain(self) -> float:
        """Standard deviation of `x` over that of white noise on `y`."""

class RLS:
    """Recursive least squares for any model linear in its parameters."""

    def __init__(
        self,
        n: int,
        lam: float = 1.0,
        P0: float | Sequence[Sequence[float]] | Floats = 1e6,
        theta0: Sequence[float] | Floats | None = None,
        *,
        forgetting: Forgetting = "exponential",
        lam0: float | None = None,
        rho: float | None = None,
        R1: float | Sequence[float] | Floats | None = None,
        R2: float = 1.0,
        clip: float | None = None,
        P_max: float | None = None,
    ) -> None: ...
    def begin(
        self,
        phi: Sequence[Sequence[float]] | Floats,
        y: Sequence[float] | Floats,
        rows: int | None = None,
    ) -> int:
        """Start from least squares on the first rows; return how many that took."""

    def update(self, phi: Sequence[float] | Floats, y: float) -> float:
        """Learn one sample and return the prior prediction error."""

    def run(self, phi: Sequence[Sequence[float]] | Floats, y: Sequence[float] | Floats) -> Floats:
        """Learn samples (N, n) and (N,): `update` in a loop, to the last bit."""

    @property
    def theta(self) -> Floats:
        """Parameters (n,)."""

    @property
    def sd(self) -> Floats:
        """Their standard deviations (n,)."""

    @property
    def P(self) -> Floats:
        """Their covariance (n, n) in units of the noise variance, exactly symmetric."""

    @property
    def noise_sd(self) -> float:
        """Standard deviation of the noise."""

    @property
    def expected_digits(self) -> Floats:
        """Decimal digits to which each parameter is that of least squares (n,)."""

    @property
    def factors(self) -> tuple[Floats, Floats]:
        """`U` (n, n) and `D` (n,) of `P = U diag(D) U'`."""

    @property
    def D_most(self) -> float:
        """The most that forgetting may make of an entry of `D`."""

    @property
    def n(self) -> int:
        """Number of parameters."""

    @property
    def lam(self) -> float:
        """Forgetting factor."""

    @property
    def lam0(self) -> float:
        """Forgetting factor of the first sample."""

    @property
    def forgetting(self) -> Forgetting:
        """How it forgets."""

    @property
    def clip(self) -> float | None:
        """Standard deviations at which errors are cut."""

class Options(TypedDict, total=False):
    """Keywords of `ARX`, `ARMAX`, `OE` and `BJ`."""

    lam: float
    offset: bool
    P0: float | Sequence[Sequence[float]] | Floats | None
    theta0: Sequence[float] | Floats | None
    Ts: float | None
    forgetting: Forgetting
    lam0: float | None
    rho: float | None
    R1: float | Sequence[float] | Floats | None
    R2: float
    clip: float | None
    alarm: bool
    gate: bool | float | None
    window: int | None
    P_max: float | None

class Recursion:
    """What the recursive estimators of the polynomial family have in common."""

    def step(self, u: float, y: float) -> float:
        """Learn one sample and return the prediction error; NaN while lags are missing."""

    def skip(self, u: float) -> None:
        """Go on without an output."""

    def restart(self) -> None:
        """Forget all signals, as after a gap."""

    def run(self, rec: Record, every: int = 1) -> Trace:
        """Learn a record: `step` in a loop, to the last bit."""

    @property
    def names(self) -> list[str]:
        """Names of the coefficients."""

    @property
    def theta(self) -> Floats:
        """Coefficients."""

    @property
    def sd(self) -> Floats:
        """Their standard deviations."""

    @property
    def P(self) -> Floats:
        """Their covariance, and the constant's, in units of the noise variance."""

    @property
    def offset(self) -> float:
        """`O` in `y = G u + O`."""

    @property
    def offset_sd(self) -> float:
        """Its standard deviation."""

    @property
    def noise_sd(self) -> float:
        """Standard deviation of the noise."""

    @property
    def alarms(self) -> int:
        """Steps of the offset seen so far."""

    @property
    def samples(self) -> int:
        """Samples taken in so far."""

    @property
    def learnt(self) -> bool:
        """Whether the last sample was learnt."""

    @property
    def lam(self) -> float:
        """Forgetting factor of the next sample."""

    @property
    def Ts(self) -> float | None:
        """Sample time, seconds."""

    @property
    def model(self) -> PolyModel:
        """The model at this moment."""

class ARX(Recursion):
    """Recursive ARX."""

    def __init__(self, na: int, nb: int, nk: int = 1, **options: Unpack[Options]) -> None: ...

class TermARX:
    """Recursive ARX with regressors of one's own."""

    def __init__(
        self,
        na: int,
        nb: int,
        nk: int = 1,
        *,
        regressors: Sequence[str],
        lam: float = 1.0,
        offset: bool = True,
        P0: ArrayLike | None = None,
        forgetting: str = "exponential",
        lam0: float | None = None,
        rho: float | None = None,
        clip: float | None = None,
    ) -> None: ...
    def step(self, u: float, y: float) -> float:
        """Learn one sample and return its prediction error, NaN where there is none."""
    def skip(self, u: float) -> None:
        """Go on without an output."""
    def restart(self) -> None:
        """Forget all signals, as after a gap."""
    def run(self, rec: Record) -> Floats:
        """Learn a record and return its prediction errors: `step` in a loop."""
    @property
    def names(self) -> list[str]: ...
    @property
    def theta(self) -> Floats: ...
    @property
    def sd(self) -> Floats: ...
    @property
    def offset(self) -> float: ...
    @property
    def noise_sd(self) -> float: ...
    @property
    def samples(self) -> int: ...

class ARMAX(Recursion):
    """Recursive ARMAX."""

    def __init__(
        self,
        na: int,
        nb: int,
        nc: int,
        nk: int = 1,
        *,
        method: Literal["rml", "els"] = "rml",
        **options: Unpack[Options],
    ) -> None: ...

class OE(Recursion):
    """Recursive output-error model."""

    def __init__(self, nb: int, nf: int, nk: int = 1, **options: Unpack[Options]) -> None: ...

class BJ(Recursion):
    """Recursive Box-Jenkins model."""

    def __init__(
        self, nb: int, nc: int, nd: int, nf: int, nk: int = 1, **options: Unpack[Options]
    ) -> None: ...

class Bank:
    """First-order ARMAX with offset, for each of many loops at each of several delays."""

    def __init__(
        self,
        loops: int,
        nk: tuple[int, int],
        lam: float = 0.995,
        lam0: float = 0.95,
        rho: float = 0.99,
        P0: float | Sequence[float] | Floats = 1e6,
        method: str = "rml",
        errors: bool = True,
        clip: float | None = None,
        swell: float = 1e3,
        c_most: float = 0.97,
        memory: float = 200.0,
    ) -> None: ...
    def step(self, u: Sequence[float] | Floats, y: Sequence[float] | Floats) -> None:
        """Learn one sample (loops,) of every loop."""

    def run(self, u: Floats, y: Floats, errors: bool = False) -> tuple[Floats, Floats] | None:
        """Learn samples (N, loops): `step` in a loop; if asked, return `eps` and `q` of each."""

    def scale(self, index: int, u_factor: float, y_factor: float) -> None:
        """Count the signals of a loop in other units, and start it anew."""

    def gate(self, index: int, open: bool) -> None:
        """Open or close the gate of a loop."""

    def open_offset(self, index: int, variance: float = 1000.0) -> None:
        """Add to the variance of the offset of a loop."""

    def reset(self, index: int) -> None:
        """Forget all of a loop."""

    @property
    def nk(self) -> NDArray[np.int64]:
        """Candidate delays (candidates,)."""

    @property
    def theta(self) -> Floats:
        """Parameters a, b, d, c (loops, candidates, 4)."""

    @property
    def P(self) -> Floats:
        """Their covariance (loops, candidates, 4, 4) in units of the noise variance."""

    @property
    def sd(self) -> Floats:
        """Their standard deviations (loops, candidates, 4)."""

    @property
    def eps(self) -> Floats:
        """Error of the last sample before it was learnt (loops, candidates)."""

    @property
    def q(self) -> Floats:
        """`psi' P psi` of the last sample (loops, candidates)."""

    @property
    def s2(self) -> Floats:
        """Robust variance of the noise (loops, candidates)."""

    @property
    def learnt(self) -> NDArray[np.bool_]:
        """Whether the last sample was learnt (loops,)."""

    @property
    def restarts(self) -> NDArray[np.uint32]:
        """How often a loop started anew (loops,)."""

    @property
    def origin(self) -> Floats:
        """First u and y of each loop (loops, 2)."""

    @property
    def loops(self) -> int:
        """Number of loops."""

# --- judgement ---------------------------------------------------------------------------------

def check(
    rec: Record,
    model: Model,
    options: tuple[str, float | None, int, int | None],
    limits: Limits,
) -> Fields:
    """Fields of `Verdict` that are computed; an X04 carries them in `.result`.

    `options` are `x0, offset, lags, fitted`; the last is the number of rows that the model was
    fitted on, where there was a fit.
    """

def plausible(
    model: Model, P: Floats | None, inputs: Sequence[str], limits: Limits
) -> list[Fields]:
    """Return notes on poles and zeros; `P` is flat, `inputs` are names of several inputs."""

def expected(
    all: Sequence[tuple[str, float, float, float]], columns: bool, limits: Limits
) -> list[Fields]:
    """Return N03 of each `(name, found, low, high)` that lies far outside of its range."""

def noisy_regressors(rec: Record, model: Model, P: Floats, limits: Limits) -> list[Fields]:
    """Return V08 where an ARX model shows errors in variables on a record; `P` is flat."""

def p_of_feedback(rec: Record, direct: bool, limits: Limits) -> list[float]:
    """Chance that an open loop looks as closed as this, per input."""

def time_varying(rec: Record, nk: Sequence[int], order: int, limits: Limits) -> Fields | None:
    """Fields of `TimeVarying` that are computed; None where the rows do not tell."""

def judge(
    process: Verdict,
    delay: tuple[float, float, float],
    rival: tuple[str, Verdict, int] | None,
    feedback: tuple[tuple[Model, Floats], tuple[Model, Floats]] | None,
    limits: Limits,
) -> tuple[float, list[Fields]]:
    """Factor for the deviations of the process model, and notes.

    `delay` is `L`, its sd, `Ts`; `rival` the polynomial model's name, verdict and `nk`; `feedback`,
    in closed loop, the two models and their flat covariances on the same rows.
    """

# --- tuning ------------------------------------------------------------------------------------

def check_tunable(K: Interval, T: Interval | None, Ts: float | None, limits: Limits) -> None:
    """Refuse a fit with an open sign (X12) or sampled too slowly (M09); slowest `T`."""

def check_action(action: str, K: float) -> None:
    """Refuse a process gain of the sign that a declared action does not serve (X12)."""

def half_rule(model: Model, order: int, tau_c: float | None) -> Fields:
    """Fields of the `ProcessModel` of first or second order."""

def controllability_ratio(model: Model) -> float:
    """`L / (T + L)`."""

def precontrol(model: Model, r: float, load: float, ramp: float) -> float:
    """Input that holds the set point."""

def imc(model: Model, tau_c: float, order: int | None, delay: str, mirror: bool) -> Fields:
    """Fields of `IMC` that are computed, each transfer function as its fields."""

def imc_classic(controller: Model, model: Model, w: Floats) -> Complexes:
    """`C / (1 - C G)` at `w`."""

def tracking_cost(nominal: Floats, y: Floats, Ts: float, T_J: float) -> float:
    """`Ts` times the sum of squares of `nominal - y` from row 1 to `T_J / Ts`."""

def imc_costs(L: float, tau_c: float, loop_: str) -> tuple[float, float, float]:
    """`ise, iae, itae`; the loop is "pi" or "ideal"."""

def imc_pi(model: Model, wish: str, value: float) -> Fields:
    """`Kp Ti Td Tf tau_c plant reduced`: what the rule was computed on, and whether that is less.

    The wish is "gain_margin", "phase_margin" or "tau_c".
    """

def imc_pid(model: Model, wish: str, value: float, N: float | None) -> Fields:
    """As `imc_pi`; `Tf = Td / N`, None for no filter."""

def simc(model: Model, tau_c: float | None, controller: str) -> Fields:
    """As `imc_pi`; the controller is "PI" or "PID"; without `tau_c` it is the dead time."""

def ziegler_nichols(model: Model, controller: str) -> Fields:
    """As `imc_pi`, `tau_c` NaN."""

def refined_ziegler_nichols(model: Model) -> Fields:
    """As `imc_pi`, `tau_c` NaN."""

def simc_plus(model: Model, tau_c: float | None, controller: str) -> Fields:
    """As `simc`; without `tau_c` it is L, and L / 2 with a derivative."""

def amigo(model: Model, controller: str) -> Fields:
    """As `ziegler_nichols`."""

def lambda_(model: Model, tau_c: float | None, controller: str) -> Fields:
    """As `simc`; without `tau_c` it is 3 T, of an integrating plant 3 L."""

def cohen_coon(model: Model, controller: str) -> Fields:
    """As `ziegler_nichols`."""

def chien_hrones_reswick(model: Model, step: str, overshoot: float, controller: str) -> Fields:
    """As `ziegler_nichols`; the step is "load" or "set_point", the overshoot 0 or 20."""

def tyreus_luyben(model: Model, controller: str) -> Fields:
    """As `ziegler_nichols`."""

def relay(rec: Record, rest: Interval | None, limits: Limits) -> Fields:
    """Fields of `RelayTest` but `t u y source Ts`, and first and last of `rows`.

    `rest` is an equilibrium `u0, y0`.
    """

def margins(model: Model, pid: PID) -> Fields:
    """Fields of `Margins`."""

def margin_bands(fits: Sequence[Drawn], pid: PID) -> list[Interval]:
    """95 % intervals of `gain phase_deg delay Ms Mt` over the models that the fits leave open."""

def loop_shape(
    model: Model, w_c: float, phase_margin: float, controller: str, Ts: float | None
) -> Fields:
    """Fields of `PID`."""

def optimal(model: Model, wish: Wish) -> tuple[Fields, float]:
    """Fields of `PID`, and what it costs."""

def optimal_over(
    fits: Sequence[Drawn], wish: Wish, dear: float
) -> tuple[Fields, float, float, float | None]:
    """Fields of `PID` over the fits, its cost, the share of the integral gain kept, and seconds.

    The share is of the gain on the best model alone; so much more record would leave `dear` of it.
    """

def robustness(
    model: Model, pid: PID, changes: Sequence[float], fits: Sequence[Drawn], count: int
) -> tuple[list[Interval], list[Interval]]:
    """Stable gain factors at each change of the dead time; gain and delay of each drawn model."""

def cloud(fits: Sequence[Drawn], count: int) -> list[Fields]:
    """Return fields of models, the most probable first, then `count` draws."""

def sensitivities(model: Model, pid: PID, w: Floats, delay: str) -> list[Complexes]:
    """`L, S, T, CS`; the delay is "exact", "pade" or "taylor", here and below."""

def stability(model: Model, pid: PID, delay: str) -> tuple[bool, list[Interval]]:
    """Whether the loop is stable, and the stable intervals of `Kp, Ki, Ti, Kd`."""

def loop_transfers(model: Model, pid: PID, delay: str) -> list[Fields]:
    """Fields of `TransferFunction` of `y_r u_r e_r y_p y_d u_d`."""

def step_band(model: Model, P: Floats, input: int, t: Floats) -> Band:
    """Lower and upper curve of the 95 % band of the step response."""

def bode_band(model: Model, P: Floats, input: int, w: Floats) -> tuple[Band, Band]:
    """95 % bands of the magnitude and of the phase in degrees."""

# --- adapt -------------------------------------------------------------------------------------

class AutoTuner:
    """The auto-tuner of one loop; `plantune.adapt.AutoTuner` makes its decisions values."""

    def __init__(self, settings: Settings) -> None: ...
    def step(
        self,
        t: float,
        r: float,
        u: float,
        y: float,
        aux: Sequence[float],
        controller: Any = None,
    ) -> Fields:
        """Take a sample, NaN where a signal is missing; fields of `Decision`."""

    def tables(self) -> tuple[list[list[float]], list[float], list[float]] | None:
        """Axes, flat values of the tables of Kp and of Ki; None without a gain schedule."""

    def copy(self) -> AutoTuner:
        """Return another tuner that has seen the same."""

    def gap(self) -> None:
        """Say that the next sample does not follow the last one."""

    def run(
        self,
        t: Floats,
        r: Floats,
        u: Floats,
        y: Floats,
        aux: Floats,
        starts: Sequence[int],
    ) -> Fields:
        """`step` for each row, with a gap before every row of `starts` but the first."""

# --- hysteresis --------------------------------------------------------------------------------

def hysteresis_check(model: HysteresisModel) -> None:
    """Refuse parameters that are none (U01)."""

def hysteresis_simulate(model: HysteresisModel, x: Floats) -> Floats:
    """Output (N,) from the virgin state."""

def hysteresis_against(
    model: HysteresisModel, x: Floats, y: Floats
) -> tuple[Floats, Floats, float]:
    """Output (N,), its error in percent of the range of `y` (N,), and the rms of that."""

def hysteresis_inverse(model: HysteresisModel) -> Fields:
    """Fields of the model whose output is this one's input."""

def preisach_everett(mu: Floats) -> Floats:
    """Everett table (n + 1, n + 1) of weights (n, n)."""

def preisach_mu(everett: Floats) -> Floats:
    """Weights (n, n) of an Everett table (n + 1, n + 1)."""

def preisach_identify(
    x: Floats,
    y: Floats,
    levels: Floats | None,
    counts: Sequence[int],
    ridge: float,
    smooth: float,
    start: str,
    offset: bool,
) -> tuple[Fields, Fields]:
    """Fields of `Preisach` with `mu` flat, and of `Identified`."""

def hysteresis_forc(x: Floats, y: Floats) -> Fields:
    """Fields of `Forc`, tables flat, curves as rows from and to."""

def creep_identify(
    x: Floats,
    y: Floats,
    Ts: float,
    n: int,
    r: Floats | None,
    tau: Floats | None,
    offset: bool,
) -> tuple[Fields, Fields]:
    """Fields of `Creep` with `c` flat, and of `Identified`."""

def leak_current(model: ChargeLeak, V: float) -> float:
    """Return the current through the leak at a voltage."""

def leak_resistance(model: ChargeLeak, i: float) -> float:
    """Return the leak resistance at a leak current."""

def hysteresis_track(
    plant: HysteresisModel,
    r: Floats,
    one_pass: int,
    Ts: float,
    noise: Floats,
    limits: tuple[float, float],
    dynamics: Model | None = None,
    inverse: HysteresisModel | None = None,
    pid: PID | None = None,
    cmac: Cmac | None = None,
) -> Fields:
    """Fields of `Tracking`, but for `t` and `r`."""

class Cmac:
    """A function of one signal, learnt while it is used."""

    def __init__(
        self,
        range: tuple[float, float],
        cells: int = 25,
        layers: int = 8,
        beta: float = 0.3,
        dead_zone: float = 0.0,
    ) -> None: ...
    def recall(self, s: float) -> float:
        """Return what was learnt for the signal `s`."""

    def learn(self, target: float) -> None:
        """Learn what should have come out of the last `recall`."""

    @property
    def range(self) -> tuple[float, float]: ...
    @property
    def cells(self) -> int: ...
    @property
    def layers(self) -> int: ...
    @property
    def beta(self) -> float: ...
    @property
    def dead_zone(self) -> float: ...
    @property
    def w(self) -> Floats:
        """Weights (2, layers, cells + 1): rising, falling."""

    state: Floats

def hysteresis_cycles(x: Floats, band: float | None = None) -> Fields:
    """Rows of turning points and whole cycles, and the band."""

def hysteresis_repeatability(x: Floats, y: Floats, band: float | None = None) -> Fields:
    """Branches over a grid, and their differences (largest, rms): rising, falling, both."""

def series_slip_identify(x: Floats, y: Floats, settings: Mapping[str, Any]) -> Fields:
    """Fields of `Identified`, those of the model under `model`."""

def series_slip_closed(model: SeriesSlip) -> Fields:
    """Fields of the loop whose elements meet."""

def series_slip_through(model: SeriesSlip, x: float, y: float, way: float) -> Fields:
    """Fields of the model moved so that the branch `way`, +1 or -1, passes (x, y)."""

def bouc_wen_simulate(
    model: HysteresisModel,
    u: Floats,
    Ts: float,
    x0: tuple[float, float, float],
    hold: str,
    substeps: int | None,
) -> Floats:
    """Displacement (N,) under a force."""

def bouc_wen_initial_state(
    model: HysteresisModel, u: Floats, y: Floats, Ts: float
) -> tuple[float, float, float]:
    """Displacement, speed and force z at the first row."""

def bouc_wen_identify(
    u: Floats, y: Floats, Ts: float, nu: float | None, at_rest: bool, start_only: bool
) -> tuple[Fields, Fields, list[Fields], tuple[float, float, float]]:
    """Fields of the model, of `Identified`, notes, and the first state."""

def bouc_wen_force_identify(
    x: Floats, y: Floats, nu: float | None
) -> tuple[Fields, Fields, list[Fields]]:
    """Fields of the model, of `Identified`, and notes."""

def maxwell_identify(
    x: Floats, y: Floats, n: int | None, r: list[float] | None, offset: bool
) -> tuple[Fields, Fields]:
    """Fields of the model, and of `Identified`."""

def hysteresis_direction(x: Floats, y: Floats) -> Fields:
    """Fields of `LoopDirection`."""

def plays_identify(
    x: Floats, y: Floats, settings: Mapping[str, Any]
) -> tuple[Fields, Fields, list[str], list[Fields]]:
    """Fields of the model, those of `Identified`, names of the parameters, notes."""

class PlayLearner:
    """Weights of a stack of plays, learnt one sample at a time and never negative."""

    def __init__(
        self,
        r: ArrayLike,
        lam: float = 1.0,
        offset: bool = True,
        P0: float = 1e8,
        gate: float | None = None,
        hold: float = 1e-4,
    ) -> None: ...
    def step(self, x: float, y: float) -> float:
        """Learn a sample; return the error before that."""

    def run(self, x: Floats, y: Floats) -> Floats:
        """Return the errors (N,): `step` in a loop, to the last bit."""

    @property
    def model(self) -> PlayStack:
        """What has been learnt, in the virgin state."""

    @property
    def w(self) -> Floats:
        """Weights (n,)."""

    @property
    def offset(self) -> float: ...
    @property
    def sd(self) -> Floats:
        """Standard deviations (n + 1,) of weights and offset; 0 of what stands at 0."""

    @property
    def r(self) -> Floats: ...
    @property
    def lam(self) -> float: ...
    @property
    def gate(self) -> float | None: ...
    @property
    def hold(self) -> float: ...
    @property
    def seen(self) -> int:
        """Samples."""

class SeriesSlipLearner:
    """Elements in series, learnt one sample at a time."""

    def __init__(
        self,
        threshold: float,
        consecutive: int | None = None,
        P0: float = 100.0,
        noise_sd: float = 0.0,
        band: float = 0.0,
    ) -> None: ...
    def step(self, x: float, y: float) -> float:
        """Learn a sample; return the error before that."""

    def run(self, x: Floats, y: Floats) -> Floats:
        """Return the errors (N,): `step` in a loop, to the last bit."""

    @property
    def model(self) -> SeriesSlip:
        """What has been learnt."""

    @property
    def elements(self) -> tuple[int, int]:
        """How many: rising, falling."""

    @property
    def threshold(self) -> float: ...
    @property
    def consecutive(self) -> int: ...
    @property
    def P0(self) -> float: ...
    @property
    def noise_sd(self) -> float: ...
    @property
    def band(self) -> float: ...

class Stream:
    """A hysteresis model at work, sample by sample."""

    def __init__(self, model: HysteresisModel) -> None: ...
    def step(self, x: float) -> float:
        """Return the output at the input `x`."""

    def run(self, x: Floats) -> Floats:
        """Return the outputs (N,): `step` in a loop, to the last bit."""

    @property
    def model(self) -> HysteresisModel:
        """As given."""

    state: Floats
