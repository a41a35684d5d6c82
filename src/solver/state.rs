//! What changes during a run.

use super::kernels::Response;
use super::model::Model;

/// The motion of the points and what acts on them.
pub struct State<const D: usize> {
    /// Displacement by component, m; owned points, then ghosts.
    pub displacement: [Vec<f64>; D],
    /// Velocity by component at full steps, m/s; owned points.
    pub velocity: [Vec<f64>; D],
    /// Force density with loads and reactions (N/m³), and energy set free; owned points.
    pub responses: Vec<Response<D>>,
}

impl<const D: usize> State<D> {
    /// Everything at rest in its reference place.
    pub fn new(model: &Model<D>) -> Self {
        Self {
            displacement: std::array::from_fn(|_| vec![0.0; model.volume.len()]),
            velocity: std::array::from_fn(|_| vec![0.0; model.owned()]),
            responses: vec![Response::default(); model.owned()],
        }
    }
}
