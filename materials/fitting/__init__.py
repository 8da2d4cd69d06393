"""Finding factor packs: tables, decompositions, joint refinement on what is seen, frames and precision by trial."""
