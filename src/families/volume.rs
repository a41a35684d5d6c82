//! Volume correction: the factor Ṽ_j/V_j, with the volume V_j of a lattice cell and the corrected volume Ṽ_j.
//! Without correction, the factor is 1 within the horizon and 0 beyond.
//!
//! - `linear`: the factor falls linearly from 1 at |ξ| = δ − dx/2 to 0 at δ + dx/2, where dx is the cell edge
//!   (Hu, Ha & Bobaru 2010; PA-HHB in Seleson 2014). Families therefore contain points beyond the horizon.
//!   `LinearInside` is the form of LAMMPS (Parks et al. 2008): the factor drops from 1/2 to 0 at δ.
//! - `exact`: the factor is the fraction of the cell within the horizon, |V_j ∩ B_δ(x_i)|/V_j (Diehl &
//!   Schweitzer 2016, eq. 2). This fraction has a closed form in 1-D and 2-D, and is computed by quadrature
//!   over slices in 3-D.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};

use rustc_hash::FxHashMap;

use crate::problem::VolumeCorrection;

use super::search::cutoff;

/// Number of quadrature slices of a cell in 3-D.
const SLICES: u32 = 256;

/// Resolution of the offsets in the cache, as a fraction of the edge of a cell.
const RESOLUTION: f64 = 1e-6;

/// A quarter of a cell's edge, in units of [`RESOLUTION`]. The components of offsets between points of the
/// same or adjacent refinement levels are multiples of a quarter of the edge.
const QUARTER: i64 = 250_000;

/// Maximum number of entries of the lookup table.
const MOST_MULTIPLES: usize = 1 << 17;

/// Bit pattern of a table entry that has not been computed.
const UNKNOWN: u64 = u64::MAX;

/// Upper limit (m) for the length of bonds with a positive factor. The factor falls to 0 at `length` (m). The
/// limit is slightly below `length`, so bonds whose factor would be only round-off are excluded.
fn inside(length: f64) -> f64 {
    length * (1.0 - 1e-9)
}

/// The volume correction factors for one horizon and one cell size. Several threads can use the same
/// `VolumeFactors` at once.
pub struct VolumeFactors {
    correction: VolumeCorrection,
    horizon: f64,
    edge: f64,
    /// 1/([`RESOLUTION`] × edge), 1/m.
    per_resolution: f64,
    dimension: usize,
    /// Square of the maximum length of bonds with a positive factor, m².
    reach_squared: f64,
    /// Number of table entries per direction, one per quarter of the edge; 0 if the table would be too large.
    multiples: usize,
    /// Bit patterns of the factors at offsets whose components are multiples of a quarter of the edge.
    table: OnceLock<Vec<AtomicU64>>,
    /// Factors at all other offsets.
    cache: Mutex<FxHashMap<[i64; 3], f64>>,
}

impl VolumeFactors {
    /// Create the factors for a horizon (m) and cells with this edge (m).
    pub fn new(correction: VolumeCorrection, horizon: f64, edge: f64, dimension: usize) -> Self {
        let mut factors = Self {
            correction,
            horizon,
            edge,
            per_resolution: 1.0 / (edge * RESOLUTION),
            dimension,
            reach_squared: 0.0,
            multiples: 0,
            table: OnceLock::default(),
            cache: Mutex::default(),
        };
        factors.reach_squared = factors.cutoff().powi(2);
        let multiples = 4.0 * factors.cutoff() / edge + 1.0;
        if multiples.powi(dimension as i32) <= MOST_MULTIPLES as f64 {
            factors.multiples = multiples as usize;
        }
        factors
    }

    /// Upper limit (m) for the length of bonds with a positive factor. For `exact`, the longest
    /// such bond is parallel to a diagonal of cell j, and the nearest corner of the cell touches the ball of
    /// radius δ.
    pub fn cutoff(&self) -> f64 {
        let half = 0.5 * self.edge;
        match self.correction {
            VolumeCorrection::None | VolumeCorrection::LinearInside => cutoff(self.horizon),
            VolumeCorrection::Linear => inside(self.horizon + half),
            VolumeCorrection::Exact => inside(self.horizon + half * (self.dimension as f64).sqrt()),
        }
    }

    /// The factor at an offset ξ (m). The factors at ξ and −ξ are equal.
    pub fn at(&self, offset: [f64; 3]) -> f64 {
        let squared = offset.iter().map(|x| x * x).sum::<f64>();
        let is_inside = squared <= cutoff(self.horizon).powi(2);
        match self.correction {
            VolumeCorrection::None => f64::from(is_inside),
            VolumeCorrection::LinearInside if !is_inside => 0.0,
            VolumeCorrection::Linear | VolumeCorrection::LinearInside => {
                ((self.horizon - squared.sqrt()) / self.edge + 0.5).clamp(0.0, 1.0)
            }
            VolumeCorrection::Exact if squared > self.reach_squared => 0.0,
            VolumeCorrection::Exact => match self.multiple(offset) {
                Some((known, steps)) => {
                    // Relaxed ordering is sufficient, because racing threads compute the same value.
                    let bits = known.load(Ordering::Relaxed);
                    if bits != UNKNOWN {
                        return f64::from_bits(bits);
                    }
                    let factor = self.overlap(steps.map(|k| k * QUARTER));
                    known.store(factor.to_bits(), Ordering::Relaxed);
                    factor
                }
                None => {
                    let steps =
                        ordered(offset.map(|x| (x.abs() * self.per_resolution + 0.5) as i64));
                    let cached = || self.cache.lock().unwrap_or_else(PoisonError::into_inner);
                    let known = cached().get(&steps).copied();
                    known.unwrap_or_else(|| {
                        let factor = self.overlap(steps);
                        cached().insert(steps, factor);
                        factor
                    })
                }
            },
        }
    }

    /// Return the table entry of an offset, and the absolute values of the offset's components in quarters of
    /// the cell edge; `None` if the table has no entry for the offset.
    #[inline]
    fn multiple(&self, offset: [f64; 3]) -> Option<(&AtomicU64, [i64; 3])> {
        let quarters = offset.map(|x| x.abs() * self.per_resolution / QUARTER as f64);
        let steps = quarters.map(|x| (x + 0.5) as i64);
        let mut index = 0;
        for k in (0..self.dimension).rev() {
            let is_multiple = (quarters[k] - steps[k] as f64).abs() < 0.5 / QUARTER as f64;
            if !is_multiple || steps[k] as usize >= self.multiples {
                return None;
            }
            index = index * self.multiples + steps[k] as usize;
        }
        Some((&self.table.get_or_init(|| self.new_table())[index], steps))
    }

    #[cold]
    fn new_table(&self) -> Vec<AtomicU64> {
        let count = self.multiples.pow(self.dimension as u32);
        (0..count).map(|_| AtomicU64::new(UNKNOWN)).collect()
    }

    /// The exact factor at an offset in units of [`RESOLUTION`].
    fn overlap(&self, steps: [i64; 3]) -> f64 {
        let steps = ordered(steps);
        let radius = self.horizon / self.edge;
        overlap(steps.map(|k| k as f64 * RESOLUTION), radius, self.dimension)
    }
}

/// Sort the components, the largest first. The volume correction factor does not depend on the order of the
/// components. Offsets that differ only in this order therefore share one cached value.
fn ordered(mut steps: [i64; 3]) -> [i64; 3] {
    steps.sort_unstable_by(|a, b| b.cmp(a));
    steps
}

/// The volume of the unit cell around `centre` that lies within a ball around the origin.
fn overlap(centre: [f64; 3], radius: f64, dimension: usize) -> f64 {
    let range = |k: usize| [centre[k] - 0.5, centre[k] + 0.5];
    match dimension {
        1 => (radius.min(range(0)[1]) - (-radius).max(range(0)[0])).clamp(0.0, 1.0),
        2 => rectangle_in_disc(range(0), range(1), radius),
        _ => {
            let [low, high] = range(2);
            let (low, high) = (low.max(-radius), high.min(radius));
            let thickness = (high - low).max(0.0) / f64::from(SLICES);
            let slice = |k: u32| {
                let z = low + (f64::from(k) + 0.5) * thickness;
                let radius = (radius * radius - z * z).max(0.0).sqrt();
                rectangle_in_disc(range(0), range(1), radius)
            };
            (0..SLICES).map(slice).sum::<f64>() * thickness
        }
    }
}

/// Return the area of the part of a rectangle that lies within a disc centred at the origin.
fn rectangle_in_disc(x: [f64; 2], y: [f64; 2], radius: f64) -> f64 {
    let corner =
        |x: f64, y: f64| x.signum() * y.signum() * quadrant_in_disc(x.abs(), y.abs(), radius);
    let area = corner(x[1], y[1]) - corner(x[0], y[1]) - corner(x[1], y[0]) + corner(x[0], y[0]);
    area.max(0.0)
}

/// The area of [0, x] × [0, y] within the disc around the origin.
fn quadrant_in_disc(x: f64, y: f64, radius: f64) -> f64 {
    if x * x + y * y <= radius * radius {
        return x * y;
    }
    let (x, y) = (x.min(radius), y.min(radius));
    if radius == 0.0 {
        return 0.0;
    }
    // The upper boundary of the area is the edge y up to `a`, and the circle beyond.
    let a = (radius * radius - y * y).max(0.0).sqrt().min(x);
    let under_circle = |u: f64| {
        let height = (radius * radius - u * u).max(0.0).sqrt();
        0.5 * (u * height + radius * radius * libm::asin((u / radius).min(1.0)))
    };
    a * y + under_circle(x) - under_circle(a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// Sum of the factors at all offsets of a lattice, including ξ = 0.
    fn whole(correction: VolumeCorrection, dimension: usize, horizon: f64) -> f64 {
        let factors = VolumeFactors::new(correction, horizon, 1.0, dimension);
        let reach = horizon.ceil() as i32 + 1;
        let range = |k: usize| if k < dimension { -reach..=reach } else { 0..=0 };
        let mut sum = 0.0;
        for z in range(2) {
            for y in range(1) {
                for x in range(0) {
                    sum += factors.at([x, y, z].map(f64::from));
                }
            }
        }
        sum
    }

    #[test]
    fn exact_factors_fill_the_ball() {
        for horizon in [1.3, 2.0, 3.0, 3.7] {
            let exact = |dimension| whole(VolumeCorrection::Exact, dimension, horizon);
            assert!((exact(1) / (2.0 * horizon) - 1.0).abs() < 1e-12);
            assert!((exact(2) / (PI * horizon.powi(2)) - 1.0).abs() < 1e-12);
            let ball = 4.0 / 3.0 * PI * horizon.powi(3);
            assert!(
                (exact(3) / ball - 1.0).abs() < 1e-5,
                "{}",
                exact(3) / ball - 1.0
            );
        }
    }

    #[test]
    fn an_exact_factor_by_counting() {
        let factors = VolumeFactors::new(VolumeCorrection::Exact, 0.003, 0.001, 3);
        let cells = 100;
        let at = |k: i32| (f64::from(k) + 0.5) / f64::from(cells) - 0.5;
        let mut within = 0;
        for i in 0..cells {
            for j in 0..cells {
                for k in 0..cells {
                    let (x, y, z) = (2.0 + at(i), 2.0 + at(j), 1.0 + at(k));
                    within += i32::from(x * x + y * y + z * z <= 9.0);
                }
            }
        }
        let counted = f64::from(within) / f64::from(cells).powi(3);
        let found = factors.at([0.002, -0.001, -0.002]);
        assert!((found - counted).abs() < 1e-3, "{found} {counted}");
    }

    #[test]
    fn cached_factors_are_those_of_their_offsets() {
        for horizon in [1.5, 3.0] {
            let factors = VolumeFactors::new(VolumeCorrection::Exact, horizon, 1.0, 3);
            // Offsets at multiples of a quarter of the edge, other offsets, and offsets beyond the cutoff.
            // The second pass over the same offsets reads the table or the cache.
            for step in [0.25, 0.3, 0.25, 0.3] {
                let axis = || (0..16).map(|k| f64::from(k) * step);
                for offset in axis().flat_map(|x| axis().map(move |y| [x, -y, 0.5])) {
                    let mut ordered = offset.map(f64::abs);
                    ordered.sort_by(|a, b| b.total_cmp(a));
                    let expected = overlap(ordered, horizon, 3);
                    // The table or cache has an entry for each of these offsets, so the differences are only
                    // round-off.
                    assert!((factors.at(offset) - expected).abs() < 1e-12, "{offset:?}");
                }
            }
        }
    }

    #[test]
    fn a_cell_on_the_horizon_counts_half_with_the_linear_taper() {
        let factors = VolumeFactors::new(VolumeCorrection::Linear, 3.0, 1.0, 2);
        assert_eq!(factors.at([3.0, 0.0, 0.0]), 0.5);
        assert_eq!(factors.at([0.0, -2.0, 0.0]), 1.0);
        assert_eq!(factors.at([2.0, 3.0, 0.0]), 0.0);
        assert!(factors.at([3.1, 0.0, 0.0]) > 0.0);
        let inside = VolumeFactors::new(VolumeCorrection::LinearInside, 3.0, 1.0, 2);
        assert_eq!(inside.at([3.0, 0.0, 0.0]), 0.5);
        assert_eq!(inside.at([2.0, 2.0, 0.0]), factors.at([2.0, 2.0, 0.0]));
        assert_eq!(inside.at([3.1, 0.0, 0.0]), 0.0);
    }
}
