//! Centre lines of connected damaged points: the path of a crack and its branches.
//!
//! Damage is spread over a band a few spacings wide. Dijkstra's method finds the shortest path along the band
//! from the start of the crack to each point. The points are grouped into sections by their path length.
//! Within a section, each set of connected points is a part; different parts lie on different branches. The
//! centre lines join the centroids of successive parts (the level-set diagram of Lazarus & Verroust 1999). A
//! wide or ragged band shifts these centroids only slightly.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use nalgebra::Vector3;

use crate::points::bins::Bins;
use crate::points::distance_squared;

type Vector = Vector3<f64>;

/// Relative tolerance of distance limits: a point at the limit counts as within it.
const TOLERANCE: f64 = 1e-9;

/// A damaged point in the band of damage around a crack.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Damaged {
    /// Position, m.
    pub place: [f64; 3],
    /// Weight of the point in the centroid of its part.
    pub weight: f64,
}

/// A vertex of a crack's centre line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vertex {
    /// Position, m.
    pub place: [f64; 3],
    /// Length of the crack from its start to this vertex, m.
    pub along: f64,
}

/// The vertices of a branch: from the start of the crack, or from the fork at which the branch begins, to the
/// tip of the branch.
pub type Branch = Vec<Vertex>;

/// Distances that define which points are connected, and how they are grouped into sections.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// Points up to this distance apart are connected, m.
    pub link: f64,
    /// Length of a section, m; at least `link`. Branches that are shorter than a section are dropped. Paths
    /// begin at all points within one section length of the start of the crack.
    pub section_length: f64,
}

/// Total length of all branches, m.
pub fn length(branches: &[Branch]) -> f64 {
    let own = |branch: &Branch| branch[branch.len() - 1].along - branch[0].along;
    // The sum of an empty iterator would be -0.
    branches.iter().map(own).fold(0.0, |sum, own| sum + own)
}

/// Find the branches of a crack that starts at `from` (m). The first branch has the longest path to its tip.
/// The result is empty if no point is within one section length of the start. The result depends only on the
/// points and their order.
pub fn branches(from: [f64; 3], points: &[Damaged], reach: Reach) -> Vec<Branch> {
    let places: Vec<[f64; 3]> = points.iter().map(|point| point.place).collect();
    let bins = Bins::new(&places, reach.link * (1.0 + TOLERANCE));
    let paths = ShortestPaths::new(from, &places, &bins, reach);
    let mut parts = parts(points, &bins, &paths, reach);
    drop_stubs(&mut parts);
    let roots = roots(&parts, &connected_sets(&places, &bins, &paths));
    lines(from, points, (&parts, roots), reach)
}

/// The shortest paths along the band from the start of the crack.
struct ShortestPaths {
    /// Path length of each reached point, m; infinite for other points.
    length: Vec<f64>,
    /// For each point, the preceding point on its path; `None` for points where a path begins, and for points
    /// that are not reached.
    before: Vec<Option<usize>>,
    /// The reached points, ordered by path length, then by index.
    order: Vec<usize>,
}

/// A candidate for the next reached point. [`BinaryHeap`] pops the greatest candidate first, so a candidate
/// with a shorter path is greater. If two paths are equally long, the candidate with the lower index is
/// greater.
#[derive(PartialEq)]
struct Next {
    length: f64,
    point: usize,
}

impl Eq for Next {}

impl Ord for Next {
    fn cmp(&self, other: &Self) -> Ordering {
        let order = other.length.total_cmp(&self.length);
        order.then(other.point.cmp(&self.point))
    }
}

impl PartialOrd for Next {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl ShortestPaths {
    /// Find the paths by Dijkstra's method. Paths begin at all points within one section length of the start
    /// of the crack.
    fn new(from: [f64; 3], places: &[[f64; 3]], bins: &Bins, reach: Reach) -> Self {
        let mut paths = Self {
            length: vec![f64::INFINITY; places.len()],
            before: vec![None; places.len()],
            order: Vec::new(),
        };
        let mut open = BinaryHeap::new();
        for (point, place) in places.iter().enumerate() {
            let length = distance_squared(from, *place).sqrt();
            if length <= reach.section_length * (1.0 + TOLERANCE) {
                paths.length[point] = length;
                open.push(Next { length, point });
            }
        }
        let mut is_done = vec![false; places.len()];
        while let Some(Next { length, point }) = open.pop() {
            if std::mem::replace(&mut is_done[point], true) {
                continue;
            }
            paths.order.push(point);
            bins.within(places[point], |other, squared| {
                let other = other as usize;
                if paths.length[other] <= length {
                    return;
                }
                let through = length + squared.sqrt();
                if through < paths.length[other] {
                    paths.length[other] = through;
                    paths.before[other] = Some(point);
                    open.push(Next {
                        length: through,
                        point: other,
                    });
                }
            });
        }
        paths
    }
}

/// Connected points of one section.
struct Part {
    /// Index of the part before this one, towards the start of the crack; `None` where paths begin.
    parent: Option<usize>,
    members: Vec<usize>,
    /// Largest path length of the points of this part and of its descendants, m.
    farthest: f64,
    children: Vec<usize>,
}

/// Divide the points into parts. In the returned list, each part comes after its parent.
fn parts(points: &[Damaged], bins: &Bins, paths: &ShortestPaths, reach: Reach) -> Vec<Part> {
    // All points where paths begin are in section 0, including those at exactly one section length.
    let section = |point: usize| match paths.before[point] {
        None => 0,
        Some(_) => (paths.length[point] / reach.section_length) as usize,
    };
    let mut part_of: Vec<Option<usize>> = vec![None; points.len()];
    let mut parts: Vec<Part> = Vec::new();
    for first in &paths.order {
        if part_of[*first].is_some() {
            continue;
        }
        // The point with the shortest path in a part is preceded by a point of an earlier section, or by
        // none.
        let parent = paths.before[*first].and_then(|before| part_of[before]);
        let number = parts.len();
        part_of[*first] = Some(number);
        let mut members = vec![*first];
        let mut next = 0;
        while let Some(point) = members.get(next).copied() {
            next += 1;
            bins.within(points[point].place, |other, _| {
                let other = other as usize;
                let is_free = part_of[other].is_none() && paths.length[other].is_finite();
                if is_free && section(other) == section(point) {
                    part_of[other] = Some(number);
                    members.push(other);
                }
            });
        }
        members.sort_unstable();
        let lengths = members.iter().map(|member| paths.length[*member]);
        parts.push(Part {
            parent,
            farthest: lengths.fold(0.0, f64::max),
            members,
            children: Vec::new(),
        });
    }
    for number in (0..parts.len()).rev() {
        if let Some(parent) = parts[number].parent {
            parts[parent].farthest = parts[parent].farthest.max(parts[number].farthest);
            parts[parent].children.push(number);
        }
    }
    parts
}

/// Remove parts without children (stubs) at forks. If all children of a part are stubs, the children are
/// merged into one child. Otherwise, the stubs are dropped.
fn drop_stubs(parts: &mut [Part]) {
    for number in 0..parts.len() {
        let children = std::mem::take(&mut parts[number].children);
        let (stubs, mut kept): (Vec<usize>, Vec<usize>) = children
            .into_iter()
            .partition(|child| parts[*child].children.is_empty());
        if let (true, Some((last, others))) = (kept.is_empty(), stubs.split_last()) {
            for other in others {
                let members = std::mem::take(&mut parts[*other].members);
                parts[*last].members.extend(members);
                parts[*last].farthest = parts[*last].farthest.max(parts[*other].farthest);
            }
            parts[*last].members.sort_unstable();
            kept.push(*last);
        }
        // The child with the longest path comes first; children with equal paths are ordered by their index.
        kept.sort_by(|a, b| {
            let order = parts[*b].farthest.total_cmp(&parts[*a].farthest);
            order.then(a.cmp(b))
        });
        parts[number].children = kept;
    }
}

/// Assign the numbers 0, 1, … to the sets of connected points. For each reached point, return the number of
/// its set. Points that are not reached have the number `usize::MAX`.
fn connected_sets(places: &[[f64; 3]], bins: &Bins, paths: &ShortestPaths) -> Vec<usize> {
    let mut set_of = vec![usize::MAX; places.len()];
    let mut sets = 0;
    for first in &paths.order {
        if set_of[*first] != usize::MAX {
            continue;
        }
        set_of[*first] = sets;
        let mut open = vec![*first];
        while let Some(point) = open.pop() {
            bins.within(places[point], |other, _| {
                let other = other as usize;
                if set_of[other] == usize::MAX {
                    set_of[other] = sets;
                    open.push(other);
                }
            });
        }
        sets += 1;
    }
    set_of
}

/// Find the parts at which branches begin. In each set of connected points, choose the part with the largest
/// `farthest` among the parts without a parent. A crack that surrounds a hole or a wide notch thus counts
/// once. If any of the chosen parts has children, the chosen parts without children are left out.
fn roots(parts: &[Part], set_of: &[usize]) -> Vec<usize> {
    let mut roots: Vec<usize> = Vec::new();
    let set = |number: usize| set_of[parts[number].members[0]];
    for number in (0..parts.len()).filter(|number| parts[*number].parent.is_none()) {
        match roots.iter_mut().find(|root| set(**root) == set(number)) {
            Some(root) if parts[number].farthest > parts[*root].farthest => *root = number,
            Some(_) => {}
            None => roots.push(number),
        }
    }
    if roots.iter().any(|root| !parts[*root].children.is_empty()) {
        roots.retain(|root| !parts[*root].children.is_empty());
    }
    roots
}

/// Construct the branches. A branch is a line that joins the centroids of successive parts. The construction
/// begins at the parts `roots`.
fn lines(
    from: [f64; 3],
    points: &[Damaged],
    (parts, roots): (&[Part], Vec<usize>),
    reach: Reach,
) -> Vec<Branch> {
    // The vertex of a part is its centroid. For a part without children, the vertex is moved along the line
    // from the previous vertex through the centroid, up to the farthest point of the part along this line.
    let place = |part: &Part, before: Vector| {
        let members = || part.members.iter().map(|member| &points[*member]);
        let (mut sum, mut weight) = (Vector::zeros(), 0.0);
        for point in members() {
            sum += point.weight * Vector::from(point.place);
            weight += point.weight;
        }
        let middle = sum / weight;
        let way = middle - before;
        if !part.children.is_empty() || way.norm() < 0.25 * reach.link {
            return middle;
        }
        let along = |point: &Damaged| (Vector::from(point.place) - before).dot(&way);
        let farthest = members().map(along).fold(0.0, f64::max);
        before + farthest / way.dot(&way) * way
    };
    let start = Vertex {
        place: from,
        along: 0.0,
    };
    let mut branches: Vec<Branch> = Vec::new();
    let mut forks: Vec<(Vertex, usize)> = roots.into_iter().map(|root| (start, root)).collect();
    while let Some((start, first)) = forks.pop() {
        let mut branch = vec![start];
        let mut next = Some(first);
        while let Some(number) = next {
            let part = &parts[number];
            let last = branch[branch.len() - 1];
            let before = Vector::from(last.place);
            let here = place(part, before);
            let here = Vertex {
                along: last.along + (here - before).norm(),
                place: here.into(),
            };
            branch.push(here);
            next = part.children.first().copied();
            forks.extend(part.children.iter().skip(1).map(|child| (here, *child)));
        }
        branches.push(branch);
    }
    branches.sort_by(|a, b| {
        let tip = |branch: &Branch| branch[branch.len() - 1].along;
        tip(b).total_cmp(&tip(a))
    });
    branches
}

#[cfg(test)]
mod tests {
    use super::*;

    const REACH: Reach = Reach {
        link: 2.0,
        section_length: 3.0,
    };

    /// Two rows of points along a straight line, with unit spacing.
    fn band(from: [f64; 2], to: [f64; 2]) -> Vec<Damaged> {
        let way = [to[0] - from[0], to[1] - from[1]];
        let length = libm::hypot(way[0], way[1]);
        let unit = way.map(|entry| entry / length);
        let count = length.round() as usize;
        let point = |k: usize, side: f64| Damaged {
            place: [
                from[0] + unit[0] * k as f64 - 0.5 * side * unit[1],
                from[1] + unit[1] * k as f64 + 0.5 * side * unit[0],
                0.0,
            ],
            weight: 0.4,
        };
        (0..=count)
            .flat_map(|k| [point(k, -1.0), point(k, 1.0)])
            .collect()
    }

    #[test]
    fn paths_begin_also_at_exactly_a_section_length() {
        let points: Vec<Damaged> = (0..=30)
            .map(|k| Damaged {
                place: [f64::from(k), 0.0, 0.0],
                weight: 1.0,
            })
            .collect();
        for from in [15.0, 15.0 + 1e-12, 15.0 - 1e-12, 15.3] {
            let found = branches([from, 0.0, 0.0], &points, REACH);
            assert_eq!(found.len(), 2, "{from}");
            assert!((length(&found) - 30.0).abs() < 0.5, "{}", length(&found));
        }
    }

    #[test]
    fn a_straight_band_is_a_line_of_its_length() {
        let points = band([1.0, 2.0], [31.0, 42.0]);
        let found = branches([1.0, 2.0, 0.0], &points, REACH);
        assert_eq!(found.len(), 1);
        assert!((length(&found) - 50.0).abs() < 0.1, "{}", length(&found));
        for vertex in &found[0] {
            let [x, y, _] = vertex.place;
            assert!(((x - 1.0) * 0.8 - (y - 2.0) * 0.6).abs() < 1e-9);
        }
    }

    #[test]
    fn a_fork_has_two_branches_and_a_stub_has_none() {
        let mut points = band([0.0, 0.0], [20.0, 0.0]);
        points.extend(band([20.0, 0.0], [40.0, 20.0]));
        points.extend(band([20.0, 0.0], [35.0, -15.0]));
        points.extend(band([10.0, 0.0], [10.0, 2.0]));
        let found = branches([0.0; 3], &points, REACH);
        assert_eq!(found.len(), 2, "{found:?}");
        let [upper, lower] = [&found[0], &found[1]];
        assert_eq!(upper[0].along, 0.0);
        assert!(lower[0].place[1].abs() < 1e-9);
        // The lower branch starts near the fork.
        assert!((18.0..24.0).contains(&lower[0].along), "{lower:?}");
        let tip = |branch: &Branch| branch[branch.len() - 1].place;
        assert!((tip(upper)[0] - 40.0).abs() < 0.5 && (tip(upper)[1] - 20.0).abs() < 0.5);
        assert!((tip(lower)[0] - 35.0).abs() < 0.5 && (tip(lower)[1] + 15.0).abs() < 0.5);
        let expected = 20.0 + 800_f64.sqrt() + 450_f64.sqrt();
        assert!(
            (length(&found) - expected).abs() < 1.5,
            "{}",
            length(&found)
        );
    }

    #[test]
    fn from_its_middle_a_crack_runs_both_ways() {
        let points = band([0.0, 0.0], [40.0, 0.0]);
        let found = branches([20.2, 0.0, 0.0], &points, REACH);
        assert_eq!(found.len(), 2);
        assert!((length(&found) - 40.0).abs() < 0.5, "{}", length(&found));
    }

    #[test]
    fn arms_on_both_sides_of_a_hole_count() {
        let mut points = band([-2.2, 0.0], [-22.2, 0.0]);
        points.extend(band([2.2, 0.0], [12.2, 0.0]));
        // A single damaged point at the hole is no arm.
        points.push(Damaged {
            place: [0.0, 2.5, 0.0],
            weight: 0.4,
        });
        let found = branches([0.0; 3], &points, REACH);
        assert_eq!(found.len(), 2, "{found:?}");
        assert!((length(&found) - 34.4).abs() < 0.1, "{}", length(&found));
        assert!(found[0][found[0].len() - 1].place[0] < -22.0);
    }

    #[test]
    fn what_does_not_hang_together_does_not_count() {
        let mut points = band([0.0, 0.0], [10.0, 0.0]);
        points.extend(band([13.0, 0.0], [30.0, 0.0]));
        let found = branches([0.0; 3], &points, REACH);
        assert!((length(&found) - 10.0).abs() < 0.1);
        assert!(branches([0.0, 4.0, 0.0], &points, REACH).is_empty());
        assert!(branches([0.0; 3], &[], REACH).is_empty());
    }
}
