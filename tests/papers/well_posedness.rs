//! Theorems of Emmrich & Weckner 2006 (sections 2 and 3) about the linear equation of motion, checked for the
//! discretized equation. They are the energy inequality, the a priori estimate of the displacement (theorem
//! 3.2), and the bound on the effect of a perturbed kernel (theorem 3.3). One half of the plate has Gauss
//! points and the other half has midpoints, the two quadratures of section 4.

use crate::support::history::row;
use crate::support::simulate;
use fissure::solver::Simulation;
use fissure::solver::observers::HistoryObserver;

const DENSITY: f64 = 2.0;
const HORIZON: f64 = 3.0;
const END: f64 = 2.0;
const STEPS: usize = 400;

/// Return the deck of a plate of 8 × 4 cells. `lambda` is the kernel function λ of the bond length r, and
/// `damping` the rate of the damping (1/s). The body force along x is `push` sin(2t) (N/m³). The initial
/// displacements and velocities vary by 30 % around a uniform value.
fn deck(lambda: &str, damping: f64, push: f64) -> String {
    let step = END / STEPS as f64;
    format!(
        "dimension = 'plane-strain'
        [grid]
        spacing = 1
        horizon = {HORIZON}
        volume_correction = 'none'
        [material.plate.linear_microelastic]
        density = {DENSITY}
        youngs_modulus = 1
        damping = {damping}
        lambda = '{lambda}'
        [body.midpoints]
        material = 'plate'
        shape.box = {{ lower = [0, 0], upper = [4, 4] }}
        [body.gauss_points]
        material = 'plate'
        quadrature = 'gauss'
        shape.box = {{ lower = [4, 0], upper = [8, 4] }}
        [initial.start]
        displacement = ['1e-3*(1 + 0.3*sin(2*x + y))', '-1e-3*(1 + 0.3*cos(x - 3*y))']
        velocity = ['1e-3*(1 - 0.3*cos(3*x*y))', '1e-3*(1 + 0.3*sin(x*x))']
        [condition.push]
        set = 'all'
        body_force = ['{push}*sin(2*t)', 0]
        [time]
        end = {END}
        step = {step}
        "
    )
}

/// Return the L² norm of a vector field: √(∫ |v|² dV).
fn norm(simulation: &Simulation<2>, values: &[Vec<f64>; 2]) -> f64 {
    let volume = &simulation.model.volume;
    let points = 0..simulation.model.owned();
    let sum: f64 = points
        .map(|k| volume[k] * (values[0][k].powi(2) + values[1][k].powi(2)))
        .sum();
    sum.sqrt()
}

/// Return the displacements at the start and after each step.
fn displacements(lambda: &str, damping: f64, push: f64) -> Vec<[Vec<f64>; 2]> {
    simulate::<2, _>(&deck(lambda, damping, push), |mut simulation| {
        let mut all = vec![simulation.fields.displacement.clone()];
        while !simulation.is_over() {
            simulation.advance();
            all.push(simulation.fields.displacement.clone());
        }
        all
    })
}

/// Return the upper bound κ + κ₀ of the L² norm of the operator v ↦ ∫ K (v' − v) dV', with K = λ ξ⊗ξ/ρ. The
/// bound is that of proposition 3.1 with p = q = 2.
fn bound(simulation: &Simulation<2>, lambda: impl Fn(f64) -> f64) -> f64 {
    let model = &simulation.model;
    let (mut kappa, mut kappa_0) = (0.0, 0.0_f64);
    for i in 0..model.owned() {
        // Entries xx, xy and yy of K₀ = ∫ K dV' at point i.
        let mut sum = [0.0; 3];
        for j in (0..model.owned()).filter(|j| *j != i) {
            let [here, there] = [i, j].map(|k| model.position(k));
            let [x, y] = [there[0] - here[0], there[1] - here[1]];
            let length = x.hypot(y);
            if length > HORIZON * (1.0 + 1e-9) {
                continue;
            }
            let kernel = lambda(length) / DENSITY;
            kappa += model.volume[i] * model.volume[j] * (kernel * length * length).powi(2);
            for (sum, entry) in sum.iter_mut().zip([x * x, x * y, y * y]) {
                *sum += model.volume[j] * kernel * entry;
            }
        }
        let mean = 0.5 * (sum[0] + sum[2]);
        kappa_0 = kappa_0.max(mean + (0.5 * (sum[0] - sum[2])).hypot(sum[1]));
    }
    kappa.sqrt() + kappa_0
}

/// Compute ∫ e^{−r(t−s)/2} sinh((t − s) w)/w f(s) ds from 0 to t by the trapezoidal rule. Here t is the end
/// of step `count`, and r is `damping`. `values` returns f at a step.
fn response(count: usize, damping: f64, w: f64, values: impl Fn(usize) -> f64) -> f64 {
    let step = END / STEPS as f64;
    let at = |k: usize| {
        let since = (count - k) as f64 * step;
        (-0.5 * damping * since).exp() * (since * w).sinh() / w * values(k)
    };
    let inner: f64 = (1..count).map(at).sum();
    step * (inner + 0.5 * (at(0) + at(count)))
}

#[test]
fn the_a_priori_estimate_holds() {
    // The plate is so soft that it mainly translates. The norm of the displacement is then close to the
    // estimate.
    let (damping, push) = (0.6, 2e-3);
    let lambda = |length: f64| 2e-3 / length.powi(3);
    let text = "2e-3/r^3";
    let [alpha, start, motion, area] = simulate::<2, _>(&deck(text, damping, push), |simulation| {
        let volume: f64 = simulation.model.volume.iter().sum();
        [
            bound(&simulation, lambda),
            norm(&simulation, &simulation.fields.displacement),
            norm(&simulation, &simulation.fields.velocity),
            volume,
        ]
    });
    let w = (alpha + 0.25 * damping * damping).sqrt();
    let all = displacements(text, damping, push);
    simulate::<2, _>(&deck(text, damping, push), |simulation| {
        for (count, displacement) in all.iter().enumerate().skip(1) {
            let time = END * count as f64 / STEPS as f64;
            let decay = (-0.5 * damping * time).exp();
            let of_start = decay * (time * w).cosh() * start;
            let of_motion = decay * (time * w).sinh() / w * motion;
            let force = |k: usize| {
                let time = END * k as f64 / STEPS as f64;
                push / DENSITY * (2.0 * time).sin().abs() * area.sqrt()
            };
            let estimate = of_start + of_motion + response(count, damping, w, force);
            let found = norm(&simulation, displacement);
            assert!(found <= estimate, "{found} {estimate} at {time}");
            assert!(found > 0.4 * estimate, "{found} {estimate} at {time}");
        }
    });
}

#[test]
fn a_perturbed_kernel_changes_the_motion_as_much_as_allowed() {
    let damping = 0.6;
    let [kernel, perturbed] = ["2e-2/r^3", "2e-2/r^3*(1 + 0.1*cos(r))"];
    let lambda = |length: f64| 2e-2 / length.powi(3);
    let difference = |length: f64| 0.1 * length.cos() * lambda(length);
    let [first, second] = [kernel, perturbed].map(|text| displacements(text, damping, 0.0));
    simulate::<2, _>(&deck(kernel, damping, 0.0), |simulation| {
        let alpha = bound(&simulation, lambda);
        let epsilon = bound(&simulation, difference);
        assert!(epsilon < 0.2 * alpha);
        let w = (alpha + 0.25 * damping * damping + epsilon).sqrt();
        let norms: Vec<f64> = first.iter().map(|u| norm(&simulation, u)).collect();
        for count in (20..=STEPS).step_by(20) {
            let [u, v] = [&first[count], &second[count]];
            let apart: [Vec<f64>; 2] = std::array::from_fn(|d| {
                let pairs = u[d].iter().zip(&v[d]);
                pairs.map(|(a, b)| a - b).collect()
            });
            let found = norm(&simulation, &apart);
            let estimate = epsilon * response(count, damping, w, |k| norms[k]);
            assert!(found <= estimate, "{found} {estimate} after {count}");
            assert!(found > 0.01 * estimate, "{found} {estimate} after {count}");
        }
    });
}

#[test]
fn the_energy_inequality_holds() {
    // The inequality after eq. 8 of the paper, for a force that varies in time. It holds for every value of
    // its parameter ν > 0, which is not Poisson's ratio.
    let push = 2e-3;
    simulate::<2, _>(&deck("2e-2/r^3", 0.0, push), |mut simulation| {
        let mut observer = HistoryObserver::new(&simulation).unwrap();
        let area: f64 = simulation.model.volume.iter().sum();
        let mut energies = vec![row(&mut observer, &mut simulation).energies];
        while !simulation.is_over() {
            simulation.advance();
            energies.push(row(&mut observer, &mut simulation).energies);
        }
        let step = END / STEPS as f64;
        let start = energies[0].kinetic + energies[0].strain;
        for nu in [0.3, 1.0, 3.0] {
            let mut closest = 0.0_f64;
            for count in 1..=STEPS {
                let time = step * count as f64;
                let integral = |values: &dyn Fn(usize) -> f64| {
                    let at = |k: usize| (nu * step * (count - k) as f64).exp() * values(k);
                    let inner: f64 = (1..count).map(at).sum();
                    step * (inner + 0.5 * (at(0) + at(count)))
                };
                let elastic = integral(&|k| energies[k].strain);
                let force =
                    integral(&|k| (push * (2.0 * step * k as f64).sin()).powi(2) * area / DENSITY);
                let now = energies[count].kinetic + energies[count].strain;
                let [left, right] = [
                    now + nu * elastic,
                    (nu * time).exp() * start + 0.5 / nu * force,
                ];
                assert!(left <= right, "{left} {right} at {time}, ν = {nu}");
                closest = closest.max(left / right);
            }
            assert!(closest > 0.9, "{closest}, ν = {nu}");
        }
    });
}
