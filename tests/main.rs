//! All tests but those of single files, as one program: what they call is generic, and would be
//! compiled anew for each.

mod adaptive;
mod commands;
mod communicator;
mod contact;
mod correspondence;
mod correspondence_plastic;
mod crack_branching;
mod crack_paths;
mod decks;
mod decomposition;
mod dynamics;
mod edge_on_impact;
mod elasticity;
mod emmrich_weckner;
mod failures;
mod families;
mod fracture_energy;
mod fronts;
mod interfaces;
mod invariants;
mod laws;
mod library;
mod ordinary_history;
mod plasticity;
mod pmma;
mod readers;
mod refinement;
mod relaxation;
mod restart;
mod stable_step;
mod stages;
mod support;
mod survey;
mod undo;
mod waves;
