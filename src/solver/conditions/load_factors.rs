//! Factors on loads, which an observer may change during a run.

/// Multiplier in the hash of requests: 2⁶⁴ divided by the golden ratio, rounded to an odd number. The bits of
/// this number look random.
const MULTIPLIER: u64 = 0x9E37_79B9_7F4A_7C15;

/// A factor for each condition of the problem, 1 at the start; the same on all ranks. Only factors of
/// conditions that are loads have an effect.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LoadFactors {
    /// Factors that an observer has requested; they apply from the next step or load step on.
    requested: Vec<f64>,
    /// Factors of the loads in the current step.
    present: Vec<f64>,
    /// Factors at the last equilibrium; in explicit stages, the factors of the current step.
    at_equilibrium: Vec<f64>,
    /// A hash of all requests since the start of the run or its restart from a checkpoint.
    requests: u64,
}

impl LoadFactors {
    /// Create factors of 1 for this number of conditions.
    pub fn new(conditions: usize) -> Self {
        let ones = vec![1.0; conditions];
        Self {
            requested: ones.clone(),
            present: ones.clone(),
            at_equilibrium: ones,
            requests: 0,
        }
    }

    /// The requested factor of a condition.
    pub fn get(&self, condition: usize) -> f64 {
        self.requested[condition]
    }

    /// Request a factor for a condition.
    pub fn set(&mut self, condition: usize, factor: f64) {
        self.requested[condition] = factor;
        for word in [condition as u64, factor.to_bits()] {
            self.requests = (self.requests ^ word)
                .wrapping_mul(MULTIPLIER)
                .rotate_left(29);
        }
    }

    /// The factors of the loads in the current step.
    pub fn present(&self) -> &[f64] {
        &self.present
    }

    /// The factors at the last equilibrium.
    pub fn at_equilibrium(&self) -> &[f64] {
        &self.at_equilibrium
    }

    /// Apply the requested factors at the start of a load step.
    pub fn begin_load_step(&mut self) {
        self.present.copy_from_slice(&self.requested);
    }

    /// Record the factors of the current step as the factors at the last equilibrium. Call at the end of a
    /// load step.
    pub fn record_equilibrium(&mut self) {
        self.at_equilibrium.copy_from_slice(&self.present);
    }

    /// Apply the requested factors at the end of an explicit step.
    pub fn end_step(&mut self) {
        self.begin_load_step();
        self.record_equilibrium();
    }

    /// Restore the factors that applied before a step that is rolled back.
    pub fn undo(&mut self, present: &[f64]) {
        self.present.copy_from_slice(present);
        self.record_equilibrium();
    }

    /// A whole number below 2⁵² that differs for different sequences of requests, except for rare hash
    /// collisions.
    pub fn fingerprint(&self) -> f64 {
        (self.requests >> 12) as f64
    }

    /// Encode all factors for a checkpoint. The result is empty if all factors are 1.
    pub fn words(&self) -> Vec<u64> {
        let all = [&self.requested, &self.present, &self.at_equilibrium];
        if all.iter().copied().flatten().all(|factor| *factor == 1.0) {
            return Vec::new();
        }
        let all = all.into_iter().flatten();
        all.map(|factor| factor.to_bits()).collect()
    }

    /// Number of words that [`Self::words`] returns if at least one factor is not 1.
    pub fn word_count(&self) -> usize {
        3 * self.requested.len()
    }

    /// Decode the factors from [`Self::words`]. `conditions` is the number of conditions.
    pub fn of_words(words: &[u64], conditions: usize) -> Self {
        if words.is_empty() {
            return Self::new(conditions);
        }
        let mut factors = words.chunks(conditions).map(|words| {
            let words = words.iter().copied();
            words.map(f64::from_bits).collect()
        });
        let mut next = || factors.next().unwrap_or_default();
        Self {
            requested: next(),
            present: next(),
            at_equilibrium: next(),
            requests: 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_act_from_the_next_step_on() {
        let mut factors = LoadFactors::new(2);
        assert_eq!(factors.words(), [0; 0]);
        factors.set(1, 0.5);
        assert_eq!((factors.get(1), factors.present()), (0.5, &[1.0, 1.0][..]));
        let restarted = LoadFactors::of_words(&factors.words(), 2);
        assert_eq!(restarted.words(), factors.words());
        assert_eq!(factors.words().len(), factors.word_count());
        factors.begin_load_step();
        assert_eq!(factors.present(), [1.0, 0.5]);
        assert_eq!(factors.at_equilibrium(), [1.0, 1.0]);
        factors.record_equilibrium();
        assert_eq!(factors.at_equilibrium(), [1.0, 0.5]);
        assert_ne!(factors.fingerprint(), LoadFactors::new(2).fingerprint());
        // The hash differs for ranks that have set different factors, even if their last factors are equal.
        let mut other = LoadFactors::new(2);
        other.set(1, 0.25);
        other.set(1, 0.5);
        assert_ne!(factors.fingerprint(), other.fingerprint());
    }
}
