//! Correspondence: a classical stress at each point, from the deformation gradient of its family.
//!
//! Silling et al. 2007, §18; Willberg, Hesse & Heinecke 2022, eq. 6–15.
//! The shape tensor is K = Σ ω ξ⊗ξ Ṽ, the displacement gradient is H = (Σ ω η⊗ξ Ṽ) K⁻¹, and the deformation
//! gradient is F = I + H. The sums are over the intact bonds.
//! With a first Piola–Kirchhoff stress P(F), the force state is
//!
//! T⟨ξ⟩ = ω P K⁻¹ ξ + ω B z, z = η − H ξ.
//!
//! z is the part of η that does not change F (a zero-energy mode). ω B z is the force state of the
//! zero-energy control, with the matrix B of the point ([`Control`]). The loops use T⟨ξ⟩ = ω (A ξ + B η) with
//! A = P K⁻¹ − B H. The strain energy density is W(F) + ½ Σ ω z·B z Ṽ = W(F) − ½ P : H + ½ Σ T·η Ṽ, because
//! Σ ω z⊗ξ Ṽ = 0.
//!
//! If a body yields ([`Plastic`]), P depends on F and on the plastic state of the point. B is then multiplied
//! by a factor s, which decreases as plastic flow proceeds ([`Plastic::control_left`]). Without this factor,
//! the control would stay elastic and carry load that the yielding solid cannot carry. When s changes by Δs,
//! the control dissipates the energy −Δs · ½ Σ ω z·B z Ṽ. In this energy, B is the matrix before the
//! multiplication by s.

mod bond_associated;
mod control;
mod family;
mod hooke;
mod johnson_cook;
mod logarithmic;
mod plastic;
mod stress;
mod tensor;

use nalgebra::SMatrix;

use super::bond::Weights;
use super::symmetric::{Symmetric, symmetric, to_entries};
use super::{
    Bond, Built, Counts, Declaration, Declared, Described, FamilyStress, ForceState, Given,
    Influence, Invariants, Key, Kind, Law, PlasticState, Property, Rotation, Values, Word,
};
use crate::lanes::{LaneTuple, Lanes, Simd};
pub use bond_associated::BondAssociated;
use control::Control;
pub use family::{FamilyShare, ShapeTensor, determinant, family_share};
use family::{extremes, family_rotation, from_rows, shape_share, to_rows};
use hooke::Hooke;
pub use logarithmic::eigenvalues;
use plastic::Plastic;
use stress::Stress;

/// The constants of the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Correspondence {
    response: Response,
    /// Largest modulus of the solid, [`Stress::largest_modulus`], Pa.
    modulus: f64,
    control: Control,
    /// Trace of the shape tensor of an untruncated family, m⁵.
    untruncated_trace: f64,
}

/// Dependence of the stress on the deformation gradient.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(
    clippy::large_enum_variant,
    reason = "there is one per law, not one per point"
)]
enum Response {
    Elastic(Stress),
    Plastic(Plastic),
}

const STRESS: Key = Key {
    name: "stress",
    meaning: "how stress follows from the deformation gradient F: S = C:E (\"st-venant-kirchhoff\"), C:E \
              taken for the Cauchy stress (\"willberg2022\", for small rotations), or a compressible \
              solid of large strains (\"neo-hooke\")",
    kind: Kind::Word(&[
        Word::new("st-venant-kirchhoff"),
        Word::new("willberg2022"),
        Word::new("neo-hooke"),
    ]),
};

const KEYS: &[Key] = hooke::keys_with_hooke![
    STRESS,
    plastic::YIELD_STRESS,
    plastic::HARDENING,
    johnson_cook::EXPONENT,
    johnson_cook::RATE_COEFFICIENT,
    johnson_cook::REFERENCE_RATE,
    johnson_cook::SOFTENING_EXPONENT,
    johnson_cook::MELTING_TEMPERATURE,
    johnson_cook::INITIAL_TEMPERATURE,
    johnson_cook::HEAT_CAPACITY,
    johnson_cook::TAYLOR_QUINNEY,
    plastic::STRAIN_MEASURE,
    control::KIND,
    control::COEFFICIENT,
];

impl Declared for Correspondence {
    const DECLARATIONS: &'static [Declaration] = &[Declaration {
        keys: KEYS,
        any_poisson_ratio: true,
        no_line: Some("`correspondence` has no 1-D form; use `pmb`"),
        breaks_by_energy: true,
        breaks_by_stress: true,
        examples: &[
            "poisson_ratio = 0.4",
            "poisson_ratio = 0.3, stress = 'neo-hooke', zero_energy = 'silling2017'",
            "poisson_ratio = 0.2, stress = 'willberg2022'",
            "poisson_ratio = 0.25, zero_energy = 'none'",
            "poisson_ratio = 0.35, zero_energy = 'wan2019'",
            "poisson_ratio = 0.3, yield_stress = 0.12, hardening_modulus = 0.5, \
             zero_energy = 'silling2017'",
            "poisson_ratio = 0.3, yield_stress = 0.12, hardening_modulus = 0.5, hardening_exponent = 0.4, \
             strain_rate_coefficient = 0.05, reference_strain_rate = 1e-3, thermal_softening_exponent = 1.1, \
             initial_temperature = 293, melting_temperature = 393, volumetric_heat_capacity = 1e-3",
        ],
        fault: Some(|values, dimension| {
            hooke::fault(values, dimension)
                .or_else(|| control::fault(values, dimension))
                .or_else(|| plastic::fault(values, dimension))
        }),
        elastic: Some(hooke::average),
        invariants,
        ..Declaration::new(
            "correspondence",
            "from a classical stress, evaluated at the deformation gradient of the family",
            build,
        )
    }];
}

fn invariants(values: &Values) -> Invariants {
    let stress = of_stress(values);
    let yields = values.get(plastic::YIELD_STRESS.name).is_some();
    // In truncated families the control of Wan et al. has principal axes, which do not rotate with the body.
    // The control then exerts a moment of the order z². Other controls are multiples of I, without such axes.
    let has_axes = values.word(control::KIND.name) == "wan2019";
    Invariants {
        conservative: stress.conservative && !yields,
        objective: stress.objective && !has_axes,
        angular_momentum: stress.angular_momentum && !has_axes,
    }
}

/// Return the invariants of the law without plastic flow and without control of zero-energy modes.
fn of_stress(values: &Values) -> Invariants {
    let by_word = values.word(STRESS.name) == "willberg2022";
    Invariants {
        conservative: !by_word,
        objective: !by_word,
        angular_momentum: true,
    }
}

fn build(given: &Given) -> Built {
    let hooke = Hooke::of(given).expect("the constants have been looked at");
    let stress = Stress::of(given.values.word(STRESS.name), given, hooke);
    Built::plain(Correspondence {
        response: Plastic::of(given).map_or(Response::Elastic(stress), Response::Plastic),
        modulus: stress.largest_modulus(),
        control: Control::of(given, hooke),
        untruncated_trace: Influence::Constant.weighted_volume(given.dimension, given.horizon),
    })
}

impl Described for Correspondence {
    fn described(&self) -> Vec<(&'static str, Property)> {
        let (stress, plastic) = match &self.response {
            Response::Elastic(stress) => (stress.name(), Vec::new()),
            Response::Plastic(plastic) => (Stress::OF_PLASTIC, plastic.described()),
        };
        let mut facts = vec![("stress", Property::Text(stress))];
        facts.extend(self.control.described());
        facts.extend(plastic);
        facts
    }
}

/// Two constants, then A and the diagonal and mixed entries of B; all in N/m⁷. The first constant is the
/// spring constant of [`Law::stiffness`], which bounds the strain energy density. The second constant is
/// [`Control::constant`].
type Point<const D: usize> = ([Lanes; CONSTANTS], Tensors<D>);

const CONSTANTS: usize = 2;

/// Largest count of a point's [own numbers](Law::OWN_NUMBERS). Every point has two of them: W − ½ P : H
/// (J/m³), and a flag, which is 1 if the point has no force.
///
/// If the law has plasticity and a zero-energy control, two more numbers follow. The first is
/// ½ tr(B H K Hᵀ) (J/m³). This number equals ½ Σ ω η·B η Ṽ minus the energy ½ Σ ω z·B z Ṽ of the control. The
/// second is the factor s on B at the start of the step.
const OWN: usize = 4;

/// Count of a point's own numbers if the law has no plasticity or no zero-energy control.
const OWN_OF_ELASTIC: usize = 2;

/// Matrices of the force state ω (A ξ + B η), N/m⁷: A, and the diagonal and mixed entries of the symmetric
/// matrix B.
type Tensors<const D: usize> = ([[Lanes; D]; D], Symmetric<D>);

/// Return A ξ + B η, N/m⁶. There is no loop over the rows. The compiler would not unroll such a loop, and
/// would keep its data in memory instead of registers.
#[inline(always)]
fn times_bond<S: Simd, const D: usize>(
    simd: S,
    tensors: &Tensors<D>,
    bond: &Bond<D>,
) -> [Lanes; D] {
    let mut product = [row(simd, tensors, bond, 0); D];
    if D > 1 {
        product[1] = row(simd, tensors, bond, 1);
    }
    if D > 2 {
        product[2] = row(simd, tensors, bond, 2);
    }
    product
}

#[inline(always)]
fn row<S: Simd, const D: usize>(
    simd: S,
    (direct, control): &Tensors<D>,
    bond: &Bond<D>,
    a: usize,
) -> Lanes {
    let mut sum = direct[a][0] * bond.reference[0];
    for b in 1..D {
        sum = simd.multiply_add(direct[a][b], bond.reference[b], sum);
    }
    for b in 0..D {
        sum = simd.multiply_add(symmetric(control, a, b), bond.eta[b], sum);
    }
    sum
}

/// Quantities of a point that follow from the deformation gradient of its family.
struct Family<const D: usize> {
    /// Inverse shape tensor K⁻¹, m⁻⁵.
    inverse: SMatrix<f64, D, D>,
    /// Displacement gradient H.
    gradient: SMatrix<f64, D, D>,
    /// First Piola–Kirchhoff stress P, Pa.
    stress: SMatrix<f64, D, D>,
    /// Strain energy density W, J/m³.
    energy: f64,
}

impl Correspondence {
    /// Compute K⁻¹, H, P and W of a point, and update its plastic state. `sums` are the sums of the first
    /// pass. `initial_spring_constant` is the spring constant of the initial family (N/m⁷). `step` is the
    /// length of the step (s).
    ///
    /// The result is `None` in three cases:
    ///
    /// - K is nearly singular;
    /// - the intact part of the family is stiffer than the stable step allows
    ///   ([`ShapeTensor::inverse_of_rest`]);
    /// - the law has no stress at H.
    fn family<const D: usize>(
        &self,
        sums: &[f64],
        initial_spring_constant: f64,
        state: &mut PlasticState,
        step: f64,
    ) -> Option<Family<D>> {
        let shape = ShapeTensor::<D>::new(&sums[..2 * D]);
        let inverse = shape.inverse_of_rest(self.modulus, initial_spring_constant)?;
        let gradient = from_rows::<D>(&sums[2 * D..]) * inverse;
        let (stress, energy) = match &self.response {
            Response::Elastic(stress) => stress.at(&gradient)?,
            Response::Plastic(plastic) => plastic.at(&gradient, state, step)?,
        };
        Some(Family {
            inverse,
            gradient,
            stress,
            energy,
        })
    }

    /// Return the plastic law; `None` if the body is elastic.
    fn plastic(&self) -> Option<&Plastic> {
        match &self.response {
            Response::Elastic(_) => None,
            Response::Plastic(plastic) => Some(plastic),
        }
    }

    /// Test whether points have a control that decreases with plastic flow.
    fn control_yields(&self) -> bool {
        self.plastic().is_some() && self.control != Control::None
    }
}

/// Return η·B η, N/m⁵. B is the matrix `control`, and η is `eta`.
#[inline(always)]
fn of_control<const D: usize>(control: &Symmetric<D>, eta: &[Lanes; D]) -> Lanes {
    let mut sum = Lanes::splat(0.0);
    for a in 0..D {
        for b in 0..D {
            sum += symmetric(control, a, b) * eta[a] * eta[b];
        }
    }
    sum
}

impl<const D: usize> Law<D> for Correspondence {
    type Point = Point<D>;
    type BondHistory = [Lanes; 0];
    /// Diagonal and mixed entries of K (m⁵), and Σ ω Ṽ (m³).
    type ReferenceSum = (([Lanes; D], [Lanes; D]), [Lanes; 1]);
    /// K and Σ ω η⊗ξ Ṽ over the intact bonds (m⁵).
    type Sum = FamilyShare<D>;
    type Force = [Lanes; D];
    const CONSTANTS: usize = CONSTANTS;
    /// The second pass computes the energy of the zero-energy control. This pass is needed only if the
    /// control decreases with plastic flow.
    const PASSES: usize = 2;
    const OWN_NUMBERS: usize = OWN;
    const LEAST_DIMENSION: usize = 2;
    const SUM_READS_STRETCH: bool = false;
    const FORCE_READS_EXTENSION: bool = false;

    #[inline(always)]
    fn reference_contribution(&self, bond: &Bond<D>) -> Self::ReferenceSum {
        (shape_share(&bond.reference), [Lanes::splat(1.0)])
    }

    fn constants(&self, sums: &[f64], numbers: &mut [f64]) {
        let shape = ShapeTensor::<D>::new(&sums[..2 * D]);
        let weight = sums[2 * D];
        numbers[1] = self.control.constant(weight);
        if let Some(inverse) = shape.inverse() {
            let control = self.control.matrix(&inverse, numbers[1]);
            let [_, largest] = extremes(&control);
            numbers[0] = (self.modulus / shape.smallest()).max(largest);
        }
    }

    fn counts(&self) -> Counts {
        let all = Counts::of::<Self, D>();
        if self.control_yields() {
            return all;
        }
        Counts {
            passes: 1,
            own: OWN_OF_ELASTIC,
            ..all
        }
    }

    /// Return the trace of K⁻¹, divided by the trace of K⁻¹ of an untruncated family; 1 if K is nearly
    /// singular.
    fn truncation_factor(&self, sums: &[f64]) -> f64 {
        let shape = ShapeTensor::<D>::new(&sums[..2 * D]);
        shape.inverse().map_or(1.0, |inverse| {
            inverse.trace() * self.untruncated_trace / (D * D) as f64
        })
    }

    #[inline(always)]
    fn pass_contribution<const S: usize>(
        &self,
        bond: &Bond<D>,
        (_, (_, control)): &Self::Point,
        _: &[Lanes; 0],
    ) -> Self::Sum {
        if S == 0 {
            return family_share(bond);
        }
        let mut sum = Self::Sum::splat(0.0);
        *sum.get_mut(0) = of_control(control, &bond.eta);
        sum
    }

    fn update_point(
        &self,
        pass: usize,
        sums: &[f64],
        numbers: &mut [f64],
        state: &mut PlasticState,
        step: f64,
    ) {
        let (constants, found) = numbers.split_at_mut(CONSTANTS);
        let own = D * D + 2 * D;
        let left = |state: &PlasticState| {
            let plastic = self.plastic();
            plastic.map_or(1.0, |plastic| plastic.control_left(state))
        };
        if pass == 1 {
            if found[own + 1] > 0.0 {
                state.control = 0.0;
                return;
            }
            let [seen, before] = [found[own + 2], found[own + 3]];
            let after = left(state);
            let energy = (0.5 * sums[0] - seen).max(0.0) / after;
            state.work += (before - after) * 0.5 * (state.control + energy);
            state.control = energy;
            return;
        }
        let control_yields = self.control_yields();
        found[..own + if control_yields { OWN } else { OWN_OF_ELASTIC }].fill(0.0);
        let before = left(state);
        let Some(family) = self.family::<D>(sums, constants[0], state, step) else {
            found[own + 1] = 1.0;
            return;
        };
        let Family {
            inverse,
            gradient,
            stress,
            energy,
        } = family;
        let after = left(state);
        let control = self.control.matrix(&inverse, constants[1]) * after;
        let direct = stress * inverse - control * gradient;
        to_rows(&direct, found);
        to_entries(&control, &mut found[D * D..]);
        found[own] = energy - 0.5 * stress.dot(&gradient);
        if control_yields {
            let moved = from_rows::<D>(&sums[2 * D..]);
            found[own + 2] = 0.5 * (control * gradient).dot(&moved);
            found[own + 3] = before;
        }
    }

    #[inline(always)]
    fn force_state(&self, bond: &Bond<D>, (_, end): &Point<D>, _: &[Lanes; 0]) -> [Lanes; D] {
        let (direct, control) = end;
        let mut force = [Lanes::splat(0.0); D];
        for a in 0..D {
            for b in 0..D {
                let of_control = symmetric(control, a, b);
                force[a] += direct[a][b] * bond.reference[b] + of_control * bond.eta[b];
            }
        }
        force
    }

    #[inline(always)]
    fn bond_force<S: Simd>(
        simd: S,
        _: &[Self; 2],
        bond: &Bond<D>,
        [(_, here), (_, there)]: [&Point<D>; 2],
        _: &[[Lanes; 0]; 2],
        weights: Weights,
    ) -> [Lanes; D] {
        let force_state_i = times_bond(simd, here, bond);
        let force_state_j = times_bond(simd, there, bond);
        LaneTuple::each(|d| weights.sum(force_state_i[d], force_state_j[d]))
    }

    #[inline(always)]
    fn end_work<S: Simd>(
        &self,
        simd: S,
        bond: &Bond<D>,
        (_, end): &Point<D>,
        _: &[Lanes; 0],
        rotation: &[Lanes; 4],
    ) -> Lanes {
        times_bond(simd, end, bond).work(simd, bond, false, rotation)
    }

    fn rotation(&self, sums: &[f64]) -> Rotation {
        family_rotation::<D>(sums)
    }

    fn family_stress(
        &self,
        sums: &[f64],
        numbers: &[f64],
        state: &PlasticState,
    ) -> Option<FamilyStress<D>> {
        let mut plastic = *state;
        let family = self.family::<D>(sums, numbers[0], &mut plastic, 0.0)?;
        Some(FamilyStress {
            gradient: family.gradient,
            piola: family.stress,
            plastic,
        })
    }

    #[inline(always)]
    fn bond_energy(&self, bond: &Bond<D>, end: &Point<D>, history: &[Lanes; 0]) -> Lanes {
        let force = self.force_state(bond, end, history);
        let mut work = force[0] * bond.eta[0];
        for d in 1..D {
            work += force[d] * bond.eta[d];
        }
        work * 0.5
    }

    fn point_energy(&self, numbers: &[f64]) -> f64 {
        numbers[CONSTANTS + D * D + 2 * D]
    }

    fn has_plasticity(&self) -> bool {
        self.plastic().is_some()
    }

    fn correct_mean(&self, plastic: &mut PlasticState) {
        if let Some(law) = self.plastic() {
            law.correct_mean(plastic);
        }
    }

    fn is_singular(&self, numbers: &[f64]) -> bool {
        numbers[CONSTANTS + D * D + 2 * D + 1] > 0.0
    }

    #[inline(always)]
    fn stiffness(&self, _: &Bond<D>, end: &Point<D>) -> Lanes {
        end.0[0]
    }

    fn out_of_plane_stress(
        &self,
        gradient: &SMatrix<f64, D, D>,
        state: &PlasticState,
    ) -> Option<f64> {
        match &self.response {
            Response::Elastic(stress) => stress.out_of_plane_stress(gradient),
            Response::Plastic(plastic) => plastic.out_of_plane_stress(gradient, state),
        }
    }

    fn out_of_plane_stretch(
        &self,
        gradient: &SMatrix<f64, D, D>,
        state: &PlasticState,
    ) -> Option<f64> {
        match &self.response {
            Response::Elastic(stress) => stress.out_of_plane_stretch(gradient),
            Response::Plastic(plastic) => plastic.out_of_plane_stretch(gradient, state),
        }
    }

    fn needs_shape(&self) -> bool {
        true
    }

    fn resists_across(&self) -> bool {
        true
    }
}
