//! Elastic constants of an imported material.

use super::draft::{Section, Value};
use super::translation::Translation;
use super::tree::Node;
use crate::error::Result;

/// Names of the constants in source decks and in the new deck.
const NAMES: [(&str, &str); 5] = [
    ("Young's Modulus", "youngs_modulus"),
    ("Poisson's Ratio", "poisson_ratio"),
    ("Bulk Modulus", "bulk_modulus"),
    ("Shear Modulus", "shear_modulus"),
    ("Youngs Modulus", "youngs_modulus"),
];

/// The elastic constants of a material.
#[derive(Debug, Clone, Default)]
pub struct Constants {
    /// For each constant: its key in the new deck, its numerical value, and the [`Value`] to write to the new
    /// deck.
    given: Vec<(&'static str, f64, Value)>,
}

impl Constants {
    /// Read the constants of a material.
    ///
    /// # Errors
    /// If a constant is not a number.
    pub fn read(translation: &Translation, material: &Node) -> Result<Self> {
        let mut given: Vec<(&str, f64, Value)> = Vec::new();
        for (name, key) in NAMES {
            if let Some(node) = material.get(name) {
                if given.iter().any(|(other, ..)| *other == key) {
                    translation.log.left_out(node, "is given twice");
                    continue;
                }
                let value = translation.number(node, name)?;
                given.push((key, value, translation.number_value(node, name)?));
                translation
                    .log
                    .taken(node, format!("{key} of the material"));
            }
        }
        Ok(Self { given })
    }

    /// Create constants from numbers.
    pub fn of(given: &[(&'static str, f64)]) -> Self {
        let with_value = |(key, value): &(&'static str, f64)| (*key, *value, Value::number(*value));
        Self {
            given: given.iter().map(with_value).collect(),
        }
    }

    fn get(&self, key: &str) -> Option<f64> {
        let (_, value, _) = self.given.iter().find(|(known, ..)| *known == key)?;
        Some(*value)
    }

    /// Return the number of constants.
    pub fn count(&self) -> usize {
        self.given.len()
    }

    /// Return bulk and shear modulus of the solid in 3-D, Pa; `None` if the constants do not determine both
    /// moduli.
    pub fn moduli(&self) -> Option<[f64; 2]> {
        let get = |key| self.get(key);
        let of_young = |e: f64, nu: f64| [e / (3.0 * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu))];
        let (bulk, shear) = (get("bulk_modulus"), get("shear_modulus"));
        let (young, ratio) = (get("youngs_modulus"), get("poisson_ratio"));
        Some(match (bulk, shear, young, ratio) {
            (Some(k), Some(g), ..) => [k, g],
            (_, _, Some(e), Some(nu)) => of_young(e, nu),
            (Some(k), _, _, Some(nu)) => of_young(3.0 * k * (1.0 - 2.0 * nu), nu),
            (_, Some(g), _, Some(nu)) => of_young(2.0 * g * (1.0 + nu), nu),
            (Some(k), _, Some(e), _) => [k, 3.0 * k * e / (9.0 * k - e)],
            (_, Some(g), Some(e), _) => [e * g / (3.0 * (3.0 * g - e)), g],
            _ => return None,
        })
    }

    /// Return the node of a constant in the table of a material. `key` is the key in the new deck.
    pub fn node<'n>(material: &'n Node, key: &str) -> Option<&'n Node> {
        let mut names = NAMES.iter().filter(|(_, known)| *known == key);
        names.find_map(|(name, _)| material.get(name))
    }

    /// Write the first two constants.
    pub fn write_two(&self, section: &mut Section) {
        for (key, _, value) in self.given.iter().take(2) {
            section.set(*key, value.clone());
        }
    }

    /// Sort the constants in the order of `precedence`, and keep the first two. Return the keys of the
    /// constants that are removed.
    pub fn keep_two(&mut self, precedence: &[&str]) -> Vec<&'static str> {
        let rank = |key: &str| precedence.iter().position(|known| *known == key);
        self.given.sort_by_key(|(key, ..)| rank(key));
        let kept = self.given.len().min(2);
        let removed = self.given.drain(kept..);
        removed.map(|(key, ..)| key).collect()
    }

    /// Write Young's modulus of a bond-based law of PeriLab. The law has the fixed Poisson's ratio `ratio`,
    /// and uses one elastic constant. Return the key of this constant: the bulk modulus if given, or else the
    /// shear modulus, or else Young's modulus. Return `None` if none of them is given.
    pub fn write_young(&self, section: &mut Section, ratio: f64) -> Option<&'static str> {
        let factors = [
            ("bulk_modulus", 3.0 * (1.0 - 2.0 * ratio)),
            ("shear_modulus", 2.0 * (1.0 + ratio)),
        ];
        for (key, factor) in factors {
            if let Some(modulus) = self.get(key) {
                section.set("youngs_modulus", Value::number(factor * modulus));
                return Some(key);
            }
        }
        let mut given = self.given.iter();
        let (key, _, value) = given.find(|(key, ..)| *key == "youngs_modulus")?;
        section.set(*key, value.clone());
        Some(key)
    }

    /// Write the only constant of a bond-based law: Young's modulus, or the bulk modulus. Return the keys of
    /// the constants that determine it. Return `None` if the constants determine neither modulus.
    ///
    /// `factor` is used only if the bulk modulus is the only constant. With `factor`, the bulk modulus is
    /// that of a plane problem, and `factor` is Young's modulus divided by this bulk modulus. Without
    /// `factor`, the bulk modulus is that of a solid in 3-D.
    pub fn write_one(
        &self,
        section: &mut Section,
        factor: Option<f64>,
    ) -> Option<&'static [&'static str]> {
        let find = |key: &str| self.given.iter().find(|(known, ..)| *known == key);
        if let Some((key, _, value)) = find("youngs_modulus") {
            section.set(*key, value.clone());
            Some(&["youngs_modulus"])
        } else if let Some([k, g]) = self.moduli() {
            section.set("youngs_modulus", Value::number(9.0 * k * g / (3.0 * k + g)));
            Some(match (find("bulk_modulus"), find("shear_modulus")) {
                (Some(_), Some(_)) => &["bulk_modulus", "shear_modulus"],
                (Some(_), None) => &["bulk_modulus", "poisson_ratio"],
                _ => &["shear_modulus", "poisson_ratio"],
            })
        } else if let (Some((_, bulk, _)), Some(factor)) = (find("bulk_modulus"), factor) {
            section.set("youngs_modulus", Value::number(factor * bulk));
            Some(&["bulk_modulus"])
        } else {
            let (key, _, value) = find("bulk_modulus")?;
            section.set(*key, value.clone());
            Some(&["bulk_modulus"])
        }
    }

    /// Return the keys of the constants in the new deck.
    pub fn keys(&self) -> impl Iterator<Item = &'static str> + '_ {
        self.given.iter().map(|(key, ..)| *key)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_two_constants_give_the_moduli() {
        let (e, nu) = (200e9, 0.3);
        let [k, g] = [e / (3.0 * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu))];
        let all = [
            ("youngs_modulus", e),
            ("poisson_ratio", nu),
            ("bulk_modulus", k),
            ("shear_modulus", g),
        ];
        for a in 0..4 {
            for b in a + 1..4 {
                let [bulk, shear] = Constants::of(&[all[a], all[b]]).moduli().unwrap();
                assert!((bulk / k - 1.0).abs() < 1e-12 && (shear / g - 1.0).abs() < 1e-12);
            }
            assert_eq!(Constants::of(&[all[a]]).moduli(), None);
        }
    }
}
