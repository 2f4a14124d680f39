//! toile
fn main() {}
