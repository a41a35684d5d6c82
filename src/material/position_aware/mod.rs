//! Position-aware linear solid: an ordinary state-based solid with influence functions fitted to each point's
//! own family.
//!
//! Mitchell, Silling & Littlewood 2015 (PALS). The law has two influence functions per bond: ω for the
//! dilatation θ, and σ for the deviatoric extension ε. With the extension e = |Y| − |ξ|, the corrected volume
//! Ṽ of the neighbour and the strain energy density W,
//!
//! θ = Σ ω|ξ| e Ṽ, ε = e − θ|ξ|/d, W = ½ k′θ² + ½ Σ σ ε² Ṽ,
//!
//! t = (k′θ − (1/d) Σ σ|ξ| ε Ṽ) ω|ξ| + σ ε,
//!
//! where d is the number of dimensions, and t is the force state along the bond. k′, A and m are those of
//! [`Ordinary`].
//!
//! At a small homogeneous strain H, a bond of direction n has e = |ξ| n·H n. The probe strains H are unit
//! extensions along the axes and shears between the axes. In an untruncated family of the continuum, ω and σ
//! satisfy for each H
//!
//! Σ ω|ξ| e Ṽ = tr H, Σ σ ε² Ṽ = 2G dev H : dev H.
//!
//! The functions of [`Ordinary`] are ω₀ = d/m and σ₀ = A/m. The [`Form`] of ω and σ determines how they are
//! fitted to these conditions. With ω = ω₀ and σ = σ₀ the law is [`Ordinary`], as long as no bond of the
//! family is broken. In all sums, the term of each bond is also multiplied by the influence function of the
//! deck. Therefore the loops over bonds multiply ω and σ by this function.
//!
//! A critical stretch s_c that follows from a fracture energy is scaled to s_c √(2σ_w/(σ_i + σ_j)). Here σ_w
//! is σ of an untruncated family. Breaking the bond then takes the same energy as in an untruncated family.

mod conditions;
mod directional;
mod nearest;
mod plastic;
mod viscoelastic;

pub use plastic::PositionAwarePlastic;
pub use viscoelastic::PositionAwareViscoelastic;

use nalgebra::SMatrix;

use super::monomials::write_monomials;
use super::ordinary::{Ordinary, SURFACE_CORRECTION};
use super::symmetric::{Symmetric, quadratic_form, quadratic_form_of, to_entries};
use super::{
    Along, Bond, Declaration, Declared, Described, Given, Influence, Law, PlasticState, Property,
    ellipsoid,
};
use crate::lanes::Lanes;
use conditions::{Conditions, weighted_volume};

/// Number of monomials of degree 4 in three variables.
const MONOMIALS: usize = 15;

/// Number of constants of a point in addition to the tensors of ω and σ.
const OTHERS: usize = 1;

/// The functions ω and σ of a point.
pub struct Fit<const D: usize> {
    /// Tensor that determines ω.
    omega: SMatrix<f64, D, D>,
    /// Tensor that determines σ.
    sigma: SMatrix<f64, D, D>,
    /// R, Q and τ of [`largest_ratio`].
    products: [f64; 3],
}

/// Form of the functions ω and σ. The form is a field of the law, not a type parameter. Selecting it at run
/// time costs up to 5 % of the speed. With a type parameter, each form would have its own copy of all loops,
/// which would increase the build time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    /// The functions of [`nearest`]; `surface_correction = "pals"`.
    Nearest,
    /// The functions of [`directional`]; `surface_correction = "directional"`.
    Directional,
}

impl Form {
    /// Return the diagonal entries of the tensors of ω and σ, for a point that has no bonds within its own
    /// horizon. These entries make ω and σ nearly 0.
    fn without_bonds(self) -> f64 {
        match self {
            Self::Nearest => 0.0,
            Self::Directional => ellipsoid::WITHOUT_BONDS,
        }
    }

    /// Fit ω to `conditions[0]` and σ to `conditions[1]`. `sums[0]` are the sums of |ξ|² Ṽ times the
    /// monomials of degree 4 in the components of the bond direction n. `sums[1]` are the same sums with N
    /// instead of n, where N_a = n_a². `reference` is σ₀, N/m⁷.
    fn fit<const D: usize>(
        self,
        sums: [&[f64]; 2],
        conditions: [&Conditions<D>; 2],
        reference: f64,
    ) -> Fit<D> {
        match self {
            Self::Nearest => nearest::fit(sums, conditions, reference),
            Self::Directional => directional::fit(sums, conditions, reference),
        }
    }

    /// Return ω (1/m⁵) and σ (N/m⁷) of eight bonds.
    #[inline(always)]
    fn of_bonds<const D: usize>(self, bond: &Bond<D>, (omega, sigma): &Functions<D>) -> [Lanes; 2] {
        // The quadratic form is computed before the `match`. The compiler can then compute its products of
        // bond components once for both ends of a bond.
        let form_of_omega = quadratic_form(bond, omega);
        let omega = match self {
            Self::Nearest => form_of_omega,
            Self::Directional => ellipsoid::radius_of(form_of_omega),
        };
        [omega, self.sigma(bond, sigma)]
    }

    /// Return σ of eight bonds, N/m⁷.
    #[inline(always)]
    fn sigma<const D: usize>(self, bond: &Bond<D>, sigma: &Symmetric<D>) -> Lanes {
        let squares = squares(bond);
        match self {
            Self::Nearest => quadratic_form_of(&squares, sigma),
            Self::Directional => ellipsoid::radius(bond, sigma),
        }
    }
}

/// The constants of the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionAware {
    /// The linear solid with ω = ω₀ and σ = σ₀.
    ordinary: Ordinary,
    /// Whether the critical stretch follows from a fracture energy, and is therefore scaled with σ.
    is_scaled: bool,
    form: Form,
}

impl PositionAware {
    /// Create the law of a 2-D or 3-D body with a surface correction and the given influence function.
    pub(super) fn of(given: &Given, influence: Influence) -> Self {
        let is_nearest = given.values.word(SURFACE_CORRECTION.name) == "pals";
        Self {
            ordinary: Ordinary::of(given, influence),
            is_scaled: given.from_fracture_energy,
            form: if is_nearest {
                Form::Nearest
            } else {
                Form::Directional
            },
        }
    }

    /// Return k′, Pa.
    fn bulk_modulus(&self) -> f64 {
        let d = self.ordinary.dimension();
        self.ordinary.volumetric() + self.ordinary.extensional() / (d * d)
    }

    /// Return σ of an untruncated family, N/m⁷.
    fn untruncated_sigma(&self) -> f64 {
        self.ordinary.extensional() / self.ordinary.untruncated_weighted_volume()
    }

    /// Return k′θ − (1/d) Σ σ|ξ| ε Ṽ (Pa), θ/d and θ, from the sums of [`Law::pass_contribution`].
    fn dilated(&self, sums: &[f64]) -> [f64; 3] {
        let d = self.ordinary.dimension();
        let [dilatation, extension, square] = [sums[0], sums[1], sums[2]];
        let mean = dilatation / d;
        let pressure = self.bulk_modulus() * dilatation - (extension - mean * square) / d;
        [pressure, mean, dilatation]
    }

    /// Return the energy density of the dilatation, ½ k′θ², J/m³.
    fn dilatation_energy(&self, dilatation: f64) -> f64 {
        0.5 * self.bulk_modulus() * dilatation * dilatation
    }
}

/// The law has no name of its own in decks. Decks select it with `ordinary` and a `surface_correction`.
impl Declared for PositionAware {
    const DECLARATIONS: &'static [Declaration] = &[];
}

impl Described for PositionAware {
    fn described(&self) -> Vec<(&'static str, Property)> {
        let value = "ordinary state-based, with the influence functions of each point's own family";
        vec![("forces", Property::Text(value))]
    }
}

/// The tensors of a point that determine ω and σ.
type Functions<const D: usize> = (Symmetric<D>, Symmetric<D>);

/// Return an upper bound of the smallest λ with k′θ² + Σ σ ε² Ṽ ≤ λ Σ σ e² Ṽ for all extensions e, in `d`
/// dimensions.
///
/// Let ⟨a, b⟩ = Σ σ a b Ṽ be a scalar product. Then θ = ⟨r, e⟩ with r = ω|ξ|/σ, and ε = e − (θ/d)|ξ|. The
/// inputs are R ≥ ⟨r, r⟩, Q ≥ ⟨|ξ|, |ξ|⟩ and τ ≤ ⟨r, |ξ|⟩ = Σ ω|ξ|² Ṽ. Let e₁ be the component of e along r.
/// Let e₂ be the component of e normal to r, in the plane of r and |ξ|. Let R, Q and τ equal the three scalar
/// products. Then ε has the component (1 − τ/d) e₁ along r and the component e₂ − g e₁ normal to r, with
/// g² = (RQ − τ²)/d². In this case, λ is the larger eigenvalue of [[k′R + (1 − τ/d)² + g², −g], [−g, 1]].
/// Because λ ≥ 1, this eigenvalue grows with R and Q and decreases with τ. It is therefore an upper bound if
/// the inputs are bounds.
fn largest_ratio(bulk_modulus: f64, d: f64, [r, q, tau]: [f64; 3]) -> f64 {
    let across = (r * q - tau * tau).max(0.0) / (d * d);
    let determinant = bulk_modulus * r + (1.0 - tau / d).powi(2);
    let trace = determinant + across + 1.0;
    0.5 * (trace + (trace * trace - 4.0 * determinant).max(0.0).sqrt())
}

/// Return N_a = n_a² of eight bonds.
#[inline(always)]
fn squares<const D: usize>(bond: &Bond<D>) -> [Lanes; D] {
    let inverse = bond.inverse * bond.inverse;
    let mut squares = [Lanes::splat(0.0); D];
    // `bond.reference.map(…)` would be slower: see the rules for loops in docs/src/developers/performance.md.
    for (square, xi) in squares.iter_mut().zip(&bond.reference) {
        *square = *xi * *xi * inverse;
    }
    squares
}

impl<const D: usize> Law<D> for PositionAware {
    /// Constants: the tensors of ω and σ, and a number λ with W ≤ ½ λ Σ σ e² Ṽ. Numbers that are
    /// recomputed before each force evaluation: k′θ − (1/d) Σ σ|ξ| ε Ṽ (Pa) and θ/d.
    type Point = (Functions<D>, [Lanes; OTHERS + 2]);
    type BondHistory = [Lanes; 0];
    /// Sums (m⁵) of |ξ|² Ṽ times each monomial of degree 4. The monomials are first those of n, then those of
    /// the squares N_a = n_a².
    type ReferenceSum = [Lanes; 2 * MONOMIALS];
    /// θ, Σ σ|ξ| e Ṽ (Pa) and Σ σ|ξ|² Ṽ (Pa), all over the intact bonds.
    type Sum = [Lanes; 3];
    type Force = Along;
    const CONSTANTS: usize = 4 * D + OTHERS;
    const PASSES: usize = 1;
    const LEAST_DIMENSION: usize = 2;
    /// The only own number of a point is the dilatation θ.
    const OWN_NUMBERS: usize = 1;
    const SUM_READS_DIRECTION: bool = true;
    const SCALED: bool = true;

    #[inline(always)]
    fn reference_contribution(&self, bond: &Bond<D>) -> Self::ReferenceSum {
        let mut sums = [Lanes::splat(0.0); 2 * MONOMIALS];
        let directions = bond.reference.map(|xi| xi * bond.inverse);
        let bases = [directions, squares(bond)];
        for (sums, base) in sums.chunks_mut(MONOMIALS).zip(bases) {
            write_monomials(4, base, bond.length * bond.length, sums);
        }
        sums
    }

    fn constants(&self, sums: &[f64], numbers: &mut [f64]) {
        let (of_directions, of_squares) = sums.split_at(MONOMIALS);
        let weighted_volume = weighted_volume::<D>(of_directions);
        // True for a point without bonds.
        if weighted_volume <= 0.0 {
            let nothing = SMatrix::<f64, D, D>::identity() * self.form.without_bonds();
            to_entries(&nothing, numbers);
            to_entries(&nothing, &mut numbers[2 * D..]);
            return;
        }
        let reference = self.ordinary.extensional() / weighted_volume;
        let conditions = [
            &Conditions::dilatational(weighted_volume),
            &Conditions::deviatoric(weighted_volume),
        ];
        let fit = self
            .form
            .fit::<D>([of_directions, of_squares], conditions, reference);
        to_entries(&fit.omega, numbers);
        to_entries(&fit.sigma, &mut numbers[2 * D..]);
        numbers[4 * D] = largest_ratio(self.bulk_modulus(), D as f64, fit.products);
    }

    #[inline(always)]
    fn pass_contribution<const S: usize>(
        &self,
        bond: &Bond<D>,
        (functions, _): &Self::Point,
        _: &[Lanes; 0],
    ) -> [Lanes; 3] {
        let square = bond.length * bond.length;
        let extension = square * bond.stretch;
        let [omega, sigma] = self.form.of_bonds(bond, functions);
        [omega * extension, sigma * extension, sigma * square]
    }

    #[inline(always)]
    fn update_point(
        &self,
        _: usize,
        sums: &[f64],
        numbers: &mut [f64],
        _: &mut PlasticState,
        _: f64,
    ) {
        let changing = &mut numbers[4 * D + OTHERS..];
        changing[..3].copy_from_slice(&self.dilated(sums));
    }

    /// Return t/|Y|. With P = `extension_over_deformed`: |ξ|/|Y| = 1 − P and e/|Y| = P.
    #[inline(always)]
    fn force_state(
        &self,
        bond: &Bond<D>,
        (functions, [_, pressure, mean]): &Self::Point,
        _: &[Lanes; 0],
    ) -> Along {
        let shortening = Lanes::splat(1.0) - bond.extension_over_deformed;
        let [omega, sigma] = self.form.of_bonds(bond, functions);
        let deviatoric = sigma * (bond.extension_over_deformed - *mean * shortening);
        Along(omega * (*pressure * shortening) + deviatoric)
    }

    #[inline(always)]
    fn bond_energy(
        &self,
        bond: &Bond<D>,
        (functions, [_, _, mean]): &Self::Point,
        _: &[Lanes; 0],
    ) -> Lanes {
        let extension = bond.length * (bond.stretch - *mean);
        extension * extension * self.form.sigma(bond, &functions.1) * 0.5
    }

    fn point_energy(&self, numbers: &[f64]) -> f64 {
        self.dilatation_energy(numbers[4 * D + OTHERS + 2])
    }

    fn dilatation(&self, numbers: &[f64]) -> Option<f64> {
        Some(numbers[4 * D + OTHERS + 2])
    }

    fn truncation_factor(&self, sums: &[f64]) -> f64 {
        self.ordinary
            .truncation_factor_of(weighted_volume::<D>(&sums[..MONOMIALS]))
    }

    #[inline(always)]
    fn stiffness(&self, bond: &Bond<D>, (functions, [ratio, ..]): &Self::Point) -> Lanes {
        self.form.sigma(bond, &functions.1) * *ratio
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
        let both = self.form.sigma(bond, &here.1) + other.form.sigma(bond, &there.1);
        (Lanes::splat(self.untruncated_sigma() + other.untruncated_sigma()) / both).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::super::monomials::exponents;
    use super::super::symmetric::mixed;
    use super::*;
    use nalgebra::{DMatrix, DVector, Matrix3, SymmetricEigen, Vector3};

    /// Return the reference vectors of the family of a point on a cubic lattice, without the vectors for
    /// which `kept` is false. The spacing is 1, the horizon is 3, and the volume of each neighbour is 1.
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

    fn law(form: Form) -> PositionAware {
        let elastic = crate::elastic::Isotropic {
            youngs_modulus: 5.0,
            poisson_ratio: 0.4,
        };
        PositionAware {
            ordinary: Ordinary::new(crate::dimension::Dimension::Space, elastic, 600.0)
                .expect("a law in space"),
            is_scaled: false,
            form,
        }
    }

    /// Return eight equal undeformed bonds.
    fn bond(xi: &Vector3<f64>) -> Bond<3> {
        let nothing = Lanes::splat(0.0);
        let reference = [xi.x, xi.y, xi.z].map(Lanes::splat);
        Bond {
            reference,
            length: Lanes::splat(xi.norm()),
            inverse: Lanes::splat(1.0 / xi.norm()),
            relative_square_extension: nothing,
            stretch: nothing,
            extension_over_deformed: nothing,
            eta: [nothing; 3],
            deformed: reference,
            beyond_series: 0,
        }
    }

    /// Return ω and σ of all bonds of a point with the family `family`, and λ of this point.
    fn functions(form: Form, family: &[Vector3<f64>]) -> (Vec<[f64; 2]>, f64) {
        functions_of(form, family, family)
    }

    /// Return ω and σ of `bonds` at a point with the family `family`, and λ of this point.
    fn functions_of(
        form: Form,
        family: &[Vector3<f64>],
        bonds: &[Vector3<f64>],
    ) -> (Vec<[f64; 2]>, f64) {
        let mut numbers = [0.0; 16];
        Law::<3>::constants(&law(form), &sums(family), &mut numbers);
        let [omega, sigma] = [0, 6].map(|first| -> Symmetric<3> {
            let entry = |k: usize| Lanes::splat(numbers[first + k]);
            ([0, 1, 2].map(entry), [3, 4, 5].map(entry))
        });
        let of_bond = |xi: &Vector3<f64>| {
            let bond = bond(xi);
            form.of_bonds(&bond, &(omega, sigma))
                .map(|lanes| lanes.0[0])
        };
        (bonds.iter().map(of_bond).collect(), numbers[12])
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
            let (functions, _) = functions(Form::Nearest, &family);
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

    /// A point without bonds within its own horizon contributes nothing to a bond from a point with a larger
    /// horizon: its σ is 0. The critical stretch s_c √(2σ_w/(σ_i + σ_j)) of this bond is therefore √2 times
    /// that of a bond with the same σ at both ends.
    #[test]
    fn points_without_bonds_have_no_share() {
        for functions in [
            functions_of(Form::Nearest, &[], &family(|_| true)),
            functions_of(Form::Directional, &[], &family(|_| true)),
        ] {
            let of_ordinary = law(Form::Nearest).untruncated_sigma();
            for [omega, sigma] in functions.0 {
                assert!((0.0..1e-100).contains(&omega), "{omega}");
                assert!((0.0..1e-100 * of_ordinary).contains(&sigma), "{sigma}");
            }
        }
    }

    /// Check the upper bound λ. It must be at least the largest eigenvalue of the energy, and at most `most`
    /// times this eigenvalue.
    fn check_bound(form: Form, name: &str, family: &[Vector3<f64>], most: f64) {
        let law = law(form);
        let (functions, bound) = functions(form, family);
        // Matrix A of 2W = e·A e, with the vector e of all extensions.
        let count = family.len();
        let mut matrix = DMatrix::zeros(count, count);
        let lengths = DVector::from_iterator(count, family.iter().map(|xi| xi.norm()));
        let omega = DVector::from_iterator(count, functions.iter().map(|[omega, _]| *omega));
        let dilatation = lengths.component_mul(&omega);
        matrix += &dilatation * dilatation.transpose() * law.bulk_modulus();
        let deviatoric = DMatrix::identity(count, count) - &lengths * dilatation.transpose() / 3.0;
        let sigma = DVector::from_iterator(count, functions.iter().map(|[_, sigma]| *sigma));
        matrix += deviatoric.transpose() * DMatrix::from_diagonal(&sigma) * deviatoric;
        // λ is at least the largest eigenvalue of A in the scalar product of the weights σ.
        let root = DMatrix::from_diagonal(&sigma.map(|value| value.sqrt().recip()));
        let largest = SymmetricEigen::new(&root * matrix * &root)
            .eigenvalues
            .max();
        let case = format!("{name}: {bound} {largest}");
        assert!(bound >= largest * (1.0 - 1e-12), "{case}");
        assert!(bound <= most * largest, "{case}");
    }

    /// The upper bound λ is loose for PALS, because λ is computed with the smallest σ over all directions.
    /// Without volume correction, σ of PALS varies by a factor of two even in an untruncated family.
    #[test]
    fn the_spring_constants_bound_the_energy() {
        for (name, family, pals, directional) in [
            ("whole", family(|_| true), 2.5, 1.01),
            ("half", family(|[x, ..]| x >= 0), 2.7, 1.2),
            (
                "corner",
                family(|[x, y, z]| x >= 0 && y >= 0 && z >= 0),
                2.1,
                1.01,
            ),
            (
                "bar",
                family(|[x, y, _]| (0..2).contains(&x) && (0..2).contains(&y)),
                90.0,
                7.0,
            ),
            ("sheet", family(|[.., z]| z == 0), 1.7, 1.5),
        ] {
            check_bound(Form::Nearest, name, &family, pals);
            check_bound(Form::Directional, name, &family, directional);
        }
    }
}
