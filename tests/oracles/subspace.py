"""Subspace identification: MOESP, N4SID, CVA; from records and from frequency responses.

    x(t+1) = A x + B u + K e,  y = C x + D u + e,  s block rows, N = rows - 2 s + 1 columns
    Up, Yp, Uf, Yf    block Hankel matrices, past 0 ... s-1 and future s ... 2s-1
    L                 lower factor of [Uf; Wp; Yf] = L Q, Wp = [Up; Yp]
    weighted block    MOESP  L32 (Yf without Uf, on Wp);  N4SID  L32 L22^+ [L21 L22] (oblique);
                      CVA    W1 L32, W1 = (L32 L32' + L33 L33')^-1/2
    G                 = W1^-1 U1 S1^(1/2) (or U1, `scaled=False`);  C = its first block row,
                      A = G(without last)^+ G(without first)
    B, D by "states"  least squares of [X(i+1); y(i)] - [A; C] X(i) - K(B, D) Uf, the projected
                      states X(i) = G^+ Yf/[Up Yp Uf], as SLICOT IB01BD with METH = 'C'
    B, D by "simulation"  y is linear in B, D, x(0) and O once A and C are known
    Kalman gain       of Q, S, R of the residuals of [X(i+1); y(i)] on [X(i); Uf]
    frequency data    rows z^i G(z) over rows z^i I, real and imaginary parts; McKelvey, Akcay &
                      Ljung, IEEE TAC 41, 1996; z is first moved so that it spreads over the circle

Verhaegen 1994; Van Overschee & De Moor 1996, 4.3 and 4.4; SLICOT IB01AD, IB01BD.
Everything as printed, with explicit projections; nothing recursive.
"""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
from numpy.linalg import lstsq, pinv, qr, solve, svd
from scipy.linalg import cholesky, schur, solve_discrete_are, solve_discrete_lyapunov


def hankel(x, first, rows, N):
    """Return [x(first) ...; x(first+1) ...; ...], rows blocks of N columns."""
    return np.vstack([x[first + i : first + i + N].T for i in range(rows)])


def blocks(u, y, s, starts=(0,)):
    """Return Uf, Up, Yp, Yf; the columns of all segments side by side."""
    edges = [*starts, len(y)]
    parts = []
    for a, b in pairwise(edges):
        N = b - a - 2 * s + 1
        if N > 0:
            parts.append([hankel(x, a + f, s, N) for x, f in ((u, s), (u, 0), (y, 0), (y, s))])
    return [np.hstack(p) for p in zip(*parts, strict=True)]


def singular(u, y, s, method="moesp", starts=(0,)):
    """Return W1, the left vectors and the singular values of the weighted block."""
    Uf, Up, Yp, Yf = blocks(u, y, s, starts)
    L = qr(np.vstack([Uf, Up, Yp, Yf]).T, mode="r").T
    a, b = len(Uf), len(Uf) + len(Up) + len(Yp)
    L21, L22, L32, L33 = L[a:b, :a], L[a:b, a:b], L[b:, a:b], L[b:, b:]
    W1 = np.eye(len(Yf))
    if method == "moesp":
        M = L32
    elif method == "n4sid":
        M = L32 @ pinv(L22, rcond=1e-12) @ np.hstack([L21, L22])
    else:
        w, V = np.linalg.eigh(L32 @ L32.T + L33 @ L33.T)
        W1 = V @ np.diag(np.maximum(w, 1e-14 * w[-1]) ** -0.5) @ V.T
        M = W1 @ L32
    U, S, _ = svd(M)
    return W1, U, S


def a_and_c(W1, U, S, n, ny, scaled=True):
    """Return A, C and the extended observability matrix G."""
    G = solve(W1, U[:, :n] * (np.sqrt(S[:n]) if scaled else 1.0))
    return lstsq(G[:-ny], G[ny:], rcond=None)[0], G[:ny], G


def stable(A, limit=0.9999):
    """Return A, eigenvalues outside `limit` reflected or drawn to it, the same Schur vectors."""
    T, Z = schur(A, "complex")
    d = np.diag(T)
    r = np.maximum(np.abs(d), 1e-300)
    inside = np.where(r > 1 / limit, 1 / r, np.minimum(r, limit))
    return (Z @ (T - np.diag(d) + np.diag(d / r * inside)) @ Z.conj().T).real


def _on(target, *rows):
    """Return the projection of target's rows on those of the others."""
    W = np.vstack(rows)
    return lstsq(W.T, target.T, rcond=None)[0].T @ W


def projected(u, y, s, G, starts=(0,)):
    """Return X(i), X(i+1), y(i), Uf."""
    m, ny = u.shape[1], y.shape[1]
    Uf, Up, Yp, Yf = blocks(u, y, s, starts)
    X = pinv(G) @ _on(Yf, Up, Yp, Uf)
    X1 = pinv(G[:-ny]) @ _on(Yf[ny:], Up, Uf[:m], Yp, Yf[:ny], Uf[m:])
    return X, X1, Yf[:ny], Uf


def toeplitz(G, B, D, s):
    """Return the lower block matrix of D, C B, C A B ..."""
    ny, m = D.shape
    h = [D] + [G[i * ny : (i + 1) * ny] @ B for i in range(s - 1)]
    H = np.zeros((s * ny, s * m))
    for i in range(s):
        for j in range(i + 1):
            H[i * ny : (i + 1) * ny, j * m : (j + 1) * m] = h[i - j]
    return H


def b_and_d_by_states(u, y, s, A, C, G, starts=(0,)):
    """Return B and D of the combined method of SLICOT."""
    n, m, ny = len(A), u.shape[1], len(C)
    X, X1, Y, Uf = projected(u, y, s, G, starts)
    target = np.vstack([X1, Y]) - np.vstack([A, C]) @ X
    full, short = pinv(G), pinv(G[:-ny])

    def effect(B, D):
        H = toeplitz(G, B, D, s)
        top = np.hstack([B, short @ H[:-ny, :-m]]) - A @ full @ H
        return np.vstack([top, np.hstack([D, np.zeros((ny, m * (s - 1)))]) - C @ full @ H]) @ Uf

    unit = np.eye(n * m + ny * m)
    columns = [effect(e[: n * m].reshape(n, m), e[n * m :].reshape(ny, m)).ravel() for e in unit]
    theta = lstsq(np.array(columns).T, target.ravel(), rcond=None)[0]
    return theta[: n * m].reshape(n, m), theta[n * m :].reshape(ny, m)


def simulate(A, B, C, D, u, x0):
    """Return y of x(t+1) = A x + B u, y = C x + D u."""
    x, y = np.array(x0, float), np.empty((len(u), len(C)))
    for t in range(len(u)):
        y[t] = C @ x + D @ u[t]
        x = A @ x + B @ u[t]
    return y


def b_and_d_by_simulation(u, y, A, C, starts=(0,), direct=True, offset=True):
    """Return B, D, O and x0 (segments, n), the least squares fit of the simulated output."""
    n, m, ny = len(A), u.shape[1], len(C)
    edges = [*starts, len(y)]
    segments = list(pairwise(edges))
    zero_b, zero_d, none = np.zeros((n, m)), np.zeros((ny, m)), np.zeros(n)
    columns = []
    for i in range(n):
        for j in range(m):
            B = zero_b.copy()
            B[i, j] = 1
            columns.append(
                np.vstack([simulate(A, B, C, zero_d, u[a:b], none) for a, b in segments])
            )
    for i in range(ny if direct else 0):
        for j in range(m):
            columns.append(np.outer(u[:, j], np.eye(ny)[i]))
    for i in range(ny if offset else 0):
        columns.append(np.tile(np.eye(ny)[i], (len(y), 1)))
    for a, b in segments:
        for i in range(n):
            free = np.zeros_like(y)
            free[a:b] = simulate(A, zero_b, C, zero_d, np.zeros((b - a, m)), np.eye(n)[i])
            columns.append(free)
    F = np.array([c.ravel() for c in columns]).T
    size = np.linalg.norm(F, axis=0)
    size[size == 0] = 1.0
    theta = lstsq(F / size, y.ravel(), rcond=1e-11)[0] / size
    parts = np.split(theta, np.cumsum([n * m, ny * m * direct, ny * offset]))
    D = parts[1].reshape(ny, m) if direct else zero_d
    O = parts[2] if offset else np.zeros(ny)
    return parts[0].reshape(n, m), D, O, parts[3].reshape(-1, n)


def kalman(u, y, s, A, C, G, rows=None, starts=(0,)):
    """Return K, Q, R, S; sums of squares over `rows` (SLICOT divides by all samples)."""
    n = len(A)
    X, X1, Y, Uf = projected(u, y, s, G, starts)
    left, Z = np.vstack([X1, Y]), np.vstack([X, Uf])
    rho = left - lstsq(Z.T, left.T, rcond=None)[0].T @ Z
    cov = rho @ rho.T / (rows or rho.shape[1])
    Q, S, R = cov[:n, :n], cov[:n, n:], cov[n:, n:]
    P = solve_discrete_are(A.T, C.T, Q, R, s=S)
    return (A @ P @ C.T + S) @ np.linalg.inv(C @ P @ C.T + R), Q, R, S


def identify(u, y, n, s, method="moesp", by="simulation", starts=(0,), direct=True):
    """Return A, B, C, D, O, x0 and the singular values."""
    W1, U, S = singular(u, y, s, method, starts)
    A, C, G = a_and_c(W1, U, S, n, y.shape[1])
    A = stable(A)
    O, x0 = np.zeros(y.shape[1]), None
    if by == "states":
        B, D = b_and_d_by_states(u, y, s, A, C, G, starts)
    else:
        B, D, O, x0 = b_and_d_by_simulation(u, y, A, C, starts, direct)
    return SimpleNamespace(A=A, B=B, C=C, D=D, O=O, x0=x0, singular_values=S)


def by_past_states(u, y, n, s, method="n4sid"):
    """Return A, B, C, D of least squares on states that are combinations of the past.

    X = S1^(-1/2) U1' W1 L32 L22^+ Wp; x(t+1) on x, u and y on x, u: as open packages do.
    """
    m, ny = u.shape[1], y.shape[1]
    Uf, Up, Yp, Yf = blocks(u, y, s)
    Wp = np.vstack([Up, Yp])
    L = qr(np.vstack([Uf, Wp, Yf]).T, mode="r").T
    a, b = len(Uf), len(Uf) + len(Wp)
    W1, U, S = singular(u, y, s, method)
    past = L[b:, a:b] @ pinv(L[a:b, a:b], rcond=1e-12)
    X = np.diag(S[:n] ** -0.5) @ U[:, :n].T @ W1 @ past @ Wp
    Z = np.vstack([X, Uf[:m]])
    AB = lstsq(Z[:, :-1].T, X[:, 1:].T, rcond=None)[0].T
    CD = lstsq(Z.T, Yf[:ny].T, rcond=None)[0].T
    return AB[:, :n], AB[:, n:], CD[:, :n], CD[:, n:]


def markov(A, B, C, D, count):
    """Return D, C B, C A B ... (count, ny, nu)."""
    out, x = [D], B
    for _ in range(count - 1):
        out.append(C @ x)
        x = A @ x
    return np.array(out)


def freqresp(A, B, C, D, z):
    return (
        C @ solve(z[:, None, None] * np.eye(len(A)) - A, np.broadcast_to(B, (len(z), *B.shape))) + D
    )


def from_frequency(z, G, n, q):
    """Return A, B, C, D of G (M, ny, nu) at z (M,) on the unit circle, and the singular values.

    z = e^(jw) goes to (1 + j t/t0)/(1 - j t/t0), t = tan(w/2), t0 the geometric mean of t, and
    the model found there comes back by the same bilinear map.
    """
    t = np.tan(np.angle(z) / 2)
    t0 = np.exp(np.mean(np.log(np.abs(t))))
    zeta = (1 + 1j * t / t0) / (1 - 1j * t / t0)
    M, ny, m = G.shape
    powers = zeta[None, :] ** np.arange(q)[:, None]
    left = np.einsum("ik,kab->iakb", powers, G).reshape(q * ny, M * m)
    right = np.einsum("ik,ab->iakb", powers, np.eye(m)).reshape(q * m, M * m)
    stack = np.vstack([np.hstack([x.real, x.imag]) for x in (right, left)])
    L = qr(stack.T, mode="r").T
    U, S, _ = svd(L[q * m :, q * m :])
    A = lstsq(U[:-ny, :n], U[ny:, :n], rcond=None)[0]
    C = U[:ny, :n]
    CX = C @ np.linalg.inv(zeta[:, None, None] * np.eye(n) - A)
    F = np.concatenate([CX, np.broadcast_to(np.eye(ny), (M, ny, ny))], axis=2).reshape(M * ny, -1)
    T = G.reshape(M * ny, m)
    theta = lstsq(np.vstack([F.real, F.imag]), np.vstack([T.real, T.imag]), rcond=None)[0]
    B, D = theta[:n], theta[n:]
    eye = np.eye(n)
    X = np.linalg.inv(A + eye)  # (zeta - 1)/(zeta + 1) = (1/t0) (z - 1)/(z + 1)
    D = D - C @ X @ B
    A, B, C = t0 * X @ (A - eye), t0 * np.sqrt(2) * X @ B, np.sqrt(2) * C @ X
    Y = np.linalg.inv(eye - A)
    return Y @ (eye + A), np.sqrt(2) * Y @ B, np.sqrt(2) * C @ Y, D + C @ Y @ B, S


def balanced(A, B, C, n):
    """Return the balanced truncation to order n, the Hankel values, and 2 sum of those cut off."""
    P, Q = solve_discrete_lyapunov(A, B @ B.T), solve_discrete_lyapunov(A.T, C.T @ C)
    Lp, Lq = cholesky(P, lower=True), cholesky(Q, lower=True)
    U, h, Vt = svd(Lq.T @ Lp)
    T, Ti = Lp @ Vt.T / np.sqrt(h), (U / np.sqrt(h)).T @ Lq.T
    return (Ti @ A @ T)[:n, :n], (Ti @ B)[:n], (C @ T)[:, :n], h, 2 * np.sum(h[n:])
