//! The report of `fissure check --json`: the figures of a deck in SI units.

use fissure::deck::Deck;
use fissure::material::Property;
use fissure::problem::{Block, Body, InterfacePair, Problem};
use fissure::solver::assign::block_laws;
use fissure::survey::{BodyFigures, Cost, DryRun, Interior, Size};
use serde_json::{Map, Value, json};

use super::check::{Request, TimeEstimate};

/// Return the figures of a dry run.
pub fn simulated(
    problem: &Problem,
    request: &Request,
    run: &DryRun,
    interiors: &[Option<Interior>],
) -> Value {
    let survey = &run.survey;
    let bodies = problem.bodies.iter().zip(&survey.bodies).zip(interiors);
    let bodies = bodies.map(|((body, figures), interior)| {
        let mut entry = described(problem, body, interior.as_ref());
        entry.append(&mut measured(problem, body, figures));
        Value::Object(entry)
    });
    let name = |body: usize| problem.bodies[body].name.as_str();
    let bonds_between_bodies = survey
        .bonds_between_bodies
        .iter()
        .map(|([a, b], bonds)| json!({ "bodies": [name(*a), name(*b)], "bonds": bonds }));
    let probes = problem.history.probes.iter().zip(&survey.probes).map(|(probe, found)| {
        let place = json!({ "point": found.id, "position": found.position, "distance": found.distance });
        (probe.name.clone(), place)
    });
    let counts = |names: Vec<&String>, counts: &[u64]| -> Map<String, Value> {
        let pairs = names.into_iter().zip(counts);
        pairs
            .map(|(name, count)| (name.clone(), json!(count)))
            .collect()
    };
    let mut report = heading(problem, request, false);
    let mut add = |name: &str, value: Value| report.insert(name.to_owned(), value);
    add("points", json!(run.points));
    add("bonds", json!(run.bonds));
    add("lattice_bonds", json!(run.lattice_bonds));
    add("bodies", bodies.collect());
    add("bonds_between_bodies", bonds_between_bodies.collect());
    let cracks = problem.cracks.iter().map(|crack| &crack.name).collect();
    add("cut_bonds", Value::Object(counts(cracks, &survey.cuts)));
    add("probes", Value::Object(probes.collect()));
    let sets = problem.sets.iter().map(|set| &set.name).collect();
    add("sets", Value::Object(counts(sets, &survey.sets)));
    report.append(&mut costs(&run.cost, request, run.ghosts));
    report.append(&mut times(problem, run.stable_step, &run.steps));
    if let Some(seconds) = &run.seconds {
        let mut add = |name: &str, value: Value| report.insert(name.to_owned(), value);
        add(
            "seconds_per_evaluation_on_one_rank",
            json!(seconds.evaluation),
        );
        add("seconds_per_row_on_one_rank", json!(seconds.row));
        add("seconds_per_output_on_one_rank", json!(seconds.outputs));
    }
    report.insert(
        "warnings".to_owned(),
        warnings(request.deck, &survey.warnings),
    );
    Value::Object(report)
}

/// Return the figures of a run that is too large for a dry run.
pub fn estimated(
    problem: &Problem,
    request: &Request,
    size: &Size,
    interiors: &[Option<Interior>],
    time: Option<&TimeEstimate>,
) -> Value {
    let bodies = problem.bodies.iter().zip(&size.points).zip(interiors);
    let bodies = bodies.map(|((body, points), interior)| {
        let mut entry = described(problem, body, interior.as_ref());
        entry.insert("points".to_owned(), json!(points));
        Value::Object(entry)
    });
    let mut report = heading(problem, request, true);
    report.insert("points".to_owned(), json!(size.all_points()));
    report.insert("bonds".to_owned(), json!(0.5 * size.directed_bonds()));
    report.insert("bodies".to_owned(), bodies.collect());
    if let Some(time) = time {
        report.append(&mut costs(&time.cost, request, 0.0));
        report.append(&mut times(problem, time.stable_step, &time.steps));
    }
    report.insert(
        "warnings".to_owned(),
        warnings(request.deck, &problem.warnings),
    );
    Value::Object(report)
}

/// Return the report on an invalid deck.
pub fn invalid(deck: &str, message: &str) -> Value {
    json!({ "deck": deck, "valid": false, "error": message })
}

fn heading(problem: &Problem, request: &Request, is_estimate: bool) -> Map<String, Value> {
    object(json!({
        "deck": request.path.to_string_lossy(),
        "valid": true,
        "title": problem.title,
        "dimension": problem.dimension.name(),
        "estimated": is_estimate,
        "ranks": request.ranks,
    }))
}

/// Return the name, the material, the horizon and the law of a body, and the computed properties of the
/// interior of the body.
fn described(problem: &Problem, body: &Body, interior: Option<&Interior>) -> Map<String, Value> {
    let elastic = body.material.elastic;
    let laws = block_laws(problem, &Block::unrefined(body));
    let law: Map<String, Value> = laws
        .law
        .described()
        .into_iter()
        .map(|(name, property)| {
            let value = match property {
                Property::Number(value, _) => json!(value),
                Property::Text(words) => json!(words),
            };
            (name.replace([' ', '-'], "_"), value)
        })
        .collect();
    let mut entry = object(json!({
        "name": body.name,
        "material": body.material_name,
        "density": body.material.density,
        "youngs_modulus": elastic.youngs_modulus,
        "poisson_ratio": elastic.poisson_ratio,
        "horizon": body.horizon,
        "law": law,
    }));
    if let Some(interior) = interior {
        let [bulk, shear] = interior.exact;
        entry.append(&mut object(json!({
            "neighbours_inside": interior.neighbours,
            "expansion_modulus_inside": interior.bulk,
            "expansion_modulus": bulk,
        })));
        if let Some([axes, diagonals]) = interior.shear {
            entry.append(&mut object(json!({
                "shear_modulus_inside": { "axes": axes, "diagonals": diagonals },
                "shear_modulus": shear,
            })));
        }
    }
    entry
}

/// Return the JSON entries with the figures of a body, and the entry that says whether its bonds can break.
fn measured(problem: &Problem, body: &Body, figures: &BodyFigures) -> Map<String, Value> {
    let mut entry = object(json!({
        "points": figures.points,
        "volume": figures.volume,
        "mass": figures.mass,
        "centre": figures.centre,
    }));
    match figures.shape_volume {
        Some(volume) => entry.insert("shape_volume".to_owned(), json!(volume)),
        None => {
            let mean = figures.mean_spacing(problem.dimension);
            entry.insert("mean_spacing".to_owned(), json!(mean));
            entry.insert("distance_of_points".to_owned(), json!(figures.spacing))
        }
    };
    if let Some([least, median, most]) = figures.neighbours {
        let range = json!({ "least": least, "median": median, "most": most });
        entry.insert("neighbours".to_owned(), range);
    }
    // Bonds to other bodies can break by the damage law of the pair of bodies.
    let pairs = &problem.interface.pairs;
    let has_own = |pair: &InterfacePair| pair.damage.own().is_some();
    let has_pair = |pair: &InterfacePair| has_own(pair) && pair.bodies.contains(&body.name);
    let damage = body.can_break() || pairs.iter().any(has_pair);
    entry.insert("has_damage".to_owned(), json!(damage));
    entry
}

fn costs(cost: &Cost, request: &Request, ghosts: f64) -> Map<String, Value> {
    let (main, further) = (cost.results.first(), cost.results.iter().skip(1));
    let further = further.map(|result| {
        let figures = json!({ "outputs": result.outputs, "result_bytes": result.bytes });
        (result.name.clone().unwrap_or_default(), figures)
    });
    object(json!({
        "memory_of_each_rank_bytes": cost.memory_of_a_rank(request.ranks, ghosts),
        "outputs": main.map(|result| result.outputs),
        "result_bytes": main.map(|result| result.bytes),
        "further_outputs": further.collect::<Map<String, Value>>(),
        "all_results_bytes": cost.all_results(),
        "checkpoint_bytes": cost.checkpoint,
    }))
}

fn times(problem: &Problem, stable_step: f64, steps: &[(f64, f64)]) -> Map<String, Value> {
    let stages = problem.all_stages();
    let stages = stages.iter().zip(steps).map(|(stage, (step, steps))| {
        if stage.time.is_quasi_static() {
            json!({ "load_steps": steps })
        } else {
            json!({ "steps": steps, "step": step })
        }
    });
    object(json!({
        "end": problem.time.end,
        "stable_step": stable_step,
        "stages": stages.collect::<Vec<_>>(),
    }))
}

fn warnings(deck: &Deck, warnings: &[fissure::error::Warning]) -> Value {
    let text =
        |warning: &fissure::error::Warning| json!(deck.locate_warning(warning.clone()).message);
    warnings.iter().map(text).collect()
}

/// Return the entries of `value`. If `value` is not a JSON object, return no entries.
fn object(value: Value) -> Map<String, Value> {
    match value {
        Value::Object(entries) => entries,
        _ => Map::new(),
    }
}
