//! Regions of LAMMPS, which become shapes.

use super::draft::Value;
use super::script::Variables;

/// Distance by which a shape extends beyond its region, in spacings. LAMMPS includes atoms on the surface,
/// which round-off could exclude.
const MARGIN: f64 = 1e-6;

/// A region; its numbers are lengths in the units of the script.
#[derive(Debug, Clone, PartialEq)]
pub enum Region {
    /// Lower and upper corner; infinite where the region is unbounded.
    Block([f64; 3], [f64; 3]),
    /// Direction of the axis (0 to 2 for x to z), coordinates of the axis in the other two directions,
    /// radius, and the lower and upper end along the axis.
    Cylinder(usize, [f64; 2], f64, [f64; 2]),
    /// Centre and radius.
    Sphere([f64; 3], f64),
    /// Points in at least one of the regions.
    Union(Vec<Region>),
    /// Points in the first region and in none of the others.
    Difference(Vec<Region>),
}

/// Read a region from the arguments after its name. `spacing` is the spacing of the lattice, and `known`
/// returns a region by its name.
///
/// # Errors
/// - If the style is unknown.
/// - If a region of a union is unknown.
/// - If an argument is missing or invalid.
/// - If the region is everything outside of a surface (`side out`).
/// - If the region moves.
pub fn region(
    variables: &Variables,
    arguments: &[&str],
    spacing: f64,
    known: &dyn Fn(&str) -> Option<Region>,
) -> Result<Region, String> {
    let style = *arguments.first().ok_or("a style is missing")?;
    let rest = &arguments[1..];
    let option = |name: &str| {
        let at = rest.iter().position(|word| *word == name)?;
        rest.get(at + 1).copied()
    };
    if option("side") == Some("out") {
        return Err("what lies outside of a region has no shape".to_owned());
    }
    if rest.contains(&"move") || rest.contains(&"rotate") {
        return Err("a region that moves has no fixed shape".to_owned());
    }
    let unit = if option("units") == Some("box") {
        1.0
    } else {
        spacing
    };
    let number = |k: usize| -> Result<f64, String> {
        match *rest.get(k).ok_or("a number is missing")? {
            "INF" | "EDGE" => {
                // With arguments counted from 0, lower bounds are the even arguments of a block, and argument
                // 4 of a cylinder.
                let is_lower = match style {
                    "block" => k.is_multiple_of(2),
                    _ => k == 4,
                };
                Ok(if is_lower {
                    f64::NEG_INFINITY
                } else {
                    f64::INFINITY
                })
            }
            word => Ok(unit * variables.number(word)?),
        }
    };
    match style {
        "block" => {
            let [a, b, c, d, e, f] = [
                number(0)?,
                number(1)?,
                number(2)?,
                number(3)?,
                number(4)?,
                number(5)?,
            ];
            Ok(Region::Block([a, c, e], [b, d, f]))
        }
        "sphere" => Ok(Region::Sphere(
            [number(0)?, number(1)?, number(2)?],
            number(3)?,
        )),
        "cylinder" => {
            let axis = ["x", "y", "z"]
                .iter()
                .position(|axis| rest.first() == Some(axis));
            let axis = axis.ok_or("the axis must be x, y or z")?;
            Ok(Region::Cylinder(
                axis,
                [number(1)?, number(2)?],
                number(3)?,
                [number(4)?, number(5)?],
            ))
        }
        "union" => {
            let count = variables.number(rest.first().ok_or("a number is missing")?)? as usize;
            let names = rest.get(1..=count).ok_or("regions are missing")?;
            let parts = names.iter().map(|name| {
                known(name).ok_or_else(|| format!("the region `{name}` is not defined"))
            });
            Ok(Region::Union(parts.collect::<Result<_, _>>()?))
        }
        style => Err(format!("regions of style {style} have no shape")),
    }
}

impl Region {
    /// Return the lower and the upper corner of a box that contains the region.
    pub fn bounds(&self) -> [[f64; 3]; 2] {
        match self {
            Self::Block(lower, upper) => [*lower, *upper],
            Self::Sphere(centre, radius) => {
                [centre.map(|c| c - radius), centre.map(|c| c + radius)]
            }
            Self::Cylinder(axis, centre, radius, ends) => {
                let mut bounds = [[0.0; 3]; 2];
                let others = others(*axis);
                for (k, other) in others.into_iter().enumerate() {
                    bounds[0][other] = centre[k] - radius;
                    bounds[1][other] = centre[k] + radius;
                }
                bounds[0][*axis] = ends[0];
                bounds[1][*axis] = ends[1];
                bounds
            }
            Self::Union(parts) => {
                let all = parts.iter().map(Self::bounds);
                all.reduce(|a, b| {
                    [
                        std::array::from_fn(|k| a[0][k].min(b[0][k])),
                        std::array::from_fn(|k| a[1][k].max(b[1][k])),
                    ]
                })
                .unwrap_or([[0.0; 3]; 2])
            }
            Self::Difference(parts) => parts.first().map_or([[0.0; 3]; 2], Self::bounds),
        }
    }

    /// Test whether the region is a block that contains a box.
    pub fn covers(&self, bounds: [[f64; 3]; 2]) -> bool {
        let Self::Block(lower, upper) = self else {
            return false;
        };
        (0..3).all(|k| lower[k] <= bounds[0][k] && bounds[1][k] <= upper[k])
    }

    /// Return the part of the region that is in a box. `bounds` holds the lower and the upper corner of this
    /// box.
    pub fn clipped(&self, bounds: [[f64; 3]; 2]) -> Self {
        let [lower, upper] = bounds;
        let own = self.bounds();
        if (0..3).all(|k| lower[k] <= own[0][k] && own[1][k] <= upper[k]) {
            return self.clone();
        }
        match self {
            Self::Block(a, b) => Self::Block(
                std::array::from_fn(|k| a[k].max(lower[k])),
                std::array::from_fn(|k| b[k].min(upper[k])),
            ),
            Self::Union(parts) => {
                Self::Union(parts.iter().map(|part| part.clipped(bounds)).collect())
            }
            _ => self.clone().intersection(Self::Block(lower, upper)),
        }
    }

    /// Return an upper bound slightly below `face`, the coordinate of the upper face of a box. Shapes of the
    /// new deck extend beyond their regions by `MARGIN` spacings, but with this bound they do not contain
    /// points on the face.
    pub fn below(face: f64, spacing: f64) -> f64 {
        face - 3.0 * MARGIN * spacing
    }

    /// Replace infinite bounds of the region by the bounds of a box.
    pub fn within(&self, bounds: [[f64; 3]; 2]) -> Self {
        let clamp = |value: f64, k: usize| {
            if value.is_finite() {
                value
            } else {
                bounds[usize::from(value > 0.0)][k]
            }
        };
        let all = |parts: &[Self]| parts.iter().map(|part| part.within(bounds)).collect();
        match self {
            Self::Block(lower, upper) => Self::Block(
                std::array::from_fn(|k| clamp(lower[k], k)),
                std::array::from_fn(|k| clamp(upper[k], k)),
            ),
            Self::Cylinder(axis, centre, radius, ends) => {
                Self::Cylinder(*axis, *centre, *radius, ends.map(|end| clamp(end, *axis)))
            }
            Self::Sphere(..) => self.clone(),
            Self::Union(parts) => Self::Union(all(parts)),
            Self::Difference(parts) => Self::Difference(all(parts)),
        }
    }

    /// Return the region of the points that are in this region and in another one.
    pub fn intersection(self, other: Self) -> Self {
        let outside = Self::Difference(vec![self.clone(), other]);
        Self::Difference(vec![self, outside])
    }

    /// Test whether the shape of the region, enlarged by `MARGIN` times the spacing, contains a point.
    pub fn contains(&self, point: [f64; 3], spacing: f64) -> bool {
        let margin = MARGIN * spacing;
        let is_between = |k: usize, lower: f64, upper: f64| {
            (lower - margin..=upper + margin).contains(&point[k])
        };
        let contains = |part: &Self| part.contains(point, spacing);
        match self {
            Self::Block(lower, upper) => (0..3).all(|k| is_between(k, lower[k], upper[k])),
            Self::Sphere(centre, radius) => {
                let square: f64 = (0..3).map(|k| (point[k] - centre[k]).powi(2)).sum();
                square.sqrt() <= radius + margin
            }
            Self::Cylinder(axis, centre, radius, ends) => {
                let [a, b] = others(*axis);
                (point[a] - centre[0]).hypot(point[b] - centre[1]) <= radius + margin
                    && is_between(*axis, ends[0], ends[1])
            }
            Self::Union(parts) => parts.iter().any(contains),
            Self::Difference(parts) => parts
                .split_first()
                .is_some_and(|(first, rest)| contains(first) && !rest.iter().any(contains)),
        }
    }

    /// Test whether all numbers of the region are finite.
    pub fn is_finite(&self) -> bool {
        match self {
            Self::Union(parts) | Self::Difference(parts) => parts.iter().all(Self::is_finite),
            _ => self
                .bounds()
                .iter()
                .flatten()
                .all(|value| value.is_finite()),
        }
    }

    /// Return the shape of the region, enlarged by `MARGIN` times the spacing, as a table with one key.
    pub fn shape(&self, spacing: f64) -> Value {
        let margin = MARGIN * spacing;
        let (name, value) = match self {
            Self::Block(lower, upper) => {
                let table = vec![
                    (
                        "lower".to_owned(),
                        Value::numbers(&lower.map(|x| x - margin)),
                    ),
                    (
                        "upper".to_owned(),
                        Value::numbers(&upper.map(|x| x + margin)),
                    ),
                ];
                ("box", Value::Table(table))
            }
            Self::Sphere(centre, radius) => {
                let table = vec![
                    ("centre".to_owned(), Value::numbers(centre)),
                    ("radius".to_owned(), Value::number(radius + margin)),
                ];
                ("sphere", Value::Table(table))
            }
            Self::Cylinder(axis, centre, radius, ends) => {
                let end = |at: f64| {
                    let mut point = [0.0; 3];
                    for (k, other) in others(*axis).into_iter().enumerate() {
                        point[other] = centre[k];
                    }
                    point[*axis] = at;
                    Value::numbers(&point)
                };
                let table = vec![
                    ("from".to_owned(), end(ends[0] - margin)),
                    ("to".to_owned(), end(ends[1] + margin)),
                    ("radius".to_owned(), Value::number(radius + margin)),
                ];
                ("cylinder", Value::Table(table))
            }
            Self::Union(parts) => {
                let parts = parts.iter().map(|part| part.shape(spacing));
                ("union", Value::list(parts))
            }
            Self::Difference(parts) => {
                let parts = parts.iter().map(|part| part.shape(spacing));
                ("difference", Value::list(parts))
            }
        };
        Value::Table(vec![(name.to_owned(), value)])
    }
}

/// Return the two directions perpendicular to an axis, in the order of LAMMPS.
pub fn others(axis: usize) -> [usize; 2] {
    match axis {
        0 => [1, 2],
        1 => [0, 2],
        _ => [0, 1],
    }
}
