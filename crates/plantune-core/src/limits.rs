//! The stored thresholds behind every warning and refusal, one field per code of the catalogue.

/// Thresholds. A changed one leaves a note in every result it was used for.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Largest share of rows that may be missing under a gap policy.
    pub D07: f64,
    /// Largest finite magnitude; squares of larger numbers overflow.
    pub D08: f64,
    /// Largest deviation of a time step from the median step, as a share of it.
    pub D15: f64,
    /// Share of the record that an output may stand still while an input moves.
    pub D18: f64,
    /// Least size of a spike, in robust standard deviations of the second difference.
    pub D19: f64,
    /// Least input travel, relative to the input's largest magnitude after centring on its first value.
    pub X01: f64,
    /// Least ratio of singular values of the centred, column-scaled input Hankel matrix.
    pub X02: f64,
    /// Rows per parameter below which intervals are doubtful.
    pub X03: f64,
    /// Largest p-value at which a model counts as related to the data.
    pub X04: f64,
    /// Largest delay as a share of the record.
    pub X05: f64,
    /// Least relative loss difference between the best two delays.
    pub X06: f64,
    /// Share of its final value that a response must reach for gain and time constant to be told apart.
    pub X07: f64,
    /// Least ratio of singular values of the column-scaled regressor of a record.
    pub X08: f64,
    /// Distance below which a pole and a zero count as cancelling, whatever their uncertainty.
    pub X10: f64,
    /// Factor by which a value may lie outside of its declared range.
    pub N03: f64,
    /// Most that a filter may remember of an unknown start, as a share of what it changed.
    pub F02: f64,
    /// Share of the rows at which an input may lie at a limit of its actuator.
    pub M03: f64,
    /// Largest share of the rows that may be left out as saturated or stuck.
    pub M03_most: f64,
    /// Largest resolution of an output as a share of its response.
    pub M04: f64,
    /// Least share of what a linear model leaves that a dead band must explain.
    pub M05: f64,
    /// Least share of it that the turning points of the input must explain.
    pub M06: f64,
    /// Largest sample time as a share of the time constant.
    pub M09: f64,
    /// Least simulation fit on fresh data, in percent, for a verdict to pass.
    pub V01: f64,
    /// Fit in percent by which a polynomial model may simulate fresh data better than a process model.
    pub V03: f64,
    /// Samples by which the delays of the two may differ, beside their uncertainty.
    pub V04: f64,
    /// Least first sample of a step response that starts the wrong way, as a share of the final value.
    pub V06: f64,
    /// Least magnitude of a pole with negative real part that counts.
    pub V07: f64,
    /// Least relative difference of mean squared errors that counts between ways to treat a record.
    pub V09: f64,
    /// Fit in percent within which models simulate fresh data equally well.
    pub V10: f64,
    /// Standard deviations by which feedback may move gain or time constant of a process model.
    pub V11: f64,
    /// Points of simulation fit that another level may cost before it is said.
    pub V13: f64,
    /// Largest share of its size by which a step response may differ from that of the record.
    pub V16: f64,
    /// Standard deviations that a process gain must be away from zero to be tuned on.
    pub X12: f64,
    /// Share of the integral gain of the best model that tuning over its uncertainty shall keep.
    pub T04: f64,
    /// Least gain margin, as a factor, over the model's uncertainty.
    pub C07: f64,
    /// Least phase margin there, degrees.
    pub C07_phase: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            D07: 0.2,
            D08: 1e150,
            D15: 0.01,
            D18: 0.2,
            D19: 20.0,
            X01: 1e-8,
            X02: 1e-5,
            X03: 10.0,
            X04: 0.01,
            X05: 1.0 / 3.0,
            X06: 0.01,
            X07: 0.632,
            X08: 1e-10,
            X10: 0.01,
            N03: 50.0,
            F02: 0.02,
            M03: 0.05,
            M03_most: 0.5,
            M04: 0.25,
            M05: 0.3,
            M06: 0.4,
            M09: 0.5,
            V01: 50.0,
            V03: 5.0,
            V04: 1.0,
            V06: 0.05,
            V07: 0.35,
            V09: 0.2,
            V10: 1.0,
            V11: 2.0,
            V13: 5.0,
            V16: 0.05,
            X12: 2.0,
            T04: 0.5,
            C07: 2.0,
            C07_phase: 45.0,
        }
    }
}

impl Limits {
    /// Every threshold by its code, in the order of the catalogue.
    pub fn items(&self) -> [(&'static str, f64); 36] {
        [
            ("D07", self.D07),
            ("D08", self.D08),
            ("D15", self.D15),
            ("D18", self.D18),
            ("D19", self.D19),
            ("X01", self.X01),
            ("X02", self.X02),
            ("X03", self.X03),
            ("X04", self.X04),
            ("X05", self.X05),
            ("X06", self.X06),
            ("X07", self.X07),
            ("X08", self.X08),
            ("X10", self.X10),
            ("N03", self.N03),
            ("F02", self.F02),
            ("M03", self.M03),
            ("M03_most", self.M03_most),
            ("M04", self.M04),
            ("M05", self.M05),
            ("M06", self.M06),
            ("M09", self.M09),
            ("V01", self.V01),
            ("V03", self.V03),
            ("V04", self.V04),
            ("V06", self.V06),
            ("V07", self.V07),
            ("V09", self.V09),
            ("V10", self.V10),
            ("V11", self.V11),
            ("V13", self.V13),
            ("V16", self.V16),
            ("X12", self.X12),
            ("T04", self.T04),
            ("C07", self.C07),
            ("C07_phase", self.C07_phase),
        ]
    }
}
