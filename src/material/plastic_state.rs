//! What plastic flow leaves at a point, from step to step.

/// Plastic strain and what came of it; 0 at the start.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PlasticState {
    /// E_p, or C_p⁻¹ − I where the strain is logarithmic: xx, yy, zz, yz, xz, xy.
    pub strain: [f64; 6],
    /// ∫ √(⅔ Ė_p:Ė_p) dt.
    pub equivalent: f64,
    /// Energy of the zero-energy control of the elastic body, J/m³.
    pub control: f64,
    /// What flow has dissipated, J/m³.
    pub work: f64,
}

impl PlasticState {
    /// How many numbers it has.
    pub const COUNT: usize = 9;

    /// From its numbers, in the order in which they are declared.
    pub fn of(numbers: [f64; Self::COUNT]) -> Self {
        let [strain @ .., equivalent, control, work] = numbers;
        Self {
            strain,
            equivalent,
            control,
            work,
        }
    }

    /// Its numbers, in the order in which they are declared.
    pub fn numbers(&self) -> [f64; Self::COUNT] {
        let Self {
            strain: [xx, yy, zz, yz, xz, xy],
            equivalent,
            control,
            work,
        } = *self;
        [xx, yy, zz, yz, xz, xy, equivalent, control, work]
    }
}
