//! The project's own body: a standing person of 1.72 m, as a smooth blend of analytic shapes.
//! placeholder
