//! Position-aware linear solid (PALS): an ordinary state-based solid with influence functions fitted to each
//! point's own family.
//!
//! Mitchell, Silling & Littlewood 2015. With the extension e = |Y| − |ξ|,
//!
//! θ = Σ ω|ξ| e Ṽ, ε = e − θ|ξ|/d, W = ½ k′θ² + ½ Σ σ ε² Ṽ,
//!
//! t = (k′θ − (1/d) Σ σ|ξ| ε Ṽ) ω|ξ| + σ ε.
//!
//! At a small homogeneous strain H, a bond of direction n has e = |ξ| n·H n.
//! The functions ω and σ must satisfy, for probe strains H along the axes and in shear between the axes,
//!
//! Σ ω|ξ| e Ṽ = tr H, Σ σ ε² Ṽ = 2G dev H : dev H.
//!
//! Among all such functions, ω and σ are nearest to those of [`Ordinary`](super::Ordinary), ω₀ = d/m and σ₀ =
//! A/m.
//! The distance is Σ |ξ|² (ω − ω₀)² Ṽ, and the same for σ.
//! Lagrange multipliers then give ω = n·Λ n and σ = N·S N, with N_a = n_a² and symmetric matrices Λ and S.
//! Because ω is quadratic in n, the dilatation is exact for every homogeneous strain, not only for the probe
//! strains.
//!
//! The loops multiply ω and σ by the influence function of the deck, as in all sums. Without the multipliers
//! this is [`Ordinary`](super::Ordinary), for unbroken families.
//!
//! A critical stretch that follows from a fracture energy is scaled to s_c √(2σ_w/(σ_i + σ_j)), with σ_w of
//! an untruncated family. This keeps the energy of breaking the bond.

use nalgebra::{DMatrix, DVector, SMatrix};

use super::ordinary::Ordinary;
use super::symmetric::{Symmetric, exponents, mixed, multiplicity, symmetric, to_entries};
use super::{
    Along, Bond, Declaration, Declared, Described, Given, Influence, Law, PlasticState, Property,
};
use crate::lanes::Lanes;

/// Smallest σ/σ₀; bonds with σ ≤ 0 would repel when stretched. At a corner of a block σ/σ₀ is 0.42.
const SMALLEST: f64 = 0.1;

/// Largest σ/σ₀. It is 1.8 at edges of a block, 12 in bars of three points, and 30 in sheets of two.
const LARGEST: f64 = 30.0;

/// Singular values below this fraction of the largest are dropped; their multipliers stay 0.
///
/// The smallest ratio is 0.08 at a corner of a block, 0.007 in a sheet of two points, and 0 in a single
/// layer.
const RANK: f64 = 5e-3;

/// Number of monomials of degree 4 in three variables.
const MONOMIALS: usize = 15;

/// Number of constants of a point in addition to Λ and S.
const OTHERS: usize = 1;

/// The constants of the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pals {
    /// The linear solid without multipliers.
    ordinary: Ordinary,
    /// Whether the critical stretch is scaled with σ, because it follows from a fracture energy.
    is_scaled: bool,
}

impl Pals {
    /// Create the law of a body with this influence function, in the plane or in space.
    pub(super) fn of(given: &Given, influence: Influence) -> Self {
        Self {
            ordinary: Ordinary::of(given, influence),
            is_scaled: given.from_fracture_energy,
        }
    }

    /// k′, Pa.
    fn bulk_modulus(&self) -> f64 {
        let d = self.ordinary.dimension();
        self.ordinary.volumetric() + self.ordinary.extensional() / (d * d)
    }

    /// σ of an untruncated family, N/m⁷.
    fn whole(&self) -> f64 {
        self.ordinary.extensional() / self.ordinary.whole()
    }
}

/// No deck name: decks write `ordinary` with `surface_correction = "pals"`.
impl Declared for Pals {
    const DECLARATIONS: &'static [Declaration] = &[];
}

impl Described for Pals {
    fn described(&self) -> Vec<(&'static str, Property)> {
        let value = "ordinary state-based, with the influence functions of each point's own family";
        vec![("forces", Property::Text(value))]
    }
}

/// Return N_a = n_a² of eight bonds.
#[inline(always)]
fn squares<const D: usize>(bond: &Bond<D>) -> [Lanes; D] {
    let inverse = bond.inverse * bond.inverse;
    bond.reference.map(|xi| xi * xi * inverse)
}

/// Return ω of eight bonds, 1/m⁵.
#[inline(always)]
fn dilatational<const D: usize>(bond: &Bond<D>, (diagonal, others): &Symmetric<D>) -> Lanes {
    let xi = &bond.reference;
    let mut sum = diagonal[0] * (xi[0] * xi[0]);
    for d in 1..D {
        sum += diagonal[d] * (xi[d] * xi[d]);
    }
    for (k, (a, b)) in mixed::<D>().enumerate() {
        sum += others[k] * (xi[a] * xi[b] * 2.0);
    }
    sum * (bond.inverse * bond.inverse)
}

/// Return σ of eight bonds, N/m⁷.
#[inline(always)]
fn deviatoric<const D: usize>(bond: &Bond<D>, tensor: &Symmetric<D>) -> Lanes {
    let square = squares(bond);
    let mut sum = Lanes::splat(0.0);
    for a in 0..D {
        let mut row = symmetric(tensor, a, 0) * square[0];
        for b in 1..D {
            row += symmetric(tensor, a, b) * square[b];
        }
        sum += row * square[a];
    }
    sum
}

/// The exponents and the coefficient of a monomial of degree 2 in the components of n or N.
type Monomial = ([usize; 3], f64);

/// A polynomial of degree 2 in the components of n or N.
type Quadratic = [Monomial];

/// Return the sum over a family of the product of two polynomials, from the sums of the monomials of degree
/// 4.
fn product(sums: &[f64], first: &Quadratic, second: &Quadratic) -> f64 {
    let mut total = 0.0;
    for (a, of_a) in first {
        for (b, of_b) in second {
            let both: [usize; 3] = std::array::from_fn(|d| a[d] + b[d]);
            let place = exponents(4).position(|one| one == both);
            total += of_a * of_b * sums[place.expect("a monomial")];
        }
    }
    total
}

/// Return the exponents of the product of two components.
fn of_product(a: usize, b: usize) -> [usize; 3] {
    let mut exponents = [0; 3];
    exponents[a] += 1;
    exponents[b] += 1;
    exponents
}

/// Result of a fit: of all functions of the direction that satisfy given sums, the one nearest to a constant.
struct Fit<const D: usize> {
    /// Matrix of the function: T in n·T n or N·T N.
    tensor: SMatrix<f64, D, D>,
    /// Sum over the family of the squared function.
    square: f64,
    /// Sum over the family of the function.
    sum: f64,
}

/// Fit the function c + Σ τ_k p_k to the conditions Σ p_l (c + Σ τ_k p_k) = wanted_l, as far as the family
/// allows.
///
/// `sums` are the sums over the family of the monomials of degree 4, in the components of n or N.
/// `one` is the polynomial of degree 2 that equals 1: n·n, or (Σ N_a)².
fn nearest<const D: usize>(
    sums: &[f64],
    constant: f64,
    one: &Quadratic,
    conditions: &[(Vec<Monomial>, f64)],
) -> Fit<D> {
    let count = conditions.len();
    let matrix = DMatrix::from_fn(count, count, |r, c| {
        product(sums, &conditions[r].0, &conditions[c].0)
    });
    let missing = DVector::from_fn(count, |r, _| {
        let (polynomial, wanted) = &conditions[r];
        wanted - constant * product(sums, polynomial, one)
    });
    // The decomposition of a matrix with NaN or infinity would not terminate.
    let multipliers = if matrix.iter().chain(missing.iter()).all(|x| x.is_finite()) {
        let decomposition = matrix.svd(true, true);
        let limit = RANK * decomposition.singular_values.max();
        decomposition.solve(&missing, limit).ok()
    } else {
        None
    };
    let multipliers = multipliers.unwrap_or_else(|| DVector::zeros(count));
    let scaled = |polynomial: &Quadratic, factor: f64| -> Vec<_> {
        let each = polynomial.iter();
        each.map(|(exponents, value)| (*exponents, value * factor))
            .collect()
    };
    let mut function = scaled(one, constant);
    for ((polynomial, _), multiplier) in conditions.iter().zip(multipliers.iter()) {
        function.extend(scaled(polynomial, *multiplier));
    }
    Fit {
        tensor: SMatrix::from_fn(|a, b| {
            let wanted = of_product(a, b);
            let terms = function
                .iter()
                .filter(|(exponents, _)| *exponents == wanted);
            terms.map(|(_, value)| value).sum::<f64>() / multiplicity(wanted)
        }),
        square: product(sums, &function, &function),
        sum: product(sums, &function, one),
    }
}

/// Return the polynomial n·n = 1; with the factor c its matrix is Λ = c I.
fn one_in_directions<const D: usize>() -> Vec<([usize; 3], f64)> {
    (0..D).map(|a| (of_product(a, a), 1.0)).collect()
}

/// Return the polynomial (Σ N_a)² = 1; with the factor c its matrix is S_ab = c.
fn one_in_squares<const D: usize>() -> Vec<([usize; 3], f64)> {
    let pairs = (0..D).flat_map(|a| (0..D).map(move |b| (a, b)));
    pairs.map(|(a, b)| (of_product(a, b), 1.0)).collect()
}

/// Fit ω with the conditions Σ |ξ|² ω n_a n_b Ṽ = δ_ab, from the sums of |ξ|² Ṽ times the monomials of n.
///
/// Mixed conditions have the weight √2, because each represents two components. Therefore the fitted function
/// rotates with the family.
fn dilatational_fit<const D: usize>(sums: &[f64], weighted_volume: f64) -> Fit<D> {
    let axes = (0..D).map(|a| (vec![(of_product(a, a), 1.0)], 1.0));
    let shears = mixed::<D>().map(|(a, b)| (vec![(of_product(a, b), 2_f64.sqrt())], 0.0));
    let conditions: Vec<_> = axes.chain(shears).collect();
    let one = one_in_directions::<D>();
    nearest(sums, D as f64 / weighted_volume, &one, &conditions)
}

/// Fit σ/σ₀ with the conditions Σ |ξ|² σ (n·dev H n)² Ṽ = 2G dev H : dev H, from the sums of |ξ|² Ṽ times the
/// monomials of N.
///
/// The probe strains H are unit strains along the axes and pure shears 1/√2 between the axes.
fn deviatoric_fit<const D: usize>(sums: &[f64], weighted_volume: f64) -> Fit<D> {
    let count = D as f64;
    let axes = (0..D).map(|k| {
        let part = |a: usize| {
            if a == k {
                1.0 - 1.0 / count
            } else {
                -1.0 / count
            }
        };
        let pairs = (0..D).flat_map(|a| (0..D).map(move |b| (a, b)));
        let square = pairs.map(|(a, b)| (of_product(a, b), part(a) * part(b)));
        (square.collect(), 1.0 - 1.0 / count)
    });
    let shears = mixed::<D>().map(|(a, b)| (vec![(of_product(a, b), 2.0)], 1.0));
    // The ratio 2G/σ₀ with σ₀ = A/m.
    let modulus = 2.0 / (count * (count + 2.0)) * weighted_volume;
    let conditions: Vec<_> = axes
        .chain(shears)
        .map(|(square, norm)| (square, norm * modulus))
        .collect();
    nearest(sums, 1.0, &one_in_squares::<D>(), &conditions)
}

/// Return the smallest and the largest N·S N over all N with N_a ≥ 0 and Σ N_a = 1. The extremes lie at a
/// corner of this triangle, on an edge or inside.
fn extremes<const D: usize>(tensor: &SMatrix<f64, D, D>) -> [f64; 2] {
    let mut values: Vec<f64> = tensor.diagonal().iter().copied().collect();
    for (a, b) in mixed::<D>() {
        // On an edge N = (t, 1 − t), so N·S N is a parabola in t.
        let [first, second, both] = [tensor[(a, a)], tensor[(b, b)], tensor[(a, b)]];
        let t = (second - both) / (first + second - 2.0 * both);
        if (0.0..=1.0).contains(&t) {
            let u = 1.0 - t;
            values.push(first * t * t + 2.0 * both * t * u + second * u * u);
        }
    }
    // At an extreme inside the triangle all components of S N are equal, and N·S N equals this component.
    if D == 3
        && let Some(inverse) = DMatrix::from_fn(D, D, |a, b| tensor[(a, b)]).try_inverse()
    {
        let rows: Vec<f64> = inverse.row_iter().map(|row| row.sum()).collect();
        let value = 1.0 / rows.iter().sum::<f64>();
        if rows.iter().all(|row| row * value >= 0.0) {
            values.push(value);
        }
    }
    let each = values.into_iter().filter(|value| value.is_finite());
    each.fold(
        [f64::INFINITY, f64::NEG_INFINITY],
        |[least, most], value| [least.min(value), most.max(value)],
    )
}

/// Limit σ/σ₀ to the range from [`SMALLEST`] to [`LARGEST`], by a factor on its difference from 1.
fn limited<const D: usize>(tensor: SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
    let [least, most] = extremes(&tensor);
    let share = |value: f64, limit: f64| {
        let beyond = (value - limit) * (limit - 1.0) > 0.0;
        if beyond {
            (limit - 1.0) / (value - 1.0)
        } else {
            1.0
        }
    };
    let share = share(least, SMALLEST).min(share(most, LARGEST));
    tensor.map(|entry| 1.0 + share * (entry - 1.0))
}

/// Return the smallest λ with k′θ² + Σ σ ε² Ṽ ≤ λ Σ σ e² Ṽ, in `d` dimensions.
///
/// In the scalar product ⟨a, b⟩ = Σ σ a b Ṽ, θ = ⟨r, e⟩ with r = ω|ξ|/σ, and ε = e − (θ/d)|ξ|.
/// The inputs are R ≥ ⟨r, r⟩, Q = ⟨|ξ|, |ξ|⟩ and τ = ⟨r, |ξ|⟩ = Σ ω|ξ|² Ṽ. These give the components of ε
/// along r and normal to r.
/// λ is the larger eigenvalue of [[k′R + (1 − τ/d)² + g², −g], [−g, 1]] with g² = (RQ − τ²)/d². λ grows with
/// R.
fn largest_ratio(bulk_modulus: f64, d: f64, [r, q, tau]: [f64; 3]) -> f64 {
    let across = (r * q - tau * tau).max(0.0) / (d * d);
    let determinant = bulk_modulus * r + (1.0 - tau / d).powi(2);
    let trace = determinant + across + 1.0;
    0.5 * (trace + (trace * trace - 4.0 * determinant).max(0.0).sqrt())
}

impl<const D: usize> Law<D> for Pals {
    /// Constants: Λ (1/m⁵), S, and a spring constant that bounds the energy (N/m⁷). Then k′θ − (1/d) Σ σ|ξ| ε
    /// Ṽ (Pa) and θ/d.
    type Point = ((Symmetric<D>, Symmetric<D>), [Lanes; OTHERS + 2]);
    type BondHistory = [Lanes; 0];
    /// Sums of |ξ|² Ṽ times the monomials of degree 4 of n, then of N, m⁵.
    type ReferenceSum = [Lanes; 2 * MONOMIALS];
    /// θ, Σ σ|ξ| e Ṽ and Σ σ|ξ|² Ṽ (Pa) over the intact bonds.
    type Sum = [Lanes; 3];
    type Force = Along;
    const CONSTANTS: usize = 4 * D + OTHERS;
    const PASSES: usize = 1;
    const LEAST_DIMENSION: usize = 2;
    /// θ.
    const OWN_NUMBERS: usize = 1;
    const SUM_READS_DIRECTION: bool = true;
    const SCALED: bool = true;

    #[inline(always)]
    fn reference_contribution(&self, bond: &Bond<D>) -> Self::ReferenceSum {
        let mut sums = [Lanes::splat(0.0); 2 * MONOMIALS];
        let directions = bond.reference.map(|xi| xi * bond.inverse);
        let bases = [directions, squares(bond)];
        for (sums, base) in sums.chunks_mut(MONOMIALS).zip(bases) {
            for (sum, exponents) in sums.iter_mut().zip(exponents(4)) {
                if exponents[D..].iter().any(|exponent| *exponent > 0) {
                    continue;
                }
                *sum = bond.length * bond.length;
                for d in 0..D {
                    for _ in 0..exponents[d] {
                        *sum = *sum * base[d];
                    }
                }
            }
        }
        sums
    }

    fn constants(&self, sums: &[f64], numbers: &mut [f64]) {
        let (of_directions, of_squares) = sums.split_at(MONOMIALS);
        let weighted_volume = weighted_volume::<D>(sums);
        // The point has no bonds.
        if weighted_volume <= 0.0 {
            return;
        }
        let reference = self.ordinary.extensional() / weighted_volume;
        let omega = dilatational_fit::<D>(of_directions, weighted_volume);
        let sigma = limited(deviatoric_fit::<D>(of_squares, weighted_volume).tensor);
        to_entries(&omega.tensor, numbers);
        to_entries(&(sigma * reference), &mut numbers[2 * D..]);
        let [least, most] = extremes(&sigma).map(|value| value * reference);
        // The sum Σ σ|ξ|² Ṽ.
        let square = {
            let pairs = (0..D).flat_map(|a| (0..D).map(move |b| (a, b)));
            let polynomial: Vec<_> = pairs
                .map(|(a, b)| (of_product(a, b), sigma[(a, b)] * reference))
                .collect();
            product(of_squares, &polynomial, &one_in_squares::<D>())
        };
        let products = [omega.square / least, square, omega.sum];
        numbers[4 * D] = most * largest_ratio(self.bulk_modulus(), D as f64, products);
    }

    #[inline(always)]
    fn pass_contribution<const S: usize>(
        &self,
        bond: &Bond<D>,
        ((omega, sigma), _): &Self::Point,
        _: &[Lanes; 0],
    ) -> [Lanes; 3] {
        let square = bond.length * bond.length;
        let extension = square * bond.stretch;
        let sigma = deviatoric(bond, sigma);
        [
            dilatational(bond, omega) * extension,
            sigma * extension,
            sigma * square,
        ]
    }

    #[inline(always)]
    fn update_point(&self, _: usize, sums: &[f64], numbers: &mut [f64], _: &mut PlasticState) {
        let d = self.ordinary.dimension();
        let [dilatation, extension, square] = [sums[0], sums[1], sums[2]];
        let mean = dilatation / d;
        let changing = &mut numbers[4 * D + OTHERS..];
        changing[0] = self.bulk_modulus() * dilatation - (extension - mean * square) / d;
        changing[1] = mean;
        changing[2] = dilatation;
    }

    /// t/|Y|, with |ξ|/|Y| = 1 − P and e/|Y| = P.
    #[inline(always)]
    fn force(
        &self,
        bond: &Bond<D>,
        ((omega, sigma), [_, pressure, mean]): &Self::Point,
        _: &[Lanes; 0],
    ) -> Along {
        let shortening = Lanes::splat(1.0) - bond.extension_over_deformed;
        let deviatoric =
            deviatoric(bond, sigma) * (bond.extension_over_deformed - *mean * shortening);
        Along(dilatational(bond, omega) * (*pressure * shortening) + deviatoric)
    }

    #[inline(always)]
    fn bond_energy(
        &self,
        bond: &Bond<D>,
        ((_, sigma), [_, _, mean]): &Self::Point,
        _: &[Lanes; 0],
    ) -> Lanes {
        let extension = bond.length * (bond.stretch - *mean);
        extension * extension * deviatoric(bond, sigma) * 0.5
    }

    fn point_energy(&self, numbers: &[f64]) -> f64 {
        let dilatation = numbers[4 * D + OTHERS + 2];
        0.5 * self.bulk_modulus() * dilatation * dilatation
    }

    fn dilatation(&self, numbers: &[f64]) -> Option<f64> {
        Some(numbers[4 * D + OTHERS + 2])
    }

    fn truncation_factor(&self, sums: &[f64]) -> f64 {
        self.ordinary
            .truncation_factor_of(weighted_volume::<D>(sums))
    }

    #[inline(always)]
    fn stiffness(&self, _: Lanes, (_, [stiffness, ..]): &Self::Point) -> Lanes {
        *stiffness
    }

    #[inline(always)]
    fn toughness_scale(
        &self,
        bond: &Bond<D>,
        [(here, _), (there, _)]: [&Self::Point; 2],
        other: &Self,
    ) -> Lanes {
        if !self.is_scaled || !other.is_scaled {
            return Lanes::splat(1.0);
        }
        let both = deviatoric(bond, &here.1) + deviatoric(bond, &there.1);
        (Lanes::splat(self.whole() + other.whole()) / both).sqrt()
    }
}

/// Weighted volume Σ |ξ|² Ṽ, m⁵.
fn weighted_volume<const D: usize>(sums: &[f64]) -> f64 {
    let one = one_in_directions::<D>();
    product(&sums[..MONOMIALS], &one, &one)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, SymmetricEigen, Vector3};

    /// Neighbours of unit volume on a cubic lattice, within a distance of 3, that fulfil a condition.
    fn family(kept: impl Fn([i32; 3]) -> bool) -> Vec<Vector3<f64>> {
        let all =
            (-3..=3).flat_map(|x| (-3..=3).flat_map(move |y| (-3..=3).map(move |z| [x, y, z])));
        let near =
            all.filter(|offset| (1..=9).contains(&offset.iter().map(|x| x * x).sum::<i32>()));
        let kept = near.filter(|offset| kept(*offset));
        kept.map(|offset| Vector3::from(offset.map(f64::from)))
            .collect()
    }

    fn sums(family: &[Vector3<f64>]) -> [f64; 2 * MONOMIALS] {
        let mut sums = [0.0; 2 * MONOMIALS];
        for xi in family {
            let n = xi / xi.norm();
            let bases = [n, n.component_mul(&n)];
            for (sums, base) in sums.chunks_mut(MONOMIALS).zip(bases) {
                for (sum, exponents) in sums.iter_mut().zip(exponents(4)) {
                    let powers = (0..3).map(|d| base[d].powi(exponents[d] as i32));
                    *sum += xi.norm_squared() * powers.product::<f64>();
                }
            }
        }
        sums
    }

    fn law() -> Pals {
        let elastic = crate::elastic::Isotropic {
            youngs_modulus: 5.0,
            poisson_ratio: 0.4,
        };
        Pals {
            ordinary: Ordinary::new(crate::dimension::Dimension::Space, elastic, 600.0)
                .expect("a law in space"),
            is_scaled: false,
        }
    }

    /// Return ω and σ of the bonds, and the spring constant.
    fn functions(family: &[Vector3<f64>]) -> (Vec<[f64; 2]>, f64) {
        let mut numbers = [0.0; 16];
        Law::<3>::constants(&law(), &sums(family), &mut numbers);
        let tensor = |entries: &[f64]| super::super::symmetric::from_entries::<3>(entries);
        let [omega, sigma] = [tensor(&numbers[..6]), tensor(&numbers[6..12])];
        let of_bond = |xi: &Vector3<f64>| {
            let n = xi / xi.norm();
            let square = n.component_mul(&n);
            [n.dot(&(omega * n)), square.dot(&(sigma * square))]
        };
        (family.iter().map(of_bond).collect(), numbers[12])
    }

    #[test]
    fn at_a_surface_probe_strains_have_their_dilatation_and_energy() {
        let shear = 5.0 / 2.8;
        for (name, family) in [
            ("whole", family(|_| true)),
            ("half", family(|[x, ..]| x >= 0)),
            ("edge", family(|[x, y, _]| x >= 0 && y >= 0)),
            ("corner", family(|[x, y, z]| x >= 0 && y >= 0 && z >= 0)),
            ("oblique", family(|[x, y, z]| 2 * x + y - 3 * z >= 0)),
            (
                "bar",
                family(|[x, y, _]| (0..3).contains(&x) && (-1..2).contains(&y)),
            ),
        ] {
            let (functions, _) = functions(&family);
            let mut least = f64::INFINITY;
            for probe in 0..6 {
                let mut strain = Matrix3::zeros();
                match probe {
                    0..3 => strain[(probe, probe)] = 1.0,
                    _ => {
                        let (a, b) = mixed::<3>().nth(probe - 3).expect("three");
                        (strain[(a, b)], strain[(b, a)]) = (0.5, 0.5);
                    }
                }
                let part = strain - Matrix3::identity() * (strain.trace() / 3.0);
                let (mut dilatation, mut energy) = (0.0, 0.0);
                for (xi, [omega, sigma]) in family.iter().zip(&functions) {
                    let along = |tensor: &Matrix3<f64>| xi.dot(&(tensor * xi)) / xi.norm();
                    dilatation += omega * xi.norm() * along(&strain);
                    energy += sigma * along(&part).powi(2);
                    least = least.min(*sigma);
                }
                assert!(
                    (dilatation - strain.trace()).abs() < 1e-9,
                    "{name}: {dilatation}"
                );
                let wanted = 2.0 * shear * part.norm_squared();
                assert!(
                    (energy / wanted - 1.0).abs() < 1e-9,
                    "{name} {probe}: {energy} {wanted}"
                );
            }
            assert!(least > 0.0, "{name}: {least}");
        }
    }

    /// The spring constant uses the extremes of σ over all bonds. Without volume correction, σ varies by a
    /// factor of two even in an untruncated family.
    #[test]
    fn the_spring_constant_bounds_the_energy() {
        let law = law();
        for (name, family, most) in [
            ("whole", family(|_| true), 2.5),
            ("half", family(|[x, ..]| x >= 0), 2.7),
            (
                "corner",
                family(|[x, y, z]| x >= 0 && y >= 0 && z >= 0),
                2.1,
            ),
            (
                "bar",
                family(|[x, y, _]| (0..2).contains(&x) && (0..2).contains(&y)),
                90.0,
            ),
            ("sheet", family(|[.., z]| z == 0), 1.7),
        ] {
            let (functions, bound) = functions(&family);
            // Matrix A of 2W = e·A e.
            let count = family.len();
            let mut matrix = DMatrix::zeros(count, count);
            let lengths = DVector::from_iterator(count, family.iter().map(|xi| xi.norm()));
            let omega = DVector::from_iterator(count, functions.iter().map(|[omega, _]| *omega));
            let dilatation = lengths.component_mul(&omega);
            matrix += &dilatation * dilatation.transpose() * law.bulk_modulus();
            let deviatoric =
                DMatrix::identity(count, count) - &lengths * dilatation.transpose() / 3.0;
            let sigma = DVector::from_iterator(count, functions.iter().map(|[_, sigma]| *sigma));
            matrix += deviatoric.transpose() * DMatrix::from_diagonal(&sigma) * deviatoric;
            let largest = SymmetricEigen::new(matrix).eigenvalues.max();
            assert!(
                bound >= largest * (1.0 - 1e-12),
                "{name}: {bound} {largest}"
            );
            assert!(bound <= most * largest, "{name}: {bound} {largest}");
        }
    }

    #[test]
    fn extremes_are_those_of_a_fine_grid() {
        for entries in [
            [1.0, 2.0, 3.0, 0.5, -0.4, 0.2],
            [1.0, 1.0, 1.0, 3.0, 2.0, 2.5],
            [2.0, 1.0, 1.5, 0.1, 0.2, -0.9],
            [1.0, 1.0, 1.0, 1.0, 1.0, 1.0],
        ] {
            let tensor = super::super::symmetric::from_entries::<3>(&entries);
            let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
            let count = 300;
            for a in 0..=count {
                for b in 0..=count - a {
                    let n =
                        Vector3::new(a, b, count - a - b).map(|k| f64::from(k) / f64::from(count));
                    let value = n.dot(&(tensor * n));
                    (least, most) = (least.min(value), most.max(value));
                }
            }
            let [exact_least, exact_most] = extremes(&tensor);
            assert!(
                (exact_least - least).abs() < 1e-4,
                "{entries:?}: {exact_least} {least}"
            );
            assert!(
                (exact_most - most).abs() < 1e-4,
                "{entries:?}: {exact_most} {most}"
            );
        }
    }
}
