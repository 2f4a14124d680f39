//! Flat patterns to files: toile's own JSON, SVG.
