//! Nearly all tests are in this program. With several programs, the generic code that the tests call would be
//! compiled once per program. `tests/README.md` describes the folders.

mod support;

mod deck {
    mod decks;
    mod import;
    mod mean_spacing;
    mod meshes;
    mod messages;
    mod survey;
}

mod command {
    mod commands;
    mod compare;
    mod failures;
    mod generate;
    mod library;
    mod pictures;
    mod problems;
    mod readers;
    mod sweep;
}

mod laws {
    mod correspondence;
    mod correspondence_plastic;
    mod declarations;
    mod directional_correction;
    mod elasticity;
    mod fatigue;
    mod interfaces;
    mod invariants;
    mod johnson_cook;
    mod ordinary_history;
    mod plasticity;
    mod slender_bodies;
    mod softening;
    mod thermal;
}

mod physics {
    mod contact;
    mod dynamics;
    mod history;
    mod impact;
    mod initial_files;
    mod load_factors;
    mod newton;
    mod pressed;
    mod refinement;
    mod relaxation;
    mod stable_step;
    mod stages;
    mod tables;
    mod waves;
}

mod fracture {
    mod adaptive;
    mod crack_paths;
    mod crack_surfaces;
    mod failure_by_stress;
    mod fracture_energy;
    mod fronts;
    mod j_integral;
    mod j_integral_in_space;
    mod scatter;
    mod surfaces;
    mod toughness_by_direction;
}

mod parallel {
    mod communicator;
    mod decomposition;
    mod families;
    mod joined_steps;
}

mod restart {
    mod checkpoints;
    mod further_outputs;
    mod undo;
}

mod papers {
    mod crack_branching;
    mod edge_on_impact;
    mod emmrich_weckner;
    mod impact_decks;
    mod pmma;
    mod well_posedness;
}
