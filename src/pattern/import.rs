//! Patterns from files: toile's own JSON, GarmentCode specifications.
