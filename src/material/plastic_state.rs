//! Plastic state of a point, stored from step to step.

/// Plastic state of a point; all numbers are initially 0.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PlasticState {
    /// Plastic strain E_p for small strains; C_p⁻¹ − I with C_p = F_pᵀ F_p for logarithmic strains. The order
    /// is xx, yy, zz, yz, xz, xy.
    pub strain: [f64; 6],
    /// Equivalent plastic strain ∫ √(⅔ Ė_p:Ė_p) dt.
    pub equivalent: f64,
    /// Factor of strain rate and temperature on the yield stress in the last step, minus 1.
    pub yield_change: f64,
    /// Energy that the zero-energy control would have if plastic flow did not reduce the control, J/m³.
    pub control: f64,
    /// Energy that plastic flow and the reduction of the zero-energy control have dissipated, J/m³.
    pub work: f64,
}

impl PlasticState {
    /// Count of the numbers in a state.
    pub const COUNT: usize = 10;

    /// Create a state from its numbers, in the order of the fields.
    pub fn of(numbers: [f64; Self::COUNT]) -> Self {
        let [strain @ .., equivalent, yield_change, control, work] = numbers;
        Self {
            strain,
            equivalent,
            yield_change,
            control,
            work,
        }
    }

    /// Return the numbers of the state, in the order of the fields.
    pub fn numbers(&self) -> [f64; Self::COUNT] {
        let Self {
            strain: [xx, yy, zz, yz, xz, xy],
            equivalent,
            yield_change,
            control,
            work,
        } = *self;
        [
            xx,
            yy,
            zz,
            yz,
            xz,
            xy,
            equivalent,
            yield_change,
            control,
            work,
        ]
    }
}
