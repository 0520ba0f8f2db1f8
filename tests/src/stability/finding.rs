//! What a trial found, and the one rule for what that is worth.

/// Errors of the mean that a result may be off by.
const ERRORS: f64 = 4.0;
/// Relative errors by rounding that a picture may have: throughputs are f32.
const ROUNDING: f64 = 1e-5;
/// A bias of so many errors of the mean is found in five of six runs: it is one error beyond [`ERRORS`].
const FOUND: f64 = 5.0;
/// The bias that a trial is to find.
pub const BIAS: f64 = 0.003;
/// With less than this found, nothing is said.
const LEAST: f64 = 0.2;

/// A number beside the known answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Answer {
    /// A mean with its standard error.
    Estimate {
        /// Known.
        expected: f64,
        /// Found.
        got: f64,
        /// Standard error of `got`.
        error: f64,
    },
    /// The worst of many deviations, or a count, beside the most that it may be.
    Bound {
        /// The most that it may be.
        at_most: f64,
        /// Found.
        got: f64,
    },
}

/// What a trial found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finding {
    /// The number.
    pub answer: Answer,
    /// Samples that were dropped.
    pub invalid: u64,
    /// Samples taken, or repetitions.
    pub samples: u64,
}

/// What a finding is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// It agrees with the known answer, and a bias of [`BIAS`] would have been found.
    Holds,
    /// It agrees; a smaller bias than this share would not have been found.
    HoldsWithin(f64),
    /// Its error is too large to say anything.
    Unsure,
    /// It does not agree.
    Fails,
}

impl Finding {
    /// An estimate.
    pub fn estimate(expected: f64, (got, error): (f64, f64), samples: u64) -> Self {
        Self { answer: Answer::Estimate { expected, got, error }, invalid: 0, samples }
    }

    /// The worst of `samples` deviations, or a count among them.
    pub fn bound(at_most: f64, got: f64, samples: u64) -> Self {
        Self { answer: Answer::Bound { at_most, got }, invalid: 0, samples }
    }

    /// How far off it is, relative to what was expected; of a bound, what was found.
    pub fn off(&self) -> f64 {
        match self.answer {
            Answer::Estimate { expected: 0.0, got, .. } | Answer::Bound { got, .. } => got,
            Answer::Estimate { expected, got, .. } => got / expected - 1.0,
        }
    }

    /// The rule: within `ERRORS` standard errors and `ROUNDING`, nothing dropped, and an error that finds a bias.
    pub fn verdict(&self) -> Verdict {
        if self.invalid > 0 {
            return Verdict::Fails;
        }
        match self.answer {
            Answer::Bound { at_most, got } if got <= at_most => Verdict::Holds,
            Answer::Bound { .. } => Verdict::Fails,
            Answer::Estimate { expected, got, error } => {
                let found = if error == 0.0 { 0.0 } else { FOUND * error / expected.abs() };
                // What is no number is not within anything.
                let is_within = (got - expected).abs() <= ERRORS * error + ROUNDING * expected.abs();
                match found {
                    _ if !is_within => Verdict::Fails,
                    f if f <= BIAS => Verdict::Holds,
                    f if f <= LEAST => Verdict::HoldsWithin(f),
                    _ => Verdict::Unsure,
                }
            }
        }
    }
}
