//! All tests but those of single files, as one program: what they call is generic, and would be
//! compiled anew for each.

mod commands;
mod communicator;
mod contact;
mod crack_branching;
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
mod plasticity;
mod readers;
mod refinement;
mod restart;
mod stable_step;
mod support;
mod survey;
mod undo;
mod waves;
