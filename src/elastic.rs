//! Isotropic elastic constants, computed from any two of them.

/// An elastic constant that a deck can give.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Constant {
    /// Young's modulus E, Pa.
    Young,
    /// Bulk modulus K, Pa.
    Bulk,
    /// Shear modulus G, Pa.
    Shear,
    /// Lamé's first parameter λ, Pa.
    Lame,
    /// Poisson's ratio ν.
    Poisson,
}

/// Young's modulus (Pa) and Poisson's ratio of an isotropic solid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Isotropic {
    /// Young's modulus E, Pa.
    pub youngs_modulus: f64,
    /// Poisson's ratio ν.
    pub poisson_ratio: f64,
}

impl Isotropic {
    /// Compute the solid from two constants in any order. Return `None` if `a` and `b` are values of the same
    /// constant, if they do not determine a stable solid (E > 0 and −1 < ν < 1/2), or if λ + 2G is not
    /// finite.
    pub fn from_two(a: (Constant, f64), b: (Constant, f64)) -> Option<Self> {
        use Constant::{Bulk, Lame, Poisson, Shear, Young};
        let order = |constant| match constant {
            Young => 0,
            Bulk => 1,
            Shear => 2,
            Lame => 3,
            Poisson => 4,
        };
        let (a, b) = if order(a.0) <= order(b.0) {
            (a, b)
        } else {
            (b, a)
        };
        let (youngs_modulus, poisson_ratio) = match (a, b) {
            ((Young, e), (Bulk, k)) => (e, (3.0 * k - e) / (6.0 * k)),
            ((Young, e), (Shear, g)) => (e, e / (2.0 * g) - 1.0),
            ((Young, e), (Lame, l)) => {
                let root = (e * e + 9.0 * l * l + 2.0 * e * l).sqrt();
                (e, 2.0 * l / (e + l + root))
            }
            ((Young, e), (Poisson, nu)) => (e, nu),
            ((Bulk, k), (Shear, g)) => (
                9.0 * k * g / (3.0 * k + g),
                (3.0 * k - 2.0 * g) / (2.0 * (3.0 * k + g)),
            ),
            ((Bulk, k), (Lame, l)) => (9.0 * k * (k - l) / (3.0 * k - l), l / (3.0 * k - l)),
            ((Bulk, k), (Poisson, nu)) => (3.0 * k * (1.0 - 2.0 * nu), nu),
            ((Shear, g), (Lame, l)) => (g * (3.0 * l + 2.0 * g) / (l + g), l / (2.0 * (l + g))),
            ((Shear, g), (Poisson, nu)) => (2.0 * g * (1.0 + nu), nu),
            ((Lame, l), (Poisson, nu)) => (l * (1.0 + nu) * (1.0 - 2.0 * nu) / nu, nu),
            _ => return None,
        };
        let stable = youngs_modulus > 0.0 && poisson_ratio > -1.0 && poisson_ratio < 0.5;
        let solid = Self {
            youngs_modulus,
            poisson_ratio,
        };
        let longitudinal = solid.lame_lambda() + 2.0 * solid.shear_modulus();
        (stable && longitudinal.is_finite()).then_some(solid)
    }

    /// Return the bulk modulus K = E / (3 (1 − 2ν)), Pa.
    pub fn bulk_modulus(&self) -> f64 {
        self.youngs_modulus / (3.0 * (1.0 - 2.0 * self.poisson_ratio))
    }

    /// Return the shear modulus G = E / (2 (1 + ν)), Pa.
    pub fn shear_modulus(&self) -> f64 {
        self.youngs_modulus / (2.0 * (1.0 + self.poisson_ratio))
    }

    /// Return Lamé's first parameter λ = K − 2G/3, Pa.
    pub fn lame_lambda(&self) -> f64 {
        self.bulk_modulus() - 2.0 * self.shear_modulus() / 3.0
    }
}

#[cfg(test)]
mod tests {
    use super::Constant::*;
    use super::*;

    #[test]
    fn any_two_constants_give_the_same_solid() {
        let solid = Isotropic {
            youngs_modulus: 72e9,
            poisson_ratio: 0.22,
        };
        let all = [
            (Young, 72e9),
            (Bulk, solid.bulk_modulus()),
            (Shear, solid.shear_modulus()),
            (Lame, solid.lame_lambda()),
            (Poisson, 0.22),
        ];
        for a in all {
            for b in all {
                let Some(found) = Isotropic::from_two(a, b) else {
                    assert_eq!(a.0, b.0);
                    continue;
                };
                assert!(
                    (found.youngs_modulus / 72e9 - 1.0).abs() < 1e-12,
                    "{a:?} {b:?}"
                );
                assert!((found.poisson_ratio - 0.22).abs() < 1e-12, "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn no_solid_has_a_poisson_ratio_of_a_half() {
        assert_eq!(Isotropic::from_two((Young, 1.0), (Poisson, 0.5)), None);
        assert_eq!(Isotropic::from_two((Young, 1.0), (Bulk, 0.1)), None);
    }
}
