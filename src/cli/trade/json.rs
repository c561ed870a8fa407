//! Everything that was measured, for programs.

use super::{Group, Traded};
use crate::cli::report;
use crate::compare::relative::EPSILON;
use crate::measure::processor;
use crate::trade::measure::End;
use serde_json::{Value, json};

/// Everything, as numbers.
pub fn of(traded: &Traded) -> Value {
    let configuration = |number: usize| {
        let configuration = &traded.configurations[number];
        let knobs: serde_json::Map<String, Value> = traded
            .options
            .vary
            .iter()
            .zip(&configuration.values)
            .map(|(each, value)| (each.knob.name.to_owned(), value.as_str().into()))
            .collect();
        let figures = traded.figures[number];
        json!({
            "knobs": knobs,
            "options": configuration.options,
            "build_seconds": traded.build[number],
            "figures": figures,
            "bias_is_in_the_noise": figures.map(|f| f.bias_is_in_the_noise(traded.limit)),
            "place": traded.places[number],
        })
    };
    let group = |group: &Group| json!({ "name": group.name, "configurations": group.members, "slope": group.slope });
    json!({
        "comber": env!("CARGO_PKG_VERSION"),
        "command": "trade",
        "machine": { "processor": processor::name(), "processors": processor::count(), "threads": traded.plan.threads },
        "scene": report::scene_json(traded.loaded),
        "camera": traded.loaded.camera,
        "reference": { "name": traded.reference, "standard_errors": traded.known },
        "epsilon": EPSILON,
        "bias_z_limit": traded.limit,
        "ended": match traded.end { End::Finished => "finished", End::Budget => "budget", End::Stopped => "stopped" },
        "configurations": (0..traded.configurations.len()).map(configuration).collect::<Vec<_>>(),
        "groups": traded.groups.iter().map(group).collect::<Vec<_>>(),
        "notes": report::notes_json(traded.notes, traded.loaded),
    })
}
