"""The sampled controller written out from its equations, as exports and core must follow it."""


class Law:
    """Backward Euler in two degrees of freedom; clamping at the limits; manual and automatic.

    ::

        e = r - y,  P = Kp (b r - y),  v = P + I' + D with I' = I + Ki Ts e
        D = Kp Td/(Tf + Ts) (w - x),  x <- x + Ts/(Tf + Ts) (w - x),  w = c r - y
        I stays where v is beyond a limit and Ki e drives it further out, else it becomes I'
        in manual u is given, and I = u - P - D
    """

    def __init__(self, pid, Ts, u_min=None, u_max=None, y0=0.0, u0=0.0):
        self.pid, self.Ts = pid, Ts
        self.low = float("-inf") if u_min is None else u_min
        self.high = float("inf") if u_max is None else u_max
        self.x = (pid.c - 1.0) * y0
        self.I = u0 - pid.Kp * (pid.b - 1.0) * y0

    def terms(self, r, y):
        """Return P and D, and move the filter on."""
        pid, Ts = self.pid, self.Ts
        off = pid.c * r - y - self.x
        self.x += Ts / (pid.Tf + Ts) * off
        return pid.Kp * (pid.b * r - y), pid.Kp * pid.Td / (pid.Tf + Ts) * off

    def step(self, r, y):
        """One sample in automatic."""
        P, D = self.terms(r, y)
        more = self.pid.Ki * self.Ts * (r - y)
        v = P + self.I + more + D
        if (v > self.high and more > 0) or (v < self.low and more < 0):
            v = P + self.I + D
        else:
            self.I += more
        return min(max(v, self.low), self.high)

    def manual(self, r, y, u):
        """One sample in manual."""
        P, D = self.terms(r, y)
        self.I = u - P - D
        return u
